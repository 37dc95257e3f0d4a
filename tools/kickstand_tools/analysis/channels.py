"""A recorded ride as channels of the vehicle, block by block: what plot, report and export work on.

Lean is the firmware's own, step by step; all that needs no memory of the past is numpy, tested equal to it.
"""

import json
from collections.abc import Iterator
from dataclasses import dataclass, fields
from pathlib import Path

import numpy as np
from kickstand.lean.meter import FALLEN_DEG
from numpy.typing import NDArray

from ..calibration.file import CalibrationFile, read_calibration
from ..errors import InputError
from ..logs.reader import Block
from ..replay import replay_engine
from ..replay.replay import with_progress

Array = NDArray[np.float64]
_TOO_SMALL = 0.01  # g2, as in kickstand.lean: in free fall no force tells a direction


@dataclass
class Channels:
    """n samples each. Axes left, up, forward; lean > 0 to the right; NaN where there is no value.

    lateral_g: the acceleration to the left of the road's plane, (23). shown_g: forward, smoothed as on the
    display. sigma_deg: how uncertain the lean is. resting: the bike stands still (1 or 0). rolling: by how it leans and
    turns it surely does not (1 or 0). sure: the meter trusts its lean (1 or 0).
    """

    t_s: Array
    lean_deg: Array
    lean_formula_deg: Array
    left_g: Array
    up_g: Array
    forward_g: Array
    lateral_g: Array
    pitch_rate_dps: Array
    yaw_rate_dps: Array
    roll_rate_dps: Array
    speed_mps: Array
    temp_c: Array
    shown_g: Array
    sigma_deg: Array
    resting: Array
    rolling: Array
    sure: Array

    @property
    def trusted(self) -> NDArray[np.bool_]:
        """Where the display shows the lean and holds its maxima."""
        return (self.sure > 0.0) & ~(np.abs(self.lean_deg) >= FALLEN_DEG)

    def part(self, which: slice | NDArray[np.bool_]) -> "Channels":
        """Some of the samples."""
        return Channels(*(getattr(self, field.name)[which] for field in fields(self)))


@dataclass
class Ride:
    """A log and the calibration it is read with. car: one, with no lean; else a motorcycle."""

    log: Path
    calibration: CalibrationFile
    car: bool

    def blocks(self, what: str) -> Iterator[tuple[Block, Channels]]:
        """The log from its beginning, with a progress bar that says what it is for. Raises InputError."""
        lean = _Lean(self.calibration)
        for block in with_progress(self.log, what):
            yield block, channels(block, self.calibration, lean.follow(block), self.car)


def open_ride(log: Path, calibration: Path | None) -> Ride:
    """The ride in log, with the calibration given or else the file beside it. Raises InputError."""
    stem = log.name.removesuffix(".gz").removesuffix(".csv")
    beside = log.with_name(stem + ".cal.json")
    if not log.is_file():
        what = "is a directory: give the name of a ride in it" if log.is_dir() else "there is no such file"
        raise InputError(f"{log}: {what}")
    if calibration is None and not beside.exists():
        raise InputError(f"{log}: no calibration {beside.name} beside it: give one with --calibration")
    path = calibration or beside
    parameters = read_calibration(path)
    if not parameters.aligned:
        raise InputError(f"{path} is not aligned, so lean and braking are unknown: kickstand calibrate two, first")
    vehicle = json.loads(path.read_text(encoding="utf-8-sig")).get("vehicle")
    return Ride(log, parameters, vehicle == "car")


def channels(block: Block, calibration: CalibrationFile, lean: Array, car: bool = False) -> Channels:
    """Forces by Nicolae's (18)-(20) and the matrix, (25)-(26) and (23). lean: what _Lean.follow() returned.

    A car has no lean, and its lateral acceleration is the force to the left.
    """
    if car:
        lean = lean * [0.0, 1.0, 0.0, 1.0, 0.0, 1.0] + [np.nan, 0.0, 0.0, 0.0, 0.0, 0.0]
    matrix = np.reshape(calibration.matrix, (3, 3))
    force = (block.readings[:, :3] * calibration.slope + calibration.offset) @ matrix.T
    rate = (block.readings[:, 4:] - calibration.bias) @ matrix.T
    left, up, forward = force.T
    angle = np.radians(np.nan_to_num(lean[:, 0]))
    temperature = block.readings[:, 3] if block.has_temp else np.full(len(rate), np.nan)
    return Channels(
        block.time_us.astype(float) * 1e-6,
        lean[:, 0],
        np.full(len(rate), np.nan) if car else formula_lean_deg(left, up, rate[:, 1]),
        left,
        up,
        forward,
        left * np.cos(angle) - up * np.sin(angle),
        -rate[:, 0],
        rate[:, 1],
        rate[:, 2],
        block.speed_mps,
        temperature,
        lean[:, 1],
        np.degrees(np.sqrt(lean[:, 2])),
        lean[:, 3],
        lean[:, 4],
        lean[:, 5],
    )


def formula_lean_deg(left: Array, up: Array, yaw_rate: Array) -> Array:
    """kickstand.lean.formula_lean_deg on arrays."""
    square = left * left + up * up
    size = np.sqrt(np.maximum(0.0, square - 1.0))
    sine = (left - np.sign(yaw_rate) * size * up) / np.maximum(square, _TOO_SMALL)
    return np.where(square < _TOO_SMALL, 0.0, np.degrees(np.arcsin(np.clip(sine, -1.0, 1.0))))


class _Lean:
    """The firmware's meter, led along the ride."""

    def __init__(self, calibration: CalibrationFile) -> None:
        self._engine = replay_engine.Replay(calibration.to_firmware())

    def follow(self, block: Block) -> Array:
        """(n, 6): lean (degrees), forward force shown (g), variance of the lean (rad2), resting, rolling, sure."""
        take, meter = self._engine.take, self._engine.meter
        smooth = meter.smooth_force
        rows = []
        for row in block.rows():
            take(*row)
            lean = meter.filter
            rows.append((meter.lean_deg, smooth[2], lean.variance, lean.at_rest, lean.rolling, meter.trusted))
        return np.array(rows, dtype=float)
