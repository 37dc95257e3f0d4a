"""Tests when the meter shows a lean, its maxima, and the effect of gaps. Also runs on MicroPython."""

from array import array
from math import degrees

from bike_motion import DT_US, force_and_rate, meter, near, nose_up, reading, ride, roll, speed_up
from kickstand.calibration.parameters import Calibration

STILL = reading(*force_and_rate())


def maxima(shown):
    return [shown.max_left_deg, shown.max_right_deg, shown.max_accel_g, shown.max_brake_g]


def test_a_standing_bike_is_at_rest_and_upright():
    shown = ride(meter(), 3.0)
    assert shown.at_rest and shown.trusted
    near(shown.speed_mps, 0.0, 0.01)
    near(shown.lean_deg, 0.0, 0.01)


def test_a_meter_takes_sums_of_counts():
    calibration = Calibration()
    calibration.set_scale(4096, 65.5)
    shown = meter(calibration)
    shown.update_sum(array("i", [8, 3 * 4096, 4, 100, -2, 6, 131]), 3, 0)
    assert [round(3 * value, 6) for value in shown.reading] == [8, 12288, 4, 100, -2, 6, 131]
    near(shown.force[1], 1.0, 0.001)
    near(degrees(shown.rate[2]), 131 / 3 / 65.5, 0.01)


def test_the_shown_g_is_smooth():
    """An aligned motorcycle has no smoothed forces left and up."""
    for aligned, leans, all_axes in ((True, False, True), (False, False, True), (True, True, False)):
        calibration = Calibration()
        calibration.aligned = aligned
        shown, forward = meter(calibration, leans=leans), []
        shown.update(STILL, 0)
        for _ in range(150):
            shown.update((0.2, 1.2, 0.4, 25.0, 0.0, 0.0, 0.0), DT_US)
            forward.append(shown.smooth_force[2])
        assert forward == sorted(forward) and forward[10] < 0.2
        near(forward[-1], 0.4, 0.01)
        left, up = shown.smooth_force[:2]
        if all_axes:
            near(left, 0.2, 0.01)
            near(up, 1.2, 0.01)
        else:
            assert left != left and up != up  # NaN
        shown.use(Calibration())
        shown.update(STILL, 0)
        near(shown.smooth_force[1], 1.0, 1e-6)


def test_a_lean_is_shown_only_while_it_is_certain():
    """The power is switched on while riding straight at 20 m/s, just after a bump. The lean is uncertain at first, and
    becomes more certain with each second."""
    shown, sigmas = meter(), {True: [], False: []}
    shown.update(reading([0.0, 1.0, 0.5], [0.0, 0.0, 0.0]), 0)
    for _ in range(2000):
        shown.update(STILL, DT_US)
        sigmas[shown.trusted].append(shown.filter.variance)
    assert shown.trusted and min(sigmas[False]) > max(sigmas[True])


def test_with_the_nose_far_up_or_down_there_is_no_lean():
    for sign in (1.0, -1.0):
        shown = nose_up(ride(meter(), 4.0), 0.0, sign * 15.0)
        assert shown.trusted
        assert not nose_up(shown, sign * 15.0, sign * 25.0).trusted
        assert nose_up(shown, sign * 25.0, 0.0).trusted


def test_after_the_poses_the_first_bend_shows_its_lean():
    """The poses have measured the gyro's bias, and show that the bike was at rest. After power-on the bias and the rest
    are unknown."""
    for posed in (True, False):
        shown = meter()
        shown.use(shown.calibration, posed)
        roll(speed_up(ride(shown, 0.5), 0.0, 15.0, 4.0), 0.0, 30.0, 15.0)
        assert ride(shown, 4.0, 15.0, lean_deg=30.0).trusted == posed
        near(shown.lean_deg, 30.0, 0.3 if posed else 8.0)
    shown = meter()
    shown.use(shown.calibration, True)
    assert not ride(shown, 1.0, 15.0, lean_deg=30.0).trusted  # the bike moves right after the poses


