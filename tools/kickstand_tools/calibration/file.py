"""Reads and writes CAL.json: a calibration."""

import json
import math
import os
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO, Any

import numpy as np
from kickstand.calibration.parameters import (
    MAX_GYRO_SIGMA,
    MAX_MATRIX_ERROR,
    MAX_OFFSET_G,
    MAX_SLOPE,
    MIN_SLOPE,
    Calibration,
)
from kickstand.calibration.store import MAX_BIAS_DPS, MAX_TRIM_DEG, is_rotation
from kickstand.lean.lean_filter import DELAY_S
from kickstand.units import AXES

from ..common.messages import InputError, Remedy, cause
from ..common.output import whole_file
from ..logs.source import File, log_stem, name_of, open_input
from ..signals import Array, rotated

VERSION = 1
MOST_BYTES = 1_000_000  # largest accepted file; Kickstand's own files are a thousand times smaller
MAX_DELAY_S = 0.05  # largest accepted delay of a chip's low-pass filter; the slowest filter has 33 ms
_NEUTRAL = {"accel_matrix": np.eye(3), "gyro_matrix": np.eye(3), "gyro_sigma": np.zeros((3, 3))}
_MATRICES = tuple(_NEUTRAL)  # names in the order of the firmware's Calibration.matrices()
# Largest error of a rotation matrix. A matrix that was copied with three or four decimals is accepted, because it is
# exact to 0.1 degrees.
ROTATION_TOLERANCE = 2e-3

BY_RIDE = "remove the calibration and let the ride show how the sensor sits"
ALIGN = Remedy("kickstand calibrate two, or calibrate ride, first", BY_RIDE)
GIVE_CALIBRATION = Remedy("give a file made by kickstand calibrate", "give the .cal.json of the ride")


