"""Corrects a speed integrated from the acceleration by the speed in the log.

A log with one speed per second has only two or three speeds in a hard stop. These few values do not show how the speed
changes between them. The acceleration shows these changes, but its integral drifts.
"""

import numpy as np
from kickstand.units import STANDARD_GRAVITY

from ..signals import Array, best_lag, integral, smoothed
from .channels import Channels

SMOOTH_S = 0.2  # averaging time of the acceleration a(t) in fitted_speed()
LEAD_S = 4.0  # the fit also uses the logged speeds in this time before the braking
DELAYS_S = np.arange(-0.5, 1.51, 0.05)  # delays of the speed to try, in s
# A delay is searched only with at least ENOUGH_SPEEDS speeds, one per second. The standard deviation of the changes
# from one speed to the next must be at least ENOUGH_CHANGE_MPS.
ENOUGH_SPEEDS, ENOUGH_CHANGE_MPS = 30, 0.5

# Standard deviations of each fitted parameter, and of a logged speed
SIGMA_SCALE, SIGMA_SLOPE_MPS2, SIGMA_DELAY_S, SIGMA_SPEED_MPS = 0.01, 0.05, 0.05, 0.05
# The random walk of the acceleration error, per square root of a second, and the time between its knots
SIGMA_WALK_MPS2, KNOT_S = 0.1, 0.5


def speed_delay_s(ride: Channels) -> float:
    """Find the delay at which the changes of the log's speed best match the integrated longitudinal force.

    Returns the delay in s; 0 if the ride does not show a delay.
    """
    valid = np.flatnonzero(~np.isnan(ride.speed_mps))
    valid = valid[np.unique(np.floor(ride.t_s[valid]), return_index=True)[1]]  # one speed per second
    time, changes = ride.t_s[valid], np.diff(ride.speed_mps[valid])
    pushed = integral(ride.t_s, STANDARD_GRAVITY * ride.forward_g)
    if len(valid) < ENOUGH_SPEEDS or np.std(changes) < ENOUGH_CHANGE_MPS:
        return 0.0

    def earlier(by_s: float) -> tuple[Array, Array] | None:
        pushes = np.diff(np.interp(time - by_s, ride.t_s, pushed))
        return (changes, pushes[:, None]) if np.std(pushes) >= ENOUGH_CHANGE_MPS else None

    lag = best_lag(DELAYS_S, earlier)
    return lag.lag_s if lag and lag.inside else 0.0


def fitted_speed(part: Channels, begin: int, speed: Array, acceleration: Array, delay_s: float) -> Array | None:
    """Correct an integrated speed by the log's speed.

    Least squares with a prior find the correction. The log's speed at the time t is

        u(t) = (1 + k) v(t) + integral of b from t to the end - d a(t)

    v is the integrated speed, and a the measured acceleration. The unknowns are the scale error k, the acceleration
    error b (m/s2) and the delay error d (s). Slopes and fork dive that the gyro did not measure cause the error b. The
    model of b is a random walk backwards in time. The error b is nearly 0 at standstill, and linear between knots. Its
    basis functions are hat functions (linear B-splines).

    part: the ride up to a standstill.
    begin: index at which braking begins.
    speed: integrated speed, shape (n), in m/s.
    acceleration: measured acceleration, shape (n), in m/s2.
    delay_s: delay of the log's speed.
    Returns the corrected speed, shape (n), in m/s; None if the log has too few speeds during the stop.
    """
    time = part.t_s
    values = np.flatnonzero(~np.isnan(part.speed_mps))
    # Indices of the samples at which the vehicle really had the logged speeds.
    sample_index = np.minimum(np.searchsorted(time, time[values] - delay_s - 1e-6), len(time) - 1)
    values, sample_index = (these[time[sample_index] >= time[begin] - LEAD_S] for these in (values, sample_index))
    if len(sample_index) < 2 or sample_index[-1] < begin:
        return None
    knots = np.arange(float(time[-1]), float(min(time[sample_index[0]], time[begin])) - KNOT_S, -KNOT_S)
    hats = np.column_stack([np.interp(time, knots[::-1], row[::-1]) for row in np.eye(len(knots))])
    pushed = np.column_stack([integral(time, hat) for hat in hats.T])
    pushed = pushed[-1] - pushed  # the integral from each sample to the end
    terms = np.column_stack((speed, pushed, -smoothed(acceleration, time, SMOOTH_S)))[sample_index]
    error = part.speed_mps[values] - speed[sample_index]
    prior = _prior(len(knots))
    weighted = np.vstack((terms / SIGMA_SPEED_MPS, prior))
    right_side = np.concatenate((error / SIGMA_SPEED_MPS, np.zeros(len(prior))))
    solution = np.linalg.lstsq(weighted, right_side, rcond=None)[0]
    scale, slope = 1.0 + solution[0], solution[1:-1]
    return scale * speed + pushed @ slope


def _prior(knots: int) -> Array:
    """Return the matrix of the prior, shape (knots + 2, knots + 2).

    The unknowns are k, then b at each knot, the last knot first, then d. The product of the matrix and the unknowns has
    a prior with mean 0 and standard deviation 1.
    """
    walk = [SIGMA_WALK_MPS2 * KNOT_S**0.5] * (knots - 1)
    sigma = np.array([SIGMA_SCALE, SIGMA_SLOPE_MPS2, *walk, SIGMA_DELAY_S])
    prior = np.eye(knots + 2)
    prior[range(2, knots + 1), range(1, knots)] = -1.0
    return prior / sigma[:, None]
