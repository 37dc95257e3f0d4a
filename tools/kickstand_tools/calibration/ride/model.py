"""What the readings of a mounted sensor have to do with the motion of a motorcycle, as residuals of least squares.

States where each window begins: lean t, pitch q, speed v (g s), the gyro's bias (3). The equations are those of the
firmware's kickstand.lean.bike_model, integrated over a window; the alignment and the errors of the sensor are unknown:

    rate  w = w_m + rotation x w_m + gyro errors w_m - bias
    force f = f_m + rotation x f_m + accelerometer errors f_m + offset, less what turning adds at the sensor's place
    t' = w_z - tan q (w_x sin t + w_y cos t)        q' = w_y sin t - w_x cos t        v' = f_z - sin q
    wheels do not slide:            f_x = cos q sin t + v w_y,     f_y = cos q cos t - v w_x
    roads are level on average:     q = 0
    a bike that rides is balanced:  f_x = tyres x sin t + beside
    a bike that stands:             v = 0, w = 0

The gyro follows the direction of gravity through the bends, by (f_x, f_y) with the speed or, without one, with the
speed that fits them. The mean of that direction on straights is the bike's own up, because it is balanced there, and
what force is then left across the bike is the offset of the accelerometer. Without the gyro, an offset of 50 mg would
tilt up by 3 degrees. No ride tells a bike that is balanced beside its own middle from one whose sensor is tilted.
"""

from dataclasses import dataclass

import numpy as np
from kickstand.units import STANDARD_GRAVITY
from numpy.typing import NDArray

from ...logs.table import Array
from .windows import WINDOW_S, Windows

LEAN, PITCH, SPEED, BIAS = 0, 1, 2, slice(3, 6)
STATE_COUNT = 6
STATE_STEPS = np.array([1e-4, 1e-4, 1e-3, 1e-5, 1e-5, 1e-5])

# Parameters: rotation (rad), errors of gyro and accelerometer (3 x 3 each), offset (g), tyres, delay of the speed (s),
# place (m), and beside (g): the push to the side on straights, of luggage or camber.
ROTATION, GYRO, ACCEL, OFFSET, TYRES, DELAY, PLACE, BESIDE = (
    slice(0, 3),
    slice(3, 12),
    slice(12, 21),
    slice(21, 24),
    24,
    25,
    slice(26, 29),
    29,
)
SENSOR = slice(GYRO.start, OFFSET.stop)
COUNT = 30
PARAMETER_STEPS = np.full(COUNT, 1e-4)
# What is known of them before. Scale errors of 3 % and cross-axis sensitivity of 2 % are a sensor's limits (data sheet
# PS-MPU-6000A, 6.1, 6.2), an offset of 50 mg; half of it is usual. Place: of the sensor, from where the rear wheel
# touches the road, half way up the tyre.
USUAL = np.zeros(COUNT)
USUAL[TYRES], USUAL[DELAY], USUAL[PLACE] = 0.1, 0.5, (0.0, 0.7, 0.7)
SIGMA = np.full(COUNT, 0.012)
SIGMA[ROTATION], SIGMA[OFFSET], SIGMA[TYRES], SIGMA[DELAY], SIGMA[PLACE] = 10.0, 0.04, 0.05, 0.5, (0.1, 0.3, 0.4)
SIGMA[BESIDE] = 0.005

# Noise over a window, or per square root of a second (..._ROOT)
_ANGLE_ROOT = np.radians(0.2)  # rad: gyro, of vibration too
_SPEED_ROOT = 0.35 / STANDARD_GRAVITY
_BIAS_ROOT = np.radians(0.01)
_LEFT, _UP = 0.04, 0.15  # g
_SHAKEN_SHARE = 0.1  # of the variance within a window that its mean keeps
_SLOPE, _SLOPE_S = np.radians(2.0), 4.0  # of roads, and how long one lasts
_BALANCE, _BALANCE_S = 0.02, 3.0  # g: wind, camber, the rider's weight
_BALANCE_LEANED = 0.1  # g at 90 degrees of lean: the rider hangs off, and tyres are not as round as assumed
_BALANCE_ROLLING_S2 = 0.05  # g per rad/s^2 of roll acceleration: a bike that is falling into a bend is not balanced
_BALANCED_MPS = 4.0  # below, steering and feet count
_USUAL_MPS, _ANY_MPS, _ANY_S = 15.0, 20.0, 60.0  # speed where nothing tells it
_GIVEN_MPS = 0.7
_REST_RATE, _REST_MPS = np.radians(0.15), 0.1
_LOST = 1e3  # times the noise, where samples are missing
_LASTING = np.ones(16)  # of assumptions that hold for long, a window's share is judged by their own sigma
_LASTING[8:10] = np.sqrt(2.0 * _SLOPE_S / WINDOW_S), np.sqrt(2.0 * _BALANCE_S / WINDOW_S)
_OUTLIER = 3.0  # sigmas; further off a residual counts less and less


