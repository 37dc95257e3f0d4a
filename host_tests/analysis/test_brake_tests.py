"""The definition of a stop and its figures are compared with exact formulas for stops without noise.

The simulated bike does not shake. A standstill is therefore found only if the lean filter detects rest, or if the log
has a speed of 0.
"""

import numpy as np
import pytest
from kickstand.units import STANDARD_GRAVITY
from kickstand_tools.analysis.stops import closes, find_stops, mfdd_mps2
from roads import REST_S, Road, braking

REST = (REST_S, 0.0)
USUAL = braking(20.0, 5.0)  # brakes from 14 to 18 s


def one_stop(ride):
    (stop,) = find_stops(ride)
    return stop


def with_speed(road, every=10, **changed):
    ride = road.channels(**changed)
    ride.speed_mps[::every] = road.mps[::every]
    return ride


def test_mfdd_follows_its_definition():
    """Only the braking from 0.8 v0 to 0.1 v0 counts, where v0 is the initial speed."""
    v = np.linspace(20.0, 0.0, 2001)
    assert mfdd_mps2(v, (20.0**2 - v * v) / (2 * 5.0)) == pytest.approx(5.0, rel=1e-9)
    # decelerate at 3 m/s2 down to 0.8 v0, then at 8 and at 5 m/s2, then at 3 m/s2 again
    pieces = [(20.0, 16.0, 3.0), (16.0, 9.0, 8.0), (9.0, 2.0, 5.0), (2.0, 0.0, 3.0)]
    distance = np.cumsum([0.0, *[(high**2 - low**2) / (2 * level) for high, low, level in pieces]])
    corners = np.array([20.0, *[low for _, low, _ in pieces]])
    bent = np.interp(-v * v, -corners * corners, distance)
    assert mfdd_mps2(v, bent) == pytest.approx((16.0**2 - 2.0**2) / (2 * (distance[3] - distance[1])), rel=1e-6)
    assert mfdd_mps2(np.array([9.0, 0.0]), np.zeros(2)) == np.inf  # from one sample to the next


@pytest.mark.parametrize("source", ["log", "integrated"])
def test_every_figure_of_a_stop_is_right(source):
    """A stop from 20 m/s at 5 m/s2 takes 4 s and 40 m, straight ahead."""
    stop = one_stop(with_speed(USUAL) if source == "log" else USUAL.channels())
    near = 1e-6 if source == "integrated" else 2e-3
    # the force is a mean over 0.2 s, and the start is one sample before the mean begins to change
    assert stop.speed_from == source and stop.start_s == pytest.approx(14.0 - 0.12, abs=1e-6)
    assert stop.stop_s == pytest.approx(18.0, abs=near) and stop.duration_s == stop.stop_s - stop.start_s
    # the last term of the distance is for the first sample, during which braking begins
    figures = (stop.initial_speed_mps, stop.distance_m, stop.mfdd_mps2, stop.peak_mps2)
    assert figures == pytest.approx((20.0, 40.0 + 20.0 * 0.12 - 5.0 * 0.02**2 / 4.0, 5.0, 5.0), rel=near)
    # the step of the force is averaged over 11 samples, and its corner over 3 samples
    assert stop.jerk_mps3 == pytest.approx(5.0 / 0.22 * 41 / 44, rel=near) and stop.side_m == stop.heading_deg == 0.0


@pytest.mark.parametrize(
    ("road", "initial_mps", "mfdd"),
    [
        (braking(9.8 / 3.6, 3.0), None, None),
        (braking(10.2 / 3.6, 3.0), 10.2 / 3.6, 3.0),  # a stop begins above 10 km/h
        (braking(20.0, 0.97), None, None),
        (braking(20.0, 1.03), 20.0, 1.03),  # the deceleration is at least 1 m/s2
        (braking(30.0, 28.5), 30.0, 28.5),
        (braking(30.0, 31.5), None, None),  # the deceleration is at most 30 m/s2
        (braking(10.0, 0.4), None, None),  # rolling out
        (braking(67.6, 1.04), 1.04 * 60.0, 1.04),  # only the last minute of a stop counts
        # a short pause is bridged; after a longer one the braking begins too slowly
        (Road(REST, (5.0, 4.0), (3.0, 0.0), (3.9, -5.0), (0.26, 0.0), (0.1, -5.0), REST), 20.0, None),
        (Road(REST, (5.0, 4.0), (3.0, 0.0), (3.9, -5.0), (0.56, 0.0), (0.1, -5.0), REST), None, None),
        # rolling out after braking is left out
        (Road(REST, (5.0, 4.0), (3.0, 0.0), (3.9, -5.0), (1.25, -0.4), REST), 20.0, 5.0),
        (Road(REST, (5.0, 4.0), (4.0, 0.0), (4.0, -5.0), REST, rate_hz=200.0), 20.0, 5.0),
    ],
)
def test_limits_of_a_stop(road, initial_mps, mfdd):
    stops = find_stops(road.channels())
    assert len(stops) == (initial_mps is not None)
    for stop in stops:
        assert stop.initial_speed_mps == pytest.approx(initial_mps, rel=0.01, abs=0.05)
        assert mfdd is None or stop.mfdd_mps2 == pytest.approx(mfdd, rel=0.01)