@dataclass(eq=False)
class CalibrationFile:
    """The parameters of one mounted sensor.

        force = accel_matrix x (accel_slope * reading + accel_offset_g)       Nicolae's (18)-(20)
        rate = gyro_matrix x (reading - gyro_bias_dps)

    accel_offset_g, accel_slope: offset and slope of the accelerometer's axes, shape (3).
    gyro_bias_dps: bias of the gyro's axes, shape (3).
    vehicle_from_sensor: shape (3, 3). The rows are left, up and forward.
    aligned: True if vehicle_from_sensor was measured.
    six_done: True if offset and slope were measured.
    notes: further entries for the file.
    trim_deg: correction of the roll misalignment, found while riding.
    vehicle: "car" or "motorcycle" if vehicle_from_sensor was measured by driving. Also "car" if the board was set to a
        car. Otherwise "".
    kickstand_side: side of the kickstand in the two poses, "left" or "right"; otherwise "".
    gyro_delay_s: delay of the gyro by its low-pass filter (DLPF) in a recorded ride; None if unknown.
    accel_matrix, gyro_matrix: cross-axis corrections, shape (3, 3).
    gyro_sigma: standard errors of gyro_matrix, shape (3, 3); zeros if it was not measured.

    >>> calibration = CalibrationFile(gyro_bias_dps=[1.0, 0.0, 0.0])
    >>> calibration.vehicle_from_sensor @ [0.0, 1.0, 0.0]
    array([0., 1., 0.])
    """

    accel_offset_g: Array = field(default_factory=lambda: np.zeros(3))
    accel_slope: Array = field(default_factory=lambda: np.ones(3))
    gyro_bias_dps: Array = field(default_factory=lambda: np.zeros(3))
    vehicle_from_sensor: Array = field(default_factory=lambda: np.eye(3))
    aligned: bool = False
    six_done: bool = False
    notes: dict[str, Any] = field(default_factory=dict)
    trim_deg: float = 0.0
    vehicle: str = ""
    kickstand_side: str = ""
    gyro_delay_s: float | None = None
    accel_matrix: Array = field(default_factory=lambda: np.eye(3))
    gyro_matrix: Array = field(default_factory=lambda: np.eye(3))
    gyro_sigma: Array = field(default_factory=lambda: np.zeros((3, 3)))

    def __post_init__(self) -> None:
        self.accel_offset_g, self.accel_slope, self.gyro_bias_dps = (
            np.array(values, dtype=float) for values in (self.accel_offset_g, self.accel_slope, self.gyro_bias_dps)
        )
        for name in ("vehicle_from_sensor", *_MATRICES):
            setattr(self, name, np.reshape(np.array(getattr(self, name), dtype=float), (3, 3)))

    def __eq__(self, other: object) -> bool:
        """True if both calibrations would be written to equal files."""
        return isinstance(other, CalibrationFile) and self.as_json() == other.as_json()

    def parameters(self) -> list[float]:
        """Return the 19 numbers of the firmware's Calibration.parameters()."""
        measured = self.accel_offset_g, self.accel_slope, self.gyro_bias_dps, self.vehicle_from_sensor.ravel()
        return [*np.concatenate(measured).tolist(), self.trim_deg]

    def matrices(self) -> list[float]:
        """Return the 27 numbers of the firmware's Calibration.matrices()."""
        return np.concatenate([getattr(self, name).ravel() for name in _MATRICES]).tolist()

    def to_firmware(self) -> Calibration:
        """Return the firmware's Calibration with these parameters, for readings in g and deg/s."""
        calibration = Calibration()
        calibration.set_parameters(self.parameters())
        calibration.set_matrices(self.matrices())
        calibration.six_done, calibration.aligned = self.six_done, self.aligned
        calibration.by_drive = bool(self.vehicle)
        return calibration

    def in_vehicle(self, readings: Array) -> tuple[Array, Array]:
        """Convert readings in the chip's order, shape (n, 7), to force in g and rate in deg/s along left, up and
        forward, each of shape (n, 3)."""
        force, rate = rotated(self.vehicle_from_sensor, *self.in_sensor(readings[:, :3], readings[:, 4:]))
        return force, rate

    def in_sensor(self, accel_g: Array, gyro_dps: Array) -> tuple[Array, Array]:
        """Calibrate readings with the firmware's Calibration.apply(). Returns force in g and rate in deg/s along the
        sensor's own axes, each of shape (n, 3)."""
        # The firmware's function takes the numbers of one reading. With arrays instead of numbers, the function
        # calibrates n readings.
        readings = [*accel_g.T, None, *gyro_dps.T]
        force, rate = [np.zeros(0)] * 3, [np.zeros(0)] * 3
        self.to_firmware().apply(readings, force, rate)
        return np.column_stack(force), np.column_stack(rate)

    def gyro_sigma_in_vehicle(self) -> Array:
        """Return gyro_sigma along left, up and forward, shape (3, 3). The errors of its entries are independent."""
        squared = self.vehicle_from_sensor**2
        return np.sqrt(squared @ self.gyro_sigma**2 @ squared.T)

    def delay_s(self) -> float:
        """Return gyro_delay_s or, if it is unknown, the delay of the default DLPF setting."""
        return DELAY_S if self.gyro_delay_s is None else self.gyro_delay_s

    def as_json(self) -> dict[str, Any]:
        """Return the content of a CAL.json, as plain numbers and lists."""
        data = {
            "version": VERSION,
            "accel_offset_g": _rounded(self.accel_offset_g),
            "accel_slope": _rounded(self.accel_slope),
            "gyro_bias_dps": _rounded(self.gyro_bias_dps),
            "vehicle_from_sensor": [_rounded(row) for row in self.vehicle_from_sensor],
            "six_positions": self.six_done,
            "aligned": self.aligned,
            "trim_deg": _rounded([self.trim_deg])[0],
        }
        data |= {"vehicle": self.vehicle} if self.vehicle else {}
        data |= {"kickstand_side": self.kickstand_side} if self.kickstand_side else {}
        data |= {"gyro_delay_s": self.gyro_delay_s} if self.gyro_delay_s is not None else {}
        for name in _MATRICES:
            matrix = getattr(self, name)
            if not np.array_equal(matrix, _NEUTRAL[name]):
                data[name] = [_rounded(row) for row in matrix]
        return data | self.notes