def test_a_bike_that_lies_on_its_side_for_a_second_has_fallen():
    for sign in (1.0, -1.0):
        lying = sign * 80.0
        shown = ride(roll(ride(meter(), 3.0), 0.0, lying, dps=120.0), 0.5, lean_deg=lying)
        assert not shown.fallen
        assert ride(shown, 0.7, lean_deg=lying).fallen
        assert not roll(shown, lying, sign * 60.0).fallen
        roll(shown, sign * 60.0, lying)
        assert not ride(shown, 0.5, lean_deg=lying).fallen  # the time of a fall counts from the latest fall
        assert ride(shown, 0.7, lean_deg=lying).fallen
        shown.restart()
        assert not shown.fallen and shown.lean_deg == 0.0


def test_maxima_are_the_largest_values_until_a_reset():
    shown = ride(meter(), 3.0)
    for lean_from, lean_to in ((0.0, 20.0), (20.0, -10.0), (-10.0, 8.0), (8.0, -30.0), (-30.0, 0.0)):
        ride(roll(shown, lean_from, lean_to), 0.3, lean_deg=lean_to)
    near(shown.max_right_deg, 20.0, 0.5)
    near(shown.max_left_deg, 30.0, 0.5)
    shown.reset_maxima()
    assert maxima(shown) == [0.0] * 4
    speed_up(shown, 0.0, 12.0, 4.0)
    near(shown.max_accel_g, 3.0 / 9.80665, 0.01)
    assert shown.max_brake_g < 0.01
    speed_up(shown, 12.0, 2.0, 2.0)
    near(shown.max_brake_g, 5.0 / 9.80665, 0.01)
    near(shown.max_accel_g, 3.0 / 9.80665, 0.01)


def test_a_lean_shorter_than_150_ms_is_not_a_maximum():
    """Potholes jerk the sensor by 18 degrees to either side."""
    shown = ride(roll(ride(meter(), 3.0), 0.0, 20.0), 0.3, lean_deg=20.0)
    for jerk in (18.0, -18.0):
        for _ in range(3):
            roll(shown, 20.0, 20.0 + jerk, dps=300.0)
            roll(shown, 20.0 + jerk, 20.0, dps=300.0)
            ride(shown, 0.1, lean_deg=20.0)
        near(shown.max_right_deg, 20.0, 0.5)
    roll(shown, 20.0, 30.0, dps=300.0)
    assert ride(shown, 0.13, lean_deg=30.0).max_right_deg < 30.0
    near(ride(shown, 0.1, lean_deg=30.0).max_right_deg, 30.0, 0.5)


def test_a_distrusted_lean_is_hidden_and_no_maximum():
    """The reason for the distrust belongs to one calibration."""
    shown = ride(meter(), 3.0)
    shown.distrust("mount-moved")
    roll(shown, 0.0, 30.0)
    near(shown.lean_deg, 30.0, 0.5)
    assert not shown.trusted and shown.max_right_deg < 0.1
    shown.distrust(None)
    assert ride(shown, 0.2, lean_deg=30.0).trusted
    near(shown.max_right_deg, 30.0, 0.2)
    shown.distrust("other-side")
    shown.use(shown.calibration)
    assert shown.suppressed_reason == "other-side"
    shown.use(Calibration())
    assert shown.suppressed_reason is None


def test_a_restart_resets_the_ride_and_keeps_the_maxima():
    shown = ride(roll(ride(meter(), 3.0), 0.0, 20.0), 0.2, lean_deg=20.0)
    for again in (shown.restart, lambda: shown.use(shown.calibration)):
        assert shown.trusted
        again()
        assert not shown.trusted
        near(shown.max_right_deg, 20.0, 0.5)
        ride(shown, 3.0)


def test_the_delay_of_the_low_pass_is_compensated():
    """The bike rolls to the right at 60 deg/s. The readings are 20 ms old, so the lean is now larger by 1.2 degrees."""
    prompt, late = ride(meter(delay_s=0.0), 3.0), ride(meter(delay_s=0.02), 3.0)
    for k in range(10):
        for shown in (prompt, late):
            shown.update(reading(*force_and_rate(0.6 * (k + 1), roll_dps=60.0)), DT_US)
    near(late.lean_deg - prompt.lean_deg, 60.0 * 0.02, 0.01)
    near(prompt.lean_deg, 6.0, 0.2)
