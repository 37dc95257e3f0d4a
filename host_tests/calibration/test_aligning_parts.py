"""The parts of a calibration from recordings: limits of its file, poses, the procedure, and the events of a drive."""

import io
import json
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from kickstand.drive_alignment.alignment import CAR, MOTORCYCLE
from kickstand.errors import AlignmentError
from kickstand_tools.calibration import drive, drive_events, drive_feed, file, poses, procedure
from kickstand_tools.calibration.drive_events import DriveWatch
from kickstand_tools.calibration.file import CalibrationFile, read_calibration
from kickstand_tools.common.errors import InputError, RefusedInput
from kickstand_tools.logs.log import Log

# file.py


def read(**changed):
    """Read the file of a neutral calibration with these entries changed; None leaves an entry out."""
    data = CalibrationFile().as_json() | changed
    return read_calibration(io.StringIO(json.dumps({key: value for key, value in data.items() if value is not None})))


@pytest.mark.parametrize(
    ("entry", "good", "bad"),
    [("accel_offset_g", [0, 0, -0.499], [0, 0, -0.5]), ("accel_slope", [0.801, 1.199, 1], [1, 1, 1.2])]
    + [("accel_slope", [0.81, 1, 1], [0.8, 1, 1]), ("gyro_bias_dps", [59.9, 0, -59.9], [0, 60.0, 0])]
    + [("trim_deg", -3.6, 3.61), ("gyro_delay_s", 0.05, 0.051), ("gyro_delay_s", 0, True), ("trim_deg", 0, "0")]
    + [("accel_matrix", [[1.15, 0, 0], [0, 1, 0], [0, 0, 1]], [[1.151, 0, 0], [0, 1, 0], [0, 0, 1]])]
    + [("gyro_matrix", [[1, -0.15, 0], [0, 1, 0], [0, 0, 1]], [[1, -0.151, 0], [0, 1, 0], [0, 0, 1]])]
    + [("gyro_sigma", [[0.05, 0, 0], [0] * 3, [0] * 3], [[0.051, 0, 0], [0] * 3, [0] * 3])]
    + [("gyro_sigma", [[0] * 3] * 3, [[-1e-9, 0, 0], [0] * 3, [0] * 3]), ("vehicle", "car", "bus")]
    + [("kickstand_side", "left", "top"), ("accel_offset_g", [0, 0, 0], [0, 0, True]), ("version", 1, True)]
    + [("vehicle_from_sensor", [[0.9995, 0, 0], [0, 1, 0], [0, 0, 1]], [[0.99, 0, 0], [0, 1, 0], [0, 0, 1]])],
)
def test_each_entry_of_a_calibration_has_its_limit(entry, good, bad):
    read(**{entry: good})
    with pytest.raises(InputError):
        read(**{entry: bad})


def test_missing_labels_follow_from_the_numbers():
    turned = [[0, 1, 0], [-1, 0, 0], [0, 0, 1]]
    plain = read(aligned=None, six_positions=None)
    assert (plain.aligned, plain.six_done, plain.vehicle, plain.gyro_delay_s) == (False, False, "", None)
    assert read(aligned=None, vehicle_from_sensor=turned).aligned and not read(vehicle_from_sensor=turned).aligned
    assert read(six_positions=None, accel_slope=[1, 1.01, 1]).six_done
    assert read(six_positions=None, accel_offset_g=[0, 0.01, 0]).six_done
    assert not read(aligned=1).aligned and read(trim_deg=None).trim_deg == 0.0 and read(gyro_delay_s=0).delay_s() == 0.0
    assert plain.delay_s() > 0.0


def test_a_file_has_at_most_a_megabyte(monkeypatch):
    text = json.dumps(CalibrationFile().as_json())
    monkeypatch.setattr(file, "MOST_BYTES", len(text))
    read_calibration(io.StringIO(text))
    with pytest.raises(InputError, match="too large for a calibration"):
        read_calibration(io.StringIO(text + " "))


