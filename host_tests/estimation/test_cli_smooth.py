"""Test `kickstand smooth`: output, remarks and refusals."""

import json

import numpy as np
import pytest
from kickstand_tools.calibration.file import CalibrationFile, write_calibration
from kickstand_tools.logs.csv_text import write_table
from kickstand_workshop.evaluation.drawn_rides import drawn_ride
from kickstand_workshop.evaluation.smoothed_rides import simulated
from support import command
from support.command import refused, works
from support.recordings import analysis_rides
from window_input import still_log


def write(directory, log, calibration):
    """Write RIDE.csv with every fourth sample, and its calibration beside it."""
    rows = np.column_stack((log.t_s + 7.25, log.accel_g, log.gyro_dps))[::4]
    write_table(directory / "RIDE.csv", command.HEADER.split(","), rows.round(5).tolist())
    write_calibration(directory / "RIDE.cal.json", calibration)
    return directory / "RIDE.csv"


@pytest.fixture(scope="module")
def ride(tmp_path_factory):
    ride = simulated("street", 2, 40.0)
    return write(tmp_path_factory.mktemp("ride"), ride.log, ride.calibration), ride.lean_deg[::4], ride.riding[::4]


def test_each_sample_has_a_row_with_the_logs_own_time(ride, tmp_path):
    log, lean, riding = ride
    out = tmp_path / "LEAN.csv"
    result = works("smooth", log, "--out", out)
    assert (result.err, result.out) == ("", f"written: {out}, {len(lean)} samples\n")
    assert out.read_text().startswith("t_s,lean_deg,lean_sigma_deg,pitch_deg,speed_mps,doubtful\n7.25,")
    table = analysis_rides.table(out)
    assert np.array_equal(table["t_s"], analysis_rides.table(log)["t_s"])
    assert np.max(np.abs(table["lean_deg"] - lean)[riding]) < 3.0
    assert np.all(table["lean_sigma_deg"] > 0.0)


@pytest.mark.parametrize(("change", "words"), [({"vehicle": "car"}, "a car does not lean"), ({}, "not aligned")])
def test_unusable_calibration_is_refused(ride, tmp_path, change, words):
    cal = command.write_cal(tmp_path / "CAL.json", **{"aligned": bool(change), **change})
    refused(tmp_path, "smooth", ride[0], "--calibration", cal, "--out", tmp_path / "LEAN.csv", words=words)
    refused(ride[0].parent, "smooth", ride[0], "--out", ride[0], words="also an input")


def test_doubtful_accelerations_are_reported(tmp_path):
    drawn = drawn_ride(3028, 60.0, ["foreign"])
    log = write(tmp_path, drawn.logs[0], drawn.calibrations[0])
    result = works("smooth", log, "--out", tmp_path / "LEAN.csv")
    assert set(analysis_rides.table(tmp_path / "LEAN.csv")["doubtful"]) == {0.0, 1.0}
    remarks = json.loads(works("report", log, "--json").out)["remarks"]
    (remark,) = (remark for remark in remarks if remark["code"] == "not-the-bikes")
    assert remark["values"][0] > 50.0
    assert remark["words"] in result.err.replace("\n", " ")


def test_report_has_the_smoothed_or_the_live_lean(ride):
    log, lean, _ = ride
    largest = {}
    for option, word, words in ((), "smoothed", "best estimate"), (("--live",), "live", "as the display showed it"):
        data = json.loads(works("report", log, "--json", *option).out)
        assert data["lean"] == word and words in works("report", log, *option).out
        largest[word] = [data[f"max_{side}_deg"]["value"] for side in ("left", "right")]
    # The largest lean to the left is the pose on the kickstand
    assert largest["smoothed"] == pytest.approx([-np.min(lean), np.max(lean)], abs=1.0) != largest["live"]


def test_a_log_at_5_hz_is_reported_with_the_displayed_lean(tmp_path):
    log = write(tmp_path, still_log(60.0, 20.0), CalibrationFile(aligned=True))
    assert "the smoothed lean needs 10 samples per second" in works("report", log).err
    refused(tmp_path, "smooth", log, "--out", tmp_path / "LEAN.csv", words="under 10 samples per second")
