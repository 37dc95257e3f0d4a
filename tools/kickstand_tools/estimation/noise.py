"""The process noise and the measurement noise of model.py, with all their parameters.

Each line has the form: symbol = default # meaning, unit. All values are standard deviations. A disturbance that lasts
for tau seconds appears in many windows of T seconds. Measurements that share an error are not independent. Therefore
the variance in each window is sigma^2 2 tau / T.
"""

import numpy as np

from ..checks.leaning import WINDOW_S, averaged
from ..signals import Array, Bools, moving_mean
from . import model as eq
from .model import BIAS, FORWARD, LEAN, LEFT, PITCH, UP
from .windows import Windows, in_hand

# Process noise, per square root of a second
ANGLE_ROOT = np.radians(0.2)  # lean and pitch, due to vibration of the gyro, in rad
VELOCITY_ROOT = (0.05, 0.05, 0.10)  # velocity left, up, forward, due to vibration of the accelerometer, in m/s
BIAS_ROOT = np.radians(0.005)  # the gyro's bias if the log has a temperature, in rad/s
# The gyro's bias if the log has no temperature, in rad/s. The bias of a gyro that warms up changes by 0.6 deg/s in five
# minutes.
WARMING_ROOT = np.radians(0.01)
# Noise while readings are missing or a hand holds the sensor: lean and pitch (rad), velocity left, up, forward (m/s).
# This noise grows with the square root of the time, by LOST_ROOT in the first second, and never exceeds LOST_MOST.
LOST_ROOT = np.array([np.radians(30.0), np.radians(5.0), 3.0, 1.0, 4.0])
LOST_MOST = np.array([np.radians(60.0), np.radians(8.0), 20.0, 2.0, 20.0])
# In a jolt, a sample's rate differs from the window's mean by more than JOLTED_RADPS. The angles are then wrong by
# JOLTED_S times the excess.
JOLTED_RADPS, JOLTED_S = np.radians(150.0), 0.06
JOLT = 4.0  # a larger residual of the process model, in standard deviations, is a jolt and is down-weighted (Cauchy)

# Measurement noise. Each name that ends in _S is the time that such an error lasts.
# The sideways velocity of the wheels has a constant part, and a part in proportion to speed x tan(lean).
SLIDE_MPS, SLIDE_SHARE, SLIDE_S = 0.15, 0.01, 0.5
# The upward velocity of the wheels has a constant part, and a part due to the chassis' pitch relative to the road.
DIVE_MPS, DIVE_RAD, DIVE_S = 0.1, np.radians(2.5), 0.5
# On slopes, the upward velocity of the wheels has a constant part, and a part due to the slope.
SLOPE_MPS, SLOPE_RAD, SLOPE_S = 0.1, np.radians(2.0), 4.0
STEEP = np.radians(10.0)  # DIVE_RAD and SLOPE_RAD double at this pitch; roads are less steep, wheelies steeper
BALANCE_G, BALANCE_S = 0.011, 3.0  # force to the side, due to wind, camber and the rider
# Two more parts of the force to the side: the first (in g) times sin(lean), and the second (in g s2/rad) times the roll
# acceleration
BALANCE_LEANED_G, BALANCE_ROLLING = 0.045, 0.05
BALANCE_MIN_MPS = 4.0  # least speed of a balanced bike; at lower speeds, steering and feet also balance it
ANY_MPS, ANY_S = 20.0, 60.0  # difference of the speed from USUAL_MPS, for a ride in which nothing else shows the speed
SPEED_MPS = 1.0  # the log's speed, if there is one per second; a receiver's error lasts for some seconds
REST_MPS, REST_RADPS = 0.05, np.radians(0.15)  # velocity and rates of a bike that stands
HAND_MPS = 0.5  # velocity in a window in which a hand moves the sensor
BACKWARD_MPS = 0.3  # speed below 0, because bikes hardly roll backwards
OUTLIER = 2.0  # larger residuals of measurements, in standard deviations, are down-weighted (Cauchy)
LASTING_S = {eq.SLIDING: SLIDE_S, eq.CLIMBING: DIVE_S, eq.SLOPING: SLOPE_S, eq.BALANCED: BALANCE_S, eq.ANY_SPEED: ANY_S}