def test_each_stop_begins_after_the_previous_standstill():
    legs = []
    for mps, mps2 in (20.0, 6.0), (12.0, 3.0), (25.0, 8.0):
        legs += [(3.0, 0.0), (mps / 4.0, 4.0), (3.0, 0.0), (mps / mps2, -mps2), (3.0, 0.0)]
    stops = find_stops(Road(*legs).channels())
    assert [stop.mfdd_mps2 for stop in stops] == pytest.approx([6.0, 3.0, 8.0], rel=0.01)
    assert [stop.initial_speed_mps for stop in stops] == pytest.approx([20.0, 12.0, 25.0], rel=0.01)


def test_a_stop_needs_its_standstill_but_not_the_one_before():
    ride = USUAL.channels()
    assert one_stop(ride.part(ride.t_s >= 11.0)).initial_speed_mps == pytest.approx(20.0, rel=0.003)
    assert find_stops(ride.part(ride.t_s < 17.5)) == find_stops(with_speed(USUAL).part(ride.t_s < 17.5)) == []
    assert [find_stops(ride.part(slice(0, n))) for n in (1, 2, 5, 40)] == [[]] * 4


@pytest.mark.parametrize(
    ("engine_mps2", "hard", "earlier_s"),
    [
        (0.2, [(17.2 / 6.0, -6.0)], 0.12),  # below 4 % of the full deceleration, braking has not begun
        # from 4 % to 15 %, at most the last 0.6 s before the deceleration exceeds 15 % are braking
        (0.3, [(16.8 / 6.0, -6.0)], 0.71),
        (0.8, [(14.8 / 6.0, -6.0)], 0.71),
        (1.0, [(14.0 / 6.0, -6.0)], 4.08),  # above 15 % of the full deceleration, all of it is braking
        (0.24, [(17.04 / 1.4, -1.4)], 0.71),  # a deceleration below 0.25 m/s2 is a slope or the wind
        (0.27, [(16.92 / 1.4, -1.4)], 4.08),
        # The full deceleration is a quantile of the last two seconds: here 6 m/s2, then 2 m/s2
        (0.8, [(2.0, -6.0), (1.4, -2.0)], 0.71),
        (0.8, [(10.0 / 9.0, -9.0), (2.4, -2.0)], 4.08),
    ],
)
def test_the_start_of_braking_is_found(engine_mps2, hard, earlier_s):
    """The engine alone slows the bike for 4 s before the rider brakes."""
    stop = one_stop(Road(REST, (6.0, 3.0), (3.0, 0.0), (4.0, -engine_mps2), *hard, REST).channels())
    assert REST_S + 6.0 + 3.0 + 4.0 - stop.start_s == pytest.approx(earlier_s, abs=0.025)


def pitched(pitch_deg):
    rate = np.gradient(np.radians(pitch_deg), USUAL.t_s)
    change = np.sin(np.radians(pitch_deg)) - 0.65 * np.gradient(rate, USUAL.t_s) / STANDARD_GRAVITY
    return {"pitch_rate_dps": np.degrees(rate), "forward_g": USUAL.mps2 / STANDARD_GRAVITY + change}