def test_values_in_a_file_are_rounded_and_shown_short():
    assert file._rounded([0.1234567894999, 123456789.4]) == [0.123456789, 123456789.0]
    assert [file._shown(value) for value in ("x" * 18, "x" * 19, float("nan"))] == [
        repr("x" * 18), "'" + "x" * 19 + "...", "nan",
    ]  # fmt: skip


def test_a_gyros_errors_are_turned_with_its_axes():
    quarter = np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    sigma = np.arange(9.0).reshape(3, 3) / 1000.0
    found = CalibrationFile(vehicle_from_sensor=quarter, gyro_sigma=sigma).gyro_sigma_in_vehicle()
    assert found == pytest.approx(sigma[[1, 0, 2]][:, [1, 0, 2]])
    half = CalibrationFile(
        vehicle_from_sensor=np.array([[0.8, 0.6, 0], [-0.6, 0.8, 0], [0, 0, 1]]), gyro_sigma=np.eye(3)
    )
    assert half.gyro_sigma_in_vehicle()[0, 0] == pytest.approx(np.sqrt(0.64**2 + 0.36**2))


# poses.py


def pose(name, accel) -> Any:
    return SimpleNamespace(name=name, accel_g=np.array(accel, dtype=float))


SIX = [[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]]


def slanted(deg):
    return [np.sin(np.radians(deg)), 0.0, np.cos(np.radians(deg))]


def test_the_free_pose_is_the_one_further_from_its_axis():
    named = [pose("abcdef"[k], up) for k, up in enumerate(SIX)]
    sides, free = poses._sides([*named[::-1], pose("g", slanted(25.0))])
    assert [one.name for one in sides] == list("abcdef") and free is not None and free.name == "g"
    assert poses._sides(named)[1] is None
    tilted = [*named[:4], pose("e", slanted(21.5)), named[5]]
    for deg, good in ((20.1, True), (19.9, False)):
        if good:
            assert poses._sides([*named, pose("g", slanted(deg))])[1] is not None
        else:
            with pytest.raises(InputError, match=r"side \+z exists twice \(e and g\)"):
                poses._sides([*named, pose("g", slanted(deg))])
    with pytest.raises(InputError, match="exists twice"):
        # The tilt of the slanted pose exceeds the tilt of the side pose by less than 3 degrees
        poses._sides([*tilted, pose("g", slanted(24.4))])
    assert poses._sides([*tilted, pose("g", slanted(24.6))])[1] is not None
    with pytest.raises(InputError, match=r"side -z is missing, and side \+z is there 2 times"):
        poses._sides([*named[:5], pose("g", slanted(25.0))])


def test_axes_beyond_the_data_sheet_are_named():
    assert poses.beyond_sheet([0.05, -0.05, 0.08], [1.0299, 0.9701, 1.0]) == []
    assert poses.beyond_sheet([0.051, -0.051, 0.081], [1.0] * 3) == ["x", "y", "z"]
    assert poses.beyond_sheet([0.0] * 3, [1.031, 0.969, 1.0]) == ["x", "y"]


def test_two_poses_keep_the_accelerometers_calibration():
    def still(up):
        readings = np.tile([*up, 20.0, 1.0, 2.0, 3.0], (400, 1))
        readings[:, [0, 1, 2, 4, 5, 6]] += np.random.default_rng(1).normal(0.0, 0.003, (400, 6))
        return Log.from_readings(readings, 100.0)

    before = CalibrationFile(accel_offset_g=np.array([0.01, 0.0, 0.0]), six_done=True, trim_deg=1.0, vehicle="car")
    found = poses.fit_two_positions(still([-0.2, 0.98, 0.0]), still([0.0, 1.0, 0.0]), before, "right")
    made = found.calibration
    assert found.tilt_deg == pytest.approx(11.5, abs=0.3) and made.aligned and made.six_done
    assert (made.trim_deg, made.vehicle, made.kickstand_side) == (0.0, "", "right")
    assert made.gyro_bias_dps == pytest.approx([1.0, 2.0, 3.0], abs=0.01) and made.accel_offset_g[0] == 0.01
    assert made.vehicle_from_sensor[1] == pytest.approx([0.01, 1.0, 0.0], abs=0.01)


# procedure.py


