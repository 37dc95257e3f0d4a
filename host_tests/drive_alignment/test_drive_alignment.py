"""Alignment by driving on simulated drives, on CPython and MicroPython: results, states, verdicts and refusals."""

import functools
import json

import numpy as np
import pytest
from kickstand.drive_alignment import alignment
from kickstand.drive_alignment.quality import PITCH_DEG, ROLL_DEG
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
    return _drive(json.dumps((legs, mount, options)))


@functools.cache
def _drive(arguments):
    return driving_runs.drive(*json.loads(arguments))


def turned(m, axis, degrees):
    """Return the mount m rotated about the vehicle's axis 0 (left), 1 (up) or 2 (forward)."""
    angle = np.radians(degrees)
    r = np.eye(3)
    i, j = [k for k in range(3) if k != axis]
    r[i, i] = r[j, j] = np.cos(angle)
    r[i, j], r[j, i] = -np.sin(angle), np.sin(angle)
    return (r @ np.reshape(m, (3, 3))).ravel().tolist()


BEFORE_SILENCE = [*around(7), [8.0, -1.0, 0.0], STAND]
SILENT_S = sum(leg[0] for leg in BEFORE_SILENCE) - 3.0
ALIGNED = {
    "car": (around(), {"gyro_bias": [6.0, -5.0, 1.0]}),
    # A motorcycle's alignment needs no stop. It works with and without the vertical of the upright pose.
    "posed motorcycle": (
        around(stands=False),
        {"vehicle": "motorcycle", "up": MOUNT[3:6], "bias": [0.0] * 3, "samples": {"start_mps": 5.0}},
    ),
    "motorcycle": (
        around(stands=False),
        {"vehicle": "motorcycle", "bias": [0.0] * 3, "samples": {"start_mps": 5.0}},
    ),
    # The receiver fails during a stop, so the last speed is zero. Then the vehicle drives off into a long curve, where
    # the force is as steady as at a stop.
    "silent source": (
        [*BEFORE_SILENCE, [4.0, 4.0, 0.0], [30.0, 0.0, 9.0]],
        {"source": {"silent": (SILENT_S, 1e9)}},
    ),
}


@pytest.mark.parametrize("engine", ENGINES)
def test_vehicles_are_aligned(engine):
    results = run(engine, [("drive", (legs, MOUNT, options)) for legs, options in ALIGNED.values()])
    for (name, (_, options)), result in zip(ALIGNED.items(), results, strict=True):
        assert result["ready"], (name, result)
        assert max(map(abs, errors(result, MOUNT))) < 0.5, name
        assert result["bias"] == pytest.approx(options.get("gyro_bias", [0.0] * 3), abs=0.05)
        assert (result["stops"] == 0) == ("motorcycle" in name)


EIGHT = [list(STAND), [6.0, 1.0, 0.0], *[[10.0, 0.1, 30.0], [8.0, -0.6, -40.0], [2.0, -1.2, -40.0]] * 6]
TWO_STOPS = [*around(1), [8.0, -1.0, 0.0], [2.0, -1.0, 0.0], STAND]
REFUSED = {
    "it only stood still": ([[60.0, 0.0, 0.0]], {}),
    "it never stood still": (around(3, stands=False), {"samples": {"start_mps": 5.0}}),
    "no speed": (around(1), {"source": {"silent": (-1.0, 1e9)}}),
    "braking events in a straight line": (EIGHT, {}),
    "it must not be negative": (around(1), {"source": {"scale": -1.0}}),
    "the speed is stuck at": (around(7), {"source": {"stuck_from_s": 20.0}}),
    "it is in km/h": (around(), {"source": {"scale": 3.6}}),
    "it is in mph or knots": (around(), {"source": {"scale": 2.237}}),
    "2.5 s late": (around(), {"source": {"late_s": 2.5}}),
    "the mount has moved": (around(8), {"moved": [55.0, turned(MOUNT, 1, 90.0)]}),
    "standing": (around(6), {"moved": [5.8, turned(MOUNT, 0, 12.0)]}),
    "two stops differ by over 8 degrees": (TWO_STOPS, {"moved": [30.0, turned(MOUNT, 0, 9.0)]}),
}


@pytest.mark.parametrize(
    "engine", [ENGINES[0], pytest.param("micropython", marks=[*ENGINES[1].marks, pytest.mark.long])]
)
def test_refusals_name_the_reason(engine):
    """Every refusal has two lines that fit the display."""
    results = run(engine, [("drive", (legs, MOUNT, options)) for legs, options in REFUSED.values()])
    for words, result in zip(REFUSED, results, strict=True):
        assert not result["ready"] and "matrix" not in result, words
        assert words in engines.words(result), engines.words(result)
        assert all(len(line) <= 16 for line in result["lcd"])


@pytest.mark.parametrize(
    ("order", "signs"), [((0, 1, 2), (1, -1, -1)), ((0, 1, 2), (-1, -1, 1)), ((1, 0, 2), (1, 1, -1))]
)
@pytest.mark.parametrize("method", ["improved", "published"])
def test_the_result_turns_with_the_sensor(method, order, signs):
    """The noise is the same in the vehicle's axes. The mounts are along the axes, some of them exactly opposite."""
    legs, q = around(5, pause_s=2.0), np.zeros((3, 3))
    q[range(3), order] = signs
    plain, other = (
        np.reshape(drive(legs, mount, method=method)["matrix"], (3, 3)) for mount in (PLAIN, q.T.ravel().tolist())
    )
    assert np.degrees(np.linalg.norm(rotation_vector(other @ q @ plain.T))) < 0.05


