"""The result of one mount of one vehicle: its status, its reasons, its rows, and what a bad log costs."""

import errno
from pathlib import Path

import numpy as np
import pytest
from fleet_drives import drive, result_of, turn_of, yaw_deg
from kickstand_fleet import files, signals
from kickstand_fleet.manifest import Period
from kickstand_fleet.period import work_on_period
from kickstand_tools.analysis.ride import vehicle_channels
from kickstand_tools.analysis.stops import brake_tests, find_stops
from kickstand_tools.calibration.file import CalibrationFile
from kickstand_tools.logs.log import Log

NO_FILE = Period("bus 12", "front", "car", ("no-such-file.csv",))


def test_each_vehicle_has_its_expected_result(fleet, results):
    assert len(results) == len(fleet.vehicles)
    for vehicle in fleet.vehicles:
        row, truth = results[vehicle.name].alignment, fleet.truth[vehicle.name]
        assert row["status"] == truth["status"], row
        if row["status"] == "aligned":
            assert abs(yaw_deg(row["vehicle_from_sensor"], fleet.mount(vehicle.name))) < 1.6
            assert row["reason"] == row["message"] == "" and row["quality_deg"] < 1.5
        else:
            assert row["reason"] in truth["reasons"].split() and row["message"]
            assert row["vehicle_from_sensor"] is row["gyro_bias_dps"] is None
            assert not results[vehicle.name].brake_tests


@pytest.mark.parametrize("trouble", ["moved-between", "moved-within"])
def test_a_move_has_its_log_its_time_and_its_angle(fleet, results, trouble):
    (vehicle,) = (vehicle for vehicle in fleet.vehicles if vehicle.trouble == trouble)
    (row,) = results[vehicle.name].moved
    within, log = trouble == "moved-within", str(vehicle.paths[vehicle.moved_log])
    assert row["turned_deg"] == pytest.approx(vehicle.moved_deg, abs=3.0 * row["turned_sigma_deg"])
    components = [row[f"about_{axis}_deg"] for axis in ("left", "up", "forward")]
    assert np.linalg.norm(components) == pytest.approx(row["turned_deg"])
    assert row["turned_deg"] / row["sigmas"] < 3.0 and (row["log"], row["within_log"]) == (log, within)
    message, turned = results[vehicle.name].alignment["message"], f"turned by {row['turned_deg']:.0f} degrees "
    start_utc_s = files.open_log(log).start_utc_s
    if within:
        assert row["at_s"] == pytest.approx(vehicle.moved_s, abs=10.0)
        assert row["utc_s"] == pytest.approx(start_utc_s + row["at_s"])
        assert f"{turned}in {log} at {row['at_s']:.0f} s: cut it there (kickstand cut)" in message
    else:
        assert row["at_s"] is None and row["utc_s"] == pytest.approx(start_utc_s)
        assert f"{turned}before {log}: give {log} and the logs after it another mount" in message


def test_an_aligned_drive_has_its_numbers_and_its_picture(tmp_path):
    log, sensor = drive(21)
    result = result_of(tmp_path, log)
    row = result.alignment
    assert (row["kind"], row["logs"], row["logs_left_out"], row["mount"]) == ("car", 1, 0, "")
    assert row["driven_s"] == pytest.approx(log.t_s[-1], abs=0.01)
    assert row["start_utc_s"] == pytest.approx(1.79e9, abs=0.2) and row["speed_lag_s"] == pytest.approx(0.3, abs=0.1)
    assert np.reshape(row["vehicle_from_sensor"], (3, 3)) == pytest.approx(sensor.mount, abs=0.03)
    assert row["gyro_bias_dps"] == pytest.approx(sensor.bias_dps, abs=0.1)
    assert row["stops"] >= 3 and row["events_used"] > 5 and 0.0 < row["quality_deg"] < row["attitude_deg"] < 3.0
    points = np.array(result.picture)
    assert 80 < len(points) <= 160 and np.array_equal(points, points.round(3))
    change, forward, centripetal, left = points.T
    assert np.corrcoef(change, forward)[0, 1] > 0.9 and np.polyfit(change, forward, 1)[0] == pytest.approx(
        1.0, abs=0.15
    )
    assert np.corrcoef(centripetal, left)[0, 1] > 0.9


def test_brake_tests_are_those_of_a_report(fleet, results):
    """A fleet finds them without the lean filter."""
    vehicle = fleet.vehicles[0]
    result = results[vehicle.name]
    bias_dps, frame = (np.array(result.alignment[name]) for name in ("gyro_bias_dps", "vehicle_from_sensor"))
    calibration = CalibrationFile(
        gyro_bias_dps=bias_dps, vehicle_from_sensor=frame.reshape(3, 3), aligned=True, vehicle="car"
    )
    path = vehicle.paths[0]
    stops, quick = find_stops(vehicle_channels(path, calibration)), brake_tests(path, calibration)
    rows = [row for row in result.brake_tests if row["log"] == str(path)]
    assert len(rows) == len(quick) == len(stops) >= 3
    for row, test, stop in zip(rows, quick, stops):
        assert row["mfdd_mps2"] == pytest.approx(stop.mfdd_mps2, rel=0.02)
        assert row["initial_speed_mps"] == pytest.approx(stop.initial_speed_mps, rel=0.02)
        names = ("start_s", "duration_s", "distance_m", "peak_mps2", "jerk_mps3", "side_m", "heading_deg", "speed_from")
        assert [row[name] for name in names] == [getattr(test, name) for name in names]
        assert row["utc_s"] == pytest.approx(result.alignment["start_utc_s"] + row["start_s"])


