"""The measurements of the lean filter in a window, their noise, and every parameter of the filter.

Each function returns the arguments of Covariance.update():
    derivatives: ((state, d measurement / d state), ...)
    innovation: measured minus expected value
    variance: variance of the measurement's noise
These arguments are the same in all functions:
    model: a Linearisation
    x: the state
    means: see bike_model.predict()

SIGMA_... are standard deviations (1 sigma). A disturbance that lasts tau seconds affects several measurements, so their
errors are not independent. Therefore the variance of the disturbance in windows of T seconds is sigma^2 2 tau / T. The
parameters of the trim are in kalman.py, in the same form.
"""

from math import atan2, radians, sqrt

from ..units import STANDARD_GRAVITY, const
from .bike_model import BIAS_LEFT, LEAN, PITCH, SCALE_LEFT, SPEED, YAW_ERROR

# The comment of each parameter has its unit, its meaning and, after "Larger:", the effect of a larger value.

# The start, before anything is measured
START_MAX_RATE = 0.02  # rad/s: largest rate that counts as standing. Larger: riding is mistaken for standing.
# g: largest deviation of the force from 1 g that counts as standing. Larger: riding is mistaken for standing.
START_MAX_FORCE = 0.05
# Standard deviation of each state before the first measurement. Larger: the state is found sooner, but absorbs the
# errors of other states.
SIGMA_START = (
    radians(1.5),  # rad: lean of a standing bike, computed from the force
    radians(5.0),  # rad: pitch
    15.0,  # m/s: speed
    radians(1.0),  # rad/s: drift of the gyro's bias since the calibration, left
    radians(1.0),  # rad/s: the same drift, up
    radians(1.0),  # rad/s: the same drift, forward
    radians(5.0),  # rad: yaw error of the alignment, caused by pitch in the kickstand pose
    # ratio: scale error of the gyro's left axis minus the scale error of its up axis. The data sheet allows 0.03 each.
    0.020,
    0.014,  # ratio: reading of the gyro's left axis per rate about up. The data sheet allows 0.02.
    0.014,  # ratio: reading of the gyro's forward axis per rate about left
    0.014,  # ratio: reading of the gyro's forward axis per rate about up
    0.014,  # ratio: scale error of the gyro's forward axis
)
# ratio: reading of the gyro's left and forward axes per rate about up, after an alignment by two poses without the six
# positions. The accelerometer's offset, up to 0.08 g, then tilts the vehicle's axes, but not for the gyro. Larger: this
# tilt is found sooner, but absorbs the errors of other states.
_SIGMA_TILT = const(0.035)
# If the readings no longer fit (consistency.py), the filter restarts. The first two restarts keep the speed, and the
# errors of the sensor that were estimated REMEMBER_S to 2 x REMEMBER_S earlier. Later restarts keep nothing.
REMEMBER_S = 10.0  # s. Larger: the remembered errors are older.
# rad/s: standard deviation of a remembered bias. Larger: a bias that has changed is found sooner.
SIGMA_GOOD_BIAS = radians(0.6)
# ratio: standard deviation of all other remembered errors, as a share of SIGMA_START. Larger: errors that have changed
# are found sooner.
GOOD_SHARE = 0.7
# m/s: amount added to the standard deviation of the kept speed. Larger: the kept speed counts for less.
SIGMA_GOOD_SPEED = 3.0
# m/s: amount added to the standard deviation of a speed that is kept over missing readings. Larger: the lean is found
# later in a bend after missing readings.
SIGMA_GAP_SPEED = 5.0
# rad/s: standard deviation of a bias about which nothing is known. Larger: a bias that has jumped is found sooner.
SIGMA_DOUBT_BIAS = radians(2.5)
# A lean above IMPOSSIBLE_LEAN that the force contradicts for IMPOSSIBLE_S is impossible. Larger: a wrong filter
# restarts later.
IMPOSSIBLE_LEAN = radians(80.0)  # rad
IMPOSSIBLE_S = 1.0  # s
# A bike lies on its side if the force to the side is above LYING_SIDE of the whole force, the force differs from 1 g by
# less than LYING_FORCE, and each rate is below LYING_RATE.
LYING_SIDE = 0.82  # ratio: sine of 55 degrees. Larger: bikes that fell on their luggage are not found.
LYING_FORCE = 0.2  # g. Larger: a ride on a mount that has turned by 90 degrees is mistaken for a fall.
LYING_RATE = 0.15  # rad/s. Larger: the same.
# For MOVING_S after a measured speed above MOVING_SPEED the bike is not at rest.
MOVING_SPEED = 2.0  # m/s. Larger: slow riding on a smooth road is mistaken for rest.
MOVING_S = 2.5  # s. Larger: a stop is detected later, and the lean is compared with older speeds.
# ratio: largest difference of the measured speed and the estimated speed, divided by their sum, with which the lean is
# compared with the measured speed. 0.2 is a factor of 1.5. Larger: after a misfit, a wrong speed hides a correct lean.
AGREED = 0.2
# A bike must be in balance if its speed is above BALANCE_SPEED and the speed's standard deviation is below
# SIGMA_BALANCE_SPEED.
BALANCE_SPEED = 2.0  # m/s. Larger: a slipped mount is detected at fewer speeds.
SIGMA_BALANCE_SPEED = 12.0  # m/s. Larger: a pushed bike is mistaken for a ridden bike.
# m/s: after the first rest, a bike with this speed must be in balance without a bend too. Before the first rest a bike
# on its kickstand may seem to ride. Larger: slips are found later.
FAST = 8.0
# rad: largest standard deviation of a lean that is compared with the rate about left and the measured speed. Larger:
# after a restart a lean that is not yet found counts as wrong.
SIGMA_COMPARED = radians(4.0)
# ratio: largest force forward over force up on a bike. Larger: a board on a table is mistaken for a faulty sensor.
MOST_FORWARD = 1.5
# s: time after which a lean with a larger force forward is hidden. Larger: a failed accelerometer is hidden later, and
# single blows hide no lean.
TIPPED_S = 1.5
# ratio: change of the gyro's scale and cross-axis errors with temperature since the six positions. The data sheet
# allows 2 % from -40 to 85 C. Larger: the measured errors count for less.
_SIGMA_GYRO_DRIFT = const(0.002)
# rad/s: standard deviation of a bias that the kickstand pose has just measured. Larger: the first lean is shown later.
SIGMA_FRESH_BIAS = radians(0.2)
# rad: standard deviation of the first lean if the bike moves. Larger: the lean is shown later, and follows the forces
# more.
SIGMA_START_LEAN_MOVING = radians(30.0)
# m/s: assumed speed if no speed is measured. Larger: if the board is switched on in a bend, the estimated lean is
# larger.
PRIOR_SPEED = 15.0

