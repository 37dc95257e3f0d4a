"""Test `kickstand smooth`: output and refusals."""

import json

import numpy as np
import pytest
from kickstand_tools.calibration.file import CalibrationFile, write_calibration
from kickstand_tools.logs.csv_lines import write_table
from support import command
from support.command import refused, works
from support.recordings import analysis_rides
from support.recordings.drawn_rides import drawn_ride
from support.recordings.smoothed_rides import simulated


@pytest.fixture(scope="module")
def ride(tmp_path_factory):
    """Write RIDE.csv with its calibration beside it, at 50 samples per second."""
    directory = tmp_path_factory.mktemp("ride")
    known = simulated("street", 2, 40.0)
    rows = np.column_stack((known.log.t_s + 7.25, known.log.accel_g, known.log.gyro_dps))[::4]
    write_table(directory / "RIDE.csv", command.HEADER.split(","), rows.round(5).tolist())
    write_calibration(directory / "RIDE.cal.json", known.calibration)
    return directory, known.lean_deg[::4], known.riding[::4]


def test_each_sample_has_a_row_with_the_logs_own_time(ride, tmp_path):
    directory, lean, riding = ride
    out = tmp_path / "LEAN.csv"
    result = works("smooth", directory / "RIDE.csv", "--out", out)
    assert result.err == ""
    assert result.out == f"written: {out}, {len(lean)} samples\n"
    assert out.read_text().startswith("t_s,lean_deg,lean_sigma_deg,pitch_deg,speed_mps,doubtful\n7.25,")
    got = analysis_rides.table(out)
    assert np.array_equal(got["t_s"], analysis_rides.table(directory / "RIDE.csv")["t_s"])
    assert np.max(np.abs(got["lean_deg"] - lean)[riding]) < 3.0
    assert np.all(got["lean_sigma_deg"] > 0.0)


def test_unusable_calibration_is_refused(ride, tmp_path):
    log = ride[0] / "RIDE.csv"
    for change, words in ({"vehicle": "car"}, "a car does not lean"), ({"aligned": False}, "not aligned"):
        cal = command.write_cal(tmp_path / "CAL.json", **{"aligned": True, **change})
        refused(tmp_path, "smooth", log, "--calibration", cal, "--out", tmp_path / "LEAN.csv", words=words)


def test_the_ride_itself_is_not_overwritten(ride):
    directory, _, _ = ride
    refused(directory, "smooth", directory / "RIDE.csv", "--out", directory / "RIDE.csv", words="also an input")


def test_doubtful_accelerations_are_reported_everywhere(tmp_path):
    drawn = drawn_ride(3028, 90.0, ["foreign"])
    log = drawn.logs[0]
    rows = np.column_stack((log.t_s, log.accel_g, log.gyro_dps))
    write_table(tmp_path / "RIDE.csv", command.HEADER.split(","), rows.round(5).tolist())
    write_calibration(tmp_path / "RIDE.cal.json", drawn.calibrations[0])
    result = works("smooth", tmp_path / "RIDE.csv", "--out", tmp_path / "LEAN.csv")
    assert "% of the riding the accelerations are not those of a bike on its wheels" in result.err
    found = analysis_rides.table(tmp_path / "LEAN.csv")["doubtful"]
    assert set(found) == {0.0, 1.0}
    assert np.mean(found[drawn.riding(0)]) > 0.5
    remarks = json.loads(works("report", tmp_path / "RIDE.csv", "--json").out)["remarks"]
    (remark,) = (remark for remark in remarks if remark["code"] == "not-the-bikes")
    assert remark["values"][0] > 50.0
    assert remark["words"] in result.err.replace("\n", " ")


def test_report_has_the_smoothed_or_the_live_lean(ride):
    directory, lean, _ = ride
    log = directory / "RIDE.csv"
    largest = {}
    for option, word, said in ((), "smoothed", "best estimate"), (("--live",), "live", "as the display showed it"):
        data = json.loads(works("report", log, "--json", *option).out)
        assert data["lean"] == word
        assert said in works("report", log, *option).out
        largest[word] = [data[f"max_{side}_deg"]["value"] for side in ("left", "right")]
    true = [-np.min(lean), np.max(lean)]  # the largest lean to the left is the pose on the kickstand
    assert np.max(np.abs(np.subtract(largest["smoothed"], true))) < 1.0
    assert largest["smoothed"] != largest["live"]


def test_slow_log_is_reported_with_the_displayed_lean(tmp_path):
    """The log has only 5 samples per second. `report` uses the lean that the display showed, and `smooth` refuses the
    log."""
    t_s = np.arange(0.0, 60.0, 0.2)
    noise = np.random.default_rng(1).normal(0.0, 0.01, (len(t_s), 6))
    table = np.column_stack((t_s, noise + [0.0, 1.0, 0.0, 0.0, 0.0, 0.0]))
    ride, cal = tmp_path / "RIDE.csv", tmp_path / "RIDE.cal.json"
    command.write(ride, table)
    write_calibration(cal, CalibrationFile(aligned=True))
    assert "the smoothed lean needs 10 samples per second" in command.works("report", ride).err
    command.refused(tmp_path, "smooth", ride, "--out", tmp_path / "LEAN.csv", words="under 10 samples per second")
