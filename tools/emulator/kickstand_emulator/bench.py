"""Measures time, memory and flash of the firmware on an emulated board.

bench() measures, and tables() formats the result.
"""

import ast
import re
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from kickstand.calibration.parameters import Calibration
from kickstand_sim.simulated_board.mpu6050 import Mpu6050
from kickstand_sim.simulation.scripted.script import Ride, accelerate, turn, upright
from kickstand_sim.simulation.scripted.sensor_errors import Sensor
from kickstand_tools.deploy import firmware_files
from rich.table import Table

from . import flash_image
from .emulate import Kind, device_class

_LIMIT_S = 10.0
_SINK_END = "\x02"  # the end of the output of Sink.write() on an ESP32, see esp32.py


@dataclass(frozen=True)
class Boot:
    micropython_s: float  # time at which main.py begins
    starting_s: float  # time at which the display says that Kickstand starts
    sampling_s: float  # time at which the sensor is set up and samples
    lean_s: float  # time at which the display shows the first lean


def _micropython_s(kind: Kind, files: dict[str, bytes]) -> float:
    begun: list[bytes] = []
    with kind(files={**files, "/main.py": f"{kind.SINK}Sink().write(b'main')\n".encode()}) as device:
        device.listen(begun.append)  # on a Pico, Sink does not use USB, which starts later than main.py
        device.run_until(lambda: begun, _LIMIT_S, 0.001)
        return device.time_s


class SampleCount:
    """Counts the samples of one sensor. The board may read the data registers or the FIFO."""

    def __init__(self, sensor: Mpu6050) -> None:
        self._sensor = sensor
        self.begin()

    def begin(self) -> None:
        self._begin = self._sensor.tally()
        self._bytes, self._waiting = self._sensor.fifo.bytes_read, self._sensor.fifo.count

    def taken(self) -> int:
        return self._sensor.tally().taken - self._begin.taken

    def delivered(self) -> int:
        if self._sensor.frame_bytes:
            return (self._sensor.fifo.bytes_read - self._bytes) // self._sensor.frame_bytes
        return self._sensor.tally().read - self._begin.read

    def lost(self) -> int:
        """Return the number of samples that are lost: overwritten, or removed from the FIFO before they were read."""
        samples, fifo = self.taken(), self._sensor.fifo  # taken() is called first, because it updates the FIFO
        if self._sensor.frame_bytes:
            accounted = fifo.bytes_read - self._bytes + fifo.count - self._waiting
            return samples - accounted // self._sensor.frame_bytes
        return max(0, samples - 1 - self.delivered())  # the latest sample can still be read


SAMPLE_HZ = 200  # samples per second, as in bench_guest.py
# Modules of this folder that run on the board: two, so that the fake radio takes memory only in the run that needs it
_GUEST = ("bench_guest", "bluetooth_guest")
_SENSOR = Sensor(seed=1, share=0.0)  # a sensor without errors, mounted at some angle
_SPEED_MPS = 15.0
_RIDE = [accelerate(_SPEED_MPS, 1.0)] + [turn(-30.0, 3.0), turn(35.0, 3.0)] * 20
_MODES: dict[str, dict[str, Any]] = {
    "aligning by driving": {"SPEED": "wheel"},
    "recording": {"RECORD": True},
    "with an OLED": {"DISPLAY": "ssd1306"},
    "live to a phone": {"LIVE": True},
    "driving, recording and OLED": {"SPEED": "wheel", "RECORD": True, "DISPLAY": "ssd1306"},
}


def bench(seconds: int = 10, chip: str = "rp2040") -> dict[str, Any]:
    """Measure all costs. This takes minutes.

    seconds: emulated time of each of six runs.
    chip: "rp2040" or "esp32".

    Returns the figures by name. A name ends with the figure's unit. Raises GuestError if the program on the board
    fails.
    """
    plain = loop(seconds, chip)
    modes = {name: loop(seconds, chip, chosen) for name, chosen in _MODES.items()}
    for mode in modes.values():
        mode["us_per_sample"] = (mode["cpu_share"] - plain["cpu_share"]) * 1e6 / SAMPLE_HZ
    return {
        "sample_hz": SAMPLE_HZ,
        **plain,
        "chip": chip,
        "modes": modes,
        "boot": {form: asdict(start(chip, form == "mpy")) for form in ("py", "mpy")},
        "flash_bytes": {
            form: sum(map(len, firmware_files.contents(device_class(chip).MPY if form == "mpy" else None).values()))
            for form in ("py", "mpy")
        },
    }


def tables(result: dict[str, Any]) -> Table:
    """Return the figures of a measurement as a table."""
    figures = Table(title=f"{result['sample_hz']} samples per second, {result['chip']}", show_header=False)
    turn = result["turn_us"]
    pause = result["collection_pause_us"]
    starts, size = result["boot"], result["flash_bytes"]
    for name, text in (
        ("a turn of the loop", ", ".join(f"{name} {turn[name]:.0f} us" for name in ("median", "p99", "max"))),
        ("CPU share", f"{100 * result['cpu_share']:.0f} %"),
        ("samples taken / lost", f"{result['samples_taken']} / {result['samples_lost']} in {result['seconds']:.1f} s"),
        ("heap taken by a sample", f"{result['heap_bytes_per_sample']} bytes"),
        ("collections", f"{result['collections_by_app']} by the app, {result['collections_automatic']} by themselves"),
        ("a collection takes", f"{pause['median'] / 1000:.1f} ms, at most {pause['max'] / 1000:.1f} ms"),
        (
            "free heap, start / end",
            f"{result['free_heap_bytes'] / 1024:.0f} / {result['free_heap_at_end_bytes'] / 1024:.0f} KB",
        ),
        *((f"while {name}", _mode_text(mode)) for name, mode in result["modes"].items()),
        ("reset to first lean", f"{starts['py']['lean_s']:.2f} s from .py, {starts['mpy']['lean_s']:.2f} s from .mpy"),
        ("names, of 1260", str(result["names"])),
        ("size on flash", f"{size['py'] / 1000:.1f} kB as .py, {size['mpy'] / 1000:.1f} kB as .mpy"),
    ):
        figures.add_row(name, text)
    return figures


