"""Derivatives of equations.py, by the chain rule; a test holds them against differences.

By differences they would cost as much as all the rest of the adjustment. A derivative that is 0 everywhere is left out.
"""

import numpy as np
from kickstand.units import STANDARD_GRAVITY

from ..logs.table import Array
from . import noise
from .equations import INPUTS, ROWS, STRAIGHT, corrected
from .parameters import (
    BIAS,
    BIAS_PER_C,
    FORWARD,
    GYRO,
    LEAN,
    LEFT,
    OF_BIKE,
    OFFSET,
    OFFSET_PER_C,
    PARAMETERS,
    PITCH,
    ROTATION,
    SCALE,
    STATES,
    UP,
)
from .windows import Windows

WX, WY, WZ, FX, FY, FZ, T, Q, L, U, V, HEIGHT, PLACE, TYRES, BESIDE, DELAY, DIVE, CAMBER = range(INPUTS)
By = dict[int, Array]  # derivatives of a quantity by the inputs


def _sum(one: By, factor: Array | float, other: By) -> By:
    """Derivatives of one + factor x other."""
    return one | {i: one[i] + factor * value if i in one else factor * value for i, value in other.items()}


def by_inputs(inputs: Array) -> dict[int, By]:
    """By row of equations(): by input, (n). inputs (INPUTS, n)."""
    wx, wy, wz, fx, fy, fz, t, q, left, _, forward, height, place, tyres, beside, delay, dive, camber = inputs
    st, ct, sq, cq = np.sin(t), np.cos(t), np.sin(q), np.cos(q)
    one, g = np.ones(len(t)), STANDARD_GRAVITY
    yaw = (wx * st + wy * ct) / cq
    by_yaw = {WX: st / cq, WY: ct / cq, T: (wx * ct - wy * st) / cq, Q: yaw * sq / cq}
    upright, sideways = fx * st + fy * ct, fx * ct - fy * st
    ahead = (fz * cq - upright * sq) * g
    by_ahead = {FX: -st * sq, FY: -ct * sq, FZ: cq, T: -sideways * sq, Q: -fz * sq - upright * cq}
    by_ahead = {i: g * value for i, value in by_ahead.items()}
    x, y, z = wy * place - wz * height, -wx * place, wx * height
    raised, across = x * st + y * ct, x * ct - y * st
    by_raised = {WX: -place * ct, WY: place * st, WZ: -height * st, T: across}
    by_raised |= {HEIGHT: -wz * st, PLACE: wy * st - wx * ct}
    by_across = {WX: place * st, WY: place * ct, WZ: -height * ct, T: -raised}
    by_across |= {HEIGHT: -wz * ct, PLACE: wy * ct + wx * st}
    wheel_up = _sum({U: one, WX: -height * sq, Q: raised * sq - z * cq, HEIGHT: -wx * sq}, -cq, by_raised)
    wheel = _sum({V: one, WX: -height * cq, Q: z * sq + raised * cq, HEIGHT: -wx * cq}, sq, by_raised)
    speed, nose = forward - (z * cq - raised * sq), q - dive * ahead
    climbing = _sum(_sum(wheel_up, -nose, wheel), speed * dive, by_ahead)
    climbing = _sum(climbing, speed, {Q: -one, DIVE: ahead})
    share, steep = 1.0 / (1.0 + (t / STRAIGHT) ** 4), (t / STRAIGHT) ** 3
    by_t = -tyres * ct + beside * st + camber * 4.0 * steep / STRAIGHT * share**2
    backward = (speed < 0.0).astype(float)
    return {
        LEAN: _sum({WZ: one, Q: -yaw * cq}, -sq, by_yaw),
        PITCH: {WX: -ct, WY: st, T: yaw * cq},
        LEFT: _sum({FX: g * ct, FY: -g * st, T: -g * upright, V: -yaw}, -forward, by_yaw),
        UP: {FX: g * st * cq, FY: g * ct * cq, FZ: g * sq, T: g * sideways * cq, Q: ahead},
        FORWARD: _sum(_sum(by_ahead, left, by_yaw), 1.0, {L: yaw}),
        STATES + noise.SLIDING: _sum({L: one}, -1.0, by_across),
        STATES + noise.CLIMBING: climbing,
        STATES + noise.SLOPING: wheel_up,
        STATES + noise.BALANCED: {FX: one, T: by_t, TYRES: -st, BESIDE: -ct, CAMBER: -share},
        STATES + noise.ANY_SPEED: wheel,
        STATES + noise.GIVEN_SPEED: _sum(_sum(wheel, -delay, by_ahead), 1.0, {DELAY: -ahead}),
        **{STATES + noise.RESTING.start + i: {axis: one} for i, axis in enumerate((L, U, V))},
        **{STATES + noise.RESTING_RATE.start + i: {axis: one} for i, axis in enumerate((WX, WY, WZ))},
        STATES + noise.BACKWARD: {i: backward * value for i, value in wheel.items()},
    }


def by_unknowns(windows: Windows, middle: Array, p: Array, factor: Array) -> Array:
    """(n, ROWS, STATES + PARAMETERS + 1): derivatives of equations() by the states in the middle of the windows and by
    the parameters, times factor (ROWS, n); the last column is left for the residuals. middle, p: see corrected()."""
    found = np.zeros((len(windows), ROWS, STATES + PARAMETERS + 1))
    of_states, of_parameters = found[:, :, :STATES], found[:, :, STATES:]
    sensed, warm = (windows.rate.T, windows.force.T), windows.warm
    for row, by in by_inputs(corrected(windows, middle, p)).items():
        states, parameters = of_states[:, row], of_parameters[:, row]
        for i, value in by.items():
            value = factor[row] * value
            if i >= HEIGHT:
                parameters[:, OF_BIKE.start + i - HEIGHT] = value
                continue
            if i >= T:
                states[:, i - T] = value
                continue
            axis, vector = i % 3, sensed[i // 3]
            after, last = (axis + 1) % 3, (axis + 2) % 3
            parameters[:, ROTATION.start + after] += value * vector[last]
            parameters[:, ROTATION.start + last] -= value * vector[after]
            if i < FX:
                states[:, BIAS.start + axis] = -value
                parameters[:, BIAS_PER_C.start + axis] = -warm * value
                for j in range(3):
                    parameters[:, GYRO.start + 3 * axis + j] = value * vector[j]
            else:
                parameters[:, OFFSET.start + axis] = value
                parameters[:, OFFSET_PER_C.start + axis] = warm * value
                if i == FY:
                    parameters[:, SCALE] = value * vector[axis]
    return found
