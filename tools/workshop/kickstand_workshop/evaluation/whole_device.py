"""Runs a ride with a fault on the whole device: the firmware on the simulated board, judged by its display."""

import contextlib
import gc
import io
import os
import re
import tempfile
from collections.abc import Callable

import numpy as np
from kickstand.calibration.store import Store
from kickstand_sim.simulated_board.lcd import shown_lean
from kickstand_sim.simulated_board.simulator import Board
from kickstand_tools.calibration.file import CalibrationFile
from kickstand_tools.signals import intervals
from numpy.typing import NDArray

from .faults import ACCEL_RANGE_G

LOOK_S = 0.1
# Texts that name a fault of the sensor. `Lean --` and texts about a speed source or a display do not match
NAMES = re.compile("Sensor|Gyro|Accel|No sensor", re.IGNORECASE)
STARTED_S = 2.0  # time until the display no longer shows start-up texts
UNSURE = "Lean  --"  # the first line while no lean is shown


def display_of(
    readings: NDArray[np.float64],
    rate_hz: float,
    calibration: CalibrationFile,
    lost: NDArray[np.bool_],
    speed: Callable[[float], float] | None = None,
) -> tuple[NDArray[np.float64], NDArray[np.float64], float]:
    """Run the whole device, and read its display every LOOK_S.

    readings: Readings in the chip's order, shape (m, 7).
    rate_hz: Number of readings per second.
    lost: True for readings at which the sensor does not answer, shape (m).
    speed: Function that returns the speed of a GPS receiver in m/s at a time in s. None for no receiver.

    Returns:
        times: shape (n), in s.
        leans: leans on the display, shape (n), in degrees. NaN where the display shows no lean.
        named: time at which the display first names a fault, in s, or NaN.
    """
    rows = readings[:, [0, 1, 2, 4, 5, 6, 3]].tolist()  # the temperature, column 3 of the chip, last
    last = len(rows) - 1
    board = Board(lambda t_s: rows[min(last, max(0, int(t_s * rate_hz)))])
    if speed:
        board.fit_gps(speed)
    for first, end in intervals(lost):
        board.faults.nack_for(board.sensor.address, first / rate_hz, (end - first) / rate_hz)
    times: list[float] = []
    leans: list[float] = []
    named: list[float] = []

    def look() -> None:
        now_s = board.clock.now_us / 1e6
        text = board.lcd.text()
        lean = shown_lean(text)
        # While the display writes a line, up to 10 ms, dashes replace its missing part
        half_written = "--" in text[0] and text[0].rstrip() != UNSURE
        times.append(now_s)
        leans.append(leans[-1] if leans and half_written else np.nan if lean is None else lean)
        if any(NAMES.match(line) for line in text) and now_s > STARTED_S:
            named.append(now_s)

    board.every(LOOK_S, look)
    config = {"SPEED": "gps"} if speed else {}
    gc.freeze()  # the firmware often collects garbage. Scanning the objects of earlier runs would take too long
    try:
        with tempfile.TemporaryDirectory() as flash, contextlib.chdir(flash):
            with board, contextlib.redirect_stdout(io.StringIO()):
                Store(board.sensor.who_am_i, int(ACCEL_RANGE_G), os.curdir).save(calibration.to_firmware())
                board.run_firmware((last + 1) / rate_hz, **config)
    finally:
        gc.unfreeze()
        gc.collect()  # the board's objects refer to each other, so the next freeze would keep them
    return np.array(times), np.array(leans), min(named, default=float("nan"))
