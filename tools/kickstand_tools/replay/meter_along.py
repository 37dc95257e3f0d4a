"""The firmware's meter run along a log on this Python, block by block.

It is replay_engine.py's loop, faster: what does not depend on the past is computed by numpy, for a block at once. The
filter is the firmware's own, sample by sample. A test holds both loops equal.
"""

from collections.abc import Iterator

import numpy as np
from kickstand.lean.meter import LeanMeter

from ..calibration.file import CalibrationFile
from ..logs.block import Block
from ..logs.table import Array
from .formula import formula_lean_deg, static_lean_deg
from .replay_engine import NOT_SHOWN, ReplayMeter


class MeterAlong:
    """columns() or after_each() takes a ride's blocks one after the other."""

    def __init__(self, calibration: CalibrationFile) -> None:
        self._meter = ReplayMeter(calibration.to_firmware(), delay_s=calibration.delay_s())
        self._last_us: int | None = None

    def in_vehicle(self, block: Block) -> tuple[list[Array], list[Array]]:
        """Force (g) and rate (rad/s) along left, up, forward: three arrays of n each."""
        force, rate = [np.zeros(0)] * 3, [np.zeros(0)] * 3
        self._meter.in_vehicle(block.readings.T, force, rate)
        return force, rate

    def after_each(self, block: Block, force: list[Array], rate: list[Array]) -> Iterator[LeanMeter]:
        """The meter after each sample of the block. force, rate: from in_vehicle()."""
        if not len(block.time_us):
            return
        meter = self._meter
        first_us = int(block.time_us[0]) if self._last_us is None else self._last_us
        steps_us, self._last_us = np.diff(block.time_us, prepend=first_us), int(block.time_us[-1])
        # Tuples that live for a sample: of lists of lists Python's garbage collector would keep account.
        forces, rates = (zip(*(axis.tolist() for axis in vector)) for vector in (force, rate))
        for forces_g, rates_radps, step_us, speed in zip(forces, rates, steps_us.tolist(), block.speed_mps.tolist()):
            if speed >= 0.0:  # NaN is not
                meter.measure_speed(speed)
            meter.follow(forces_g, rates_radps, step_us)
            yield meter

    def columns(self, block: Block) -> Array:
        """(n, replay_engine.COLUMNS): what Replay.step() returns for the samples of the block."""
        force, rate = self.in_vehicle(block)
        leans, variances = [], []
        for meter in self.after_each(block, force, rate):
            leans.append(meter.lean_deg)
            variances.append(meter.filter.variance if meter.trusted else -1.0)
        variance = np.array(variances)
        return np.column_stack(
            (
                leans,
                formula_lean_deg(force[0], force[1], rate[1]),
                *force,
                static_lean_deg(force[0], force[1]),
                np.degrees(rate[1]),
                np.degrees(rate[2]),
                np.where(variance >= 0.0, np.degrees(np.sqrt(np.maximum(variance, 0.0))), NOT_SHOWN),
            )
        )