def moving_log(stretches_s, hz=100.0, size_g=0.5, between_s=1.0) -> Log:
    """Return the log of a sensor that is still for these times and moves between them."""
    chance = np.random.default_rng(1)
    parts = [chance.normal(0.0, size_g, (round(between_s * hz), 6))]
    for seconds in stretches_s:
        parts += [
            chance.normal(0.0, 0.001, (round(seconds * hz), 6)),
            chance.normal(0.0, size_g, (round(between_s * hz), 6)),
        ]
    values = np.vstack(parts)
    return Log(np.arange(len(values)) / hz, values[:, :3] + [0.0, 1.0, 0.0], values[:, 3:])


def test_stillness_lasts_a_second_between_margins():
    found = procedure._still_stretches(moving_log([1.15, 1.35, 3.0]))
    assert [last - first for first, last in found] == pytest.approx([115, 280], abs=6)
    # The second stretch begins after 1 + 1.15 + 1 s and a margin of 0.1 s
    assert found[0][0] == pytest.approx(325, abs=6)
    with pytest.raises(InputError, match="too short for the six positions"):
        procedure._still_stretches(Log(np.arange(40) / 100.0, np.zeros((40, 3)), np.zeros((40, 3))))


@pytest.mark.parametrize(
    ("what", "amount", "still"),
    [
        ("peak", 0.095, True),
        ("peak", 0.105, False),
        ("spread", 0.019, True),
        ("spread", 0.021, False),
    ]
    + [("drift", 0.0065, True), ("drift", 0.0075, False), ("rate", 5.9, True), ("rate", 6.1, False)],
)
def test_a_still_window_has_limits(what, amount, still):
    """A window has 50 samples. The halves of a window may differ by 0.007 g, and its standard deviation is at most 0.02
    g."""
    n = 300
    force, rates = np.tile([0.0, 1.0, 0.0], (n, 1)), np.zeros((n, 3))
    k = np.arange(n)
    if what == "peak":
        force[::25, 0] += amount
    elif what == "spread":
        force[:, 0] += amount * (-1.0) ** k
    elif what == "drift":
        force[:, 0] += amount * k / 25.0
    else:
        rates[::10, 1] += amount
    found = procedure._still_stretches(Log(k / 100.0, force, rates))
    assert bool(found and found[0][1] - found[0][0] > 250) is still


@pytest.mark.parametrize(("before", "found"), [(122, [(10, 110), (135, 260)]), (130, [(10, 119), (140, 260)])])
def test_no_stretch_extends_over_a_gap(before, found):
    """Windows begin at every fifth sample. With 130 samples before the gap, a new window begins just after the gap."""
    t_s = np.append(np.arange(before) / 100.0, 3.0 + np.arange(270 - before) / 100.0)
    log = Log(t_s, np.tile([0.0, 1.0, 0.0], (270, 1)), np.zeros((270, 3)))
    assert procedure._still_stretches(log) == found


def test_the_least_tilted_pose_is_a_sides():
    named = SimpleNamespace(name="n")
    means = [slanted(10.0), *SIX[:4], SIX[5], slanted(3.0), slanted(31.0), slanted(5.0)]
    assert procedure._sides(named, means) == [1, 2, 3, 4, 6, 5]  # type: ignore[arg-type]
    with pytest.raises(InputError, match=r"n: 6 still poses, none with side \+z up"):
        procedure._sides(named, [slanted(31.0), *SIX[:4], SIX[5]])  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("most", "used"), [(240.0, True), (246.0, True), (246.3, False), (252.4, False), (252.6, True)]
)
def test_turns_at_the_end_of_a_range_are_left_out(most, used):
    """A rate of 98.5 to 101 % of 250 deg/s is treated as the end of a range of 250 deg/s. In a range of 250 deg/s, all
    rates over 237.5 deg/s are left out."""
    rates = np.zeros((100, 3))
    rates[50] = [0.0, most, 0.0]
    log = Log(np.arange(100) / 100.0, np.tile([0.0, 1.0, 0.0], (100, 1)), rates)
    still: Any = SimpleNamespace(gyro_dps=np.zeros(3))
    (found,) = procedure._turns(log, [(0, 10), (90, 100)], [still, still])
    assert (found is not None) is used
    if found:
        assert found[1] == pytest.approx(0.8)


