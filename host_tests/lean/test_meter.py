"""The meter: what it shows as certain, and how late the sensor's low-pass may be."""

import math

import pytest
from kickstand.calibration.parameters import Calibration
from kickstand.lean import lean_filter
from kickstand_tools.replay.replay_engine import ReplayMeter
from kickstand_tools.simulated_board.simulator import Board

DT_US = 10_000
STILL = (0.0, 1.0, 0.0, 25.0, 0.0, 0.0, 0.0)


@pytest.fixture
def gyro_delay_s():
    """The driver's table: seconds by DLPF, 1 to 6."""
    board = Board(lambda t: STILL)
    board.install()  # the driver needs MicroPython's time
    try:
        from kickstand.imu.mpu6050 import GYRO_DELAY_S
    finally:
        board.uninstall()
    return GYRO_DELAY_S


def meter(**options):
    calibration = Calibration()
    for i in range(9):
        calibration.vehicle_from_sensor[i] = 1.0 if i % 4 == 0 else 0.0
    return ReplayMeter(calibration, **options)


def stand(shown, seconds=5.0):
    for _ in range(round(seconds * 1e6 / DT_US)):
        shown.update(STILL, DT_US)
    return shown


def test_a_standing_bike_is_at_rest_and_upright():
    shown = stand(meter())
    assert shown.at_rest
    assert shown.trusted
    assert shown.speed_mps == pytest.approx(0.0, abs=0.01)
    assert shown.lean_deg == pytest.approx(0.0, abs=0.01)


def test_the_lean_is_distrusted_for_a_reason_until_it_is_trusted_again():
    shown = stand(meter())
    shown.distrust("mount has moved")
    assert shown.suppressed_reason == "mount has moved"
    assert not shown.trusted
    shown.trust()
    assert shown.suppressed_reason is None
    assert shown.trusted
    with pytest.raises(AttributeError):
        setattr(shown, "doubt", "written")  # noqa: B010 type checkers know that it is read only


def test_a_doubt_is_about_one_calibration():
    shown = stand(meter())
    shown.distrust("side was wrong?")
    shown.use(shown.calibration)
    assert shown.suppressed_reason == "side was wrong?"
    shown.use(Calibration())
    assert shown.suppressed_reason is None


def test_a_car_has_no_lean_to_doubt():
    shown = stand(meter(leans=False))
    shown.distrust("mount has moved")
    assert shown.trusted


def test_the_trim_of_the_calibration_is_taken_off():
    calibration = Calibration()
    calibration.trim_deg = 1.5
    shown = ReplayMeter(calibration)
    assert shown.trim_deg == pytest.approx(1.5)
    for i in range(9):
        calibration.vehicle_from_sensor[i] = 1.0 if i % 4 == 0 else 0.0
    shown.use(calibration)
    assert stand(shown).lean_deg == pytest.approx(-1.5, abs=0.01)


def test_a_slower_low_pass_takes_off_more(gyro_delay_s):
    """Rolling at 60 deg/s: lean is shown as it is now, by the delay of the low-pass times the rate ahead."""
    rate_dps = 60.0
    ahead = []
    for delay_s in gyro_delay_s.values():
        shown = stand(meter(delay_s=delay_s))
        before = math.degrees(shown.filter._x[0])  # the state itself
        shown.update((*STILL[:6], rate_dps), DT_US)
        ahead.append(shown.lean_deg - before - rate_dps * DT_US * 1e-6)
    assert ahead == pytest.approx([rate_dps * delay for delay in gyro_delay_s.values()], abs=0.01)
    assert ahead == sorted(ahead)
    assert ahead[5] > ahead[2] + 0.8


def test_without_a_setting_the_delay_is_that_of_the_default_low_pass(gyro_delay_s):
    assert lean_filter.DELAY_S == gyro_delay_s[3]
    assert tuple(gyro_delay_s.values()) == (0.0019, 0.0028, 0.0048, 0.0083, 0.0134, 0.0186)
