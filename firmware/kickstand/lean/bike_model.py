"""The states of a motorcycle, its equations of motion, the equations for a sensor on it, and their partial derivatives.

Axes: left (x), up (y), forward (z). Units: rad, rad/s, m/s, m and s; forces in g, which is 9.80665 m/s^2.

State                                       Measured (a vector with [3] has the components left, up, forward)
    t  LEAN   roll, > 0 to the right            f    specific force [3]
    q  PITCH  of road and suspension, nose up   w_m  rate of rotation [3]
    v  SPEED  forward
    b  BIAS_LEFT, BIAS_UP, BIAS_FORWARD: change of the gyro's bias since the calibration
    psi  YAW_ERROR of the alignment. Pitch in the kickstand pose causes it: psi is this pitch over tan(tilt of the
         stand). A degree of pitch causes 5 degrees of yaw error at 11 degrees of tilt, and 11 degrees at 5 degrees of
         tilt.
    s_x, c_xy        SCALE_LEFT, CROSS_LEFT_UP: scale error of the gyro's left axis, and its reading of a rate about up
    c_zx, c_zy, s_z  CROSS_FORWARD_LEFT, CROSS_FORWARD_UP, SCALE_FORWARD: errors of the gyro's forward axis
The data sheet allows 3 % of scale error and 2 % of cross-axis sensitivity. A filter without these states would mistake
these errors for bias in a long bend, and for lean in a quick roll. The up axis has no such states: without a measured
speed its scale error cannot be distinguished from an error of the speed.

Equations, with ' for the derivative by time
    rates, corrected         w = w_m - b,  then  w_z -= c_zx w_x + c_zy w_y + s_z w_z,  w_x -= s_x w_x + c_xy w_y
    rotation, exact          t' = w_z - tan q (w_x sin t + w_y cos t)                  (1)
                             q' = w_y sin t - w_x cos t                                (2)
    wheels do not slide      v' = g (f_z - sin q) + v w_y psi                          (3)
                             f_x = cos q sin t + (v (w_y - d sin t) + psi v' - h cos t w_z') / g   (4)
                             f_y = cos q cos t - (v (w_x + d cos t) + h w_z^2) / g                 (5)
    roads are level          0 = q + psi sin t  on average                             (6)
    lean of the bike itself  t - psi cos t (tan q + 1/2 psi sin t)                     (7)
    springs                  d = share a',  where a = f_z - sin q is the forward acceleration in g        (8)

t and q refer to the sensor's axes, which the yaw error psi has turned. So t contains a part of the bike's own pitch,
which is q + psi sin t. For example, on a slope of 10 % a yaw error of 5 degrees causes half a degree of lean. (7)
removes this part, to second order in psi. On a level road q is -psi sin t, and (7) agrees with
tan(lean of the bike) = tan t / cos psi.

d is the part of the pitch rate q' that the springs cause. The wheels do not rise with this pitch, so its product with
the speed is not an acceleration. In braking a telescopic fork dives, by 2.8 degrees per g on a superbike. In
acceleration the rear sits down, by 1.3 degrees per g. So (8) makes d proportional to the change of the forward
acceleration. h is the height of the sensor above the roll axis.

(4) and (5) are A. Nicolae's (22) and (23) with s = v w / g. In a steady bend the two equations cannot separate lean
from speed, because the derivatives by lean and by speed have the same ratio in (4) and (5). In a steady bend the ratio
of two rates gives the lean: by (6) the pitch does not change, so by (2) w_x / w_y is tan t. At the beginning of a bend
the speed estimated before the bend is still valid, and with this speed (4) gives the lean.
"""

from math import asin, atan2, cos, degrees, radians, sin, sqrt, tan

from ..units import STANDARD_GRAVITY, const

STATES = 12
LEAN, PITCH, SPEED = 0, 1, 2
BIAS_LEFT, BIAS_UP, BIAS_FORWARD = 3, 4, 5
YAW_ERROR = 6
SCALE_LEFT, CROSS_LEFT_UP = 7, 8
CROSS_FORWARD_LEFT, CROSS_FORWARD_UP, SCALE_FORWARD = 9, 10, 11

# rad: largest pitch. A sensor in a hand can reach this pitch, but no motorcycle can. At a pitch of 90 degrees the lean
# is undefined.
MAX_PITCH = 1.2
MIN_PITCH = -MAX_PITCH  # stored as a constant, because a negation for each sample would take heap and time

