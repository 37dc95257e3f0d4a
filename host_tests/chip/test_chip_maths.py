"""The firmware's mathematics with the chip's 32-bit floats and 31-bit small integers, compared with the other
engines."""

import io
import struct
import subprocess
from pathlib import Path

import numpy as np
import pytest
from kickstand_tools.common import unix_port
from kickstand_tools.deploy import bytecode
from kickstand_tools.replay import replay_engine
from kickstand_tools.rides import block_reader
from kickstand_tools.simulated_board.gps import sentence
from kickstand_tools.simulation.scripted.script import Ride, accelerate, turn
from support.emulated import PART, esp32, modules, pico

pytestmark = pytest.mark.chip


def records():
    """Return three seconds of a ride as input of replay_engine.run()."""
    world = PART.world(Ride([accelerate(15.0, 1.0), turn(-30.0, 1.0, 0.5)]).motion)
    offsets = [-o / s for o, s in zip(PART.accel_offset_g, PART.accel_scale, strict=True)]
    slopes = [1.0 / s for s in PART.accel_scale]
    identity = 2 * (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)  # identity matrices as accel_matrix and gyro_matrix
    measured = (*offsets, *slopes, *PART.gyro_bias_dps, *PART.vehicle_from_sensor, 0.0)
    calibration = (*measured, *identity, *(9 * (0.0,)), 0.0048)
    made = struct.pack(replay_engine.CALIBRATION, *calibration)
    for i in range(300):
        fx, fy, fz, wx, wy, wz, temperature = world(i / 100)
        reading = (fx, fy, fz, temperature, wx, wy, wz)
        made += struct.pack(replay_engine.RECORD, i * 10_000, *reading, replay_engine.NO_SPEED)
    return made


def agree(results):
    """Assert that all engines give the same lean within 0.01 degrees at every sample. results: one per engine."""
    host, *others = (np.frombuffer(result).reshape(-1, len(replay_engine.COLUMNS)) for result in results)
    assert abs(host[:, 0]).max() > 25.0
    for other in others:
        assert host.shape == other.shape
        assert len(other) == 300
        assert np.abs(host - other)[:, :2].max() < 0.01
        assert np.abs(host - other)[:, 2:5].max() < 1e-5


def on_host():
    out = io.BytesIO()
    replay_engine.run(io.BytesIO(records()), out)
    return out.getvalue()


def test_the_same_log_gives_the_same_lean(tmp_path):
    """The lean agrees on a Pico, on MicroPython's unix port and on CPython."""
    pico()  # skips the test without the emulator
    from kickstand_emulator.engine import rp2040

    with rp2040(iter([records()]), None) as results_of_chip:
        results = [on_host(), results_of_chip.read()]
    if unix_port.available():
        (tmp_path / "records").write_bytes(records())
        command = unix_port.command(replay_engine.__file__, str(tmp_path / "records"))
        results.append(subprocess.run(command, env=unix_port.environment(), capture_output=True, check=True).stdout)
    agree(results)


@pytest.mark.esp32
def test_the_same_log_gives_the_same_lean_on_an_esp32():
    engine = bytecode.cross_compiled(Path(replay_engine.__file__), "xtensawin")
    with esp32(files=modules("esp32") | {"replay_engine.mpy": engine, "records": records()}) as device:
        code = "import replay_engine\nout = open('out', 'wb')\n"
        device.exec(code + "replay_engine.run(open('records', 'rb'), out)\nout.close()", 60.0)
        agree([on_host(), device.files()["out"]])


_SENTENCE = sentence("GPRMC,235959.97,A,8959.99999,S,17959.99998,W,19.438,084.4,311226,,,A")

_PLACE = """
import gc
from time import ticks_diff, ticks_ms, ticks_us
from kickstand.rides.block import RideBlock
from kickstand.speed.gps import Gps
class Uart:
    data = %r
    def any(self):
        return len(self.data)
    def read(self, n):
        data, self.data = self.data[:n], self.data[n:]
        return data
class Chip:
    accel_lsb_per_g, gyro_lsb_per_dps, gyro_delay_s = 4096, 65.5, 0.0134
    def temperature_c(self, counts):
        return 31.25
gps = Gps(Uart())
block = RideBlock(5000)
block.begin(512, 7, 3, 5, Chip(), 200, bytes(80))
gps.poll(990)
gps.poll(1000)
gc.collect()
before, begun_us = gc.mem_alloc(), ticks_us()
place = gps.place(1000)
took_us, heap = ticks_diff(ticks_us(), begun_us), gc.mem_alloc() - before
block.add_place(place)
block.add([200] * 7, 2, 10000)
block.close()
print(took_us, heap)
print("".join("%%02x" %% byte for byte in block.buffer[:512]))
"""


def test_position_on_the_chip_is_exact_fast_and_small(at_prompt):
    costs, block = at_prompt.exec(_PLACE % _SENTENCE.encode(), 20.0).split("\n")[:2]
    turn = block_reader.parse(bytes.fromhex(block.strip())).turns[0]
    assert turn.place == block_reader.Place(-89.0 - 59.99999 / 60, -179.0 - 59.99998 / 60, 1_798_761_599.97)
    took_us, heap = map(int, costs.split())
    assert took_us < 2000
    assert heap < 200
