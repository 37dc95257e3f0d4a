"""Tests the result for a period, which is all logs of one mount of one vehicle."""

import numpy as np
import pytest
from kickstand_fleet.manifest import Period, read_manifest
from kickstand_fleet.period import work_on_period
from kickstand_tools.analysis.brake_tests import brake_tests
from kickstand_tools.analysis.ride import vehicle_channels
from kickstand_tools.analysis.stops.brake_test import find_stops
from kickstand_tools.calibration.file import CalibrationFile
from made_fleet import drive, turn_of, worked_on, yaw_deg


@pytest.fixture(scope="module")
def results(fleet):
    return {period.vehicle: work_on_period(period) for period in read_manifest(str(fleet.manifest))}


def test_each_vehicle_gets_its_expected_result(fleet, results):
    assert len(results) == len(fleet.vehicles)
    for made in fleet.vehicles:
        row = results[made.name].alignment
        truth = fleet.truth[made.name]
        assert row["status"] == truth["status"], row
        if row["status"] == "aligned":
            assert abs(yaw_deg(row["vehicle_from_sensor"], fleet.mount(made.name))) < 1.6
            assert row["reason"] == row["message"] == "" and row["quality_deg"] < 1.5
        else:
            assert row["reason"] in truth["reasons"].split() and row["message"]
            assert row["vehicle_from_sensor"] is None


def test_a_mount_that_moved_is_found_where_it_moved(fleet, results):
    for made in fleet.vehicles:
        moved = results[made.name].moved
        assert len(moved) == (1 if made.moved_deg else 0), made.name
        if moved:
            row = moved[0]
            assert row["turned_deg"] == pytest.approx(made.moved_deg, abs=3.0 * row["turned_sigma_deg"])
            assert row["log"] == str(made.paths[made.moved_log])
            assert row["within_log"] == (made.trouble == "moved-within")
            assert row["utc_s"] > 1.7e9
            if row["within_log"]:
                assert row["at_s"] == pytest.approx(made.moved_s, abs=10.0)


def test_a_bad_log_costs_its_own_row_only(fleet, results):
    garbage = next(made for made in fleet.vehicles if made.trouble == "garbage")
    found = results[garbage.name]
    assert [(row["log"], row["reason"]) for row in found.errors] == [(str(garbage.paths[0]), "unreadable")]
    assert (found.alignment["logs"], found.alignment["logs_left_out"]) == (len(garbage.paths) - 1, 1)
    assert found.alignment["status"] == "aligned" and found.brake_tests


def test_period_without_readable_logs_gets_an_error_row(tmp_path):
    bad = tmp_path / "bad.csv"
    bad.write_text("t_s,ax_g\n")
    found = work_on_period(Period("v", "m", "car", (str(bad), str(tmp_path / "none.csv.gz"))))
    assert (found.alignment["status"], found.alignment["reason"]) == ("error", "unreadable")
    assert [row["mount"] for row in found.errors] == ["m", "m"]
    assert "none.csv.gz: there is no such file" in found.errors[1]["message"]


def test_bug_in_kickstand_gets_an_error_row(monkeypatch, fleet):
    def broken(*_):
        raise ZeroDivisionError("on purpose")

    monkeypatch.setattr("kickstand_fleet.period.fit_logs", broken)
    found = work_on_period(read_manifest(str(fleet.manifest))[0])
    assert (found.alignment["status"], found.alignment["reason"]) == ("error", "fault")
    assert "ZeroDivisionError: on purpose" in found.errors[0]["message"]


def test_mirrored_axes_are_not_aligned(tmp_path):
    log, _ = drive(12)
    log.gyro_dps = -log.gyro_dps
    found = worked_on(tmp_path, log)
    assert (found.alignment["status"], found.alignment["reason"]) == ("refused", "left-handed")


def test_brake_tests_of_a_car_without_the_lean_filter(fleet, results):
    made = fleet.vehicles[0]
    row = results[made.name].alignment
    known = CalibrationFile(
        gyro_bias_dps=np.array(row["gyro_bias_dps"]),
        vehicle_from_sensor=np.array(row["vehicle_from_sensor"]),
        aligned=True,
        vehicle="car",
    )
    whole = find_stops(vehicle_channels(made.paths[0], known))
    quick = brake_tests(made.paths[0], known)
    assert len(quick) == len(whole) >= 3
    for one, other in zip(quick, whole, strict=True):
        assert one.mfdd_mps2 == pytest.approx(other.mfdd_mps2, rel=0.02)
        assert one.initial_speed_mps == pytest.approx(other.initial_speed_mps, rel=0.02)


@pytest.mark.parametrize(("degrees", "axis"), [(5.5, (1, 0.3, 0)), (8.0, (0.2, 1, 0.3))])
def test_small_turn_between_two_logs_is_found(tmp_path, degrees, axis):
    first, sensor = drive(21)
    sensor.mount = turn_of(degrees, axis) @ sensor.mount
    second, _ = drive(22, sensor=sensor)
    found = worked_on(tmp_path, first, second)
    assert found.alignment["reason"] == "mount-moved"
    row = found.moved[0]
    turned = [row["about_left_deg"], row["about_up_deg"], row["about_forward_deg"]]
    assert turned == pytest.approx(degrees * np.array(axis) / np.linalg.norm(axis), abs=2.5)
