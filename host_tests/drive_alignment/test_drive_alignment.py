"""Tests alignment by driving on simulated drives, on CPython and MicroPython: results and refusals."""

import numpy as np
import pytest
from kickstand.drive_alignment import alignment, quality, speed_check, verdict
from kickstand_tools.signals import rotation_vector
from support import driving_runs, engines
from support.driving_runs import STAND, around
from support.engines import ENGINES, run

MOUNT = [0.48, 0.36, 0.8, -0.6, 0.8, 0.0, -0.64, -0.48, 0.6]  # no axis of the sensor is near an axis of the vehicle
PLAIN = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]


def errors(result, mount):
    """Return the yaw error and total error of the matrix in degrees."""
    between = np.reshape(result["matrix"], (3, 3)) @ np.reshape(mount, (3, 3)).T
    yaw = np.degrees(np.arctan2(between[2, 0] - between[0, 2], between[0, 0] + between[2, 2]))
    return yaw, np.degrees(np.arccos(np.clip((np.trace(between) - 1) / 2, -1, 1)))


def drive(legs, mount=MOUNT, **options):
    """Run driving_runs.drive on CPython."""
    return driving_runs.drive(legs, mount, options)


def turned(m, axis, degrees):
    """Return the mount m rotated about the vehicle's axis 0 (left), 1 (up) or 2 (forward)."""
    angle = np.radians(degrees)
    r = np.eye(3)
    i, j = [k for k in range(3) if k != axis]
    r[i, i] = r[j, j] = np.cos(angle)
    r[i, j], r[j, i] = -np.sin(angle), np.sin(angle)
    return (r @ np.reshape(m, (3, 3))).ravel().tolist()


@pytest.mark.parametrize("engine", [*ENGINES, "published"])
def test_a_car_is_aligned(engine):
    """The published method runs only on CPython."""
    options = {"method": "published"} if engine == "published" else {}
    calls = [("drive", (around(), MOUNT, options | {"gyro_bias": [6.0, -5.0, 1.0]}))]
    [result] = run("cpython" if options else engine, calls)
    assert result["ready"], result
    assert max(map(abs, errors(result, MOUNT))) < 0.3
    assert result["bias"] == pytest.approx([6.0, -5.0, 1.0], abs=0.05)


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("known", [True, False])
def test_a_motorcycle_is_aligned(engine, known):
    """The alignment works with and without the vertical of the upright pose. The motorcycle moves from the start,
    because its alignment needs no stop."""
    options = {"vehicle": "motorcycle", "up": MOUNT[3:6] if known else None, "bias": [0.0, 0.0, 0.0]}
    options["samples"] = {"start_mps": 5.0}
    [result] = run(engine, [("drive", (around(stands=False), MOUNT, options))])
    assert result["ready"], result
    assert max(map(abs, errors(result, MOUNT))) < 0.5
    assert result["stops"] == 0


@pytest.mark.parametrize("method", ["improved", "published"])
def test_the_result_turns_with_the_sensor(method):
    """If the sensor is rotated, the result changes by exactly this rotation, within 0.05 degrees. The mounts are along
    the axes, some of them exactly opposite to the vehicle's axes."""
    legs = around(5, pause_s=2.0)
    plain = np.reshape(drive(legs, PLAIN, method=method)["matrix"], (3, 3))
    for order, signs in (
        ((0, 1, 2), (1, -1, -1)),
        ((0, 1, 2), (-1, -1, 1)),
        ((1, 2, 0), (1, 1, 1)),
        ((1, 0, 2), (1, 1, -1)),
    ):
        q = np.zeros((3, 3))
        q[range(3), order] = signs
        # The noise is the same in the vehicle's axes, so each sample is PLAIN's sample multiplied by q.
        result = drive(legs, q.T.ravel().tolist(), method=method)
        between = np.reshape(result["matrix"], (3, 3)) @ q @ plain.T
        assert np.degrees(np.linalg.norm(rotation_vector(between))) < 0.05


