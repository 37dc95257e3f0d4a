"""The first guess of a ride: standstills, time in a hand, rough lean and speed, and the mounted part of a log."""

import numpy as np
import pytest
from kickstand_tools.common.errors import RefusedInput
from kickstand_tools.estimation.alignment import mounted_windows
from kickstand_tools.estimation.first_guess import lean_and_speed
from window_input import still_log, windows

G = 9.80665


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
