"""What the lean filter measures in a window, how uncertain that is, and every parameter of the filter.

A measurement is what Covariance.update() takes: ((state, d measurement / d state), ...), the innovation (measured minus
expected) and the variance of its noise. model: a Linearisation. x: the state. means: see bike_model.predict().

SIGMA_... are standard deviations (1 sigma). A disturbance that lasts tau seconds, measured once in each window of T
seconds, gets the variance sigma^2 2 tau / T, because measurements that share an error must not count as independent.
Speeds are written in m/s and divided by standard gravity, as the model has them (g s). Standing still and the
trim have their own parameters in rest.py and upright_trim.py, in the same form.
"""

from math import radians

from ..units import STANDARD_GRAVITY
from .bike_model import BIAS_LEFT, LEAN, PITCH, SPEED, YAW_ERROR

# Symbol = default  # unit: what it is. "Larger:" says what raising it does.

# The start: before anything is measured
START_MAX_RATE = 0.02  # rad/s: largest rate that counts as standing. Larger: riding is mistaken for it.
START_MAX_FORCE = 0.05  # g: largest deviation from 1 g that counts as standing. Larger: as above.
SIGMA_START = (  # Larger, each: found sooner, but the other states' errors are mistaken for it.
    radians(1.5),  # rad: lean of a bike that stands, by the force
    radians(5.0),  # rad: pitch
    15.0 / STANDARD_GRAVITY,  # g s: speed
    radians(1.0),  # rad/s: drift of the gyro's bias since the calibration, left
    radians(1.0),  # rad/s: up
    radians(1.0),  # rad/s: forward
    radians(5.0),  # rad: yaw error of the kickstand pose
    0.020,  # of 1: scale of the gyro's left axis against that of its up axis; 0.03 is allowed to each
    0.014,  # of 1: cross-axis, left of up; 0.02 is allowed
    0.014,  # of 1: cross-axis, forward of left
    0.014,  # of 1: cross-axis, forward of up
    0.014,  # of 1: scale of the forward axis
)
SIGMA_START_LEAN_MOVING = radians(30.0)  # rad: lean under way. Larger: lean is shown later, and follows forces more.
USUAL_SPEED = 15.0 / STANDARD_GRAVITY  # g s: if nothing measures it. Larger: leans begun before the start are larger.

# Process noise, per square root of a second
NOISE_ANGLE = radians(0.2)  # rad: vibration of the gyro. Larger: lean follows the forces more and the gyro less.
NOISE_SPEED = 0.35 / STANDARD_GRAVITY  # g s. Larger: speed follows turns sooner, and is less steady on straights.
NOISE_BIAS = radians(0.01)  # rad/s: 0.6 deg/s in five minutes of warming up. Larger: long turns are mistaken for bias.
# Where readings are lost
SIGMA_LOST_RATE = radians(30.0)  # rad/s: roll rate, against the one after the gap; pitch a quarter. Larger: see below.
SIGMA_LOST_FORCE = 0.3  # g: forward. Larger, both: after a gap the lean is hidden longer, and follows the forces more.

# Measurement noise while riding
SIGMA_LEFT = 0.04  # g: of the force to the left. Larger: lean follows it less, and the gyro and level roads more.
SIGMA_UP = 0.07  # g: of the force up, which bumps disturb. Larger: in held turns scale errors are found later.
PITCHING_SHARE = 2.0  # of 1: of the pitch rate that springs may be to blame for. Larger: braking disturbs less.
SHAKEN_SHARE = 0.1  # of 1: of vibration's variance that a mean keeps. Larger: forces count less on rough roads.
ROLL_HEIGHT_M = 0.4  # m: h, of the sensor above the roll axis. Larger: rolling explains more of the force.
SIGMA_ROLL_HEIGHT_M = 0.4  # m. Larger: forces count less while the bike rolls quickly.
SIGMA_MEASURED_SPEED = 1.0 / STANDARD_GRAVITY  # g s: of a receiver or a wheel sensor. Larger: it counts for less.
MEASURED_SPEED_LATE_S = 1.0  # s: how late it may be. Larger: it counts for less while speeding up and braking.

# Assumptions that take the place of measurements
SIGMA_SLOPE = radians(1.6)  # rad: of roads' slopes. Larger: they are followed better, turns are found less well.
SLOPE_S = 3.0  # s: how long a slope lasts; fitted, real ones last longer. Larger: as for SIGMA_SLOPE.
STEEP = radians(6.0)  # rad: such a slope counts half as much, twice it a fifth. Larger: wheelies pass for slopes.
# Riding straight is all three: less lean than this, less yaw rate than this, more speed than this.
STRAIGHT_MAX_LEAN = radians(8.0)  # rad. Larger: the lean of wide turns is drawn towards upright.
STRAIGHT_MAX_RATE = radians(2.5)  # rad/s, about the vertical. Larger: the lean of slow turns is drawn towards upright.
STRAIGHT_MIN_SPEED = 4.0 / STANDARD_GRAVITY  # g s. Larger: drift on slow straights is not taken off.
SIGMA_STRAIGHT = radians(0.8)  # rad: of lean on straights, by wind and camber. Larger: drift is taken off later.
STRAIGHT_S = 3.0  # s: how long such a lean lasts. Larger: drift is taken off later.
SIGMA_USUAL_SPEED = 20.0 / STANDARD_GRAVITY  # g s: of speed from USUAL_SPEED. Larger: less pull towards it.
USUAL_SPEED_S = 60.0  # s: how long a speed lasts. Larger: less pull towards USUAL_SPEED.

