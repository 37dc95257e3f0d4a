"""Recorded logs: CSV with the columns of design's contract, plain or gzipped, read block by block."""

import csv
import gzip
import io
import itertools
import zlib
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError, cause
from ..output import write_whole
from . import cells
from .cells import COLUMNS, OPTIONAL
from .speed_unit import SpeedUnit

ROOM_TEMP_C = 25.0
BLOCK_BYTES = 1 << 22  # of text, some 60000 samples
_NUMERIC = b"0123456789+-.eE, \n"  # where nothing else stands, numpy may read it


@dataclass
class Log:
    """One recording in the sensor's axes.

    time_us: n integers, strictly increasing, 0 for the first.  time_text: n, as they stand in the file.
    readings: n of (ax, ay, az in g, temperature in C, gx, gy, gz in deg/s), the chip's order.
    speed_mps: n, None where there is no new value.
    """

    path: Path
    time_text: list[str]
    time_us: list[int]
    readings: list[tuple[float, ...]]
    speed_mps: list[float | None]


@dataclass
class Block:
    """Some rows of a log, one after the other; columns as in Log, but readings (n, 7) and NaN for no speed."""

    time_us: NDArray[np.int64]
    readings: NDArray[np.float64]
    speed_mps: NDArray[np.float64]
    has_temp: bool
    text: str
    time_place: int
    bytes_read: int  # of the file so far, as it is packed

    def rows(self) -> Iterator[tuple[int, list[float], float]]:
        """Time, reading and speed of each row."""
        return zip(self.time_us.tolist(), self.readings.tolist(), self.speed_mps.tolist())

    @property
    def time_text(self) -> list[str]:
        """The times as they stand in the file."""
        lines = [line for line in self.text.split("\n") if line]
        if self.time_place == 0:
            return [line.partition(",")[0].strip() for line in lines]
        return [cells[self.time_place].strip() for cells in csv.reader(lines)]


def read_log(path: Path, minimum: int = 2) -> Log:
    """Read a log of at least minimum samples. Raises InputError naming the file and the line."""
    log = Log(path, [], [], [], [])
    for block in read_blocks(path, minimum):
        log.time_text += block.time_text
        log.time_us += block.time_us.tolist()
        log.readings += map(tuple, block.readings.tolist())
        log.speed_mps += [value if value == value else None for value in block.speed_mps.tolist()]
    return log


def read_blocks(path: Path, minimum: int = 2) -> Iterator[Block]:
    """The same, block by block, however long the log is."""
    chunks = _chunks(path)
    first, packed = next(chunks, (b"", 0))
    first = first.removeprefix(b"\xef\xbb\xbf")
    if not first.strip():
        raise InputError(f"{path} is empty: a log starts with the line {','.join(COLUMNS)}")
    cells.check_text(path, first, 0)
    header, _, rest = first.partition(b"\n")
    names = cells.header(path, header.decode())
    places = {name: names.index(name) for name in COLUMNS + OPTIONAL if name in names}
    count, line, first_us, last_us = 0, 1, 0, -1
    speed_unit = SpeedUnit(path)
    for text, done in itertools.chain([(rest, packed)], chunks):
        table, rows = _numbers(path, text, names, places, line, last_us if count else None)
        line += text.count(b"\n")
        if not len(table):
            continue
        time_us = np.rint(table[:, 0] * 1e6).astype(np.int64)
        if not count:
            first_us = int(time_us[0])
            _check_units(path, table[:, 1:4], time_us)
        count, last_us = count + len(table), int(time_us[-1])
        block = _block(table, time_us - first_us, places, rows, done)
        if "speed_mps" in places:
            speed_unit.add(block.time_us.astype(float) * 1e-6, block.readings[:, :3], block.speed_mps)
        yield block
    if count < minimum:
        raise InputError(f"{path} is too short: {count} samples, at least {minimum} are needed")


