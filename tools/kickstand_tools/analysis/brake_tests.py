"""Measures the brake tests of a log: its stops, as defined by UN Regulation No. 13."""

import numpy as np

from ..calibration.file import CalibrationFile
from ..logs.reader import Source, read_blocks
from ..signals import Array
from .channels import Channels, channels, downsampled, joined
from .ride import Ride
from .stops.brake_test import RATE_S, Stop, find_stops


def brake_tests(log: Source, calibration: CalibrationFile) -> list[Stop]:
    """Find every stop of a log from over 10 km/h, and measure it by UN Regulation No. 13 (see find_stops).

    The firmware's lean filter takes most of the time. The filter runs only for motorcycles, because a car has no lean.

    calibration: must be aligned.
    Raises InputError.

    >>> from kickstand_tools.api import Log, fit_two_positions, simulate_ride
    >>> ride = simulate_ride("street", seed=1, seconds=60.0)
    >>> poses = [Log.from_readings(pose, ride.rate_hz) for pose in (ride.kickstand, ride.upright)]
    >>> log = Log.from_readings(ride.readings, ride.rate_hz)
    >>> log.speed_mps[::200] = ride.truth["speed_mps"][::200]  # once per second
    >>> stops = brake_tests(log, fit_two_positions(*poses).calibration)
    >>> stops[-1].initial_speed_mps > 3.0, stops[-1].mfdd_mps2 > 1.0
    (True, True)
    """
    ride = Ride(log, calibration)
    blocks = car_channels(log, calibration) if ride.car else list(ride.blocks())
    return find_stops(joined(list(downsampled(blocks, RATE_S))))


def car_channels(log: Source, calibration: CalibrationFile) -> list[Channels]:
    """Return the channels of a car's log, in the vehicle's axes and without a lean. The list has one item per block."""
    parts = []
    for block in read_blocks(log, lines=False):
        measured = block.measured
        if len(measured.time_us):
            lean: dict[str, Array] = {name: np.zeros(len(measured.time_us)) for name in ("shown_g", "resting", "sure")}
            parts.append(channels(measured, calibration, lean, car=True))
    return parts
