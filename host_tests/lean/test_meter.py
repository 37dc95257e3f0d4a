"""Tests when the meter shows a lean, its maxima, and the effect of gaps. Also runs on MicroPython."""

from array import array
from math import degrees

from bike_motion import DT_US, force_and_rate, meter, near, nose_up, reading, ride, roll, speed_up
from kickstand.calibration.parameters import Calibration

STILL = reading(*force_and_rate())


def maxima(shown):
    return [shown.max_left_deg, shown.max_right_deg, shown.max_accel_g, shown.max_brake_g]


def test_a_standing_bike_is_at_rest_and_upright():
    lean_meter = ride(meter(), 3.0)
    assert lean_meter.at_rest and lean_meter.trusted
    near(lean_meter.speed_mps, 0.0, 0.01)
    near(lean_meter.lean_deg, 0.0, 0.01)


def test_a_meter_takes_sums_of_counts():
    calibration = Calibration()
    calibration.set_scale(4096, 65.5)
    lean_meter = meter(calibration)
    lean_meter.update_sum(array("i", [8, 3 * 4096, 4, 100, -2, 6, 131]), 3, 0)
    assert [round(3 * value, 6) for value in lean_meter.reading] == [8, 12288, 4, 100, -2, 6, 131]
    near(lean_meter.force[1], 1.0, 0.001)
    near(degrees(lean_meter.rate[2]), 131 / 3 / 65.5, 0.01)


def test_the_shown_g_is_smooth():
    """An aligned motorcycle has no smoothed forces left and up."""
    for aligned, leans, all_axes in ((True, False, True), (False, False, True), (True, True, False)):
        calibration = Calibration()
        calibration.aligned = aligned
        lean_meter, forward = meter(calibration, leans=leans), []
        lean_meter.update(STILL, 0)
        for _ in range(150):
            lean_meter.update((0.2, 1.2, 0.4, 25.0, 0.0, 0.0, 0.0), DT_US)
            forward.append(lean_meter.smooth_force[2])
        assert forward == sorted(forward) and forward[10] < 0.2
        near(forward[-1], 0.4, 0.01)
        left, up = lean_meter.smooth_force[:2]
        if all_axes:
            near(left, 0.2, 0.01)
            near(up, 1.2, 0.01)
        else:
            assert left != left and up != up  # NaN
        lean_meter.use(Calibration())
        lean_meter.update(STILL, 0)
        near(lean_meter.smooth_force[1], 1.0, 1e-6)


def test_a_lean_is_shown_only_while_it_is_certain():
    """The power is switched on while riding straight at 20 m/s, just after a bump. The lean is uncertain at first, and
    becomes more certain with each second."""
    lean_meter, sigmas = meter(), {True: [], False: []}
    lean_meter.update(reading([0.0, 1.0, 0.5], [0.0, 0.0, 0.0]), 0)
    for _ in range(2000):
        lean_meter.update(STILL, DT_US)
        sigmas[lean_meter.trusted].append(lean_meter.filter.variance)
    assert lean_meter.trusted and min(sigmas[False]) > max(sigmas[True])


def test_with_the_nose_far_up_or_down_there_is_no_lean():
    for sign in (1.0, -1.0):
        lean_meter = nose_up(ride(meter(), 4.0), 0.0, sign * 15.0)
        assert lean_meter.trusted
        assert not nose_up(lean_meter, sign * 15.0, sign * 25.0).trusted
        assert nose_up(lean_meter, sign * 25.0, 0.0).trusted


def test_after_the_poses_the_first_bend_shows_its_lean():
    """The poses have measured the gyro's bias, and show that the bike was at rest. After power-on the bias and the rest
    are unknown."""
    for posed in (True, False):
        lean_meter = meter()
        lean_meter.use(lean_meter.calibration, posed)
        roll(speed_up(ride(lean_meter, 0.5), 0.0, 15.0, 4.0), 0.0, 30.0, 15.0)
        assert ride(lean_meter, 4.0, 15.0, lean_deg=30.0).trusted == posed
        near(lean_meter.lean_deg, 30.0, 0.3 if posed else 8.0)
    lean_meter = meter()
    lean_meter.use(lean_meter.calibration, True)
    assert not ride(lean_meter, 1.0, 15.0, lean_deg=30.0).trusted  # the bike moves right after the poses


def test_a_bike_that_lies_on_its_side_for_a_second_has_fallen():
    for sign in (1.0, -1.0):
        lying = sign * 80.0
        lean_meter = ride(roll(ride(meter(), 3.0), 0.0, lying, dps=120.0), 0.5, lean_deg=lying)
        assert not lean_meter.fallen
        assert ride(lean_meter, 0.7, lean_deg=lying).fallen
        assert not roll(lean_meter, lying, sign * 60.0).fallen
        roll(lean_meter, sign * 60.0, lying)
        assert not ride(lean_meter, 0.5, lean_deg=lying).fallen  # the time of a fall counts from the latest fall
        assert ride(lean_meter, 10.0, lean_deg=lying).fallen and lean_meter.odd is None
        lean_meter.restart()
        assert not lean_meter.fallen and lean_meter.lean_deg == 0.0


