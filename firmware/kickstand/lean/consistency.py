"""Checks that the readings fit the lean filter's model, by the innovations of the filter.

A filter's covariance does not reveal a partly failed sensor, but its innovations do. An innovation is a measured value
minus the expected value. The square of an innovation divided by its expected variance is called the normalised
innovation squared. The mean of this value is 1 if everything fits (Y. Bar-Shalom and others, Estimation with
Applications to Tracking and Navigation, section 5.4). This module averages the root of this value, with the
innovation's sign. Vibration and bumps cancel in the mean. A dead or mirrored axis, a halved scale, a jump of the bias
and a slipped mount do not cancel. The forces to the left and up have two means each. The short mean shows large errors
within two seconds. The long mean shows small errors after some seconds.

Two more means are of quantities that never stay large for long on a real ride:
    the pitch
    the part of the pitch that the forward force does not confirm
On a real slope the forward force contains a part of gravity, sin(pitch). If the forward force lacks this part, the
pitch is wrong, because wrong rates were integrated. The filter then mistakes the missing force for an acceleration. So
the bike seems to brake uphill or to accelerate downhill for longer than a real bike does.

Each mean is compared with its own spread, as in Student's t-test. On a road rougher than the filter expects, single
innovations are large, and their means vary more.

A fault often raises several of these quantities, each to less than its limit. So each is divided by its limit, and the
sum of the cubes must be below 1. Squares, as in a chi-square test, would hide leans on hills, where a sound ride raises
two quantities to two thirds of their limits.

More quantities are summed instead of averaged, as in a CUSUM test (E. S. Page, Continuous inspection schemes,
Biometrika 41, 1954). Two of them need no estimate of the lean, so they survive a restart of the filter:
    The force to the side. A bike is in balance, so this force has a mean of 0. A mount that has slipped shifts it.
    The sides. In a bend the nose rises, and a bike that rolls to one side begins to turn to this side. If both are the
    other way round, the sensor is turned by 180 degrees about up, because SIDE or the order of the presses was wrong.
The other two are of the gyro's scale. At half the scale the lean is too small, and all forces nearly fit. But in a
steady bend the rate about left divided by the rate about up is tan(lean) at any scale. So each sum is the log
likelihood ratio of a second hypothesis against the lean, times twice the variance of the rate about left: that this
rate is twice, or half, the expected one. A crest in a bend has such a rate too, but the forward force confirms its
pitch. So these sums count together with the pitch that the forward force does not confirm.

A misfit is such a sum above its limit. After a misfit the lean is doubted: it is hidden until everything has fitted for
a while. Repeated misfits mean a faulty sensor. A slip, or exchanged sides, is one misfit as long as it lasts.

After a doubt the lean itself is checked too. If the gyro's rate about up is wrong, a straight can look like an endless
bend, or a bend like a straight, with all forces as expected. But in a steady bend the rate about left divided by the
rate about up is tan(lean). So the lean is not shown while it is unsure, for one of these reasons:
    The bike leans, and for some time the rate about left has not been the rate of a steady bend with this lean.
    This rate is far off, or the biases differ from the biases before the misfit, because the filter may explain wrong
    rates by biases.
    The force to the side has a mean. With a measured speed, the lean beyond that of a bike in balance takes its place:
    lean + atan(speed x yaw rate / g).
An unsure lean that becomes sure needs no restart of the filter. If it stays unsure for long, this is a misfit.

A wrong lean can fit for some seconds, also after a restart. If a lean fitted only briefly before it misfits, the next
one may be wrong in the same way. So the doubt is longer by the time for which that lean fitted.
"""

from math import sqrt

from ..units import const

# The comment of each parameter has its unit, its meaning and, after "Larger:", the effect of a larger value.

