"""Computes offset and slope of the accelerometer from six still poses, one on each side (A. Nicolae, section 4).

The closed form, equations 16-17, assumes that each axis points exactly up or down. A pose that is 10 degrees off causes
an error of 0.6 degrees of lean. fit() uses the same six mean readings, but only assumes that each calibrated reading
has a length of 1 g, as it has in any pose. The fit starts from the closed form and takes a few Gauss-Newton steps. The
error of the fit is about 0.1 degrees.

Six poses determine six numbers exactly, so their residual proves nothing. Only a seventh, free pose can verify the
result. A SensorFit then calibrates accelerometer and gyro from all poses and the turns between them.
"""

from array import array
from math import acos, degrees

from ..errors import Refusal, SickSensor
from ..rotation import matrix, vector
from ..units import AXES, const
from .parameters import MAX_OFFSET_G, MAX_SLOPE, MIN_SLOPE, Calibration
from .poses import rotated

SIDES = ("+x", "-x", "+y", "-y", "+z", "-z")  # the axis that points up, in the order of the six poses
_MAX_TILT_DEG = const(20.0)  # largest angle between a side's axis and the vertical
FREE_TILT_DEG = 20.0  # the free pose must be tilted by more, because a pose near a side adds little information
# Largest error of the free pose. A good sensor can have this error, because six numbers cannot describe its cross-axis
# sensitivity of 2 %.
_FREE_MAX_G = const(0.028)


def side_of(accel):
    """Return the index in SIDES of the side that is up.

    Args:
        accel: mean reading of the accelerometer, 3 values in g.
    """
    axis = 0
    for i in (1, 2):
        if abs(accel[i]) > abs(accel[axis]):
            axis = i
    return 2 * axis + (1 if accel[axis] < 0 else 0)


def tilt_deg(force):
    """Return the angle in degrees between the vertical and the axis nearest to it.

    Args:
        force: 3 values in any unit. For a null vector the result is 90.
    """
    size = sum(f * f for f in force) ** 0.5
    if not size > 1e-6:
        return 90.0
    return degrees(acos(min(1.0, max(abs(f) for f in force) / size)))


def closed_form(poses):
    """Compute offset and slope by equations 16-17. Raises Refusal for an axis that does not change.

    Args:
        poses: six mean readings of the accelerometer, each of 3 values in g, in the order of SIDES.

    Returns:
        offset: 3 values in g.
        slope: 3 values.
    """
    offset, slope = [0.0] * 3, [0.0] * 3
    for i in range(3):
        high, low = poses[2 * i][i], poses[2 * i + 1][i]
        if not high - low > 0.5:
            raise Refusal("dead-axis", AXES[i], high - low)
        offset[i] = -(high + low) / (high - low)
        slope[i] = 2.0 / (high - low)
    return offset, slope


def fit(poses):
    """Compute the offset and slope for which all six calibrated readings have a length of 1 g.

    Arguments and results are those of closed_form(). Raises Refusal."""
    offset, slope = closed_form(poses)
    rows = [[0.0] * 7 for _ in range(6)]
    for _ in range(8):  # more than enough: 3 to 5 steps suffice
        for pose, row in zip(poses, rows):
            square = 0.0
            for i in range(3):
                value = slope[i] * pose[i] + offset[i]
                square += value * value
                row[i] = 2.0 * value
                row[3 + i] = 2.0 * value * pose[i]
            row[6] = 1.0 - square
        if not _solve(rows):
            raise Refusal("unclear")
        for i in range(3):
            offset[i] += rows[i][6]
            slope[i] += rows[3 + i][6]
        if max(abs(row[6]) for row in rows) < 1e-6:
            break
    check_plausible(offset, slope, poses)
    return offset, slope


def check_plausible(offset, slope, poses):
    """Raise Refusal unless offset and slope are plausible, and in each pose one axis was within _MAX_TILT_DEG
    of the vertical."""
    for i in range(3):
        if not (abs(offset[i]) < MAX_OFFSET_G and MIN_SLOPE < slope[i] < MAX_SLOPE):
            raise Refusal("odd-axis", AXES[i], offset[i], slope[i])
    for k in range(6):
        tilt = tilt_deg([slope[i] * poses[k][i] + offset[i] for i in range(3)])
        if tilt > _MAX_TILT_DEG:
            raise Refusal("side-tilted", SIDES[k], tilt, _MAX_TILT_DEG)