def test_maxima_are_the_largest_values_until_a_reset():
    lean_meter = ride(meter(), 3.0)
    for lean_from, lean_to in ((0.0, 20.0), (20.0, -10.0), (-10.0, 8.0), (8.0, -30.0), (-30.0, 0.0)):
        ride(roll(lean_meter, lean_from, lean_to), 0.3, lean_deg=lean_to)
    near(lean_meter.max_right_deg, 20.0, 0.5)
    near(lean_meter.max_left_deg, 30.0, 0.5)
    lean_meter.reset_maxima()
    assert maxima(lean_meter) == [0.0] * 4
    speed_up(lean_meter, 0.0, 12.0, 4.0)
    near(lean_meter.max_accel_g, 3.0 / 9.80665, 0.01)
    assert lean_meter.max_brake_g < 0.01
    speed_up(lean_meter, 12.0, 2.0, 2.0)
    near(lean_meter.max_brake_g, 5.0 / 9.80665, 0.01)
    near(lean_meter.max_accel_g, 3.0 / 9.80665, 0.01)


def test_a_lean_shorter_than_150_ms_is_not_a_maximum():
    """Potholes jerk the sensor by 18 degrees to either side."""
    lean_meter = ride(roll(ride(meter(), 3.0), 0.0, 20.0), 0.3, lean_deg=20.0)
    for jerk in (18.0, -18.0):
        for _ in range(3):
            roll(lean_meter, 20.0, 20.0 + jerk, dps=300.0)
            roll(lean_meter, 20.0 + jerk, 20.0, dps=300.0)
            ride(lean_meter, 0.1, lean_deg=20.0)
        near(lean_meter.max_right_deg, 20.0, 0.5)
    roll(lean_meter, 20.0, 30.0, dps=300.0)
    assert ride(lean_meter, 0.13, lean_deg=30.0).max_right_deg < 30.0
    near(ride(lean_meter, 0.1, lean_deg=30.0).max_right_deg, 30.0, 0.5)


def test_a_distrusted_lean_is_hidden_and_no_maximum():
    """The reason for the distrust belongs to one calibration."""
    lean_meter = ride(meter(), 3.0)
    lean_meter.distrust("mount-moved")
    roll(lean_meter, 0.0, 30.0)
    near(lean_meter.lean_deg, 30.0, 0.5)
    assert not lean_meter.trusted and lean_meter.max_right_deg < 0.1
    lean_meter.distrust(None)
    assert ride(lean_meter, 0.2, lean_deg=30.0).trusted
    near(lean_meter.max_right_deg, 30.0, 0.2)
    lean_meter.distrust("other-side")
    lean_meter.use(lean_meter.calibration)
    assert lean_meter.suppressed_reason == "other-side"
    lean_meter.use(Calibration())
    assert lean_meter.suppressed_reason is None


def test_a_restart_resets_the_ride_and_keeps_the_maxima():
    lean_meter = ride(roll(ride(meter(), 3.0), 0.0, 20.0), 0.2, lean_deg=20.0)
    for reset in (lean_meter.restart, lambda: lean_meter.use(lean_meter.calibration)):
        assert lean_meter.trusted
        reset()
        assert not lean_meter.trusted
        near(lean_meter.max_right_deg, 20.0, 0.5)
        ride(lean_meter, 3.0)


def test_a_ride_keeps_the_errors_of_the_gyro_that_it_has_found():
    """The roll rate reads 4 % too much. At the next rest the calibration corrects most of it, once."""
    calibration = Calibration()
    shown = speed_up(ride(meter(calibration), 3.0), 0.0, 15.0, 5.0)
    exact = shown.update
    shown.update = lambda reading, dt_us: exact(reading[:6] + [1.04 * reading[6]], dt_us)
    lean_deg = 0.0
    for target in (30.0, -25.0, 20.0, -35.0) * 6 + (0.0,):
        ride(roll(shown, lean_deg, target, 15.0), 3.0, 15.0, lean_deg=target)
        lean_deg = target
    assert not shown.keep_trim()
    ride(speed_up(shown, 15.0, 0.0, 4.0), 12.0)
    assert shown.at_rest and shown.keep_trim() and not shown.keep_trim()
    near(calibration.gyro_matrix[8], 0.97, 0.015)
    near(calibration.trim_deg, 0.0, 0.5)
    assert 0.0 < max(calibration.gyro_sigma) < 0.02


def test_the_delay_of_the_low_pass_is_compensated():
    """The bike rolls to the right at 60 deg/s. The readings are 20 ms old, so the lean is now larger by 1.2 degrees."""
    prompt, late = ride(meter(delay_s=0.0), 3.0), ride(meter(delay_s=0.02), 3.0)
    for k in range(10):
        for lean_meter in (prompt, late):
            lean_meter.update(reading(*force_and_rate(0.6 * (k + 1), roll_dps=60.0)), DT_US)
    near(late.lean_deg - prompt.lean_deg, 60.0 * 0.02, 0.01)
    near(prompt.lean_deg, 6.0, 0.2)
