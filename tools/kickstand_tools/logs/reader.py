"""Reads recorded logs block by block: CSV with the columns of COLUMNS, plain or gzipped."""

import contextlib
import itertools
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from ..calibration.file import CalibrationFile
from ..checks.log import Checks
from ..checks.sensor import SensorHealth
from ..checks.units import check_units
from ..common.errors import InputError
from ..common.messages import Message
from ..signals import Array
from . import cells
from .cells import COLUMNS, OPTIONAL, TRACK
from .csv_reader import numbers_in
from .even_times import even_blocks
from .frozen import FrozenFinder
from .log import Block, Log, Stretch
from .source import File, Progress, chunks, name_of, total_bytes

BLOCK_BYTES = 1 << 20  # bytes of text per block, about 15000 samples
BLOCK_SAMPLES = 60_000  # samples per block of a log in memory
MOST_SAMPLES = 10_000_000  # most samples of a log: 14 hours at 200 Hz, which use 1 GB of memory
_READINGS = ("ax_g", "ay_g", "az_g", "temp_c", "gx_dps", "gy_dps", "gz_dps")  # columns in the order of Block.readings

Source = File | Log | Stretch  # everything that can be read as a log


class CutLine(Message):
    """The last line is incomplete, as after an interrupted recording."""

    line_number: int

    code = "cut-line"
    text = "line {line_number}, the last one, was cut: it is left out"


def read_log(source: Source, minimum: int = 2, progress: Progress | None = None, axes: bool = True) -> Log:
    """Read a whole log: CSV with the columns t_s,ax_g,ay_g,az_g,gx_dps,gy_dps,gz_dps and optionally
    speed_mps,lat_deg,lon_deg,utc_s,temp_c.

    Repeated times are spread evenly. An incomplete last line is left out. If the source is a Log, it is only checked.

    Args:
        source: a path (of a gzip file if it ends in .gz), an open file of text or bytes, a Log, or a Stretch of these.
        minimum: least number of samples.
        progress: called with the number of bytes read and the size of the file.
        axes: check that rates and accelerations fit each other. This check takes most of the time.

    Raises InputError, which names the file and the line of a mistake. Common wrong units (m/s2, milliseconds, km/h)
    also raise InputError.

    >>> import io
    >>> log = read_log(io.StringIO("t_s,ax_g,ay_g,az_g,gx_dps,gy_dps,gz_dps\\n0.00,0,1,0,0,0,0\\n0.01,0,1,0,0,0,0\\n"))
    >>> log.accel_g.tolist()
    [[0.0, 1.0, 0.0], [0.0, 1.0, 0.0]]
    >>> log.to_pandas().columns.tolist()
    ['t_s', 'ax_g', 'ay_g', 'az_g', 'gx_dps', 'gy_dps', 'gz_dps', 'speed_mps', 'lat_deg', 'lon_deg', 'utc_s', 'temp_c']
    """
    notices: list[Message] = []
    blocks = list(read_blocks(source, minimum, progress, notices, axes, lines=False))
    readings = np.concatenate([block.readings for block in blocks])
    return Log(
        np.concatenate([block.t_s for block in blocks]),
        readings[:, :3],
        readings[:, 4:],
        temperature_c=readings[:, 3],
        start_s=blocks[0].start_s,
        name=name_of(source),
        notices=notices,
        **{column: np.concatenate([getattr(block, column) for block in blocks]) for column in TRACK},
    )


def read_blocks(
    source: Source,
    minimum: int = 2,
    progress: Progress | None = None,
    notices: list[Message] | None = None,
    axes: bool = True,
    lines: bool = True,
    calibration: CalibrationFile | None = None,
) -> Iterator[Block]:
    """Read a log block by block. Frozen readings are marked in each block.

    Args:
        source, minimum, progress, axes: see read_log().
        notices: after the last block, notices about the log and its contradictions to `calibration` are appended.
        lines: also keep the rows as CSV, to write them again. The rows use most of a block's memory.
    """
    name, count = name_of(source), 0
    remarks: list[Message] = []
    checks, frozen, health = Checks(name), FrozenFinder(), SensorHealth()
    whole = source.source if isinstance(source, Stretch) else source
    total = len(whole.t_s) if isinstance(whole, Log) else total_bytes(whole)
    for block in _unchecked(source, remarks, lines):
        if not count:
            check_units(name, block.time_us, block.readings[:, :3])
        count += len(block.time_us)
        if count > MOST_SAMPLES:
            raise InputError(
                f"{name} has over {MOST_SAMPLES / 1e6:.0f} million samples: kickstand cut writes a part of it"
            )
        block.frozen = frozen.mark(block.time_us, block.readings) | health.mark(block.time_us, block.readings)
        checks.add(block.measured)
        yield block
        if progress:
            progress(block.done, total)
    if count < minimum:
        raise InputError(f"{name} is too short: {count} samples, at least {minimum} are needed")
    found = checks.remarks(axes and notices is not None, calibration)
    if notices is not None:
        notices += remarks + frozen.notices() + health.notices() + found


