"""Averages the last hour of a log over bins of a tenth of a second, for the checks of units, axes and mount."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..logs.log import Log
from ..signals import Array, Bins, Bools, bin_numbers, binned, intervals, runs

BIN_S = 0.1  # length of a bin; faster changes are vibration
MOST_BINS = 36_000  # number of bins with samples that are used: one hour
GAP_BINS = 3  # number of successive bins without samples that make a gap; fewer bins are interpolated


@dataclass
class LogBins:
    """n successive bins of BIN_S. Vectors are along the sensor's axes.

    bins: the bins as averaged. Means are force and rate, three columns each.
    force: mean forces, shape (n, 3), in g; 0 where unknown.
    rate: mean rates, shape (n, 3), in deg/s; 0 where unknown.
    valid: False in gaps, shape (n).
    speeds: the first speed of each second, shape (m, 2): time in s, speed in m/s.
    positions: the first position of each second, shape (m, 3): time in s, latitude and longitude in degrees.
    """

    bins: Bins
    force: Array
    rate: Array
    valid: Bools
    speeds: Array
    positions: Array

    def integrals(self, time_s: Array) -> Array:
        """Integrate from the first bin to each of k times.

        time_s: the times, shape (k), in s.
        Returns seven columns, shape (k, 7): the integral of the force (3, in g s), the integral of the rate (3, in
        degrees), and the duration of valid bins (s).
        """
        edges_s = (self.bins.first + np.arange(len(self.valid) + 1)) * BIN_S
        return np.column_stack([np.interp(time_s, edges_s, sums) for sums in self._sums])

    @cached_property
    def _sums(self) -> Array:
        values = np.column_stack((self.force, self.rate, self.valid)) * BIN_S
        sums = np.zeros((7, len(values) + 1))
        np.cumsum(values.T, axis=1, out=sums[:, 1:])
        return sums

    def means(self, over: int) -> tuple[Array, Array, Array]:
        """Average groups of `over` bins. Missing values are NaN.

        Returns the mean force of each group, shape (k, 3), in g; the mean rate, shape (k, 3), in deg/s; and the first
        speed in each group, shape (k), in m/s.
        """
        merged = self.bins.merged(over)
        return merged.means[:, :3], merged.means[:, 3:], merged.latest[:, 0]


def log_bins(log: Log) -> LogBins | None:
    """Average a log to LogBins. Returns None without samples, or if gaps make the log too long for a ride."""
    bins = binned(log.t_s, BIN_S, [*log.accel_g.T, *log.gyro_dps.T], [log.speed_mps], MOST_BINS, longest=10 * MOST_BINS)
    if bins is None:
        return None
    has_samples = bins.count > 0
    valid = has_samples.copy()
    for begin, end in intervals(~has_samples):
        valid[begin:end] = end - begin < GAP_BINS
    number, sampled = np.arange(len(valid)), np.flatnonzero(has_samples)
    filled = np.column_stack([np.interp(number, sampled, column[sampled]) for column in bins.means.T]) * valid[:, None]
    first_s = bins.first * BIN_S
    speeds = _once_a_second(first_s, log.t_s, log.speed_mps)
    positions = _once_a_second(first_s, log.t_s, log.lat_deg, log.lon_deg)
    return LogBins(bins, filled[:, :3], filled[:, 3:], valid, speeds, positions)


def _once_a_second(first_s: float, time_s: Array, *columns: Array) -> Array:
    """Return the first row of each second in which all columns have a value, with the time in front.

    first_s: earlier rows are not used.
    """
    rows = np.flatnonzero(~np.isnan(columns[0]))
    values = np.column_stack([column[rows] for column in (time_s, *columns)])
    values = values[np.all(np.isfinite(values), axis=1) & (values[:, 0] >= first_s)]
    return values[runs(bin_numbers(values[:, 0], 1.0))] if len(values) else values
