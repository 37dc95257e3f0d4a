"""A stretch of a log written as a log of its own."""

import gzip
from pathlib import Path

from kickstand.errors import Notice

from ..output import write_whole
from .reader import read_blocks
from .source import File, Progress
from .stretch import Stretch


def cut_log(
    source: File,
    out: Path,
    from_s: float | None = None,
    to_s: float | None = None,
    progress: Progress | None = None,
    notices: list[Notice] | None = None,
) -> tuple[int, float]:
    """Write from from_s to to_s of a log to out, line for line, gzipped if its name ends in .gz, whole or not at all.

    from_s, to_s: seconds since the log's first sample; negative: before its last one; None: to its end there. Returns
    the number of samples and the seconds that they last. progress, notices: of read_blocks(). Raises InputError.

    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as directory:
    ...     log = Path(directory, "log.csv")
    ...     _ = log.write_text("t_s,ax_g,ay_g,az_g,gx_dps,gy_dps,gz_dps\\n0,0,1,0,0,0,0\\n1,0,1,0,0,0,0\\n")
    ...     cut_log(log, Path(directory, "cut.csv"), from_s=0.5)
    (1, 0.0)
    """
    count, seconds = 0, 0.0

    def write(temporary: Path) -> None:
        nonlocal count, seconds
        opened = gzip.open if out.suffix == ".gz" else open
        with opened(temporary, "wt", encoding="utf-8", newline="") as file:
            for block in read_blocks(Stretch(source, from_s, to_s), 1, progress, notices):
                if not count:
                    file.write(",".join(block.names) + "\n")
                file.write("\n".join(block.lines) + "\n")
                count, seconds = count + len(block.lines), float(block.t_s[-1])

    write_whole(out, write)
    return count, seconds
