"""Rides of a few numbers, whose figures, words and charts can be computed by hand."""

from dataclasses import fields
from typing import Any

import numpy as np
from kickstand_tools import api
from kickstand_tools.analysis.overview import Overview, Quality, summary
from kickstand_tools.analysis.ride import Channels, Ride
from kickstand_tools.analysis.stops import Stop
from kickstand_tools.checks.log import CheckedLog

STOP = Stop(61.0, 63.5, 20.0, 30.04, 7.114, 8.125, 12.4, 0.24, 1.0, "log")
ALIGNED = api.CalibrationFile(aligned=True)


def samples(n, step_s=0.01, **columns):
    """Return n samples of an upright bike whose lean is trusted. columns: other values of channels."""
    usual = {"up_g": 1.0, "sure": 1.0, "speed_mps": np.nan, "lat_deg": np.nan, "lon_deg": np.nan, "utc_s": np.nan}
    usual |= {"temp_c": np.nan, "t_s": np.arange(n) * step_s} | columns
    return Channels(*(np.full(n, 0.0) + usual.get(field.name, 0.0) for field in fields(Channels)))


def quality_of(roll=None, pitch=None, yaw=None, gravity=None, lateral_g=(), forward_g=()):
    return Quality(roll, pitch, yaw, gravity, 30.0, np.array(lateral_g, float), np.array(forward_g, float))


def overview_of(course, quality=None, stops=(), riding_s=60.0, notices=(), smoothed=False, **calibration):
    log = api.Log(np.array([0.0, 0.01]), np.tile([0.0, 1.0, 0.0], (2, 1)), np.zeros((2, 3)), name="trip/RIDE.csv")
    ride = Ride(CheckedLog(log, np.ones(2, dtype=bool), []), api.CalibrationFile(aligned=True, **calibration), smoothed)
    quality = quality or quality_of(0.1, None, 1.0, 1.0)
    return Overview(ride, summary(course), course, list(stops), quality, riding_s, list(notices))


def standing_log(seconds=4.0, shake_g=0.002, shake_dps=0.002, hz=100.0, bias_dps=0.0, **values: Any):
    """A log of a bike that stands upright. shake_g, shake_dps: rms of the vibration."""
    random, count = np.random.default_rng(2), round(seconds * hz)
    force = random.normal(0.0, shake_g, (count, 3)) + [0.0, 1.0, 0.0]
    rates = random.normal(bias_dps, shake_dps, (count, 3))
    columns: Any = {name: np.full(count, value) for name, value in values.items()}
    return api.Log(np.arange(count) / hz, force, rates, **columns, name="trip/RIDE.csv")
