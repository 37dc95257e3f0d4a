"""Reads the blocks of a ride that a board recorded, and writes them as the project's log CSV and CAL.json.

firmware/kickstand/rides/block.py defines the format of the blocks.
"""

import struct
from binascii import crc32
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
from kickstand.calibration import store
from kickstand.calibration.parameters import Calibration
from kickstand.rides import block as block_format

from ..calibration.file import CalibrationFile, calibration_path, write_calibration
from ..logs.csv_text import COLUMNS, TRACK, write_table

_HEAD_LENGTH = struct.calcsize(block_format.HEAD)
_TAIL_LENGTH = struct.calcsize(block_format.TAIL)
_START = _HEAD_LENGTH + store.BODY_LENGTH  # start of the entries if the calibration has no matrices
_PLACE_LENGTH = struct.calcsize(block_format.PLACE)
# Samples were lost if a turn of the loop is late by more than this number of sample periods. kickstand.imu.sensor uses
# the same rule.
_LATE_PERIODS = 2
_DEGREE = 60 * 100_000  # a degree in the unit of stored positions, which is 0.00001 minutes
_MOST = 1e4  # largest accepted parameter of a calibration; real parameters are far smaller
CUT_SHORT = "cut short"  # usual for the last block of a ride, because the ignition cuts the power during a write


class BadBlock(Exception):
    """Bytes that are not a complete, valid block. The text gives the reason in a few words."""


@dataclass
class Place:
    """A position that arrived in a turn of the board's loop, in degrees north and east."""

    lat_deg: float
    lon_deg: float
    utc_s: float | None  # Universal Time in s since 1970, None if the receiver did not know the date


@dataclass
class StoredTurn:
    """One turn of the board's loop."""

    time_us: int  # of the turn's last sample
    n: int  # number of samples
    sums: tuple[int, ...]  # of the counts of these samples, in the order ax ay az gx gy gz
    speed_mps: float | None  # None if none arrived in this turn
    place: Place | None = None  # None if none arrived in this turn


@dataclass
class StoredBlock:
    """One block of a ride: the fields of its head, and its turns."""

    ride: int
    sequence: int
    time_us: int  # time of the last sample before the block, since power-on
    centidegrees: int  # temperature in 0.01 C
    accel_lsb_per_g: int
    gyro_lsb_tenths: int
    sample_hz: int
    firmware: str
    delay_tenths_ms: int  # delay of the gyro's low-pass in 0.1 ms, 0 if the firmware did not store it
    body: bytes  # of the calibration
    crc: int
    turns: list[StoredTurn] = field(default_factory=list)
    vehicle: str = ""  # from the board's config.py, "" if unknown. Blocks do not contain the vehicle.

    @property
    def who_am_i(self) -> int:
        """The content of the chip's register WHO_AM_I."""
        return self.body[0]

    def calibration(self) -> Calibration:
        """Return the calibration that the board used for the lean on the display."""
        return store.unpack(self.body)[2]

    def numbers(self) -> list[float]:
        """Return all numbers of the calibration."""
        calibration = self.calibration()
        return calibration.parameters() + calibration.matrices()

    def missing_s(self) -> list[float]:
        """The durations of all gaps in s: the time between two turns that the samples do not fill."""
        period_us, before_us, gaps = 1_000_000 // self.sample_hz, self.time_us, []
        for turn in self.turns:
            late_us = turn.time_us - before_us - turn.n * period_us
            if late_us > _LATE_PERIODS * period_us:
                gaps.append(late_us / 1e6)
            before_us = turn.time_us
        return gaps


def read(content: bytes) -> tuple[list[StoredBlock], list[str]]:
    """Return the complete blocks of a file, and one text per damaged place. CUT_SHORT means that the last block is
    incomplete, which is no damage."""
    blocks, problems = [], []
    offset = 0
    while offset < len(content):
        length = int.from_bytes(content[offset + 6 : offset + 8], "little")
        try:
            blocks.append(parse(content[offset : offset + length]))
            offset += length
        except BadBlock as problem:
            following = content.find(block_format.MAGIC, offset + 1)
            last = following < 0 and str(problem) == CUT_SHORT
            problems.append(CUT_SHORT if last else f"{problem} at byte {offset}")
            offset = following if following > 0 else len(content)
    return blocks, problems