# turn_rates() uses the yaw rate of a bike in balance if the speed is above _BALANCE_MIN_SPEED, the lean's standard
# deviation is below BALANCE_SIGMA, and the measured rate differs by less than
# _BALANCE_RATE + _BALANCE_SHARE x |balanced rate|. The form of the comments is explained in measurements.py.
_BALANCE_MIN_SPEED = const(4.0)  # m/s. Larger: the balanced rate is not used in slow bends.
_BALANCE_RATE = const(0.1)  # rad/s. Larger: the balanced rate is used with a wrong lean or speed.
_BALANCE_SHARE = const(0.5)  # ratio. Larger: the balanced rate is used with a wrong lean or speed.
BALANCE_SIGMA = radians(20.0)  # rad. Larger: the balanced rate is used with a more uncertain lean.
# ratio: lower bound of cos(lean) in a division. Larger: in deep leans the rate about left is too small.
_BALANCE_MIN_COS = const(0.3)

# Dive
# rad per g: share before the first braking, equal to 1.5 degrees per g. Larger: before the share is found, more of the
# pitch counts as dive.
PRIOR_SHARE = 0.026
# (g/s)^2: weight of PRIOR_SHARE, as a part of the sum of a'^2. Larger: the share is found later, and varies less.
_PRIOR_SQUARE = const(5.3)
_MIN_SHARE = const(-0.035)  # rad per g: smallest share, negative because an anti-dive fork may lift the nose
_MAX_SHARE = const(0.14)  # rad per g: largest share, 8 degrees per g, as with soft, long forks
_MIN_SPEED = const(5.0)  # m/s: lowest speed of a window that counts. Larger: the share is found later.
_MAX_JERK = const(3.0)  # g/s: largest a' that counts. Larger: bumps and lost readings count as braking.


def predict(x, force, rate, seconds, sums):
    """Integrate (1) to (3) over one sample. Return the corrected roll rate in rad/s.

    This function also computes the innovations, because both computations use the same sines.

    Args:
        x: the state, STATES values, which is updated.
        force: 3 values in g.
        rate: 3 values in rad/s.
        seconds: time since the previous sample.
        sums: 9 values, to which the sample's values are added.

    A window is a fifth of a second, one update of the filter. The sums of a window, divided by its number of samples,
    are these means:
        0       innovation of (4) without its terms in h and d, at the state before the step, in g
        1       innovation of (5) without its terms in h and d, at the same state, in g
        2 to 4  corrected rates about left, up, forward, in rad/s
        5 to 7  force left, up, forward, in g
        8       square of innovation 0, in g^2
    """
    fx, fy, fz = force
    wx, wy, wz = rate
    t, q, v, bx, by, bz, yaw_error, sx, cxy, czx, czy, sz = x
    wx -= bx
    wy -= by
    wz -= bz
    wz -= czx * wx + czy * wy + sz * wz
    wx -= sx * wx + cxy * wy
    st, ct = sin(t), cos(t)
    sq = sin(q)
    cq = sqrt(1.0 - sq * sq)
    per_rate = v / STANDARD_GRAVITY  # centripetal acceleration in g per rad/s of yaw rate
    sideways = per_rate * wy
    acceleration = fz - sq + sideways * yaw_error
    x[LEAN] = t + (wz - sq / cq * (wx * st + wy * ct)) * seconds
    q += (wy * st - wx * ct) * seconds
    if q > MAX_PITCH:
        q = MAX_PITCH
    elif q < MIN_PITCH:
        q = MIN_PITCH
    x[PITCH] = q
    speed = v + acceleration * seconds * STANDARD_GRAVITY
    x[SPEED] = speed if speed > 0.0 else 0.0
    left = fx - cq * st - sideways - acceleration * yaw_error
    sums[0] += left
    sums[1] += fy - cq * ct + per_rate * wx
    sums[2] += wx
    sums[3] += wy
    sums[4] += wz
    sums[5] += fx
    sums[6] += fy
    sums[7] += fz
    sums[8] += left * left
    return wz


def possible_pitch(pitch):
    """Limit the pitch to +-MAX_PITCH. At 90 degrees, as on a board that lies flat, predict() would divide by zero."""
    return max(MIN_PITCH, min(MAX_PITCH, pitch))


