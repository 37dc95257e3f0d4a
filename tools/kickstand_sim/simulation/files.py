"""Simulates a ride and writes it as logs."""

from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from kickstand_tools.common.messages import InputError
from kickstand_tools.common.output import check_directory, make_directory, whole_file
from kickstand_tools.logs.csv_text import COLUMNS, TRACK
from numpy.typing import NDArray

from .profiles import check_profile
from .ride import SimulatedRide, ride

_LOG = (*COLUMNS, "temp_c")
_FORMATS = ["%.3f", *["%.6f"] * 6, "%.2f"]
START = 47.6, 8.0  # start of the ride, in degrees north and east. The ride first heads east
START_UTC_S = 1_779_008_400.0  # 09:00 on 17 May 2026
_DEGREE_M = np.radians(6_371_000.0)
_TRACK_S = 1  # time between two fixes, as from a GPS receiver


def simulate(
    profile: str, seed: int, out_dir: Path | str, seconds: float = 640.0, *, speed: bool = False, **conditions: Any
) -> SimulatedRide:
    """Simulate a ride and write it to a directory.

    The files are POSE_1.csv to POSE_7.csv (each side up once, then a slanted pose), SIX.csv (seven poses in one log,
    with the turns between them), KICKSTAND.csv and UPRIGHT.csv (the poses of the bike), RIDE.csv, and TRUTH.csv with
    one row per row of RIDE.csv. An old RIDE.cal.json in the directory is removed.

    seconds: Exact length of RIDE.csv.
    speed: True to add a speed and a position to RIDE.csv once per second.
    profile, seed, conditions: Arguments of ride.ride().

    Raises InputError if the profile is unknown or the directory cannot be written.
    """
    check_profile(profile)
    directory = Path(out_dir)
    check_directory(directory)
    simulated = _cut(ride(profile, seed, seconds, exact=True, **conditions), seconds)
    try:
        make_directory(directory)
        # An old calibration belongs to another sensor, but report, plot and export would use it for this ride
        (directory / "RIDE.cal.json").unlink(missing_ok=True)
        write_poses(directory, simulated)
        _write_readings(directory / "SIX.csv", simulated.procedure, simulated.rate_hz)
        write_ride(directory / "RIDE.csv", simulated, speed)
        names, formats = ("t_s", *simulated.truth, "phase"), ["%.3f", *["%.4f"] * len(simulated.truth)]
        table = np.column_stack((simulated.time, *simulated.truth.values()))
        _write(directory / "TRUTH.csv", names, formats, table, simulated.phase.tolist())
    except OSError as error:
        raise InputError(f"{directory} cannot be written: {error.strerror}") from error
    return simulated


def _cut(simulated: SimulatedRide, seconds: float) -> SimulatedRide:
    n = min(len(simulated.time), round(seconds * simulated.rate_hz))
    truth = {name: values[:n] for name, values in simulated.truth.items()}
    return replace(
        simulated, time=simulated.time[:n], readings=simulated.readings[:n], truth=truth, phase=simulated.phase[:n]
    )


def write_poses(directory: Path, simulated: SimulatedRide) -> tuple[list[Path], Path, Path]:
    """Write the seven poses, the kickstand pose and the upright pose. Returns their paths in this order."""
    seven = [directory / f"POSE_{k}.csv" for k in range(1, 8)]
    pair = directory / "KICKSTAND.csv", directory / "UPRIGHT.csv"
    for path, readings in zip([*seven, *pair], [*simulated.poses, simulated.kickstand, simulated.upright]):
        _write_readings(path, readings, simulated.rate_hz)
    return seven, *pair


def _write_readings(path: Path, readings: NDArray, rate_hz: float) -> None:
    _write(path, _LOG, _FORMATS, _log(np.arange(len(readings)) / rate_hz, readings))


def positions(simulated: SimulatedRide) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Integrate speed and yaw rate. Returns latitude, longitude in degrees, and Universal Time in s, shape (n) each."""
    # The course in rad from east, positive to the left
    course = np.cumsum(np.radians(simulated.truth["yaw_rate_dps"])) / simulated.rate_hz
    speed = simulated.truth["speed_mps"] / simulated.rate_hz
    lat = START[0] + np.cumsum(speed * np.sin(course)) / _DEGREE_M
    lon = START[1] + np.cumsum(speed * np.cos(course)) / (_DEGREE_M * np.cos(np.radians(START[0])))
    return lat, lon, START_UTC_S + simulated.time


def _log(time: NDArray, readings: NDArray) -> NDArray:
    return np.column_stack((time, readings[:, :3], readings[:, 4:], readings[:, 3]))


def _write(path: Path, names: Iterable[str], formats: list[str], table: NDArray, *texts: list[str]) -> None:
    """Write a CSV file with the columns of the table, followed by one column per list of texts."""
    form = ",".join(formats)
    with whole_file(path) as temporary, temporary.open("w", encoding="ascii") as file:
        print(*names, sep=",", file=file)
        for row, *cells in zip(table, *texts):
            print(form % tuple(row), *cells, sep=",", file=file)


def write_ride(path: Path, simulated: SimulatedRide, speed: bool) -> None:
    """Write the log of a ride. speed: True to add a speed and a position once per second."""
    log = _log(simulated.time, simulated.readings)
    if not speed:
        _write(path, _LOG, _FORMATS, log)
        return
    track = np.column_stack((simulated.truth["speed_mps"], *positions(simulated)))
    step = round(_TRACK_S * simulated.rate_hz)
    cells = ["{:.2f},{:.7f},{:.7f},{:.3f}".format(*row) if k % step == 0 else ",,," for k, row in enumerate(track)]
    _write(path, (*_LOG, *TRACK), _FORMATS, log, cells)
