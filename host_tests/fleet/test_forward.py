"""The fleet's tool computes the direction forward from whole logs. The computed direction is more exact than the
device's, and its standard error is right."""

import dataclasses

import numpy as np
import pytest
from kickstand_fleet import evidence, forward, period
from kickstand_fleet.forward import find_forward
from kickstand_tools.calibration.drive import fit_logs, usable
from kickstand_tools.calibration.drive_refusals import MountMoved
from kickstand_tools.common.errors import RefusedInput
from kickstand_tools.logs.reader import read_log
from kickstand_tools.signals import rotation_vector
from made_fleet import drive, turn_of, worked_on, yaw_deg

SEEDS = (101, 102, 106, 109)  # with these seeds the device's forward has an error of about a degree


@pytest.fixture(scope="module")
def buses():
    """Simulate buses that brake gently about ten times.

    Returns a tuple for each bus: the device's fit, the result of the whole log, and the true mount.
    """
    found = []
    for seed in SEEDS:
        log, sensor = drive(seed, "bus", 150.0)
        fit = fit_logs([log], None, "car")
        driven = [evidence.intervals(log, "car", fit.lag_s or 0.0, fit.bias_dps)]
        found.append((fit, find_forward(driven, fit), sensor.mount))
    return found


def test_forward_without_the_road_beats_the_device(buses):
    device = [yaw_deg(fit.calibration.vehicle_from_sensor, mount) for fit, _, mount in buses]
    whole = [yaw_deg(known.frame, mount) for _, known, mount in buses]
    assert np.sqrt(np.mean(np.square(device))) > 0.95
    assert np.sqrt(np.mean(np.square(whole))) < 0.75


def test_standard_error_of_forward_is_right(buses):
    sigmas = np.array([known.sigma_deg for _, known, _ in buses])
    errors = np.array([yaw_deg(known.frame, mount) for _, known, mount in buses])
    assert np.all(sigmas < 0.7) and np.all(np.abs(errors) < 2.0 * sigmas)


def test_up_is_the_devices(buses):
    for fit, known, _ in buses:
        assert known.frame[1] == pytest.approx(fit.calibration.vehicle_from_sensor[1], abs=1e-6)
        assert known.frame @ known.frame.T == pytest.approx(np.eye(3), abs=1e-6)


@pytest.mark.parametrize(("seed", "doubt"), [(138, "uncertain"), (114, "parts-differ")])
def test_sure_whole_log_overrides_the_devices_doubt(tmp_path, seed, doubt):
    log, sensor = drive(seed, "bus", 150.0)
    assert fit_logs([log], None, "car").reason == doubt
    found = worked_on(tmp_path, log)
    assert (found.alignment["status"], found.alignment["reason"], found.alignment["message"]) == ("aligned", "", "")
    assert abs(yaw_deg(found.alignment["vehicle_from_sensor"], sensor.mount)) < 0.8
    assert found.brake_tests


@pytest.mark.parametrize("limit", ["READY_DEG", "AGREE_DEG"])
def test_uncertain_forward_is_reported_as_refused(tmp_path, monkeypatch, limit):
    monkeypatch.setattr(forward, limit, 0.1)
    found = worked_on(tmp_path, drive(4)[0])
    assert (found.alignment["status"], found.alignment["reason"]) == ("refused", "uncertain")
    assert "drive on" in found.alignment["message"] and found.alignment["quality_deg"] > 0.1
    assert found.alignment["vehicle_from_sensor"] is None and not found.brake_tests


def test_late_speed_is_not_reported_as_a_moved_mount(tmp_path, monkeypatch):
    log, _ = drive(4)
    moved = RefusedInput(MountMoved("between-stops", 8.0))
    fit = dataclasses.replace(fit_logs([log], None, "car"), refusal=moved)
    for lag_s, reason in ((0.5, "mount-moved"), (2.5, "speed-late")):
        monkeypatch.setattr(period, "fit_logs", lambda *_, lag_s=lag_s: dataclasses.replace(fit, lag_s=lag_s))
        row = worked_on(tmp_path, log).alignment
        assert (row["status"], row["reason"]) == ("refused", reason)
    assert "2.5 s late" in row["message"]