# The roughness of a ride is the rms of the residuals in ROUGH, divided by EXPECTED. EXPECTED is the rms of each
# residual in a rough ride.
ROUGH = [LEAN, PITCH, LEFT, UP, FORWARD, eq.SLIDING, eq.CLIMBING]
EXPECTED = np.array([0.38, 0.38, 0.38, 0.38, 0.38, 0.5, 0.5])
ROUGHNESS_S, LEAST_ROUGHNESS, MOST_ROUGHNESS = 60.0, 0.1, 4.0
# A resonating mount causes accelerations that are not the bike's. Such accelerations are white noise only if they are
# brief. The residual CLIMBING shows their size and how long they last. CLIMBING is the upward velocity from integrated
# forces minus the upward velocity from pitch and speed.
#
# The misfit is a factor on the standard deviation of the velocities. To compute it, take the means of CLIMBING over
# LASTING_MISFIT_S, and multiply their rms by the root of the number of windows in a mean. Divide the result by
# USUAL_MISFIT, its value in an ordinary ride. The misfit is the square of this ratio. A mount's error in m/s is the
# same in town as on a motorway. Therefore, at any speed, CLIMBING is first divided by its standard deviation at
# MISFIT_MPS.
LASTING_MISFIT_S, MISFIT_MPS, USUAL_MISFIT, MOST_MISFIT = 2.0, 25.0, 0.25, 6.0
# If the misfit is over 1, the roughness is at least MISFIT_ROUGHNESS times the misfit. The residuals alone would give
# less, because lasting errors have small residuals.
MISFIT_ROUGHNESS = 0.14
# The unbalance of a ride is estimated in the same way. Subtract from BALANCED its mean over LASTS_S, which is BESIDE,
# and divide it by its standard deviation. Average the result over BRIEF_S or LONG_S. The unbalance follows from the rms
# of these averages. Longer averages remove errors that change sign, such as a rider's corrections. So BRIEF_S
# overestimates the noise, for caution, and LONG_S does not.
BRIEF_S, LONG_S, LASTS_S = 3.0, 10.0, 40.0
LEAST_UNBALANCE, MOST_UNBALANCE = 0.12, 6.0
LEAST_WINDOWS = 50  # with fewer windows of balanced riding, the unbalance stays 1