def read_calibration(source: File) -> CalibrationFile:
    """Read and check a CAL.json, a path or an open file. Raises InputError that names the file.

    >>> import io
    >>> file = io.StringIO()
    >>> write_calibration(file, CalibrationFile(accel_offset_g=[0.01, -0.02, 0.03]))
    >>> _ = file.seek(0)
    >>> read_calibration(file).accel_offset_g
    array([ 0.01, -0.02,  0.03])
    """
    name = name_of(source)
    data = _json_object(name, source)
    if "version" not in data:
        raise InputError(f"{name} is no calibration: version is missing", GIVE_CALIBRATION)
    if data["version"] != VERSION or isinstance(data["version"], bool):
        raise InputError(f"{name}: version {_shown(data['version'])}, this program reads {VERSION}: calibrate again")
    offset, slope, bias = (
        np.array(_numbers(name, entry, _list(name, data, entry)))
        for entry in ("accel_offset_g", "accel_slope", "gyro_bias_dps")
    )
    matrix = _matrix(name, data, "vehicle_from_sensor")
    calibration = CalibrationFile(offset, slope, bias, matrix, trim_deg=_within(name, data, "trim_deg", MAX_TRIM_DEG))
    if "gyro_delay_s" in data:
        calibration.gyro_delay_s = _within(name, data, "gyro_delay_s", MAX_DELAY_S)
    for entry in _MATRICES:
        if entry in data:
            setattr(calibration, entry, _matrix(name, data, entry))
    _check_ranges(name, calibration)
    calibration.aligned = data.get("aligned", not np.array_equal(matrix, np.eye(3))) is True
    neutral = not np.any(calibration.accel_offset_g) and bool(np.all(calibration.accel_slope == 1.0))
    calibration.six_done = data.get("six_positions", not neutral) is True
    calibration.vehicle = _one_of(name, data, "vehicle", ("car", "motorcycle"))
    calibration.kickstand_side = _one_of(name, data, "kickstand_side", ("left", "right"))
    return calibration


def _json_object(name: str, source: File) -> dict[str, Any]:
    """Read the object in a JSON file. Raises InputError."""
    try:
        if isinstance(source, (Path, str)):
            if not Path(source).exists():
                raise InputError(f"{name}: there is no such file: make it with kickstand calibrate")
            with open_input(source) as file:
                content = file.read(MOST_BYTES + 1)
        else:
            content = source.read(MOST_BYTES + 1)
        if len(content) > MOST_BYTES:
            raise InputError(f"{name} is too large for a calibration, which has under 1 MB", GIVE_CALIBRATION)
        data = json.loads(content if isinstance(content, str) else content.decode("utf-8-sig"))
    except OSError as error:
        raise InputError(f"{name} cannot be read: {cause(error)}") from error
    except (ValueError, RecursionError) as error:
        raise InputError(f"{name} is not JSON", GIVE_CALIBRATION) from error
    if not isinstance(data, dict):
        raise InputError(f"{name} is no calibration", GIVE_CALIBRATION)
    return data


def _one_of(name: str, data: dict[str, Any], entry: str, words: tuple[str, str]) -> str:
    """The value of an entry, "" if it is missing. Raises InputError for other values than `words`."""
    if data.get(entry) in (None, ""):
        return ""
    if data[entry] not in words:
        raise InputError(f"{name}: {entry} is {_shown(data[entry])}: write {' or '.join(words)}, or leave it out")
    return data[entry]


def write_calibration(target: Path | str | IO[str], calibration: CalibrationFile) -> None:
    """Write a CAL.json. Raises InputError.

    target: a path, or a file open for text. The file of a path is written whole or not at all.

    >>> import sys
    >>> write_calibration(sys.stdout, CalibrationFile())  # doctest: +ELLIPSIS
    {
      "version": 1,
      "accel_offset_g": [
    ...
    """
    text = json.dumps(calibration.as_json(), indent=2) + "\n"
    if not isinstance(target, (Path, str)):
        target.write(text)
        return
    with whole_file(Path(target)) as temporary:
        temporary.write_text(text, encoding="ascii", newline="\n")


def calibration_path(log: Path) -> Path:
    """Return the path of a ride's calibration: NAME.cal.json beside NAME.csv, NAME.csv.gz or another app's export."""
    if log.name in ("", ".."):  # the log is the current folder or its parent, so use the file beside this folder
        log = Path(os.path.abspath(log))
    return log.parent / f"{log_stem(log.name)}.cal.json"