# drive.py, drive_events.py, drive_feed.py


class Alignment:
    """Replaces a DriveAlignment. Its state is set by the test."""

    needed = 5

    def __init__(self):
        self.counted = self.turned = 0
        self.quality_deg, self.ready, self.problem = 180.0, False, None
        self.reason = AlignmentError("no-speed")


def test_each_change_of_a_drive_is_an_event():
    made: Any = Alignment()
    heard: list = []
    watch = DriveWatch(made, heard.append)
    watch.begin("a")
    watch.look(1.0)
    made.counted = 1
    watch.look(2.0)
    made.turned = 1
    watch.look(3.0)
    made.counted, made.turned = 2, 2
    watch.look(4.0)
    made.problem = AlignmentError("speed-negative", -1.0)
    watch.look(5.0)
    watch.look(6.0)
    made.problem, made.ready = None, True
    watch.look(7.0)
    made.ready = False
    watch.end(8.0)
    watch.begin("b")
    watch.end(4.0)
    made.ready, made.problem = True, None
    watch.begin("c")
    watch.look(2.0)
    seen = [(event.log, event.t_s, event.what, event.refusal and event.refusal.code) for event in watch.events]
    assert seen == [
        ("a", 0.0, "log-begins", None), ("a", 2.0, "used", None), ("a", 3.0, "turning", None), ("a", 4.0, "used", None),
        ("a", 5.0, "problem", "speed-negative"), ("a", 7.0, "ready", None), ("a", 8.0, "not-ready", "no-speed"),
        ("b", 0.0, "log-begins", None), ("b", 4.0, "log-without-events", None), ("c", 0.0, "log-begins", None),
        ("c", 2.0, "ready", None),
    ]  # fmt: skip
    assert heard == watch.events and watch.ready_s == 7.0
    late = DriveWatch(made, None)
    made.ready = False
    late.begin("a")
    late.end(8.0)
    made.ready = True
    late.begin("b")
    late.look(2.0)
    assert late.ready_s == 10.0


def test_a_problem_is_the_reason_that_a_drive_is_not_ready():
    made: Any = Alignment()
    watch = DriveWatch(made, None)
    made.ready = True
    watch.look(1.0)
    made.ready, made.problem = False, AlignmentError("speed-late", 2.5)
    watch.look(2.0)
    assert [(event.what, event.refusal and event.refusal.code) for event in watch.events] == [
        (drive_events.READY, None), (drive_events.PROBLEM, "speed-late"), (drive_events.NOT_READY, None),
    ]  # fmt: skip


def test_a_log_needs_a_speed_and_20_samples_a_second():
    def log(step_s, speed=9.0):
        t_s = np.arange(100) * step_s
        noise = np.random.default_rng(1).normal(size=(100, 3))
        return Log(t_s, noise, noise, np.full(100, speed), name="n")

    assert drive.usable(log(0.05), False) is not None
    with pytest.raises(InputError, match=r"n: a sample every 0\.05 s: at least 20 per second"):
        drive.usable(log(0.0501), False)
    for others, words in ((False, "a wheel$"), (True, "or leave this log out$")):
        with pytest.raises(InputError, match=words):
            drive.usable(log(0.05, np.nan), others)


def test_the_vehicle_follows_from_the_calibration():
    """A short log is refused, but the result says which vehicle was assumed."""
    log = Log(np.arange(300) / 100.0, np.tile([0.0, 1.0, 0.0], (300, 1)), np.zeros((300, 3)), np.zeros(300))
    aligned = CalibrationFile(aligned=True, gyro_bias_dps=np.array([1.0, 2.0, 3.0]))
    for given, vehicle, kind in (
        (None, None, CAR), (aligned, None, MOTORCYCLE), (CalibrationFile(aligned=True, vehicle="car"), None, CAR),
        (aligned, CAR, CAR), (CalibrationFile(), MOTORCYCLE, MOTORCYCLE),
    ):  # fmt: skip
        found = drive.fit_logs([log], given, vehicle)
        assert (found.vehicle, found.status, found.used, found.ready_s) == (kind, "refused", 0, 0.0)
        assert found.poses is None and found.calibration == (given or CalibrationFile())
        assert ("taken for a car" in str(found.refusal)) is (vehicle is None and kind == CAR)
    assert found.attitude_deg == pytest.approx(np.hypot(180.0, 1.1)) and found.lag_s == 0.0
    with pytest.raises(RefusedInput):
        drive.fit_drive([log], vehicle=CAR)