class Noise:
    """The standard deviations of n windows. Set lean, pitch and speed, in rad and m/s, before you call sigma().

    riding, still: True where the bike may be riding, and where it stands.
    roughness: factor on the noise of vibration; 1 for a rough ride.
    misfit: factor on the noise of the velocities; 1 if the accelerations are the bike's.
    doubtful: True where the bike is riding and the misfit is at its limit.
    unbalance: factor on the noise of BALANCED; 1 for an average ride.
    """

    def __init__(self, windows: Windows, still: Bools) -> None:
        self._windows, self.still = windows, still & ~windows.gap
        self._in_hand, self._not_riding = (held & ~still for held in in_hand(windows))
        self._rolling = np.gradient(windows.rate[:, 2]) / WINDOW_S if len(windows) > 1 else np.zeros(1)
        self.riding = ~windows.gap & ~still & ~self._not_riding
        self.lean = self.pitch = self.speed = np.zeros(len(windows))
        self.roughness, self.misfit, self.unbalance = np.ones(len(windows)), np.ones(len(windows)), 1.0
        self._own_misfit, self.doubtful = self.misfit, np.zeros(len(windows), dtype=bool)
        seconds = np.maximum(windows.seconds, 1e-4)
        self._root = np.sqrt(seconds)[:, None]
        # The factor on the standard deviation in a window, for errors that last longer than the window.
        self._lasting = np.ones((len(windows), eq.ROWS))
        for row, over_s in LASTING_S.items():
            self._lasting[:, row] = np.sqrt(np.maximum(1.0, 2.0 * over_s / seconds))

    def sigma(self) -> Array:
        """Return the standard deviations in each window, shape (n, ROWS).

        The process noise over the window comes first, then the measurement noise, infinite where there is no
        measurement.
        """
        w, riding, balanced = self._windows, self.riding, self._is_balanced
        speed, roughness = np.maximum(self.speed, 0.0), self.roughness
        sigma = np.full((len(w), eq.ROWS), np.inf)
        sigma[:, :LEFT] = ANGLE_ROOT
        sigma[:, LEFT : BIAS.start] = VELOCITY_ROOT
        sigma[:, : BIAS.start] *= self._root * roughness[:, None]
        sigma[:, LEFT : BIAS.start] *= self.misfit[:, None]
        sigma[:, :LEFT] = np.hypot(sigma[:, :LEFT], jolted(w)[:, None])
        sigma[:, BIAS] = (BIAS_ROOT if np.any(w.warm) else WARMING_ROOT) * self._root
        lost, free = np.minimum(LOST_ROOT * self._root, LOST_MOST), w.gap | self._in_hand
        sigma[free, : BIAS.start] = lost[free]
        sigma[self._not_riding, LEFT : BIAS.start] = lost[self._not_riding, LEFT:]
        sideways = SLIDE_SHARE * speed * np.tan(np.clip(self.lean, -1.0, 1.0))
        sigma[riding, eq.SLIDING] = (roughness * np.hypot(SLIDE_MPS, sideways))[riding]
        sigma[riding, eq.CLIMBING] = (roughness * np.hypot(DIVE_MPS, DIVE_RAD * speed))[riding]
        sigma[riding, eq.SLOPING] = np.hypot(SLOPE_MPS, SLOPE_RAD * speed)[riding]
        sigma[balanced, eq.BALANCED] = (self.unbalance * self._of_balance())[balanced]
        sigma[:, eq.CLIMBING : eq.SLOPING + 1] *= self._wheelie_factor[:, None]
        sigma[riding, eq.ANY_SPEED] = ANY_MPS
        sigma *= self._lasting
        sigma[balanced, eq.BALANCED] = np.hypot(sigma[:, eq.BALANCED], BALANCE_ROLLING * self._rolling)[balanced]
        sigma[~np.isnan(w.speed) & ~w.gap, eq.MEASURED_SPEED] = SPEED_MPS
        sigma[self.still, eq.RESTING], sigma[self.still, eq.RESTING_RATE] = REST_MPS, REST_RADPS
        sigma[self._not_riding & ~w.gap, eq.RESTING] = HAND_MPS
        sigma[riding, eq.BACKWARD] = BACKWARD_MPS
        return sigma

    def robust(self, sigma: Array, off: Array) -> Array:
        """Return `sigma`, enlarged where a residual in `off` is an outlier (Cauchy). All have the shape (n, ROWS)."""
        limit = OUTLIER / self._lasting  # OUTLIER does not include the factor for the duration of a disturbance
        limit[:, : BIAS.start], limit[:, BIAS] = JOLT, np.inf
        return sigma * np.hypot(1.0, off / sigma / limit)

    def estimate_roughness(self, residual: Array) -> None:
        """Set the roughness from the mean square around each window of residuals divided by sigma(), (n, ROWS)."""
        squares = np.mean((residual[:, ROUGH] / EXPECTED) ** 2, axis=1) * self.roughness**2
        share = averaged(self.riding.astype(float), ROUGHNESS_S)
        mean_square = averaged(np.where(self.riding, squares, 0.0), ROUGHNESS_S) / np.maximum(share, 1e-9)
        least = np.where(self.misfit > 1.0, MISFIT_ROUGHNESS * self.misfit, LEAST_ROUGHNESS)
        self.roughness = np.where(share > 0.02, np.clip(np.sqrt(mean_square), least, MOST_ROUGHNESS), 1.0)

    def estimate_misfit(self, off: Array) -> None:
        """Estimate from the residuals, shape (n, ROWS), how much the accelerations differ from a bike's.

        The misfit for the states comes from CLIMBING divided by its standard deviation, which grows with speed. Slow
        rides then get too little weight, but the states become only slightly worse. The misfit for the covariance comes
        from CLIMBING divided by a constant. It is used after count_own_misfit().
        """
        limit = OUTLIER / self._lasting[:, eq.CLIMBING]

        def factor(sigma: Array) -> Array:
            size = off[:, eq.CLIMBING] / sigma
            return self._misfit(size / np.hypot(1.0, size / limit))

        unit = np.hypot(DIVE_MPS, DIVE_RAD * MISFIT_MPS) * self._wheelie_factor * self._lasting[:, eq.CLIMBING]
        self._own_misfit = factor(unit)
        self.misfit = factor(self.sigma()[:, eq.CLIMBING])
        self.doubtful = self.riding & (self.misfit >= MOST_MISFIT)

    def count_own_misfit(self) -> None:
        self.misfit = self._own_misfit

    def _misfit(self, residual: Array) -> Array:
        """Return the misfit, shape (n). residual: CLIMBING divided by its unit, shape (n)."""
        count = round(LASTING_MISFIT_S / WINDOW_S)
        lasting = np.where(self.riding, residual, 0.0)
        # The squares are limited, because in a wheelie the residual is large but brief.
        squares = np.minimum(count * moving_mean(lasting, count) ** 2, 2.0 * MOST_MISFIT * USUAL_MISFIT**2)
        share = averaged(self.riding.astype(float), ROUGHNESS_S)
        mean = averaged(np.where(self.riding, squares, 0.0), ROUGHNESS_S) / np.maximum(share, 1e-9)
        ratio = np.where(share > 0.02, mean / USUAL_MISFIT**2, 1.0)
        return np.clip(ratio, 1.0, MOST_MISFIT)

    def estimate_unbalance(self, force: Array, over_s: float) -> None:
        """Set the unbalance; with too few balanced windows to 1.

        force: the measurement BALANCED, shape (n), in g.
        over_s: BRIEF_S or LONG_S.
        """
        counted = self._is_balanced
        share, complete = averaged(counted.astype(float), LASTS_S), averaged(counted.astype(float), over_s) > 0.97
        self.unbalance = 1.0
        if np.count_nonzero(complete) < LEAST_WINDOWS:
            return
        deviation = force - averaged(np.where(counted, force, 0.0), LASTS_S) / np.maximum(share, 1e-9)
        mean = averaged(np.where(counted, deviation / self._of_balance(), 0.0), over_s)[complete]
        # An error that lasts for BALANCE_S keeps this share of its variance in a mean over over_s.
        ratio = over_s / BALANCE_S
        remaining = 2.0 * (ratio - 1.0 + np.exp(-ratio)) / ratio**2
        self.unbalance = float(np.clip(np.sqrt(np.mean(mean**2) / remaining), LEAST_UNBALANCE, MOST_UNBALANCE))

    @property
    def _wheelie_factor(self) -> Array:
        """Factor on the noise of the wheels' upward motion: in a wheelie the chassis does not point along the road."""
        return 1.0 + (self.pitch / STEEP) ** 4

    @property
    def _is_balanced(self) -> Bools:
        return self.riding & (self.speed > BALANCE_MIN_MPS)

    def _of_balance(self) -> Array:
        return np.hypot(BALANCE_G, BALANCE_LEANED_G * np.sin(self.lean))


def jolted(windows: Windows) -> Array:
    """Return the error of the angles in rad that a jolt, or a gyro at the end of its range, may cause, shape (n)."""
    return JOLTED_S * np.maximum(windows.jolt - JOLTED_RADPS, 0.0)
