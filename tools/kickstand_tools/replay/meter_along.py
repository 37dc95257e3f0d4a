"""Replays parts of a log on this Python, and computes Nicolae's formula on arrays.

numpy computes all values that do not depend on earlier samples, for a whole part at once. So a log of an hour at 200
Hz takes 4.0 s instead of 7.2 s with Replay.step(). A test compares the results of this module with those of
Replay.step().
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np
from kickstand.lean.meter import LeanMeter

from ..calibration.file import CalibrationFile
from ..common.messages import Message, Remedy, is_explained, kind
from ..logs.log import Log
from ..signals import Array, Bools
from .replay_engine import NOT_SHOWN, ODD, Replay

# Smallest square of a force, in g^2, that has a direction, as in kickstand.lean. In free fall the force is smaller
TOO_SMALL = 0.01


class MeterAlong(Replay):
    """A Replay of parts of a log. Pass all parts in order to columns() or to after_each()."""

    def __init__(self, calibration: CalibrationFile) -> None:
        super().__init__(calibration.to_firmware(), delay_s=calibration.delay_s())

    def in_vehicle(self, log: Log) -> tuple[list[Array], list[Array]]:
        """Return force in g and rate in rad/s along left, up and forward. Each is a list of three arrays, shape (n)."""
        force, rate = [np.zeros(0)] * 3, [np.zeros(0)] * 3
        self.meter.in_vehicle(log.readings.T, force, rate)
        return force, rate

    def after_each(self, log: Log, force: list[Array], rate: list[Array]) -> Iterator[LeanMeter]:
        """Yield the meter, always the same object, after each sample of a part. force, rate: from in_vehicle()."""
        # Use the tuples of zip(), not lists of lists: they save time in Python's garbage collector
        forces, rates = (zip(*(axis.tolist() for axis in vector)) for vector in (force, rate))
        return self.follow(zip(log.time_us.tolist(), forces, rates, log.speed_mps.tolist()))

    def columns(self, log: Log) -> Array:
        """Return the results of Replay.step() for all samples of a part, one column per replay_engine.COLUMNS."""
        force, rate = self.in_vehicle(log)
        leans, variances = [], []
        for meter in self.after_each(log, force, rate):
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


ReadingsMisfit = kind(
    "readings-misfit",
    "seconds first_s",  # total duration of the meter's reports, time of the first one
    "the readings repeatedly contradict each other, first at {first_s:.0f} s, {seconds:.0f} s in all; the board shows "
    "no lean there",
    Remedy("is the sensor's mount loose, or the sensor faulty?"),
)


@dataclass
class Misfit:
    """Adds up the time in which the meter reports contradicting readings.

    first_s: Time of the first report.
    seconds: Total duration of the reports.
    """

    first_s: float = 0.0
    seconds: float = 0.0

    def add(self, t_s: Array, odd: Bools) -> None:
        """Add a part of the ride.

        t_s: Time of each sample, shape (n).
        odd: True for samples at which the meter reports contradicting readings, shape (n).
        """
        if np.any(odd):
            self.first_s = self.first_s if self.seconds else float(t_s[np.argmax(odd)])
            self.seconds += float(np.sum(np.diff(t_s, prepend=t_s[0])[odd])) or 1e-6

    def remarks(self, notices: Iterable[Message]) -> list[Message]:
        """Return the notice about contradicting readings. The list is empty if one of the notices explains the
        readings."""
        if not self.seconds or is_explained(notices):
            return []
        return [ReadingsMisfit(self.seconds, self.first_s)]


def static_lean_deg(left: Array, up: Array) -> Array:
    """Compute the lean of a standing bike by Nicolae's equation (21), in degrees; positive to the right."""
    return np.degrees(np.arctan2(left, up))


def formula_lean_deg(left: Array, up: Array, yaw_rate: Array) -> Array:
    """Compute the lean from each single reading by Nicolae's equations (25) and (26).

    The lean is in degrees, positive to the right. kickstand.lean.bike_model does the same for one reading.
    """
    square = left * left + up * up
    size = np.sqrt(np.maximum(0.0, square - 1.0))
    sine = (left - np.sign(yaw_rate) * size * up) / np.maximum(square, TOO_SMALL)
    return np.where(square < TOO_SMALL, 0.0, np.degrees(np.arcsin(np.clip(sine, -1.0, 1.0))))