def check_free_pose(offset, slope, accel):
    """Verify offset and slope with a seventh, slanted pose. Return by how much the calibrated force of this pose
    exceeds 1 g.

    Args:
        offset, slope: as returned by fit().
        accel: mean reading of the accelerometer in the seventh pose, 3 values in g.

    Raises:
        Refusal: the force differs from 1 g by more than _FREE_MAX_G.
    """
    force = [slope[i] * accel[i] + offset[i] for i in range(3)]
    error = sum(f * f for f in force) ** 0.5 - 1.0
    if not abs(error) <= _FREE_MAX_G:
        raise Refusal("free-pose-off", 1.0 + error)
    return error


def _solve(rows):
    """Solve six linear equations in place, by Gauss-Jordan elimination with partial pivoting.

    Args:
        rows: six lists, one per equation. Each list has six coefficients and the right-hand side, which the solution
            replaces.

    Returns:
        False if the equations are singular.
    """
    for k in range(6):
        pivot = k
        for r in range(k + 1, 6):
            if abs(rows[r][k]) > abs(rows[pivot][k]):
                pivot = r
        if not abs(rows[pivot][k]) > 1e-4:
            return False
        rows[k], rows[pivot] = rows[pivot], rows[k]
        lead = rows[k][k]
        for c in range(k, 7):
            rows[k][c] /= lead
        for r in range(6):
            if r != k and rows[r][k] != 0.0:
                factor = rows[r][k]
                for c in range(k, 7):
                    rows[r][c] -= factor * rows[k][c]
    return True


_UNKNOWNS = const(18)
_GYRO = 9  # index of the gyro's first unknown; it follows offset (3), slope (3) and N (3, in the order yz, xz, xy)
_STEPS = const(5)
_SIGMA_FORCE = const(0.0015)  # standard deviation of a pose's force, in g
_SIGMA_TURN = const(0.0015)  # standard deviation of a turn's angle, caused by the poses at its ends, in rad
# Random walk of the gyro's bias during a turn, in deg/s per sqrt(s). The poses at both ends measure the bias, so the
# variance of the turn's angle is _BIAS_WALK_DPS^2 seconds^3 / 12, in degrees^2.
_BIAS_WALK_DPS = const(0.008)
# Standard deviations of the priors. SIGMA_OFFSET is in g. SIGMA_SKEW is for N, SIGMA_SCALE for the diagonal of X, and
# SIGMA_CROSS for the rest of X. The data sheet allows errors of 0.03 in the gyro's scale and of 0.02 between its axes.
# The accelerometer's axes may also be rotated against the gyro's axes.
SIGMA_OFFSET, SIGMA_SLOPE, SIGMA_SKEW = 0.1, 0.1, 0.012
SIGMA_SCALE, SIGMA_CROSS = 0.03, 0.02
# Limits for accepting the fit
_MAX_SCALE_ERROR = const(0.10)  # largest scale error of a working gyro
# Largest cross-axis error of the gyro, three times the data sheet's value. A larger error means that the readings of
# one axis are late.
_MAX_CROSS_ERROR = const(0.06)
_MAX_MISFIT = const(0.012)  # largest misfit of a turn after the fit, in rad
# Largest misfit of a turn before the fit, in rad. In a turn of 180 degrees the errors that the data sheet allows add up
# to 0.2 rad.
_GROSS_MISFIT = const(0.25)
# Factors by which the readings of a faulty gyro axis may differ from the true rate. Each factor is tried on each axis.
_READS = const((-1.0, 0.25, 0.5, 0.75, 1.3, 2.0, 4.0))
_DEAD_RAD = const(0.2)  # an axis that measures no larger angle in any turn is dead
# Largest standard error of a gyro axis' scale. With a larger standard error, no turn about this axis has measured the
# scale.
_PROOF_SIGMA = const(0.025)