def test_stops_are_found_in_each_log_of_its_own():
    """In each of the two logs the vehicle stands for 4 s, which makes two stops. A speed of over 5 s ago is not known
    any more."""
    seen: list = []
    steps = drive_feed.Steps(lambda *done: seen.append(done), 800)

    def log(seconds=4.0, speed_at=(0,)):
        n = round(100 * seconds)
        speed = np.full(n, np.nan)
        speed[list(speed_at)] = 0.0
        return Log(np.arange(n) / 100.0, np.tile([0.0, 1.0, 0.0], (n, 1)), np.tile([0.5, 0.0, 0.0], (n, 1)), speed)

    found = drive_feed.standing([log(), log()], CalibrationFile(), steps)
    assert found.stops == 2 and found.bias == pytest.approx([0.5, 0.0, 0.0]) and seen[-1] == (800, 800)
    assert drive_feed.standing([log(speed_at=())], CalibrationFile(), drive_feed.Steps(None, 1)).stops == 0
    for seconds, stops in ((6.1, 1), (4.0, 1), (2.9, 0)):
        assert drive_feed.standing([log(seconds)], CalibrationFile(), drive_feed.Steps(None, 1)).stops == stops
    late = drive_feed.standing([log(4.0, (250,))], CalibrationFile(), drive_feed.Steps(None, 1))
    assert late.stops == 0  # the log's only speed is at 2.5 s, and the log ends 1.5 s later


def test_a_speed_counts_as_known_for_5_s(monkeypatch):
    """Each bin lasts 100 ms. After the speed in the first bin, the speed is known in 50 more bins."""
    seen: list = []
    monkeypatch.setattr(drive_feed.StandingVertical, "update", lambda _, force, rate, mps, s: seen.append((mps, s)))
    speed = np.full(801, np.nan)
    speed[10] = -0.2
    log = Log(np.arange(801) / 100.0, np.tile([0.0, 1.0, 0.0], (801, 1)), np.zeros((801, 3)), speed)
    drive_feed.standing([log], CalibrationFile(), drive_feed.Steps(None, 1))
    assert seen[0] == (2.0 * 2.0, 0.0)  # a pretended motion separates the two logs
    assert seen[1:] == [(0.0, pytest.approx(0.1))] * 51


def test_a_first_event_is_reported_without_an_earlier_look():
    made: Any = Alignment()
    made.counted = 1
    watch = DriveWatch(made, None)
    watch.look(1.0)
    assert [event.what for event in watch.events] == ["used"]
    made = Alignment()
    made.turned = 1
    watch = DriveWatch(made, None)
    watch.look(1.0)
    assert [event.what for event in watch.events] == ["turning"]


def test_forces_of_nothing_are_refused_with_their_time():
    def fails(*_):
        raise ValueError

    made: Any = SimpleNamespace(update=fails, measure_speed=lambda *_: None, standing=None)
    watch: Any = SimpleNamespace(begin=lambda name: None, look=lambda t_s: None, end=lambda t_s: None)
    log = Log(np.arange(800) / 100.0, np.zeros((800, 3)), np.zeros((800, 3)), name="n")
    with pytest.raises(InputError, match=r"n, at 0\.0 s: accelerations of nearly 0: at rest 1 g is needed"):
        drive_feed.feed(made, [log], CalibrationFile(), drive_feed.Steps(None, 1), watch)
    made.update = lambda force, rate, us: fails() if len(seen) > 499 else seen.append(us)
    seen: list = []
    with pytest.raises(InputError, match=r"n, at 5\.0 s: accelerations"):
        drive_feed.feed(made, [log], CalibrationFile(), drive_feed.Steps(None, 1), watch)