@pytest.mark.parametrize(("method", "yaw_deg"), [("improved", 0.0), ("published", 10.0)])
def test_camber_at_the_stops_does_not_reach_forward(method, yaw_deg):
    """The road's camber at the stops is 2 degrees, so the levelled force has an error of sin 2 degrees = 0.035 g to the
    side. Together with a braking force of 0.2 g, this side force gives the published method a yaw error of 10
    degrees."""
    yaw, total = errors(drive(around(8), samples={"tilt_deg": 2.0}, method=method), MOUNT)
    assert abs(yaw) == pytest.approx(yaw_deg, abs=1.0)
    assert total < max(2.3, 1.1 * abs(yaw))


@pytest.mark.parametrize("source", [{"every_s": 1.0, "step": 1 / 3.6}, {"late_s": 1.7}, {"scale": 1.25}])
def test_a_coarse_or_late_speed_aligns(source):
    result = drive(around(), source=source)
    assert result["ready"] and abs(errors(result, MOUNT)[0]) < 0.5
    assert result["lag"] == pytest.approx(source.get("late_s", 0.0), abs=0.15)


@pytest.mark.parametrize(
    ("axis", "degrees", "from_s", "words"),
    [
        (1, 180.0, 130.0, "no longer where it was"),  # the rotation is followed by only one braking event
        (1, 12.0, 100.0, "two parts of the drive"),
        (0, 1.3 * PITCH_DEG, 82.0, "vertical"),
        (2, 1.3 * ROLL_DEG, 82.0, "vertical"),
        (0, 0.9 * PITCH_DEG, 82.0, None),
        (2, 0.9 * ROLL_DEG, 82.0, None),
    ],
)
def test_a_mount_that_moved(axis, degrees, from_s, words):
    """The drive has ten braking events in a straight line; the last begins at 137 s. Events in bends at the end do not
    hide the move."""
    legs = [*around(10), [4.0, 1.5, 20.0], [4.0, -1.5, 20.0]]
    result = drive(legs, moved=[from_s, turned(MOUNT, axis, degrees)])
    assert result["ready"] is (words is None), result
    assert words is None or words in engines.words(result)


def fed(vehicle, brakings, lost=range(0)):
    """Pass a drive to an alignment whose sensor is mounted as PLAIN. lost: samples that are missing in each 25 s."""
    source, gap_us = driving_runs.SpeedSource(), 0
    for k, (force, rate, speed) in enumerate(driving_runs.samples(around(brakings), "motorcycle")):
        value = source.step_to(speed)
        if k % 2500 in lost:
            gap_us += 10_000
            continue
        vehicle.update(force, rate, 10_000 + gap_us)
        gap_us = 0
        if value is not None:
            vehicle.measure_speed(value)
    vehicle.finish()
    return vehicle


def test_nothing_is_joined_across_missing_samples():
    """Samples are missing for 1.5 s in every 25 s, and the vehicle is still aligned."""
    bike = fed(alignment.DriveAlignment("motorcycle", PLAIN[3:6], [0.0] * 3), 8, range(101, 250))
    assert bike.ready
    forward = bike.quality.fit.forward
    assert np.degrees(np.arctan2(forward[0], forward[2])) == pytest.approx(0.0, abs=0.3)


@functools.cache
def straight_drive(brakings):
    return fed(alignment.DriveAlignment("motorcycle", PLAIN[3:6], [0.0] * 3), brakings)


@pytest.mark.parametrize(("brakings", "state"), [(4, alignment.WAITING_FOR_BRAKING), (5, alignment.READY)])
def test_a_drive_is_ready_after_five_brakings(brakings, state):
    bike = straight_drive(brakings)
    assert bike.ready == (state == alignment.READY) and bike.state == state


@pytest.mark.parametrize(
    ("yaw_deg", "up_deg", "brakings", "expected"),
    [
        (0.0, 0.0, 6, alignment.SAME),
        (-0.7, 0.0, 6, alignment.SAME),
        (1.8, 0.0, 6, alignment.REFINED),
        (-11.4, 0.0, 6, alignment.REFINED),  # 2 degrees of pitch between two poses that are 10 degrees apart
        (29.5, 0.0, 6, alignment.REFINED),
        (30.5, 0.0, 6, alignment.MOVED),
        (134.5, 0.0, 6, alignment.MOVED),
        (-135.5, 0.0, 6, alignment.REVERSED),
        (180.0, 0.0, 2, alignment.REVERSED),
        (180.0, 0.0, 1, alignment.UNKNOWN),
        (11.4, 0.0, 2, alignment.UNKNOWN),
        (0.0, 7.8, 6, alignment.SAME),
        (0.0, -8.2, 6, alignment.MOVED),
        (0.0, 8.2, 4, alignment.UNKNOWN),
    ],
)
def test_an_alignment_is_compared_with_driving(yaw_deg, up_deg, brakings, expected):
    earlier = turned(turned(PLAIN, 1, yaw_deg), 2, up_deg)
    bike = straight_drive(brakings)
    assert alignment.compare(bike, earlier) == expected
    if up_deg == 0.0:
        off = alignment.yaw_deg(bike.quality.fit, earlier) + yaw_deg
        assert (off + 180.0) % 360.0 - 180.0 == pytest.approx(0.0, abs=0.5)


def test_turning_round_reverses_left_and_forward():
    matrix = [float(k) for k in range(1, 10)]
    alignment.turn_round(matrix)
    assert matrix == [-1.0, -2.0, -3.0, 4.0, 5.0, 6.0, -7.0, -8.0, -9.0]