@pytest.mark.parametrize(("method", "yaw_deg"), [("improved", 0.0), ("published", 10.0)])
def test_camber_at_the_stops_does_not_reach_forward(method, yaw_deg):
    """The road's camber at the stops is 2 degrees, so the levelled force has an error of sin 2 degrees = 0.035 g to the
    side. Together with a braking force of 0.2 g, this side force gives the published method a yaw error of 10
    degrees."""
    yaw, total = errors(drive(around(8), samples={"tilt_deg": 2.0}, method=method), MOUNT)
    assert abs(yaw) == pytest.approx(yaw_deg, abs=1.0)
    assert total < max(2.3, 1.1 * abs(yaw))


def test_it_reports_the_missing_step():
    """The alignment waits first for a speed, then for a stop, then for a braking event. During a braking event the
    alignment reports whether the vehicle brakes straight. At the end it reports that the result is ready."""
    legs = [[2.0, 1.0, 0.0], [2.0, -1.0, 0.0], *around(2), [8.0, 1.5, 0.0], [4.0, -2.0, 15.0], *around(6, stands=False)]
    states = drive(legs)["states"]
    assert alignment.DriveAlignment("car").state == alignment.WAITING_FOR_SPEED
    assert states[0] == alignment.WAITING_FOR_STOP
    assert states[1] == alignment.WAITING_FOR_BRAKING
    assert {alignment.BRAKING, alignment.TURNING, alignment.READY} <= set(states)
    assert alignment.REFUSED not in states


@pytest.mark.parametrize("engine", ENGINES)
def test_refusals_name_the_reason(engine):
    """Every refusal has two lines that fit the display."""
    eight = [list(STAND), [6.0, 1.0, 0.0], *[[10.0, 0.1, 30.0], [8.0, -0.6, -40.0], [2.0, -1.2, -40.0]] * 6]
    cases = {
        "it only stood still": ([[120.0, 0.0, 0.0]], {}),
        "it never stood still": (around(stands=False), {"samples": {"start_mps": 5.0}}),
        "no speed": (around(), {"source": {"silent": (-1.0, 1e9)}}),
        "braking events in a straight line": (eight, {}),
        "it must not be negative": (around(), {"source": {"scale": -1.0}}),
        "the speed is stuck at": (around(7), {"source": {"stuck_from_s": 20.0}}),
        "it is in km/h": (around(), {"source": {"scale": 3.6}}),
        "it is in mph or knots": (around(), {"source": {"scale": 2.237}}),
        "2.5 s late": (around(), {"source": {"late_s": 2.5}}),
        "the mount has moved": (around(8), {"moved": [55.0, turned(MOUNT, 1, 90.0)]}),
        "standing": (around(6), {"moved": [5.8, turned(MOUNT, 0, 12.0)]}),
    }
    results = run(engine, [("drive", (legs, MOUNT, options)) for legs, options in cases.values()])
    for words, result in zip(cases, results, strict=True):
        assert not result["ready"], words
        assert words in engines.words(result), engines.words(result)
        assert all(len(line) <= 16 for line in result["lcd"])
        assert "matrix" not in result


@pytest.mark.parametrize(
    ("source", "fine"),
    [
        ({"every_s": 1.0, "step": 1 / 3.6}, True),
        ({"late_s": 0.9 * speed_check.MAX_LAG_S}, True),
        ({"late_s": 1.1 * speed_check.MAX_LAG_S}, False),
        ({"scale": 1.1 / speed_check.MIN_FORCE_RATIO}, False),
        ({"scale": 0.9 / speed_check.MAX_FORCE_RATIO}, False),
    ],
)
def test_only_usable_speeds_align(source, fine):
    result = drive(around(8), source=source)
    assert result["ready"] is fine, result.get("refused")
    if fine:
        assert abs(errors(result, MOUNT)[0]) < 0.5
        assert result["lag"] == pytest.approx(source.get("late_s", 0.0), abs=0.3)


@pytest.mark.parametrize(
    ("axis", "degrees", "from_s", "words"),
    [
        (1, 180.0, 130.0, "no longer where it was"),  # the rotation is followed by only one braking event
        (1, 12.0, 100.0, "two parts of the drive"),
        (0, 1.3 * quality.PITCH_DEG, 82.0, "vertical"),
        (2, 1.3 * quality.ROLL_DEG, 82.0, "vertical"),
        (0, 0.9 * quality.PITCH_DEG, 82.0, None),
        (2, 0.9 * quality.ROLL_DEG, 82.0, None),
    ],
)
def test_a_mount_that_moved(axis, degrees, from_s, words):
    """The sensor is rotated by these degrees at the time from_s. The drive has ten braking events in a straight line;
    the last begins at 137 s."""
    legs = [*around(10), [4.0, 1.5, 20.0], [4.0, -1.5, 20.0]]  # events in bends at the end do not hide the move
    result = drive(legs, moved=[from_s, turned(MOUNT, axis, degrees)])
    assert result["ready"] is (words is None), result
    assert words is None or words in engines.words(result)