@dataclass
class Model:
    """The windows in the axes of the alignment so far. rate (n, 3): rad/s, less the first bias. force (n, 3): g.
    turning (n, 3): change of the rate, rad/s^2. balanced (n): True where the bike rides.
    leaned (n): sin(lean)."""

    windows: Windows
    rate: Array
    force: Array
    turning: Array
    balanced: NDArray[np.bool_]
    leaned: Array

    @classmethod
    def of(cls, windows: Windows, matrix: Array, bias: Array, states: Array) -> "Model":
        """states: roughly."""
        rate = (windows.rate - bias) @ matrix.T
        middle = 0.5 * (states[1:] + states[:-1])
        balanced = ~windows.still & (middle[:, SPEED] * STANDARD_GRAVITY > _BALANCED_MPS)
        turning = np.gradient(rate, WINDOW_S, axis=0)
        return cls(windows, rate, windows.force @ matrix.T, turning, balanced, np.sin(middle[:, LEAN]))

    def residuals(self, states: Array, parameters: Array) -> Array:
        """(n, 16) over their standard deviations, without regard to outliers."""
        w = self.windows
        step, middle = states[1:] - states[:-1], 0.5 * (states[1:] + states[:-1])
        t, q, v = middle[:, LEAN], middle[:, PITCH], middle[:, SPEED]
        turn = np.cross(np.eye(3), parameters[ROTATION])  # turn @ a = rotation x a
        rate = self.rate + self.rate @ (turn + parameters[GYRO].reshape(3, 3)).T - middle[:, BIAS]
        force = self.force + self.force @ (turn + parameters[ACCEL].reshape(3, 3)).T + parameters[OFFSET]
        place = parameters[PLACE] / STANDARD_GRAVITY
        around = np.cross(np.eye(3), place)  # a @ around = a x place
        # less turning x place and rate x (rate x place), without np.cross, which takes ten times as long
        force = force - self.turning @ around - (rate @ place)[:, None] * rate
        force += np.sum(rate * rate, axis=1)[:, None] * place
        wx, wy, wz = rate.T
        fx, fy, fz = force.T
        st, ct, sq, cq = np.sin(t), np.cos(t), np.sin(q), np.cos(q)
        root = np.sqrt(WINDOW_S) * np.where(w.linked, 1.0, _LOST)
        rest = np.where(w.still, 1.0, 0.0)
        balance = np.hypot(_BALANCE, _BALANCE_LEANED * self.leaned)
        rolling = _BALANCE_ROLLING_S2 * np.abs(self.turning[:, 2])
        shaken = _SHAKEN_SHARE * w.shaken
        there = np.where(np.isnan(w.speed), 0.0, 1.0)
        given = np.nan_to_num(w.speed / STANDARD_GRAVITY, nan=0.0)
        return np.column_stack(
            (
                (step[:, LEAN] - WINDOW_S * (wz - sq / cq * (wx * st + wy * ct))) / (_ANGLE_ROOT * root),
                (step[:, PITCH] - WINDOW_S * (wy * st - wx * ct)) / (_ANGLE_ROOT * root),
                (step[:, SPEED] - WINDOW_S * (fz - sq)) / (_SPEED_ROOT * root),
                step[:, BIAS] / (_BIAS_ROOT * root[:, None]),
                (fx - cq * st - v * wy) / np.sqrt(_LEFT**2 + shaken + rolling**2),
                (fy - cq * ct + v * wx) / np.sqrt(_UP**2 + shaken),
                q / (_SLOPE * np.sqrt(2.0 * _SLOPE_S / WINDOW_S)),
                np.where(self.balanced, 1.0, 0.0)
                * (fx - parameters[TYRES] * st - parameters[BESIDE])
                / np.sqrt(balance**2 * 2.0 * _BALANCE_S / WINDOW_S + rolling**2),
                (v - _USUAL_MPS / STANDARD_GRAVITY) / (_ANY_MPS / STANDARD_GRAVITY * np.sqrt(2.0 * _ANY_S / WINDOW_S)),
                there * (given - v + parameters[DELAY] * (fz - sq)) * STANDARD_GRAVITY / _GIVEN_MPS,
                rest * v * STANDARD_GRAVITY / _REST_MPS,
                np.where(w.calm, 1.0, 0.0)[:, None] * rate / np.maximum(_REST_RATE, w.unrest)[:, None],
            )
        )

    def weights(self, residual: Array) -> Array:
        """(n, 16) square roots of weights: outliers of the measurements count less (Cauchy); the motion does not."""
        weights = 1.0 / np.sqrt(1.0 + (residual * _LASTING / _OUTLIER) ** 2)
        weights[:, :6] = 1.0
        return weights
