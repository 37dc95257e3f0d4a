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

from dataclasses import dataclass

import numpy as np
from kickstand.units import STANDARD_GRAVITY

from ..logs.table import Array
from . import noise
from .noise import MEASURED, OUTLIER, USUAL_MPS, Circumstances
from .parameters import (
    AHEAD,
    BESIDE,
    BIAS,
    BIAS_PER_C,
    CAMBER,
    DELAY,
    DIVE,
    FORWARD,
    HEIGHT,
    LEAN,
    LEFT,
    OFFSET,
    OFFSET_PER_C,
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


@dataclass
class Residuals:
    """Of n windows. motion (n, STATES), measured (n, MEASURED): of motion_and_measurements(). scale (n, STATES), weight
    (n, MEASURED): by what they are multiplied. values (n, ROWS): over their standard deviations. sigma (n, STATES): of
    what the states change by."""

    motion: Array
    measured: Array
    sigma: Array
    scale: Array
    weight: Array
    values: Array


def residuals(known: Circumstances, states: Array, p: Array, robust: bool) -> Residuals:
    """states (n + 1, STATES): at the windows' edges. p (n, PARAMETERS). robust: outliers count less (Cauchy)."""
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
    scale = seconds / sigma
    values = np.concatenate((step / sigma - scale * motion, weight * measured), axis=1)
    return Residuals(motion, measured, sigma, scale, weight, values)


def linearised(known: Circumstances, states: Array, p: Array, robust: bool) -> Array:
    """(n, ROWS, 2 STATES + PARAMETERS + 1): derivatives of the residuals by the states at both ends of each window and
    by the parameters, and the residuals. See residuals()."""
    windows, at = known.windows, residuals(known, states, p, robust)
    middle = 0.5 * (states[1:] + states[:-1])
    found = np.empty((len(middle), ROWS, 2 * STATES + PARAMETERS + 1))
    found[:, :, -1] = at.values

    def changed(middle: Array, p: Array, step: float) -> Array:
        motion, measured = motion_and_measurements(windows, middle, p)
        return np.concatenate((at.scale * (at.motion - motion), at.weight * (measured - at.measured)), axis=1) / step

    for i in range(STATES):
        moved = middle.copy()
        moved[:, i] += STATE_STEPS[i]
        found[:, :, i] = found[:, :, STATES + i] = 0.5 * changed(moved, p, STATE_STEPS[i])  # the middle moves by half
    for j in range(OFFSET_PER_C.start):
        moved = p.copy()
        moved[:, j] += PARAMETER_STEP
        found[:, :, 2 * STATES + j] = changed(middle, moved, PARAMETER_STEP)
    warm = windows.warm[:, None, None]
    by_parameters = found[:, :, 2 * STATES : -1]
    by_parameters[:, :, OFFSET_PER_C] = warm * by_parameters[:, :, OFFSET]
    by_parameters[:, :, BIAS_PER_C] = warm * 2.0 * found[:, :, BIAS]
    for i in range(STATES):
        found[:, i, i] -= 1.0 / at.sigma[:, i]
        found[:, i, STATES + i] += 1.0 / at.sigma[:, i]
    return found
