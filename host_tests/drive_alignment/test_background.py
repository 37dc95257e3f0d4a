"""The alignment in the background: what it saves, what it says to the rider, and which speeds it passes on.

A vehicle drives at 100 samples per second with its sensor mounted at random. Its earlier alignment may be wrong. The
device tests drive the same module behind a display.
"""

import numpy as np
import pytest
from kickstand.calibration.parameters import Calibration
from kickstand.calibration.store import Store
from kickstand.drive_alignment import alignment
from kickstand.lean.meter import LeanMeter
from kickstand_sim.simulated_board.simulator import Board
from kickstand_sim.simulation.scripted.sensor_errors import random_mounting
from support import driving_runs
from support.driving_runs import around, mounted

MOUNT = random_mounting(5)
TO_A_STOP = [[10.0, -1.5, 0.0], [6.0, 0.0, 0.0]]


class Chip:
    """short: True if the memory is too short to use a calibration."""

    who_am_i, accel_range_g, gyro_lsb_per_dps, short = 0x68, 8, 65.5, False

    @property
    def accel_lsb_per_g(self):
        if self.short:
            raise MemoryError("memory allocation failed")
        return 4096.0


class Receiver:
    """A speed source. speed: the speed that poll() returns next, or None."""

    age_ms = 0
    speed: float | None = None

    def poll(self, now_ms):
        speed, self.speed = self.speed, None
        return speed


class Vehicle:
    """A vehicle whose earlier alignment is turned about up by yaw_deg; None for a sensor that is not aligned.

    scale: factor on each speed.
    """

    def __init__(self, leans=True, yaw_deg=None, scale=1.0, trim_deg=1.0):
        from kickstand.calibration.active import ActiveCalibration
        from kickstand.drive_alignment.background import BackgroundAlignment
        from kickstand.speed.source import Speed  # these modules need a board's clock

        self.leans, self.scale, self.now_ms = leans, scale, 0
        self.receiver = Receiver()
        self.meter = LeanMeter(Calibration(), leans)
        self.active = ActiveCalibration(self.meter)
        self.chip = Chip()
        self.active.chip_started(self.chip)
        if yaw_deg is not None:
            self.align(yaw_deg, trim_deg)
        self.background = BackgroundAlignment(leans, Speed(self.receiver), self.meter, self.active)
        self.passed = []
        self.speed = 0.0

    def align(self, yaw_deg, trim_deg):
        c, s = np.cos(np.radians(yaw_deg)), np.sin(np.radians(yaw_deg))
        turned = np.array([[c, 0.0, -s], [0.0, 1.0, 0.0], [s, 0.0, c]]) @ np.reshape(MOUNT, (3, 3))
        self.active.save(Calibration().with_alignment(turned.ravel().tolist(), [0.5, -1.0, 0.3], trim_deg))

    def drive(self, legs):
        """Drive these legs: see driving_runs. Yields after each second."""
        kind = "motorcycle" if self.leans else "car"
        for k, (force, rate, speed) in enumerate(driving_runs.samples(legs, kind, start_mps=self.speed)):
            self.speed = speed
            self.now_ms += 10
            turning = np.add(mounted(MOUNT, rate), [0.5, -1.0, 0.3])
            counts = [round(4096.0 * f) for f in mounted(MOUNT, force)] + [0] + [round(65.5 * w) for w in turning]
            self.background.feed(counts, 1, 10_000, self.now_ms)
            if k % 50 == 0:
                self.receiver.speed = self.speed * self.scale
            passed = self.background.poll(self.now_ms)
            if k % 50 == 0:
                self.passed.append(passed)
            if k % 100 == 99:
                yield

    def go(self, legs):
        for _ in self.drive(legs):
            pass
        return self

    def yaw_error_deg(self):
        matrix = np.reshape(self.active.value.vehicle_from_sensor, (3, 3)) @ np.reshape(MOUNT, (3, 3)).T
        return np.degrees(np.arctan2(matrix[2, 0], matrix[2, 2]))

    @property
    def message(self):
        return self.background.message and self.background.message.code

    @property
    def result(self):
        return self.background.result and self.background.result.code