def check_first_line(log: Path) -> None:
    """Raise InputError if the first line of a file is not the header of a log, or if no other line follows."""
    with contextlib.closing(chunks(log, BLOCK_BYTES, [])) as pieces:
        first, _ = next(pieces, (b"", 0))
        _, rest = _header(str(log), first)
        if not rest.strip() and not any(text.strip() for text, _ in pieces):
            raise InputError(f"{log} is empty: there are no readings below the names of its columns")


def is_log(path: Path) -> bool:
    """Return True if a file begins with the header of a log and has another line."""
    try:
        check_first_line(path)
        return True
    except InputError:
        return False


def read_twice(source: Source) -> Source:
    """Return a source that can be read twice. An open file is read into a Log."""
    if isinstance(source, Stretch):
        return replace(source, source=_rereadable(source.source))
    return _rereadable(source)


def split_stretch(source: Source) -> tuple[File | Log, Stretch | None]:
    """Split a source into the whole log and the stretch.

    Returns:
        whole: the log.
        stretch: the stretch with both limits counted from the log's start, or None if the source is not a Stretch.

    Raises InputError if the stretch has no sample.
    """
    if not isinstance(source, Stretch):
        return source, None
    stretch = _from_beginning(replace(source, source=_rereadable(source.source)))
    next(stretch.cut(_unchecked(stretch.source, [])))
    return stretch.source, stretch


def _from_beginning(stretch: Stretch) -> Stretch:
    """Return the stretch with both limits counted from the log's start.

    If a limit counts from the end, the log is read to find its duration.
    """
    if min(stretch.from_s or 0.0, stretch.to_s or 0.0) >= 0.0:
        return stretch
    whole = _rereadable(stretch.source)
    last_s = [float(block.t_s[-1]) for block in _unchecked(whole, [])]
    return Stretch(whole, stretch.from_s, stretch.to_s).of_length(max(last_s, default=0.0))


def _rereadable(source: File | Log) -> File | Log:
    return source if isinstance(source, (Path, str, Log)) else read_log(source)


def _unchecked(source: Source, remarks: list[Message], lines: bool = False) -> Iterator[Block]:
    """Return the blocks of a source. Their units and their number of samples are not checked yet.

    remarks: notices about the file are appended.
    lines: see read_blocks().
    """
    if isinstance(source, Log):
        return _blocks_of(source)
    if not isinstance(source, Stretch):
        return _parsed(source, name_of(source), remarks, lines)
    stretch = _from_beginning(source)
    return stretch.cut(_unchecked(stretch.source, remarks, lines))


def _blocks_of(log: Log) -> Iterator[Block]:
    time_us, readings = log.time_us, log.readings
    has_temp = not np.all(np.isnan(log.temperature_c))
    for start in range(0, len(time_us), BLOCK_SAMPLES):
        part = slice(start, start + BLOCK_SAMPLES)
        yield Block(
            time_us[part],
            readings[part],
            frozen=np.zeros(len(time_us[part]), dtype=bool),
            has_temp=has_temp,
            start_s=log.start_s,
            done=min(start + BLOCK_SAMPLES, len(time_us)),
            **{name: getattr(log, name)[part] for name in TRACK},
        )


def _parsed(source: File, name: str, remarks: list[Message], lines: bool) -> Iterator[Block]:
    # An error holds the frames that it went through, so without closing() the file would stay open as long as the error
    with contextlib.closing(chunks(source, BLOCK_BYTES, remarks)) as pieces:
        first, packed = next(pieces, (b"", 0))
        names, rest = _header(name, first)
        rows = _rows(itertools.chain([(rest, packed)], pieces), name, names, remarks, lines)
        yield from even_blocks(rows, name, remarks)


