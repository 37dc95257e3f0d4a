"""The first guess of a ride: standstills, time in a hand, rough lean and speed, and the mounted part of a log."""

import numpy as np
import pytest
from kickstand_tools.common.messages import RefusedInput
from kickstand_tools.estimation.alignment import mounted_windows
from kickstand_tools.estimation.windows import calm
from window_input import still_log, windows


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


@pytest.mark.parametrize(
    ("shaking", "speed", "expected"),
    [(0.1, np.nan, True), (0.6, np.nan, False), (0.6, 0.1, True), (2.4, 0.1, False), (0.1, 5.0, False)],
)
def test_standstill_is_where_nothing_changes(shaking, speed, expected):
    chance = np.random.default_rng(1).normal(size=(100, 3))
    assert np.mean(calm(windows(100, np.radians(shaking * chance), speed=speed))) == pytest.approx(
        float(expected), abs=0.1
    )
    assert not calm(windows(100, force=chance)).any()
