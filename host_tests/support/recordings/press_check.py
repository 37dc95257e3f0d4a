"""Measures how often the gyro check of the two presses refuses a sound sensor, and how often it misses a faulty sensor.

The simulated sensors have all errors of the data sheet and any mounting. Some are calibrated by the six positions.
Hands raise the bike from its stand at once or after a while. The hands shake the bike and turn it about the vertical.
The program prints the shares:

    OMP_NUM_THREADS=1 PYTHONPATH=host_tests .venv/bin/python -m support.recordings.press_check 1000
"""

import sys
from types import SimpleNamespace

import numpy as np
from kickstand.calibration.parameters import Calibration
from kickstand.calibration.turn import Turn
from kickstand.calibration.two_position import align, check_turn
from kickstand.errors import AlignmentError, GyroError
from kickstand_tools.simulation.hands import _rotations
from kickstand_tools.simulation.physics.chip import RATE_HZ, Chip
from kickstand_tools.simulation.physics.signals import band_noise, smoothstep
from kickstand_tools.simulation.ride import random_rotation

LSB_PER_DPS = 65.5
POSE = 600  # samples at 200 Hz
FAULTS = ("dead", "half", "mirrored", "double")


def presses(chance, chip, mounting):
    """Simulate the two presses: the pose on the kickstand, then the movement to the upright pose.

    Returns:
        readings: shape (n, 7), at 200 Hz. The first and the last POSE samples are at rest.
        tilt: angle between the two poses in degrees.
    """
    wait_s, raise_s = np.exp(chance.uniform(*np.log((0.3, 40.0)))), chance.uniform(0.8, 4.0)
    n, still = int((wait_s + raise_s + 1.0) * RATE_HZ), POSE * RATE_HZ // 200
    tilt = chance.uniform(6.0, 18.0)
    at = np.arange(n) / RATE_HZ
    way = smoothstep((at - wait_s) / raise_s)
    shaken = np.sin(np.pi * np.linspace(0.0, 1.0, n)) ** 0.5
    lean = -tilt * (1.0 - way) + shaken * chance.uniform(0.3, 3.0) * band_noise(chance, n, 0.1, 1.5, RATE_HZ)
    pitch = chance.uniform(-1.0, 1.0) * way + shaken * chance.uniform(0.1, 1.0) * band_noise(
        chance, n, 0.1, 1.5, RATE_HZ
    )
    yaw = chance.uniform(-20.0, 20.0) * way + shaken * chance.uniform(0.2, 3.0) * band_noise(
        chance, n, 0.1, 1.0, RATE_HZ
    )
    lean, pitch, yaw = (np.pad(np.radians(angle), still, mode="edge") for angle in (lean, pitch, yaw))
    hand = np.radians(0.05) * band_noise(chance, len(lean), 0.2, 0.6, RATE_HZ)
    lean[-still:] += hand[-still:]
    zero = np.zeros_like(lean)
    # The axes are left, up, forward. In the bike's axes, a lean to the right turns the direction up to the left.
    body = (
        _rotations(np.column_stack((zero, yaw, zero)))
        @ _rotations(np.column_stack((-pitch, zero, zero)))
        @ _rotations(np.column_stack((zero, zero, lean)))
    )
    steps = np.einsum("nji,njk->nik", body[:-1], body[1:])
    skew = steps - np.swapaxes(steps, 1, 2)
    rates = np.degrees(0.5 * RATE_HZ * np.stack((skew[:, 2, 1], skew[:, 0, 2], skew[:, 1, 0]), axis=1))
    up = body[:-1, 1]
    return chip.read(chance, up @ mounting, rates @ mounting, np.full(len(up), chance.uniform(5.0, 35.0))), tilt


def refusal(chance, fault=None, six_done=False, axis=0):
    """Return the code with which the check refuses a random sensor, or None if it passes.

    fault: one of FAULTS, or None for a sound sensor. axis: index of the faulty axis of the gyro.
    """
    chip, mounting = Chip.random(chance), random_rotation(chance)
    readings, _ = presses(chance, chip, mounting)
    factor = {"dead": 0.0, "half": 0.5, "mirrored": -1.0, "double": 2.0, None: 1.0}[fault]
    readings[:, 4 + axis] *= factor
    share = float(abs(mounting[2, axis]))
    calibration = Calibration()
    if six_done:
        calibration.set_accel(-chip.accel_offset / np.diag(chip.accel_matrix), 1.0 / np.diag(chip.accel_matrix))
        calibration.six_done = True
    poses = [
        SimpleNamespace(accel=part[:, :3].mean(axis=0).tolist(), gyro=part[:, 4:].mean(axis=0).tolist())
        for part in (readings[:POSE], readings[-POSE:])
    ]
    turn = Turn(LSB_PER_DPS, 5000)
    turn.start(poses[0].gyro)
    for row in np.round(readings[POSE:-POSE] * LSB_PER_DPS).astype(int).tolist():
        turn.add(row, 1, 5000)
    turn.end()
    try:
        align(calibration, poses[0], poses[1], "left")
        check_turn(calibration, poses[0], poses[1], turn)
    except AlignmentError as error:
        return error.code, share
    except GyroError as error:
        return error.code, share
    return None, share


def main(count):
    """Print the share of refusals for `count` sound sensors, then the share for each fault."""
    for six_done in (False, True):
        codes = [refusal(np.random.default_rng([k, 31]), None, six_done)[0] for k in range(int(count))]
        found = {str(code): codes.count(code) for code in set(codes)}
        print(f"sound, six positions {'done' if six_done else 'not done'}: {found} of {count}", flush=True)
    for fault in FAULTS:
        seen = [refusal(np.random.default_rng([k, 32]), fault, True, k % 3) for k in range(int(count) // 3)]
        for least, most in ((0.0, 0.3), (0.3, 0.7), (0.7, 1.0)):
            some = [code for code, share in seen if least <= share < most]
            missed = sum(code is None for code in some)
            print(f"{fault}, {least:.1f} to {most:.1f} along forward: missed {missed} of {len(some)}", flush=True)


if __name__ == "__main__":
    main(*sys.argv[1:])
