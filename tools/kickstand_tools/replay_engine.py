"""The firmware's LeanMeter over a recording, on CPython or MicroPython: records in, results out.

    micropython replay_engine.py RECORDS > RESULTS

RECORDS starts with the calibration (19 doubles: offset, slope, gyro bias, matrix, trim), then one record a sample:
its time in microseconds (int64) and seven readings in the chip's order (doubles; g, C, deg/s). RESULTS has
the doubles of COLUMNS for each. Binary, because a number printed and read again may be another number.
"""

import struct
import sys
from math import degrees

from kickstand.calibration import Calibration
from kickstand.lean import static_lean_deg
from kickstand.meter import LeanMeter

COLUMNS = (
    "lean_deg",
    "lean_formula_deg",
    "left_g",
    "up_g",
    "forward_g",
    "static_lean_deg",
    "yaw_rate_dps",
    "roll_rate_dps",
)
CALIBRATION = "<19d"
RECORD = "<q7d"
RESULT = "<8d"


def run(source, sink):
    """Read records from source until its end and write results to sink, both binary files."""
    meter = LeanMeter(_calibration(struct.unpack(CALIBRATION, source.read(struct.calcsize(CALIBRATION)))))
    size = struct.calcsize(RECORD)
    before = None
    while True:
        record = source.read(size)
        if len(record) < size:
            return
        values = struct.unpack(RECORD, record)
        now = values[0]
        meter.update(values[1:], 0 if before is None else now - before)
        before = now
        force, rate = meter.force, meter.rate
        sink.write(
            struct.pack(
                RESULT,
                meter.lean_deg,
                meter.lean_formula_deg,
                force[0],
                force[1],
                force[2],
                static_lean_deg(force),
                degrees(rate[1]),
                degrees(rate[2]),
            )
        )


def _calibration(values):
    calibration = Calibration()
    calibration.set_accel(values[0:3], values[3:6])
    for i in range(3):
        calibration.gyro_bias[i] = values[6 + i]
    for i in range(9):
        calibration.vehicle_from_sensor[i] = values[9 + i]
    calibration.trim_deg = values[18]
    return calibration


if __name__ == "__main__":
    with open(sys.argv[1], "rb") as records:
        run(records, sys.stdout.buffer)
