"""The process model and the measurement model of a motorcycle, and their Jacobian.

The states are lean t, pitch q, and the sensor's velocity to the left, up and forward (l, u, v), in level axes that yaw
with the bike at the rate p. Rates w and forces f are the readings without the sensor's errors:

    w = R w_m + GYRO w_m - bias        f = R f_m + ACCEL f_m + offset        R: ROTATION, to second order
    p = (w_x sin t + w_y cos t) / cos q        t' = w_z - p sin q        q' = w_y sin t - w_x cos t
    l' = a_l - p v        v' = a_f + p l        u' = a_u        a: the force in level axes, less 1 g upwards

These are the equations of the firmware's kickstand.lean.bike_model, which assumes no motion sideways or up. Here, no
motion is a measurement with noise instead: an error of velocity is brief, while every bump causes errors of
acceleration. The wheels' velocity is the sensor's velocity minus the rates times the sensor's position (rigid body).
The measurements are differences that should be 0:

    SLIDING      the wheels' velocity sideways, because wheels do not slide
    CLIMBING     the wheels' velocity up minus the part due to the chassis' pitch: the chassis points along the road,
                 except for dive in braking, (8) in the firmware's kickstand.lean.dive, which moves no wheel
    SLOPING      the wheels' velocity up, because roads are level on average
    BALANCED     the force to the side minus TYRES, CAMBER and BESIDE (see unknowns.py): a moving bike is balanced
    ANY_SPEED    the speed minus USUAL_MPS        MEASURED_SPEED    the speed minus the log's, delayed
    RESTING      the velocity, and RESTING_RATE the rates, of a standing bike (zero-velocity update)
    BACKWARD     a speed under 0
"""

import numpy as np
from kickstand.units import STANDARD_GRAVITY

from ..signals import Array, Ints
from . import unknowns as of
from .unknowns import BIAS, FORWARD, LEAN, LEFT, PITCH, STATES, UP
from .windows import Windows

# Rows of the measurements, after the rows of the process model
SLIDING, CLIMBING, SLOPING, BALANCED, ANY_SPEED, MEASURED_SPEED = range(STATES, STATES + 6)
RESTING, RESTING_RATE, BACKWARD = slice(14, 17), slice(17, 20), 20
ROWS = 21
USUAL_MPS = 15.0  # mean of the speed's prior
STRAIGHT = 0.1  # rad: up to this lean a road is cambered; in bends with more lean it is banked into the bend
STEP = 1e-6  # step of the finite differences, in the unknowns' units


def process_and_measurements(windows: Windows, x: Array) -> Array:
    """(ROWS, n): the rates of change of the states (first STATES rows), then the measurements.

    x (STATES + PARAMETERS, n): states in the middle of each window, and parameters.
    """
    t, q, left, up, forward = x[: BIAS.start]
    p = x[STATES:]
    wx, wy, wz = corrected_rates(windows.rate.T, x, windows.warm)
    fx, fy, fz = _corrected(windows.force.T, p, of.ACCEL) + p[of.OFFSET] + p[of.OFFSET_PER_C] * windows.warm
    st, ct, sq, cq = np.sin(t), np.cos(t), np.sin(q), np.cos(q)
    yaw = (wx * st + wy * ct) / cq
    upright = fx * st + fy * ct  # upward force in axes that pitch but do not lean with the bike
    ahead = (fz * cq - upright * sq) * STANDARD_GRAVITY
    found = np.zeros((ROWS, len(t)))
    found[LEAN] = wz - yaw * sq
    found[PITCH] = wy * st - wx * ct
    found[LEFT] = (fx * ct - fy * st) * STANDARD_GRAVITY - yaw * forward
    found[UP] = (upright * cq + fz * sq - 1.0) * STANDARD_GRAVITY
    found[FORWARD] = ahead + yaw * left
    height, place = p[of.HEIGHT], p[of.AHEAD]
    turn_x, turn_y, turn_z = wy * place - wz * height, -wx * place, wx * height  # rates x place
    raised = turn_x * st + turn_y * ct
    wheel_up = up - (raised * cq + turn_z * sq)
    wheel = forward - (turn_z * cq - raised * sq)
    found[SLIDING] = left - (turn_x * ct - turn_y * st)
    found[CLIMBING] = wheel_up - wheel * (q - p[of.DIVE] * ahead / STANDARD_GRAVITY)
    found[SLOPING] = wheel_up
    found[BALANCED] = fx - p[of.TYRES] * st * fy - p[of.BESIDE] * ct - p[of.CAMBER] / (1.0 + (t / STRAIGHT) ** 4)
    found[ANY_SPEED] = wheel - USUAL_MPS
    found[MEASURED_SPEED] = wheel - p[of.DELAY] * ahead - np.nan_to_num(windows.speed)
    found[RESTING] = left, up, forward
    found[RESTING_RATE] = wx, wy, wz
    found[BACKWARD] = np.minimum(wheel, 0.0)
    return found


def jacobian(windows: Windows, x: Array, unknown: Ints) -> Array:
    """(len(unknown), ROWS, n): derivatives of process_and_measurements() by the rows `unknown` of x, as finite
    differences."""
    found, moved = np.empty((len(unknown), ROWS, x.shape[1])), x.copy()
    here = process_and_measurements(windows, x)
    for slot, row in zip(found, unknown, strict=True):
        moved[row] += STEP
        slot[:] = process_and_measurements(windows, moved) - here
        moved[row] = x[row]
    found /= STEP
    return found


def corrected_rates(rate: Array, x: Array, warm: Array) -> Array:
    """(3, n): rates about left, up, forward (rad/s) without the gyro's errors. rate (3, n): the measured rates. x
    (STATES + PARAMETERS, n): states and parameters. warm (n): see Windows."""
    return _corrected(rate, x[STATES:], of.GYRO) - x[BIAS] - x[STATES:][of.BIAS_PER_C] * warm


def _corrected(readings: Array, p: Array, errors: slice) -> Array:
    """Turn readings (3, n) by the rotation, and add the matrix of errors times the readings."""
    x, y, z = readings
    a, b, c = p[of.ROTATION]
    e = p[errors]
    # second order is needed: to first order, a yaw of 7 degrees would lengthen the readings by 0.8 %, like a scale
    # error
    u, v, w = 0.5 * (b * z - c * y), 0.5 * (c * x - a * z), 0.5 * (a * y - b * x)
    return np.array(
        (
            x + 2.0 * u + b * w - c * v + e[0] * x + e[1] * y + e[2] * z,
            y + 2.0 * v + c * u - a * w + e[3] * x + e[4] * y + e[5] * z,
            z + 2.0 * w + a * v - b * u + e[6] * x + e[7] * y + e[8] * z,
        )
    )
