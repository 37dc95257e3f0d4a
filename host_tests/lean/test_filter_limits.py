"""Where the lean filter's limits are: start, rest, rolling, and what a restart keeps. Runs on MicroPython too."""

from math import atan2, cos, degrees, pi, radians, sin, sqrt

from bike_motion import DT_S, DT_US, GRAVITY_MPS2, felt, near
from kickstand.lean.bike_model import LEAN, SPEED
from kickstand.lean.lean_filter import LeanFilter

LEVEL, NO_RATE = [0.0, 1.0, 0.0], [0.0, 0.0, 0.0]


def feel(estimator, seconds, force=LEVEL, rate=NO_RATE, dt_us=DT_US):
    """The same force and rate for so long; returns the last lean."""
    lean = 0.0
    for _ in range(int(seconds * 1e6 / dt_us + 0.5)):
        lean = estimator.update(force, rate, dt_us)
    return lean


def sigma_deg(estimator):
    """Of the lean without the trim."""
    return degrees(sqrt(estimator.variance - estimator.trim.variance))


def vector(axis, value, base=NO_RATE):
    return [base[i] + (value if i == axis else 0.0) for i in range(3)]


def test_before_the_first_window_nothing_is_known():
    estimator = LeanFilter()
    assert estimator.variance == pi * pi
    assert not estimator.rolling
    assert not estimator.at_rest
    near(estimator.update([0.5, sqrt(0.75), 0.0], NO_RATE, 0), 30.0, 1e-9)
    assert estimator.variance == pi * pi


def test_the_first_lean_is_that_of_the_force_of_the_first_twentieth_of_a_second():
    estimator = LeanFilter()
    shown = [estimator.update([sin(radians(a)), cos(radians(a)), 0.0], NO_RATE, DT_US) for a in (10, 12, 14, 16)]
    near(shown[3], 13.0, 0.01)
    assert estimator.variance == pi * pi
    near(estimator.update([sin(radians(18)), cos(radians(18)), 0.0], NO_RATE, DT_US), 14.0, 0.01)
    near(sigma_deg(estimator), 1.5, 1e-6)


def begun(force=LEVEL, rate=NO_RATE):
    """Speed and 1 sigma of the lean after the first window."""
    estimator = LeanFilter()
    feel(estimator, 0.06, force, rate)
    return estimator.speed_mps, sigma_deg(estimator)


def test_power_on_at_rest_or_under_way_is_told_by_rate_and_force():
    """Under way a lean by the force is 30 degrees uncertain, and the speed is supposed to be 15 m/s."""
    for axis in range(3):
        for sign in (1.0, -1.0):
            speed, sigma = begun(rate=vector(axis, sign * 0.0199))
            near(speed, 0.0, 0.01)
            near(sigma, 1.5, 0.01)
            speed, sigma = begun(rate=vector(axis, sign * 0.0201))
            near(speed, 15.0, 0.1)
            near(sigma, 30.0, 0.01)
    for size, moving in ((0.951, False), (0.949, True), (1.049, False), (1.051, True)):
        for direction in ([0.0, 1.0, 0.0], [0.6, 0.8, 0.0], [0.0, 0.6, 0.8]):
            _, sigma = begun([size * part for part in direction])
            near(sigma, 30.0 if moving else 1.5, 0.01)


def rest_after(forward_g, limit_s=15.0):
    estimator, t_s = LeanFilter(), 0.0
    force = [0.0, sqrt(1.0 - forward_g**2), forward_g]
    while not estimator.at_rest and t_s < limit_s:
        estimator.update(force, NO_RATE, DT_US)
        t_s += DT_S
    return t_s


def test_a_forward_force_of_over_80_mg_may_be_braking_so_rest_is_seen_later():
    for sign in (1.0, -1.0):
        assert rest_after(sign * 0.075) < 2.5
        assert rest_after(sign * 0.088) > 9.0


def speed_up(estimator, until_mps, mps2=2.0):
    """From rest, straight on; returns {speed estimated: rolling}."""
    seen = {}
    for _ in range(int(until_mps / mps2 / DT_S + 0.5)):
        estimator.update([0.0, 1.0, mps2 / GRAVITY_MPS2], NO_RATE, DT_US)
        seen[estimator.speed_mps] = estimator.rolling
    return seen


def test_over_3_mps_it_rolls():
    estimator = LeanFilter()
    feel(estimator, 3.0)
    seen = speed_up(estimator, 6.0)
    assert max(seen) > 5.0
    assert all(rolls == (speed > 3.0) for speed, rolls in seen.items())


def told(speed_mps, mps2):
    """Power-on while it speeds up so; after half a second the speed is told once."""
    estimator = LeanFilter()
    force = [0.0, 1.0, mps2 / GRAVITY_MPS2]
    feel(estimator, 0.05, [0.0, 1.1, 0.0])
    feel(estimator, 0.5, force)
    estimator.measure_speed(speed_mps)
    feel(estimator, 0.7, force)
    return estimator


