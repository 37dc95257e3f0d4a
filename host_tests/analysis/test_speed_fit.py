"""The speed of a log is combined with the measured force. The fit and its delay are compared with an independent
computation."""

import numpy as np
import pytest
from kickstand.units import STANDARD_GRAVITY
from kickstand_tools.analysis.stops import fitted_speed, speed_delay_s
from roads import RATE_HZ, Road, braking

BEGIN_S, STOP_S = 14.0, 18.0  # start and end of the braking, in s


def part_of(road: Road, every: int, scale=1.0, off_mps=0.0, late_s=0.0):
    """Return the ride until 2.5 s after the stop, with a wrong speed in the log.

    every: number of samples from one speed to the next.
    scale, off_mps: factor and offset of the wrong speed.
    late_s: delay of the speed.
    """
    ride = road.channels()
    ride.speed_mps[::every] = scale * np.interp(ride.t_s[::every] - late_s, road.t_s, road.mps) + off_mps
    return ride.part(ride.t_s < STOP_S + 2.5)


def test_fit_needs_several_speeds_during_braking():
    part = part_of(braking(20.0, 5.0), 50)
    acceleration = STANDARD_GRAVITY * part.forward_g
    begin = int(np.searchsorted(part.t_s, BEGIN_S))

    def fit(*times_s: float):
        part.speed_mps[:] = np.nan
        part.speed_mps[np.searchsorted(part.t_s, np.array(times_s) - 1e-6)] = 10.0
        return fitted_speed(part, begin, np.zeros(len(part.t_s)), acceleration, 0.0)

    assert fit(BEGIN_S + 1.0) is None
    assert fit(BEGIN_S - 4.1, BEGIN_S + 1.0) is None  # the fit needs four seconds of the ride before braking
    assert fit(BEGIN_S - 3.9, BEGIN_S + 1.0) is not None
    assert fit(BEGIN_S - 3.0, BEGIN_S - 1.0) is None
    assert fit(BEGIN_S - 3.0, BEGIN_S) is not None


def waves(seconds=60.0, late_s=0.0, size_mps2=1.5, every_s=1.0, period_s=5.0):
    """Simulate a speed that rises and falls like a sine. The speed in the log is delayed by late_s."""
    road = Road((seconds, 0.0))
    t, omega = road.t_s, 2.0 * np.pi / period_s
    ride = road.channels(forward_g=size_mps2 * np.cos(omega * t) / STANDARD_GRAVITY)
    step = round(every_s * RATE_HZ)
    ride.speed_mps[::step] = 20.0 + size_mps2 / omega * np.sin(omega * (t[::step] - late_s))
    return ride


@pytest.mark.parametrize("late_s", [-0.4, 0.0, 0.1, 0.42, 1.0, 1.43])
@pytest.mark.parametrize("every_s", [0.2, 1.0])
def test_delay_of_the_speed_is_found(late_s, every_s):
    assert speed_delay_s(waves(300.0, late_s, every_s=every_s)) == pytest.approx(late_s, abs=0.005)


@pytest.mark.parametrize("late_s", [-0.7, 1.7])
def test_impossible_delay_of_the_speed_is_ignored(late_s):
    assert speed_delay_s(waves(late_s=late_s)) == 0.0
