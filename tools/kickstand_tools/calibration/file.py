"""CAL.json: a calibration as the command line reads and writes it."""

import json
import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from kickstand.calibration.parameters import MAX_OFFSET_G, MAX_SLOPE, MIN_SLOPE, Calibration
from kickstand.calibration.store import MAX_BIAS_DPS, MAX_TRIM_DEG
from kickstand.rotation import is_rotation

from ..errors import InputError, cause
from ..output import write_whole

VERSION = 1
ROTATION_TOLERANCE = 2e-3  # a matrix copied with three or four decimals is still good to 0.1 degrees
_IDENTITY = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]


@dataclass
class CalibrationFile:
    """The parameters of one mounted sensor: calibrated = slope * reading + offset, Nicolae's (18)-(20).

    offset (3, g), slope (3), bias (3, deg/s), matrix (9, row-major, rows left, up, forward).
    aligned: the matrix was measured, not left as it was.  vehicle: "car" or "motorcycle" if it was measured by driving,
    else "".  notes: what else stands in the file.  trim: degrees that the upright of the alignment was found to be off.
    side: "left" or "right", where the kickstand leaned to, or "".
    """

    offset: list[float] = field(default_factory=lambda: [0.0] * 3)
    slope: list[float] = field(default_factory=lambda: [1.0] * 3)
    bias: list[float] = field(default_factory=lambda: [0.0] * 3)
    matrix: list[float] = field(default_factory=lambda: list(_IDENTITY))
    aligned: bool = False
    six_done: bool = False
    notes: dict[str, Any] = field(default_factory=dict)
    trim: float = 0.0
    vehicle: str = ""
    side: str = ""

    def parameters(self) -> list[float]:
        """As Calibration.parameters()."""
        return [*self.offset, *self.slope, *self.bias, *self.matrix, self.trim]

    def to_firmware(self) -> Calibration:
        """The same as the firmware's own object, for readings in g and deg/s."""
        calibration = Calibration()
        calibration.set_parameters(self.parameters())
        calibration.six_done, calibration.aligned = self.six_done, self.aligned
        return calibration


def read_calibration(path: Path) -> CalibrationFile:
    """Read and check a CAL.json. Raises InputError."""
    try:
        data = json.loads(path.read_text(encoding="utf-8-sig"))
    except FileNotFoundError as error:
        raise InputError(f"{path}: there is no such file: make it with kickstand calibrate") from error
    except OSError as error:
        raise InputError(f"{path} cannot be read: {cause(error)}") from error
    except (ValueError, RecursionError) as error:
        raise InputError(f"{path} is not JSON: give a file made by kickstand calibrate") from error
    if not isinstance(data, dict):
        raise InputError(f"{path} is no calibration: give a file made by kickstand calibrate")
    if "version" not in data:
        raise InputError(f"{path}: version is missing: give a file made by kickstand calibrate")
    if data["version"] != VERSION or isinstance(data["version"], bool):
        raise InputError(
            f"{path}: version {_shown(data['version'])}, this program reads {VERSION}: calibrate again"
        )
    rows = _list(path, data, "vehicle_from_sensor")
    matrix = [
        v for i, row in enumerate(rows) for v in _numbers(path, f"vehicle_from_sensor, row {i + 1},", row)
    ]
    calibration = CalibrationFile(
        _numbers(path, "accel_offset_g", _list(path, data, "accel_offset_g")),
        _numbers(path, "accel_slope", _list(path, data, "accel_slope")),
        _numbers(path, "gyro_bias_dps", _list(path, data, "gyro_bias_dps")),
        matrix,
    )
    calibration.trim = _trim(path, data)
    _check_ranges(path, calibration)
    calibration.aligned = data.get("aligned", matrix != _IDENTITY) is True
    neutral = calibration.offset == [0.0] * 3 and calibration.slope == [1.0] * 3
    calibration.vehicle = data["vehicle"] if data.get("vehicle") in ("car", "motorcycle") else ""
    calibration.side = data["kickstand_side"] if data.get("kickstand_side") in ("left", "right") else ""
    calibration.six_done = data.get("six_positions", not neutral) is True
    return calibration


