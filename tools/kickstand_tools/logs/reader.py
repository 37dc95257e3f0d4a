"""Reads recorded logs, plain or gzipped, and writes logs and parts of logs. It judges nothing: see checks.log."""

import contextlib
import itertools
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from ..common.messages import InputError, Message, kind
from ..signals import Array
from .csv_text import (
    COLUMNS,
    OPTIONAL,
    cells_of,
    check_text,
    csv_lines,
    header_names,
    is_plausible,
    numbers_by_line,
    numbers_in,
    write_lines,
)
from .even_times import TimesSpread, even_times
from .log import Log, Source, Sparse, Stretch
from .source import File, Progress, chunks, name_of, total_bytes

CHUNK_BYTES = 1 << 20  # bytes of text that are converted at once, about 15000 samples
MOST_SAMPLES = 10_000_000  # most samples of a log: 14 hours at 200 Hz, which use 1 GB of memory
REPORTED_S = 0.002  # smallest change of a time, in s, that is reported in a notice

DIGITS = {"speed_mps": 3, "temp_c": 2, "lat_deg": 7, "lon_deg": 7, "utc_s": 3}

CutLine = kind("cut-line", "line_number", "line {line_number}, the last one, was cut: it is left out")


def read_log(source: Source, minimum: int = 2, progress: Progress | None = None) -> Log:
    """Read a log: CSV with the columns t_s,ax_g,ay_g,az_g,gx_dps,gy_dps,gz_dps and optionally
    speed_mps,lat_deg,lon_deg,utc_s,temp_c.

    Repeated times are spread evenly. An incomplete last line is left out. Units and axes are not checked: see
    check_log().

    source: a path (of a gzip file if it ends in .gz), an open file of text or bytes, a Log, or a Stretch of these.
    minimum: least number of samples.
    Raises InputError, which names the file and the line of a mistake.

    >>> import io
    >>> log = read_log(io.StringIO("t_s,ax_g,ay_g,az_g,gx_dps,gy_dps,gz_dps\\n0.00,0,1,0,0,0,0\\n0.01,0,1,0,0,0,0\\n"))
    >>> log.accel_g.tolist()
    [[0.0, 1.0, 0.0], [0.0, 1.0, 0.0]]
    >>> log.to_pandas().columns.tolist()
    ['t_s', 'ax_g', 'ay_g', 'az_g', 'gx_dps', 'gy_dps', 'gz_dps', 'speed_mps', 'lat_deg', 'lon_deg', 'utc_s', 'temp_c']
    """
    if isinstance(source, Stretch):
        log = read_log(source.source, 0, progress)
        log = log.between(source.from_s, source.to_s)
    else:
        log = source if isinstance(source, Log) else _parsed(source, progress)
    count = len(log.t_s)
    if count > MOST_SAMPLES:
        raise _too_long(log.name)
    if count < minimum:
        raise InputError(f"{log.name} is too short: {count} samples, at least {minimum} are needed")
    return log


def check_first_line(log: Path) -> None:
    """Raise InputError if the first line of a file is not the header of a log, or if no other line follows."""
    with contextlib.closing(chunks(log, CHUNK_BYTES, [])) as pieces:
        first, _ = next(pieces, (b"", 0))
        _, rest = _header(str(log), first)
        if not rest.strip() and not any(text.strip() for text, _ in pieces):
            raise InputError(f"{log} is empty: there are no readings below the names of its columns")


def is_log(path: Path) -> bool:
    try:
        check_first_line(path)
        return True
    except InputError:
        return False


def text_rows(file: Path | str, progress: Progress | None = None) -> Iterator[tuple[tuple[str, ...], list[str]]]:
    """Yield the names of the columns and many rows of a log, one string per sample of read_log() and cut last row."""
    pieces, total = chunks(file, CHUNK_BYTES, []), total_bytes(file)
    first, position = next(pieces, (b"", 0))
    names, rest = _header(str(file), first)
    for text, done in itertools.chain([(rest, position)], pieces):
        yield tuple(names), [line for line in text.decode().split("\n") if line.strip()]
        if progress:
            progress(done, total)


def time_texts(source: Source, log: Log, rows: slice = slice(None)) -> Iterator[str]:
    """Yield the times of these rows of a log as texts. Times that reading has not changed are copied from the file."""
    file = source.source if isinstance(source, Stretch) else source
    if not isinstance(file, (Path, str)) or not log.own_times:
        return iter([f"{log.start_s + t:.6f}" for t in log.t_s[rows].tolist()])
    lines = ((names, line) for names, many in text_rows(file) for line in many)
    begin, end, _ = rows.indices(len(log.t_s))
    return (cells_of(line)[names.index("t_s")].strip() for names, line in itertools.islice(lines, begin, end))


