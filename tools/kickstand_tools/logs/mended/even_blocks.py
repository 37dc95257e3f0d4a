"""A log whose times are rounded or repeated, block by block, with even times."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from kickstand.errors import Notice

from ..block import Block, joined
from ..even_times import even_times

CONTEXT = 2000  # samples before and after a block that have a say in its times
SAID_S = 0.002  # a shift of the times that is worth a remark


def even_blocks(blocks: Iterator[Block], name: str, remarks: list[Notice]) -> Iterator[Block]:
    """The same blocks with times that increase, see even_times(). name: of the log; remarks: told what was done.

    Blocks whose times are even or fine come as they are. Of others the last samples wait for the next block.
    """
    spread = _Spread(name)
    held: Block | None = None
    for block in blocks:
        whole = block if held is None else joined(held, block)
        ready, held = spread.take(whole)
        if ready is not None:
            yield ready
    if held is not None:
        yield spread.rest(held)
    remarks += spread.notices()


class _Spread:
    """name: of the log, for messages."""

    def __init__(self, name: str) -> None:
        self._name = name
        self._before_s = np.zeros(0)  # recorded times of the samples that were handed on last
        self._from_us: int | None = None  # time of the first sample, after spreading
        self._last_us = -1
        self._samples = self._repeated = 0
        self._shift_s = 0.0

    def take(self, block: Block) -> tuple[Block | None, Block | None]:
        """The part that is ready, and the part that has to wait for the next block."""
        recorded = np.concatenate((self._before_s, block.t_s))
        steady = not np.any(np.diff(block.time_us) == 0)
        if not steady and len(block.time_us) < 2 * CONTEXT:
            return None, block
        times = even_times(recorded, self._name)
        if np.array_equal(times, recorded):
            return self._ready(block, block.t_s), None
        if len(block.time_us) < 2 * CONTEXT:
            return None, block
        wait = len(block.time_us) - CONTEXT
        held = block.part(slice(wait, None))
        return self._ready(block.part(slice(0, wait)), times[len(self._before_s) :][:wait]), held

    def rest(self, block: Block) -> Block:
        """The last samples."""
        times = even_times(np.concatenate((self._before_s, block.t_s)), self._name)
        return self._ready(block, times[len(self._before_s) :])

    def notices(self) -> list[Notice]:
        """What there is to say of the times."""
        if not self._repeated and self._shift_s < SAID_S:
            return []
        return [Notice("times-spread", self._repeated, self._samples, self._shift_s)]

    def _ready(self, block: Block, times: np.ndarray) -> Block:
        recorded = block.t_s
        self._samples += len(times)
        self._repeated += int(np.count_nonzero(np.diff(recorded, prepend=self._before_s[-1:]) == 0.0))
        self._shift_s = max(self._shift_s, float(np.max(np.abs(times - recorded))))
        self._before_s = np.concatenate((self._before_s, recorded))[-CONTEXT:]
        own = bool(np.array_equal(times, recorded))
        if own and not self._from_us:
            self._from_us = 0
            self._last_us = int(block.time_us[-1])
            return block
        time_us = np.rint(times * 1e6).astype(np.int64)
        if self._from_us is None:
            self._from_us = int(time_us[0])
        order = np.arange(1, len(times) + 1)
        time_us = np.maximum.accumulate(np.maximum(time_us - self._from_us, self._last_us + 1) - order) + order
        self._last_us = int(time_us[-1])
        return replace(block, time_us=time_us, start_s=block.start_s + self._from_us / 1e6, own_times=own)
