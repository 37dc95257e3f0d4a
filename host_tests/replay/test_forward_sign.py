"""Forward and backward told apart by the speed of a log, in whatever blocks it comes."""

import numpy as np
import pytest
from kickstand_tools.calibration.file import CalibrationFile
from kickstand_tools.refusals import sentence
from kickstand_tools.replay.forward_sign import ENOUGH, ForwardSign, exchanged_notice

G = 9.80665


def ride(seconds: float = 60.0, late_s: float = 0.0, sign: float = 1.0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Faster and slower at 50 Hz, with noise, on a slope; a speed once a second."""
    time = np.arange(0.0, seconds, 0.02)
    noise = np.random.default_rng(0).normal(scale=0.1, size=len(time))
    force = sign * 2.0 * np.sin(time / 3.0) / G + 0.05 + noise
    speed = np.full(len(time), np.nan)
    speed[::50] = 15.0 - 6.0 * np.cos((time[::50] - late_s) / 3.0)
    return time, force, speed


@pytest.mark.parametrize("late_s", [0.0, 0.4, 1.0])
@pytest.mark.parametrize("block", [7, 777, 10_000])
def test_forward_is_told_from_backward(late_s, block):
    for sign in 1.0, -1.0:
        found = ForwardSign()
        columns = ride(late_s=late_s, sign=sign)
        for start in range(0, len(columns[0]), block):
            found.add(*(column[start : start + block] for column in columns))
        whole = ForwardSign()
        whole.add(*columns)
        assert found.correlation == pytest.approx(whole.correlation)
        assert found.correlation == pytest.approx(sign, abs=0.1)
        assert found.exchanged is (sign < 0.0)


def test_what_does_not_tell():
    time, force, speed = ride(sign=-1.0)
    few = ForwardSign()
    few.add(*(column[: 50 * (ENOUGH - 1)] for column in (time, force, speed)))
    for told in ((time, force, np.full(len(time), np.nan)), (time, force, np.where(np.isnan(speed), speed, 12.0))):
        found = ForwardSign()
        found.add(*told)
        assert found.correlation is None
        assert not found.exchanged
    assert few.correlation is None


def test_a_ride_across_does_not_accuse():
    time, force, speed = ride()
    found = ForwardSign()
    found.add(time, np.roll(force, 235), speed)  # a quarter of a period
    assert not found.exchanged


SIGN = " Or, if no board wrote this log, do all accelerations have the opposite sign? At rest up reads +1 g"


def exchanged_line(car, side, roll_deg=None):
    calibration = CalibrationFile(vehicle="car" if car else "", kickstand_side=side)
    return sentence(exchanged_notice(calibration, roll_deg))


def test_what_is_said():
    """Where both forward and left may be reversed, the sign of the log is named as the other cause: the other side of
    the kickstand would make a clean report of it, mirrored."""
    assert exchanged_line(False, "left", 0.0).endswith("exchanged: calibrate two --side right?" + SIGN)
    assert exchanged_line(False, "right", -3.9).endswith("exchanged: calibrate two --side left?" + SIGN)
    assert exchanged_line(False, "", 0.0).endswith("calibrate two with the other --side?" + SIGN)
    assert exchanged_line(False, "left", -4.1).endswith("exchanged: were the poses swapped?")
    assert exchanged_line(False, "left").endswith("calibrate two --side right? Or were the poses swapped?" + SIGN)
    assert exchanged_line(True, "").endswith("exchanged: calibrate drive again?")
