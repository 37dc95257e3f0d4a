"""What the readings have to do with the motion of a motorcycle, as equations.

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
from .noise import MEASURED, USUAL_MPS
from .parameters import (
    BIAS,
    FORWARD,
    LEAN,
    LEFT,
    OF_BIKE,
    PITCH,
    STATES,
    UP,
    corrected_force,
    corrected_rates,
)
from .windows import Windows

ROWS = STATES + MEASURED
STRAIGHT = 0.1  # rad: of lean. Up to about this a road is cambered, above it is banked, like the turn itself.
INPUTS = 18


def motion_and_measurements(windows: Windows, middle: Array, p: Array) -> tuple[Array, Array]:
    """Rates of change (n, STATES) of the states, and measurements (n, MEASURED).

    middle (n, STATES): states in the middle of each window. p (n, PARAMETERS).
    """
    found = equations(corrected(windows, middle, p), windows.speed).T
    return found[:, :STATES], found[:, STATES:]


def corrected(windows: Windows, middle: Array, p: Array) -> Array:
    """(INPUTS, n): what equations() takes, see there. middle (n, STATES), p (n, PARAMETERS)."""
    rates = corrected_rates(windows.rate, middle, p, windows.warm)
    forces = corrected_force(windows.force, p, windows.warm)
    return np.concatenate((rates, forces, middle[:, : BIAS.start].T, p[:, OF_BIKE].T))


def equations(inputs: Array, speed: Array) -> Array:
    """(ROWS, n): motion and measurements, see above. inputs (INPUTS, n): rates and forces without the sensor's errors,
    states but the bias, parameters OF_BIKE. speed (n): the log's."""
    wx, wy, wz, fx, fy, fz, t, q, left, up, forward, height, place, tyres, beside, delay, dive, camber = inputs
    st, ct, sq, cq = np.sin(t), np.cos(t), np.sin(q), np.cos(q)
    yaw = (wx * st + wy * ct) / cq
    upright = fx * st + fy * ct  # force up after the lean is taken off
    ahead = (fz * cq - upright * sq) * STANDARD_GRAVITY
    found = np.zeros((ROWS, len(t)))
    found[LEAN] = wz - yaw * sq
    found[PITCH] = wy * st - wx * ct
    found[LEFT] = (fx * ct - fy * st) * STANDARD_GRAVITY - yaw * forward
    found[UP] = (upright * cq + fz * sq - 1.0) * STANDARD_GRAVITY
    found[FORWARD] = ahead + yaw * left
    x, y, z = wy * place - wz * height, -wx * place, wx * height  # rates x place
    raised = x * st + y * ct
    wheel_up = up - (raised * cq + z * sq)
    wheel = forward - (z * cq - raised * sq)
    measured = found[STATES:]
    measured[noise.SLIDING] = left - (x * ct - y * st)
    measured[noise.CLIMBING] = wheel_up - wheel * (q - dive * ahead)
    measured[noise.SLOPING] = wheel_up
    measured[noise.BALANCED] = fx - tyres * st - beside * ct - camber / (1.0 + (t / STRAIGHT) ** 4)
    measured[noise.ANY_SPEED] = wheel - USUAL_MPS
    measured[noise.GIVEN_SPEED] = wheel - delay * ahead - np.nan_to_num(speed)
    measured[noise.RESTING] = left, up, forward
    measured[noise.RESTING_RATE] = wx, wy, wz
    measured[noise.BACKWARD] = np.minimum(wheel, 0.0)
    return found
