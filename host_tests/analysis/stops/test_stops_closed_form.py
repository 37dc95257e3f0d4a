"""The definition of a stop and its figures are compared with exact formulas for stops without noise.

The simulated bike does not shake. A standstill is therefore found only if the lean filter detects rest, or if the log
has a speed of 0.
"""

import numpy as np
import pytest
from kickstand.units import STANDARD_GRAVITY
from kickstand_tools.analysis.stops.brake_test import closes, find_stops, stops_by_speed, stops_of
from kickstand_tools.analysis.stops.standstill import standing
from roads import RATE_HZ, REST_S, Road, braking


@pytest.mark.parametrize(
    ("mps", "mps2", "counts"),
    [
        (9.8 / 3.6, 3.0, False),
        (10.2 / 3.6, 3.0, True),  # a stop begins above 10 km/h
        (20.0, 0.97, False),
        (20.0, 1.03, True),  # the deceleration is at least 1 m/s2
        (30.0, 28.5, True),
        (30.0, 31.5, False),  # the deceleration is at most 30 m/s2
    ],
)
def test_limits_of_a_stop(mps, mps2, counts):
    found = find_stops(braking(mps, mps2).channels())
    assert len(found) == counts
    if counts:
        assert found[0].initial_speed_mps == pytest.approx(mps, rel=0.01, abs=0.05)
        assert found[0].mfdd_mps2 == pytest.approx(mps2, rel=0.01)


@pytest.mark.parametrize("speed", ["log", "integrated"])
def test_every_figure_of_a_stop_is_right(speed):
    """A stop from 20 m/s at 5 m/s2 takes 4 s and 40 m, straight ahead."""
    road = braking(20.0, 5.0)
    ride = road.channels()
    if speed == "log":
        ride.speed_mps[::10] = road.mps[::10]
    (stop,) = find_stops(ride)
    assert stop.speed_from == speed
    # the force is a mean over 0.2 s, and the start is one sample before the mean begins to change
    assert stop.start_s == pytest.approx(14.0 - 0.12, abs=1e-6)
    near = 1e-6 if speed == "integrated" else 2e-3
    assert stop.stop_s == pytest.approx(18.0, abs=near)
    assert stop.duration_s == stop.stop_s - stop.start_s
    assert stop.initial_speed_mps == pytest.approx(20.0, rel=near)
    # the last term is for the first sample, during which braking begins
    assert stop.distance_m == pytest.approx(40.0 + 20.0 * 0.12 - 5.0 * 0.02**2 / 4.0, rel=near)
    assert stop.mfdd_mps2 == pytest.approx(5.0, rel=near)
    assert stop.peak_mps2 == pytest.approx(5.0, rel=near)
    # the step of the force is averaged over 11 samples, and its corner over 3 samples
    assert stop.jerk_mps3 == pytest.approx(5.0 / 0.22 * 41 / 44, rel=near)
    assert stop.side_m == stop.heading_deg == 0.0


def test_rebound_of_the_fork_does_not_change_the_end():
    """When the bike has nearly stopped, its fork throws the sensor back and forth. Below a fiftieth of the initial
    speed a constant deceleration is therefore assumed. A stop from 60 m/s at 5 m/s2 takes 12 s and 360 m.
    """
    road = braking(60.0, 5.0)
    ride = road.channels()
    end = int(np.argmax(road.rests & (road.t_s > 20.0)))
    # the forces of the rebound add up to zero, so the rebound does not change the speed
    ride.forward_g[end - 6 : end] += 0.1 * np.array([1.0, -1.0, -1.0, 1.0, 1.0, -1.0])
    (stop,) = find_stops(ride)
    assert stop.stop_s == pytest.approx(REST_S + 15.0 + 4.0 + 12.0, abs=1e-6)
    assert stop.distance_m == pytest.approx(360.0 + 60.0 * 0.12, abs=0.002)


def test_jerk_is_the_steepest_change_of_the_force():
    """The deceleration rises to 6 m/s2 at a rate of 10 m/s3, and stays constant. At the end the deceleration falls at a
    rate of 20 m/s3, which is the larger jerk."""
    t = np.arange(0.0, 30.0, 1.0 / RATE_HZ)
    braked = np.interp(t, [15.0, 15.6, 17.6, 17.9, 19.0], [0.0, 6.0, 6.0, 0.0, 0.0])
    lost = np.concatenate(([0.0], np.cumsum((braked[1:] + braked[:-1]) / 2.0 / RATE_HZ)))[-1]
    road = Road((REST_S, 0.0), (lost / 2.0, 2.0), (30.0 - REST_S - lost / 2.0, 0.0))
    road.mps2 = road.mps2 - braked[: len(road.t_s)]
    road.rests = (road.t_s < REST_S) | (road.t_s > 17.9)
    (stop,) = find_stops(road.channels())
    # the force is smoothed twice over 0.2 s, which makes the jerk less than 20 m/s3
    assert stop.jerk_mps3 == pytest.approx(20.0, rel=0.15)
    assert stop.peak_mps2 == pytest.approx(6.0, rel=0.01)
    assert stop.initial_speed_mps == pytest.approx(lost, rel=0.01)


