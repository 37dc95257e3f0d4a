"""Writes a recorded ride as the project's log CSV and CAL.json."""

from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

import numpy as np

from ..calibration.file import CalibrationFile, calibration_path, write_calibration
from ..logs.csv_text import COLUMNS, TRACK, write_table
from .block_reader import StoredBlock, StoredTurn


def header(track: Sequence[str]) -> tuple[str, ...]:
    """Return the log's column names. track: the columns of TRACK that this log has."""
    return (*COLUMNS, *track, "temp_c")


def rows(blocks: Iterable[StoredBlock], track: Sequence[str], from_us: int = 0) -> Iterator[list[str]]:
    """Yield one row per turn of the board's loop: the time of its last sample and the mean of its samples.

    Values have enough digits to distinguish single counts of the chip. Only the first row of each block has the
    temperature.

    track: the columns of TRACK that this log has. from_us: the board's time at which the log's time is 0.
    """
    for block in blocks:
        lsb, gyro_lsb = block.accel_lsb_per_g, block.gyro_lsb_tenths / 10
        temperature = f"{block.centidegrees / 100:.2f}"
        for turn in block.turns:
            row = [f"{(turn.time_us - from_us) / 1e6:.6f}"]
            row += [f"{total / turn.n / lsb:.7f}" for total in turn.sums[:3]]
            row += [f"{total / turn.n / gyro_lsb:.6f}" for total in turn.sums[3:]]
            if track:
                cells = _track_cells(turn)
                row += [cells[name] for name in track]
            row.append(temperature)
            yield row
            temperature = ""


def _track_cells(turn: StoredTurn) -> dict[str, str]:
    """Return the cells of the columns TRACK, with the values that arrived in this turn."""
    cells: dict[str, str] = dict.fromkeys(TRACK, "")
    if turn.speed_mps is not None:
        cells["speed_mps"] = f"{turn.speed_mps:.2f}"
    if turn.place:
        cells |= {"lat_deg": f"{turn.place.lat_deg:.7f}", "lon_deg": f"{turn.place.lon_deg:.7f}"}
        cells["utc_s"] = "" if turn.place.utc_s is None else f"{turn.place.utc_s:.3f}"
    return cells


def calibration(block: StoredBlock) -> CalibrationFile:
    """Return the calibration that the board used for its display, with notes on board and chip."""
    c = block.calibration()
    notes = {"firmware": block.firmware, "who_am_i": f"{block.who_am_i:#04x}", "sample_hz": block.sample_hz}
    return CalibrationFile(
        np.array(c.accel_offset),
        np.array(c.accel_slope),
        np.array(c.gyro_bias),
        np.array(c.vehicle_from_sensor),
        c.aligned,
        c.six_done,
        notes,
        c.trim_deg,
        "car" if block.vehicle == "car" else "",
        gyro_delay_s=block.delay_tenths_ms / 10_000 if block.delay_tenths_ms else None,
        accel_matrix=np.array(c.accel_matrix),
        gyro_matrix=np.array(c.gyro_matrix),
        gyro_sigma=np.array(c.gyro_sigma),
    )


def write(path: Path, blocks: list[StoredBlock]) -> Path:
    """Write the log NAME.csv.gz or NAME.csv, and NAME.cal.json beside it. Returns the path of NAME.cal.json."""
    turns = [turn for block in blocks for turn in block.turns]
    columns = {
        "speed_mps": any(turn.speed_mps is not None for turn in turns),
        "lat_deg": any(turn.place for turn in turns),
        "utc_s": any(turn.place and turn.place.utc_s is not None for turn in turns),
    }
    track = [name for name in TRACK if columns[name.replace("lon", "lat")]]
    write_table(path, header(track), rows(blocks, track, blocks[0].time_us))
    calibration_file = calibration_path(path)
    write_calibration(calibration_file, calibration(blocks[0]))
    return calibration_file