def turn_rates(speed, sin_lean, cos_lean, cos_pitch, rate_left, rate_up):
    """Return the rates about left and up, in rad/s, to use in derivatives that multiply a rate by a state.

    A bike in balance has the rate v w_y / g = -cos q sin t about up. If the measured rate about up is close to the
    balanced rate, the function returns the rates of a bike in balance. If the rates differ more, or the speed is 0, the
    function returns the measured rates. In a product of rate and state, the noise of a measured rate would be squared.
    Squared noise would make the estimated speed and lean too small (errors in variables).
    """
    if speed > _BALANCE_MIN_SPEED:
        balanced = -STANDARD_GRAVITY * cos_pitch * sin_lean / speed
        if abs(rate_up - balanced) < _BALANCE_SHARE * abs(balanced) + _BALANCE_RATE:
            return balanced * sin_lean / max(cos_lean, _BALANCE_MIN_COS), balanced
    return rate_left, rate_up


class Linearisation:
    """The partial derivatives of (1) to (6).

    Args:
        x: the state.
        rates: the window's mean corrected rates, 3 values in rad/s.
        forward: the window's mean forward force in g.
        lean_variance: variance of the lean in rad^2, see turn_rates().

    Attributes:
        lean_row, pitch_row, speed_row: derivatives of the rates of change (1), (2) and (3).
        left_row, up_row: derivatives of the forces (4) and (5).
        level_row: derivatives of (6).
        The other attributes are values that several terms share.

    Each row is ((state, partial derivative), ...). Derivatives that are zero are left out. Terms are also left out if
    they are small because a pitch, yaw error, scale error or cross-axis error is small.
    """

    def __init__(self, x, rates, forward, lean_variance=0.0):
        wx, wy, wz = rates
        speed, yaw_error = x[SPEED], x[YAW_ERROR]
        st, ct, sq = sin(x[LEAN]), cos(x[LEAN]), sin(x[PITCH])
        cq = sqrt(1.0 - sq * sq)
        yaw_rate = wx * st + wy * ct  # rate about the vertical at a pitch of 0
        per_rate = speed / STANDARD_GRAVITY  # centripetal acceleration in g per rad/s of yaw rate
        sideways = per_rate * wy
        acceleration = forward - sq + sideways * yaw_error
        turn_x, turn_y = turn_rates(speed if lean_variance < BALANCE_SIGMA**2 else 0.0, st, ct, cq, wx, wy)
        self.lean_row = (
            (PITCH, -yaw_rate / (cq * cq)),  # d lean' / d q
            (BIAS_FORWARD, -1.0),  # d lean' / d b_z
            (CROSS_FORWARD_LEFT, -turn_x),  # d lean' / d c_zx
            (CROSS_FORWARD_UP, -turn_y),  # d lean' / d c_zy
            (SCALE_FORWARD, -wz),  # d lean' / d s_z
        )
        self.pitch_row = (
            (LEAN, yaw_rate),  # d pitch' / d t
            (BIAS_LEFT, ct),  # d pitch' / d b_x
            (BIAS_UP, -st),  # d pitch' / d b_y
            (SCALE_LEFT, ct * turn_x),  # d pitch' / d s_x
            (CROSS_LEFT_UP, ct * turn_y),  # d pitch' / d c_xy
        )
        self.speed_row = (
            (PITCH, -cq * STANDARD_GRAVITY),  # d speed' / d q
            (YAW_ERROR, speed * wy),  # d speed' / d psi
        )
        self.left_row = (
            (LEAN, cq * ct),  # d left / d t
            (PITCH, -sq * st - cq * yaw_error),  # d left / d q
            (SPEED, turn_y / STANDARD_GRAVITY),  # d left / d v
            (BIAS_UP, -per_rate),  # d left / d b_y
            (YAW_ERROR, acceleration),  # d left / d psi
        )
        self.up_row = (
            (LEAN, -cq * st),  # d up / d t
            (PITCH, -sq * ct),  # d up / d q
            (SPEED, -turn_x / STANDARD_GRAVITY),  # d up / d v
            (BIAS_LEFT, per_rate),  # d up / d b_x
            (SCALE_LEFT, per_rate * turn_x),  # d up / d s_x
            (CROSS_LEFT_UP, per_rate * turn_y),  # d up / d c_xy
        )
        self.level_row = (
            (PITCH, 1.0),  # d level / d q
            (LEAN, yaw_error * ct),  # d level / d t
            (YAW_ERROR, st),  # d level / d psi
        )
        self.sin_lean, self.cos_lean, self.sin_pitch, self.cos_pitch = st, ct, sq, cq
        self.speed, self.yaw_rate, self.sideways = speed, yaw_rate, sideways
        self.pitch_rate = wy * st - wx * ct
        self.pitching = per_rate * self.pitch_rate  # in g

    def lean_by_pitch(self, x):
        """Return the part of the state's lean that (7) subtracts, in rad. This part is pitch of the bike that looks
        like lean because of the yaw error."""
        return x[YAW_ERROR] * self.cos_lean * (tan(x[PITCH]) + 0.5 * x[YAW_ERROR] * self.sin_lean)


