"""Simulated rides for the tests of the analysis, with a perfect sensor whose axes are the vehicle's."""

import functools
import json
from pathlib import Path

import numpy as np
from kickstand_sim.simulation.scripted import script

from support import command

CALIBRATION = {
    "version": 1,
    "accel_offset_g": [0, 0, 0],
    "accel_slope": [1, 1, 1],
    "gyro_bias_dps": [0, 0, 0],
    "vehicle_from_sensor": [[1, 0, 0], [0, 1, 0], [0, 0, 1]],
    "aligned": True,
}


def calibration(path: Path, **changed) -> Path:
    """Write the entries of CALIBRATION with these changes. Return the path of the file."""
    path.write_text(json.dumps(CALIBRATION | changed))
    return path


def write(directory: Path, segments: list, rate_hz: int = 100, speed_hz: int = 0, vibration_g: float = 0.02) -> Path:
    """Simulate a ride and write its RIDE.csv and RIDE.cal.json. Return the path of RIDE.csv.

    segments: the ride's manoeuvres, see kickstand_sim.simulation.scripted.
    speed_hz: rate of the speed in the log, 0 for a log without speed.
    """
    return _put(directory, _text(segments, rate_hz, speed_hz, vibration_g))


def _put(directory: Path, text: str) -> Path:
    calibration(directory / "RIDE.cal.json")
    (directory / "RIDE.csv").write_text(text)
    return directory / "RIDE.csv"


def _text(segments: list, rate_hz: int, speed_hz: int, vibration_g: float) -> str:
    ride = script.Ride(segments, vibration_g)
    header = command.HEADER + (",speed_mps" if speed_hz else "")
    lines = [header]
    for n in range(round(ride.seconds * rate_hz)):
        t_s = n / rate_hz
        line = ",".join(f"{value:.5f}" for value in (t_s, *ride.motion(t_s)))
        if speed_hz:
            line += f",{ride.truth(t_s)[1]:.2f}" if n % (rate_hz // speed_hz) == 0 else ","
        lines.append(line)
    return "\n".join(lines) + "\n"


def short(directory: Path, rate_hz: int = 100, speed_hz: int = 0) -> Path:
    """Write a ride of less than a minute: the bike stands, sets off, turns to each side and stops hard."""
    return _put(directory, _short(rate_hz, speed_hz))


@functools.cache
def _short(rate_hz: int, speed_hz: int) -> str:
    parts = [script.upright(4), script.accelerate(15, 5), script.turn(-30, 4), script.straight(2)]
    parts += [script.turn(42, 4), script.straight(2), script.brake(0, 3), script.wait(4)]
    return _text(parts, rate_hz, speed_hz, 0.02)


def table(path: Path) -> np.ndarray:
    """Read a CSV of numbers as an array with named columns."""
    return np.genfromtxt(path, delimiter=",", names=True)
