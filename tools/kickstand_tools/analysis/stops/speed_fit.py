"""A speed integrated from the acceleration, brought into line with the log's.

A speed once a second has two or three values in a hard stop, which alone tell nothing of its shape; the acceleration
has the shape, and drifts.
"""

import numpy as np

from ..channels import Array, Channels
from ..signals import G, integral, smoothed

LEAD_S = 4.0  # of speed before the braking that are taken into the fit
DELAYS_S = np.arange(-0.5, 1.51, 0.05)  # of a speed, that are tried
ENOUGH_SPEEDS, ENOUGH_CHANGE_MPS = 30, 0.5

# One sigma, of what is fitted and of a speed
SIGMA_SCALE, SIGMA_SLOPE_MPS2, SIGMA_DELAY_S, SIGMA_SPEED_MPS = 0.01, 0.05, 0.05, 0.05
SIGMA_WALK_MPS2, KNOT_S = 0.1, 0.5  # per square root of a second


def speed_delay_s(ride: Channels) -> float:
    """How late the log's speed is, as that of satellites is: where its changes best fit those felt. 0 if unknown."""
    there = np.flatnonzero(~np.isnan(ride.speed_mps))
    if len(there) < ENOUGH_SPEEDS:
        return 0.0
    second = np.floor(ride.t_s[there])
    there = there[np.flatnonzero(np.diff(second, prepend=-1.0))]  # one a second
    time, changes = ride.t_s[there], np.diff(ride.speed_mps[there])
    felt = integral(ride.t_s, G * ride.forward_g)
    if len(there) < ENOUGH_SPEEDS or np.std(changes) < ENOUGH_CHANGE_MPS:
        return 0.0
    left = []
    for delay in DELAYS_S:
        pushes = np.diff(np.interp(time - delay, ride.t_s, felt))
        if np.std(pushes) < ENOUGH_CHANGE_MPS:
            return 0.0
        left.append(1.0 - np.corrcoef(pushes, changes)[0, 1] ** 2)
    best = int(np.argmin(left))
    if best in (0, len(left) - 1):
        return 0.0
    before, least, after = left[best - 1 : best + 2]  # a parabola through these
    return float(DELAYS_S[best] + 0.5 * (before - after) / (before - 2.0 * least + after) * (DELAYS_S[1] - DELAYS_S[0]))


def fitted_speed(
    part: Channels, begin: int, speed: Array, acceleration: Array, delay_s: float
) -> Array | None:
    """speed and acceleration (n, m/s, of part, to a standstill), corrected; None if the log has no speed there.

    begin: index at which braking begins. delay_s: of the log's speed.

    Least squares with what was known before: log = (1 + scale) v + integral of slope to the end - delay dv/dt,
    where slope, what the force has of hill and dive that the gyro has not told, is a random walk back in time
    from nearly none at standstill.
    """
    time = part.t_s
    values = np.flatnonzero(~np.isnan(part.speed_mps))
    wanted = np.searchsorted(time, time[values] - delay_s - 1e-6).clip(0, len(time) - 1)  # when they were so
    values, wanted = (these[time[wanted] >= time[begin] - LEAD_S] for these in (values, wanted))
    if len(wanted) < 2 or wanted[-1] < begin:
        return None
    knots = np.arange(float(time[-1]), float(min(time[wanted[0]], time[begin])) - KNOT_S, -KNOT_S)
    hats = np.column_stack([np.interp(time, knots[::-1], row[::-1]) for row in np.eye(len(knots))])
    pushed = np.column_stack([integral(time, hat) for hat in hats.T])
    pushed = pushed[-1] - pushed  # from each sample to the end
    terms = np.column_stack((speed, pushed, -smoothed(acceleration, time)))[wanted]
    error = part.speed_mps[values] - speed[wanted]
    prior = np.zeros((len(knots) + 2, len(knots) + 2))
    prior[0, 0], prior[-1, -1] = 1.0 / SIGMA_SCALE, 1.0 / SIGMA_DELAY_S
    prior[1, 1] = 1.0 / SIGMA_SLOPE_MPS2
    for k in range(2, len(knots) + 1):
        prior[k, k], prior[k, k - 1] = np.array([1.0, -1.0]) / (SIGMA_WALK_MPS2 * KNOT_S**0.5)
    weighted = np.vstack((terms / SIGMA_SPEED_MPS, prior))
    known = np.concatenate((error / SIGMA_SPEED_MPS, np.zeros(len(prior))))
    found = np.linalg.lstsq(weighted, known, rcond=None)[0]
    scale, slope = 1.0 + found[0], found[1:-1]
    return scale * speed + pushed @ slope
