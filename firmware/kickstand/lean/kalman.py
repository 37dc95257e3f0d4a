"""The Kalman filters: the covariance of the lean's filter, and the filter of the trim.

The covariance is updated in steps short enough for the time of one sample. Nearly all of the work is sums of products.
On a board a product of floats takes 12 us and 32 bytes of heap. So on a board machine code computes these sums on
arrays, without heap. The long methods are generators, which yield where the work may be interrupted. Rows of Jacobians
are written as ((state, value), ...), because most of their values are zero.
"""

from array import array
from math import radians, sin, sqrt

from ..quick import load, plain
from ..units import const

# Lower bound of a variance, because rounding in 32-bit floats could make it negative. quick_viper.py has it too
_MIN_VARIANCE = const(1e-10)
# Number of terms of a Jacobian's row that are processed between two yields. Without machine code three terms take a
# millisecond.
_TERMS_PER_STEP = const(3)
# Largest squared innovation, in variances, with full weight (5 sigma). Larger innovations get less weight. No
# innovation is rejected, because the state may be wrong.
_GATE = const(25.0)

# The trim
# rad: largest trim, the sum of 2 degrees for an inexact upright pose, and the accelerometer's remaining errors
MAX_TRIM = radians(3.5)
# The comment of each parameter has its unit, its meaning and, after "Larger:", the effect of a larger value.

# rad (2.5 degrees): standard deviation of the trim after new poses. Larger: the trim is found sooner, and varies more.
_SIGMA_START = const(0.0436)
# rad (0.5 degrees): standard deviation of a trim from an earlier ride, because the sensor was colder or hotter then.
# Larger: the trim is found sooner, and varies more.
_SIGMA_KEPT = const(0.0087)
# rad (4.6 degrees): largest lean of a bike that is held upright. Larger: a bike on its kickstand counts as held.
_MAX_HELD = const(0.08)
# ratio: weight of the lean before setting off, compared with the upright pose. A rider on the bike feels where it is in
# balance, but may lean it on a foot. With this weight a bike that leans by 2 degrees makes the first lean no worse.
# Larger: a foot on the ground makes the first lean wrong.
_HELD_SHARE = const(0.3)
# rad (1.0 degrees): force to the side divided by force up on straights, caused by rider, camber and wind. On a recorded
# motorcycle ride its means over 2 s vary by 0.8 degrees. Larger: the trim is found later.
_SIGMA_STRAIGHT = const(0.0175)
# rad (0.4 degrees): the same for minutes, as in a steady crosswind. Larger: a trim that is nearly found varies less.
_SIGMA_LASTING = const(0.007)
# ratio: standard deviation of the force to the side in bends, divided by sin(lean). Tyres and rider cause this force.
# Larger: bends to one side count less.
_SIGMA_LEAN_SHARE = const(0.15)
# ratio: variation of the force to the side from bend to bend, divided by sin(lean). The rider causes it. Larger: bends
# count less.
_SIGMA_TURN = const(0.04)
# rad per rad/s: additional measurement noise, divided by the yaw rate. Larger: bends count less.
_SIGMA_YAW_S = const(0.03)
# ratio: limit to which larger forces to the side are reduced. Larger: a single blow counts for more.
_MOST_UNEXPLAINED = const(0.25)
# ratio: largest innovation that counts. Larger: a sensor in a hand counts as a balanced bike.
_MAX_SIDEWAYS = const(0.1)
_DISTURBANCE_S = const(2.0)  # s: duration of wind or camber. Larger: the trim is found later, and varies less.
# rad per square root of a second: process noise of the trim. Larger: a change of the trim is found sooner.
_NOISE = const(0.000175)


def add_products_python(out, factors, source, n, rows):
    """Add factors[i] * source[k] to out[i * n + k], for i below rows and k below n.

    out, factors, source: arrays of floats. rows: 1, or n for a covariance. Half of a covariance is computed and copied
    to the other half, and its variances are kept above _MIN_VARIANCE. On the board add_products() is the machine code
    of quick_viper.py, for array("f"). Elsewhere add_products() is this function.
    """
    for i in range(rows):
        factor = factors[i]
        for k in range(i + 1 if rows > 1 else n):
            value = out[i * n + k] + factor * source[k]
            out[i * n + k] = value
            if rows > 1:
                out[k * n + i] = value
        if rows > 1 and out[i * n + i] < _MIN_VARIANCE:
            out[i * n + i] = _MIN_VARIANCE