# s: time constant of the short means. Larger: fewer correct leans are hidden, and wrong leans are hidden later.
_SHORT_S = const(3.0)
# s: time constant of all means except the short means. Larger: fewer correct leans are hidden, and wrong leans are
# hidden later.
_LONG_S = const(10.0)
# standard deviations: limit to which larger innovations are reduced. Larger: a single blow counts for more.
_MOST = const(4.0)
# Limits of the means. Larger: fewer correct leans and fewer wrong leans are hidden. "Largest without a fault" is the
# largest mean in rides without a fault, on good and bad roads, with good and bad mounts.
LEFT_SHORT, LEFT_LONG = 0.75, 0.5  # standard deviations. Largest without a fault: 0.6 and 0.4
# standard deviations: on a straight, the part of left that wind and camber explain. Both make a bike lean on a
# straight, and the filter draws this lean towards upright. Larger: small errors of the roll rate are found later on
# straights.
_WIND = const(0.35)
UP_SHORT, UP_LONG = 0.9, 0.35  # standard deviations. Largest without a fault: 0.7 and 0.25
# ratio: factor on UP_SHORT and UP_LONG if the six positions were not done. The data sheet allows the accelerometer a
# scale error of 3 % and an offset of 80 mg. Without the six positions, the filter notices these errors only at rest.
# Larger: fewer leans are hidden.
_UNMEASURED = const(2.0)
# ratio: force to the side divided by force up. The sum grows by what exceeds this value. As in a sequential likelihood
# ratio, this value is half-way between two hypotheses: a lasting wind leans a bike by 4 degrees, which is 0.07, and a
# slip by 10 degrees causes 0.176. Larger: smaller slips of the mount are not found.
_UNBALANCED = const(0.12)
# s: limit of the sum. Largest without a fault: 0.19, on hills and if a rider moves about in deep bends. Larger: a slip
# is found later.
_SLIP_S = const(0.22)
# standard deviations: limit of a single innovation of the force to the left while the sum of the roll rate is above its
# limit. Larger: exchanged sides and wrong roll rates are hidden later. Largest without a fault: 1.1
_WRONG_ROLL = const(1.8)
# s: time after a bend for which the sum grows; it shrinks at any time. A bike on its kickstand is not in balance
# either, and if its engine shakes it, only its missing bends prove that it stands. Larger: a parked bike is said to
# have slipped.
_BEND_S = const(3.0)
_MOST_SLIP_S = const(0.45)  # s: largest sum, which names the slip. Larger: the slip is named, and forgotten, later.
# Limits of the two sums that show exchanged sides. Without a fault at most a fifth of one of them is exceeded by both.
# Larger: exchanged sides are found later.
_NOSE_DOWN = const(0.01)  # rad^2/s: rate about left times rate about up
_ROLL_OUT = const(0.03)  # rad^2/s: roll rate times change of the rate about up
_STEEP = const(0.21)  # rad: pitch. Largest without a fault: 0.14
# rad: root mean square of the pitch that the forward force does not confirm. Largest on a recorded ride without a
# fault: 0.096
_SLOPE = const(0.12)
# rad^2/s: limit of the two sums of the scale. A crest in a bend reaches 0.009. Larger: a wrong scale of the gyro is
# found later.
_SCALE = const(0.03)
_MOST_SCALE = const(0.003)  # rad^2/s^2: limit of what a window adds per second. Larger: a single bump counts for more.
# squared standard deviations: above this spread of the innovations, the limits of left and up grow with the root of the
# spread. The spread is the mean of half the squared change of the innovation from window to window. Larger: more leans
# are hidden on the roughest roads.
_SPREAD = const(0.4)
# rad: after a doubt, a lean above this value must be confirmed by the rate about left. On a straight, slopes cause this
# rate too, so _CONFIRMING is larger by half there. Larger: fewer leans are hidden.
_LEANING = const(0.12)
# The rate about left confirms a lean if it differs from the rate of a steady bend by less than one of the next two
# limits. Larger: wrong leans are hidden later.
_CONFIRMING = const(0.004)  # rad/s
_CONFIRMING_SHARE = const(0.4)  # ratio: the limit, divided by the rate of a steady bend
# s: a lean is hidden if it is unconfirmed for this much longer than confirmed. Larger: wrong leans are hidden later.
_UNCONFIRMED_S = const(2.5)
# s: largest such time that counts, because a fault that ends has disturbed the means of the rates. Larger: a hidden
# lean stays hidden for longer.
_MOST_UNCONFIRMED_S = const(3.0)
# After a doubt the lean is unsure if the sum of two squares is above 1: (change of the biases / _MOVED)^2 and
# (difference of the rates about left / _APART)^2. Larger: after a misfit wrong leans are shown for longer, and fewer
# leans are hidden.
_MOVED = const(0.0157)  # rad/s
_APART = const(0.028)  # rad/s
# rad/s: change of the biases up to which they are those before the misfit. Larger: after a fault that ends the lean is
# shown again sooner, and a lasting fault is hidden for less long.
_SAME = const(0.006)
_RATES_S = const(4.0)  # s: time constant of the rates about left. Larger: wrong leans are hidden later.
# ratio: after a doubt, largest mean of the force to the side that is not explained. Larger: small slips are shown.
_SIDEWAYS = const(0.08)
_UNSURE_S = const(4.0)  # s: an unsure lean is a misfit after this time. Larger: a lasting fault is named later.
# ratio: factor on the limits after a doubt if the six positions were done. Without them the readings of a sound sensor
# fit less well. Larger: a lasting fault is detected later.
_STRICT = const(0.75)
# ratio: during a doubt, the means fit again when they are below this share of their limits. Larger: the lean is shown
# again sooner.
_FIT = const(0.6)
# s: least time for which everything must fit after the first doubt, after the second doubt, and so on. Larger: after a
# fault the lean stays hidden for longer.
HOLDS_S = (3.0, 3.0, 4.0, 20.0, 60.0)
# s: a lean that fitted for less than this time lengthens the doubt after its misfit by this time. Larger: after a fault
# that ends the lean stays hidden for longer.
_BRIEF_S = const(20.0)
# s: time for which everything must fit after a gap in the readings. Larger: after a gap the lean stays hidden for
# longer.
_GAP_S = const(4.5)
# s: a misfit within this time after a misfit has the same cause, so it is not counted. Larger: after a fault that ends
# the lean is shown again sooner, and a lasting fault is named later.
_SAME_S = const(3.0)
# From this number of doubts on, fitting on a straight does not count, because there nearly everything fits. It does
# count if the biases are those before the first misfit: then the fault is probably over.
MILD = 3
# s: shortest time between two doubts after more than MILD doubts. The time between two doubts is needed to detect rest.
# Larger: errors of the sensor that have changed are found later.
_AGAIN_S = const(12.0)
_TURNING = const(0.05)  # rad/s: smallest yaw rate of a bend. Larger: the lean stays hidden for longer.
# s: time of fitting after which one doubt is forgotten. Larger: after a repeated fault the lean is hidden for longer.
FORGET_S = 60.0