# Standing still
SIGMA_STAND = radians(0.5)  # rad: of lean and pitch by the force on coming to rest. Larger: later forces count more.
SIGMA_REST_RATE = radians(0.1)  # rad/s: of a bike that feet hold. Larger: bias is found later.
SIGMA_REST_FORCE = 0.02  # g: of the force, with the engine idling. Larger: lean settles later.
REST_FORCE_SHARE = 0.1  # of 1: weight of a window in the mean force at rest. Larger: found sooner, less steady.
SIGMA_REST_SPEED = 0.02 / STANDARD_GRAVITY  # g s: of a speed of zero. Larger: it is less surely zero.
MAX_REST_PUSH = 0.08  # g: forward force not from pitch; more is braking. Larger: steady braking is taken for standing.
ROLLING_SPEED = 3.0 / STANDARD_GRAVITY  # g s: an estimate above it is no standstill, if the next line holds too.
ROLLING_SIGMAS = 3.0  # speed over its standard deviation. Larger, both: a smooth road is mistaken for rest.
# The trim is measured while speed and lean are more certain than this. Larger, both: found sooner, less surely.
SIGMA_TRIM_SPEED = 8.0 / STANDARD_GRAVITY  # g s
SIGMA_TRIM_LEAN = radians(1.4)  # rad


def forces(model, means, roll_acceleration, force_error):
    """Two: the force to the left, (4), and up, (5). roll_acceleration: rad/s^2 divided by standard gravity.
    force_error: of the accelerometer, as a share of the force."""
    uncertain = SIGMA_ROLL_HEIGHT_M * roll_acceleration
    left = means[0]
    shaken = max(0.0, means[8] - left * left)
    left_variance = SIGMA_LEFT**2 + SHAKEN_SHARE * shaken + uncertain**2
    left += ROLL_HEIGHT_M * roll_acceleration * model.cos_lean
    # In a held turn the force up, 1 / cos(lean), makes the lean observable, whatever the gyro's scale: little by one
    # window, well over a minute, if no error in it keeps its sign.
    square = means[4] * means[4] / STANDARD_GRAVITY
    up = means[1] + ROLL_HEIGHT_M * square - force_error * means[6]
    # Where the springs pitch the bike its wheels do not rise: v w_x is no acceleration then.
    pitching = PITCHING_SHARE * model.speed * model.pitch_rate
    up_variance = (
        SIGMA_UP**2 + pitching * pitching + SIGMA_ROLL_HEIGHT_M**2 * square * square + (uncertain * model.sin_lean) ** 2
    )
    return (model.left_row, left, left_variance), (model.up_row, up, up_variance)


def level_road(model, x, seconds):
    """Roads are level on average, (6), but a steep pitch may be a wheelie."""
    innovation = -x[PITCH] - x[YAW_ERROR] * model.sin_lean
    steep = innovation / STEEP
    return model.level_row, innovation, SIGMA_SLOPE**2 * (1.0 + steep * steep) * 2 * SLOPE_S / seconds


def straight_or_usual_speed(lean, speed, yaw_rate, seconds):
    """On a straight, a bike that does not turn is upright. Elsewhere, its speed is an ordinary one."""
    if abs(lean) < STRAIGHT_MAX_LEAN and abs(yaw_rate) < STRAIGHT_MAX_RATE and speed > STRAIGHT_MIN_SPEED:
        return ((LEAN, 1.0),), -lean, SIGMA_STRAIGHT**2 * 2 * STRAIGHT_S / seconds
    return ((SPEED, 1.0),), USUAL_SPEED - speed, SIGMA_USUAL_SPEED**2 * 2 * USUAL_SPEED_S / seconds


def measured_speed(measured, speed, acceleration):
    """The speed as a receiver or a wheel sensor measures it."""
    late = MEASURED_SPEED_LATE_S * acceleration
    return ((SPEED, 1.0),), measured - speed, SIGMA_MEASURED_SPEED**2 + late * late


def at_rest(model, means, speed, axis):
    """Four of a bike that stands: it has no speed; what the gyro reads is bias (of one axis, 0 to 2); the force is the
    vertical."""
    return (
        (((SPEED, 1.0),), -speed, SIGMA_REST_SPEED**2),
        (((BIAS_LEFT + axis, 1.0),), means[2 + axis], SIGMA_REST_RATE**2),
        (model.left_row[0:2], means[0] + model.sideways, SIGMA_REST_FORCE**2),  # only LEAN and PITCH
        (((PITCH, model.cos_pitch),), means[7] - model.sin_pitch, SIGMA_REST_FORCE**2),
    )
