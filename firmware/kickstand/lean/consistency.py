"""Checks that the readings fit the model: the lean filter judges itself by its own innovations.

A filter's covariance does not show a partly failed sensor, but its innovations do. The square of an innovation over its
expected variance, the normalised innovation squared, is 1 on average if everything fits (Y. Bar-Shalom and others,
Estimation with Applications to Tracking and Navigation, section 5.4). Here the mean is of its root, with its sign.
Vibration and bumps, which a good sensor has too, cancel in this mean. A dead or mirrored axis, half of the scale, a
step of the bias and a slipped mount do not cancel. The forces to the left and up each have a short mean, which shows
large errors within a second or two, and a long one, which shows small errors after some seconds.

Three more means are of quantities that never last long on a real ride: a force to the side, because a bike is in
balance, a steep pitch, and a pitch without its force. On a real slope the forward force has gravity's part, sin(pitch).
If that part is missing, wrong rates have made the pitch, and the filter takes the difference for an acceleration: up
the slope it seems to brake, down the slope to accelerate. Real bikes do so for a few seconds only.

Each mean is judged by its own spread, as in Student's t: on a road that is rougher than the filter expects the
innovations are large, of either sign, and so are their means.

One more check follows a doubt. With a gyro that is wrong about up, a straight seems to be an endless bend, and all
forces are as expected. So after a doubt a lean that has stayed on one side for long is not shown.

After a misfit the lean is doubted, and hidden until everything has fitted for a while. Repeated misfits are a fault of
the sensor.
"""

from math import sqrt

from ..units import const

# Symbol = default  # unit: what it is. "Larger:" says what raising it does.
_SHORT_S = const(3.0)  # s: time constant of the short means. Larger: fewer leans are hidden, and later.
_LONG_S = const(10.0)  # s: time constant of the other means. Larger: as for the short means.
_MOST = const(4.0)  # standard deviations: a larger innovation counts as this. Larger: a blow counts for more.
# Limits of the means. Larger, each: fewer leans are hidden, good and wrong ones. On rides without a fault, on good and
# bad roads and mounts, they reach .4, .25, .7, .25, .12, 8 degrees and .096, the last on a recorded ride.
LEFT_SHORT, LEFT_LONG = 0.75, 0.5  # standard deviations
UP_SHORT, UP_LONG = 0.9, 0.35  # standard deviations
# ratio: the limits of up are wider by this without the six positions, as the data sheet allows the accelerometer
# 3 % of scale error and 80 mg of offset, and only rest shows them. Larger: fewer leans are hidden.
_UNMEASURED = const(2.0)
_SIDEWAYS = const(0.15)  # ratio: force to the side over force up, less the trim
_STEEP = const(0.21)  # rad: pitch
_SLOPE = const(0.12)  # rad: a pitch without its force, the root of the short mean of its square
# The limits of left and up grow with the spread, the root of this mean square: half the square of the change between
# windows. Larger: more is hidden on the roughest roads.
_SPREAD = const(0.4)  # standard deviations, squared
# rad: limit of a steady mean lean after a doubt. Larger: less is hidden in bends, and on straights that seem bends.
_ONE_SIDE = const(0.13)
# rad: a larger steady lean is hidden only after _LONG_S, because the force up confirms it. Smaller: as for _ONE_SIDE.
_SURE_LEAN = const(0.3)
# ratio: of the mean square of the lean, above which it has been steady. Larger: as _ONE_SIDE.
_STEADY = const(0.75)
_MOST_SIDEWAYS = const(0.5)  # ratio: more counts as this. Larger: a blow counts for more.
_STRICT = const(0.85)  # ratio: share of the limits after a doubt. Larger: a lasting fault is detected later.
# ratio: share of the limits in which the means have to stay while doubted. Larger: shown again sooner.
_FIT = const(0.6)
# s: time for which everything must fit after the first doubt, the second and so on. Larger: after a fault the lean
# stays hidden for longer.
HOLDS_S = (3.0, 4.0, 4.0, 20.0, 60.0)
_GAP_S = const(4.5)  # s: the same after a gap in the readings. Larger: after a gap the lean stays hidden for longer.
MILD = 3  # doubts. With more of them only turns count as fitting, because on a straight nearly everything fits.
# s: least time between doubts after MILD of them, so that rest is found. Larger: changed errors are found later.
_AGAIN_S = const(12.0)
_TURNING = const(0.05)  # rad/s: least yaw rate of a turn. Larger: the lean stays hidden for longer.
FORGET_S = 60.0  # s: after fitting for this time one doubt is forgotten. Larger: a repeated fault is hidden for longer.

last_odd = None  # the last code of `odd`, for `kickstand status`