def _too_long(name: str) -> InputError:
    return InputError(f"{name} has over {MOST_SAMPLES / 1e6:.0f} million samples: kickstand cut writes a part of it")


def _compact(column: Array) -> Array | Sparse:
    rows = np.flatnonzero(~np.isnan(column))
    return Sparse(rows.astype(np.int32), column[rows], len(column)) if 2 * len(rows) < len(column) else column


def _joined(parts: list[Array | Sparse]) -> Array | Sparse:
    """Join the parts of a column. Clear the list, so that the parts of each column are freed before the next one."""
    column = np.concatenate([np.zeros(0), *(part[:] for part in parts)])
    parts.clear()
    return _compact(column)


def _parsed(file: File, progress: Progress | None) -> Log:
    # An error holds the frames that it went through, so without closing() the file would stay open as long as the error
    notices: list[Message] = []
    with contextlib.closing(chunks(file, CHUNK_BYTES, notices)) as pieces:
        columns = _columns(pieces, name_of(file), notices, total_bytes(file), progress)
    return _log(name_of(file), columns, notices)


def _columns(
    pieces: Iterator[tuple[bytes, int]], name: str, notices: list[Message], total: int, progress: Progress | None
) -> dict[str, Any]:
    """Read all columns of a log, NaN for a missing value. total: number of bytes. Raises InputError."""
    first, position = next(pieces, (b"", 0))
    names, rest = _header(name, first)
    index = {column: names.index(column) for column in COLUMNS + OPTIONAL if column in names}
    columns: dict[str, list[Array | Sparse]] = {column: [] for column in COLUMNS + OPTIONAL}
    line, count, last_us = 1, 0, None
    for text, done, is_last in _last_marked(itertools.chain([(rest, position)], pieces)):
        if is_last:
            text, cut = _without_cut_line(text, names, index)
            notices += [CutLine(line + text.count(b"\n") + 1)] if cut else []
        table = _numbers(name, text, names, index, line, last_us)
        line, count = line + text.count(b"\n"), count + len(table)
        if count > MOST_SAMPLES:
            raise _too_long(name)
        if len(table):
            last_us = round(table[-1, 0] * 1e6)
            nothing = np.full(len(table), np.nan)
            values = dict(zip(index, table.T))
            for column, parts in columns.items():
                parts.append(_compact(values.get(column, nothing).copy()))
        if progress:
            progress(done, total)
    return {name: _joined(parts) for name, parts in columns.items()}


def _log(name: str, columns: dict[str, Any], notices: list[Message]) -> Log:
    """Make a log of the columns of a file. The times begin at 0 and are made even; a notice is added if that shows."""
    time_us = np.rint(columns.pop("t_s") * 1e6)
    start_s = float(time_us[0]) / 1e6 if len(time_us) else 0.0
    t_s = (time_us - round(start_s * 1e6)) * 1e-6
    del time_us
    times = even_times(t_s, name)
    own_times = times is t_s or np.array_equal(times, t_s)
    if not own_times:
        repeated, shift_s = int(np.count_nonzero(np.diff(t_s) == 0.0)), float(np.max(np.abs(times - t_s)))
        if repeated or shift_s >= REPORTED_S:
            notices.append(TimesSpread(repeated, len(t_s), shift_s))
        time_us = np.rint(times * 1e6)
        start_s += float(time_us[0]) / 1e6
        order = np.arange(float(len(times)))  # keeps each step at 1 us or more
        t_s = (np.maximum.accumulate(time_us - time_us[0] - order) + order) * 1e-6
    force, rate = (np.array([columns.pop(axis) for axis in axes]).T for axes in (COLUMNS[1:4], COLUMNS[4:7]))
    log = Log(t_s, force, rate, temperature_c=columns.pop("temp_c")[:], name=name, notices=notices, **columns)
    log.start_s, log.own_times = start_s, own_times
    return log


def _header(log: str, first: bytes) -> tuple[list[str], bytes]:
    """Split the first chunk of a log into the names of its columns and the bytes after the header.

    log: the log's name in messages.
    """
    first = first.removeprefix(b"\xef\xbb\xbf")
    if not first.strip():
        raise InputError(f"{log} is empty: a log starts with the line {','.join(COLUMNS)}")
    header, _, rest = first.partition(b"\n")
    check_text(log, header, lines_before=0)
    try:
        return header_names(log, header.decode()), rest
    except InputError:
        check_text(log, first, lines_before=0)  # if the file is not text at all, say that instead
        raise