def parse(data: bytes) -> StoredBlock:
    """Parse one block. Raises BadBlock if the block is not complete and valid."""
    if not data.startswith(block_format.MAGIC[: len(data)]):
        raise BadBlock("not of a ride")
    if len(data) < _START + _TAIL_LENGTH:
        raise BadBlock(CUT_SHORT)
    _, version, length, *rest, firmware, places, delay = struct.unpack_from(block_format.HEAD, data)
    if version not in block_format.BODY_LENGTHS:
        raise BadBlock(f"format {version}, this program reads {max(block_format.BODY_LENGTHS)}")
    start = _HEAD_LENGTH + block_format.BODY_LENGTHS[version]
    if len(data) < max(length, start + _TAIL_LENGTH):
        raise BadBlock(CUT_SHORT)
    count, crc = struct.unpack_from(block_format.TAIL, data, len(data) - _TAIL_LENGTH)
    if len(data) != length or crc != crc32(data[:-4]):
        raise BadBlock("damaged")
    firmware = firmware.rstrip(b"\0").decode("ascii", "replace")
    fields: list[Any] = [*rest, firmware, delay, data[_HEAD_LENGTH:start], crc]
    block = StoredBlock(*fields)
    try:
        units = block.accel_lsb_per_g, block.gyro_lsb_tenths, block.sample_hz
        if not all(units) or not all(abs(value) <= _MOST for value in block.numbers()):
            raise ValueError  # "not <=" also refuses NaN
        end = len(data) - _TAIL_LENGTH - places * _PLACE_LENGTH
        positions = dict(_places(data[end : len(data) - _TAIL_LENGTH]))
        block.turns = list(_turns(block, data[start:end], count, positions))
    except (ValueError, ZeroDivisionError) as error:  # the check sum is right, so the board wrote invalid values
        raise BadBlock("not decodable") from error
    return block


def _places(data: bytes) -> Iterator[tuple[int, Place]]:
    """Yield the number of the entry and the position, for each position."""
    for entry, date, day_ms, lat, lon in struct.iter_unpack(block_format.PLACE, data):
        if abs(lat) > 90 * _DEGREE or abs(lon) > 180 * _DEGREE:
            continue  # an impossible position from the receiver would make the log invalid
        try:
            midnight_s = datetime(2000 + (date >> 9), date >> 5 & 15, date & 31, tzinfo=UTC).timestamp()
        except ValueError:
            midnight_s = None
        yield entry, Place(lat / _DEGREE, lon / _DEGREE, None if midnight_s is None else midnight_s + day_ms / 1000.0)


def _turns(block: StoredBlock, data: bytes, count: int, places: dict[int, Place]) -> Iterator[StoredTurn]:
    """Decode the `count` entries that block_format.encode() writes. places: positions by the number of their entry."""
    difference = _Differences(data).next
    samples, counts, speed_cmps = 1, [0] * (_SPEED - _COUNTS), 0
    period_us = 1_000_000 // block.sample_hz
    time_us, speed_mps = block.time_us, None
    for entry in range(count):
        earlier = samples
        samples += difference(_SAMPLES)
        if samples == 0:  # a speed, which belongs to the next turn
            samples = earlier
            speed_cmps += difference(_SPEED)
            speed_mps = speed_cmps / 100
            continue
        dt_us = samples * period_us + difference(_TIME)
        scaled = counts if samples == earlier else [value * samples // earlier for value in counts]
        counts = [value + difference(field) for field, value in enumerate(scaled, _COUNTS)]
        if samples < 0 or dt_us < 0 or max(map(abs, counts)) > samples << 15:
            raise ValueError  # the time must increase, and counts have 16 bits
        time_us += dt_us
        yield StoredTurn(time_us, samples, tuple(counts), speed_mps, places.get(entry))
        speed_mps = None


_SAMPLES, _TIME, _COUNTS, _SPEED = 0, 1, 2, 8  # fields of an entry. _COUNTS is the first of six


class _Differences:
    """Decodes the differences of the fields. The code of a field adapts to the mean size of its differences."""

    def __init__(self, data: bytes) -> None:
        self._bits, self._next_bit = bin(int.from_bytes(b"\x01" + data, "big"))[3:], 0
        self._means = [block_format.START_MEAN] * block_format.FIELDS

    def next(self, field: int) -> int:
        """Return the next difference. Raises ValueError at the end of the data."""
        bits, bit, mean = self._bits, self._next_bit, self._means[field]
        zero = bits.index("0", bit)
        ones = zero - bit
        if ones < block_format.LIMIT:
            k = max(0, mean.bit_length() - block_format.MEAN_SHIFT - 1)
            self._next_bit = zero + 1 + k
            size = ones << k | (int(bits[zero + 1 : self._next_bit], 2) if k else 0)
        else:
            start = bit + block_format.LIMIT
            self._next_bit = start + block_format.RAW_BITS
            size = int(bits[start : self._next_bit], 2)
        self._means[field] = mean + min(size, block_format.MAX_SIZE) - (mean >> block_format.MEAN_SHIFT)
        return size >> 1 ^ -(size & 1)


def missing_note(missing_s: list[float]) -> str:
    """A line of text about gaps of these durations in s."""
    times = "once" if len(missing_s) == 1 else f"{len(missing_s)} times"
    return (
        f"readings are missing {times}, {sum(missing_s):.1f} s in all: the sensor was set up again, "
        "or the board was busy for longer than the sensor keeps samples"
    )


# The log


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
        accel_offset_g=np.array(c.accel_offset),
        accel_slope=np.array(c.accel_slope),
        gyro_bias_dps=np.array(c.gyro_bias),
        vehicle_from_sensor=np.array(c.vehicle_from_sensor),
        aligned=c.aligned,
        six_done=c.six_done,
        notes=notes,
        trim_deg=c.trim_deg,
        vehicle="car" if block.vehicle == "car" else "",
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
