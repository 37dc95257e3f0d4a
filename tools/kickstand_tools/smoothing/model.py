"""What the readings have to do with the motion of a motorcycle, as residuals of least squares.

States at both ends of each window: lean t, pitch q, velocity of the sensor to the left, up and forward in level axes
that turn with the bike (l, u, v), and the gyro's bias (3). With the yaw rate p about the vertical:

    p = (w_x sin t + w_y cos t) / cos q        t' = w_z - p sin q        q' = w_y sin t - w_x cos t
    l' = a_l - p v        v' = a_f + p l        u' = a_u        a: the force in level axes, less 1 g upwards

These are the firmware's kickstand.lean.bike_model without its assumption that there is no motion sideways or up. That
is measured here, with an error: velocities may err for a moment only, while accelerations err with every bump. The
wheels' velocity is the sensor's less what turning adds at its place; they do not slide sideways, the chassis points
along the road but for its dive, and roads are level on average. A bike that rides is balanced, a bike that stands does
not move.
"""

from dataclasses import dataclass

import numpy as np
from kickstand.units import STANDARD_GRAVITY
from numpy.typing import NDArray

from ..logs.axes.leaning import averaged
from ..logs.table import Array
from .windows import Windows

LEAN, PITCH, LEFT, UP, FORWARD, BIAS = 0, 1, 2, 3, 4, slice(5, 8)
STATES = 8
STATE_STEPS = np.array([1e-5, 1e-5, 1e-4, 1e-4, 1e-4, 1e-6, 1e-6, 1e-6])

# Parameters: rotation of the alignment (rad, about left, up, forward); errors of the gyro (3 x 3); offset of the
# accelerometer (g) and its scale along up; place of the sensor above the roll axis and in front of the rear wheel (m);
# tyres: force to the side over sin(lean); beside: the same upright (g); delay of the speed (s); dive in braking
# (rad per m/s2).
ROTATION, GYRO, OFFSET, SCALE = slice(0, 3), slice(3, 12), slice(12, 15), 15
HEIGHT, AHEAD, TYRES, BESIDE, DELAY, DIVE = 16, 17, 18, 19, 20, 21
PARAMETERS = 22
USUAL = np.zeros(PARAMETERS)
USUAL[HEIGHT], USUAL[AHEAD], USUAL[TYRES], USUAL[DELAY], USUAL[DIVE] = 0.5, 0.6, 0.07, 0.4, np.radians(0.2)
SIGMA = np.empty(PARAMETERS)
SIGMA[ROTATION] = np.radians([1.5, 5.0, 2.5])
SIGMA[GYRO] = 0.012
SIGMA[OFFSET], SIGMA[SCALE] = (0.001, 0.003, 0.003), 0.004
SIGMA[HEIGHT], SIGMA[AHEAD], SIGMA[TYRES], SIGMA[BESIDE] = 0.3, 0.5, 0.06, 0.001
SIGMA[DELAY], SIGMA[DIVE] = 0.4, np.radians(0.2)
WITHOUT_SIX_G, WITHOUT_SIX_SCALE = 0.04, 0.015  # sigma of offset and scale where the six positions were not done
DRIFT = np.full(PARAMETERS, 1e-4)  # share of sigma by which each may change from block to block
DRIFT[ROTATION], DRIFT[OFFSET] = 0.04, (0.3, 0.1, 0.1)

# Noise per square root of a second
ANGLE_ROOT = np.radians(0.12)
VELOCITY_ROOT = np.array([0.05, 0.05, 0.10])
BIAS_ROOT = np.radians(0.01)
GAP_ROOT = np.array([np.radians(30.0), np.radians(5.0), 3.0, 1.0, 4.0])
GAP_MOST = np.array([np.radians(60.0), np.radians(8.0), 20.0, 2.0, 20.0])  # of noise in a gap

