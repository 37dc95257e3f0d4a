"""The data that an alignment by driving gets from several logs, and its result for a known drive."""

from array import array
from typing import Any

import numpy as np
import pytest
from kickstand.drive_alignment import verdict
from kickstand.drive_alignment.alignment import DriveAlignment
from kickstand_tools.calibration import drive, drive_feed
from kickstand_tools.calibration.drive_events import DriveWatch
from kickstand_tools.calibration.file import CalibrationFile
from kickstand_tools.common.errors import InputError, RefusedInput
from kickstand_tools.logs.log import Log
from kickstand_tools.simulation.scripted.sensor_errors import random_mounting
from support import driving_runs

NAN = float("nan")


def steady(seconds, speeds, name="a", gap=None):
    """A log at 100 Hz. speeds: {number of the sample: m/s}. gap: (number of the sample, seconds without samples)."""
    n = round(100 * seconds) + 1
    t_s, speed = np.arange(n) / 100.0, np.full(n, NAN)
    if gap:
        t_s[gap[0] :] += gap[1]
    for at, mps in speeds.items():
        speed[at] = mps
    return Log(t_s, np.tile([0.0, 1.0, 0.0], (n, 1)), np.tile([0.5, 0.0, 0.0], (n, 1)), speed, name=name)


_Base: Any = DriveAlignment  # an untyped base, because the class below replaces its properties by attributes


class Noted(_Base):
    """An alignment that only notes its calls."""

    counted = turned = 0
    needed, quality_deg, ready, problem = 5, 180.0, False, None

    def __init__(self):
        self.calls: list[Any] = []
        self.standing: Any = self

    def update(self, force, rate, *rest):
        self.calls.append(("update", *rest))

    def measure_speed(self, speed_mps, age_us=0):
        self.calls.append(("speed", speed_mps, age_us))

    def interrupt(self):
        self.calls.append(("interrupt",))

    def finish(self):
        self.calls.append(("finish",))


def fed(*logs):
    """Return the calls of an alignment, and the times of each look at its state."""
    alignment, looks = Noted(), []
    watch: Any = DriveWatch(alignment, None)
    look = watch.look
    watch.look = lambda t_s: (looks.append(t_s), look(t_s))
    drive_feed.feed(alignment, logs, CalibrationFile(), drive_feed.Steps(None, 1), watch)
    return alignment.calls, looks, watch


def test_speeds_come_at_their_times():
    """A bin lasts 100 ms, of which the last sample takes 10 ms."""
    calls, looks, _ = fed(steady(0.2, {0: 10.0, 5: 10.5, 10: 11.0}))
    assert calls == [
        ("speed", 10.0, 0), ("update", 90_000), ("speed", 10.5, 40_000), ("update", 10_000), ("speed", 11.0, 0),
        ("update", 90_000), ("update", 10_000), ("finish",),
    ]  # fmt: skip
    assert looks == pytest.approx([0.0, 0.05, 0.1, 0.2])


def test_a_gap_interrupts_but_the_stop_continues():
    calls, _, _ = fed(steady(0.2, {}, gap=(11, 2.0)))
    assert [call[0] for call in calls] == ["update", "update", "interrupt", "update", "finish"]


def test_the_next_log_interrupts_and_ends_the_stop():
    """StandingVertical gets the end of a stop as a motion without a duration."""
    calls, looks, watch = fed(steady(0.1, {}), steady(0.1, {3: 9.0}, "b"))
    assert calls == [
        ("update", 90_000), ("update", 10_000), ("interrupt",), ("update", 4.0, 0.0),
        ("update", 90_000), ("speed", 9.0, 60_000), ("update", 10_000), ("finish",),
    ]  # fmt: skip
    assert looks == pytest.approx([0.1, 0.03, 0.1])
    assert [(event.log, event.what) for event in watch.events] == [
        ("a", "log-begins"), ("a", "log-without-events"), ("b", "log-begins"), ("b", "log-without-events"),
    ]  # fmt: skip


def test_no_stop_is_known_before_the_first_speed(monkeypatch):
    """The first speed comes in the fourth bin."""
    seen = []
    monkeypatch.setattr(drive_feed.StandingVertical, "update", lambda _, force, rate, mps, s: seen.append((mps, s)))
    drive_feed.standing([steady(0.6, {35: 0.0})], CalibrationFile(), drive_feed.Steps(None, 1))
    assert seen == [(4.0, 0.0)] + [(0.0, pytest.approx(0.1))] * 3


def test_the_last_speed_of_a_bin_counts_and_is_never_negative(monkeypatch):
    seen = []
    monkeypatch.setattr(drive_feed.StandingVertical, "update", lambda _, force, rate, mps, s: seen.append(mps))
    speeds = {0: 9.0, 5: 8.0, 15: 7.0, 20: 6.0, 25: -0.5}
    drive_feed.standing([steady(0.4, speeds)], CalibrationFile(), drive_feed.Steps(None, 1))
    assert seen == [4.0, 8.0, 6.0, 0.0, 0.0]


MOUNT = np.reshape(random_mounting(5), (3, 3))


