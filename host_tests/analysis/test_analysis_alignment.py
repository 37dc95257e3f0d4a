"""What the ride says of the alignment, where it is known how far that is off."""

import json
from math import cos, radians, sin
from pathlib import Path

import analysis_rides
import command
import numpy as np
import pytest
from kickstand_tools.analysis.alignment_quality import Quality
from kickstand_tools.analysis.overview import overview
from kickstand_tools.analysis.report import angles
from kickstand_tools.analysis.ride import open_ride
from kickstand_tools.simulation.scripted import script


@pytest.fixture(scope="module")
def log(tmp_path_factory) -> Path:
    segments = [script.upright(4)]
    for lean in 25, -30, 20:
        segments += [script.accelerate(16, 5), script.straight(6), script.turn(lean, 4), script.straight(5)]
        segments += [script.brake(0, 4), script.wait(4)]
    return analysis_rides.write(tmp_path_factory.mktemp("ride"), segments, speed_hz=1)


def turned(axis: str, angle_deg: float) -> np.ndarray:
    """(3, 3) vehicle from sensor, off by an angle about one of the vehicle's axes."""
    c, s = cos(radians(angle_deg)), sin(radians(angle_deg))
    return {
        "roll": np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]]),  # up leans to the right of the bike's own
        "pitch": np.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]]),  # forward points up
        "yaw": np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]]),  # forward points to the right
    }[axis]


@pytest.mark.parametrize("axis", ["roll", "pitch", "yaw"])
@pytest.mark.parametrize("angle_deg", [-3.0, 0.0, 2.0])
def test_an_error_of_the_alignment_is_seen(log, tmp_path, axis, angle_deg):
    cal = tmp_path / "cal.json"
    matrix = turned(axis, angle_deg)
    cal.write_text(json.dumps(analysis_rides.CALIBRATION | {"vehicle_from_sensor": matrix.tolist()}))
    quality = overview(open_ride(log, cal)).quality
    assert quality.straight_s > 30.0
    for name in "roll", "pitch", "yaw":
        value = getattr(quality, f"{name}_deg")
        assert value == pytest.approx(angle_deg if name == axis else 0.0, abs=0.4), name
    assert quality.gravity_g == pytest.approx(1.0, abs=0.002)


def test_a_ride_without_straights_does_not_tell(tmp_path):
    path = analysis_rides.write(tmp_path, [script.upright(8)])
    quality = overview(open_ride(path, None)).quality
    assert (quality.roll_deg, quality.pitch_deg, quality.yaw_deg) == (None, None, None)
    said = command.works("report", path).out
    assert "Alignment: not enough straight riding to tell how far it is off." in said


def test_nothing_is_a_negative_nothing():
    quality = Quality(-0.04, None, 2.04, None, 60.0, np.zeros(0), np.zeros(0))
    assert angles(quality) == ["roll +0.0°", "yaw +2.0°"]