# Measurements: sigma, and how long an error lasts
SLIDE, SLIDE_SHARE, SLIDE_S = 0.1, 0.01, 0.5  # m/s, and share of v tan(lean)
DIVE_MPS, DIVE_ANGLE, DIVE_S = 0.1, np.radians(1.5), 0.5
SLOPE_MPS, SLOPE_ANGLE, SLOPE_S = 0.1, np.radians(2.0), 4.0
BALANCE, BALANCE_S = 0.014, 3.0
BALANCE_LEANED, BALANCE_ROLLING = 0.06, 0.05
BALANCED_MPS = 4.0
USUAL_MPS, ANY_MPS, ANY_S = 15.0, 20.0, 60.0
GIVEN_MPS = 0.5
REST_MPS, REST_RADPS, HAND_MPS = 0.05, np.radians(0.15), 0.5
BACKWARD_MPS = 0.3
OUTLIER = 2.0
JOLTED_RADPS, JOLTED_S = np.radians(150.0), 0.06  # a rate so far from its mean is one, and how long its error lasts
JOLT = 4.0  # sigmas of the motion within a window: what is more is a jolt to the sensor

# The ride itself tells how rough it is: the rms of these residuals over what is expected of the sigmas above
CALMED = [LEAN, PITCH, LEFT, UP, FORWARD, STATES, STATES + 1]
EXPECTED = np.array([0.38, 0.38, 0.38, 0.38, 0.38, 0.5, 0.5])
UNREST_S, LEAST_UNREST, MOST_UNREST = 60.0, 0.1, 4.0

MEASURED = 13  # rows of residuals after those of the motion
ROWS = STATES + MEASURED


def sigma_without_six() -> Array:
    """SIGMA where the accelerometer was not calibrated by six positions."""
    sigma = SIGMA.copy()
    sigma[OFFSET], sigma[SCALE] = WITHOUT_SIX_G, WITHOUT_SIX_SCALE
    return sigma


def jolted(windows: Windows) -> Array:
    """(n) rad: by how much a jolt, or a gyro at the end of its range, may have falsified the angles in each window."""
    return JOLTED_S * np.maximum(windows.jolt - JOLTED_RADPS, 0.0)


def corrected_rates(rate: Array, states: Array, p: Array) -> tuple[Array, Array, Array]:
    """Rates about left, up, forward (rad/s) without the gyro's errors. rate (n, 3), states (n, STATES), p (n,
    PARAMETERS)."""
    x, y, z = rate.T
    a, b, c = p[:, ROTATION].T
    g = p[:, GYRO].T
    bias = states[:, BIAS].T
    return (
        x + b * z - c * y + g[0] * x + g[1] * y + g[2] * z - bias[0],
        y + c * x - a * z + g[3] * x + g[4] * y + g[5] * z - bias[1],
        z + a * y - b * x + g[6] * x + g[7] * y + g[8] * z - bias[2],
    )


def _corrected_force(force: Array, p: Array) -> tuple[Array, Array, Array]:
    """Forces to the left, up and forward (g) without the accelerometer's errors."""
    x, y, z = force.T
    a, b, c = p[:, ROTATION].T
    off = p[:, OFFSET].T
    return (
        x + b * z - c * y + off[0],
        (1.0 + p[:, SCALE]) * y + c * x - a * z + off[1],
        z + a * y - b * x + off[2],
    )


