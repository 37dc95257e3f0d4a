"""The speed of a log is combined with the measured force. The fit and its delay are compared with an independent
computation."""

import numpy as np
import pytest
from kickstand.units import STANDARD_GRAVITY
from kickstand_tools.analysis.stops.speed_fit import fitted_speed, speed_delay_s
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


def conditioned(part, speed, acceleration, delay_s):
    """Compute the estimated speed as the mean of a normal distribution, conditioned on the measured speeds.

    The errors have these standard deviations:

    * the scale of the integrated speed: 1 %.
    * the delay of the log's speed: 0.05 s.
    * the error of the acceleration due to the road's slope: 0.05 m/s2 at the end of the part. Backwards from there this
      error is a random walk of 0.1 m/s2 per root second. The error is linear between points half a second apart.
    * each measured speed: 0.05 m/s.
    """
    time = part.t_s
    values = np.flatnonzero(~np.isnan(part.speed_mps))
    values = values[time[values] - delay_s >= BEGIN_S - 4.0 - 1e-6]
    sample_index = np.array([int(np.argmin(np.abs(time - (time[value] - delay_s)))) for value in values])
    count = int(np.ceil((time[-1] - min(time[sample_index[0]], BEGIN_S) + 0.5) / 0.5 - 1e-9))
    knots = time[-1] - 0.5 * np.arange(count)
    age = np.arange(count)
    covariance = 0.05**2 + 0.1**2 * 0.5 * np.minimum(age[:, None], age[None, :])
    slopes = []  # how an acceleration error at each point changes the speed of each sample
    for k in range(count):
        hat = np.interp(-time, -knots, np.eye(count)[k])
        steps = np.append(np.diff(time) * (hat[1:] + hat[:-1]) / 2.0, 0.0)
        slopes.append(np.cumsum(steps[::-1])[::-1])
    slopes = np.array(slopes).T
    full = np.zeros((len(time), count + 2))
    full[:, 0], full[:, 1:-1] = speed, slopes
    design = full[sample_index]
    n = 5  # the acceleration is averaged over 0.2 s, which is five samples on each side
    design[:, -1] = [-np.mean(np.pad(acceleration, n, mode="edge")[k : k + 2 * n + 1]) for k in sample_index]
    prior = np.zeros((count + 2, count + 2))
    prior[0, 0], prior[-1, -1], prior[1:-1, 1:-1] = 0.01**2, 0.05**2, covariance
    gain = prior @ design.T @ np.linalg.inv(design @ prior @ design.T + 0.05**2 * np.eye(len(design)))
    return speed + full @ (gain @ (part.speed_mps[values] - speed[sample_index]))


@pytest.mark.parametrize(
    "wrong",
    [
        {"every": 50},
        {"every": 10, "scale": 1.05},
        {"every": 50, "scale": 0.97, "off_mps": 0.3},
        {"every": 25, "late_s": 0.3},
        {"every": 50, "late_s": 0.5, "off_mps": -0.4},
    ],
)
@pytest.mark.parametrize("delay_s", [0.0, 0.4])
def test_fit_is_the_conditional_mean(wrong, delay_s):
    part = part_of(braking(20.0, 5.0), **wrong)
    acceleration = STANDARD_GRAVITY * part.forward_g
    integrated = np.concatenate(([0.0], np.cumsum((acceleration[1:] + acceleration[:-1]) / 2.0 / RATE_HZ)))
    begin = int(np.searchsorted(part.t_s, BEGIN_S))
    fitted = fitted_speed(part, begin, integrated, acceleration, delay_s)
    assert fitted is not None
    want = conditioned(part, integrated, acceleration, delay_s)
    shown = slice(begin - 50, None)
    assert fitted[shown] == pytest.approx(want[shown], abs=1e-6)
    assert np.max(np.abs(fitted[shown] - integrated[shown])) > 0.01 or wrong == {"every": 50}


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