def _header(name: str, first: bytes) -> tuple[list[str], bytes]:
    """Split the first chunk of a log into the names of its columns and the bytes after the header."""
    first = first.removeprefix(b"\xef\xbb\xbf")
    if not first.strip():
        raise InputError(f"{name} is empty: a log starts with the line {','.join(COLUMNS)}")
    header, _, rest = first.partition(b"\n")
    cells.check_text(name, header, 0)
    try:
        return cells.header(name, header.decode()), rest
    except InputError:
        cells.check_text(name, first, 0)
        raise


def _rows(
    pieces: Iterator[tuple[bytes, int]], name: str, names: list[str], remarks: list[Message], lines: bool
) -> Iterator[Block]:
    """Yield the blocks with the times as recorded. Some times may be repeated."""
    places = {column: names.index(column) for column in COLUMNS + OPTIONAL if column in names}
    line, start_us, last_us = 1, None, None
    for text, done, is_last in _last_marked(pieces):
        cut = b""
        if is_last:
            text, cut = _without_cut_line(text, names, places)
            remarks += [CutLine(line + text.count(b"\n") + 1)] if cut else []
        table = _numbers(name, text, names, places, line, last_us)
        line += text.count(b"\n")
        if not len(table):
            continue
        time_us = np.rint(table[:, 0] * 1e6).astype(np.int64)
        start_us = int(time_us[0]) if start_us is None else start_us
        last_us = int(time_us[-1])
        column: dict[str, Any] = dict.fromkeys(OPTIONAL, np.full(len(table), np.nan))
        column |= {name: table[:, k] for k, name in enumerate(places)}
        yield Block(
            time_us - start_us,
            np.column_stack([column[name] for name in _READINGS]),
            frozen=np.zeros(len(table), dtype=bool),
            has_temp="temp_c" in places,
            start_s=start_us / 1e6,
            done=done,
            lines=[line for line in text.decode().split("\n") if line.strip()] if lines else [],
            names=tuple(names),
            **{name: column[name] for name in TRACK},
        )


def _numbers(
    name: str, text: bytes, names: list[str], places: dict[str, int], line: int, before_us: int | None
) -> Array:
    """Convert the text of n rows to numbers.

    line: number of lines before the text.

    Returns the columns in the order of places, shape (n, number of places).
    """
    table = numbers_in(text, len(names))
    if table is not None and cells.plausible(table[:, list(places.values())], list(places), before_us):
        return table[:, list(places.values())]
    cells.check_text(name, text, line)
    return cells.read(name, text.decode(), len(names), places, line, before_us)


def _last_marked(parts: Iterator[tuple[bytes, int]]) -> Iterator[tuple[bytes, int, bool]]:
    """Yield each part, with True added for the last part."""
    before = next(parts, None)
    for part in parts:
        if before:
            yield *before, False
        before = part
    if before:
        yield *before, True


def _without_cut_line(text: bytes, names: list[str], places: dict[str, int]) -> tuple[bytes, bytes]:
    """Remove the last line of a log if it was cut.

    The last line was cut if it has fewer cells than the log has columns. A last line without a line end was also cut in
    two other cases: it cannot be read, or its last number has fewer decimals than the last number of the previous line.

    Returns:
        text: the text without the cut line.
        cut: the cut line, empty if no line was cut.
    """
    kept = text.rstrip()
    before, _, last = kept.rpartition(b"\n")
    if not last or last.count(b'"'):
        return text, b""
    cut = last.count(b",") + 1 < len(names)
    if not cut and not text.endswith(b"\n"):
        above = before.rpartition(b"\n")[2]
        half = not last.endswith(b",") and _digits(last) < _digits(above)
        cut = half or not _readable(last, names, places)
    return (before + b"\n" if before else b"", last) if cut else (text, b"")


def _readable(line: bytes, names: list[str], places: dict[str, int]) -> bool:
    try:
        return len(cells.read("", line.decode(), len(names), places, 0, None)) == 1
    except (InputError, UnicodeDecodeError):
        return False


def _digits(line: bytes) -> int:
    """The number of decimals in the last cell; 0 for an empty cell."""
    return len(line.rpartition(b",")[2].strip().partition(b".")[2])
