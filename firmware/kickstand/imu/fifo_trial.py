"""Tries out the chip's FIFO. Imported by Mpu6050.fifo_fault(), after a fault that set-ups do not remove."""

from time import sleep_ms

from micropython import const

from ..errors import Notice
from .fifo_frames import FRAME

_INT_ENABLE = const(0x38)  # register map p. 27: bit 0, a sample is ready
_INT_STATUS = const(0x3A)  # p. 28
_PERIODS = 4  # samples that the FIFO gets time for


def try_out(chip):
    """See Mpu6050.fifo_fault(). chip: an Mpu6050."""
    chip.restart_fifo()
    left = chip.waiting()  # not 0 if a sample came in between
    chip.write_register(_INT_ENABLE, 1)
    before = _reading(chip)
    sleep_ms(_PERIODS * chip.period_ms)
    waiting = chip.waiting()
    measures = chip.read_register(_INT_STATUS) & 1 or _reading(chip) != before
    chip.write_register(_INT_ENABLE, 0)
    how = None
    if left > FRAME * _PERIODS:
        how = "stays full"
    elif measures and waiting <= left:
        how = "stays empty" if not left else "stands still"
    elif measures and _repeats(chip):
        how = "repeats"
    chip.restart_fifo()
    return Notice("sensor-fifo", how) if how else None


def _reading(chip):
    chip.read()
    return tuple(chip.counts)


def _repeats(chip):
    """True if the FIFO gives the same frame again and again, though the data registers change."""
    first = _reading(chip)
    frames = set()
    for _ in range(3):
        sleep_ms(_PERIODS * chip.period_ms)
        for k in range(chip.fetch()):
            chip.take(k)
            frames.add(tuple(chip.counts))
    return len(frames) == 1 and _reading(chip) != first