def write_table(path: Path, columns: Sequence[str], rows: Iterable[Sequence[object]]) -> None:
    """Write a CSV file, gzipped if its name ends in .gz, whole or not at all."""

    def write(temporary: Path) -> None:
        opened = gzip.open if path.suffix == ".gz" else open
        with opened(temporary, "wt", encoding="ascii", newline="") as file:
            writer = csv.writer(file, lineterminator="\n")
            writer.writerow(columns)
            writer.writerows(rows)

    write_whole(path, write)


def _chunks(path: Path) -> Iterator[tuple[bytes, int]]:
    """The file's text, unpacked, in pieces of whole lines that end in a line feed; bytes read of the file."""
    if path.is_dir():
        raise InputError(f"{path} is a directory: give the name of a log in it")
    pending = b""
    try:
        with open(path, "rb") as packed, gzip.open(packed) if path.suffix == ".gz" else packed as file:
            while data := file.read(BLOCK_BYTES):
                pending += data
                if len(data) < BLOCK_BYTES:
                    break  # the end
                cut = pending.rfind(b"\n") + 1 or pending.rfind(b"\r") + 1
                if cut:
                    yield _with_line_feeds(pending[:cut]), packed.tell()
                    pending = pending[cut:]
    except gzip.BadGzipFile as error:
        raise InputError(f"{path} is not a gzip file: unpacked logs have names without .gz") from error
    except (EOFError, zlib.error) as error:
        raise InputError(f"{path} is damaged or cut short: copy it again") from error
    except FileNotFoundError as error:
        raise InputError(f"{path}: there is no such file") from error
    except (OSError, ValueError) as error:
        raise InputError(f"{path} cannot be read: {cause(error)}") from error
    if pending:
        yield _with_line_feeds(pending + b"\n"), path.stat().st_size


def _with_line_feeds(text: bytes) -> bytes:
    text = text.replace(b"\r\n", b"\n")
    return text if b"\n" in text else text.replace(b"\r", b"\n")


def _numbers(
    path: Path, text: bytes, names: list[str], places: dict[str, int], line: int, before_us: int | None
) -> tuple[NDArray[np.float64], str]:
    """(n, columns in the order of places) and the rows as CSV. line: lines before this text.

    numpy reads what is plain; whatever is not, or looks wrong, is gone through cell by cell, which names the
    line of a mistake and is twenty times slower.
    """
    if text.strip() and not text.translate(None, _NUMERIC):
        plain = text.replace(b",,", b",nan,").replace(b",,", b",nan,").replace(b",\n", b",nan\n")
        try:
            table = np.loadtxt(io.BytesIO(plain), delimiter=",", comments=None, ndmin=2)
        except ValueError:
            table = np.empty((0, 0))
        if table.shape[1] == len(names):
            table = table[:, list(places.values())]
            if cells.plausible(table, list(places), before_us):
                return table, text.decode()
    cells.check_text(path, text, line)
    return cells.read(path, text.decode(), len(names), places, line, before_us)


def _block(
    table: NDArray[np.float64], time_us: NDArray[np.int64], places: dict[str, int], text: str, done: int
) -> Block:
    column = {name: table[:, k] for k, name in enumerate(places)}
    none = np.full(len(table), np.nan)
    temperature = column.get("temp_c", none)
    order = ("ax_g", "ay_g", "az_g", "temp_c", "gx_dps", "gy_dps", "gz_dps")
    column["temp_c"] = np.where(np.isnan(temperature), ROOM_TEMP_C, temperature)
    readings = np.column_stack([column[name] for name in order])
    return Block(time_us, readings, column.get("speed_mps", none), "temp_c" in places, text, places["t_s"], done)


def _check_units(path: Path, accelerations: NDArray[np.float64], time_us: NDArray[np.int64]) -> None:
    """Raise InputError for a log in units that are easily taken for the right ones, by its beginning."""
    if 5.0 < np.median(np.linalg.norm(accelerations, axis=1)) < 20.0:
        raise InputError(f"{path}: accelerations look like m/s2: divide them by 9.80665, their unit is g")
    if len(time_us) > 1 and (time_us[-1] - time_us[0]) / (len(time_us) - 1) >= 4e6:
        raise InputError(f"{path}: seconds between samples: is t_s in milliseconds?")
