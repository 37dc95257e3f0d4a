"""Measures the brake tests of a log: its stops, as defined by UN Regulation No. 13."""

from collections.abc import Iterator

import numpy as np

from ..calibration.file import CalibrationFile
from ..checks.log import check_log
from ..logs.log import Source
from ..logs.reader import read_log
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
    ride = Ride(check_log(read_log(log), axes=False), calibration)
    parts = _car_channels(ride) if ride.car else ride.read().parts()
    return find_stops(joined(downsampled(parts, RATE_S)))


def _car_channels(ride: Ride) -> Iterator[Channels]:
    """Yield the channels of a car's ride, without a lean."""
    for _, part in ride.log.parts(ride.checked.measured):
        lean: dict[str, Array] = {name: np.zeros(len(part.t_s)) for name in ("shown_g", "resting", "sure")}
        if len(part.t_s):
            yield channels(part, ride.calibration, lean, car=True)
