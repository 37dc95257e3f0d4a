"""Creates the emulated boards for their tests, or skips a test that cannot have a board."""

import functools
import hashlib
import importlib
import re
import time
from collections.abc import Callable
from typing import Any

import pytest
from kickstand_sim.simulation.scripted.script import Ride, upright
from kickstand_sim.simulation.scripted.sensor_errors import Sensor
from kickstand_tools.common.messages import InputError
from kickstand_tools.deploy import firmware_files

PART = Sensor(seed=1, share=0.5)  # an ordinary sensor, mounted at some angle


def need(chip: str) -> None:
    """Skip the test if this chip, "pico" or "esp32", cannot be emulated here."""
    if reason := _lacking(chip):
        pytest.skip(reason)


@functools.cache  # cached, so that a missing package is not downloaded for each test
def _lacking(chip: str) -> str:
    """Return the reason why this chip cannot be emulated, or "" if it can."""
    from kickstand_emulator import image

    try:
        if chip == "esp32":
            image.find_esp32()
        else:
            image.find()
            importlib.import_module("kickstand_emulator.pico")
    except InputError as reason:
        return str(reason)
    except ImportError as reason:
        return f"no emulator of the {chip} for this system: {reason}"
    return ""


def pico(world: Callable[[float], tuple] | None = None, files: dict[str, bytes] | None = None, **fitted: Any):
    """Return an emulated Pico that is off. Skip the test if the emulator or the MicroPython image is missing."""
    need("pico")
    from kickstand_emulator.pico import Pico

    return Pico(world, files, **fitted)


def esp32(world: Callable[[float], tuple] | None = None, files: dict[str, bytes] | None = None, **fitted: Any):
    """Return an emulated ESP32 that is off. Skip the test if QEMU's library is missing."""
    need("esp32")
    from kickstand_emulator.esp32 import Esp32

    return Esp32(world, files, **fitted)


CHIPS = {"pico": pico, "esp32": esp32}
MPY = {"pico": firmware_files.PICO, "esp32": firmware_files.ESP32}


@functools.cache
def firmware(chip: str = "pico") -> dict[str, bytes]:
    """Return the firmware's compiled files. With compiled files, a board starts in half the time."""
    return firmware_files.contents(MPY[chip])


def modules(chip: str = "pico") -> dict[str, bytes]:
    """Return the firmware without main.py, so the board waits at its prompt."""
    return {path: content for path, content in firmware(chip).items() if path != "/main.py"}


@functools.cache
def calibrated(who_am_i: int = 0x68) -> dict[str, bytes]:
    """Return the calibration files of PART: mounting, gyro bias and accelerometer."""
    from kickstand.calibration.parameters import Calibration
    from kickstand_emulator import flash_image

    calibration = Calibration()
    calibration.six_done = calibration.aligned = True
    calibration.set_accel(
        [-o / s for o, s in zip(PART.accel_offset_g, PART.accel_scale, strict=True)],
        [1.0 / s for s in PART.accel_scale],
    )
    for i in range(3):
        calibration.gyro_bias[i] = PART.gyro_bias_dps[i]
    for i in range(9):
        calibration.vehicle_from_sensor[i] = PART.vehicle_from_sensor[i]
    return flash_image.stored(calibration, who_am_i)


def begun(pause_s: float) -> tuple[int, str]:
    """Start a Pico without files. Return its cycles and a hash of its memory 0.15 s after power-on.

    pause_s: duration of the pauses that the host makes meanwhile.
    """
    with pico() as device:
        device.run(0.15, lambda: time.sleep(pause_s))
        return device.chip.rp2040.core.cycles, hashlib.sha256(bytes(device.chip.rp2040.sram)).hexdigest()


def leaning(lean_deg: float) -> Callable[[float], tuple]:
    """Return world(t_s) of PART on a bike that is held at this lean."""
    return PART.world(Ride([upright(1e6, lean_deg=lean_deg)]).motion)


def shows(device, pattern: str, limit_s: float) -> re.Match:
    """Advance the time until the display's two lines match, joined by "|". Return the match."""
    return device.run_until(lambda: re.search(pattern, "|".join(device.lcd())), limit_s)


def reset_in_a_read(device, at_s: float) -> None:
    """Reset the processor at at_s or soon after, while the sensor is sending."""

    def act() -> None:
        if device.reading:
            device.reset()
        else:
            device.board.at(device.time_s + 5e-6, act)

    device.board.at(at_s, act)