class Consistency:
    """Read-only attributes. doubt: the lean must not be shown. doubts: number of misfits minus the forgotten ones. odd:
    None, or the code of repeated misfits: "odd-left", "odd-up" (forces) or "odd-pitch".

    six_done: the six positions have measured the accelerometer."""

    def __init__(self, six_done=True):
        self._up_share = 1.0 if six_done else _UNMEASURED
        self.doubt = False
        self.odd = None
        self.doubts = 0
        self._fits_s = 0.0
        self._since_s = 0.0  # since the last doubt
        self._in_rest = True  # rest counts as fitting
        self._forget_means()

    def _forget_means(self):
        self._left = self._left_long = self._up = self._up_long = self._side = self._pitch = 0.0
        self._lean = self._lean_square = self._mean_s = self._slope_square = 0.0
        self._left_before = self._up_before = self._left_square = self._up_square = 0.0

    def gap(self, in_rest=True):
        """Doubt until everything has fitted for a while, because the filter has just begun. in_rest: rest counts as
        fitting."""
        self.doubt = True
        self._in_rest = in_rest
        self._fits_s = 0.0
        self._forget_means()

    @property
    def one_sided(self):
        """True after a recent misfit if the lean has been steadily on one side."""
        lean = abs(self._lean)
        if not self.doubts or lean <= _ONE_SIDE or lean * lean <= _STEADY * self._lean_square:
            return False
        return lean < _SURE_LEAN or self._mean_s >= _LONG_S

    def add(self, left, up, sideways, pitch, push, lean, yaw_rate, seconds):
        """Take a window of `seconds` while riding. left, up: the normalised innovations of these forces. sideways:
        force to the side over force up. pitch and lean in rad, yaw_rate in rad/s. push: estimated forward
        acceleration, g. Return True if a misfit has just begun."""
        gain, long_gain = min(1.0, seconds / _SHORT_S), min(1.0, seconds / _LONG_S)
        left, up = max(-_MOST, min(_MOST, left)), max(-_MOST, min(_MOST, up))
        self._left += gain * (left - self._left)
        self._up += gain * (up - self._up)
        self._left_long += long_gain * (left - self._left_long)
        self._up_long += long_gain * (up - self._up_long)
        self._side += long_gain * (max(-_MOST_SIDEWAYS, min(_MOST_SIDEWAYS, sideways)) - self._side)
        self._pitch += long_gain * (pitch - self._pitch)
        square = -pitch * max(-abs(pitch), min(abs(pitch), push))  # pitch * pitch if all of the force is missing
        self._slope_square += gain * (square - self._slope_square)
        change = left - self._left_before
        self._left_square += long_gain * (0.5 * change * change - self._left_square)
        change = up - self._up_before
        self._up_square += long_gain * (0.5 * change * change - self._up_square)
        self._left_before, self._up_before = left, up
        self._mean_s = min(self._mean_s + seconds, _LONG_S)
        gain = seconds / self._mean_s
        self._lean += gain * (lean - self._lean)
        self._lean_square += gain * (lean * lean - self._lean_square)
        left = max(abs(self._left) / LEFT_SHORT, abs(self._left_long) / LEFT_LONG)
        left = max(left / sqrt(max(1.0, self._left_square / _SPREAD)), abs(self._side) / _SIDEWAYS)
        up = max(abs(self._up) / UP_SHORT, abs(self._up_long) / UP_LONG)
        up /= self._up_share * sqrt(max(1.0, self._up_square / _SPREAD))
        pitch = max(abs(self._pitch) / _STEEP, sqrt(max(0.0, self._slope_square)) / _SLOPE)
        worst = max(left, up, pitch)
        self._since_s += seconds
        if self.doubts > MILD and self._since_s < _AGAIN_S:
            if worst > _FIT:
                self._fits_s = 0.0
        elif not worst <= (_STRICT if self.doubts else 1.0):
            self.fail("odd-left" if worst == left else "odd-up" if worst == up else "odd-pitch")
            return True
        elif self.doubt and worst > _FIT:
            self._fits_s = 0.0
        elif (self.doubts <= MILD or abs(yaw_rate) > _TURNING) and not self.one_sided:
            self._fit(seconds)
        return False

    def rest(self, seconds):
        """Take a window at rest. After a gap the force then shows the lean."""
        if self.doubt and self._in_rest and self.doubts <= MILD:
            self._fit(seconds if self.doubts else _GAP_S)

    def fail(self, code):
        """Doubt because of a misfit. code: see odd."""
        global last_odd
        self.gap()
        self._since_s = 0.0
        self.doubts = min(self.doubts + 1, len(HOLDS_S))
        if self.doubts >= MILD:
            self.odd = last_odd = code

    def _fit(self, seconds):
        self._fits_s += seconds
        if self.doubt:
            if self._fits_s >= (HOLDS_S[self.doubts - 1] if self.doubts else _GAP_S):
                self.doubt, self.odd, self._fits_s = False, None, 0.0
        elif self.doubts and self._fits_s >= FORGET_S:
            self.doubts -= 1
            self._fits_s = 0.0
