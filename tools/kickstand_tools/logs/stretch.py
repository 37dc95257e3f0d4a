"""A stretch of a log, between two times."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

from ..errors import InputError
from ..signals import Array, Bools
from .block import Block
from .log import Log
from .source import File, name_of


@dataclass
class Stretch:
    """From from_s to to_s of a log, seconds since its first sample; negative: before its last one. None: its end there.

    It can be used wherever a log can. Read as a log its times count from its own first sample. Functions that compute
    the lean read the whole log, because the lean depends on earlier readings, and return the stretch in the log's
    times.

    >>> import numpy as np
    >>> from kickstand_tools.api import Log, read_log
    >>> log = Log(np.arange(300) / 100.0, np.tile([0.0, 1.0, 0.0], (300, 1)), np.zeros((300, 3)))
    >>> len(read_log(Stretch(log, 1.0, 2.0)).t_s), len(read_log(Stretch(log, from_s=-0.5)).t_s)
    (101, 51)
    """

    source: File | Log
    from_s: float | None = None
    to_s: float | None = None

    @property
    def name(self) -> str:
        """The log's name."""
        return name_of(self.source)

    def of_length(self, length_s: float) -> "Stretch":
        """The stretch with both times from the beginning. length_s: length of the log."""
        times = [None if t is None else t if t >= 0.0 else length_s + t for t in (self.from_s, self.to_s)]
        return Stretch(self.source, *times)

    def holds(self, block: Block) -> Bools:
        """(n) True for the samples of a block of the whole log that lie in the stretch, whose times have to be from the
        beginning."""
        begin_us, end_us = self._ends_us()
        return (block.time_us >= begin_us) & (block.time_us <= end_us)

    def _ends_us(self) -> tuple[float, float]:
        return round(1e6 * (self.from_s or 0.0)), float("inf") if self.to_s is None else round(1e6 * self.to_s)

    def cut(self, blocks: Iterator[Block]) -> Iterator[Block]:
        """The blocks of the whole log, cut to the stretch. Raises InputError if it holds no sample."""
        begin_us, end_us = self._ends_us()
        if end_us <= begin_us:
            raise InputError(f"{self.name}: the stretch ends before it begins: give --from the smaller time")
        from_us, length_s = None, 0.0
        for block in blocks:
            length_s = float(block.t_s[-1])
            if block.time_us[0] > end_us:
                break
            within = self.holds(block)
            if not within.any():
                continue
            part = block if within.all() else block.part(within)
            from_us = int(part.time_us[0]) if from_us is None else from_us
            yield replace(part, time_us=part.time_us - from_us, start_s=part.start_s + from_us / 1e6)
        if from_us is None:
            raise InputError(f"{self.name}: no samples in this stretch: the log is {length_s:.1f} s long")


def within(stretch: Stretch | None, block: Block, values: Array) -> Iterator[tuple[Block, Array]]:
    """A block of the whole log and the values of its rows (n, ...), as far as they lie in the stretch; None: all."""
    if stretch is None:
        yield block, values
    elif (which := stretch.holds(block)).any():
        yield block.part(which), values[which]
