"""The firmware's mathematics with the chip's 32-bit floats and 31-bit small integers, compared with the other
engines."""

import io
import json
import struct
import subprocess
import time
from pathlib import Path

import numpy as np
import pytest
from kickstand.drive_alignment import alignment
from kickstand.drive_alignment.quality import MIN_EVENTS
from kickstand_sim.simulation.scripted.script import Ride, accelerate, turn
from kickstand_sim.simulation.scripted.sensor_errors import random_mounting
from kickstand_tools.common import installation
from kickstand_tools.deploy import firmware_files
from kickstand_tools.replay import replay_engine
from kickstand_tools.signals import rotation_vector
from support.emulated import PART, esp32, modules, pico

pytestmark = pytest.mark.chip


def records():
    """Return three seconds of a ride as input of replay_engine.run()."""
    world = PART.world(Ride([accelerate(15.0, 1.0), turn(-30.0, 1.0, 0.5)]).motion)
    offsets = [-o / s for o, s in zip(PART.accel_offset_g, PART.accel_scale, strict=True)]
    slopes = [1.0 / s for s in PART.accel_scale]
    identity = 2 * (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)  # identity matrices as accel_matrix and gyro_matrix
    measured = (*offsets, *slopes, *PART.gyro_bias_dps, *PART.vehicle_from_sensor, 0.0)
    packed = struct.pack(replay_engine.CALIBRATION, *measured, *identity, *(9 * (0.0,)), 0, 0, 0, 0.0048)
    for i in range(300):
        fx, fy, fz, wx, wy, wz, temperature = world(i / 100)
        reading = (fx, fy, fz, temperature, wx, wy, wz)
        packed += struct.pack(replay_engine.RECORD, i * 10_000, *reading, replay_engine.NO_SPEED)
    return packed


def assert_equal_leans(results):
    """Assert that all engines give the same lean within 0.01 degrees at every sample. results: one per engine."""
    host, *emulated = (np.frombuffer(result).reshape(-1, len(replay_engine.COLUMNS)) for result in results)
    assert abs(host[:, 0]).max() > 25.0
    for other in emulated:
        assert host.shape == other.shape
        assert len(other) == 300
        assert np.abs(host - other)[:, :2].max() < 0.01
        assert np.abs(host - other)[:, 2:5].max() < 1e-5


def host_result():
    out = io.BytesIO()
    replay_engine.run(io.BytesIO(records()), out)
    return out.getvalue()


def test_the_same_log_gives_the_same_lean(tmp_path):
    """The lean agrees on a Pico, on MicroPython's unix port and on CPython."""
    pico()  # skips the test without the emulator
    from kickstand_emulator.engine import rp2040

    with rp2040(iter([records()]), None) as chip_result:
        results = [host_result(), chip_result.read()]
    if installation.has_micropython():
        (tmp_path / "records").write_bytes(records())
        command, environment = installation.micropython(replay_engine.__file__, str(tmp_path / "records"))
        results.append(subprocess.run(command, env=environment, capture_output=True, check=True).stdout)
    assert_equal_leans(results)


@pytest.mark.esp32
@pytest.mark.long
def test_the_same_log_gives_the_same_lean_on_an_esp32():
    engine = firmware_files.cross_compiled(Path(replay_engine.__file__), "xtensawin")
    with esp32(files=modules("esp32") | {"replay_engine.mpy": engine, "records": records()}) as device:
        code = "import replay_engine\nout = open('out', 'wb')\n"
        device.exec(code + "replay_engine.run(open('records', 'rb'), out)\nout.close()", 60.0)
        assert_equal_leans([host_result(), device.files()["out"]])


# The code before this script defines mount, clock, elapsed and allocated. Each update does one step of the work, so
# every update is timed in the same way.
_DRIVE = """
from kickstand.drive_alignment import alignment
from kickstand.rotation import matrix
drive = alignment.DriveAlignment("car", None, [0.0, 0.0, 0.0])
rate, force = [0.0] * 3, [0.0] * 3
speed, longest, updates, memory = 0.0, 0, 0, []
def sample(ahead, dt_us):
    global longest, updates
    for i in range(3):
        force[i] = mount[3 + i] + ahead * mount[6 + i]
    if updates % 50 == 0:
        allocated()
    began = clock()
    drive.update(force, rate, dt_us)
    longest = max(longest, elapsed(began))
    updates += 1
for k, (acceleration, count) in enumerate([(0.0, 70), (3.0, 40)] + [(-2.5, 20), (3.0, 20), (0.0, 10)] * 4):
    for i in range(count):
        if i % 10 == 0:
            memory.append(allocated())
            drive.measure_speed(speed)
        speed += 0.05 * acceleration
        sample(acceleration / 9.80665 + 0.002 * (i % 5 - 2), 50000)
        sample(0.0, 0)
        sample(0.0, 0)
        while drive._work is not None:
            sample(0.0, 0)
out = matrix()
drive.matrix(out)
result = {"matrix": list(out), "longest": longest, "updates": updates, "memory": memory, "counted": drive.counted}
"""
_ONE_PIECE = "from kickstand.drive_alignment import alignment\nalignment.STEP_US = 10**9\n"
_ON_CHIP = """
import gc, json
from time import ticks_diff, ticks_us as clock
def elapsed(began):
    return ticks_diff(clock(), began)
def allocated():
    gc.collect()
    return gc.mem_alloc()
"""


@pytest.mark.long
def test_alignment_by_driving_on_the_chip(at_prompt, monkeypatch):
    """The drive has five events of acceleration, with braking events between them. An update takes at most 2 ms. The
    time between two samples is 10 ms."""
    mount = random_mounting(4)
    host = {"mount": mount, "clock": time.monotonic_ns, "elapsed": lambda began: 0, "allocated": lambda: 0}
    monkeypatch.setattr(alignment, "STEP_US", 10**9)
    exec(_DRIVE, host)
    code = f"{_ONE_PIECE}{_ON_CHIP}mount = {mount!r}\n{_DRIVE}print(json.dumps(result))"
    chip = json.loads(at_prompt.exec(code, 120).splitlines()[-1])
    assert chip["counted"] == host["result"]["counted"] >= MIN_EVENTS
    assert chip["updates"] == host["result"]["updates"] > 300
    difference = np.reshape(chip["matrix"], (3, 3)) @ np.reshape(host["result"]["matrix"], (3, 3)).T
    assert np.degrees(np.linalg.norm(rotation_vector(difference))) < 0.05
    assert chip["longest"] < 2100, "microseconds"
    # The heap grows until each attribute holds a number. The heap must not grow in the second half of the drive.
    second_half = chip["memory"][len(chip["memory"]) // 2 :]
    assert max(second_half) - min(second_half) < 400, chip["memory"]
    assert second_half[-1] - chip["memory"][0] < 3000