@pytest.mark.parametrize(
    ("engine_mps2", "mps2", "earlier_s"),
    [
        (0.2, 6.0, 0.12),  # below 4 % of the full deceleration, braking has not begun
        # from 4 % to 15 %, at most the last 0.6 s before the deceleration exceeds 15 % are braking
        (0.3, 6.0, 0.71),
        (0.8, 6.0, 0.71),
        (1.0, 6.0, 4.08),  # above 15 % of the full deceleration, all of it is braking
        (0.24, 1.4, 0.71),  # a deceleration below 0.25 m/s2 is a slope or the wind, even above 15 %
        (0.27, 1.4, 4.08),
    ],
)
def test_start_of_braking_is_found(engine_mps2, mps2, earlier_s):
    """The engine alone slows the bike for 4 s before the rider brakes."""
    mps = 18.0
    seconds = (mps - 4.0 * engine_mps2) / mps2
    road = Road((REST_S, 0.0), (6.0, 3.0), (3.0, 0.0), (4.0, -engine_mps2), (seconds, -mps2), (REST_S, 0.0))
    (stop,) = find_stops(road.channels())
    assert REST_S + 6.0 + 3.0 + 4.0 - stop.start_s == pytest.approx(earlier_s, abs=0.025)


@pytest.mark.parametrize(("pause_s", "counts"), [(0.26, True), (0.56, False)])
def test_brief_pause_before_the_standstill_is_bridged(pause_s, counts):
    """A stop continues after a short pause of braking. A longer pause ends the stop, and the braking after it begins
    too slowly to count as a stop."""
    road = Road(*((REST_S, 0.0), (5.0, 4.0), (3.0, 0.0), (3.9, -5.0), (pause_s, 0.0), (0.1, -5.0), (REST_S, 0.0)))
    found = find_stops(road.channels())
    assert len(found) == counts
    if counts:
        assert found[0].initial_speed_mps == pytest.approx(20.0, rel=0.01)


def test_no_stop_is_longer_than_a_minute():
    """A stop from 67.6 m/s at 1.04 m/s2 takes 65 s. Only the last 60 s of a stop are used."""
    (stop,) = find_stops(braking(67.6, 1.04).channels())
    assert stop.initial_speed_mps == pytest.approx(1.04 * 60.0, rel=0.005)


@pytest.mark.parametrize(("missing_s", "initial_mps"), [(0.46, 20.0), (0.56, 12.2)])
def test_missing_readings_are_bridged_for_half_a_second(missing_s, initial_mps):
    """Readings are missing from 15 s on, one second after braking began. A gap of up to half a second is bridged. After
    a longer gap the stop begins at the end of the gap."""
    road = braking(20.0, 5.0)
    there = (road.t_s < 15.001) | (road.t_s > 15.0 + missing_s - 1e-6)
    (stop,) = find_stops(road.channels().part(there))
    assert stop.initial_speed_mps == pytest.approx(initial_mps, rel=0.01)


def test_only_readings_after_the_last_gap_are_integrated():
    """The readings of the stop have two gaps of 0.9 s. The stop begins after the last gap."""
    road = braking(20.0, 2.0)
    there = ~((road.t_s > 14.5) & (road.t_s < 15.4)) & ~((road.t_s > 17.0) & (road.t_s < 17.9))
    (stop,) = find_stops(road.channels().part(there))
    assert stop.start_s == pytest.approx(17.9, abs=0.03)


