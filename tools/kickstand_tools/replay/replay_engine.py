"""Runs the firmware's LeanMeter over a recording, on CPython or MicroPython. It reads records and writes results.

    micropython replay_engine.py RECORDS > RESULTS

RECORDS begins with 46 doubles for the calibration's parameters() and matrices(), three for its six_done, aligned and
by_drive, and one for the gyro's delay in s. Then one record per sample follows:

    int64          time in microseconds
    7 doubles      readings in the chip's order, in g, C and deg/s
    double         new speed in m/s, negative if there is none

RESULTS has the doubles of COLUMNS for each sample. Both files are binary, because converting a number to text and back
may change it.
"""

import struct
import sys
from math import degrees, radians, sqrt

from kickstand.calibration.parameters import Calibration
from kickstand.lean.bike_model import static_lean_deg
from kickstand.lean.lean_filter import DELAY_S
from kickstand.lean.meter import LeanMeter

COLUMNS = (
    "lean_deg",
    "lean_formula_deg",
    "left_g",
    "up_g",
    "forward_g",
    "static_lean_deg",
    "yaw_rate_dps",
    "roll_rate_dps",
    "lean_sigma_deg",
)
CALIBRATION = "<50d"
RECORD = "<q8d"
RESULT = "<9d"
# Values of lean_sigma_deg while the display shows no lean. ODD means that the readings contradict each other
NOT_SHOWN, ODD = -1.0, -2.0
NO_SPEED = -1.0  # negative instead of NaN, because the module struct on a board does not read NaN correctly


class ReplayMeter(LeanMeter):
    """The firmware's meter for single readings in g and deg/s. On a board the meter processes sums of counts."""

    def use(self, calibration, posed=False):
        """Use a calibration (see LeanMeter.use())."""
        LeanMeter.use(self, calibration, posed)
        self._force_matrix, self._force_offset, rate_matrix, rate_offset = calibration.in_vehicle()
        self._rate_matrix = [radians(value) for value in rate_matrix]
        self._rate_offset = [radians(value) for value in rate_offset]

    def update(self, reading, dt_us):
        """Process a reading: 7 numbers in the chip's order, in g, C and deg/s. dt_us: microseconds since the previous
        reading, 0 for the first."""
        force, rate = self.in_vehicle(reading)
        self.update_in_vehicle(force, rate, dt_us)

    def in_vehicle(self, reading):
        """Return the force in g and the rate in rad/s along the vehicle's axes, 3 values each.

        reading: 7 numbers in the chip's order, or 7 arrays of n numbers for n readings. The results are of this kind.
        """
        force = self._force_matrix, self._force_offset, reading[:3]
        rate = self._rate_matrix, self._rate_offset, reading[4:]
        return [
            [m[k] * x + m[k + 1] * y + m[k + 2] * z + offset[k // 3] for k in (0, 3, 6)]
            for m, offset, (x, y, z) in (force, rate)
        ]

    def update_in_vehicle(self, force, rate, dt_us):
        """Process a reading like update(). force, rate: the results of in_vehicle(), three numbers each."""
        self.force, self.rate = force, rate
        self._follow(dt_us)


class Replay:
    """Runs the meter over one recording. All engines and streamed rides use this loop.

    calibration: The firmware's Calibration, for readings in g and deg/s.
    delay_s: Delay of the gyro's low-pass.
    leans: False for a car.
    since_us: Time of the sample before the first sample, or None.
    """

    def __init__(self, calibration, delay_s=DELAY_S, leans=True, since_us=None):
        self.meter = ReplayMeter(calibration, leans, delay_s)
        self._before_us = since_us

    def follow(self, samples):
        """Yield the meter after each sample, always the same object.

        samples: tuples (time_us, force, rate, speed_mps), with the results of in_vehicle(). The speed is NaN or
        negative if there is no new one.
        """
        meter = self.meter
        for time_us, force, rate, speed_mps in samples:
            if speed_mps >= 0.0:
                meter.measure_speed(speed_mps)
            meter.update_in_vehicle(force, rate, 0 if self._before_us is None else time_us - self._before_us)
            self._before_us = time_us
            yield meter

    def take(self, time_us, reading, speed_mps=NO_SPEED):
        """Process a sample, and return the meter. reading: as in ReplayMeter.update()."""
        force, rate = self.meter.in_vehicle(reading)
        return next(self.follow(((time_us, force, rate, speed_mps),)))

    def step(self, time_us, reading, speed_mps=NO_SPEED):
        """Process a sample as take(), and return the values of COLUMNS."""
        meter = self.take(time_us, reading, speed_mps)
        force, rate = meter.force, meter.rate
        return (
            meter.lean_deg,
            meter.lean_formula_deg,
            force[0],
            force[1],
            force[2],
            static_lean_deg(force),
            degrees(rate[1]),
            degrees(rate[2]),
            degrees(sqrt(meter.filter.variance)) if meter.trusted else ODD if meter.odd else NOT_SHOWN,
        )


def run(source, sink):
    """Read records from a binary file until its end, and write results to the binary file `sink`."""
    calibration = Calibration()
    *numbers, delay_s = struct.unpack(CALIBRATION, source.read(struct.calcsize(CALIBRATION)))
    calibration.set_parameters(numbers[:19])
    calibration.set_matrices(numbers[19:46])
    calibration.six_done, calibration.aligned, calibration.by_drive = [value > 0.0 for value in numbers[46:]]
    replay = Replay(calibration, delay_s=delay_s)
    size = struct.calcsize(RECORD)
    while True:
        record = source.read(size)
        if len(record) < size:
            return
        values = struct.unpack(RECORD, record)
        sink.write(struct.pack(RESULT, *replay.step(values[0], values[1:8], values[8])))


if __name__ == "__main__":
    with open(sys.argv[1], "rb") as records:
        run(records, sys.stdout.buffer)
