"""Writes a simulated fleet: logs, MANIFEST.csv and TRUTH.csv.

TRUTH.csv lists the results that `kickstand fleet` must find.
"""

import gzip
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from kickstand_tools.common.messages import InputError, cause
from kickstand_tools.common.output import check_directory, make_directory, whole_file
from kickstand_tools.logs.csv_text import write_table
from kickstand_tools.logs.log import Log
from kickstand_tools.signals import Array, rotation_matrix

from .drive import HANDLING, Receiver, drive_log, random_route, random_sensor

# The share of the fleet with each fault of the vehicle or of its logs. The other vehicles have no fault
TROUBLES = {
    "moved-between": 0.06,  # the mount was turned between two logs
    "moved-within": 0.06,  # the mount was turned during a log
    "late": 0.03,  # the speed is 2.6 s late
    "dead": 0.03,  # the logs contain no speed
    "dies": 0.02,  # the receiver fails during the second log
    "km/h": 0.03,
    "circles": 0.02,  # the vehicle drives in circles, so it never brakes in a straight line
    "garbage": 0.02,  # the first log is not text
    "empty": 0.02,  # the first log is an empty file
    "cut": 0.02,  # the end of the first log is missing
    "missing": 0.02,  # the first log does not exist
}
# Faults that make an alignment impossible, each with the codes of the refusals that are correct for this fault
_REASONS = {
    "moved-between": "mount-moved",
    "moved-within": "mount-moved",
    "late": "speed-late speed-unit",
    "dead": "no-speed",
    "km/h": "speed-unit",
    "circles": "few-events parts-differ uncertain",
}
_LEAST_TURN_DEG, _LARGEST_TURN_DEG = 5.0, 40.0
_DAY_S, _START_UTC_S = 86_400.0, 1_790_000_000.0  # in September 2026
_COLUMNS = ("vehicle", "kind", "trouble", "status", "reasons", "moved_deg", "moved_log", "moved_s")
MATRIX = tuple(f"{row}_{axis}" for row in ("left", "up", "forward") for axis in "xyz")


@dataclass
class MadeVehicle:
    name: str  # name of the vehicle in the manifest
    kind: str  # "car", "bus" or "motorcycle"
    trouble: str  # the vehicle's fault, a key of TROUBLES, or ""
    paths: list[Path]  # paths of the logs
    # Rotation of each mounting, shape (3, 3), as in VehicleSensor. There are two mountings if the mount moved.
    mounts: list[Array]
    moved_deg: float = 0.0  # angle by which the mount moved
    moved_log: int | None = None  # index of the log in which the mount moved, or of the first log after it moved
    moved_s: float = float("nan")  # time in that log at which the mount moved. NaN if it moved before that log.

    @property
    def reasons(self) -> str:
        """The correct codes of a refusal, separated by spaces. "" if the fleet command must align the vehicle."""
        return _REASONS.get(self.trouble, "")


