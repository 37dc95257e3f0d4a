"""The page Rides without its page: which file is what, and which files belong together."""

import json
from pathlib import Path

import pytest
from kickstand_tools.web import browser_rides
from support.recordings import analysis_rides, app_exports

RIDING = app_exports.riding().every(4)
CALIBRATION = json.dumps(analysis_rides.CALIBRATION)
POINT = '<trkpt lat="47.{k}" lon="8"><time>2026-01-01T00:00:{k}Z</time></trkpt>'
TRACK = "".join(POINT.replace("{k}", str(k)) for k in range(10, 50))
TRACK = f'<gpx version="1.1"><trk><trkseg>{TRACK}</trkseg></trk></gpx>'
PHYPHOX = {name: text for name, text in app_exports.phyphox(RIDING).items() if "/" not in name}


@pytest.fixture(scope="module")
def log(ride) -> str:
    return ride.read_text()[:3000].rpartition("\n")[0] + "\n"


@pytest.fixture
def sorted_out(tmp_path, monkeypatch):
    """Return a function that gives these files to the page. files: {name: text or content}."""

    def give(files):
        for folder in ("given", "here"):
            (tmp_path / folder).mkdir()
        for name, content in files.items():
            (tmp_path / "given" / name).write_bytes(content.encode() if isinstance(content, str) else content)
        monkeypatch.chdir(tmp_path / "here")  # the code deletes all other files in its working directory
        return json.loads(browser_rides.rides(str(tmp_path / "given"), json.dumps(list(files))))

    return give


@pytest.mark.parametrize(
    ("names", "expected"),
    [
        ("A.csv B.csv A.cal.json", {"A.csv": "A.cal.json", "B.csv": ""}),
        ("A.csv B.csv bike.json", {"A.csv": "bike.json", "B.csv": "bike.json"}),
        ("A.csv old.json new.json", {"A.csv": "new.json"}),
        ("ride-10.csv ride-9.csv a.csv 10.csv", {"10.csv": "", "a.csv": "", "ride-9.csv": "", "ride-10.csv": ""}),
        ("b.csv x.gpx y.GPX a.csv", {"a.csv": "", "b.csv": ""}),
    ],
)
def test_a_ride_gets_its_calibration_and_the_last_track(sorted_out, log, names, expected):
    """The rides are sorted as a reader counts. A calibration that belongs to another ride is not used."""
    contents = {"csv": log, "json": CALIBRATION, "gpx": TRACK}
    result = sorted_out({name: contents[name.lower().rpartition(".")[2]] for name in names.split()})
    assert result["why"] == {}
    calibrations = [(ride["log"], ride["calibration"]) for ride in result["rides"]]
    assert calibrations == list(expected.items())
    assert {ride["track"] for ride in result["rides"]} == {"y.GPX" if "gpx" in names else ""}


def test_each_file_gets_its_kind_or_its_reason(sorted_out, log):
    result = sorted_out(
        {
            "log.csv": log,
            "lap.csv": app_exports.racechrono(RIDING),
            "c.json": CALIBRATION,
            "d.json": "{}",
            "table.csv": "a,b\n1,2\n3,4\n",
            "x.gpx": TRACK,
            "half.csv": "t_s,ax\n" + "".join(f"{k},1\n" for k in range(20)),
            "ride.parquet": b"PAR1" + bytes(40),
            "picture.png": b"\x89PNG\r\n\x1a\n" + bytes(8),
        }
    )
    kinds = result["kinds"]
    assert (kinds["log.csv"], kinds["c.json"], kinds["x.gpx"]) == ("log", "calibration", "track")
    assert kinds["lap.csv"].startswith("of RaceChrono")
    assert [(ride["log"], ride["isLog"]) for ride in result["rides"]] == [("lap.csv", False), ("log.csv", True)]
    for name, words in (
        ("d.json", "is no calibration: version is missing: give the"),
        ("table.csv", "no table of sensors"),
        ("half.csv", "no table of sensors"),
        ("ride.parquet", "is Parquet, which this page cannot read: give the ride as CSV"),
        ("picture.png", "not text: give what an app has exported"),
    ):
        reason = result["why"].pop(name)
        assert words in reason and not any(part in reason for part in ("\n", "kickstand", "--"))
    assert result["why"] == {}


def two_tables():
    """Return the tables of an accelerometer and a gyro of an unknown logger."""
    t_s = [k / 50.0 for k in range(200)]
    accel = ["t_s,acc_x_g,acc_y_g,acc_z_g", *(f"{t:.3f},0.01,0.98,{0.1 + 0.001 * (k % 7)}" for k, t in enumerate(t_s))]
    rates = ["t_s,gyro_x_dps,gyro_y_dps,gyro_z_dps", *(f"{t:.3f},{k % 5},1.0,2.0" for k, t in enumerate(t_s))]
    return {"acc.csv": "\n".join(accel) + "\n", "gyro.csv": "\n".join(rates) + "\n"}


TABLE = app_exports.any_table(RIDING)


@pytest.mark.parametrize(
    ("files", "logs", "asks"),
    [
        (two_tables(), {"recording": ["acc.csv", "gyro.csv"]}, True),
        ({"one.csv": TABLE, "two.csv": TABLE}, {"one.csv": ["one.csv"], "two.csv": ["two.csv"]}, True),
        (
            {"a.csv": app_exports.racechrono(RIDING), **PHYPHOX},
            {"a.csv": ["a.csv"], "phyphox recording": sorted(PHYPHOX)},
            False,
        ),
        (
            {"phyphox recording": "no log", **PHYPHOX},
            {"phyphox recording_": [*sorted(PHYPHOX), "phyphox recording"]},
            False,
        ),
    ],
)
def test_files_of_one_recording_are_one_ride(sorted_out, files, logs, asks):
    """The page asks for the columns of an unknown logger's table."""
    result = sorted_out(files)
    assert {ride["log"]: sorted(ride["files"]) for ride in result["rides"]} == logs
    assert all((ride["table"] is not None) is asks for ride in result["rides"])


def test_an_archive_is_one_ride_with_its_own_name(sorted_out, tmp_path):
    path = app_exports.into(tmp_path / "lap.zip", app_exports.phyphox(RIDING))
    result = sorted_out({"lap.zip": path.read_bytes()})
    assert [(ride["log"], ride["files"], ride["table"]) for ride in result["rides"]] == [("lap.zip", ["lap.zip"], None)]
    assert result["kinds"]["lap.zip"].startswith("of phyphox")


def test_the_report_is_that_of_the_command(sorted_out, ride, calibration):
    """On the page, the same code runs in the browser."""
    from support.command import works

    sorted_out({path.name: path.read_bytes() for path in (ride, calibration)})
    report = json.loads(browser_rides.look(ride.name, calibration.name, lambda done, total: None))
    assert report["json"] == json.loads(works("report", ride, "--json").out) | {"ride": ride.name}
    assert report["warnings"] == [] and "Plotly.newPlot" in report["page"]
    (path,) = json.loads(browser_rides.smooth(ride.name, calibration.name, lambda done, total: None)).values()
    works("smooth", ride, "--out", "lean.csv")
    assert Path(path).read_text() == Path("lean.csv").read_text()
    refusal = json.loads(browser_rides.align(ride.name, lambda done, total: None))["refused"]
    assert "of riding: at least" in refusal
