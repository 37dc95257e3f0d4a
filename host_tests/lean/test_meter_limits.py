"""Where the meter's limits are: each is met from both sides. Runs on MicroPython too."""

from math import degrees, exp, pi, radians, sqrt

from bike_motion import DT_S, DT_US, felt, meter, near, nose_up, reading, ride, roll, speed_up
from kickstand.calibration.parameters import Calibration

STILL = reading(*felt())


def aligned():
    calibration = Calibration()
    calibration.aligned = True
    return calibration


def step_up(shown, seconds):
    """From 0 to (0.2, 1.2, 0.4) g, for so long. The lean is not asked."""
    shown.update(STILL, 0)
    for _ in range(int(seconds / DT_S + 0.5)):
        shown.update((0.2, 1.2, 0.4, 25.0, 0.0, 0.0, 0.0), DT_US)
    return shown.smooth_force


def test_the_g_shown_has_a_time_constant_of_0_3_s():
    for seconds in (0.1, 0.3, 0.9):
        share = 1.0 - exp(-seconds / 0.3)
        for shown in (meter(leans=False), meter(aligned(), leans=False), meter()):
            left, up, forward = step_up(shown, seconds)
            near(left, 0.2 * share, 0.003)
            near(up, 1.0 + 0.2 * share, 0.003)
            near(forward, 0.4 * share, 0.006)
        near(step_up(meter(aligned()), seconds)[2], 0.4 * share, 0.006)


def test_the_first_g_is_shown_at_once_also_after_a_gap():
    shown = meter(leans=False)
    shown.update((0.1, 0.9, 0.3, 25.0, 0.0, 0.0, 0.0), 10_000)
    near(shown.smooth_force[2], 0.3, 1e-12)
    near(shown.smooth_force[0], 0.1, 1e-12)
    shown.update((-0.1, 1.1, -0.3, 25.0, 0.0, 0.0, 0.0), 600_000)
    near(shown.smooth_force[2], -0.3, 1e-12)


def test_a_lean_less_certain_than_3_degrees_is_not_shown():
    """Power-on on a straight at 20 m/s after a bump, so that it is unsure at first and surer with each second."""
    shown = meter()
    shown.update(reading([0.0, 1.0, 0.5], [0.0, 0.0, 0.0]), 0)
    sigmas = []
    for _ in range(2000):
        shown.update(STILL, DT_US)
        sigmas.append(degrees(sqrt(shown.filter.variance)))
        assert shown.trusted == (sigmas[-1] <= 3.0), sigmas[-1]
    shown = meter()
    for k in range(6000):
        shown.update(reading([0.0, 1.0, 0.0], [0.05 if k < 10 else 0.0, 0.0, 0.0]), DT_US)
        sigmas.append(degrees(sqrt(shown.filter.variance)))
        assert shown.trusted == (sigmas[-1] <= 3.0), sigmas[-1]
    for low, high in ((2.0, 3.0), (3.0, 4.0)):
        assert any(low < sigma < high for sigma in sigmas), (low, high)


def test_with_the_nose_20_degrees_up_or_down_there_is_no_lean():
    for sign in (1.0, -1.0):
        shown = nose_up(ride(meter(), 4.0), 0.0, sign * 19.0)
        near(shown.filter.pitch_deg, sign * 19.0, 0.3)
        assert shown.trusted
        nose_up(shown, sign * 19.0, sign * 21.0)
        near(shown.filter.pitch_deg, sign * 21.0, 0.3)
        assert not shown.trusted
        assert nose_up(shown, sign * 21.0, 0.0).trusted


def test_a_car_shows_its_g_however_it_stands():
    shown = nose_up(ride(meter(leans=False), 1.0), 0.0, 25.0)
    assert shown.trusted
    assert shown.lean_deg == 0.0


def fallen_after(lean_deg, seconds):
    shown = roll(ride(meter(), 3.0), 0.0, lean_deg, dps=120.0)
    return ride(shown, seconds, lean_deg=lean_deg)


def test_a_bike_over_65_degrees_for_a_second_has_fallen():
    for sign in (1.0, -1.0):
        shown = fallen_after(sign * 64.5, 2.5)
        near(shown.lean_deg, sign * 64.5, 0.2)
        assert not shown.fallen
        shown = fallen_after(sign * 66.0, 0.9)
        near(shown.lean_deg, sign * 66.0, 0.2)
        assert not shown.fallen
        assert ride(shown, 0.2, lean_deg=sign * 66.0).fallen
        roll(shown, sign * 66.0, sign * 64.0)
        assert not shown.fallen
        roll(shown, sign * 64.0, sign * 66.0)
        assert not ride(shown, 0.8, lean_deg=sign * 66.0).fallen  # the second counts from its latest fall
        assert ride(shown, 0.5, lean_deg=sign * 66.0).fallen
        shown.restart()
        assert not shown.fallen
        assert shown.lean_deg == 0.0
        assert not ride(shown, 0.9, lean_deg=sign * 66.0).fallen
        assert ride(shown, 0.2, lean_deg=sign * 66.0).fallen