def _adding():
    """Return arrays and their mark. Some of the sums grow, vanish, change their sign or are rounded, and a variance is
    too small."""
    sums = array("f", (0.65625, 0, 0, -0.75, 8388609, 0, 1e-9, 3e9, -0.984))
    return (sums, array("f", (1.5, -2.6875, 0.75)), array("f", (-0.4375, 98304.5, 1.3125)), 3, 3), 0x0A019A4B


(add_products,) = load("quick_viper", ("add_products", _adding))
KIND = "f"  # type of the arrays' elements
if "add_products" in plain:  # as plain Python it cannot take floats apart
    add_products, KIND = add_products_python, "d"
del _adding, add_products_python


class Covariance:
    """P, the covariance of n states, and the correction of these states by measurements.

    variances: n initial variances of uncorrelated states.
    Attributes:
        rows        P, n rows of n floats
        correction  n floats, which the owner adds to the states and sets to 0
        misfit      the last innovation, in standard deviations
    """

    def __init__(self, variances):
        n = self.n = len(variances)
        self._zeros = array(KIND, [0.0] * n)
        self._p = array(KIND, [0.0] * n * n)
        self._divide()
        for i, variance in enumerate(variances):
            self._p[i * n + i] = variance
        self.correction, self._column, self._gain = [array(KIND, self._zeros) for _ in range(3)]
        self._factor = array(KIND, [0.0])
        self.misfit = 0.0

    def _divide(self):
        n, elements = self.n, memoryview(self._p)
        # Parts of _p. The type checker treats the elements of a memoryview as integers.
        self.rows = [elements[n * i : n * (i + 1)] for i in range(n)]  # type: list

    def __getstate__(self):  # without the memoryviews in `rows`, which copy and pickle on a computer cannot copy
        return {name: value for name, value in self.__dict__.items() if name != "rows"}

    def __setstate__(self, state):
        self.__dict__.update(state)
        self._divide()

    def set_variance(self, i, variance):
        """Set the variance of state i, and its covariances with the other states to 0."""
        p, n = self._p, self.n
        for k in range(n):
            p[i * n + k] = p[k * n + i] = 0.0
        p[i * n + i] = variance

    def add_noise(self, i, variance):
        """Add process noise to the variance of state i. Use this method for states that do not depend on other
        states."""
        self._p[i * self.n + i] += variance

    def propagate_row(self, i, derivatives, seconds, noise):
        """Compute P = F P F^T for one row of F, plus process noise. A generator.

        derivatives: ((j, d rate_i / d state_j), ...), where rate_i is the rate of change of state i. j is never i.
        seconds: length of the step. noise: added to state i's variance.
        """
        rows, factor, n = self.rows, self._factor, self.n
        row = rows[i]
        for m, (j, a) in enumerate(derivatives):
            if m == _TERMS_PER_STEP:
                yield
            factor[0] = a * seconds
            add_products(row, factor, rows[j], n, 1)
        variance = row[i] + noise
        for j, a in derivatives:
            variance += a * seconds * row[j]
        row[i] = variance
        for k in range(n):
            rows[k][i] = row[k]  # P is symmetric
        yield

    def update(self, derivatives, innovation, variance):
        """Apply one scalar measurement: K = P H^T / (H P H^T + R), correction += K innovation, P -= K H P. A generator.

        derivatives: H, ((state, d measurement / d state), ...). innovation: the measured value minus the value expected
        from the states before this window's corrections. variance: R, in the measurement's unit squared. If the squared
        innovation exceeds _GATE times its expected variance, this variance is raised until they are equal.
        """
        rows, column, gain, factor = self.rows, self._column, self._gain, self._factor
        correction, n = self.correction, self.n
        column[:] = self._zeros
        for m, (j, h) in enumerate(derivatives):
            if m == _TERMS_PER_STEP:
                yield
            factor[0] = h
            add_products(column, factor, rows[j], n, 1)
        expected = variance
        for j, h in derivatives:
            expected += h * column[j]
            innovation -= h * correction[j]
        square = innovation * innovation
        self.misfit = innovation / sqrt(expected)
        if square > _GATE * expected:
            expected = square / _GATE
        yield
        gain[:] = self._zeros
        factor[0] = -1.0 / expected
        add_products(gain, factor, column, n, 1)
        add_products(self._p, gain, column, n, n)
        yield
        factor[0] = -innovation
        add_products(correction, factor, gain, n, 1)
        yield


