"""Measures time, memory and flash of the firmware on an emulated board.

bench() measures, and tables() formats the result.
"""

import ast
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from kickstand.calibration.parameters import Calibration
from kickstand_emulator import flash_image
from kickstand_emulator.emulate import device_class
from kickstand_tools.deploy.bytecode import architecture, cross_compiled
from kickstand_tools.simulation.scripted.script import Ride, accelerate, turn, upright
from kickstand_tools.simulation.scripted.sensor_errors import Sensor
from rich.console import Group
from rich.table import Table

from . import boot
from .sample_count import SampleCount

SAMPLE_HZ = 200  # samples per second, as in bench_guest.py
_GUEST = ("bench_guest", "stages_guest", "bluetooth_guest")  # modules of this folder that run on the board
_SENSOR = Sensor(seed=1, share=0.0)  # a sensor without errors, mounted at some angle
_SPEED_MPS = 15.0
_RIDE = [accelerate(_SPEED_MPS, 1.0)] + [turn(-30.0, 3.0), turn(35.0, 3.0)] * 20
_MODES: dict[str, dict[str, Any]] = {
    "aligning by driving": {"SPEED": "wheel"},
    "recording": {"RECORD": True},
    "with an OLED": {"DISPLAY": "ssd1306"},
    "live to a phone": {"LIVE": True},
}


