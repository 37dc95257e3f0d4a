"""The process model and the measurement model of a motorcycle, and their Jacobian.

The states are the lean t, the pitch q, and three velocities of the sensor: l to the left, u up and v forward. The
velocities are in level axes that yaw with the bike at the yaw rate p. Rates w and forces f are the measured values
(w_m, f_m) without the sensor's errors. R is the rotation by ROTATION, to second order. The acceleration a is the force
in level axes, minus 1 g upwards.

    w = R w_m + GYRO w_m - bias        f = R f_m + ACCEL f_m + offset
    p = (w_x sin t + w_y cos t) / cos q        t' = w_z - p sin q        q' = w_y sin t - w_x cos t
    l' = a_l - p v        v' = a_f + p l        u' = a_u

The firmware's kickstand.lean.bike_model has the same equations, and assumes no motion sideways or up. Here, "no motion
sideways or up" is a measurement of the velocity, with noise. It would be worse to measure the acceleration. The
velocity differs from 0 only briefly, but the acceleration differs from 0 at every bump. The wheels' velocity is the
sensor's velocity minus the rates times the sensor's position (rigid body). The measurements are differences that should
be 0:

    SLIDING         the wheels' velocity sideways, because wheels do not slide
    CLIMBING        the wheels' velocity up minus the part due to the chassis' pitch. The chassis points along the road,
                    except for dive in braking, (8) there. Dive does not move a wheel.
    SLOPING         the wheels' velocity up, because roads are level on average
    BALANCED        the force to the side minus TYRES, CAMBER and BESIDE (see unknowns.py): a moving bike is balanced
    ANY_SPEED       the speed minus USUAL_MPS
    MEASURED_SPEED  the speed minus the log's delayed speed
    RESTING         the velocity of a standing bike (zero-velocity update)
    RESTING_RATE    the rates of a standing bike
    BACKWARD        a speed under 0
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
STRAIGHT = 0.1  # in rad: at smaller leans a road is cambered, at larger leans it is banked
STEP = 1e-6  # step of the finite differences, in the units of the unknowns


def process_and_measurements(windows: Windows, x: Array) -> Array:
    """Evaluate both models in n windows.

    x: states in the middle of each window, then parameters, shape (STATES + PARAMETERS, n).
    Returns an array of shape (ROWS, n). The first STATES rows are the states' rates of change. The other rows are the
    measurements.
    """
    return _models(windows, x, _readings(windows, x))


def _readings(windows: Windows, x: Array) -> Array:
    """Return rates and forces without the sensor's errors, shape (6, n)."""
    p = x[STATES:]
    force = _corrected(windows.force.T, p, of.ACCEL) + p[of.OFFSET] + p[of.OFFSET_PER_C] * windows.warm
    return np.concatenate((corrected_rates(windows.rate.T, x, windows.warm), force))


def _models(windows: Windows, x: Array, readings: Array) -> Array:
    """Evaluate process_and_measurements() with these _readings()."""
    t, q, left, up, forward = x[: BIAS.start]
    p, (wx, wy, wz, fx, fy, fz) = x[STATES:], readings
    st, ct, sq, cq = np.sin(t), np.cos(t), np.sin(q), np.cos(q)
    yaw = (wx * st + wy * ct) / cq
    upright = fx * st + fy * ct  # upward force in axes that pitch but do not lean with the bike
    ahead = (fz * cq - upright * sq) * STANDARD_GRAVITY
    rows = np.zeros((ROWS, len(t)))
    rows[LEAN] = wz - yaw * sq
    rows[PITCH] = wy * st - wx * ct
    rows[LEFT] = (fx * ct - fy * st) * STANDARD_GRAVITY - yaw * forward
    rows[UP] = (upright * cq + fz * sq - 1.0) * STANDARD_GRAVITY
    rows[FORWARD] = ahead + yaw * left
    height, distance = p[of.HEIGHT], p[of.AHEAD]
    turn_x, turn_y, turn_z = wy * distance - wz * height, -wx * distance, wx * height  # rates x place
    raised = turn_x * st + turn_y * ct
    wheel_up = up - (raised * cq + turn_z * sq)
    wheel = forward - (turn_z * cq - raised * sq)
    rows[SLIDING] = left - (turn_x * ct - turn_y * st)
    rows[CLIMBING] = wheel_up - wheel * (q - p[of.DIVE] * ahead / STANDARD_GRAVITY)
    rows[SLOPING] = wheel_up
    rows[BALANCED] = fx - p[of.TYRES] * st * fy - p[of.BESIDE] * ct - p[of.CAMBER] / (1.0 + (t / STRAIGHT) ** 4)
    rows[ANY_SPEED] = wheel - USUAL_MPS
    rows[MEASURED_SPEED] = wheel - p[of.DELAY] * ahead - np.nan_to_num(windows.speed)
    rows[RESTING] = left, up, forward
    rows[RESTING_RATE] = wx, wy, wz
    rows[BACKWARD] = np.minimum(wheel, 0.0)
    return rows