def _triangle(i):
    return i * (i + 1) // 2


def six_position_calibration(offset, slope, gyro_bias, matrices=None):
    """Return a new Calibration with the result of the six positions.

    The new Calibration is not aligned, because the sensor was not on the vehicle for the six poses.

    Args:
        offset: accel_offset, 3 values in g.
        slope: accel_slope, 3 values.
        gyro_bias: 3 values in deg/s.
        matrices: the 27 numbers of Calibration.matrices() if the gyro was measured too, else None.
    """
    new = Calibration()
    new.set_accel(offset, slope)
    new.six_done = True
    new.gyro_bias = vector(*gyro_bias)
    if matrices:
        new.set_matrices(matrices)
    return new


class SensorFit:
    """Calibrates accelerometer and gyro from still poses and the turns between them, by least squares.

    The fit has 18 unknowns, 9 in the model of each sensor:

        force = (I + N) (slope * reading + offset)      accelerometer; N is symmetric with a diagonal of 0; 9 unknowns
        rate = (I + X) (reading - bias)                 gyro; X is any 3x3 matrix; 9 unknowns

    In each pose the force must have a length of 1 g. Each turn rotates the force of the pose before it into the
    sensor's axes after it. The rotated force must equal the force of the pose after the turn. The priors come from the
    data sheet. The fit takes five Gauss-Newton steps in 32-bit floats. To save memory, the lower triangle of the normal
    equations (171 numbers) is factorised in place (A.-L. Cholesky).

    Args:
        poses: mean readings of the accelerometer, each of 3 values in g, in chronological order.
        turns: the turn after each pose but the last, as (Turn.packed(), seconds); None if the turn cannot be used.
        offset: first guess of the offset, 3 values in g.
        slope: first guess of the slope, 3 values.

    Attributes, after run():
        offset: 3 values in g.
        slope: 3 values.
        accel_matrix: 9 values.
        gyro_matrix: 9 values.
        gyro_sigma: standard error of each entry of gyro_matrix, 9 values.
        unproved: names of the axes that no turn has measured.
    """

    def __init__(self, poses, turns, offset, slope):
        self._poses, self._turns = poses, turns
        self._p = list(offset) + list(slope) + [0.0] * 12
        self._start = [0.0] * 3 + [1.0] * 3 + [0.0] * 12
        self._sigma = [SIGMA_OFFSET] * 3 + [SIGMA_SLOPE] * 3 + [SIGMA_SKEW] * 3
        self._sigma += [SIGMA_SCALE if i % 4 == 0 else SIGMA_CROSS for i in range(9)]
        self._h = array("f", [0.0] * _triangle(_UNKNOWNS))
        self._g = [0.0] * _UNKNOWNS

    def run(self):
        """Fit, as a generator of short steps. On a board the whole fit takes longer than the chip's FIFO can keep the
        samples. Raises SickSensor if a working gyro cannot have measured these turns."""
        self._check_gross()
        for _ in range(_STEPS):
            yield from self._accumulate()
            self._factorise()
            yield
            step = self._solve()
            for i in range(_UNKNOWNS):
                self._p[i] += step[i]
            yield
        self._finish()
        self._check()

    def finish(self):
        """Do all steps of run()."""
        for _ in self.run():
            pass

    def matrices(self):
        """Return the 27 numbers of Calibration.matrices()."""
        return list(self.accel_matrix) + list(self.gyro_matrix) + self.gyro_sigma

    def force(self, k):
        """Return the force of pose k by the current unknowns, 3 values in g."""
        m, p, a = self._accel(), self._p, self._poses[k]
        g = [p[3 + i] * a[i] + p[i] for i in range(3)]
        return [m[3 * i] * g[0] + m[3 * i + 1] * g[1] + m[3 * i + 2] * g[2] for i in range(3)]

    def _accel(self):
        yz, xz, xy = self._p[6:9]
        return 1.0, xy, xz, xy, 1.0, yz, xz, yz, 1.0

    def _misfit(self, k, x):
        """Compare the forces at both ends of a turn, in the axes of the pose before the turn.

        Args:
            k: index of the turn.
            x: the 9 entries of X, row by row.

        Returns:
            misfit: `before` minus the force of the next pose, rotated back by R; 3 values in rad, because the force is
                1 g.
            before: the force of the pose before the turn, corrected for the gyro's errors; 3 values in g.
        """
        turn = self._turns[k][0]
        turned = [0.0] * 3
        for a in range(3):
            for m in range(9):
                turned[a] -= turn[9 + 9 * a + m] * x[m]
        earlier, later = rotated(turned, self.force(k)), self.force(k + 1)
        for a in range(3):
            turned[a] = earlier[a] - turn[3 * a] * later[0] - turn[3 * a + 1] * later[1] - turn[3 * a + 2] * later[2]
        return turned, earlier

    def _accumulate(self):
        h, g, p = self._h, self._g, self._p
        for i in range(len(h)):
            h[i] = 0.0
        for i in range(_UNKNOWNS):
            weight = 1.0 / (self._sigma[i] * self._sigma[i])
            h[_triangle(i) + i] = weight
            g[i] = weight * (self._start[i] - p[i])
        row = [0.0] * _UNKNOWNS
        for k in range(len(self._poses)):
            force = self.force(k)
            columns = self._force_columns(k)
            for i in range(9):
                row[i] = force[0] * columns[i] + force[1] * columns[9 + i] + force[2] * columns[18 + i]
            square = force[0] * force[0] + force[1] * force[1] + force[2] * force[2]
            self._add(row, 9, 0.5 * (1.0 - square), 1.0 / (_SIGMA_FORCE * _SIGMA_FORCE))
            yield
        for k in range(len(self._turns)):
            if self._turns[k] is None:
                continue
            turn, seconds = self._turns[k]
            walk = _BIAS_WALK_DPS * 0.01745
            weight = 1.0 / (_SIGMA_TURN * _SIGMA_TURN + walk * walk * seconds * seconds * seconds / 12)
            misfit, rotated_force = self._misfit(k, p[_GYRO:])
            first, second = self._force_columns(k), self._force_columns(k + 1)
            yield
            for a in range(3):
                b, c = (a + 1) % 3, (a + 2) % 3
                for i in range(9):
                    row[i] = first[9 * a + i]
                    for j in range(3):
                        row[i] -= turn[3 * a + j] * second[9 * j + i]
                    row[_GYRO + i] = rotated_force[b] * turn[9 + 9 * c + i] - rotated_force[c] * turn[9 + 9 * b + i]
                self._add(row, _UNKNOWNS, -misfit[a], weight)
                yield

    def _force_columns(self, k):
        """Return the derivatives of the force of pose k by offset, slope and N: 3 rows of 9."""
        m, p, a = self._accel(), self._p, self._poses[k]
        x, y, z = [p[3 + i] * a[i] + p[i] for i in range(3)]
        out = []
        for i in range(3):
            row = m[3 * i : 3 * i + 3]
            out += row
            out += [row[j] * a[j] for j in range(3)]
            out += ((0.0, z, y), (z, 0.0, x), (y, x, 0.0))[i]
        return out

    def _add(self, row, n, residual, weight):
        """Add the equation `residual = row . change` to the normal equations. The row has n entries."""
        h, g = self._h, self._g
        index = 0
        for i in range(n):
            value = weight * row[i]
            g[i] += value * residual
            for j in range(i + 1):
                h[index] += value * row[j]
                index += 1

    def _factorise(self):
        """Factorise h = L L^T in place."""
        h = self._h
        for i in range(_UNKNOWNS):
            of_i = _triangle(i)
            for j in range(i + 1):
                of_j = _triangle(j)
                total = h[of_i + j]
                for k in range(j):
                    total -= h[of_i + k] * h[of_j + k]
                h[of_i + j] = total / h[of_j + j] if j < i else max(total, 1e-9) ** 0.5

    def _solve(self):
        """Solve L L^T change = g."""
        h, out = self._h, self._g[:]
        for i in range(_UNKNOWNS):
            for k in range(i):
                out[i] -= h[_triangle(i) + k] * out[k]
            out[i] /= h[_triangle(i) + i]
        for i in range(_UNKNOWNS - 1, -1, -1):
            for k in range(i + 1, _UNKNOWNS):
                out[i] -= h[_triangle(k) + i] * out[k]
            out[i] /= h[_triangle(i) + i]
        return out

    def _finish(self):
        """Set the results.

        The gyro's unknowns come last, so the last 9 rows and columns of L give their covariance. The variance of an
        unknown is the squared length of its column in the inverse of that block."""
        h, p = self._h, self._p
        self.offset, self.slope = p[0:3], p[3:6]
        self.accel_matrix = matrix(self._accel())
        self.gyro_matrix = matrix([p[_GYRO + i] + (1.0 if i % 4 == 0 else 0.0) for i in range(9)])
        self.gyro_sigma = []
        for m in range(_GYRO, _UNKNOWNS):
            column, square = [0.0] * _UNKNOWNS, 0.0
            for i in range(m, _UNKNOWNS):
                total = 1.0 if i == m else 0.0
                for k in range(m, i):
                    total -= h[_triangle(i) + k] * column[k]
                column[i] = total / h[_triangle(i) + i]
                square += column[i] * column[i]
            self.gyro_sigma.append(square**0.5)
        self.unproved = [AXES[i] for i in range(3) if self.gyro_sigma[4 * i] > _PROOF_SIGMA]

    def _check_gross(self):
        """Raise SickSensor if a turn by the gyro differs much from the turn that gravity shows."""
        worst = self._cost([0.0] * 9)[1]
        if worst > _GROSS_MISFIT**2:
            raise self._ill(worst)

    def _ill(self, worst):
        """Return the SickSensor for turns that do not fit. The error names an axis if that axis alone explains the
        misfits."""
        x = [0.0] * 9
        best, fault = self._cost(x)[0] / 4, None
        for axis in range(3):
            if self._turned(axis) < _DEAD_RAD:
                return SickSensor("dead-gyro", AXES[axis])
            for reads in _READS:
                x[4 * axis] = 1.0 / reads - 1.0
                cost = self._cost(x)[0]
                if cost < best:
                    best, fault = cost, (axis, reads)
            x[4 * axis] = 0.0
        if fault is None:
            return SickSensor("gyro-misfit", degrees(worst**0.5))
        axis, reads = fault
        if reads < 0.0:
            return SickSensor("gyro-reversed", AXES[axis])
        return SickSensor("gyro-scale", AXES[axis], 100.0 * (reads - 1.0))

    def _turned(self, axis):
        """Return the largest rotation about an axis that the gyro measured in any turn, in rad."""
        largest = 0.0
        for turn in self._turns:
            if turn is not None:
                for a in range(3):
                    largest = max(largest, abs(turn[0][9 + 9 * a + 4 * axis]))
        return largest

    def _cost(self, x):
        """Return the sum and the maximum of the squared misfits of all turns."""
        total = largest = 0.0
        for k in range(len(self._turns)):
            if self._turns[k] is not None:
                misfit = self._misfit(k, x)[0]
                square = misfit[0] * misfit[0] + misfit[1] * misfit[1] + misfit[2] * misfit[2]
                total += square
                largest = max(largest, square)
        return total, largest

    def _check(self):
        """Raise SickSensor if the gyro's errors exceed those of a working chip, or a turn does not fit."""
        p = self._p
        worst = self._cost(p[_GYRO:])[1]
        if not worst < _MAX_MISFIT**2:
            raise self._ill(worst)
        for i in range(9):
            error = p[_GYRO + i]
            if i % 4 == 0 and not abs(error) < _MAX_SCALE_ERROR:
                raise SickSensor("gyro-scale", AXES[i // 4], -100.0 * error)
            if not abs(error) < _MAX_CROSS_ERROR + 2 * self.gyro_sigma[i]:
                raise SickSensor("gyro-misfit", degrees(abs(error)))