@pytest.mark.parametrize("silent_s", [200.0, 500.0])
def test_the_first_braking_counts_after_any_late_first_speed(silent_s):
    """The first speed comes after 200 or 500 s. The history's time counter wraps around every nine minutes, and the
    wrap must not lose a braking event."""
    legs = [[silent_s, 0.0, 0.0], *around(6)]
    result = drive(legs, source={"every_s": 1.0, "silent": (-1.0, silent_s)})
    assert result["counted"] == 6  # the six braking events; the vehicle speeds up only in bends
    assert result["ready"]


@pytest.mark.parametrize("engine", ENGINES)
def test_a_silent_source_at_zero_is_no_standstill(engine):
    """The receiver fails during a stop, so the last speed is zero. After the stop the vehicle drives off into a long
    curve, where the force is as steady as at a stop."""
    before = [*around(7), [8.0, -1.0, 0.0], STAND]
    legs = [*before, [4.0, 4.0, 0.0], [30.0, 0.0, 9.0]]
    seconds = sum(leg[0] for leg in before)
    options = {"source": {"silent": (seconds - 3.0, 1e9)}}
    [result] = run(engine, [("drive", (legs, MOUNT, options))])
    assert result["ready"], result
    assert max(map(abs, errors(result, MOUNT))) < 0.5


def test_a_silent_source_is_not_a_stuck_one():
    """The vehicle drives in stop-and-go traffic through a straight tunnel. The receiver gives a speed only before and
    after the tunnel."""
    tunnel = [[seconds, acceleration, 0.0] for seconds, acceleration, _ in around(6, pause_s=3.0, stands=False)]
    before = around(3)
    begin = sum(leg[0] for leg in before)
    silent = (begin, begin + sum(leg[0] for leg in tunnel))
    result = drive([*before, *tunnel, *around(4)], source={"every_s": 1.0, "silent": silent})
    assert alignment.REFUSED not in result["states"]
    assert result["ready"], result


def test_nothing_is_joined_across_missing_samples():
    """Samples are missing for 1.5 s in every 25 s, and the vehicle is still aligned."""
    drive = alignment.DriveAlignment("car")
    source = driving_runs.SpeedSource()
    gap = 0
    for k, (force, rate, speed) in enumerate(driving_runs.samples(around(8))):
        value = source.step_to(speed)
        if 100 < k % 2500 < 250:
            gap += 10_000
            continue
        drive.update(force, rate, 10_000 + gap)
        gap = 0
        if value is not None:
            drive.measure_speed(value)
    assert drive.ready
    forward = drive.quality.fit.forward
    assert np.degrees(np.arctan2(forward[0], forward[2])) == pytest.approx(0.0, abs=0.3)


@pytest.mark.parametrize(
    ("against", "brakings", "verdict"),
    [
        (PLAIN, 6, verdict.SAME),
        (turned(PLAIN, 1, 11.4), 6, verdict.REFINED),
        (turned(PLAIN, 1, 168.0), 6, verdict.REVERSED),
        (turned(PLAIN, 1, 60.0), 6, verdict.MOVED),
        (turned(PLAIN, 2, 10.0), 6, verdict.MOVED),
        (PLAIN, 1, verdict.UNKNOWN),
        (turned(PLAIN, 1, 11.4), 2, verdict.UNKNOWN),
    ],
)
def test_an_alignment_is_compared_with_driving(against, brakings, verdict):
    """A change of pitch by 2 degrees between two poses 10 degrees apart causes a yaw error of 11.4 degrees. The cases
    use a yaw error of 11.4 degrees."""
    up = against[3:6] if against[3:6] == PLAIN[3:6] else PLAIN[3:6]
    options = {"vehicle": "motorcycle", "up": up, "bias": [0.0, 0.0, 0.0], "against": against}
    assert drive(around(brakings), PLAIN, **options)["compare"] == verdict