def jacobian(windows: Windows, x: Array, unknown: Ints) -> Array:
    """Compute the derivatives of process_and_measurements() by some rows of x.

    Most unknowns are errors of the sensor, which only change the corrected readings. So the derivatives by the readings
    are computed first, as finite differences.

    unknown: indices of these rows of x.
    Returns an array of shape (len(unknown), ROWS, n).
    """
    readings, moved, derivatives = _readings(windows, x), x.copy(), np.empty((len(unknown), ROWS, x.shape[1]))
    base, by_reading = _models(windows, x, readings), np.empty((6, *derivatives.shape[1:]))
    for k, slot in enumerate(by_reading):
        readings[k] += STEP
        slot[:] = (_models(windows, x, readings) - base) / STEP
        readings[k] -= STEP
    errors = _errors(windows)
    for slot, row in zip(derivatives, unknown, strict=True):
        moved[row] += STEP
        if row in errors:
            reading, derivative = errors[row]
            np.multiply(by_reading[reading], derivative, out=slot)
        elif STATES <= row < STATES + of.ROTATION.stop:
            slot[:] = np.einsum("krn,kn->rn", by_reading, (_readings(windows, moved) - readings) / STEP)
        else:
            slot[:] = (_models(windows, moved, readings) - base) / STEP
        moved[row] = x[row]
    return derivatives


def _errors(windows: Windows) -> dict[int, tuple[int, Array]]:
    """Return, for each row of x that is an error of one axis, the index of its reading, and this reading's derivative
    by the row."""
    warm, errors = windows.warm, {}
    for k in range(3):
        errors[BIAS.start + k] = k, -np.ones(len(warm))
        errors[STATES + of.BIAS_PER_C.start + k] = k, -warm
        errors[STATES + of.OFFSET.start + k] = 3 + k, np.ones(len(warm))
        errors[STATES + of.OFFSET_PER_C.start + k] = 3 + k, warm
        for by in range(3):
            errors[STATES + of.GYRO.start + 3 * k + by] = k, windows.rate[:, by]
            errors[STATES + of.ACCEL.start + 3 * k + by] = 3 + k, windows.force[:, by]
    return errors


def corrected_rates(rate: Array, x: Array, warm: Array) -> Array:
    """Remove the gyro's errors from n measured rates.

    rate: measured rates, shape (3, n), in rad/s.
    x: states, then parameters, shape (STATES + PARAMETERS, n).
    warm: see Windows, shape (n).
    Returns the rates about left, up and forward, shape (3, n), in rad/s.
    """
    return _corrected(rate, x[STATES:], of.GYRO) - x[BIAS] - x[STATES:][of.BIAS_PER_C] * warm


def _corrected(readings: Array, p: Array, errors: slice) -> Array:
    """Rotate readings (3, n) by ROTATION, and add the matrix `errors` times the readings."""
    x, y, z = readings
    a, b, c = p[of.ROTATION]
    e = p[errors]
    # Second order is needed. To first order, a rotation also lengthens the readings, like a scale error: by 0.8 % for a
    # yaw of 7 degrees.
    u, v, w = 0.5 * (b * z - c * y), 0.5 * (c * x - a * z), 0.5 * (a * y - b * x)
    return np.array(
        (
            x + 2.0 * u + b * w - c * v + e[0] * x + e[1] * y + e[2] * z,
            y + 2.0 * v + c * u - a * w + e[3] * x + e[4] * y + e[5] * z,
            z + 2.0 * w + a * v - b * u + e[6] * x + e[7] * y + e[8] * z,
        )
    )