# Process noise, per square root of a second
# rad: error of the integrated rates, caused by vibration. Larger: the lean follows the forces more and the gyro less.
NOISE_ANGLE = radians(0.24)
NOISE_SPEED = 0.35  # m/s. Larger: the estimated speed adapts sooner in bends, and is less steady on straights.
# rad/s: a bias drifts by 0.6 deg/s in five minutes of warming up. Larger: long bends are mistaken for bias.
NOISE_BIAS = radians(0.01)
# Lost readings
# rad/s: unknown roll rate during lost readings. The unknown pitch rate is a quarter of this rate. Larger: after a gap
# the lean is hidden for longer.
SIGMA_LOST_RATE = radians(30.0)
# g: unknown forward force during lost readings. Larger: after a gap the lean is hidden for longer.
SIGMA_LOST_FORCE = 0.3

# Measurement noise while riding g: noise of the force to the left. Larger: the lean follows this force less, and
# follows the gyro and the assumption of level roads more.
_SIGMA_LEFT = const(0.04)
# g: noise of the upward force, which bumps disturb. Larger: in long bends the gyro's scale errors are found later.
_SIGMA_UP = const(0.07)
# ratio: noise (1 sigma) of the upward force, divided by speed x pitch rate / g. The force to the left has sin(lean)
# times this noise. The noise arises because the springs pitch the bike, but its wheels do not rise. Larger: braking
# disturbs the lean less.
_PITCHING_SHARE = const(2.0)
# ratio: share of the vibration's variance that stays in a window's mean. This share is added to the variance of the
# force to the left. Larger: forces count less on rough roads.
_SHAKEN_SHARE = const(0.1)
# m: h, the sensor's height above the roll axis. Larger: rolling explains more of the force.
_ROLL_HEIGHT_M = const(0.4)
_SIGMA_ROLL_HEIGHT_M = const(0.4)  # m: standard deviation of h. Larger: forces count less while the bike rolls quickly.
# m/s: error of a speed from a receiver or a wheel sensor. Larger: measured speeds count for less.
_SIGMA_MEASURED_SPEED = const(1.0)
# ratio: scale error of the measured speed. A leaning tyre has a smaller radius, and slips. This parameter includes the
# scale error of the gyro's up axis, because the product speed x yaw rate has both errors. Larger: measured speeds count
# for less, most at high speed.
_SIGMA_SPEED_SCALE = const(0.05)
# s: time for which the error _SIGMA_MEASURED_SPEED stays the same. Larger: measured speeds count for less.
_MEASURED_SPEED_S = const(4.0)
# s: time for which the scale error of the speed stays the same. A wheel's radius is smaller during a whole bend.
# Larger: measured speeds count for less, most of all in long bends.
_SPEED_SCALE_S = const(40.0)
# s: possible delay of a measured speed. Larger: measured speeds count for less during acceleration and braking.
_MEASURED_SPEED_LATE_S = const(1.0)
# s: shortest time between two measured speeds that are used. In the windows between them, straight_or_prior_speed() is
# used. Larger: the measured speeds in use are older.
MEASURED_SPEED_EVERY_S = 0.3