last_odd = None  # the last code of `odd`, for `kickstand status`


class Mean:
    """A mean with the time constant tau, in s.

    value: the mean.
    """

    def __init__(self, tau):
        self.value = 0.0
        self._tau = tau

    def add(self, x, seconds):
        """Add the value x of a window of `seconds`."""
        self.value += min(1.0, seconds / self._tau) * (x - self.value)


class Innovations:
    """The means of a force's innovations. limits: the largest short and long mean, in standard deviations."""

    def __init__(self, limits):
        self._limits = limits
        self._short, self._long, self._spread = Mean(_SHORT_S), Mean(_LONG_S), Mean(_LONG_S)
        self._last = 0.0

    def add(self, x, seconds):
        """Add an innovation, in standard deviations. Return the larger mean, divided by its limit."""
        change, self._last = x - self._last, x
        self._short.add(x, seconds)
        self._long.add(x, seconds)
        self._spread.add(0.5 * change * change, seconds)
        largest = max(abs(self._short.value) / self._limits[0], abs(self._long.value) / self._limits[1])
        return largest / sqrt(max(1.0, self._spread.value / _SPREAD))


class Consistency:
    """Judges the innovations of each window. six_done: True if the six positions have measured the accelerometer.

    Read-only attributes:
        doubt   True if the lean must not be shown
        doubts  number of misfits that are not forgotten
        side    Mean of the force to the side, to which the filter adds
        odd     None, or the code of a lasting fault. "turned": the sides are exchanged. "mount-moved": a force to the
                side. "odd-left", "odd-up" (the forces) or "odd-pitch": other repeated misfits.
    """

    def __init__(self, six_done=True):
        self._up_share, self._strict = (1.0, _STRICT) if six_done else (_UNMEASURED, 1.0)
        self.doubt = False
        self.odd = None
        self.doubts = 0
        self._fits_s = self._brief_s = 0.0  # time for which the lean fits, and fitted before the misfit if it was brief
        self._since_s = 0.0  # time since the last misfit that was counted
        self._in_rest = True  # True if time at rest counts as fitting
        self._turned = False  # True if the sides are exchanged
        self._side_s = 0.0  # sum of the force to the side
        self._straight_s = _BEND_S  # time since the last bend
        self._nose_down = self._roll_out = self._rate_up = 0.0
        self._lean = 0.0  # the lean of the last window
        self._doubted_lean = 0.0  # the lean when the doubt began, until the bike is upright again
        self._forget_means()

    def _forget_means(self):
        self._left, self._up = Innovations((LEFT_SHORT, LEFT_LONG)), Innovations((UP_SHORT, UP_LONG))
        self._pitch, self._slope = Mean(_LONG_S), Mean(_SHORT_S)
        self.side = Mean(_SHORT_S)
        self._expected, self._measured = Mean(_RATES_S), Mean(_RATES_S)  # rates about left
        self._unconfirmed_s = self._unsure_s = 0.0
        self._too_small = self._too_large = 0.0  # sums of the scale
        self._same_biases = False  # True if the biases are those before the misfit

    def gap(self, in_rest=True):
        """Doubt until everything has fitted for a while, because the filter has restarted. in_rest: True if time at
        rest counts as fitting."""
        self.doubt = True
        self._in_rest = in_rest
        self._fits_s = 0.0
        self._forget_means()

    @property
    def unsure(self):
        """True if the lean is unsure for a reason of the module's docstring."""
        return self._unconfirmed_s > _UNCONFIRMED_S or self._unsure_s > 0.0

    @property
    def _slip(self):
        """The sum of the force to the side, divided by its limit. Exchanged sides are above the limit too."""
        return 2.0 if self._turned else abs(self._side_s) / _SLIP_S

    @property
    def _cause(self):
        """The code of a fault that is certain, or None."""
        return "turned" if self._turned else "mount-moved" if abs(self._side_s) >= _MOST_SLIP_S else None

    def add_rates(self, left, up, forward, seconds):
        """Take the mean corrected rates of a window of `seconds` while riding, in rad/s."""
        kept = 1.0 - min(1.0, seconds / _LONG_S)
        self._nose_down = nose_down = kept * self._nose_down + left * abs(up) * seconds
        self._roll_out = roll_out = kept * self._roll_out + forward * (up - self._rate_up)
        self._rate_up = up
        if nose_down > _NOSE_DOWN and roll_out > _ROLL_OUT:
            self._turned = True
        elif nose_down < 0.0 or roll_out < 0.0:
            self._turned = False

    def compare(self, expected, measured, moved, seconds):
        """Compare the rate about left with that of a steady bend, in a window of `seconds` while riding.

        Args:
            expected, measured: rate about left of a steady bend with this lean, and the measured rate, in rad/s. Both
                are computed with the biases before the misfit.
            moved: square of the change of the biases since then, in rad^2/s^2. The changes about up and forward count
                a third, because a restart finds these biases less well.
        """
        self._same_biases = moved < _SAME**2
        self._expected.add(expected, seconds)
        self._measured.add(measured, seconds)
        if not self.doubt:
            small, large = expected * (measured - 1.5 * expected), expected * (0.75 * expected - measured)
            self._too_small = max(0.0, self._too_small + max(-_MOST_SCALE, min(_MOST_SCALE, small)) * seconds)
            self._too_large = max(0.0, self._too_large + max(-_MOST_SCALE, min(_MOST_SCALE, large)) * seconds)
        expected, leaning = self._expected.value, abs(self._lean) > _LEANING
        apart = abs(self._measured.value - expected)
        limit = max(_CONFIRMING if leaning else 1.5 * _CONFIRMING, _CONFIRMING_SHARE * expected)
        if not leaning:
            self._doubted_lean = 0.0
        # With a mirrored rate a bend seems a bend to the other side
        if apart < limit and not (leaning and (self.doubts >= MILD or self._lean * self._doubted_lean < 0.0)):
            self._unconfirmed_s = max(0.0, self._unconfirmed_s - seconds)
        elif leaning and self.doubts:
            self._unconfirmed_s = min(_MOST_UNCONFIRMED_S, self._unconfirmed_s + seconds)
        apart /= _APART
        unsure = moved / _MOVED**2 + apart * apart > 1.0 or abs(self.side.value) > _SIDEWAYS
        self._unsure_s = self._unsure_s + seconds if unsure and 0 < self.doubts < MILD else 0.0

    def add(self, left, up, sideways, pitch, push, lean, yaw_rate, seconds, fast=False):
        """Take a window of `seconds` while riding. Return True if a misfit has just begun.

        Args:
            left, up: innovations of the forces to the left and up, in standard deviations.
            sideways: force to the side divided by force up that trim, tyres and rider do not explain. None if the bike
                need not be in balance.
            pitch, lean: of the bike, in rad.
            push: estimated forward acceleration in g.
            yaw_rate: in rad/s.
            fast: True if the speed is certainly that of a ride, which must be in balance on a straight too.
        """
        left, up = max(-_MOST, min(_MOST, left)), max(-_MOST, min(_MOST, up))
        if abs(yaw_rate) < _TURNING:
            left -= max(-_WIND, min(_WIND, left))
        self._straight_s = 0.0 if abs(yaw_rate) > _TURNING else self._straight_s + seconds
        self._lean = lean
        if sideways is not None:
            side_s = self._side_s + sideways * seconds
            bend = self._straight_s < _BEND_S
            normal = _UNBALANCED * seconds
            side_s = max(0.0, side_s - normal) + min(0.0, side_s + normal)
            if fast or bend or abs(side_s) < abs(self._side_s):
                self._side_s = max(-_MOST_SLIP_S, min(_MOST_SLIP_S, side_s))
        self._pitch.add(pitch, seconds)
        # pitch * pitch is added if the forward force confirms none of the pitch
        self._slope.add(-pitch * max(-abs(pitch), min(abs(pitch), push)), seconds)
        wrong_roll = abs(left) / _WRONG_ROLL if self._roll_out > _ROLL_OUT else 0.0
        left = max(self._left.add(left, seconds), wrong_roll)
        up = self._up.add(up, seconds) / self._up_share
        slope = sqrt(max(0.0, self._slope.value)) / _SLOPE
        pitch = max(abs(self._pitch.value) / _STEEP, slope + max(self._too_small, self._too_large) / _SCALE)
        cause = self._cause
        if cause:
            self._blame(cause)
        largest = max(left, up, pitch)
        worst = left * left * left + up * up * up + pitch * pitch * pitch
        if not self.doubt:  # a slip is only one misfit, whose doubt lasts as long as the slip
            worst = max(worst, self._slip**3)
        self._since_s += seconds
        if self.doubt and (cause or (self.doubts > MILD and self._since_s < _AGAIN_S)):
            if cause or largest > _FIT:
                self._fits_s = 0.0
        elif not worst <= (self._strict if self.doubts else 1.0) ** 3 or self._unsure_s > _UNSURE_S:
            self.fail(cause or ("odd-left" if largest == left else "odd-up" if largest == up else "odd-pitch"))
            return True
        elif self.doubt and largest > _FIT:
            self._fits_s = 0.0
        elif (self.doubts < MILD or abs(yaw_rate) > _TURNING or self._same_biases) and not self.unsure:
            self._fit(seconds)
        return False

    def rest(self, seconds):
        """Process a window at rest. seconds: its length.

        A doubt that comes only from a gap ends here at once, because at rest the force shows the lean."""
        if self.doubt and self._in_rest and self.doubts <= MILD:
            self._fit(seconds if self.doubts else _GAP_S)

    def fail(self, code):
        """Doubt because of a misfit. code: see odd."""
        self._brief_s = 0.0 if self.doubt or self._fits_s > _BRIEF_S else self._fits_s
        if not self.doubt:
            self._roll_out, self._doubted_lean = 0.0, self._lean
        if not self.doubt or self._since_s > _SAME_S:
            self._since_s = 0.0
            self.doubts = min(self.doubts + 1, len(HOLDS_S))
        self.gap()
        if self.doubts >= MILD and self.odd != "turned":  # exchanged sides cause other misfits as well
            self._blame(code)

    def _blame(self, code):
        global last_odd
        self.odd = last_odd = code

    def _fit(self, seconds):
        self._fits_s += seconds
        if self.doubt:
            hold_s = HOLDS_S[self.doubts - 1] + self._brief_s if self.doubts else _GAP_S
            if self._fits_s >= hold_s and self._slip <= _FIT:
                self.doubt, self.odd, self._fits_s, self._brief_s = False, None, 0.0, 0.0
        elif self.doubts and self._fits_s >= FORGET_S:
            self.doubts -= 1
            self._fits_s = 0.0
