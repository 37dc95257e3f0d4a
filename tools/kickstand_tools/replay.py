"""A recorded log through the firmware's own LeanMeter, by one of several engines."""

import io
import struct
import subprocess
import tempfile
from pathlib import Path

from . import firmware_path, unix_port
from .calibration_file import CalibrationFile
from .errors import InputError
from .logs import Log, write_table
from .progress import Bar

firmware_path.add_to_path()
from . import replay_engine  # noqa: E402

ENGINES = ("cpython", "micropython", "rp2040")
_CHUNK = 500  # samples between two steps of the progress bar


def replay(log: Log, calibration: CalibrationFile, engine: str) -> list[tuple[float, ...]]:
    """replay_engine.COLUMNS for each sample. Raises InputError where the engine is not to be had."""
    if engine == "micropython" and not unix_port.available():
        raise InputError("engine micropython has no package for this system: use --engine cpython")
    with Bar("replaying", len(log.readings)) as bar:
        results = _RUN[engine](log, calibration, bar)
    return list(struct.iter_unpack(replay_engine.RESULT, results))


def write_results(path: Path, log: Log, results: list[tuple[float, ...]]) -> None:
    """Write LEAN.csv: the log's own times, then replay_engine.COLUMNS."""
    rows = ([t, *(f"{value:.5f}" for value in row)] for t, row in zip(log.time_text, results, strict=True))
    write_table(path, ("t_s", *replay_engine.COLUMNS), rows)


class _Sink(io.BytesIO):
    """Collects results and moves the bar on."""

    def __init__(self, bar: Bar) -> None:
        super().__init__()
        self._bar = bar
        self._count = 0

    def write(self, data, /) -> int:
        self._count += 1
        if self._count % _CHUNK == 0:
            self._bar.advance(_CHUNK)
        return super().write(data)


def _cpython(log: Log, calibration: CalibrationFile, bar: Bar) -> bytes:
    sink = _Sink(bar)
    replay_engine.run(io.BytesIO(_records(log, calibration)), sink)
    return sink.getvalue()


def _rp2040(log: Log, calibration: CalibrationFile, bar: Bar) -> bytes:
    from .emulator import image

    image.find()  # before the rest, which needs what this misses
    from .emulator import replay as emulated

    sink = _Sink(bar)
    emulated.run(_records(log, calibration), sink.write)
    return sink.getvalue()


def _micropython(log: Log, calibration: CalibrationFile, bar: Bar) -> bytes:
    results = b""
    with tempfile.TemporaryDirectory() as directory:
        records = Path(directory) / "records"
        records.write_bytes(_records(log, calibration))
        command = unix_port.command(replay_engine.__file__, str(records))
        with subprocess.Popen(command, env=unix_port.environment(), stdout=subprocess.PIPE) as process:
            assert process.stdout is not None
            while chunk := process.stdout.read(_CHUNK * struct.calcsize(replay_engine.RESULT)):
                results += chunk
                bar.advance(_CHUNK)
    if process.returncode != 0:  # its traceback went to standard output too
        reason = results.decode(errors="replace").strip().rpartition("\n")[2]
        raise InputError(f"MicroPython stopped ({reason}): use --engine cpython")
    return results


_RUN = {"cpython": _cpython, "micropython": _micropython, "rp2040": _rp2040}


def _records(log: Log, calibration: CalibrationFile) -> bytes:
    """What replay_engine.run reads."""
    values = calibration.offset + calibration.slope + calibration.bias + calibration.matrix + [calibration.trim]
    records = [struct.pack(replay_engine.CALIBRATION, *values)]
    for time_us, reading in zip(log.time_us, log.readings, strict=True):
        records.append(struct.pack(replay_engine.RECORD, time_us, *reading))
    return b"".join(records)
