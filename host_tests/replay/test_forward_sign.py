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
    """The sign of the log is always named as the other cause: the other side of the kickstand would make a clean report
    of it, mirrored."""
    assert exchanged_line(False, "left", 0.0).endswith("exchanged: calibrate two --side right?" + SIGN)
    assert exchanged_line(False, "right", -3.9).endswith("exchanged: calibrate two --side left?" + SIGN)
    assert exchanged_line(False, "", 0.0).endswith("calibrate two with the other --side?" + SIGN)
    assert exchanged_line(False, "left", -4.1).endswith("exchanged: were the poses swapped?" + SIGN)
    assert exchanged_line(False, "left").endswith("calibrate two --side right? Or were the poses swapped?" + SIGN)
    assert exchanged_line(True, "").endswith("exchanged: calibrate drive again?" + SIGN)


def jerky(late_s: int = 0, sign: float = 1.0, noise_g: float = 0.0, seconds: int = 240, mps2: float = 2.0):
    """Another acceleration each second, by chance; a speed at its beginning, so many seconds late. 10 Hz."""
    chance = np.random.default_rng(5)
    pushes = chance.normal(scale=mps2, size=seconds)
    speed_at = 30.0 + np.concatenate(([0.0], np.cumsum(pushes)))
    time = np.arange(0.0, seconds, 0.1)
    second = np.floor(time + 1e-9).astype(int)
    force = sign * (pushes / G + chance.normal(scale=noise_g, size=seconds))[second]
    speed = np.full(len(time), np.nan)
    speed[::10] = speed_at[np.maximum(0, np.arange(seconds) - late_s)]
    return time, force, speed


def told(*columns) -> ForwardSign:
    found = ForwardSign()
    found.add(*columns)
    return found


@pytest.mark.parametrize("late_s", [0, 1, 2])
def test_a_speed_up_to_two_seconds_late_tells(late_s):
    """Each second pushes otherwise than the one before, so that one second off says nothing."""
    assert told(*jerky(late_s)).correlation == pytest.approx(1.0, abs=1e-6)
    assert told(*jerky(late_s, sign=-1.0)).exchanged


@pytest.mark.parametrize("late_s", [3, 4])
def test_a_later_one_does_not(late_s):
    """Nor one that is told before it is there."""
    for late in late_s, -1:
        found = told(*jerky(late, sign=-1.0))
        assert found.correlation is not None
        assert abs(found.correlation) < 0.3
        assert not found.exchanged


@pytest.mark.parametrize(("noise_g", "correlation", "exchanged"), [(0.24, -0.64, True), (0.28, -0.55, False)])
def test_how_clear_it_has_to_be(noise_g, correlation, exchanged):
    """A correlation of -0.6: less may be the hills."""
    found = told(*jerky(sign=-1.0, noise_g=noise_g))
    assert found.correlation == pytest.approx(correlation, abs=0.02)
    assert found.exchanged is exchanged


@pytest.mark.parametrize(("seconds", "tells"), [(23, True), (20, False)])
def test_how_many_changes_of_speed(seconds, tells):
    """Twenty."""
    assert (told(*jerky(seconds=seconds)).correlation is not None) is tells


@pytest.mark.parametrize(("mps2", "tells"), [(0.55, True), (0.45, False)])
def test_how_large_the_changes(mps2, tells):
    """0.5 m/s rms from second to second: less is the speed's own noise."""
    time, force, speed = jerky(mps2=1.0)
    scale = mps2 / np.std(np.diff(speed[::10]))
    assert (told(time, force * scale, speed * scale).correlation is not None) is tells


def test_an_hour_is_remembered():
    """What was the other way round before it, as with a sensor that was turned over, no longer counts."""
    before, after = jerky(sign=-1.0, seconds=3600), jerky(seconds=3600)
    found = told(*before)
    assert found.exchanged
    found.add(before[0][-1] + 0.1 + after[0], after[1], after[2])
    assert found.correlation == pytest.approx(1.0, abs=1e-3)
    assert found._seconds.shape == (3600, 4)  # and no more is kept


def test_of_several_speeds_in_a_second_the_first_counts():
    time, force, speed = jerky()
    speed[3::10] = 77.0
    assert told(time, force, speed).correlation == pytest.approx(1.0, abs=1e-6)


def test_seconds_without_a_speed_or_without_samples():
    """A gap in the log and lost satellites: what is left still tells."""
    time, force, speed = jerky(sign=-1.0)
    speed[500:900] = np.nan
    kept = (time < 100.0) | (time > 130.0)
    found = told(time[kept], force[kept], speed[kept])
    assert found.correlation == pytest.approx(-1.0, abs=1e-6)
    assert told(time[:0], force[:0], speed[:0]).correlation is None
    far = told(np.concatenate((time, time + 4e5)), np.tile(force, 2), np.tile(speed, 2))
    assert far.correlation is None  # four days: not one ride


@pytest.mark.parametrize("block", [3, 4, 7, 16])
def test_a_block_may_end_within_a_second_before_its_speed(block):
    time, force, speed = jerky()
    columns = time, force, np.roll(speed, 5)
    found = ForwardSign()
    for start in range(0, len(time), block):
        found.add(*(column[start : start + block] for column in columns))
    assert np.allclose(found._seconds, told(*columns)._seconds, equal_nan=True)
    assert found.correlation == pytest.approx(told(*columns).correlation)