def bench(seconds: int = 10, chip: str = "rp2040") -> dict[str, Any]:
    """Measure all costs. This takes minutes.

    seconds: emulated time of each run. A Pico needs six runs, and an ESP32 five, because its stages are not measured.
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
        "stage_us": {name: _spread(us) for name, us in _stages(_run(chip, seconds, detail=True)).items()}
        if chip == "rp2040"  # on an ESP32, recording the time of a stage takes longer than the stage
        else {},
        "modes": modes,
        "boot": {form: asdict(start(chip, form == "mpy")) for form in ("py", "mpy")},
        "flash_bytes": {form: _size(form == "mpy", device_class(chip).MPY) for form in ("py", "mpy")},
    }


def tables(result: dict[str, Any]) -> Group:
    """Format the result of bench() for a terminal."""
    title = f"A turn of the loop at {result['sample_hz']} samples per second: emulated us, {result['chip']}"
    times = Table(title=title)
    times.add_column("stage")
    for name in ("median", "p99", "max"):
        times.add_column(name, justify="right")
    for name, spread in (*result["stage_us"].items(), ("whole turn", result["turn_us"])):
        times.add_row(name, *(f"{spread[key]:.0f}" for key in ("median", "p99", "max")))
    figures = Table(show_header=False)
    pause = result["collection_pause_us"]
    starts, size = result["boot"], result["flash_bytes"]
    for name, text in (
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
        ("size on flash", f"{size['py'] / 1000:.1f} kB as .py, {size['mpy'] / 1000:.1f} kB as .mpy"),
    ):
        figures.add_row(name, text)
    return Group(times, boot.table(starts["mpy"]), figures)


def _mode_text(mode: dict[str, Any]) -> str:
    return (
        f"CPU {100 * mode['cpu_share']:.0f} %, {mode['us_per_sample']:+.0f} us a sample, {mode['samples_lost']} lost, "
        f"{mode['free_heap_bytes'] / 1024:.0f} / {mode['free_heap_at_end_bytes'] / 1024:.0f} KB free"
    )


def start(chip: str, compiled: bool = True) -> boot.Boot:
    """Measure the time from power-on to the first lean. The bike is upright and at rest.

    compiled: True to install the firmware as .mpy files.
    """
    return boot.boot(device_class(chip), _SENSOR.world(Ride([upright(100.0)]).motion), _calibration(), compiled)


def loop(seconds: int, chip: str = "rp2040", chosen: dict[str, Any] | None = None) -> dict[str, Any]:
    """Measure the costs of the app's loop.

    seconds: emulated time of the run. chip: "rp2040" or "esp32". chosen: values of settings, by name.

    Returns the figures by name. A name ends with the figure's unit.
    """
    run = _run(chip, seconds, chosen=chosen)
    figures = run["figures"]
    return {
        "seconds": figures["elapsed_us"] / 1e6,
        "turn_us": _spread(run["took"]),
        "cpu_share": 1.0 - figures["slept_us"] / figures["elapsed_us"],
        "turns": figures["turns"],
        "samples_taken": run["taken"],
        "samples_lost": run["lost"],
        "heap_bytes_per_sample": round(figures["heap_bytes"] / max(1, run["heap_samples"])),
        "collections_by_app": figures["collections_by_app"],
        "collections_automatic": figures["collections_automatic"],
        "collection_pause_us": _spread(run["pauses"]),
        "free_heap_bytes": figures["free_before"],
        "free_heap_at_end_bytes": figures["free_after"],
    }


def _run(chip: str, seconds: int, detail: bool = False, chosen: dict[str, Any] | None = None) -> dict[str, Any]:
    """Run the app's loop on the emulated board.

    seconds: emulated time. detail: True to measure the stages of a pass of the loop too. chosen: values of settings, by
        name.

    Returns the figures and arrays of bench_guest.py, and the numbers of samples that were taken and lost.
    """
    chosen = chosen or {}
    mpy = device_class(chip).MPY
    files = flash_image.firmware(True, mpy) | _calibration()
    del files["/main.py"]
    folder = Path(__file__).parent
    files |= {f"{name}.mpy": cross_compiled(folder / f"{name}.py", architecture(mpy)) for name in _GUEST}
    arrays: list[np.ndarray] = []
    stages: list[np.ndarray] = []
    result: dict[str, Any] = {}
    with device_class(chip)(_SENSOR.world(Ride(_RIDE).motion), files, display=chosen.get("DISPLAY", "lcd")) as device:
        samples = SampleCount(device.board.sensor)

        def take(data: bytes) -> None:
            if data == b"begin":
                samples.begin()
            elif data == b"heap":
                result["heap_samples"] = samples.delivered()
            elif data == b"end":
                result.update(taken=samples.taken(), lost=samples.lost())
            elif "taken" not in result:
                stages.append(np.frombuffer(data, np.uint32))
            else:
                arrays.append(np.frombuffer(data, np.uint16))

        device.listen(take)
        if chosen.get("SPEED") == "wheel":
            device.fit_wheel(lambda t_s: _SPEED_MPS)
        code = f"{device.SINK}import bench_guest\nbench_guest.run({detail}, {seconds}, Sink(), {chosen})\n"
        output = device.exec(code, limit_s=2.0 * seconds + 30.0)
        # The figures follow the output of a Sink
        result["figures"] = ast.literal_eval(output.rpartition("\x02")[2].strip())
    turns = result["figures"]["turns"]
    result["took"] = arrays[0][:turns]
    asked_for = arrays[1][: result["figures"]["collections_by_app"]]
    result["pauses"] = asked_for if len(asked_for) else np.array([result["figures"]["collect_us"]])
    if detail:
        result["stages"] = np.array(stages).astype(int)
    return result


def _stages(run: dict[str, Any]) -> dict[str, np.ndarray]:
    """Return the times of each stage in us, one for each pass of the loop in which the stage ran."""
    columns = dict(zip(run["figures"]["stages"], run["stages"].T, strict=True))
    sampled = columns["decode and sum"] > 0
    watch = run["figures"]["stopwatch_us"]
    # The stage of the sensor contains three timed calls: two transfers and add_up()
    fetch = columns["fetch"] - 3 * watch
    meter = columns["meter"] - 2 * watch
    stages = {
        "read": columns["read"],
        "decode and sum": columns["decode and sum"],
        "check": fetch - columns["read"] - columns["decode and sum"],
        "calibrate and rotate": columns["calibrate and rotate"],
        "filter": columns["filter"],
        "rest of the meter": meter - columns["calibrate and rotate"] - columns["filter"],
        "sample path": fetch + meter,
    }
    stages = {name: us[sampled] for name, us in stages.items()}
    stages["page"] = columns["page"][columns["page"] > 0]
    stages["display"] = columns["display"]
    return stages


def _spread(us: np.ndarray) -> dict[str, float]:
    return {"median": float(np.median(us)), "p99": float(np.percentile(us, 99)), "max": float(us.max())}


def _calibration() -> dict[str, bytes]:
    """Return the calibration files of _SENSOR. The calibration contains only the alignment."""
    calibration = Calibration()
    calibration.aligned = True
    for i, value in enumerate(_SENSOR.vehicle_from_sensor):
        calibration.vehicle_from_sensor[i] = value
    return flash_image.stored(calibration)


def _size(compiled: bool, mpy: int) -> int:
    return sum(len(content) for content in flash_image.firmware(compiled, mpy).values())
