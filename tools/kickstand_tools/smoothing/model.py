"""What the readings have to do with the motion of a motorcycle, as residuals of least squares.

Lean t, pitch q, velocity of the sensor to the left, up and forward (l, u, v), in level axes that turn with the bike at
the yaw rate p, and rates w without the gyro's errors:

    p = (w_x sin t + w_y cos t) / cos q        t' = w_z - p sin q        q' = w_y sin t - w_x cos t
    l' = a_l - p v        v' = a_f + p l        u' = a_u        a: the force in level axes, less 1 g upwards

These are the firmware's kickstand.lean.bike_model without its assumption that there is no motion sideways or up. That
is measured here, with an error: a velocity may err for a moment only, while accelerations err with every bump. The
wheels' velocity is the sensor's less what turning adds at its place. Measured are differences that should be 0:

    SLIDING      the wheels' velocity sideways: they do not slide
    CLIMBING     their velocity up less that along the chassis: it points along the road, but for its dive in braking
    SLOPING      their velocity up: roads are level on average
    BALANCED     the force to the side, less those by the tyres' width and by what lasts: a bike that rides is balanced
    ANY_SPEED    the speed less a usual one        GIVEN_SPEED    the same less the log's, which is late
    RESTING      the velocity, and RESTING_RATE the rates, of a bike that stands
    BACKWARD     the speed where it is under 0
"""

import numpy as np
from kickstand.units import STANDARD_GRAVITY

from ..logs.table import Array
from . import noise
from .noise import MEASURED, OUTLIER, USUAL_MPS, Circumstances
from .parameters import (
    AHEAD,
    BESIDE,
    BIAS,
    CAMBER,
    DELAY,
    DIVE,
    FORWARD,
    HEIGHT,
    LEAN,
    LEFT,
    PARAMETERS,
    PITCH,
    STATES,
    TYRES,
    UP,
    corrected_force,
    corrected_rates,
)
from .windows import Windows

ROWS = STATES + MEASURED
STRAIGHT = 0.1  # rad: of lean. Up to about this a road is cambered, above it is banked, like the turn itself.
STATE_STEPS = np.array([1e-5, 1e-5, 1e-4, 1e-4, 1e-4, 1e-6, 1e-6, 1e-6])  # of the differences for derivatives
PARAMETER_STEP = 1e-5


def motion_and_measurements(windows: Windows, middle: Array, p: Array) -> tuple[Array, Array]:
    """Rates of change (n, STATES) of the states, and measurements (n, MEASURED).

    middle (n, STATES): states in the middle of each window. p (n, PARAMETERS).
    """
    t, q, left, up, forward = middle[:, : BIAS.start].T
    wx, wy, wz = corrected_rates(windows.rate, middle, p, windows.warm)
    fx, fy, fz = corrected_force(windows.force, p, windows.warm)
    st, ct, sq, cq = np.sin(t), np.cos(t), np.sin(q), np.cos(q)
    yaw = (wx * st + wy * ct) / cq
    upright = fx * st + fy * ct  # force up after the lean is taken off
    ahead = (fz * cq - upright * sq) * STANDARD_GRAVITY
    motion = np.zeros((len(t), STATES))
    motion[:, LEAN] = wz - yaw * sq
    motion[:, PITCH] = wy * st - wx * ct
    motion[:, LEFT] = (fx * ct - fy * st) * STANDARD_GRAVITY - yaw * forward
    motion[:, UP] = (upright * cq + fz * sq - 1.0) * STANDARD_GRAVITY
    motion[:, FORWARD] = ahead + yaw * left
    x, y, z = wy * p[:, AHEAD] - wz * p[:, HEIGHT], -wx * p[:, AHEAD], wx * p[:, HEIGHT]  # rates x place
    raised = x * st + y * ct
    wheel_left = left - (x * ct - y * st)
    wheel_up = up - (raised * cq + z * sq)
    wheel = forward - (z * cq - raised * sq)
    measured = np.empty((len(t), MEASURED))
    measured[:, noise.SLIDING] = wheel_left
    measured[:, noise.CLIMBING] = wheel_up - wheel * (q - p[:, DIVE] * ahead)
    measured[:, noise.SLOPING] = wheel_up
    measured[:, noise.BALANCED] = fx - p[:, TYRES] * st - p[:, BESIDE] * ct - p[:, CAMBER] / (1.0 + (t / STRAIGHT) ** 4)
    measured[:, noise.ANY_SPEED] = wheel - USUAL_MPS
    measured[:, noise.GIVEN_SPEED] = wheel - p[:, DELAY] * ahead - np.nan_to_num(windows.speed)
    measured[:, noise.RESTING] = middle[:, LEFT : BIAS.start]
    measured[:, noise.RESTING_RATE] = np.column_stack((wx, wy, wz))
    measured[:, noise.BACKWARD] = np.minimum(wheel, 0.0)
    return motion, measured


def linearised(known: Circumstances, states: Array, p: Array, robust: bool) -> Array:
    """(n, ROWS, 2 STATES + PARAMETERS + 1): derivatives of the residuals by the states at both ends of each window and
    by the parameters, and the residuals, all over their standard deviations.

    states (n + 1, STATES): at the windows' edges. p (n, PARAMETERS). robust: outliers count less (Cauchy).
    """
    windows = known.windows
    middle, step = 0.5 * (states[1:] + states[:-1]), states[1:] - states[:-1]
    seconds = np.where(windows.gap, 0.0, windows.seconds)[:, None]
    motion, measured = motion_and_measurements(windows, middle, p)
    sigma, weight = known.of_motion(), 1.0 / known.of_measurements()
    if robust:
        off = (step - seconds * motion)[:, : BIAS.start] / sigma[:, : BIAS.start]
        sigma[:, : BIAS.start] *= np.hypot(1.0, off / noise.JOLT)
        # what holds for long is judged by its own sigma, not by its share of a window
        weight = weight / np.hypot(1.0, measured * weight * known.lasting() / OUTLIER)
    found = np.zeros((len(middle), ROWS, 2 * STATES + PARAMETERS + 1))
    scale = seconds / sigma
    for i in range(STATES):
        moved = middle.copy()
        moved[:, i] += STATE_STEPS[i]
        by_motion, by_measured = motion_and_measurements(windows, moved, p)
        half = 0.5 / STATE_STEPS[i]  # the middle changes by half of what an end does
        found[:, :STATES, i] = found[:, :STATES, STATES + i] = -half * scale * (by_motion - motion)
        found[:, STATES:, i] = found[:, STATES:, STATES + i] = half * weight * (by_measured - measured)
        found[:, i, i] -= 1.0 / sigma[:, i]
        found[:, i, STATES + i] += 1.0 / sigma[:, i]
    for j in range(PARAMETERS):
        moved = p.copy()
        moved[:, j] += PARAMETER_STEP
        by_motion, by_measured = motion_and_measurements(windows, middle, moved)
        found[:, :STATES, 2 * STATES + j] = scale * (motion - by_motion) / PARAMETER_STEP
        found[:, STATES:, 2 * STATES + j] = weight * (by_measured - measured) / PARAMETER_STEP
    found[:, :STATES, -1] = step / sigma - scale * motion
    found[:, STATES:, -1] = weight * measured
    return found
