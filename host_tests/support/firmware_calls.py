"""Calls the firmware's mathematics by name, with JSON input and output. Runs on CPython and on MicroPython.

As a script: reads one JSON list of [name, arguments] from standard input and prints the list of results.
"""

import json
import math
import sys
from array import array

from kickstand import rotation
from kickstand.calibration import poses, six_position, vectors
from kickstand.calibration.parameters import Calibration, Transform
from kickstand.calibration.poses import StillPose
from kickstand.calibration.store import is_rotation
from kickstand.errors import Refusal
from kickstand.imu import axes
from kickstand.lean import bike_model
from kickstand.ui import messages

from support import driving_runs


def matrix_of(values):
    m = rotation.matrix()
    for i in range(9):
        m[i] = values[i]
    return m


def _vector(function, *arguments):
    out = rotation.vector()
    function(out, *arguments)
    return list(out)


def align_two_position(kickstand, upright, side):
    m = rotation.matrix()
    tilt = poses.two_position(m, kickstand, upright, side)
    return tilt, list(m)


def apply(offset, slope, bias, lsb, gyro_lsb, reading):
    calibration = Calibration()
    calibration.set_accel(offset, slope)
    for i in range(3):
        calibration.gyro_bias[i] = bias[i]
    calibration.set_scale(lsb, gyro_lsb)
    force, rate = rotation.vector(), rotation.vector()
    calibration.apply(reading, force, rate)
    return list(force) + list(rate)


def transform(offset, slope, matrix, sums, n):
    """Compute force and rate of the mean of n samples, by the board's code and with plain floats.

    sums: sums of the n readings, at 4096 counts per g.
    """
    calibration = Calibration()
    calibration.set_accel(offset, slope)
    for i in range(9):
        calibration.vehicle_from_sensor[i] = matrix[i]
    for i in range(3):
        calibration.gyro_bias[i] = 2.0 - i
    calibration.set_scale(4096, 65.5)
    transform_of_both = Transform(calibration)
    force, rate = [0.0] * 3, [0.0] * 3
    transform_of_both.apply_sum(array("i", sums), n, force, rate)
    sensor_force, sensor_rate = [0.0] * 3, [0.0] * 3
    calibration.apply([value / n for value in sums], sensor_force, sensor_rate)
    plain_force, plain_rate = [0.0] * 3, [0.0] * 3
    rotation.rotate(plain_force, calibration.vehicle_from_sensor, sensor_force)
    rotation.rotate(plain_rate, calibration.vehicle_from_sensor, [math.radians(r) for r in sensor_rate])
    return force + rate, plain_force + plain_rate


def add_up(batches, limit):
    """Add up batches of frames of 14 bytes. Return per batch [number of good frames, sums, good frames, notes of the
    AxisWatch]."""
    watch = axes.AxisWatch(200, 3, 1, 3, limit).notes
    sums = array("i", [99] * 7)  # the buffer's earlier content must not matter
    answers = []
    for batch in batches:
        data = bytearray()
        for frame in batch:
            data.extend(bytes(frame))
        good = axes.add_up(data, len(batch), sums, watch)
        answers.append([good, list(sums), list(data[: 14 * good]), list(watch)])
    return answers


def decode(batch):
    """Decode frames of 14 bytes. Return the counts of each frame."""
    data = b"".join([bytes(frame) for frame in batch])
    counts = array("h", [0] * 7)
    answers = []
    for k in range(len(batch)):
        axes.decode(data, 14 * k, counts)
        answers.append(list(counts))
    return answers


def capture(samples):
    """Return the means of a still pose. samples: rows of seven integers, 8192 counts per g and 65.5 per deg/s."""
    pose = StillPose(8192, 65.5, 32700, len(samples))
    for sample in samples:
        pose.add(sample)
    pose.finish()
    return pose.accel, pose.gyro


CALLS = {
    "drive": driving_runs.drive,
    "parts": driving_runs.parts,
    "regression": driving_runs.regression,
    "cross": lambda a, b: _vector(vectors.cross, a, b),
    "rotate": lambda m, a: _vector(rotation.rotate, matrix_of(m), a),
    "angle": vectors.angle_deg,
    "is_rotation": is_rotation,
    "two_position": align_two_position,
    "static_lean": bike_model.static_lean_deg,
    "formula_lean": bike_model.formula_lean_deg,
    "apply": apply,
    "closed_form": six_position.closed_form,
    "fit": six_position.fit,
    "free_pose": six_position.check_free_pose,
    "side_of": six_position.side_of,
    "capture": capture,
    "transform": transform,
    "add_up": add_up,
    "decode": decode,
}


def call(name, arguments):
    """Return the result, or {"refused": code, "values": values, "lcd": lines} for a refusal."""
    try:
        return CALLS[name](*arguments)
    except Refusal as refusal:
        return {"refused": refusal.code, "values": list(refusal.values), "lcd": messages.lines(refusal)}


if __name__ == "__main__":
    json.dump([call(name, arguments) for name, arguments in json.load(sys.stdin)], sys.stdout)