# ratio: real standard deviation of the lean's error, divided by the filter's own standard deviation. The filter's
# standard deviation is too large, because the noises in this file are increased for disturbances that last. In
# simulated rides, two thirds of the errors are below this share of the filter's standard deviation. Larger: the claimed
# sigma is larger, and the lean stays the same.
SIGMA_SHARE = 0.46

# Assumptions that take the place of measurements
# rad: slope of roads. Larger: the pitch follows slopes better, and the lean in bends is found less well.
SIGMA_SLOPE = radians(1.6)
# s: duration of a slope. The value is fitted to rides; real slopes last longer. Larger: the lean in bends is found less
# well.
_SLOPE_S = const(3.0)
# rad: pitch at which the assumption of a level road has half its weight. At twice this pitch the assumption has a fifth
# of its weight. Larger: wheelies are mistaken for slopes.
STEEP = radians(6.0)
# The bike rides straight if its lean and yaw rate are below these limits, and its speed is above STRAIGHT_MIN_SPEED.
STRAIGHT_MAX_LEAN = radians(8.0)  # rad. Larger: the lean in wide bends is drawn towards upright.
STRAIGHT_MAX_RATE = radians(2.5)  # rad/s, about the vertical. Larger: the lean in slow bends is drawn towards upright.
STRAIGHT_MIN_SPEED = 4.0  # m/s. Larger: the gyro's drift on slow straights is not removed.
SIGMA_STRAIGHT = radians(0.8)  # rad: lean on straights, caused by wind and camber. Larger: gyro drift is removed later.
_STRAIGHT_S = const(3.0)  # s: duration of a lean caused by wind or camber. Larger: gyro drift is removed later.
# m/s: difference between the real speed and PRIOR_SPEED. Larger: PRIOR_SPEED counts for less.
_SIGMA_PRIOR_SPEED = const(20.0)
# s: time for which a bike keeps about the same speed. Larger: PRIOR_SPEED counts for less.
_PRIOR_SPEED_S = const(60.0)