def make_fleet(
    out: Path | str,
    vehicles: int,
    seed: int = 0,
    seconds: float = 240.0,
    rate_hz: float = 50.0,
    troubles: list[str] | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> list[MadeVehicle]:
    """Simulate a fleet, and write drives/*.csv.gz, MANIFEST.csv and TRUTH.csv to a directory.

    One third of the vehicles are cars, one third buses, and one third motorcycles. Each vehicle has one to three
    drives. The same seed always gives the same fleet.

    seconds: Approximate duration of each drive.
    rate_hz: Samples per second.
    troubles: The fault of each vehicle, a key of TROUBLES, or "". None draws faults with the shares of TROUBLES.
    progress: Function that is called with the number of finished vehicles and the number of all.

    Raises InputError if the directory cannot be written.
    """
    directory = Path(out)
    check_directory(directory)
    if troubles is None:
        troubles = _shares(np.random.default_rng([seed, 1]), vehicles)
    fleet = []
    try:
        make_directory(directory / "drives")
        for k, trouble in enumerate(troubles):
            vehicle = _vehicle(np.random.default_rng([seed, 2, k]), directory / "drives", k, trouble, seconds, rate_hz)
            fleet.append(vehicle)
            if progress:
                progress(k + 1, len(troubles))
        kinds = {"motorcycle": "motorcycle", "car": "car", "bus": "car"}  # a manifest has no kind "bus"
        rows = [(v.name, path.relative_to(directory), kinds[v.kind]) for v in fleet for path in v.paths]
        write_table(directory / "MANIFEST.csv", ("vehicle", "path", "kind"), rows)
        write_table(directory / "TRUTH.csv", (*_COLUMNS, *MATRIX), map(_truth, fleet))
    except OSError as error:
        raise InputError(f"{directory} cannot be written: {cause(error)}") from error
    return fleet


def _shares(chance: np.random.Generator, vehicles: int) -> list[str]:
    troubles = [name for name, share in TROUBLES.items() for _ in range(round(share * vehicles))]
    troubles = (troubles + [""] * vehicles)[:vehicles]
    return [troubles[k] for k in chance.permutation(vehicles)]


def _vehicle(
    chance: np.random.Generator, directory: Path, k: int, trouble: str, seconds: float, rate_hz: float
) -> MadeVehicle:
    """Simulate vehicle k and write its logs. trouble: its fault, a key of TROUBLES, or "". seconds: of a drive."""
    kind = ("car", "bus", "motorcycle")[k % 3]
    name = f"{kind}-{k:04d}"
    has_several_drives = trouble in ("moved-between", "dies") or (trouble in ("", "garbage", "empty", "missing"))
    drives = int(chance.integers(2, 4)) if has_several_drives and (trouble or chance.random() < 0.5) else 1
    sensor = random_sensor(chance)
    receiver = Receiver(float(chance.choice([0.2, 0.5, 1.0])), float(chance.uniform(0.0, 1.2)))
    faults = {"late": {"late_s": 2.6}, "dead": {"until_s": -1.0}, "km/h": {"factor": 3.6}}
    receiver = replace(receiver, **faults.get(trouble, {}))
    suffix = ".csv" if k % 5 == 0 else ".csv.gz"
    vehicle = MadeVehicle(name, kind, trouble, [], [sensor.mount])
    if trouble.startswith("moved"):
        vehicle.moved_deg = float(np.exp(chance.uniform(np.log(_LEAST_TURN_DEG), np.log(_LARGEST_TURN_DEG))))
        vehicle.mounts.append(_turn(chance, vehicle.moved_deg) @ sensor.mount)
        vehicle.moved_log = int(chance.integers(1, drives)) if trouble == "moved-between" else 0
    first_utc_s = _START_UTC_S + _DAY_S * float(chance.integers(0, 60))
    for drive in range(drives):
        route = random_route(chance, HANDLING[kind], seconds * chance.uniform(0.85, 1.2), rate_hz, trouble != "circles")
        moved = None
        if trouble == "moved-between":
            sensor.mount = vehicle.mounts[drive >= (vehicle.moved_log or 0)]
        elif trouble == "moved-within":
            vehicle.moved_s = round(float(route.time[-1] * chance.uniform(0.4, 0.6)), 1)
            moved = vehicle.moved_s, vehicle.mounts[1]
        if trouble == "dies":
            receiver.until_s = float("inf") if drive == 0 else 60.0
        broken = trouble if drive == 0 and trouble in ("garbage", "empty", "cut", "missing") else ""
        start_s = first_utc_s + drive * _DAY_S * chance.uniform(0.1, 1.5)
        vehicle.paths.append(directory / f"{name}-{drive + 1}{suffix}")
        _write(vehicle.paths[-1], drive_log(chance, kind, route, sensor, receiver, start_s, moved), broken)
    return vehicle


def _turn(chance: np.random.Generator, degrees: float) -> Array:
    axis = chance.standard_normal(3)
    return rotation_matrix(np.radians(degrees) * axis / np.linalg.norm(axis))


def _write(path: Path, log: Log, broken: str) -> None:
    """Write a log to a file. broken: the fault of the file, a key of TROUBLES, or ""."""
    content = log_bytes(log)
    if path.suffix == ".gz":
        content = gzip.compress(content, 1, mtime=0)
    if broken == "missing":
        path.unlink(missing_ok=True)
        return
    if broken == "empty":
        content = b""
    elif broken == "garbage":
        content = bytes(range(128, 256)) * 20
    elif broken == "cut":
        content = content[: len(content) * 9 // 10]
    with whole_file(path) as temporary:
        temporary.write_bytes(content)


def log_bytes(log: Log) -> bytes:
    """Return a log as CSV."""
    import pyarrow  # imported here, because it is slow to import
    from pyarrow import csv

    values = [log.t_s.round(3), *log.accel_g.T.round(5), *log.gyro_dps.T.round(4)]
    names = ["t_s", "ax_g", "ay_g", "az_g", "gx_dps", "gy_dps", "gz_dps"]
    columns = [pyarrow.array(column) for column in values]
    for name in ("speed_mps", "utc_s"):
        names.append(name)
        columns.append(pyarrow.array(getattr(log, name), from_pandas=True))
    sink = pyarrow.BufferOutputStream()
    csv.write_csv(pyarrow.table(columns, names=names), sink, csv.WriteOptions(quoting_style="none"))
    return sink.getvalue().to_pybytes()


def _truth(vehicle: MadeVehicle) -> list[object]:
    return [
        vehicle.name,
        vehicle.kind,
        vehicle.trouble,
        "refused" if vehicle.reasons else "aligned",
        vehicle.reasons,
        round(vehicle.moved_deg, 3),
        "" if vehicle.moved_log is None else vehicle.moved_log,
        "" if np.isnan(vehicle.moved_s) else vehicle.moved_s,
        *(round(float(value), 6) for value in vehicle.mounts[-1].ravel()),
    ]