def test_a_speed_of_less_than_three_sigma_may_be_none():
    """Told 4 m/s, that is right to 1 m/s; after 0.4 s of lost readings to 1.5 m/s."""
    assert told(4.0, 0.5).rolling
    for speed_mps, rolls in ((4.0, False), (9.0, True)):
        estimator = told(speed_mps, 0.5)
        estimator.inflate_covariance(0.4)
        assert estimator.speed_mps > 3.5
        assert estimator.rolling is rolls


def speed_sigma_mps(forward_g, before_mps, now_mps):
    """1 sigma after two speeds, told a second apart, of a bike that feels such a force."""
    estimator = LeanFilter()
    force = [0.0, 1.0, forward_g]
    feel(estimator, 0.05, [0.0, 1.1, 0.0])
    for speed_mps in (before_mps, now_mps):
        feel(estimator, 1.0, force)
        estimator.measure_speed(speed_mps)
    feel(estimator, 0.5, force)
    assert estimator._p is not None
    return sqrt(estimator._p.rows[SPEED][SPEED]) * GRAVITY_MPS2


def test_a_speed_may_be_late_while_the_told_ones_change_whatever_force_is_felt():
    """A wrong pitch feigns a force forward, and the speed that would contradict it must not be heard less for that."""
    steady, changing = speed_sigma_mps(0.0, 12.0, 12.0), speed_sigma_mps(0.0, 6.0, 12.0)
    assert changing > steady + 0.2
    near(speed_sigma_mps(0.3, 12.0, 12.0), steady, 0.05)


def test_a_told_speed_is_news_once():
    estimator = told(5.0, 0.0)
    near(estimator.speed_mps, 5.0, 0.2)
    once, again = told(5.0, 3.0), told(5.0, 3.0)
    again.measure_speed(5.0)
    for each in (once, again):
        feel(each, 0.7, [0.0, 1.0, 3.0 / GRAVITY_MPS2])
    assert again.speed_mps < once.speed_mps - 0.1


def test_coming_to_rest_the_force_is_the_vertical():
    """Whatever was estimated before: here a lean of 10 degrees that the gyro did not see."""
    estimator = LeanFilter()
    feel(estimator, 3.0)
    speed_up(estimator, 8.0)
    force = [sin(radians(10.0)), cos(radians(10.0)) * cos(radians(12.0)), sin(radians(12.0)) * cos(radians(10.0))]
    t_s = 0.0
    while not estimator.at_rest:
        feel(estimator, DT_S, force)
        t_s += DT_S
    assert t_s < 12.0
    feel(estimator, 0.2, force)
    near(estimator.speed_mps, 0.0, 0.01)
    upright_deg = degrees(estimator.trim.angle)
    near(feel(estimator, DT_S, force) + upright_deg, degrees(atan2(force[0], force[1])), 0.15)
    near(estimator.pitch_deg, 11.8, 0.15)
    assert sigma_deg(estimator) < 0.7


def biased(bias_dps, seconds=30.0):
    """A filter that has seen a bias at rest."""
    estimator = LeanFilter()
    rate = [radians(value) for value in bias_dps]
    feel(estimator, seconds, LEVEL, rate)
    assert estimator.at_rest
    return estimator, rate


def test_at_rest_the_bias_of_every_axis_is_found_and_a_restart_keeps_it():
    """Then the bike is rocked: a bias that was not found would be seen as a lean."""
    bias_dps = (1.2, -0.9, 1.5)
    for restarted in (False, True):
        estimator, bias = biased(bias_dps)
        if restarted:
            estimator.restart()
            assert estimator.variance == pi * pi
            assert not estimator.at_rest
            near(estimator.speed_mps, 0.0, 1e-9)
        worst = 0.0
        for k in range(1000):
            lean_deg = 10.0 - 10.0 * cos(k * DT_S)
            roll_dps = 10.0 * sin(k * DT_S)
            force, rate = felt(lean_deg, 0.0, roll_dps)
            lean = estimator.update(force, [a + b for a, b in zip(rate, bias)], DT_US)
            worst = max(worst, abs(lean - lean_deg - 0.0048 * roll_dps))
        assert worst < 0.7, worst


def test_after_a_restart_a_smooth_turn_is_no_rest():
    """The bias is known by then: a rate of 2 deg/s that does not change is the bike's."""
    estimator, _ = biased((0.0, 0.0, 0.0), 5.0)
    estimator.restart()
    for _ in range(1500):
        estimator.update([0.0, 1.02, 0.0], [0.0, radians(2.0), 0.0], DT_US)
        assert not estimator.at_rest


def test_values_that_are_no_numbers_are_forgotten():
    estimator = LeanFilter()
    feel(estimator, 3.0)
    forgotten = False
    for k in range(300):
        estimator.update([float("nan") if k < 20 else 0.0, 1.0, 0.0], NO_RATE, DT_US)
        forgotten = forgotten or estimator.variance == pi * pi
    assert forgotten
    near(feel(estimator, 5.0), 0.0, 0.01)
    assert sigma_deg(estimator) < 1.0