# Standing still
# rad: error of lean and pitch that are set from the force when the bike comes to rest. Larger: later forces count more.
SIGMA_STAND = radians(0.5)
SIGMA_REST_RATE = radians(0.1)  # rad/s: rates of a standing bike that feet hold. Larger: the bias is found later.
_SIGMA_REST_FORCE = const(0.02)  # g: noise of the force at rest while the engine idles. Larger: the lean settles later.
# ratio: weight of each window in the mean magnitude of the force at rest. Larger: the mean is found sooner, and varies
# more.
REST_FORCE_SHARE = 0.1
SIGMA_REST_SPEED = 0.02  # m/s: error of the speed 0 at rest. Larger: the estimated speed goes to 0 more slowly.
# g: largest forward force at rest that the pitch does not explain. A larger force is braking. Larger: steady braking is
# mistaken for rest.
MAX_REST_PUSH = 0.08
# The bike certainly rolls if the estimated speed is above both of the next limits. Larger: a smooth road is mistaken
# for rest.
ROLLING_SPEED = 3.0  # m/s
ROLLING_SIGMAS = 3.0  # standard deviations of the speed
# g: vibration that no moving bike has, root mean square of the force to the left. The chip's noise is 0.0025, and the
# least vibration of a simulated ride is 0.03. With less vibration, the estimated speed does not exclude the first rest
# since power-on. A sensor whose bias has changed with the temperature seems to move on its kickstand. Larger: a smooth
# road is mistaken for rest.
QUIET = 0.005
VIBRATION_S = 0.5  # s: time constant of this vibration. Larger: rest is detected later, but more reliably.
# Largest deviation of a window's mean from the recent average at rest. Larger: smooth roads are mistaken for rest.
_MAX_FORCE_G = const(0.010)  # g
_MAX_RATE_RADPS = const(0.009)  # rad/s (equal to 0.5 deg/s)
# rad/s (1.2 deg/s): largest mean rate that may be bias. Larger: smooth bends are mistaken for rest.
MAX_BIAS_RADPS = 0.02
# rad/s: largest mean rate that may be bias before the first rest, because the bias has drifted since the calibration.
# Larger: more bends are mistaken for rest.
_MAX_FIRST_BIAS_RADPS = const(0.1)
_REST_S = const(1.5)  # s: duration of stillness that counts as rest. Larger: rest is detected later, but more reliably.
# s: duration of stillness that counts as rest if the bike seems to move or brake. No road is smooth for this long.
_REST_ROLLING_S = const(10.0)
_AVERAGE_S = const(0.5)  # s: time constant of the recent average. Larger: rest is detected later after a movement.
# The trim is measured while the standard deviations of speed and lean are below SIGMA_TRIM_SPEED and SIGMA_TRIM_LEAN.
# Larger: the trim is found sooner, but less exactly.
SIGMA_TRIM_SPEED = 8.0  # m/s
SIGMA_TRIM_LEAN = radians(1.4)  # rad


def gyro_variances(sigma, r, tilted=False):
    """Return the prior variances of the last five states (the gyro's errors), or None for those of SIGMA_START.

    Args:
        sigma: standard errors of the gyro matrix' entries in the sensor's axes, 9 values, treated as independent. All
            are zero if the gyro was not measured.
        r: vehicle_from_sensor, 9 values.
        tilted: True if the accelerometer's unknown offset may have tilted r.
    """
    if not any(sigma):
        if not tilted:
            return None
        scale_left, _, forward_left, _, scale_forward = [value**2 for value in SIGMA_START[SCALE_LEFT:]]
        return [scale_left, _SIGMA_TILT**2, forward_left, _SIGMA_TILT**2, scale_forward]

    def variance(i, j):
        """Return the variance of a gyro error: the reading of axis i per rate about axis j, in the vehicle's axes."""
        total = _SIGMA_GYRO_DRIFT**2
        for a in range(3):
            for b in range(3):
                total += (r[3 * i + a] * r[3 * j + b] * sigma[3 * a + b]) ** 2
        return total

    variances = variance(0, 0) + variance(1, 1), variance(0, 1), variance(2, 0), variance(2, 1), variance(2, 2)
    return [min(variances[k], SIGMA_START[SCALE_LEFT + k] ** 2) for k in range(5)]