def _numbers(name: str, text: bytes, names: list[str], index: dict[str, int], line: int, last_us: int | None) -> Array:
    """Convert the text of n rows to numbers, in the order of `index`, shape (n, number of columns).

    line: number of lines before the text.
    last_us: time of the previous sample, None for the first.
    """
    table = numbers_in(text, len(names))
    if table is not None and is_plausible(table[:, list(index.values())], list(index), last_us):
        return table[:, list(index.values())]
    check_text(name, text, line)
    return numbers_by_line(name, text.decode(), len(names), index, line, last_us)


def _last_marked(parts: Iterator[tuple[bytes, int]]) -> Iterator[tuple[bytes, int, bool]]:
    previous = next(parts, None)
    for part in parts:
        if previous:
            yield *previous, False
        previous = part
    if previous:
        yield *previous, True


def _without_cut_line(text: bytes, names: list[str], index: dict[str, int]) -> tuple[bytes, bytes]:
    """Return the text without the last line, and this line, if it was cut; otherwise the text, and an empty line.

    The last line was cut if it has fewer cells than the log has columns. A last line without a line end was also cut in
    two other cases: it cannot be read, or its last number has fewer decimals than the last number of the previous line.
    """
    lines, _, last = text.rstrip().rpartition(b"\n")
    if not last or last.count(b'"'):
        return text, b""
    cut = last.count(b",") + 1 < len(names)
    if not cut and not text.endswith(b"\n"):
        above = lines.rpartition(b"\n")[2]
        half = not last.endswith(b",") and _digits(last) < _digits(above)
        cut = half or not _readable(last, names, index)
    return (lines + b"\n" if lines else b"", last) if cut else (text, b"")


def _readable(line: bytes, names: list[str], index: dict[str, int]) -> bool:
    try:
        return len(numbers_by_line("", line.decode(), len(names), index, 0, None)) == 1
    except (InputError, UnicodeDecodeError):
        return False


def _digits(line: bytes) -> int:
    """Return the number of decimals in the last cell; 0 for an empty cell."""
    return len(line.rpartition(b",")[2].strip().partition(b".")[2])


def write_log(path: Path | str, log: Log) -> None:
    """Write a log in memory to a CSV file, gzipped if the name ends in .gz. Raises InputError.

    After an error, no incomplete file remains. Optional columns without any value are left out. The column t_s has the
    recorder's own time.

    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as directory:
    ...     write_log(f"{directory}/log.csv", Log([0.0, 0.01], [[0.0, 1.0, 0.0]] * 2, [[0.0, 0.0, 0.0]] * 2))
    ...     print(Path(directory, "log.csv").read_text().splitlines()[1])
    0.000000,0.000000,1.000000,0.000000,0.000000,0.000000,0.000000
    """
    values = log.columns()
    values["t_s"] = values["t_s"] + log.start_s
    names = [*COLUMNS, *[name for name in OPTIONAL if np.any(np.isfinite(values[name]))]]
    digits = [DIGITS.get(name, 6) for name in names]
    table = np.column_stack([values[name] for name in names])
    write_lines(Path(path), names, csv_lines(table, digits))


def cut_log(
    source: Path | str,
    out: Path,
    from_s: float | None = None,
    to_s: float | None = None,
    progress: Progress | None = None,
) -> tuple[int, float]:
    """Copy the lines of a stretch (see Stretch) of a log to the file `out`, as write_log() does.

    Returns the number of samples, and the time from the first to the last sample in s.

    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as directory:
    ...     log = Path(directory, "log.csv")
    ...     _ = log.write_text("t_s,ax_g,ay_g,az_g,gx_dps,gy_dps,gz_dps\\n0,0,1,0,0,0,0\\n1,0,1,0,0,0,0\\n")
    ...     cut_log(log, Path(directory, "cut.csv"), from_s=0.5)
    (1, 0.0)
    """
    log = read_log(source, 1, progress)
    rows = log.rows_between(from_s, to_s)
    copy_rows(source, out, rows)
    return rows.stop - rows.start, float(log.t_s[rows.stop - 1] - log.t_s[rows.start])


def copy_rows(source: Path | str, out: Path, rows: slice) -> None:
    """Copy the lines of some samples of a log to the file `out`, as cut_log()."""
    texts = text_rows(source)
    names, first = next(texts)

    def lines() -> Iterator[bytes]:
        begin, end = rows.start, rows.stop
        for many in itertools.chain([first], (many for _, many in texts)):
            yield "".join(f"{line}\n" for line in many[max(0, begin) : max(0, end)]).encode()
            begin, end = begin - len(many), end - len(many)

    write_lines(out, names, lines())
