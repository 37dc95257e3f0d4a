"""A ride with fewer samples a second: means over equal stretches of time."""

from collections.abc import Iterable, Iterator
from dataclasses import fields

import numpy as np

from ..signals import Array
from .channels import Channels

_LAST = ("lat_deg", "lon_deg", "utc_s")


def joined(parts: Iterable[Channels]) -> Channels:
    """The parts of a ride joined to one. Takes them one by one, to limit memory; a column without any value takes none,
    and is read only."""
    columns: list[Array | None] = [None for _ in fields(Channels)]
    length = 0
    for part in parts:
        end = length + len(part.t_s)
        for k, field in enumerate(fields(Channels)):
            values, column = getattr(part, field.name), columns[k]
            if column is None:
                if np.all(np.isnan(values)):
                    continue
                column = columns[k] = np.full(end, np.nan)
            if end > len(column):
                longer = np.empty(2 * end)  # what is not written yet takes no memory, but in a browser
                longer[:length] = column[:length]
                column = columns[k] = longer
            column[length:end] = values
        length = end
    for column in columns:
        if column is not None:
            column.resize(length, refcheck=False)
    return Channels(*(np.broadcast_to(np.nan, length) if column is None else column for column in columns))


def thinned(course: Channels, step_s: float) -> Channels:
    """A whole ride in means over step_s; unchanged if it has no more samples than that."""
    if np.all(np.diff(_stretches(course.t_s, step_s)) > 0.0):
        return course
    return joined(downsampled([course], step_s))


def spacing_s(course: Channels) -> float:
    """Median time from sample to sample, s."""
    return float(np.median(np.diff(course.t_s))) if len(course.t_s) > 1 else 1.0


def downsampled(blocks: Iterable[Channels], step_s: float, rounded: bool = False) -> Iterator[Channels]:
    """The means over each stretch of step_s in which there are samples; a channel's NaNs do not count. For positions
    and their time it is the last value: there is no mean of longitudes on both sides of 180 degrees.

    A ride with at most one sample per stretch is not changed. A stretch may extend over several blocks. rounded: each
    stretch is of the times that round to the same multiple of step_s.
    """
    rest: Channels | None = None
    for block in blocks:
        block = block if rest is None else joined([rest, block])
        step = _stretches(block.t_s, step_s, rounded)
        last = int(np.searchsorted(step, step[-1]))  # the last stretch may go on in the next block
        rest = block.part(slice(last, None))
        if last:
            yield _means(block.part(slice(0, last)), step[:last])
    if rest is not None:
        yield _means(rest, np.zeros(len(rest.t_s)))


def rounded_to(t_s: Array, step_s: float) -> Array:
    """Times as multiples of step_s: of stretches that are rounded no two are the same."""
    return _stretches(t_s, step_s, True) * step_s


def _stretches(t_s: Array, step_s: float, rounded: bool = False) -> Array:
    """The number of the stretch that each sample lies in."""
    return np.floor(t_s / step_s + 0.5 * rounded + 1e-6)


def _means(block: Channels, step: Array) -> Channels:
    starts = np.flatnonzero(np.diff(step, prepend=-np.inf))
    if len(starts) == len(step):
        return block
    columns = []
    for field in fields(block):
        values = getattr(block, field.name)
        there = ~np.isnan(values)
        if field.name in _LAST:
            last = np.maximum.reduceat(np.where(there, np.arange(len(step)), -1), starts)
            columns.append(np.where(last >= 0, values[last], np.nan))
            continue
        count = np.add.reduceat(there, starts, dtype=float)
        total = np.add.reduceat(np.where(there, values, 0.0), starts)
        columns.append(np.divide(total, count, out=np.full(len(starts), np.nan), where=count > 0))
    return Channels(*columns)
