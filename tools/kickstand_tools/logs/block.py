"""Some successive rows of a log."""

from collections.abc import Iterator
from dataclasses import dataclass, field, replace

import numpy as np

from ..signals import Array, Bools, Ints
from .csv_reader import cells_of
from .log import FirmwareRow, firmware_rows
from .table import Table


@dataclass
class Block(Table):
    """Some successive rows of a log, in the units of the firmware's modules.

    time_us (n): since the log's first sample. readings (n, 7): acceleration (3, g), temperature (C), rate (3, deg/s),
    the chip's order. speed_mps, lat_deg, lon_deg, utc_s (n): as in a Log. What the log does not have is NaN. start_s:
    the recorder's own time at the log's first sample. frozen (n): True where the readings are repeated ones, see
    frozen.py.
    """

    time_us: Ints
    readings: Array
    speed_mps: Array
    lat_deg: Array
    lon_deg: Array
    utc_s: Array
    frozen: Bools
    has_temp: bool
    start_s: float
    done: int  # bytes of the (packed) file that have been read; samples of a log in memory
    lines: list[str] = field(default_factory=list)  # the rows as CSV, none for a log in memory
    names: tuple[str, ...] = ()  # names of the columns in lines
    own_times: bool = True  # False if the times were changed (see even_times.py) and differ from those in lines

    def rows(self) -> Iterator[FirmwareRow]:
        """The samples as firmware_rows() has them, for a replay by the firmware's modules."""
        return firmware_rows(self.time_us, self.readings, self.speed_mps)

    @property
    def t_s(self) -> Array:
        """(n) seconds since the log's first sample."""
        return self.time_us.astype(float) * 1e-6

    @property
    def time_text(self) -> list[str]:
        """The times as texts: those of the file, or the changed ones."""
        if not self.lines or not self.own_times:
            return [f"{self.start_s + t:.6f}" for t in self.t_s.tolist()]
        place = self.names.index("t_s")
        return [cells_of(line)[place].strip() for line in self.lines]

    def part(self, which: slice | Bools) -> "Block":
        """The rows of a slice, or those where an array of n is True."""
        if isinstance(which, slice):
            lines = self.lines[which]
        else:
            lines = [line for line, wanted in zip(self.lines, which.tolist()) if wanted]
        return replace(super().part(which), lines=lines)

    @property
    def measured(self) -> "Block":
        """The rows that are not frozen."""
        return self.part(~self.frozen) if np.any(self.frozen) else self


def joined(first: Block, second: Block) -> Block:
    """Two successive blocks as one."""
    return replace(
        second,
        lines=first.lines + second.lines,
        own_times=first.own_times and second.own_times,
        **{name: np.concatenate((rows, getattr(second, name))) for name, rows in first.columns().items()},
    )