@pytest.fixture(autouse=True)
def board(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with Board(lambda t_s: (0, 0, 1, 0, 0, 0)):
        yield


def test_a_car_aligns_itself_and_saves_at_a_stop(tmp_path):
    car = Vehicle(leans=False)
    assert car.background.shown and not car.active.aligned
    for _ in car.drive([*around(6), *TO_A_STOP]):
        assert car.speed == 0.0 or not car.active.aligned
    assert car.message == "aligned" and car.background.result is car.background.message
    assert car.background.result and car.background.result.values[0] == pytest.approx(car.background.drive.quality_deg)
    assert abs(car.yaw_error_deg()) < 1.0
    stored = Store(0x68, 8, str(tmp_path)).load()
    assert stored.by_drive and stored.vehicle_from_sensor == car.active.value.vehicle_from_sensor
    assert list(stored.gyro_bias) == pytest.approx([0.5, -1.0, 0.3], abs=0.03) and stored.trim_deg == 0.0
    assert any(car.passed[:4]) is False and car.passed[20] > 0.0  # a car's speeds are recorded as they are
    car.go([[3.0, 2.0, 0.0]])
    assert car.message is None  # away


@pytest.mark.parametrize(
    ("yaw_deg", "message", "reason", "result", "error_deg"),
    [
        (0.0, None, None, None, 0.0),
        (11.0, None, "old", "aligned", 0.0),  # a yaw error of the poses is corrected
        (-60.0, "mount-moved", "mount-moved", None, -60.0),
        (180.0, "other-side", "other-side", None, 180.0),
    ],
)
def test_each_verdict_has_its_reaction(yaw_deg, message, reason, result, error_deg):
    """A motorcycle hides the lean while a question waits. The trim stays. A good verdict ends a distrust."""
    bike = Vehicle(yaw_deg=yaw_deg)
    bike.meter.distrust("old")
    bike.go([*around(6), *TO_A_STOP])
    assert (bike.message, bike.result) == (message, result)
    assert bike.meter.suppressed_reason in (reason, None if result else reason)
    assert abs(abs(bike.yaw_error_deg()) - abs(error_deg)) < 1.5
    assert bike.active.value.trim_deg == pytest.approx(1.0)
    assert list(bike.active.value.gyro_bias) == pytest.approx([0.5, -1.0, 0.3], abs=0.03)
    bike.go([[3.0, 2.0, 0.0]])
    assert bike.message is None and (bike.meter.suppressed_reason or "") == (message or "")


def test_without_memory_for_its_alignment_a_drive_says_so_and_goes_on():
    bike = Vehicle().go(around(6))
    bike.chip.short = True
    bike.go(TO_A_STOP)
    assert bike.message == "no-memory" and not bike.active.aligned
    assert bike.go([[3.0, 2.0, 0.0]]).message is None


@pytest.mark.parametrize("yaw_deg", [11.0, 60.0])
def test_a_drive_says_nothing_about_poses_that_were_taken_after_it(yaw_deg):
    """The same yaw error in the poses before the drive would be corrected, or reported as a moved mount."""
    bike = Vehicle(yaw_deg=0.0).go([*around(6), *TO_A_STOP])
    bike.align(yaw_deg, 0.5)
    posed = bike.active.value
    bike.go([[3.0, 0.0, 0.0]])
    assert (bike.message, bike.meter.suppressed_reason, bike.active.value is posed) == (None, None, True)


@pytest.mark.parametrize("agreed", [True, False])
def test_an_answer_exchanges_forward_and_backward(agreed):
    bike = Vehicle(yaw_deg=180.0).go([*around(3), *TO_A_STOP])
    assert bike.message == "other-side"
    bike.background.answer(agreed)
    assert bike.meter.suppressed_reason is None
    assert bike.message == ("side-fixed" if agreed else None)
    assert abs(bike.yaw_error_deg()) == pytest.approx(0.0 if agreed else 180.0, abs=0.5)
    assert bike.active.value.trim_deg == pytest.approx(-1.0 if agreed else 1.0)
    assert bike.go([[4.0, 0.0, 0.0]]).message == ("side-fixed" if agreed else None)  # the rider is not asked again


def test_a_car_whose_mount_moved_is_aligned_again():
    car = Vehicle(leans=False, yaw_deg=60.0).go([*around(6), *TO_A_STOP])
    assert car.message == "aligned" and abs(car.yaw_error_deg()) < 1.0 and car.active.value.trim_deg == 0.0


def test_a_requested_drive_replaces_the_alignment_once_it_is_ready():
    bike = Vehicle(yaw_deg=60.0)
    bike.background.ask()
    assert bike.background.shown
    bike.go([*around(2), *TO_A_STOP])
    assert bike.message is None and abs(bike.yaw_error_deg()) == pytest.approx(60.0, abs=0.1)
    bike.go([*around(5, stands=False), *TO_A_STOP])
    assert bike.message == "aligned" and abs(bike.yaw_error_deg()) < 1.0 and bike.active.value.trim_deg == 0.0


@pytest.mark.parametrize("yaw_deg", [0.0, None])
def test_a_useless_speed_is_said_only_if_an_alignment_is_in_use(yaw_deg):
    """A drive begins again after a problem, because the problem may disappear."""
    bike = Vehicle(yaw_deg=yaw_deg, scale=2.237).go([*around(5), *TO_A_STOP])
    assert bike.result == "speed-unit" and bike.background.drive.counted == 0
    assert bike.message == ("speed-unit" if yaw_deg == 0.0 else None)
    assert not any(bike.passed) and bike.meter.filter.speed_mps < 1.0


def test_a_motorcycles_speed_is_passed_once_brakings_confirm_it():
    bike, brakings = Vehicle(yaw_deg=0.0), []
    for _ in bike.drive([*around(3), *TO_A_STOP]):
        brakings += [bike.background.drive.counted] * 2
    second = brakings.index(2)
    assert not any(bike.passed[: second - 2]) and all(bike.passed[second + 3 : second + 20])
    assert all(speed == round(speed, 2) for speed in bike.passed if speed)  # rounded as in a recording
    assert bike.passed[-1] is None  # a broken wire reads zero too


def test_a_failed_save_is_reported_and_changes_nothing(tmp_path):
    bike = Vehicle(yaw_deg=180.0).go([*around(3), *TO_A_STOP])
    for path in tmp_path.iterdir():
        path.unlink()
    tmp_path.rmdir()
    bike.background.answer(True)
    assert bike.message not in ("side-fixed", "other-side")
    assert abs(bike.yaw_error_deg()) == pytest.approx(180.0, abs=0.5)


@pytest.mark.parametrize(("lost_ms", "counted"), [(200, 1), (301, 0)])
def test_a_gap_in_the_readings_drops_the_braking(lost_ms, counted):
    bike = Vehicle(yaw_deg=0.0).go([[5.0, 2.0, 12.0], [3.0, 0.0, 0.0], [1.5, -2.0, 0.0]])
    bike.now_ms += lost_ms
    bike.go([[0.5, -2.0, 0.0], [3.0, 0.0, 0.0]])
    assert bike.background.drive.counted == counted


def test_a_speed_is_fresh_for_three_seconds():
    bike = Vehicle(yaw_deg=0.0).go([[1.0, 2.0, 0.0]])
    bike.receiver.speed = 2.5
    bike.background.poll(10_000)
    assert [bike.background.fresh_speed(ms) for ms in (12_999, 13_000, 10_001)] == [2.5, None, None]


def test_a_bend_at_walking_pace_is_shown_as_braking():
    states = {}
    for speed in (6.0, 3.0):
        bike = Vehicle(yaw_deg=0.0)
        for _ in bike.drive([[4.0, speed / 4.0, 0.0], [4.0, 0.0, 0.0], [3.0, -speed / 3.0, 15.0]]):
            states.setdefault(speed, set()).add(bike.background.state())
    assert alignment.TURNING in states[6.0] and alignment.BRAKING in states[3.0]
