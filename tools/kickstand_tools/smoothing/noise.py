"""How large the errors of the motion and of the measurements of equations.py are, and every parameter of that.

Symbol = default  # unit: what it is. Standard deviations are 1 sigma. A disturbance that lasts tau seconds, measured in
each window of T seconds, gets the variance sigma^2 2 tau / T, because measurements that share an error must not count
as independent.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..logs.axes.leaning import averaged
from ..logs.table import Array
from .parameters import BIAS, FORWARD, LEAN, LEFT, PITCH, STATES, UP
from .windows import Windows

# Measurements: rows after those of the motion
SLIDING, CLIMBING, SLOPING, BALANCED, ANY_SPEED, GIVEN_SPEED = 0, 1, 2, 3, 4, 5
RESTING, RESTING_RATE, BACKWARD = slice(6, 9), slice(9, 12), 12
MEASURED = 13

# Noise of the motion, per square root of a second
ANGLE_ROOT = np.radians(0.2)  # rad: of lean and pitch, by vibration of the gyro
VELOCITY_ROOT = (0.05, 0.05, 0.10)  # m/s: left, up, forward, by vibration of the accelerometer
BIAS_ROOT = np.radians(0.005)  # rad/s
WARMING_ROOT = np.radians(0.01)  # the same where no temperature tells: 0.6 deg/s in five minutes of warming up
# Where readings are missing, and in the hand: lean, pitch, velocity; per root of a second, and at most
LOST_ROOT = np.array([np.radians(30.0), np.radians(5.0), 3.0, 1.0, 4.0])
LOST_MOST = np.array([np.radians(60.0), np.radians(8.0), 20.0, 2.0, 20.0])
JOLTED_RADPS, JOLTED_S = np.radians(150.0), 0.06  # a rate that is so far from its window's mean errs, for so long
JOLT = 4.0  # sigmas of the motion within a window: what is more is a jolt to the sensor, and counts less and less

# Errors of the measurements, and how long they last
SLIDE_MPS, SLIDE_SHARE, SLIDE_S = 0.15, 0.01, 0.5  # m/s sideways, and as a share of speed x tan(lean)
DIVE_MPS, DIVE_RAD, DIVE_S = 0.1, np.radians(2.5), 0.5  # m/s up, and as an angle: of the chassis against the road
SLOPE_MPS, SLOPE_RAD, SLOPE_S = 0.1, np.radians(2.0), 4.0  # the same, of the road against the horizontal
BALANCE_G, BALANCE_S = 0.011, 3.0  # force to the side, by wind, camber and the rider
BALANCE_LEANED_G, BALANCE_ROLLING = 0.045, 0.05  # the same over sin(lean), and over the roll acceleration (g s2/rad)
BALANCE_MIN_MPS = 4.0  # below, steering and feet count
USUAL_MPS, ANY_MPS, ANY_S = 15.0, 20.0, 60.0  # speed where nothing tells it
GIVEN_MPS = 1.0  # of the log's speed, in each second: a receiver errs for some seconds together
REST_MPS, REST_RADPS = 0.05, np.radians(0.15)  # of a bike that stands
HAND_MPS = 0.5  # of a sensor that is moved about, over a window
BACKWARD_MPS = 0.3  # of a bike that rides backwards
OUTLIER = 2.0  # sigmas: what is further off counts less and less
LASTING_S = ((SLIDING, SLIDE_S), (CLIMBING, DIVE_S), (SLOPING, SLOPE_S), (BALANCED, BALANCE_S), (ANY_SPEED, ANY_S))

# How rough a ride is, it tells itself: by the rms of these residuals over those that are expected of a rough ride
TELLING = [LEAN, PITCH, LEFT, UP, FORWARD, STATES + SLIDING, STATES + CLIMBING]
EXPECTED = np.array([0.38, 0.38, 0.38, 0.38, 0.38, 0.5, 0.5])
ROUGHNESS_S, LEAST_ROUGHNESS, MOST_ROUGHNESS = 60.0, 0.1, 4.0
# How far from balance a ride is, likewise: by the rms of BALANCED in means over some seconds, less what lasts longer
# (parameters.BESIDE), over its standard deviation. The longer these means, the more an error has gone that changes
# sides, as a rider's corrections do: over BRIEF_S the balance is judged with care, over LONG_S as it is.
BRIEF_S, LONG_S, LASTS_S = 3.0, 10.0, 40.0
LEAST_UNBALANCE, MOST_UNBALANCE = 0.25, 6.0
TOLD_BY = 50  # windows, at least


@dataclass
class Circumstances:
    """What is known of each of n windows.

    still (n): the bike stands. in_hand, not_riding (n): of first_guess.in_hand(). rolling (n): roll acceleration,
    rad/s^2. lean (n, rad), speed (n, m/s): roughly. roughness (n): of roughness_of(), 1 for a rough ride. unbalance:
    of unbalance_of().
    """

    windows: Windows
    still: NDArray[np.bool_]
    in_hand: NDArray[np.bool_]
    not_riding: NDArray[np.bool_]
    rolling: Array
    lean: Array
    speed: Array
    roughness: Array
    unbalance: float

    @property
    def riding(self) -> NDArray[np.bool_]:
        """(n) True where the bike rides, or may."""
        return ~self.windows.gap & ~self.still & ~self.not_riding

    @property
    def _balanced(self) -> NDArray[np.bool_]:
        return self.riding & (self.speed > BALANCE_MIN_MPS)

    def _of_balance(self) -> Array:
        """(n) g: of a ride that is as far from balance as usual."""
        return np.hypot(BALANCE_G, BALANCE_LEANED_G * np.sin(self.lean))

    def of_motion(self) -> Array:
        """(n, STATES): standard deviations of what the states change by within a window."""
        w = self.windows
        root = np.sqrt(np.maximum(w.seconds, 1e-4))[:, None]
        found = np.empty((len(w), STATES))
        found[:, :LEFT] = ANGLE_ROOT
        found[:, LEFT : BIAS.start] = VELOCITY_ROOT
        found[:, : BIAS.start] *= root * self.roughness[:, None]
        found[:, :LEFT] = np.hypot(found[:, :LEFT], jolted(w)[:, None])
        found[:, BIAS] = (BIAS_ROOT if np.any(w.warm) else WARMING_ROOT) * root
        lost = np.minimum(LOST_ROOT * root, LOST_MOST)
        everything, velocity = w.gap | (self.in_hand & ~self.still), self.not_riding & ~self.still
        found[everything, : BIAS.start] = lost[everything]
        found[velocity, LEFT : BIAS.start] = lost[velocity, LEFT:]
        return found

    def of_measurements(self) -> Array:
        """(n, MEASURED): standard deviations, infinite where there is no measurement."""
        w, riding, speed = self.windows, self.riding, np.maximum(self.speed, 0.0)
        found = np.full((len(w), MEASURED), np.inf)
        sideways = SLIDE_SHARE * speed * np.tan(np.clip(self.lean, -1.0, 1.0))
        found[riding, SLIDING] = (self.roughness * np.hypot(SLIDE_MPS, sideways))[riding]
        found[riding, CLIMBING] = (self.roughness * np.hypot(DIVE_MPS, DIVE_RAD * speed))[riding]
        found[riding, SLOPING] = np.hypot(SLOPE_MPS, SLOPE_RAD * speed)[riding]
        balanced = self._balanced
        found[balanced, BALANCED] = (self.unbalance * self._of_balance())[balanced]
        found[riding, ANY_SPEED] = ANY_MPS
        found *= self.lasting()
        found[balanced, BALANCED] = np.hypot(found[:, BALANCED], BALANCE_ROLLING * self.rolling)[balanced]
        found[~np.isnan(w.speed) & ~w.gap, GIVEN_SPEED] = GIVEN_MPS
        resting = self.still & ~w.gap
        found[resting, RESTING], found[resting, RESTING_RATE] = REST_MPS, REST_RADPS
        found[self.not_riding & ~self.still & ~w.gap, RESTING] = HAND_MPS
        found[riding, BACKWARD] = BACKWARD_MPS
        return found

    def lasting(self) -> Array:
        """(n, MEASURED): what an error that lasts is multiplied by in each window."""
        seconds = np.maximum(self.windows.seconds, 1e-4)
        found = np.ones((len(seconds), MEASURED))
        for row, over_s in LASTING_S:
            found[:, row] = np.sqrt(np.maximum(1.0, 2.0 * over_s / seconds))
        return found

    def roughness_of(self, residual: Array) -> Array:
        """(n): how large errors are around each window. residual (n, STATES + MEASURED): values of Residuals."""
        squares = np.mean((residual[:, TELLING] / EXPECTED) ** 2, axis=1) * self.roughness**2
        share = averaged(self.riding.astype(float), ROUGHNESS_S)
        found = averaged(np.where(self.riding, squares, 0.0), ROUGHNESS_S) / np.maximum(share, 1e-9)
        return np.where(share > 0.02, np.clip(np.sqrt(found), LEAST_ROUGHNESS, MOST_ROUGHNESS), 1.0)

    def unbalance_of(self, force: Array, over_s: float) -> float:
        """How large errors of the balance are. force (n): the measurement BALANCED, g. over_s: BRIEF_S or LONG_S."""
        counted = self._balanced
        share, whole = averaged(counted.astype(float), LASTS_S), averaged(counted.astype(float), over_s) > 0.97
        if np.count_nonzero(whole) < TOLD_BY:
            return 1.0
        off = force - averaged(np.where(counted, force, 0.0), LASTS_S) / np.maximum(share, 1e-9)
        mean = averaged(np.where(counted, off / self._of_balance(), 0.0), over_s)[whole]
        ratio = over_s / BALANCE_S  # left in a mean is this share of the variance of an error that lasts BALANCE_S
        left = 2.0 * (ratio - 1.0 + np.exp(-ratio)) / ratio**2
        return float(np.clip(np.sqrt(np.mean(mean**2) / left), LEAST_UNBALANCE, MOST_UNBALANCE))


def jolted(windows: Windows) -> Array:
    """(n) rad: by how much a jolt, or a gyro at the end of its range, may have falsified the angles in each window."""
    return JOLTED_S * np.maximum(windows.jolt - JOLTED_RADPS, 0.0)
