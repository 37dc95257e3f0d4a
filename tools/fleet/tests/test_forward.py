"""Forward from whole logs is more exact than the firmware's, and its standard errors are right."""

import numpy as np
import pytest
from exact import MOUNT, drive_intervals
from fleet_drives import yaw_deg
from kickstand_fleet import evidence
from kickstand_fleet.evidence import Forward, find_forward
from kickstand_tools.calibration.drive import UP_DEG, DriveFit, fit_logs, usable
from kickstand_tools.calibration.file import CalibrationFile
from kickstand_tools.logs.reader import read_log
from kickstand_tools.signals import rotation_vector


def forward_of(*logs, device=None):
    result = find_forward(list(logs), device)
    assert result
    return result


def test_without_noise_only_the_errors_of_the_sensor_remain():
    """The beginnings of bends are not fitted, so a long arm changes nothing."""
    for log in drive_intervals(64.0, speed=1e3), drive_intervals(64.0, arm=0.1, speed=1e3):
        result = forward_of(log)
        assert result.frame == pytest.approx(MOUNT, abs=0.02) and result.halves_deg == pytest.approx(0.0, abs=0.02)
    result = forward_of(drive_intervals(64.0, speed=1e3))
    assert result.sigma_deg == pytest.approx(0.3, abs=0.001)
    assert result.attitude_deg == pytest.approx(np.hypot(0.3, UP_DEG), abs=0.001)


@pytest.mark.parametrize("lengths_s", [(24.0,), (), (32.0,), (16.0, 16.0)])
def test_forward_needs_four_blocks(lengths_s):
    assert (find_forward([drive_intervals(s) for s in lengths_s]) is not None) is (sum(lengths_s) > 30.0)


@pytest.mark.parametrize("turn_deg", [6.0, -6.0])
def test_the_halves_of_the_driving_are_compared(turn_deg):
    """The halves may be in different logs."""
    turned = drive_intervals(64.0, turn_deg, from_s=32.0, speed=1e3)
    assert forward_of(turned).halves_deg == pytest.approx(6.0, abs=0.05)
    pair = drive_intervals(32.0, speed=1e3), drive_intervals(32.0, turn_deg, speed=1e3)
    assert forward_of(*pair).halves_deg == pytest.approx(6.0, abs=0.05)


@pytest.mark.parametrize(
    ("sigma", "halves", "sure"), [(1.49, -3.9, True), (1.51, 0.0, False), (0.1, -4.1, False), (0.1, 4.1, False)]
)
def test_forward_is_sure_within_the_limits_of_the_firmware(sigma, halves, sure):
    assert Forward(MOUNT, sigma, 1.0, halves).sure is sure


def device_of(frame, quality_deg, halves_deg=None):
    """Return the firmware's alignment."""
    calibration = CalibrationFile(vehicle_from_sensor=frame, aligned=True)
    return DriveFit(calibration, "car", "fit", 9, 0, 3, quality_deg, 60.0, 0.3, halves_deg, None, [], [], np.zeros(3))


@pytest.mark.parametrize("halves_deg", [None, 2.5])
def test_a_short_drive_has_the_alignment_of_the_firmware(halves_deg):
    result = forward_of(drive_intervals(24.0), device=device_of(MOUNT, 0.4, halves_deg))
    assert result.frame == pytest.approx(MOUNT)
    assert (result.sigma_deg, result.halves_deg) == (pytest.approx(0.5), halves_deg or 0.0)
    assert result.attitude_deg == pytest.approx(np.hypot(0.5, UP_DEG))


# Matrices from the sensor's axes to the vehicle's, with the rows left, up, forward, measured with the recordings' own
# receivers.
REFERENCES = {
    "short-turn-loop-nominal-001": [[0.0124, 0.9995, 0.0302], [-0.0021, -0.0302, 0.9995], [0.9999, -0.0124, 0.0017]],
    "medium-turn-loop-nominal-001": [[0.0473, 0.9987, 0.0204], [-0.0003, -0.0204, 0.9998], [0.9989, -0.0473, -0.0006]],
    "medium-turn-loop-nominal-002": [[0.0098, 0.9999, -0.0040], [0.0, 0.0040, 1.0], [1.0, -0.0098, 0.0]],
}


@pytest.mark.parametrize("name", REFERENCES)
def test_forward_of_recorded_drives(shared_data, name):
    log = usable(read_log(shared_data / f"car-urban-{name}.csv.gz"), False)
    fit = fit_logs([log], None, "car")
    driven = [evidence.intervals(log, "car", fit.lag_s or 0.0, fit.bias_dps)]
    alone, mean = forward_of(*driven), forward_of(*driven, device=fit)
    assert mean.sure and abs(yaw_deg(alone.frame, REFERENCES[name])) < 1.0
    device = fit.calibration.vehicle_from_sensor
    assert abs(yaw_deg(mean.frame, REFERENCES[name])) < abs(yaw_deg(device, REFERENCES[name])) + 0.1
    for frame, sigma_deg in (mean.frame, mean.attitude_deg), (device, fit.attitude_deg):
        off = np.degrees(rotation_vector(frame @ np.array(REFERENCES[name]).T))
        assert 1.0 < sigma_deg < 1.6 and np.linalg.norm(off) < 1.5 * sigma_deg