def test_the_lean_of_a_fall_is_no_maximum():
    shown = ride(roll(ride(meter(), 3.0), 0.0, 63.0), 0.2, lean_deg=63.0)
    near(shown.max_right_deg, 63.0, 0.5)  # the low-pass is made up for
    roll(shown, 63.0, 85.0)
    assert shown.lean_deg > 80.0
    assert shown.max_right_deg < 65.0


def test_maxima_are_the_largest_of_each_side_until_they_are_reset():
    shown = ride(meter(), 3.0)
    for lean_from, lean_to in ((0.0, 20.0), (20.0, -10.0), (-10.0, 8.0), (8.0, -30.0), (-30.0, 0.0)):
        ride(roll(shown, lean_from, lean_to), 0.3, lean_deg=lean_to)
    near(shown.max_right_deg, 20.0, 0.5)
    near(shown.max_left_deg, 30.0, 0.5)
    shown.reset_maxima()
    assert shown.max_right_deg < 0.1
    assert shown.max_left_deg == shown.max_accel_g == shown.max_brake_g == 0.0
    speed_up(shown, 0.0, 12.0, 4.0)
    near(shown.max_accel_g, 3.0 / 9.80665, 0.01)
    assert shown.max_brake_g < 0.01
    speed_up(shown, 12.0, 2.0, 2.0)
    near(shown.max_brake_g, 5.0 / 9.80665, 0.01)
    near(shown.max_accel_g, 3.0 / 9.80665, 0.01)
    ride(shown, 0.5)
    shown.reset_maxima()
    assert shown.max_right_deg == shown.max_left_deg == shown.max_accel_g == shown.max_brake_g == 0.0


def test_a_lean_that_cannot_be_trusted_is_no_maximum():
    shown = ride(meter(), 3.0)
    shown.distrust("mount has moved")
    roll(shown, 0.0, 30.0)
    near(shown.lean_deg, 30.0, 0.5)
    assert shown.max_right_deg < 0.1
    shown.trust()
    ride(shown, 0.2, lean_deg=30.0)
    near(shown.max_right_deg, 30.0, 0.2)


def test_what_lasts_less_than_150_ms_is_no_maximum():
    """A pothole that jerks the sensor by 18 degrees, to either side."""
    shown = ride(roll(ride(meter(), 3.0), 0.0, 20.0), 0.3, lean_deg=20.0)
    for sign in 1.0, -1.0:
        for _ in range(3):
            roll(shown, 20.0, 20.0 + sign * 18.0, dps=300.0)
            roll(shown, 20.0 + sign * 18.0, 20.0, dps=300.0)
            ride(shown, 0.1, lean_deg=20.0)
        near(shown.max_right_deg, 20.0, 0.5)
    roll(shown, 20.0, 30.0, dps=300.0)
    ride(shown, 0.13, lean_deg=30.0)
    assert shown.max_right_deg < 30.0
    ride(shown, 0.1, lean_deg=30.0)
    near(shown.max_right_deg, 30.0, 0.5)


def test_a_gap_of_more_than_half_a_second_begins_anew():
    """At most half a second is bridged: the movement during it is taken from the rate at its end."""
    shown = ride(meter(), 3.0)
    shown.update(reading(*felt(5.0, roll_dps=10.0)), 500_000)
    assert shown.filter.variance < pi * pi
    near(shown.lean_deg, 5.0, 0.3)
    shown.update(reading(*felt(5.0, roll_dps=10.0)), 500_001)
    assert shown.filter.variance == pi * pi  # one reading says nothing yet
    assert not shown.trusted
    shown = ride(meter(), 3.0, lean_deg=20.0)
    shown.update(reading(*felt(-20.0, roll_dps=50.0)), 500_001)
    near(shown.lean_deg, -20.0, 0.01)  # by the force alone: no rate is multiplied by the gap
    assert not shown.at_rest


def test_what_is_lost_for_over_170_ms_makes_the_lean_uncertain_by_30_degrees_a_second():
    for lost_us, degrees_lost in ((170_000, 0.0), (170_001, 5.1), (300_000, 9.0), (500_000, 15.0)):
        shown = ride(meter(), 3.0)
        before = shown.filter.variance
        shown.update(STILL, lost_us)
        near(degrees(sqrt(max(0.0, shown.filter.variance - before))), degrees_lost, 0.1)
        assert shown.trusted is (degrees_lost < 3.0)