class TestStandstill:
    """The standstill after the stop shows the slope and the gyro's reading at rest."""

    def disturbed(self, begin_s: float, end_s: float, off_g: float = 0.1) -> float:
        """Return the MFDD if the force has an error of off_g from begin_s to end_s, counted from the standstill at
        18 s."""
        road = braking(20.0, 5.0)
        ride = road.channels()
        ride.forward_g[(road.t_s > 18.0 + begin_s - 0.01) & (road.t_s < 18.0 + end_s - 0.01)] += off_g
        (stop,) = find_stops(ride)
        return stop.mfdd_mps2

    def test_slope_is_from_0_5_to_2_5_seconds_after_the_stop(self):
        right = self.disturbed(9.0, 9.0)
        assert right == pytest.approx(5.0, rel=0.002)
        assert self.disturbed(2.56, 4.0) == pytest.approx(right, rel=1e-4)
        # 0.1 g during one of the 2 s before braking counts as a slope of 0.49 m/s2
        assert self.disturbed(0.5, 1.5) == pytest.approx(right + 0.49, rel=0.02)
        assert self.disturbed(1.5, 2.5) == pytest.approx(right + 0.49, rel=0.02)

    def test_rebound_of_the_fork_is_not_part_of_the_slope(self):
        """The mean force of the rebound is zero, so it does not change the speed. The rebound lasts less than half a
        second."""
        road = braking(20.0, 5.0)
        ride = road.channels()
        after = road.t_s - 18.0
        ride.forward_g += np.where((after > -0.01) & (after < 0.45), 0.2 * np.sin(2 * np.pi * after / 0.46), 0.0)
        (stop,) = find_stops(ride)
        assert stop.mfdd_mps2 == pytest.approx(5.0, rel=0.004)

    def test_reading_of_the_gyro_at_rest_is_its_bias(self):
        road = braking(20.0, 5.0)
        ride = road.channels(pitch_rate_dps=np.full(len(road.t_s), 1.5), yaw_rate_dps=np.full(len(road.t_s), -2.5))
        (stop,) = find_stops(ride)
        assert stop.mfdd_mps2 == pytest.approx(5.0, rel=0.002)
        assert stop.heading_deg == pytest.approx(0.0, abs=1e-6)
        assert stop.side_m == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize("up", [-0.33, 0.33])
def test_steep_road_does_not_change_the_figures(up):
    """The steepest streets have a slope of 19 degrees. The force at standstill shows the slope."""
    road = braking(20.0, 5.0)
    (stop,) = find_stops(road.channels(forward_g=road.mps2 / STANDARD_GRAVITY + up))
    assert stop.mfdd_mps2 == pytest.approx(5.0, rel=0.002)


@pytest.mark.parametrize(("samples", "counts"), [(10, 0), (11, 1)])
def test_brief_standstill_shows_no_slope(samples, counts):
    """The road falls by 10 %. A brief standstill does not show the road's slope, so the stop does not count. A longer
    standstill shows the slope."""
    road = braking(20.0, 5.0)
    still = (road.t_s >= 18.0 - 1e-6) & (road.t_s < 18.0 + samples / RATE_HZ - 1e-6)
    found = stops_of(road.channels(forward_g=road.mps2 / STANDARD_GRAVITY - 0.1), still)
    assert [stop.mfdd_mps2 for stop in found] == pytest.approx([5.0 - 2.5 / 11] * counts, rel=0.002)


def test_dive_is_not_braking():
    """The nose is 4 degrees down while the bike brakes. The sensor then measures a part of gravity along the bike,
    which is no deceleration. When braking begins, the nose goes down at 10 deg/s. A sensor 0.65 m above the hubs is
    then 0.11 m/s faster than the bike."""
    road = braking(20.0, 5.0)
    ride = road.channels()
    pitch = np.interp(road.t_s, [13.7, 14.1, 17.8, 18.0], [0.0, -4.0, -4.0, 0.0])
    rate = np.gradient(np.radians(pitch), road.t_s)
    ride.pitch_rate_dps = np.degrees(rate)
    ride.forward_g += np.sin(np.radians(pitch)) - 0.65 * np.gradient(rate, road.t_s) / STANDARD_GRAVITY
    (stop,) = find_stops(ride)
    assert stop.mfdd_mps2 == pytest.approx(5.0, rel=0.005)
    assert stop.initial_speed_mps == pytest.approx(20.0, abs=0.05)


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_bend_is_not_a_dive(side):
    """The bike brakes in a bend at 30 degrees of lean, with a yaw rate of 8 deg/s for 2 s. Because of the lean, the
    gyro shows a pitch rate, but the nose stays level."""
    road = braking(20.0, 5.0)
    turning = (road.t_s >= 14.5) & (road.t_s < 16.5)
    lean = np.where(turning, 30.0 * side, 0.0)
    rate = np.where(turning, -8.0 * side, 0.0)  # the yaw rate is positive to the left
    ride = road.channels(
        lean_deg=lean, pitch_rate_dps=-rate * np.sin(np.radians(lean)), yaw_rate_dps=rate * np.cos(np.radians(lean))
    )
    (stop,) = find_stops(ride)
    assert stop.mfdd_mps2 == pytest.approx(5.0, rel=0.004)
    assert stop.heading_deg == pytest.approx(-16.0 * side * np.cos(np.radians(30.0)), rel=0.01)
    assert np.sign(stop.side_m) == -side