def forces(model, means, roll_acceleration, force_error, dive=0.0):
    """Return two measurements: the force to the left (4), and the force up (5).

    Args:
        roll_acceleration: in rad/s^2.
        force_error: relative error of the accelerometer's magnitude, as found at rest.
        dive: the result of Dive.update(), in g.
    """
    # Effect of roll acceleration on the force, in g per metre of height, like `square` below
    rolling = roll_acceleration / STANDARD_GRAVITY
    uncertain = _SIGMA_ROLL_HEIGHT_M * rolling
    left = means[0]
    shaken = max(0.0, means[8] - left * left)
    # When the springs pitch the bike, its wheels do not rise. So v times this part of the pitch rate is not an
    # acceleration. The argument `dive` is the part that braking explains by (8). The rest is noise.
    pitching = _PITCHING_SHARE * model.pitching
    sideways = pitching * model.sin_lean
    left_variance = _SIGMA_LEFT**2 + _SHAKEN_SHARE * shaken + uncertain**2 + sideways * sideways
    left += _ROLL_HEIGHT_M * rolling * model.cos_lean + dive * model.sin_lean
    # In a steady bend the upward force is 1 / cos(lean), so it shows the lean independently of the gyro's scale error.
    # This force of one window shows the lean poorly, but the windows of a minute show it well. A constant error of the
    # force would add up in a minute, so force_error is subtracted.
    square = means[4] * means[4] / STANDARD_GRAVITY
    up = means[1] + _ROLL_HEIGHT_M * square - force_error * means[6] + dive * model.cos_lean
    up_variance = (
        _SIGMA_UP**2
        + pitching * pitching
        + _SIGMA_ROLL_HEIGHT_M**2 * square * square
        + (uncertain * model.sin_lean) ** 2
    )
    return (model.left_row, left, left_variance), (model.up_row, up, up_variance)


def level_road(model, x, seconds):
    """Return the measurement of (6), which assumes that roads are level on average. The measurement's noise grows with
    the pitch, because a large pitch may be a wheelie."""
    innovation = -x[PITCH] - x[YAW_ERROR] * model.sin_lean
    steep = innovation / STEEP
    return model.level_row, innovation, SIGMA_SLOPE**2 * (1.0 + steep * steep) * 2 * _SLOPE_S / seconds


def straight_or_prior_speed(lean, speed, yaw_rate, seconds):
    """Return an assumed measurement: a lean of 0 if the bike rides straight, otherwise the speed PRIOR_SPEED."""
    if abs(lean) < STRAIGHT_MAX_LEAN and abs(yaw_rate) < STRAIGHT_MAX_RATE and speed > STRAIGHT_MIN_SPEED:
        return ((LEAN, 1.0),), -lean, SIGMA_STRAIGHT**2 * 2 * _STRAIGHT_S / seconds
    return ((SPEED, 1.0),), PRIOR_SPEED - speed, _SIGMA_PRIOR_SPEED**2 * 2 * _PRIOR_SPEED_S / seconds


def measured_speed(measured, speed, acceleration, seconds):
    """Return the measurement of speed by a receiver or a wheel sensor. acceleration: in m/s^2, which adds noise,
    because the speed may be late. seconds: time since the previous measured speed. Ten speeds in a second count as much
    as one speed."""
    late = _MEASURED_SPEED_LATE_S * acceleration
    scale = _SIGMA_SPEED_SCALE * measured
    variance = (_SIGMA_MEASURED_SPEED**2 + late * late) * max(1.0, 2 * _MEASURED_SPEED_S / seconds)
    return ((SPEED, 1.0),), measured - speed, variance + scale * scale * max(1.0, 2 * _SPEED_SCALE_S / seconds)


