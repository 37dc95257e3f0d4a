"""Runs MeterAlong in a second process.

For a log of an hour at 200 Hz, one process needs 6.3 s of processor time. With two processes, the second computes for
4.0 s. At the same time, the first reads and writes for 2.2 s.
"""

import multiprocessing
import signal
from collections import deque
from collections.abc import Iterator
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from dataclasses import replace

from ..calibration.file import CalibrationFile
from ..common.errors import InputError
from ..logs.log import Block
from ..signals import Array
from .meter_along import MeterAlong

_AHEAD = 3  # number of blocks that are read in advance to keep the second process busy

_along: MeterAlong  # exists only in the second process


def columns_of(blocks: Iterator[Block], calibration: CalibrationFile) -> Iterator[tuple[Block, Array]]:
    """Yield each block with MeterAlong.columns() of its measured rows.

    Raises InputError if the log cannot be used, and if the second process ends.
    """
    spawn = multiprocessing.get_context("spawn")  # do not fork, because the progress bar runs in a thread
    waiting: deque[tuple[Block, Future[Array]]] = deque()
    try:
        with ProcessPoolExecutor(1, spawn, _begin, (calibration,)) as pool:
            for block in blocks:
                waiting.append((block, pool.submit(_columns, replace(block.measured, lines=[]))))
                if len(waiting) > _AHEAD:
                    yield _result(*waiting.popleft())
            while waiting:
                yield _result(*waiting.popleft())
    except BrokenProcessPool as error:
        raise InputError("the second process of replay has ended: is there enough memory?") from error


def _result(block: Block, columns: Future[Array]) -> tuple[Block, Array]:
    return block, columns.result()


def _begin(calibration: CalibrationFile) -> None:
    global _along
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the first process handles Ctrl-C, and ends this one
    _along = MeterAlong(calibration)


def _columns(block: Block) -> Array:
    return _along.columns(block)
