"""The first guess of a ride: standstills, time in a hand, rough lean and speed, and the mounted part of a log."""

import numpy as np
import pytest
from kickstand_tools.common.errors import RefusedInput
from kickstand_tools.estimation.alignment import mounted_windows
from kickstand_tools.estimation.first_guess import in_hand, lean_and_speed, standing
from window_input import still_log, windows

G = 9.80665


def alternating(size):
    """Return 60 values with this standard deviation, shape (60, 3). Only the first component changes."""
    return np.outer(np.where(np.arange(60) % 2, size, -size), [1.0, 0.0, 0.0])


# The moving standard deviation over 9 windows is sqrt(80) / 9 = 0.9938 times the size.
@pytest.mark.parametrize(
    ("rate_dps", "force_g", "mean_dps", "speed", "still"),
    [
        (0.35, 0.0, 0.0, np.nan, True),
        (0.355, 0.0, 0.0, np.nan, False),
        (0.0, 0.01, 0.0, np.nan, True),
        (0.0, 0.0102, 0.0, np.nan, False),
        (0.0, 0.0, 3.9, np.nan, True),
        (0.0, 0.0, 4.1, np.nan, False),
        (0.0, 0.0, 0.0, 5.0, False),
    ],
)
def test_a_standing_bike_may_shake_a_little(rate_dps, force_g, mean_dps, speed, still):
    rate = np.radians(alternating(rate_dps) + [0.0, mean_dps, 0.0])
    assert standing(windows(60, rate, alternating(force_g) + [0.0, 1.0, 0.0], speed))[30] == still


def test_a_jolt_ends_a_standstill_for_four_windows():
    force = np.tile([0.0, 1.0, 0.0], (60, 1))
    force[30, 0] = 0.5
    assert np.flatnonzero(~standing(windows(60, force=force))).tolist() == list(range(26, 35))
    assert np.flatnonzero(~standing(windows(60, gap=np.arange(60) == 10))).tolist() == [10]


def held(*parts: tuple[int, int], deg=90.0):
    """Return in_hand() of a sensor that is turned by this angle from the first to before the last window of a part.

    Each result is a list of the first and the last window of each stretch.
    """
    force = np.tile([0.0, 1.0, 0.0], (1500, 1))
    for begin, end in parts:
        force[begin:end] = [np.sin(np.radians(deg)), np.cos(np.radians(deg)), 0.0]
    edges = (np.flatnonzero(np.diff([0, *hand.astype(int), 0])) for hand in in_hand(windows(1500, force=force)))
    return [(edge - np.arange(len(edge)) % 2).tolist() for edge in edges]


def test_a_hand_changes_the_mean_force_over_10_s():
    """The mean over 51 windows is beyond 35 degrees if 22 of them are on their side, because tan(35) = 0.7. So the hand
    is found from 4 windows before its beginning. It is sure 10 windows later, and perhaps 25 windows earlier."""
    assert held((600, 900)) == [[606, 893], [571, 928]]
    assert [len(held((600, 900), deg=deg)[0]) for deg in (34.9, 35.1)] == [0, 2]


@pytest.mark.parametrize(("between", "parts"), [(104, 1), (108, 2)])
def test_under_20_s_between_two_hands_count_as_a_hand(between, parts):
    assert len(held((400, 500), (500 + between, 600 + between))[0]) == 2 * parts


@pytest.mark.parametrize(("begin", "first"), [(101, 0), (105, 111)])
def test_under_20_s_at_either_end_count_as_a_hand(begin, first):
    assert held((begin, begin + 200))[0][0] == first
    assert held((1300 - begin, 1500 - begin))[0][1] == 1499 - first


def test_lean_and_speed_of_a_steady_bend():
    """The bike leans by 0.5 rad to the left at 15 m/s. The force gives the speed. A prior speed of 10 m/s has the
    weight of a yaw rate of 0.14 rad/s."""
    yaw = G * np.tan(0.5) / 15.0
    bend = windows(600, force=(0.0, 1.0 / np.cos(0.5), 0.0), rate=(-yaw * np.sin(0.5), yaw * np.cos(0.5), 0.0))
    still = np.zeros(600, dtype=bool)
    turning = yaw * np.cos(0.5)
    lean, speed = lean_and_speed(bend, still)
    by_hand = (np.tan(0.5) * turning * G + 0.14**2 * 10.0) / (turning**2 + 0.14**2)
    assert speed[300] == pytest.approx(by_hand) and lean[300] == pytest.approx(-np.arctan(by_hand * turning / G))
    logged = windows(600, bend.rate, bend.force, 12.0)
    assert lean_and_speed(logged, still)[1][300] == pytest.approx(12.0)
    lean, speed = lean_and_speed(windows(600, force=(np.sin(0.2), np.cos(0.2), 0.0)), ~still)
    assert lean[300] == pytest.approx(0.2) and speed[300] == 0.0


def mounted(log):
    result = mounted_windows(log)
    return float(result.edges[0]), float(result.edges[-1])


@pytest.mark.parametrize(
    ("hand_s", "first_s", "last_s"),
    [((0.0, 0.0), 0.0, 200.0), ((40.0, 0.0), 50.2, 200.0), ((0.0, 40.0), 0.0, 149.8), ((40.0, 30.0), 50.2, 159.8)],
)
def test_the_ride_begins_10_s_after_the_hand(hand_s, first_s, last_s):
    """The sensor is upside down in the hand. The mean over 10 s is right 1.2 s after it."""
    log = still_log(200.0)
    log.accel_g[(log.t_s < hand_s[0]) | (log.t_s >= 200.0 - hand_s[1])] *= -1.0
    assert mounted(log) == pytest.approx((first_s, last_s), abs=0.3)


def test_half_an_hour_of_a_ride_is_used():
    assert mounted(still_log(1830.0, 20.0))[1] == pytest.approx(1800.0, abs=0.1)


@pytest.mark.parametrize(
    ("force_g", "rate_dps", "gap"), [(19.9, 0.0, 0), (20.1, 0.0, 1), (1.0, 2499.0, 0), (1.0, 2501.0, 1)]
)
def test_readings_beyond_any_sensor_are_left_out(force_g, rate_dps, gap):
    log = still_log(60.0)
    log.accel_g[1000:1050, 1], log.gyro_dps[1000:1050, 2] = force_g, -rate_dps
    assert np.count_nonzero(mounted_windows(log).gap) == gap


@pytest.mark.parametrize("accel_g", [0.0, 30.0])
def test_a_log_without_usable_readings_is_too_short(accel_g):
    log = still_log(60.0)
    log.accel_g[1:] = accel_g
    with pytest.raises(RefusedInput, match="only 0 s of riding"):
        mounted_windows(log)
