"""A recorded log through the firmware's own LeanMeter, by one of several engines, block by block."""

import io
import struct
import subprocess
import sys
import tempfile
from collections.abc import Iterable, Iterator
from pathlib import Path

import numpy as np

from .. import unix_port
from ..calibration.file import CalibrationFile
from ..errors import InputError
from ..logs.rate_unit import RateUnit
from ..logs.reader import Block, read_blocks, write_table
from ..progress import Bar
from . import replay_engine
from .forward_sign import ForwardSign, exchanged_line

_CHUNK = 500  # samples between two steps of the progress bar of an emulated Pico

_FORWARD = replay_engine.COLUMNS.index("forward_g")

Row = tuple[float, ...]


def replay(log: Path, calibration: CalibrationFile, engine: str, out: Path) -> int:
    """Write LEAN.csv: the log's own times, then replay_engine.COLUMNS. Returns how many samples.

    Raises InputError, also where the engine is not to be had. Memory does not grow with the log, but on the
    emulated Pico, which no long log is for.
    """
    if engine == "micropython" and not unix_port.available():
        raise InputError("engine micropython has no package for this system: use --engine cpython")
    count, sign = 0, ForwardSign()

    def rows() -> Iterator[list[str]]:
        nonlocal count
        for block, results in _RUN[engine](log, calibration):
            count += len(results)
            forward = np.array([row[_FORWARD] for row in results])
            sign.add(block.time_us.astype(float) * 1e-6, forward, block.speed_mps[: len(forward)])
            for time, row in zip(block.time_text, results, strict=True):
                yield [time, *(f"{value:.5f}" for value in row)]

    write_table(out, ("t_s", *replay_engine.COLUMNS), rows())
    if calibration.aligned and sign.exchanged:
        line = exchanged_line(calibration.vehicle == "car", calibration.side)
        warn(f"{log}: {line}")
    return count


def with_progress(path: Path, what: str) -> Iterator[Block]:
    """The blocks of a log with a progress bar, by how much of the file they are; after them a remark, if need be."""
    before, size = 0, path.stat().st_size if path.is_file() else 0
    rates = RateUnit()
    with Bar(what, size) as bar:
        for block in read_blocks(path):
            rates.add(block.time_us.astype(float) * 1e-6, block.readings[:, :3], block.readings[:, 4:])
            yield block
            bar.advance(block.bytes_read - before)
            before = block.bytes_read
    if rates.remark:
        warn(f"{path}: {rates.remark}")


def warn(remark: str) -> None:
    """A line on standard error."""
    print(f"warning: {remark}", file=sys.stderr)


def _cpython(log: Path, calibration: CalibrationFile) -> Iterator[tuple[Block, list[Row]]]:
    engine = replay_engine.Replay(calibration.to_firmware())
    for block in with_progress(log, "replaying"):
        yield block, [engine.step(*row) for row in block.rows()]


def _micropython(log: Path, calibration: CalibrationFile) -> Iterator[tuple[Block, list[Row]]]:
    size = struct.calcsize(replay_engine.RESULT)
    with tempfile.TemporaryDirectory() as directory:
        records = Path(directory) / "records"
        with records.open("wb") as file:
            file.writelines(_records(read_blocks(log), calibration))
        command = unix_port.command(replay_engine.__file__, str(records))
        with subprocess.Popen(command, env=unix_port.environment(), stdout=subprocess.PIPE) as process:
            assert process.stdout is not None
            results = b""
            for block in with_progress(log, "replaying"):
                results = process.stdout.read(size * len(block.time_us))
                if len(results) < size * len(block.time_us):
                    break
                yield block, list(struct.iter_unpack(replay_engine.RESULT, results))
            results += process.stdout.read()
        if process.returncode != 0:  # its traceback went to standard output too
            reason = results.decode(errors="replace").strip().rpartition("\n")[2]
            raise InputError(f"MicroPython stopped ({reason}): use --engine cpython")


def _rp2040(log: Path, calibration: CalibrationFile) -> Iterator[tuple[Block, list[Row]]]:
    from ..emulator import image

    image.find()  # before the rest, which needs what this misses
    from . import emulated as emulated

    size = struct.calcsize(replay_engine.RESULT)
    records = b"".join(_records(read_blocks(log), calibration))
    results = io.BytesIO()
    with Bar("replaying", len(records) // struct.calcsize(replay_engine.RECORD)) as bar:

        def sink(result: bytes) -> None:
            results.write(result)
            if results.tell() % (_CHUNK * size) == 0:
                bar.advance(_CHUNK)

        emulated.run(records, sink)
    results.seek(0)
    for block in with_progress(log, "writing"):
        yield block, list(struct.iter_unpack(replay_engine.RESULT, results.read(size * len(block.time_us))))


_RUN = {"cpython": _cpython, "micropython": _micropython, "rp2040": _rp2040}


def _records(blocks: Iterable[Block], calibration: CalibrationFile) -> Iterator[bytes]:
    """What replay_engine.run reads."""
    yield struct.pack(replay_engine.CALIBRATION, *calibration.parameters())
    for block in blocks:
        for time_us, reading, speed in block.rows():
            given = speed if speed >= 0.0 else replay_engine.NO_SPEED  # not so where it is not a number
            yield struct.pack(replay_engine.RECORD, time_us, *reading, given)