# Matrices from the sensor's axes to the vehicle's, with the rows left, up, forward. The matrices were measured with the
# recordings' own receivers.
REFERENCES = {
    "short-turn-loop-nominal-001": [[0.0124, 0.9995, 0.0302], [-0.0021, -0.0302, 0.9995], [0.9999, -0.0124, 0.0017]],
    "medium-turn-loop-nominal-001": [[0.0473, 0.9987, 0.0204], [-0.0003, -0.0204, 0.9998], [0.9989, -0.0473, -0.0006]],
    "medium-turn-loop-nominal-002": [[0.0098, 0.9999, -0.0040], [0.0, 0.0040, 1.0], [1.0, -0.0098, 0.0]],
}


@pytest.mark.parametrize("name", REFERENCES)
def test_forward_of_recorded_drives(shared_data, name):
    log = usable(read_log(shared_data / f"car-urban-{name}.csv.gz", axes=False), False)
    fit = fit_logs([log], None, "car")
    driven = [evidence.intervals(log, "car", fit.lag_s or 0.0, fit.bias_dps)]
    alone, known = find_forward(driven), find_forward(driven, fit)
    assert alone and known and known.sure and abs(yaw_deg(alone.frame, REFERENCES[name])) < 1.0
    device = fit.calibration.vehicle_from_sensor
    assert abs(yaw_deg(known.frame, REFERENCES[name])) < abs(yaw_deg(device, REFERENCES[name])) + 0.1
    for frame, sigma_deg in (known.frame, known.attitude_deg), (device, fit.attitude_deg):
        off = np.degrees(rotation_vector(frame @ np.array(REFERENCES[name]).T))
        assert 1.0 < sigma_deg < 1.6 and np.linalg.norm(off) < 1.5 * sigma_deg


def test_contradicting_device_makes_forward_uncertain(buses):
    fit, known, _ = buses[0]
    driven = [evidence.intervals(drive(SEEDS[0], "bus", 150.0)[0], "car", fit.lag_s or 0.0, fit.bias_dps)]
    turned = turn_of(10.0, [0.0, 1.0, 0.0]) @ fit.calibration.vehicle_from_sensor
    other = dataclasses.replace(fit, calibration=dataclasses.replace(fit.calibration, vehicle_from_sensor=turned))
    doubted = find_forward(driven, other)
    assert known.sure and doubted and not doubted.sure and doubted.sigma_deg > 3.0 * known.sigma_deg


def test_a_tight_turn_counts_less_than_a_wide_one():
    """A car's sensor is ahead of the rear axle, so it moves sideways in a tight turn. Forward is then less certain."""
    log, _ = drive(4)
    log = dataclasses.replace(log, gyro_dps=np.zeros_like(log.gyro_dps))
    straight = evidence.intervals(log, "car", 0.0, np.zeros(3))
    up = log.accel_g.mean(axis=0)
    log.gyro_dps[:] = evidence.TIGHT_DPS * up / np.linalg.norm(up)
    circle = evidence.intervals(log, "car", 0.0, np.zeros(3))
    driven = straight.speed > 5.0
    assert circle.weight[driven] == pytest.approx(straight.weight[driven] / 2.0, rel=0.05)


def test_logs_that_show_nothing_have_no_forward():
    log, _ = drive(4, seconds=60.0)
    driven = evidence.intervals(log, "car", 0.0, np.zeros(3))
    short = evidence.Intervals(*(getattr(driven, name)[:20] for name in evidence.Intervals.__dataclass_fields__))
    assert find_forward([short]) is None and find_forward([]) is None