def test_the_speed_becomes_uncertain_by_3_mps_a_second():
    """So that 4 m/s may be none after half a second, and not after a quarter of one."""
    for lost_us, rolls in ((250_000, True), (500_000, False)):
        shown = speed_up(ride(meter(), 3.0), 0.0, 4.0, 2.0)
        assert shown.filter.rolling
        shown.update(STILL, lost_us)
        assert shown.filter.rolling is rolls


def trimmed(angle_deg, sigma_deg, kept_deg=0.0):
    """A bike that stands, whose ride has found this trim so surely."""
    calibration = Calibration()
    calibration.trim_deg = kept_deg
    shown = ride(meter(calibration), 3.0)
    shown.filter.trim.angle, shown.filter.trim.variance = radians(angle_deg), radians(sigma_deg) ** 2
    return shown


def test_a_trim_is_kept_if_it_is_certain_to_half_a_degree_and_has_changed_by_0_3():
    for angle_deg, sigma_deg, kept_deg, keeps in (
        (1.0, 0.49, 0.0, True),
        (1.0, 0.51, 0.0, False),
        (0.31, 0.3, 0.0, True),
        (0.29, 0.3, 0.0, False),
        (-0.31, 0.3, 0.0, True),
        (1.0, 0.3, 0.75, False),
        (1.0, 0.3, 0.65, True),
    ):
        shown = trimmed(angle_deg, sigma_deg, kept_deg)
        assert shown.at_rest
        assert shown.keep_trim() is keeps, (angle_deg, sigma_deg, kept_deg)
        assert shown.calibration
        near(shown.calibration.trim_deg, angle_deg if keeps else kept_deg, 1e-5)
        assert not shown.keep_trim()  # once is enough


def test_no_trim_is_kept_while_it_rides():
    shown = trimmed(1.0, 0.3)
    speed_up(shown, 0.0, 15.0, 5.0)
    assert not shown.at_rest
    assert not shown.keep_trim()
    assert shown.calibration
    assert shown.calibration.trim_deg == 0.0


def test_the_delay_of_the_low_pass_is_made_up_for():
    """Rolling to the right at 60 deg/s, what is measured is some milliseconds old: the lean is larger by now."""
    now, late = ride(meter(delay_s=0.0), 3.0), ride(meter(delay_s=0.02), 3.0)
    for k in range(10):
        for shown in (now, late):
            shown.update(reading(*felt(0.6 * (k + 1), roll_dps=60.0)), DT_US)
    near(late.lean_deg - now.lean_deg, 60.0 * 0.02, 0.01)
    near(now.lean_deg, 6.0, 0.2)


def test_a_speed_below_zero_is_no_news():
    told, untold = meter(), meter()
    for shown in (told, untold):
        ride(speed_up(ride(shown, 3.0), 0.0, 20.0, 6.0), 1.0, speed_mps=20.0)
    told.measure_speed(-1.0)
    for shown in (told, untold):
        ride(shown, 1.0, speed_mps=20.0)
    assert told.speed_mps == untold.speed_mps
    told.measure_speed(0.0)  # a zero is one
    ride(told, 1.0, speed_mps=20.0)
    assert told.speed_mps < untold.speed_mps - 0.5


def test_another_calibration_or_a_restart_forgets_the_ride_and_keeps_the_maxima():
    shown = ride(roll(ride(meter(), 3.0), 0.0, 20.0), 0.2, lean_deg=20.0)
    assert shown.trusted
    shown.restart()
    assert not shown.trusted
    near(shown.max_right_deg, 20.0, 0.5)
    ride(shown, 3.0)
    assert shown.trusted
    shown.use(shown.calibration)
    assert not shown.trusted
    near(shown.max_right_deg, 20.0, 0.5)


def test_a_meter_takes_sums_of_counts():
    from array import array

    calibration = Calibration()
    calibration.set_scale(4096, 65.5)
    shown = meter(calibration)
    assert shown.reading == [0] * 7
    shown.update_sum(array("i", [8, 3 * 4096, 4, 100, -2, 6, 131]), 3, 0)
    assert [round(3 * value, 6) for value in shown.reading] == [8, 12288, 4, 100, -2, 6, 131]
    near(shown.force[1], 1.0, 0.001)
    near(degrees(shown.rate[2]), 131 / 3 / 65.5, 0.01)
    shown.restart()
    counts = array("i", [2 * 1401, 2 * 3849, 0, 0, 0, 0, 0])  # 20 degrees
    for _ in range(200):
        shown.update_sum(counts, 2, DT_US)
    near(shown.lean_deg, 20.0, 0.1)
    assert shown.at_rest


def test_the_formulas_lean_takes_the_yaw_rate():
    """A turn of 30 degrees that a bike leans into: the rate about left has its other sign at the nose down."""
    force, rate = felt(30.0, 15.0)
    shown = meter()
    shown.update(reading(force, [-rate[0], rate[1], rate[2]]), 0)
    near(shown.lean_formula_deg, 30.0, 0.01)