class UprightTrim:
    """Estimates the trim with a Kalman filter of two states. The trim is the correction of the roll misalignment,
    because the alignment's upright pose was not quite upright.

    A bike in balance has no specific force to the side. The mean force to the side on straights comes from the roll
    misalignment and from the accelerometer's drift, so both effects are subtracted from the lean. In bends wide tyres
    and a rider who hangs off add a force whose sign differs between left and right bends. The trim is the part that
    left and right bends have in common.

    Args:
        angle: the trim found on earlier rides, in rad, or 0.

    Read-only attributes:
        angle: the trim in rad, within MAX_TRIM. The trim is subtracted from the lean.
        variance: the variance of the trim in rad^2.
    """

    def __init__(self, angle):
        self.angle = angle
        self.variance = (_SIGMA_START if angle == 0.0 else _SIGMA_KEPT) ** 2
        # The second state: tyres and rider make a bike lean more or less than balance requires, equally on both sides
        self._lean_share = 0.0  # times sin(lean)
        self._share_variance = _SIGMA_LEAN_SHARE**2
        self._covariance = 0.0

    def unexplained(self, sideways, lean):
        """Return the part of a force to the side that trim, tyres and rider do not explain.

        A wind of a minute looks like trim. So the trim may be any value between 0 and the angle. The value that
        explains most is subtracted.

        Args:
            sideways: force to the left divided by force up.
            lean: of a bike in balance at this speed and yaw rate, in rad. The estimated lean would be wrong, because
                it follows the force of a mount that has slipped. So tyres would seem to explain a part of this force.
        """
        force = sideways - sin(lean) * self._lean_share
        force -= max(min(0.0, self.angle), min(max(0.0, self.angle), force))
        return max(-_MOST_UNEXPLAINED, min(_MOST_UNEXPLAINED, force))

    def held(self, lean):
        """Take the lean of a bike that its rider held at rest, in rad, if nothing else is known about the trim. Between
        this lean and the upright pose the bike is upright."""
        if self.variance >= _SIGMA_START**2 and abs(lean) < _MAX_HELD:
            self.angle = _HELD_SHARE * lean
            self.variance *= 1.0 - _HELD_SHARE

    def update(self, sideways, lean, yaw_rate, seconds):
        """Update the angle with one measurement made while riding.

        Args:
            sideways: force to the left divided by force up.
            lean: in rad. Lean and yaw rate increase the noise in bends.
            yaw_rate: in rad/s.
            seconds: time since the previous update.
        """
        sine = sin(lean - self.angle)
        innovation = sideways - self.angle - sine * self._lean_share
        if not -_MAX_SIDEWAYS < innovation < _MAX_SIDEWAYS:
            return
        turn = _SIGMA_TURN * sine
        yaw = _SIGMA_YAW_S * yaw_rate
        noise = (_SIGMA_STRAIGHT**2 + turn * turn + yaw * yaw) * 2.0 * _DISTURBANCE_S / seconds
        noise *= 1.0 + _SIGMA_LASTING**2 / self.variance
        self.variance += _NOISE**2 * seconds
        # P H^T of the measurement sideways = angle + lean_share sin(lean), H = (1, sin(lean))
        angle_gain = self.variance + sine * self._covariance
        share_gain = self._covariance + sine * self._share_variance
        expected = angle_gain + sine * share_gain + noise
        innovation /= expected
        self.angle = max(-MAX_TRIM, min(MAX_TRIM, self.angle + angle_gain * innovation))
        self._lean_share += share_gain * innovation
        self.variance -= angle_gain * angle_gain / expected
        self._covariance -= angle_gain * share_gain / expected
        self._share_variance -= share_gain * share_gain / expected
