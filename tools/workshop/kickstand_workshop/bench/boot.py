"""Measures the parts of the time from reset to the first lean on an emulated board.

boot() measures, and table() formats the result.
"""

import ast
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from kickstand_emulator import flash_image
from kickstand_emulator.emulate import Kind
from kickstand_tools.common import firmware_path
from rich.table import Table

_LIMIT_S = 10.0
_ROWS = 10  # number of modules in the table

# Each module is imported after the modules that it imports. So the time of a module does not contain the times of the
# modules that it imports.
_TIMED_IMPORTS = """
from time import ticks_diff, ticks_us
took = []
for name in {names}:
    start = ticks_us()
    __import__(name)
    took.append(ticks_diff(ticks_us(), start))
print("took", took)
"""


@dataclass(frozen=True)
class Boot:
    """The parts of a start. All times but the last count from power-on."""

    micropython_s: float  # time at which main.py begins
    starting_s: float  # time at which the display says that Kickstand starts
    sampling_s: float  # time at which the sensor is set up and samples
    lean_s: float  # time at which the display shows the first lean
    import_s: dict[str, float]  # time for importing each module, by its name


def boot(kind: Kind, world: Callable[[float], tuple], files: dict[str, bytes], compiled: bool = True) -> Boot:
    """Measure the parts of the start.

    kind: Class of the emulated board.
    world: Motion of the board, as for EmulatedDevice. The board must be upright and at rest.
    files: Calibration files of the board.
    compiled: True to install the firmware as .mpy files.

    Raises NotReached if one of these parts takes over 10 s.
    """
    board_files = flash_image.firmware(compiled, kind.MPY) | files
    with kind(world, board_files) as device:
        device.run_until(lambda: device.lcd()[1].startswith("starting"), _LIMIT_S, 0.001)
        starting_s = device.time_s
        device.run_until(lambda: device.board.sensor.fifo.count, _LIMIT_S, 0.001)
        sampling_s = device.time_s
        device.run_until(lambda: device.lcd()[0].startswith("Lean") and "°" in device.lcd()[0], _LIMIT_S, 0.001)
        lean_s = device.time_s
    return Boot(_micropython_s(kind, board_files), starting_s, sampling_s, lean_s, _imports(kind, world, board_files))


def table(result: dict[str, Any]) -> Table:
    """Format the result for a terminal. result: the fields of a Boot, by name."""
    rows = Table(title="From reset to the first lean, compiled: emulated ms")
    rows.add_column("what")
    rows.add_column("at", justify="right")
    rows.add_column("takes", justify="right")
    rows.add_row("main.py begins", f"{1000 * result['micropython_s']:.0f}", "")
    by_cost = sorted(result["import_s"].items(), key=lambda item: -item[1])
    rows.add_row(f"{len(by_cost)} imports, all", "", f"{1000 * sum(result['import_s'].values()):.0f}")
    for name, seconds in by_cost[:_ROWS]:
        rows.add_row("  " + name.removeprefix("kickstand."), "", f"{1000 * seconds:.0f}")
    rows.add_row("display says starting", f"{1000 * result['starting_s']:.0f}", "")
    rows.add_row("sensor samples", f"{1000 * result['sampling_s']:.0f}", "")
    took_s = result["lean_s"] - result["sampling_s"]
    rows.add_row("first lean on the display", f"{1000 * result['lean_s']:.0f}", f"{1000 * took_s:.0f}")
    return rows


def _micropython_s(kind: Kind, files: dict[str, bytes]) -> float:
    """Measure the time until MicroPython runs main.py, in s."""
    begun: list[bytes] = []
    with kind(files={**files, "/main.py": f"{kind.SINK}Sink().write(b'main')\n".encode()}) as device:
        device.listen(begun.append)  # on a Pico, Sink does not use USB, which starts later than main.py
        device.run_until(lambda: begun, _LIMIT_S, 0.001)
        return device.time_s


def _imports(kind: Kind, world: Callable[[float], tuple], files: dict[str, bytes]) -> dict[str, float]:
    names = ["kickstand.board.port", *in_order("kickstand.start", []), *in_order("kickstand.app", [])]
    names = list(dict.fromkeys(names))
    files = {path: content for path, content in files.items() if path.lstrip("/") != "main.py"}
    with kind(world, files) as device:
        output = device.exec(_TIMED_IMPORTS.format(names=names), _LIMIT_S)
    took_us = ast.literal_eval(output.split("took ")[1])
    return {name: us / 1e6 for name, us in zip(names, took_us, strict=True)}


def in_order(name: str, found: list[str]) -> list[str]:
    """Append a module to found, after the modules that it imports. Returns found."""
    for other in _imported(name):
        if other not in found:
            in_order(other, found)
    if name not in found:
        found.append(name)
    return found


def _imported(name: str) -> Iterator[str]:
    """Yield the firmware's modules that this module imports at its top level."""
    path = _path(name)
    package = name.split(".") if path.name == "__init__.py" else name.split(".")[:-1]
    for node in ast.parse(path.read_text(encoding="utf-8")).body:
        for inner in node.body if isinstance(node, ast.Try) else [node]:
            if isinstance(inner, ast.ImportFrom) and inner.level:
                base = package[: len(package) - inner.level + 1] + (inner.module or "").split(".") * bool(inner.module)
                modules = [".".join(base), *(".".join([*base, alias.name]) for alias in inner.names)]
                yield from (module for module in modules if _path(module).is_file() and "." in module)


def _path(name: str) -> Path:
    path = firmware_path.PACKAGE.parent.joinpath(*name.split("."))
    return path.with_suffix(".py") if path.with_suffix(".py").is_file() else path / "__init__.py"
