"""Simulated rides that several tests share."""

import pytest
from kickstand_tools.analysis.overview import overview
from kickstand_tools.analysis.ride import open_ride
from support.recordings import analysis_rides


@pytest.fixture(scope="session")
def short_ride(tmp_path_factory):
    """Return the RIDE.csv of a ride of 34 s with one speed per second, with its calibration beside it."""
    return analysis_rides.short(tmp_path_factory.mktemp("short"), speed_hz=1)


@pytest.fixture(scope="session")
def short_overview(short_ride):
    return overview(open_ride(short_ride))