def test_deviation_from_the_straight_line_is_right():
    """The bike turns left at 0.5 deg/s for 4 s while it brakes from 20 m/s at 5 m/s2. The bike's deviation from the
    straight line is the integral of (20 - 5 t) sin(0.5 deg/s t), where t is the time since the start of braking."""
    road = braking(20.0, 5.0)
    ride = road.channels(yaw_rate_dps=np.where((road.t_s >= 14.0) & (road.t_s < 18.0), 0.5, 0.0))
    (stop,) = find_stops(ride)
    # the heading is measured until the speed is 2 % of the initial speed
    assert stop.heading_deg == pytest.approx(0.5 * (0.98 * 4.0 + 0.01), abs=0.002)
    t = np.linspace(0.0, 4.0, 4001)
    assert stop.side_m == pytest.approx(np.trapezoid((20.0 - 5.0 * t) * np.sin(np.radians(0.5 * t)), t), abs=0.02)
    ride.yaw_rate_dps *= 20.0  # the bike now turns by 40 degrees, so only a speed in the log would prove a stop
    assert find_stops(ride) == []
    ride.speed_mps[::10] = road.mps[::10]
    assert len(find_stops(ride)) == 1


def test_each_stop_begins_after_the_previous_standstill():
    """Each stop has its own initial speed and start, also if hard and soft stops alternate."""
    legs = []
    for mps, mps2 in (20.0, 6.0), (12.0, 3.0), (25.0, 8.0):
        legs += [(3.0, 0.0), (mps / 4.0, 4.0), (3.0, 0.0), (mps / mps2, -mps2), (3.0, 0.0)]
    found = find_stops(Road(*legs).channels())
    assert [stop.mfdd_mps2 for stop in found] == pytest.approx([6.0, 3.0, 8.0], rel=0.01)
    assert [stop.initial_speed_mps for stop in found] == pytest.approx([20.0, 12.0, 25.0], rel=0.01)


@pytest.mark.parametrize(("off_g", "counts"), [(0.11, True), (0.15, False)])
def test_stop_with_an_open_speed_is_rejected(off_g, counts):
    """The speed is integrated back to the previous standstill, where it must be near 0. The limit is 3 m/s plus 0.7 m/s
    per second of riding. An error of 0.15 g over 8.8 s would give 13 m/s."""
    road = braking(20.0, 5.0, before_s=4.0)
    ride = road.channels()
    ride.forward_g[(road.t_s > 5.0) & (road.t_s < 14.0)] -= off_g
    assert len(find_stops(ride)) == counts
    assert closes(40.0, seconds=40.0) and not closes(40.0, seconds=20.0)  # after 40 s the integral proves nothing


def test_rolling_out_is_not_braking():
    assert find_stops(braking(10.0, 0.4).channels()) == []


def test_speed_in_the_log_corrects_the_integral():
    """The accelerometer's slope is 3 % too large. The log's speed corrects the accelerometer's error."""
    road = braking(20.0, 5.0)
    ride = road.channels(forward_g=1.03 * road.mps2 / STANDARD_GRAVITY)
    (stop,) = find_stops(ride)
    assert stop.mfdd_mps2 == pytest.approx(5.15, rel=0.003)
    ride.speed_mps[::10] = road.mps[::10]
    (stop,) = find_stops(ride)
    assert stop.mfdd_mps2 == pytest.approx(5.0, rel=0.003)
    assert stop.initial_speed_mps == pytest.approx(20.0, rel=0.002)


@pytest.mark.parametrize(("mps2", "counts"), [(1.45, False), (1.55, True)])
def test_hard_stop_is_shown_by_the_speed_alone(mps2, counts):
    """The speed alone shows a stop if it falls by more than 1.5 m/s2, from over 10 km/h."""
    road = braking(20.0, mps2)
    ride = road.channels()
    ride.speed_mps[::50] = road.mps[::50]
    assert stops_by_speed(ride) is counts
    slow = braking(2.7, 4.0)
    ride = slow.channels()
    ride.speed_mps[::5] = slow.mps[::5]
    assert not stops_by_speed(ride)


