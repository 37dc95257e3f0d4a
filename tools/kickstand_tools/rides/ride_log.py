"""A recorded ride as the project's log CSV and CAL.json."""

from collections.abc import Iterable, Iterator
from pathlib import Path

import numpy as np

from ..calibration.file import CalibrationFile, calibration_path, write_calibration
from ..logs.reader import COLUMNS, write_table
from .block_reader import Block


def header(speed: bool) -> tuple[str, ...]:
    """The log's column names."""
    return (*COLUMNS, "speed_mps", "temp_c") if speed else (*COLUMNS, "temp_c")


def rows(blocks: Iterable[Block], speed: bool, from_us: int = 0) -> Iterator[list[str]]:
    """One row a turn of the board's loop: the mean of its samples at the time of the last, in s since from_us.

    Values have enough digits to tell one count of the chip from the next. The temperature stands in the first row of
    each block.
    """
    for block in blocks:
        lsb, gyro_lsb = block.accel_lsb_per_g, block.gyro_lsb_tenths / 10
        temperature = f"{block.centidegrees / 100:.2f}"
        for turn in block.turns:
            row = [f"{(turn.time_us - from_us) / 1e6:.6f}"]
            row += [f"{total / turn.n / lsb:.7f}" for total in turn.sums[:3]]
            row += [f"{total / turn.n / gyro_lsb:.6f}" for total in turn.sums[3:]]
            if speed:
                row.append("" if turn.speed_mps is None else f"{turn.speed_mps:.2f}")
            row.append(temperature)
            yield row
            temperature = ""


def calibration(block: Block) -> CalibrationFile:
    """The calibration that the lean on the display was computed with, with notes on board and chip."""
    c = block.calibration()
    notes = {
        "firmware": block.firmware,
        "who_am_i": f"{block.who_am_i:#04x}",
        "sample_hz": block.sample_hz,
    }
    return CalibrationFile(
        np.array(c.accel_offset),
        np.array(c.accel_slope),
        np.array(c.gyro_bias),
        np.array(c.vehicle_from_sensor),
        c.aligned,
        c.six_done,
        notes,
        c.trim_deg,
        gyro_delay_s=block.delay_tenths_ms / 10_000 if block.delay_tenths_ms else None,
    )


def write(path: Path, blocks: list[Block]) -> Path:
    """Write NAME.csv.gz (or .csv) and NAME.cal.json beside it, whose path is returned."""
    speed = any(turn.speed_mps is not None for block in blocks for turn in block.turns)
    write_table(path, header(speed), rows(blocks, speed, blocks[0].time_us))
    beside = calibration_path(path)
    write_calibration(beside, calibration(blocks[0]))
    return beside