class Dive:
    """Estimates while riding how far braking and acceleration pitch the bike on its springs, in fixed memory.

    The part of the pitch rate that comes from the road does not depend on a' of (8). So a regression of the pitch rate
    on a' gives the share: sum(a' pitch rate) / sum(a'^2). Each sum begins with a prior.

    share (read-only): pitch in rad per g, positive if the nose goes down in braking.
    """

    def __init__(self):
        self.share = PRIOR_SHARE
        self._product = PRIOR_SHARE * _PRIOR_SQUARE  # sum of a' times the pitch rate
        self._square = _PRIOR_SQUARE  # sum of a'^2
        self.restart()

    def restart(self):
        """Drop the last window, because readings were missing. Keep the share, which belongs to the bike."""
        self._push = None
        self._pitch_rate = 0.0

    def update(self, push, pitch_rate, speed, seconds):
        """Take one window. Return speed x dive' / g, in g. Equations (4) and (5) need this term.

        Args:
            push: mean forward acceleration in g.
            pitch_rate: in rad/s.
            speed: in m/s.
        """
        last_push, last_rate = self._push, self._pitch_rate
        self._push, self._pitch_rate = push, pitch_rate
        if last_push is None:
            return 0.0
        jerk = (push - last_push) / seconds  # in g/s, from the middle of the last window to the middle of this window
        if not -_MAX_JERK < jerk < _MAX_JERK:  # also true for NaN
            return 0.0
        if speed > _MIN_SPEED:
            self._product += jerk * 0.5 * (pitch_rate + last_rate)
            self._square += jerk * jerk
            self.share = max(_MIN_SHARE, min(_MAX_SHARE, self._product / self._square))
        return speed * self.share * jerk / STANDARD_GRAVITY


# Nicolae's lean from one reading of forces and yaw rate (section 5, signs corrected). With s the centripetal
# acceleration in g (> 0 in a left turn) and forces in g:
#     A_up cos t + A_left sin t = 1        (22)
#     A_left cos t - A_up sin t = s        (23, corrected)
#     A_left^2 + A_up^2 = 1 + s^2          (24)
_TOO_SMALL = const(0.01)  # (0.1 g)^2. A smaller squared force has no direction, because it is nearly free fall


def static_lean_deg(force):
    """Return the lean of a standing bike in degrees, > 0 to the right. This lean is equation (21) with a sign, and is
    exact near upright.

    force: left, up, forward in g.
    """
    return degrees(atan2(force[0], force[1]))


def centripetal_g(left_g, up_g, yaw_rate):
    """Return s, the centripetal acceleration in g, by (26). The force gives the size of s. The yaw rate gives the sign
    of s, which is > 0 in a left turn. Without a yaw rate s is 0."""
    excess = left_g * left_g + up_g * up_g - 1.0
    if excess <= 0.0 or yaw_rate == 0.0:
        return 0.0
    return sqrt(excess) if yaw_rate > 0.0 else -sqrt(excess)


def formula_lean_deg(force, yaw_rate):
    """Return Nicolae's lean by (25) and (26), in degrees, > 0 to the right. In free fall (under 0.1 g) the lean is 0.

    force: left, up, forward in g. yaw_rate: in any unit, because only its sign counts.

    In bends this lean is right on average. Near upright this lean is noisy: 1 % of vibration causes an error of 8
    degrees, always to the side of the yaw rate.
    """
    left, up = force[0], force[1]
    square = left * left + up * up
    if square < _TOO_SMALL:
        return 0.0
    sine = (left - centripetal_g(left, up, yaw_rate) * up) / square
    return degrees(asin(max(-1.0, min(1.0, sine))))