def _list(name: str, data: dict[str, Any], entry: str) -> list[Any]:
    if entry not in data:
        raise InputError(f"{name}: {entry} is missing", GIVE_CALIBRATION)
    if not isinstance(data[entry], list) or len(data[entry]) != 3:
        form = "3 rows of 3 numbers" if entry in ("vehicle_from_sensor", *_MATRICES) else "3 numbers"
        raise InputError(f"{name}: {entry} must be {form}: calibrate again")
    return data[entry]


def _matrix(name: str, data: dict[str, Any], entry: str) -> Array:
    rows = _list(name, data, entry)
    return np.array([_numbers(name, f"{entry}, row {i + 1},", row) for i, row in enumerate(rows)])


def _numbers(name: str, entry: str, values: Any) -> list[float]:
    """The three finite floats of an entry. Raises InputError for other values."""
    if not isinstance(values, list) or len(values) != 3:
        raise InputError(f"{name}: {entry} must be 3 numbers: calibrate again")
    for value in values:
        if isinstance(value, bool) or not isinstance(value, (int, float)) or not abs(value) < 1e6:
            raise InputError(f"{name}: {entry} has {_shown(value)} where a number should be: calibrate again")
    return [float(value) for value in values]


def _within(name: str, data: dict[str, Any], entry: str, limit: float) -> float:
    """The number of an entry, 0 if it is missing. Raises InputError if it is not within +-limit."""
    value = data.get(entry, 0.0)
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not abs(value) <= limit:
        raise InputError(f"{name}: {entry} is {_shown(value)}, it is at most {limit:g}: calibrate again")
    return float(value)


def _check_ranges(name: str, calibration: CalibrationFile) -> None:
    """Raise InputError if a value is impossible for a sensor, or if the alignment is not a rotation."""
    measured = calibration.accel_offset_g.tolist(), calibration.accel_slope.tolist(), calibration.gyro_bias_dps.tolist()
    for axis, offset, slope, bias in zip(AXES, *measured, strict=True):
        wrong = ""
        if not abs(offset) < MAX_OFFSET_G:
            wrong = f"offset of {axis} is {offset:g} g, a sensor's is under {MAX_OFFSET_G:g}"
        elif not MIN_SLOPE < slope < MAX_SLOPE:
            wrong = f"slope of {axis} is {slope:g}, a sensor's is {MIN_SLOPE:g} to {MAX_SLOPE:g}"
        elif not abs(bias) < MAX_BIAS_DPS:
            wrong = f"gyro bias of {axis} is {bias:g} deg/s, a sensor's is under {MAX_BIAS_DPS:g}"
        if wrong:
            raise InputError(f"{name}: {wrong}: calibrate again")
    for entry in ("accel_matrix", "gyro_matrix"):
        worst = float(np.max(np.abs(getattr(calibration, entry) - np.eye(3))))
        if not worst <= MAX_MATRIX_ERROR:
            excess = f"{entry} is {worst:g} from the identity, a sensor's is within {MAX_MATRIX_ERROR:g}"
            raise InputError(f"{name}: {excess}: calibrate again")
    if not (np.all(calibration.gyro_sigma >= 0.0) and np.all(calibration.gyro_sigma <= MAX_GYRO_SIGMA)):
        raise InputError(f"{name}: gyro_sigma must be 0 to {MAX_GYRO_SIGMA:g}: calibrate again")
    if not is_rotation(calibration.vehicle_from_sensor.ravel().tolist(), ROTATION_TOLERANCE):
        raise InputError(f"{name}: vehicle_from_sensor is no rotation (rows left, up, forward): align again")


def _rounded(values: Any) -> list[float]:
    """Round values to nine significant digits. The firmware's 32-bit floats do not hold more."""
    return [float(f"{value:.9g}") for value in values]


def _shown(value: Any) -> str:
    if isinstance(value, float) and not math.isfinite(value):
        return str(value)
    text = ascii(value)
    return text if len(text) <= 20 else text[:20] + "..."