@pytest.mark.parametrize(
    ("hard", "easy", "counts"), [((4.0, -4.0), (8.0, -0.5), True), ((4.0, -9.0), (16.0, -0.25), False)]
)
def test_stop_by_speed_alone_takes_at_most_15_seconds(hard, easy, counts):
    """Braking from 20 m/s within 12 s is a stop. Braking from 40 m/s within 20 s is no stop, because only the last 15 s
    are considered."""
    top_mps = -hard[0] * hard[1] - easy[0] * easy[1]
    road = Road((REST_S, 0.0), (top_mps / 4.0, 4.0), (3.0, 0.0), hard, easy, (REST_S, 0.0))
    ride = road.channels()
    ride.speed_mps[::50] = road.mps[::50]
    assert stops_by_speed(ride) is counts


@pytest.mark.parametrize(("age_s", "stands"), [(2.9, True), (3.1, False)])
def test_old_speed_shows_no_standstill(age_s, stands):
    """The log's only speed is 0 m/s. Three seconds later the vehicle may be moving again."""
    road = Road((10.0, 0.0), (20.0, 0.5))
    road.rests[:] = False
    ride = road.channels()
    ride.speed_mps[50] = 0.0
    still = standing(ride)
    assert not still[:50].any()
    assert still[round((1.0 + age_s) * RATE_HZ)] == stands


def test_log_may_begin_on_the_move():
    """The log begins while the vehicle moves, so it has no standstill before the stop."""
    ride = braking(20.0, 5.0).channels()
    (stop,) = find_stops(ride.part(ride.t_s >= 11.0))
    assert stop.initial_speed_mps == pytest.approx(20.0, rel=0.003)


def test_stops_are_searched_at_50_samples_per_second():
    """The log has 200 samples per second. Each value is the mean of four samples, for example at 13.88, 13.885, 13.89
    and 13.895 s."""
    road = Road((REST_S, 0.0), (5.0, 4.0), (4.0, 0.0), (4.0, -5.0), (REST_S, 0.0), rate_hz=200.0)
    (stop,) = find_stops(road.channels())
    assert stop.start_s == pytest.approx(13.8875, abs=1e-6)
    assert stop.mfdd_mps2 == pytest.approx(5.0, rel=0.002)


def test_the_straight_line_is_the_direction_just_before_braking():
    """The straight line has the mean direction of the first tenth of a second of the stop. In that time the vehicle
    turns by half a degree, so the mean is a quarter of a degree from both ends."""
    road = braking(20.0, 5.0)
    begin = 14.0 - 0.12
    ride = road.channels(yaw_rate_dps=np.where((road.t_s > begin - 0.01) & (road.t_s < begin + 0.09), 5.0, 0.0))
    (stop,) = find_stops(ride)
    assert stop.side_m == pytest.approx(42.4 * np.sin(np.radians(0.25)), rel=0.25)


@pytest.mark.parametrize(
    ("hard", "easy", "earlier_s"), [((2.0, -6.0), (1.4, -2.0), 0.71), ((10.0 / 9.0, -9.0), (2.4, -2.0), 4.08)]
)
def test_full_deceleration_is_from_the_last_two_seconds(hard, easy, earlier_s):
    """The rider brakes hard and then eases the brake to 2 m/s2. Before the rider brakes, the engine slows the bike by
    0.8 m/s2. A stop begins at 15 % of the full deceleration.

    * If the hard braking fills a quarter of the last two seconds, it is the full deceleration. 15 % of its 6 m/s2 are
      0.9 m/s2, so the engine's braking does not count.
    * If the hard braking ends earlier, the full deceleration is 2 m/s2, and 15 % are 0.3 m/s2. The stop begins with the
      engine's braking.
    """
    legs = (REST_S, 0.0), (6.0, 3.0), (3.0, 0.0), (4.0, -0.8), hard, easy, (REST_S, 0.0)
    (stop,) = find_stops(Road(*legs).channels())
    assert REST_S + 6.0 + 3.0 + 4.0 - stop.start_s == pytest.approx(earlier_s, abs=0.025)


def test_rolling_out_after_braking_is_left_out():
    """With released brakes the bike decelerates by 0.4 m/s2 at the end. The stop ends before the brakes are
    released."""
    legs = (REST_S, 0.0), (5.0, 4.0), (3.0, 0.0), (3.9, -5.0), (1.25, -0.4), (REST_S, 0.0)
    (stop,) = find_stops(Road(*legs).channels())
    assert stop.initial_speed_mps == pytest.approx(20.0, rel=1e-3)
    assert stop.mfdd_mps2 == pytest.approx(5.0, rel=1e-3)
