"""The files that a user gives to the page Rides are identified."""

import json
import os
from pathlib import Path

import pytest
from kickstand_tools.web import rides_given
from support.recordings import analysis_rides, app_exports


def given(tmp_path, monkeypatch, **files):
    """Return sorted_out() of these files. files: {name with __ for a dot: content}."""
    monkeypatch.chdir(tmp_path)
    names = []
    for name, text in files.items():
        names.append(name.replace("__", "."))
        Path(names[-1]).write_text(text)
    return rides_given.sorted_out(names)


def test_each_given_file_gets_its_kind_or_its_reason(tmp_path, monkeypatch, ride):
    calibration = json.dumps(analysis_rides.CALIBRATION)
    export = app_exports.racechrono(app_exports.riding().every(4))
    log = ride.read_text()[:3000].rpartition("\n")[0] + "\n"
    table = "a,b\n1,2\n3,4\n"
    found = given(
        tmp_path,
        monkeypatch,
        r10__csv=log,
        r9__csv=log,
        lap__csv=export,
        c__json=calibration,
        d__json="{}",
        n__csv=table,
    )
    assert [one.log for one in found.rides] == ["lap.csv", "r9.csv", "r10.csv"]
    assert found.kinds["r9.csv"] == "log" and found.kinds["c.json"] == "calibration"
    assert found.kinds["lap.csv"].startswith("of RaceChrono")
    assert set(found.refused) == {"d.json", "n.csv"}
    assert {one.calibration for one in found.rides} == {"c.json"}
    assert {one.track for one in found.rides} == {""}


def test_every_ride_gets_the_last_track(tmp_path, monkeypatch, ride):
    point = '<trkpt lat="47.{k}" lon="8"><time>2026-01-01T00:00:{k}Z</time></trkpt>'
    points = "".join(point.replace("{k}", str(k)) for k in range(10, 50))
    track = f'<gpx version="1.1"><trk><trkseg>{points}</trkseg></trk></gpx>'
    log = ride.read_text()[:3000].rpartition("\n")[0] + "\n"
    found = given(tmp_path, monkeypatch, a__csv=log, x__gpx=track, y__GPX=track, b__csv=log)
    assert not found.refused
    assert [one.track for one in found.rides] == ["y.GPX", "y.GPX"]
    assert found.kinds["x.gpx"] == "track"


def two_tables(shift_s=0.0):
    """Return the tables of an accelerometer and a gyro of an unknown logger. shift_s: added to the gyro's times."""
    t_s = [k / 50.0 for k in range(200)]
    accel = ["t_s,acc_x_g,acc_y_g,acc_z_g", *(f"{t:.3f},0.01,0.98,{0.1 + 0.001 * (k % 7)}" for k, t in enumerate(t_s))]
    rates = ["t_s,gyro_x_dps,gyro_y_dps,gyro_z_dps", *(f"{t + shift_s:.3f},{k % 5},1.0,2.0" for k, t in enumerate(t_s))]
    return {"acc__csv": "\n".join(accel) + "\n", "gyro__csv": "\n".join(rates) + "\n"}


def test_two_tables_of_one_recording_are_one_ride(tmp_path, monkeypatch):
    found = given(tmp_path, monkeypatch, **two_tables())
    (ride,) = found.rides
    assert (ride.log, sorted(ride.files)) == ("recording", ["acc.csv", "gyro.csv"])
    assert sorted(path.name for path in Path("recording").iterdir()) == ["acc.csv", "gyro.csv"]
    assert ride.table is not None and ride.table.joined
    assert found.kinds == {"acc.csv": "table", "gyro.csv": "table"} and not found.refused


def test_each_table_with_all_sensors_is_a_ride(tmp_path, monkeypatch):
    table = app_exports.any_table(app_exports.riding().every(4))
    found = given(tmp_path, monkeypatch, one__csv=table, two__csv=table)
    assert [(ride.log, ride.files) for ride in found.rides] == [("one.csv", ["one.csv"]), ("two.csv", ["two.csv"])]
    assert not any(ride.table is None or ride.table.joined for ride in found.rides)


def test_one_incomplete_table_is_refused(tmp_path, monkeypatch):
    found = given(tmp_path, monkeypatch, acc__csv="t_s,ax\n" + "".join(f"{k},1\n" for k in range(20)))
    assert not found.rides and not found.kinds and set(found.refused) == {"acc.csv"}


def test_an_archive_is_one_ride_with_its_own_name(tmp_path, monkeypatch):
    app_exports.into(tmp_path / "lap.zip", app_exports.phyphox(app_exports.riding().every(4)))
    monkeypatch.chdir(tmp_path)
    found = rides_given.sorted_out(["lap.zip"])
    assert [(ride.log, ride.files, ride.table) for ride in found.rides] == [("lap.zip", ["lap.zip"], None)]
    assert found.kinds["lap.zip"].startswith("of phyphox")


def test_parquet_is_refused_with_what_to_do(tmp_path, monkeypatch):
    found = given(tmp_path, monkeypatch, ride__parquet="PAR1")
    assert "give the ride as CSV" in str(found.refused["ride.parquet"])


@pytest.mark.skipif(os.name == "nt", reason="file names on Windows have no capitals of their own")
def test_rides_are_sorted_as_a_reader_counts():
    names = ["ride-10", "Ride-2", "ride-2b", "a", "10", "9"]
    assert sorted(names, key=rides_given._by_number) == ["9", "10", "a", "Ride-2", "ride-2b", "ride-10"]
