"""Alignment by driving on the chip gives the host's result, within the time of a sample and in constant memory."""

import json
import time

import numpy as np
import pytest
from kickstand.drive_alignment import alignment
from kickstand.drive_alignment.quality import MIN_EVENTS
from kickstand_tools.signals import rotation_vector
from kickstand_tools.simulation.scripted.sensor_errors import random_mounting

pytestmark = pytest.mark.chip

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
    between = np.reshape(chip["matrix"], (3, 3)) @ np.reshape(host["result"]["matrix"], (3, 3)).T
    assert np.degrees(np.linalg.norm(rotation_vector(between))) < 0.05
    assert chip["longest"] < 2100, "microseconds"
    # The heap grows until each attribute holds a number. The heap must not grow in the second half of the drive.
    later = chip["memory"][len(chip["memory"]) // 2 :]
    assert max(later) - min(later) < 400, chip["memory"]
    assert later[-1] - chip["memory"][0] < 3000