def without_speed(log):
    return Log(log.t_s, log.accel_g, log.gyro_dps, np.full(len(log.t_s), np.nan), name="log")


def mirrored(log):
    return Log(log.t_s, log.accel_g, -log.gyro_dps, log.speed_mps, name="log")


@pytest.mark.parametrize(
    ("seed", "how", "change", "reason"),
    [
        (12, {}, mirrored, "left-handed"),
        (21, {"seconds": 60.0}, without_speed, "no-speed"),
        (21, {"seconds": 100.0, "straight": False}, None, "few-events"),
        (21, {"late_s": 2.6}, None, "speed-late"),
    ],
)
def test_a_drive_that_shows_no_alignment_is_refused(tmp_path, seed, how, change, reason):
    log, _ = drive(seed, **how)
    result = result_of(tmp_path, change(log) if change else log)
    row = result.alignment
    assert (row["status"], row["reason"], bool(row["message"])) == ("refused", reason, True)
    assert row["vehicle_from_sensor"] is None and not result.brake_tests


def test_a_bad_log_costs_its_own_row_only(fleet, results):
    vehicle = next(vehicle for vehicle in fleet.vehicles if vehicle.trouble == "garbage")
    result = results[vehicle.name]
    assert [(row["log"], row["reason"]) for row in result.errors] == [(str(vehicle.paths[0]), "unreadable")]
    assert (result.alignment["logs"], result.alignment["logs_left_out"]) == (len(vehicle.paths) - 1, 1)
    assert result.alignment["status"] == "aligned" and result.brake_tests


@pytest.mark.parametrize(
    ("error", "reason", "words"),
    [
        (MemoryError(), "no-memory", "more memory than there is"),
        (OSError(errno.EIO, "Input/output error"), "unreadable", "Input/output error"),
        (KeyError("x"), "fault", "KeyError: 'x' (test_period.py, line "),
    ],
)
def test_no_error_stops_a_fleet(monkeypatch, error, reason, words):
    def broken(_):
        raise error

    monkeypatch.setattr(files, "open_log", broken)
    result = work_on_period(NO_FILE)
    assert (result.alignment["status"], result.alignment["reason"]) == ("error", reason)
    assert words in result.errors[0]["message"]


def test_signals_are_along_vehicle_axes_in_one_file_per_day(tmp_path):
    from pyarrow import parquet

    mount, midnight, t_s = turn_of(50.0, (1.0, 2.0, 3.0)), 20_000 * 86_400.0, np.linspace(0.0, 29.9, 300)
    force, rates = np.tile(mount[1] + 0.5 * mount[2], (300, 1)), np.tile(10.0 * mount[0], (300, 1))
    log = Log(t_s, force, rates, np.full(300, 7.0), utc_s=midnight - 9.95 + t_s, name="a/drive 1.csv.gz")
    calibration, period = CalibrationFile(vehicle_from_sensor=mount, aligned=True), Period("bus 12", "front", "car", ())
    paths = [Path(path) for path in signals.write(str(tmp_path), period, log, calibration)]
    assert [path.parent.name for path in paths] == ["day=2024-10-03", "day=2024-10-04"]
    assert {path.parent.parent.name for path in paths} == {"vehicle=bus%2012"}
    assert len({path.name for path in paths}) == 1 and paths[0].name.startswith("front%20drive%201-")
    first, second = (parquet.ParquetFile(path).read().to_pydict() for path in paths)
    assert (len(first["t_s"]), len(second["t_s"])) == (100, 200) and list(first) == list(signals.COLUMNS)
    assert second["t_s"][0] == pytest.approx(10.0) and second["utc_s"][0] == pytest.approx(midnight + 0.05)
    assert [first[f"{axis}_g"][0] for axis in ("left", "up", "forward")] == pytest.approx([0.0, 1.0, 0.5], abs=1e-6)
    rates = [first[f"about_{axis}_dps"][0] for axis in ("left", "up", "forward")]
    assert rates == pytest.approx([10.0, 0.0, 0.0], abs=1e-5) and first["speed_mps"][0] == 7.0
    schema = parquet.read_schema(paths[0])
    assert schema.field("t_s").type == "double" and schema.field("up_g").type == "float"
    undated = Log(t_s, force, np.zeros((300, 3)), log.speed_mps, name="a/drive 1.csv.gz")
    (path,) = signals.write(str(tmp_path), period, undated, calibration)
    assert Path(path).parent.name == "day=unknown" and parquet.ParquetFile(path).read().to_pydict()["utc_s"][0] is None