def in_a_bend(side):
    """30 degrees of lean with a yaw rate of 8 deg/s for 2 s. The gyro shows a pitch rate, but the nose stays level."""
    lean, rate = (np.where((USUAL.t_s >= 14.5) & (USUAL.t_s < 16.5), size * side, 0.0) for size in (30.0, -8.0))
    pitch, yaw = -rate * np.sin(np.radians(lean)), rate * np.cos(np.radians(lean))
    return {"lean_deg": lean, "pitch_rate_dps": pitch, "yaw_rate_dps": yaw}


CONSTANT, AFTER_S = np.ones(len(USUAL.t_s)), USUAL.t_s - 18.0
FORCE = USUAL.mps2 / STANDARD_GRAVITY
REBOUND = np.where((AFTER_S > -0.01) & (AFTER_S < 0.45), 0.2 * np.sin(2 * np.pi * AFTER_S / 0.46), 0.0)


@pytest.mark.parametrize(
    ("changed", "heading_deg"),
    [
        ({"forward_g": FORCE - 0.33}, 0.0),  # the steepest streets have a slope of 19 degrees
        ({"forward_g": FORCE + 0.33}, 0.0),
        ({"forward_g": FORCE + REBOUND}, 0.0),  # the fork rebounds for less than half a second
        ({"pitch_rate_dps": 1.5 * CONSTANT, "yaw_rate_dps": -2.5 * CONSTANT}, 0.0),  # the gyro's bias
        (pitched(np.interp(USUAL.t_s, [13.7, 14.1, 17.8, 18.0], [0.0, -4.0, -4.0, 0.0])), 0.0),  # the bike dives
        (in_a_bend(-1.0), 16.0 * np.cos(np.radians(30.0))),
        (in_a_bend(1.0), -16.0 * np.cos(np.radians(30.0))),
    ],
)
def test_slopes_dives_and_bends_do_not_change_the_figures(changed, heading_deg):
    stop = one_stop(USUAL.channels(**changed))
    assert stop.mfdd_mps2 == pytest.approx(5.0, rel=0.005) and stop.initial_speed_mps == pytest.approx(20.0, rel=0.005)
    assert stop.heading_deg == pytest.approx(heading_deg, rel=0.01, abs=1e-6)
    assert np.sign(np.round(stop.side_m, 3)) == np.sign(heading_deg)


def test_the_deviation_from_the_straight_line_is_right():
    """The bike turns left at 0.5 deg/s for 4 s. The deviation is the integral of (20 - 5 t) sin(0.5 deg/s t)."""
    yaw = np.where((USUAL.t_s >= 14.0) & (USUAL.t_s < 18.0), 0.5, 0.0)
    stop, t = one_stop(USUAL.channels(yaw_rate_dps=yaw)), np.linspace(0.0, 4.0, 4001)
    # the heading is measured until the speed is 2 % of the initial speed
    assert stop.heading_deg == pytest.approx(0.5 * (0.98 * 4.0 + 0.01), abs=0.002)
    assert stop.side_m == pytest.approx(np.trapezoid((20.0 - 5.0 * t) * np.sin(np.radians(0.5 * t)), t), abs=0.02)
    # In a turn of 40 degrees, only a speed in the log proves a stop
    assert find_stops(USUAL.channels(yaw_rate_dps=20.0 * yaw)) == []
    assert len(find_stops(with_speed(USUAL, yaw_rate_dps=20.0 * yaw))) == 1


@pytest.mark.parametrize(("off_g", "counts"), [(0.11, True), (0.15, False)])
def test_a_stop_whose_speed_does_not_close_is_rejected(off_g, counts):
    """Integrated back to the previous standstill, the speed must be within 3 m/s plus 0.7 m/s per second of riding."""
    ride = USUAL.channels()
    ride.forward_g[(USUAL.t_s > 5.0) & (USUAL.t_s < 14.0)] -= off_g
    assert len(find_stops(ride)) == counts
    assert closes(40.0, seconds=40.0) and not closes(40.0, seconds=20.0)  # after 40 s the integral proves nothing


def test_the_speed_in_the_log_corrects_the_integral():
    """The accelerometer's slope is 3 % too large."""
    assert one_stop(USUAL.channels(forward_g=1.03 * FORCE)).mfdd_mps2 == pytest.approx(5.15, rel=0.003)
    stop = one_stop(with_speed(USUAL, forward_g=1.03 * FORCE))
    assert stop.mfdd_mps2 == pytest.approx(5.0, rel=0.003) and stop.initial_speed_mps == pytest.approx(20.0, rel=0.002)
