"""Tables of numbers as lines of CSV, quickly; a log in memory as a file."""

import gzip
from pathlib import Path

import numpy as np

from ..output import write_whole
from .cells import COLUMNS, OPTIONAL
from .log import Log
from .table import Array

_DIGITS = {"speed_mps": 3, "temp_c": 2, "lat_deg": 7, "lon_deg": 7, "utc_s": 3}
_ROWS = 60_000  # written at a time


def csv_lines(table: Array, digits: list[int]) -> str:
    """(n, m) with digits[k] after the point in column k; NaN is an empty cell."""
    form = ",".join(f"%.{digit}f" for digit in digits) + "\n"
    return "".join([form % tuple(row) for row in table.tolist()]).replace("nan", "")


def write_log(path: Path | str, log: Log) -> None:
    """Write a log, gzipped if the name ends in .gz, whole or not at all. Raises InputError.

    Of the columns that may be empty those that have a value; t_s is the recorder's own time.

    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as directory:
    ...     write_log(Path(directory, "log.csv"), Log([0.0, 0.01], [[0.0, 1.0, 0.0]] * 2, [[0.0, 0.0, 0.0]] * 2))
    ...     print(Path(directory, "log.csv").read_text().splitlines()[1])
    0.000000,0.000000,1.000000,0.000000,0.000000,0.000000,0.000000
    """
    path = Path(path)
    values = log.columns()
    values["t_s"] = values["t_s"] + log.start_s
    names = [*COLUMNS, *[name for name in OPTIONAL if np.any(np.isfinite(values[name]))]]
    digits = [_DIGITS.get(name, 6) for name in names]
    table = np.column_stack([values[name] for name in names])

    def write(temporary: Path) -> None:
        opened = gzip.open if path.suffix == ".gz" else open
        with opened(temporary, "wt", encoding="ascii", newline="") as file:
            file.write(",".join(names) + "\n")
            for begin in range(0, len(table), _ROWS):
                file.write(csv_lines(table[begin : begin + _ROWS], digits))

    write_whole(path, write)
