"""A standstill is found by its low vibration. Each condition is tested just below and just above its limit.

The simulated log has 10 s of riding, 4 s that may be a standstill, and 10 s of riding. It has no speed.
"""

import numpy as np
import pytest
from kickstand_tools.analysis.ride import Channels
from kickstand_tools.analysis.stops import standing
from roads import RATE_HZ, Road

BEGIN_S, END_S = 10.0, 14.0
SHAKEN = {"pitch_rate_dps": 3.0, "yaw_rate_dps": 2.0, "up_g": 0.1}  # the road's shaking at 4.5 Hz
ROAD_HZ, ENGINE_HZ = RATE_HZ / 11.0, 3.0 * RATE_HZ / 7.0


def maybe(**changed: float) -> Channels:
    """Simulate the log. The name of a channel sets its shaking in the middle part, as a share of its shaking while
    riding; the default is 5 %. The code of this function shows what the other names change."""
    road = Road((24.0, 0.0))
    road.rests[:] = False
    ride = road.channels()
    t = road.t_s
    middle = (t >= BEGIN_S) & (t < END_S)
    for name, size in SHAKEN.items():
        shaking = np.where(middle, changed.get(name, 0.05), 1.0) * size * np.sin(2.0 * np.pi * ROAD_HZ * t)
        setattr(ride, name, getattr(ride, name) + shaking)
    engine = np.sin(2.0 * np.pi * ENGINE_HZ * t + 0.3)
    ride.pitch_rate_dps += changed.get("engine", 0.0) * engine * middle
    ride.pitch_rate_dps += changed.get("pitching", 0.0) * middle
    ride.yaw_rate_dps += changed.get("yawing", 0.0) * middle
    ride.yaw_rate_dps += changed.get("bends", 0.0) * np.sin(0.4 * np.pi * t) * ~middle
    ride.up_g += changed.get("heavier", 0.0) * middle
    ride.forward_g += changed.get("drifting", 0.0) * np.where(middle, t - BEGIN_S, 0.0)
    ride.rolling[middle] = np.arange(np.count_nonzero(middle)) % 10 < changed.get("rolling", 0.0)
    if "rested" in changed:  # "rested": the filter found a rest during the ride, with this upward force
        resting = (t >= 5.0) & (t < 7.0)
        ride.resting[resting] = 1.0
        ride.up_g[resting] = changed["rested"]
        ride.forward_g[t < 5.0] = 0.1
    return ride


@pytest.mark.parametrize("ridden_s", [(0.0, 24.0), (8.0, 15.0)])
def test_standstill_is_found_within_half_a_second(ridden_s):
    """The standstill is found within half a second even if most of the log is standstill."""
    ride = maybe()
    ride = ride.part((ride.t_s >= ridden_s[0]) & (ride.t_s < ridden_s[1]))
    times = ride.t_s[standing(ride)]
    assert times[0] == pytest.approx(BEGIN_S, abs=0.5)
    assert times[-1] == pytest.approx(END_S, abs=0.5)


@pytest.mark.parametrize(("seconds", "stands"), [(0.7, False), (2.0, True)])
def test_standstill_needs_a_second_of_quiet(seconds, stands):
    quiet, ridden = maybe(), maybe(pitch_rate_dps=1.0, yaw_rate_dps=1.0, up_g=1.0)
    still = (quiet.t_s >= BEGIN_S) & (quiet.t_s < BEGIN_S + seconds)
    for name in SHAKEN:
        setattr(ridden, name, np.where(still, getattr(quiet, name), getattr(ridden, name)))
    assert standing(ridden).any() == stands


def test_rest_from_the_beginning_is_found():
    road = Road((4.0, 0.0), (4.0, 3.0))
    ride = road.channels(resting=((road.t_s >= 2.0) & (road.t_s < 4.0)).astype(float))
    still = standing(ride)
    assert still[road.t_s < 3.99].all()
    assert not still[road.t_s > 4.01].any()