def write_calibration(path: Path, calibration: CalibrationFile) -> None:
    """Write a CAL.json, whole or not at all. Raises InputError."""
    m = [_rounded(v) for v in calibration.matrix]
    data = {
        "version": VERSION,
        "accel_offset_g": [_rounded(v) for v in calibration.offset],
        "accel_slope": [_rounded(v) for v in calibration.slope],
        "gyro_bias_dps": [_rounded(v) for v in calibration.bias],
        "vehicle_from_sensor": [m[0:3], m[3:6], m[6:9]],
        "six_positions": calibration.six_done,
        "aligned": calibration.aligned,
        "trim_deg": _rounded(calibration.trim),
    }
    if calibration.vehicle:
        data["vehicle"] = calibration.vehicle
    if calibration.side:
        data["kickstand_side"] = calibration.side
    text = json.dumps(data | calibration.notes, indent=2) + "\n"

    def write(temporary: Path) -> None:
        temporary.write_text(text, encoding="ascii", newline="\n")

    write_whole(path, write)


def _list(path: Path, data: dict[str, Any], name: str) -> list[Any]:
    if name not in data:
        raise InputError(f"{path}: {name} is missing: give a file made by kickstand calibrate")
    if not isinstance(data[name], list) or len(data[name]) != 3:
        what = "3 rows of 3 numbers" if name == "vehicle_from_sensor" else "3 numbers"
        raise InputError(f"{path}: {name} has to be {what}: calibrate again")
    return data[name]


def _numbers(path: Path, name: str, values: Any) -> list[float]:
    """Three finite floats."""
    if not isinstance(values, list) or len(values) != 3:
        raise InputError(f"{path}: {name} has to be 3 numbers: calibrate again")
    for value in values:
        if isinstance(value, bool) or not isinstance(value, (int, float)) or not abs(value) < 1e6:
            raise InputError(f"{path}: {name} has {_shown(value)} where a number should be: calibrate again")
    return [float(value) for value in values]


def _trim(path: Path, data: dict[str, Any]) -> float:
    """Degrees; 0 where the file says nothing."""
    value = data.get("trim_deg", 0.0)
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not abs(value) <= MAX_TRIM_DEG:
        raise InputError(
            f"{path}: trim_deg is {_shown(value)}, it is at most {MAX_TRIM_DEG:g} degrees: calibrate again"
        )
    return float(value)


def _check_ranges(path: Path, calibration: CalibrationFile) -> None:
    for i, axis in enumerate("xyz"):
        offset, slope, bias = calibration.offset[i], calibration.slope[i], calibration.bias[i]
        if not abs(offset) < MAX_OFFSET_G:
            raise InputError(
                f"{path}: offset of {axis} is {offset:g} g, a sensor's is under {MAX_OFFSET_G:g}: "
                "calibrate again"
            )
        if not MIN_SLOPE < slope < MAX_SLOPE:
            between = f"{MIN_SLOPE:g} to {MAX_SLOPE:g}"
            raise InputError(
                f"{path}: slope of {axis} is {slope:g}, a sensor's is {between}: calibrate again"
            )
        if not abs(bias) < MAX_BIAS_DPS:
            raise InputError(
                f"{path}: gyro bias of {axis} is {bias:g} deg/s, a sensor's is under {MAX_BIAS_DPS:g}: "
                "calibrate again"
            )
    if not is_rotation(calibration.matrix, ROTATION_TOLERANCE):
        raise InputError(f"{path}: vehicle_from_sensor is no rotation (rows left, up, forward): align again")


def _rounded(value: float) -> float:
    """Nine significant digits: all that the firmware's 32-bit floats hold."""
    return float(f"{value:.9g}")


def _shown(value: Any) -> str:
    if isinstance(value, float) and not math.isfinite(value):
        return str(value)
    text = ascii(value)
    return text if len(text) <= 20 else text[:20] + "..."