def driven(vehicle="car", events=7, braking=-2.0, before=()):
    """A drive at 100 Hz with a speed each half second. The gyro's bias is (0.5, -1, 0.3) deg/s along the sensor."""
    made = list(driving_runs.samples([*before, *driving_runs.around(events, braking)], vehicle))
    n = len(made)
    speed = np.full(n, NAN)
    speed[::50] = [row[2] for row in made][::50]
    force, rate = (np.array([row[k] for row in made]) @ MOUNT for k in (0, 1))
    return Log(np.arange(n) / 100.0, force, rate + [0.5, -1.0, 0.3], speed, name="ride")


def test_a_car_is_aligned_by_its_drive():
    log, done, events = driven(), [], []
    found = drive.fit_logs([log], None, None, "improved", lambda *of: done.append(of), events.append)
    made = found.calibration
    assert np.degrees(np.linalg.norm(made.vehicle_from_sensor - MOUNT) / np.sqrt(2.0)) < 1.0
    assert made.gyro_bias_dps == pytest.approx([0.5, -1.0, 0.3], abs=0.02)
    assert (made.aligned, made.vehicle, made.trim_deg, made.kickstand_side) == (True, "car", 0.0, "")
    assert (found.status, found.reason, found.refusal, found.poses) == ("aligned", "", None, None)
    assert 5 <= found.used <= 8 and found.turned == 0 and found.stops >= 1
    assert found.quality_deg < 3.0 and found.attitude_deg == pytest.approx(np.hypot(found.quality_deg, 1.1))
    assert found.lag_s == pytest.approx(0.0, abs=0.3) and found.halves_deg is not None and found.halves_deg < 3.0
    (ready,) = [event.t_s for event in events if event.what == "ready"]
    assert found.ready_s == ready and events == found.events
    assert done[-1] == (2 * len(log.t_s),) * 2


def test_the_bias_of_a_calibrated_gyro_is_a_reading():
    """The rates of this gyro are too small by a half, and 2 deg/s of its bias are already known."""
    log = driven()
    log.gyro_dps = log.gyro_dps / 2.0 + [0.0, 2.0, 0.0]
    before = CalibrationFile(gyro_matrix=2.0 * np.eye(3), gyro_bias_dps=np.array([0.0, 2.0, 0.0]))
    found = drive.fit_logs([log], before, "car")
    assert found.calibration.gyro_bias_dps == pytest.approx([0.25, 1.5, 0.15], abs=0.02)


def test_the_published_method_has_neither_lag_nor_halves():
    found = drive.fit_logs([driven(events=1)], None, "car", "published")
    assert (found.method, found.lag_s, found.halves_deg, found.poses) == ("published", None, None, None)


@pytest.mark.parametrize(
    ("yaw_deg", "expected", "error_deg"),
    [(0.0, verdict.SAME, 0.0), (10.0, verdict.REFINED, -10.0), (180.0, verdict.REVERSED, 180.0)],
)
def test_two_poses_are_compared_with_the_drive(yaw_deg, expected, error_deg):
    """The alignment from the poses is turned to the left about the vertical by yaw_deg."""
    c, s = np.cos(np.radians(yaw_deg)), np.sin(np.radians(yaw_deg))
    turned = np.array([[c, 0.0, -s], [0.0, 1.0, 0.0], [s, 0.0, c]]) @ MOUNT
    before = CalibrationFile(vehicle_from_sensor=turned, aligned=True, kickstand_side="left", trim_deg=1.0)
    found = drive.fit_logs([driven("motorcycle")], before)
    assert found.vehicle == found.calibration.vehicle == "motorcycle" and found.calibration.kickstand_side == ""
    assert found.poses is not None and found.poses.verdict == expected
    apart = found.poses.yaw_deg - error_deg
    assert (apart + 180.0) % 360.0 - 180.0 == pytest.approx(0.0, abs=1.5)


def test_remarks_about_each_log_have_its_name():
    logs = [driven(events=1), driven(events=1)]
    logs[1].name = "other"
    logs[0].notices, logs[1].notices = ["first"], ["second", "third"]  # type: ignore[list-item]
    found = drive.fit_logs(logs, None, "car")
    assert found.notices == [("ride", "first"), ("other", "second"), ("other", "third")]


def test_a_refused_drive_names_its_logs():
    logs = [driven(events=1), driven(events=1)]
    logs[1].name = "other"
    with pytest.raises(RefusedInput, match=r"^ride, other: .*taken for a car: else --vehicle motorcycle"):
        drive.fit_drive(logs)
    with pytest.raises(RefusedInput) as refused:
        drive.fit_drive(logs, vehicle="car")
    assert "taken for a car" not in str(refused.value)
    with pytest.raises(InputError, match="given twice"):
        drive.fit_drive(["a.csv", "a.csv"])
    logs[1].speed_mps[:] = NAN
    with pytest.raises(InputError, match=r"^other: no speed.*or leave this log out$"):
        drive.fit_drive(logs)


def test_the_matrix_of_a_refused_drive_is_the_earlier_one():
    before = CalibrationFile(accel_slope=np.array([1.01, 1.0, 1.0]))
    found = drive.fit_logs([driven(events=1)], before, "car")
    assert found.calibration is before and found.status == "refused"
    assert found.bias_dps == pytest.approx([0.5, -1.0, 0.3], abs=0.02)
    assert array("f", found.calibration.vehicle_from_sensor.ravel()).tolist() == np.eye(3).ravel().tolist()