def balanced_lean(speed, yaw_rate):
    """Return the lean of a bike in balance, in rad. speed: in m/s. yaw_rate: about the vertical, in rad/s."""
    return atan2(-speed * yaw_rate, STANDARD_GRAVITY)


def at_rest(model, means, speed, axis):
    """Return the four measurements of a bike at rest (zero-velocity update): the speed is 0, the gyro's reading about
    `axis` (0 to 2) is bias, and the forces to the left and forward come from gravity."""
    return (
        (((SPEED, 1.0),), -speed, SIGMA_REST_SPEED**2),
        (((BIAS_LEFT + axis, 1.0),), means[2 + axis], SIGMA_REST_RATE**2),
        (model.left_row[0:2], means[0] + model.sideways, _SIGMA_REST_FORCE**2),  # only the terms of LEAN and PITCH
        (((PITCH, model.cos_pitch),), means[7] - model.sin_pitch, _SIGMA_REST_FORCE**2),
    )


def lies(means):
    """True if the force is gravity on a bike that lies on its side and does not turn. On a bike in balance the force
    points to the bike's up axis, even if the estimated lean is wrong."""
    force = sqrt(means[5] * means[5] + means[6] * means[6] + means[7] * means[7])
    if abs(means[5]) < LYING_SIDE * force or abs(force - 1.0) > LYING_FORCE:
        return False
    return max(max(means[2:5]), -min(means[2:5])) < LYING_RATE


class RestDetector:
    """Detects rest, for zero-velocity updates. update() takes the means of each window, in which an idling engine
    averages out.

    first: True if there was no rest since power-on, so the bias may be far off.

    moving_s: time for which a measured speed proves that the bike moves.
    first (read-only): False after the first rest.
    resting (read-only): True after _REST_S of stillness, or after _REST_ROLLING_S if the bike seems to move.
    """

    def __init__(self, first=True):
        self.resting = False
        self.first = first
        self.moving_s = 0.0
        self._still_s = 0.0
        self._not_rolling_s = 0.0  # time of stillness without a sign that the bike moves
        self._average = None  # averages of the rates, with the estimated bias included, and of the forces

    def update(self, rates, force, bias, seconds, rolling=False):
        """Take the means over a window.

        Args:
            rates: 3 values in rad/s, without the estimated bias.
            force: 3 values in g.
            bias: the estimated bias, 3 values in rad/s.
            seconds: duration of the window.
            rolling: True if other evidence suggests that the bike moves.
        """
        readings = [rates[i] + bias[i] for i in range(3)] + force
        if self._average is None:
            self._average = readings
        average = self._average
        gain = min(1.0, seconds / _AVERAGE_S)
        max_bias = _MAX_FIRST_BIAS_RADPS if self.first else MAX_BIAS_RADPS
        # The average rate must be small after subtracting either the estimated bias or only the calibrated bias.
        # With only the estimated bias, a wrong estimate, as after moving the sensor by hand, would never be corrected.
        still = near_estimate = near_calibration = True
        for i in range(6):
            deviation = readings[i] - average[i]
            average[i] += gain * deviation
            if i < 3:
                still = still and abs(deviation) < _MAX_RATE_RADPS
                near_estimate = near_estimate and abs(average[i] - bias[i]) < max_bias
                near_calibration = near_calibration and abs(average[i]) < max_bias
            else:
                still = still and abs(deviation) < _MAX_FORCE_G
        still = still and (near_estimate or near_calibration) and self.moving_s <= 0.0
        self.moving_s -= seconds
        self._still_s = self._still_s + seconds if still else 0.0
        # Steady braking looks still, so a second timer counts only stillness without a sign of rolling. With one timer,
        # braking would count as rest as soon as the estimated speed is low.
        self._not_rolling_s = self._not_rolling_s + seconds if still and not rolling else 0.0
        self.resting = self._not_rolling_s >= _REST_S or self._still_s >= _REST_ROLLING_S
        if self.resting:
            self.first = False