def test_a_speed_of_850_kmh_is_one_and_of_950_is_none():
    """A board on its nose seems to speed up by 1 g until its rest is seen, after ten seconds and more."""
    for speed_mps, fits in ((240.0, True), (260.0, False)):
        estimator = LeanFilter()
        feel(estimator, 0.05, [0.0, 1.2, 0.0])
        restarts = 0
        for _ in range(1000):
            estimator.measure_speed(speed_mps)
            estimator.update(LEVEL, NO_RATE, DT_US)
            restarts += estimator.variance == pi * pi
        assert (restarts == 0) is fits, speed_mps


def test_a_lean_beyond_half_a_turn_comes_from_the_other_side():
    """A sensor in the hand, turned over to the right or left, and on."""
    for sign in (1.0, -1.0):
        estimator = LeanFilter()
        feel(estimator, 3.0)
        for k in range(1500):
            a = sign * min(2.0 * pi, 0.006 * k)
            turning = sign * 0.6 if 0.006 * k < 2.0 * pi else 0.0
            lean = estimator.update([sin(a), cos(a), 0.0], [0.0, 0.0, turning], DT_US)
            if abs(a) > radians(210.0):
                near(lean, degrees(a) - sign * 360.0, 3.0)
        near(feel(estimator, 4.0), 0.0, 0.5)


def test_a_large_correction_is_made_once():
    """Power-on in a turn of 30 degrees; then the speed is told, and the lean found at once. While that is calculated
    more innovations are summed up, which still show the old error."""
    estimator, speeds, leans = LeanFilter(), [], []
    force, rate = felt(30.0, 20.0)
    for k in range(400):
        if k == 10:
            estimator.measure_speed(20.0)
        leans.append(estimator.update(force, rate, DT_US))
        speeds.append(estimator.speed_mps)
    assert abs(leans[30]) < 1.0
    assert leans[60] > 28.0
    assert max(leans) < 30.5


def test_where_samples_come_slowly_rest_and_ride_are_seen_as_well():
    """At 50 Hz all work on a window is done in the sample after it."""
    estimator = LeanFilter()
    force, rate = felt(-20.0)
    lean = 0.0
    for k in range(400):
        lean = estimator.update(force, rate, 20_000 if k else 0)
    assert estimator.at_rest
    near(lean, -20.0, 0.05)
    near(feel(estimator, 6.0, [sin(radians(-20.0)), cos(radians(-20.0)), 0.2], NO_RATE, 20_000), -20.0, 2.0)
    assert estimator.rolling


def test_a_bias_that_is_far_off_is_put_right_at_once_where_rest_is_seen():
    """Of 5 deg/s, on a bike that stands at 20 degrees: neither lean nor pitch drifts from then on."""
    force, _ = felt(20.0)
    for axis in range(3):
        estimator, rate = LeanFilter(), vector(axis, 0.08)
        while not estimator.at_rest:
            estimator.update(force, rate, DT_US)
        for _ in range(60):
            near(estimator.update(force, rate, DT_US), 20.0, 0.25)
            near(estimator.pitch_deg, 0.0, 0.2)


def test_a_sensor_whose_forward_axis_points_up_or_down_comes_to_rest():
    """A board on the table, not aligned: where pitch is a right angle, lean has no meaning, but nothing may fail."""
    for forward in (1.0, -1.0):
        for left, up in ((0.0, 0.0), (1e-5, 0.0), (1e-4, -1e-4), (0.01, 0.02), (0.0, -0.3)):
            estimator, rested = LeanFilter(), False
            for _ in range(1500):
                estimator.update([left, up, forward * sqrt(1.0 - left * left - up * up)], NO_RATE, DT_US)
                rested = rested or estimator.at_rest
                assert abs(estimator.pitch_deg) < 68.8
            assert rested, (left, up)


def trim_after(speed_mps, lean_deg):
    """Whether the trim is measured on a straight where speed and lean are so uncertain."""
    estimator = LeanFilter()
    feel(estimator, 0.1, [0.0, 1.1, 0.0])
    before = estimator.trim.variance
    assert estimator._p is not None
    estimator._p.set_variance(LEAN, radians(lean_deg) ** 2)
    estimator._p.set_variance(SPEED, (speed_mps / GRAVITY_MPS2) ** 2)
    feel(estimator, 0.42)  # a window, and the work on it
    return estimator.trim.variance < before


def test_the_trim_is_measured_while_the_speed_is_certain_to_8_mps_and_the_lean_to_1_4_degrees():
    assert trim_after(7.5, 1.0)
    assert not trim_after(8.5, 1.0)
    assert trim_after(7.5, 1.3)
    assert not trim_after(7.5, 3.0)
