"""Rides of a few numbers, whose figures, words and charts can be computed by hand."""

from dataclasses import fields

import numpy as np
from kickstand_tools import api
from kickstand_tools.analysis.alignment_quality import Quality
from kickstand_tools.analysis.channels import Channels
from kickstand_tools.analysis.overview import Overview
from kickstand_tools.analysis.ride import Ride
from kickstand_tools.analysis.stops.brake_test import Stop
from kickstand_tools.analysis.summary import summary


def made(n: int, step_s: float = 0.01, **columns) -> Channels:
    """Return n samples of an upright bike whose lean is trusted.

    columns: {name of a channel: another value, a number or shape (n)}.
    """
    usual = {"up_g": 1.0, "sure": 1.0, "speed_mps": np.nan, "lat_deg": np.nan, "lon_deg": np.nan, "utc_s": np.nan}
    usual |= {"temp_c": np.nan, "t_s": np.arange(n) * step_s} | columns
    return Channels(*(np.full(n, 0.0) + usual.get(field.name, 0.0) for field in fields(Channels)))


def seen(course: Channels, found: Quality | None = None, stops=(), riding_s=60.0, notices=(), **calibration):
    log = api.Log(np.array([0.0, 0.01]), np.tile([0.0, 1.0, 0.0], (2, 1)), np.zeros((2, 3)), name="trip/RIDE.csv")
    ride = Ride(log, api.CalibrationFile(aligned=True, **calibration))
    none = np.zeros(1)
    found = found or Quality(0.1, None, 1.0, 1.0, 30.0, none, none)
    return Overview(ride, summary(course), course, list(stops), found, riding_s, list(notices))


STOP = Stop(61.0, 63.5, 20.0, 30.04, 7.114, 8.125, 12.4, 0.24, 1.0, "log")