@dataclass
class Model:
    """windows (n) laid out for the solver, and what is known of each: still, the bike stands; in_hand and not_riding:
    of first_guess.in_hand(); rolling: roll
    acceleration, rad/s^2; leaned (rad) and speed (m/s): roughly;
    unrest: of unrest_of(), 1 at first."""

    windows: Windows
    still: NDArray[np.bool_]
    in_hand: NDArray[np.bool_]
    not_riding: NDArray[np.bool_]
    rolling: Array
    leaned: Array
    speed: Array
    unrest: Array

    @property
    def riding(self) -> NDArray[np.bool_]:
        """(n) True where the bike rides, or may."""
        return ~self.windows.gap & ~self.still & ~self.not_riding

    def values(self, middle: Array, p: Array) -> tuple[Array, Array]:
        """Rates of change (n, STATES) of the states, and measurements (n, MEASURED), which should be 0 (measured minus
        expected). middle (n, STATES): states in the middle of each window; p (n, PARAMETERS)."""
        t, q, left, up, forward = middle[:, :5].T
        wx, wy, wz = corrected_rates(self.windows.rate, middle, p)
        fx, fy, fz = _corrected_force(self.windows.force, p)
        st, ct, sq, cq = np.sin(t), np.cos(t), np.sin(q), np.cos(q)
        turn = wx * st + wy * ct
        yaw = turn / cq
        upright = fx * st + fy * ct
        ahead = (fz * cq - upright * sq) * STANDARD_GRAVITY
        motion = np.zeros((len(t), STATES))
        motion[:, LEAN] = wz - sq / cq * turn
        motion[:, PITCH] = wy * st - wx * ct
        motion[:, LEFT] = (fx * ct - fy * st) * STANDARD_GRAVITY - yaw * forward
        motion[:, UP] = (upright * cq + fz * sq - 1.0) * STANDARD_GRAVITY
        motion[:, FORWARD] = ahead + yaw * left
        high, front = p[:, HEIGHT], p[:, AHEAD]
        place_x, place_y, place_z = wy * front - wz * high, -wx * front, wx * high
        raised = place_x * st + place_y * ct
        wheel_left = left - (place_x * ct - place_y * st)
        wheel_up = up - (raised * cq + place_z * sq)
        wheel = forward - (place_z * cq - raised * sq)
        measured = np.empty((len(t), MEASURED))
        measured[:, 0] = wheel_left
        measured[:, 1] = wheel_up - wheel * (q - p[:, DIVE] * ahead)
        measured[:, 2] = wheel_up
        measured[:, 3] = fx - p[:, TYRES] * st - p[:, BESIDE]
        measured[:, 4] = wheel - USUAL_MPS
        measured[:, 5] = np.nan_to_num(self.windows.speed) - wheel + p[:, DELAY] * ahead
        measured[:, 6], measured[:, 7], measured[:, 8] = left, up, forward
        measured[:, 9], measured[:, 10], measured[:, 11] = wx, wy, wz
        measured[:, 12] = np.minimum(wheel, 0.0)
        return motion, measured

    def sigmas(self) -> tuple[Array, Array]:
        """(n, STATES) and (n, MEASURED): standard deviations of the motion over a window and of what is measured;
        infinite where there is no measurement."""
        w = self.windows
        seconds = np.maximum(w.seconds, 1e-4)
        root = np.sqrt(seconds)[:, None]
        motion = np.empty((len(w), STATES))
        motion[:, :2] = ANGLE_ROOT
        motion[:, 2:5] = VELOCITY_ROOT
        motion[:, :5] *= root * self.unrest[:, None]
        motion[:, :2] = np.hypot(motion[:, :2], jolted(w)[:, None])
        motion[:, BIAS] = BIAS_ROOT * root
        moved = ~self.still
        for loose, rows in ((w.gap | (self.in_hand & moved), slice(0, 5)), (self.not_riding & moved, slice(2, 5))):
            motion[loose, rows] = np.minimum(GAP_ROOT * root[loose], GAP_MOST)[:, rows] + 1e-4

        def lasting(sigma: Array | float, over_s: float) -> Array:
            return sigma * np.sqrt(np.maximum(1.0, 2.0 * over_s / seconds))

        speed = np.maximum(self.speed, 0.0)
        riding = self.riding
        measured = np.full((len(w), MEASURED), np.inf)
        slide = np.hypot(SLIDE, SLIDE_SHARE * speed * np.tan(np.clip(self.leaned, -1.0, 1.0)))
        measured[riding, 0] = (self.unrest * lasting(slide, SLIDE_S))[riding]
        dive = lasting(np.hypot(DIVE_MPS, DIVE_ANGLE * speed), DIVE_S)
        measured[riding, 1] = (self.unrest * dive)[riding]
        measured[riding, 2] = lasting(np.hypot(SLOPE_MPS, SLOPE_ANGLE * speed), SLOPE_S)[riding]
        balance = np.hypot(BALANCE, BALANCE_LEANED * np.sin(self.leaned))
        balanced = riding & (self.speed > BALANCED_MPS)
        measured[balanced, 3] = np.hypot(lasting(balance, BALANCE_S), BALANCE_ROLLING * self.rolling)[balanced]
        measured[riding, 4] = lasting(ANY_MPS, ANY_S)[riding]
        given = ~np.isnan(w.speed) & ~w.gap
        measured[given, 5] = GIVEN_MPS
        rest = self.still & ~w.gap
        measured[rest, 6:9] = REST_MPS
        measured[rest, 9:12] = REST_RADPS
        measured[riding, 12] = BACKWARD_MPS
        measured[self.not_riding & moved & ~w.gap, 6:9] = HAND_MPS
        return motion, measured

    def linearised(self, states: Array, p: Array, robust: bool) -> Array:
        """(n, ROWS, 2 STATES + PARAMETERS + 1): derivatives of the weighted residuals, and the residuals. states
        (n + 1, STATES): at the windows' edges."""
        middle, step = 0.5 * (states[1:] + states[:-1]), states[1:] - states[:-1]
        seconds = self.windows.seconds[:, None]
        seconds = np.where(self.windows.gap[:, None], 0.0, seconds)
        motion_sigma, measured_sigma = self.sigmas()
        motion, measured = self.values(middle, p)
        weight = 1.0 / measured_sigma
        if robust:
            off = np.abs(step - seconds * motion)[:, :BIAS.start] / motion_sigma[:, :BIAS.start]
            motion_sigma[:, :BIAS.start] *= np.sqrt(1.0 + (off / JOLT) ** 2)
            weight = weight / np.sqrt(1.0 + (self._standing(measured * weight) / OUTLIER) ** 2)
        n = len(middle)
        out = np.zeros((n, ROWS, 2 * STATES + PARAMETERS + 1))
        scale = seconds / motion_sigma
        for i in range(STATES):
            moved = middle.copy()
            moved[:, i] += STATE_STEPS[i]
            d_motion, d_measured = self.values(moved, p)
            half = -0.5 * scale * (d_motion - motion) / STATE_STEPS[i]
            out[:, :STATES, i] = out[:, :STATES, STATES + i] = half
            half = 0.5 * weight * (d_measured - measured) / STATE_STEPS[i]
            out[:, STATES:, i] = out[:, STATES:, STATES + i] = half
            out[:, i, i] -= 1.0 / motion_sigma[:, i]
            out[:, i, STATES + i] += 1.0 / motion_sigma[:, i]
        for j in range(PARAMETERS):
            moved = p.copy()
            moved[:, j] += 1e-5
            d_motion, d_measured = self.values(middle, moved)
            out[:, :STATES, 2 * STATES + j] = -scale * (d_motion - motion) / 1e-5
            out[:, STATES:, 2 * STATES + j] = weight * (d_measured - measured) / 1e-5
        out[:, :STATES, -1] = step / motion_sigma - scale * motion
        out[:, STATES:, -1] = weight * measured
        return out

    def unrest_of(self, residual: Array) -> Array:
        """(n) how large errors are around each window, over the sigmas of a rough ride. residual (n, ROWS): weighted,
        as linearised() gives it."""
        riding = self.riding
        squares = np.mean((residual[:, CALMED] / EXPECTED) ** 2, axis=1) * self.unrest**2
        share = averaged(riding.astype(float), UNREST_S)
        found = averaged(np.where(riding, squares, 0.0), UNREST_S) / np.maximum(share, 1e-9)
        return np.where(share > 0.02, np.clip(np.sqrt(found), LEAST_UNREST, MOST_UNREST), 1.0)

    def _standing(self, residual: Array) -> Array:
        """An assumption that holds for long is judged by its own sigma, not by its share of a window."""
        seconds = np.maximum(self.windows.seconds, 1e-4)[:, None]
        lasting = np.ones((len(residual), MEASURED))
        for row, over_s in ((0, SLIDE_S), (1, DIVE_S), (2, SLOPE_S), (3, BALANCE_S), (4, ANY_S)):
            lasting[:, row] = np.sqrt(np.maximum(1.0, 2.0 * over_s / seconds[:, 0]))
        return residual * lasting