def _mode_text(mode: dict[str, Any]) -> str:
    return (
        f"CPU {100 * mode['cpu_share']:.0f} %, {mode['us_per_sample']:+.0f} us a sample, {mode['samples_lost']} lost, "
        f"{mode['free_heap_bytes'] / 1024:.0f} / {mode['free_heap_at_end_bytes'] / 1024:.0f} KB free"
    )


def start(chip: str, compiled: bool = True) -> Boot:
    """Measure the parts of the start. The bike is upright and at rest.

    compiled: True to install .mpy files. Raises NotReached if a part takes over 10 s.
    """
    kind = device_class(chip)
    files = firmware_files.contents(kind.MPY if compiled else None) | _calibration()
    with kind(_SENSOR.world(Ride([upright(100.0)]).motion), files) as device:
        device.run_until(lambda: device.lcd()[1].startswith("starting"), _LIMIT_S, 0.001)
        starting_s = device.time_s
        device.run_until(lambda: device.board.sensor.fifo.count, _LIMIT_S, 0.001)
        sampling_s = device.time_s
        device.run_until(lambda: device.lcd()[0].startswith("Lean") and "°" in device.lcd()[0], _LIMIT_S, 0.001)
        lean_s = device.time_s
    return Boot(_micropython_s(kind, files), starting_s, sampling_s, lean_s)


def loop(seconds: int, chip: str = "rp2040", chosen: dict[str, Any] | None = None) -> dict[str, Any]:
    """Measure the costs of the app's loop. Returns the figures by name. A name ends with the unit, except of a number
    without one.

    seconds: emulated time of the run. chip: "rp2040" or "esp32". chosen: values of settings, by name.
    """
    counts, passes_us, pauses_us, output = _run_guest(device_class(chip), seconds, chosen or {})
    # On an ESP32 the output of each Sink is text too, and the figures follow the last one
    figures = ast.literal_eval(output.rpartition(_SINK_END)[2].strip().splitlines()[-1])
    pauses_us = pauses_us[: figures["collections_by_app"]]
    return {
        "seconds": figures["elapsed_us"] / 1e6,
        "turn_us": _spread(passes_us[: figures["turns"]]),
        "cpu_share": 1.0 - figures["slept_us"] / figures["elapsed_us"],
        "turns": figures["turns"],
        "samples_taken": counts["taken"],
        "samples_lost": counts["lost"],
        "heap_bytes_per_sample": round(figures["heap_bytes"] / max(1, counts["delivered_at_heap"])),
        "collections_by_app": figures["collections_by_app"],
        "collections_automatic": figures["collections_automatic"],
        "collection_pause_us": _spread(pauses_us if len(pauses_us) else np.array([figures["collect_us"]])),
        "free_heap_bytes": figures["free_before"],
        "free_heap_at_end_bytes": figures["free_after"],
        "names": int(re.findall(r"n_qstr=(\d+)", output)[-1]),
    }


def _run_guest(kind: Kind, seconds: int, chosen: dict[str, Any]) -> tuple[dict[str, int], np.ndarray, np.ndarray, str]:
    """Run bench_guest.run() on a board.

    Returns counts of samples, the two arrays that run() sends (us of each pass, and of each collection), and the
    board's output.
    """
    files = firmware_files.contents(kind.MPY) | _calibration()
    del files["/main.py"]
    for name in _GUEST:
        guest = Path(__file__).with_name(f"{name}.py")
        files[f"{name}.mpy"] = firmware_files.cross_compiled(guest, firmware_files.architecture(kind.MPY))
    arrays: list[np.ndarray] = []
    counts: dict[str, int] = {}
    with kind(_SENSOR.world(Ride(_RIDE).motion), files, display=chosen.get("DISPLAY", "lcd")) as device:
        samples = SampleCount(device.board.sensor)

        def take(data: bytes) -> None:
            if data == b"begin":
                samples.begin()
            elif data == b"heap":
                counts["delivered_at_heap"] = samples.delivered()
            elif data == b"end":
                counts.update(taken=samples.taken(), lost=samples.lost())
            else:
                arrays.append(np.frombuffer(data, np.uint16))

        device.listen(take)
        if chosen.get("SPEED") == "wheel":
            device.fit_wheel(lambda t_s: _SPEED_MPS)
        code = f"{device.SINK}import bench_guest\nbench_guest.run({seconds}, Sink(), {chosen})\n"
        output = device.exec(code, limit_s=2.0 * seconds + 30.0)
    passes_us, pauses_us = arrays
    return counts, passes_us, pauses_us, output


def _spread(us: np.ndarray) -> dict[str, float]:
    return {"median": float(np.median(us)), "p99": float(np.percentile(us, 99)), "max": float(us.max())}


def _calibration() -> dict[str, bytes]:
    calibration = Calibration()
    calibration.aligned = True
    for i, value in enumerate(_SENSOR.vehicle_from_sensor):
        calibration.vehicle_from_sensor[i] = value
    return flash_image.stored(calibration)
