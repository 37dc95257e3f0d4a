"""Measures the roughness of simulated and recorded rides, as the rms in each frequency band."""

from pathlib import Path

import numpy as np
from kickstand_sim.simulation.ride import ride
from kickstand_tools.calibration.file import CalibrationFile
from kickstand_tools.common.messages import InputError
from kickstand_tools.estimation.alignment import fit_ride
from kickstand_tools.logs.log import Log
from kickstand_tools.logs.reader import read_log
from numpy.typing import NDArray
from rich import box
from rich.table import Table

BANDS_HZ = ((0.03, 0.1), (0.1, 0.3), (0.3, 1.0), (1.0, 3.0), (3.0, 10.0))
QUANTITIES = ("vertical, g", "sideways, g", "pitch rate, deg/s", "yaw rate, deg/s", "roll rate, deg/s")
_GRID_HZ = 50.0
_LEAST_S = 2.0 / BANDS_HZ[0][0]
_RIDING_DPS = 5.0  # largest rate of a standing bike

Figures = dict[str, NDArray[np.float64]]


def bands_of(force_g: NDArray[np.float64], rate_dps: NDArray[np.float64], rate_hz: float) -> Figures:
    """Return the rms in each of BANDS_HZ, for each of QUANTITIES.

    force_g, rate_dps: rate_hz samples per second along and about left, up, forward, shape (n, 3).
    """
    columns = force_g[:, 1], force_g[:, 0], *rate_dps.T
    window = np.hanning(len(force_g))
    frequency = np.fft.rfftfreq(len(force_g), 1.0 / rate_hz)
    figures = {}
    for name, values in zip(QUANTITIES, columns, strict=True):
        power = np.abs(np.fft.rfft((values - values.mean()) * window)) ** 2 * 2.0 / len(values) / np.sum(window**2)
        inside = [power[(frequency >= low) & (frequency < high)].sum() for low, high in BANDS_HZ]
        figures[name] = np.sqrt(np.array(inside))
    return figures


def bands_of_log(log: Log, calibration: CalibrationFile) -> Figures:
    """Return bands_of() a log from the start to the end of riding. Raises InputError if the ride is too short."""
    step = 1.0 / _GRID_HZ
    time = np.arange(log.t_s[0], log.t_s[-1], step)
    force, rate = calibration.in_vehicle(log.readings)
    number = np.searchsorted(time, log.t_s, side="right") - 1

    def mean(values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Average the samples in each step, to avoid aliasing. Interpolate linearly between the means."""
        count = np.bincount(number, minlength=len(time))
        has_data = count > 0
        total = np.bincount(number, values, minlength=len(time))
        return np.interp(time, time[has_data], total[has_data] / count[has_data])

    force, rate = (np.column_stack([mean(column) for column in values.T]) for values in (force, rate))
    busy = np.flatnonzero(np.linalg.norm(rate - np.median(rate, axis=0), axis=1) > _RIDING_DPS)
    if not len(busy) or (busy[-1] - busy[0]) * step < _LEAST_S:
        raise InputError(f"{log.name}: less than {_LEAST_S:.0f} s of riding: too short for the lowest band")
    riding = slice(busy[0], busy[-1] + 1)
    return bands_of(force[riding], rate[riding], _GRID_HZ)


def of_recording(path: Path) -> Figures:
    """Return bands_of_log() of a recorded ride, aligned by the ride itself. Raises InputError."""
    log = read_log(path)
    return bands_of_log(log, fit_ride(log).calibration)


def of_simulated(profile: str, seed: int, seconds: float, road: str | None, mount: str | None) -> Figures:
    simulated = ride(profile, seed, seconds, road=road, mount=mount)
    calibration = CalibrationFile(vehicle_from_sensor=simulated.vehicle_from_sensor, aligned=True)
    return bands_of_log(Log.from_readings(simulated.readings, simulated.rate_hz, "RIDE.csv"), calibration)


def table(rides: dict[str, Figures]) -> Table:
    """Return a table with a block of lines for each quantity. rides: the rms in each band, by the name of the ride."""
    report = Table(title="rms by band of frequency, Hz", box=box.SIMPLE_HEAD, padding=(0, 1, 0, 0))
    report.add_column("ride", overflow="fold")
    for low, high in BANDS_HZ:
        report.add_column(f"{low:g}-{high:g}", justify="right")
    for quantity in QUANTITIES:
        report.add_row(quantity, style="cyan")
        digits = 3 if quantity.endswith(" g") else 2
        for k, (name, figures) in enumerate(rides.items()):
            cells = [f"{value:.{digits}f}" for value in figures[quantity]]
            report.add_row("  " + name, *cells, end_section=k == len(rides) - 1)
    return report
