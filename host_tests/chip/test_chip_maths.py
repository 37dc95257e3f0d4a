"""The firmware's mathematics in the chip's 32-bit floats, against numpy and the other engines."""

import io
import json
import struct
import subprocess

import numpy as np
import pytest
from emulated import PART, modules, pico
from kickstand_tools import unix_port
from kickstand_tools.replay import replay_engine
from kickstand_tools.simulation.scripted.script import Ride, accelerate, turn
from kickstand_tools.simulation.scripted.sensor_errors import random_mounting

pytestmark = pytest.mark.chip

_COMPOSED = """
import json
from array import array
from kickstand.rotation import rotate, vector
turned = []
for a in ((1, 0, 0), (0, 1, 0), (0, 0, 1), v):
    a, other = array("f", a), vector()
    for m in matrices:
        rotate(other, array("f", m), a)
        a, other = other, a
    turned.append(list(a))
print(json.dumps([turned[0:3], turned[3]]))
"""


def test_composed_rotations_agree_with_numpy():
    """Six rotations one after the other, of the three axes and of a vector: to 1e-6, a few units of the last place."""
    matrices = [random_mounting(seed) for seed in range(6)]
    v = (0.3, -0.5, 0.81)
    with pico(files=modules()) as board:
        axes, out = json.loads(board.exec(f"matrices = {matrices!r}\nv = {v!r}\n{_COMPOSED}"))
    expected = np.eye(3)
    for m in matrices:
        expected = np.reshape(m, (3, 3)) @ expected
    assert np.abs(np.transpose(axes) - expected).max() < 1e-6
    assert np.abs(np.array(out) - expected @ v).max() < 1e-6


def test_the_same_log_gives_the_same_lean(tmp_path):
    """Through the whole LeanMeter, on chip, unix port and CPython: within 0.05 degrees in every sample."""
    pico()  # or skip
    from kickstand_tools.replay.replay import rp2040

    world = PART.world(Ride([accelerate(15.0, 1.0), turn(-30.0, 1.0, 0.5)]).motion)
    offsets = [-o / s for o, s in zip(PART.accel_offset_g, PART.accel_scale, strict=True)]
    slopes = [1.0 / s for s in PART.accel_scale]
    calibration = (*offsets, *slopes, *PART.gyro_bias_dps, *PART.vehicle_from_sensor, 0.0, 0.0048)
    records = struct.pack(replay_engine.CALIBRATION, *calibration)
    for i in range(300):
        fx, fy, fz, wx, wy, wz, temperature = world(i / 100)
        reading = (fx, fy, fz, temperature, wx, wy, wz)
        records += struct.pack(replay_engine.RECORD, i * 10_000, *reading, replay_engine.NO_SPEED)
    on_host = io.BytesIO()
    replay_engine.run(io.BytesIO(records), on_host)
    with rp2040(iter([records]), None) as results_of_chip:
        on_chip = results_of_chip.read()
    results = [on_host.getvalue(), on_chip]
    if unix_port.available():
        (tmp_path / "records").write_bytes(records)
        command = unix_port.command(replay_engine.__file__, str(tmp_path / "records"))
        results.append(subprocess.run(command, env=unix_port.environment(), capture_output=True, check=True).stdout)
    host, *others = (np.frombuffer(result).reshape(-1, len(replay_engine.COLUMNS)) for result in results)
    assert abs(host[:, 0]).max() > 25.0
    for other in others:
        assert host.shape == other.shape
        assert len(other) == 300
        assert np.abs(host - other)[:, :2].max() < 0.05
        assert np.abs(host - other)[:, 2:5].max() < 1e-5
