"""Replays blocks of a log on this Python, and computes Nicolae's formula on arrays.

Values that do not depend on earlier samples are computed for a whole block with numpy. An hour at 200 Hz takes 4.0 s,
with Replay.step() 7.2 s. A test compares both.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np
from kickstand.lean.meter import LeanMeter

from ..calibration.file import CalibrationFile
from ..common.messages import Message, Remedy, is_explained
from ..logs.log import Block
from ..signals import Array, Bools
from .replay_engine import NOT_SHOWN, ODD, Replay

TOO_SMALL = 0.01  # g2, as in kickstand.lean: in free fall the force has no direction


class MeterAlong(Replay):
    """A Replay of whole blocks. Pass all blocks of a ride in order to columns() or to after_each()."""

    def __init__(self, calibration: CalibrationFile) -> None:
        super().__init__(calibration.to_firmware(), delay_s=calibration.delay_s())

    def in_vehicle(self, block: Block) -> tuple[list[Array], list[Array]]:
        """Force (g) and rate (rad/s) along left, up, forward: three arrays of n each."""
        force, rate = [np.zeros(0)] * 3, [np.zeros(0)] * 3
        self.meter.in_vehicle(block.readings.T, force, rate)
        return force, rate

    def after_each(self, block: Block, force: list[Array], rate: list[Array]) -> Iterator[LeanMeter]:
        """Yield the meter, always the same object, after each sample of the block. force, rate: from in_vehicle()."""
        # Tuples that live for one sample, because Python's garbage collector would track lists of lists.
        forces, rates = (zip(*(axis.tolist() for axis in vector)) for vector in (force, rate))
        return self.follow(zip(block.time_us.tolist(), forces, rates, block.speed_mps.tolist()))

    def columns(self, block: Block) -> Array:
        """(n, replay_engine.COLUMNS): what Replay.step() returns for the samples of the block."""
        force, rate = self.in_vehicle(block)
        leans, variances = [], []
        for meter in self.after_each(block, force, rate):
            leans.append(meter.lean_deg)
            variances.append(meter.filter.variance if meter.trusted else ODD if meter.odd else NOT_SHOWN)
        variance = np.array(variances)
        return np.column_stack(
            (
                leans,
                formula_lean_deg(force[0], force[1], rate[1]),
                *force,
                static_lean_deg(force[0], force[1]),
                np.degrees(rate[1]),
                np.degrees(rate[2]),
                np.where(variance >= 0.0, np.degrees(np.sqrt(np.maximum(variance, 0.0))), variance),
            )
        )


@dataclass(frozen=True)
class ReadingsMisfit(Message):
    """The meter repeatedly reported readings that contradict each other. first_s: time of the first report. seconds:
    total duration."""

    seconds: float
    first_s: float

    code = "readings-misfit"
    text = (
        "the readings repeatedly contradict each other, first at {first_s:.0f} s, {seconds:.0f} s in all; the board "
        "shows no lean there"
    )
    todo = Remedy("is the sensor's mount loose, or the sensor faulty?")


@dataclass
class Misfit:
    """Adds up the time in which the meter reports contradicting readings. first_s: time of the first report. seconds:
    total duration."""

    first_s: float = 0.0
    seconds: float = 0.0

    def add(self, t_s: Array, odd: Bools) -> None:
        """Add a part of the ride. t_s (n): times, s. odd (n): True where the meter reports contradicting readings."""
        if np.any(odd):
            self.first_s = self.first_s if self.seconds else float(t_s[np.argmax(odd)])
            self.seconds += float(np.sum(np.diff(t_s, prepend=t_s[0])[odd])) or 1e-6

    def remarks(self, known: Iterable[Message]) -> list[Message]:
        """The notice about contradicting readings. It is left out if `known` contains the reason."""
        if not self.seconds or is_explained(known):
            return []
        return [ReadingsMisfit(self.seconds, self.first_s)]


def static_lean_deg(left: Array, up: Array) -> Array:
    """The lean of a standing bike, degrees, > 0 to the right: Nicolae's equation (21) with a sign."""
    return np.degrees(np.arctan2(left, up))


def formula_lean_deg(left: Array, up: Array, yaw_rate: Array) -> Array:
    """The lean from each single reading, degrees, > 0 to the right: Nicolae's equations (25)-(26), as in
    kickstand.lean.formula."""
    square = left * left + up * up
    size = np.sqrt(np.maximum(0.0, square - 1.0))
    sine = (left - np.sign(yaw_rate) * size * up) / np.maximum(square, TOO_SMALL)
    return np.where(square < TOO_SMALL, 0.0, np.degrees(np.arcsin(np.clip(sine, -1.0, 1.0))))
