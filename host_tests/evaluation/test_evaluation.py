"""The estimators on simulated and recorded rides, the faults, and the commands `evaluate` and `bands`."""

import functools
import json
import math

import numpy as np
import pytest
from kickstand_sim.simulation.ride import ride
from kickstand_tools.common.messages import InputError
from kickstand_tools.estimation.alignment import fit_ride
from kickstand_tools.logs.reader import read_log
from kickstand_workshop.evaluation import estimators, faults, integrity, runs, setting_off
from kickstand_workshop.evaluation.estimators import Samples
from kickstand_workshop.evaluation.integrity import FaultJob
from support.command import refused, works

FILTERS = [name for name in estimators.OTHERS if estimators.PACKAGES.get(name) not in estimators.missing()]
NAMED = {fault.title: fault for fault in faults.FAULTS}


@pytest.mark.parametrize("name", FILTERS)
def test_every_filter_has_the_signs_right(name):
    """The bike leans from upright to the side within 1.5 s, and keeps this lean for the same time."""
    for lean_deg in (30.0, -25.0):
        lean = np.radians(np.concatenate((np.linspace(0.0, lean_deg, 300), np.full(300, lean_deg))))
        rate, force = np.zeros((600, 3)), np.column_stack((np.sin(lean), np.cos(lean), np.zeros(600)))
        rate[:300, 2] = lean_deg / 1.5
        shown = estimators.OTHERS[name](Samples(np.arange(600) / 200.0, force, rate))
        assert shown[-1] == pytest.approx(lean_deg, abs=2.0) and shown[150] == pytest.approx(lean_deg / 2.0, abs=3.0)


@functools.cache
def swept():
    return runs.run(runs.Job("sweeper", 1, seconds=120.0))


@pytest.mark.long
def test_every_estimator_is_scored_and_none_beats_the_oracle():
    """In a long turn, the lean of filters that trust the force decays. Riders complain about this decay. The oracle
    knows the speed, the alignment and the sensor's errors."""
    scores = swept().scores
    names = {"kickstand", "smoothed", "formula", "formula 0.3 s", "possible", "GPS 1 Hz", "GPS 10 Hz"}
    assert swept().refusal is None and set(scores) == {*names, *FILTERS}
    rms = {name: figures.rms_deg for name, figures in scores.items()}
    assert all(map(math.isfinite, rms.values()))
    assert rms["smoothed"] < 0.6 * rms["kickstand"] < rms["kickstand"] < rms["formula 0.3 s"] < 0.5 * rms["formula"]
    assert scores["complementary"].slope < 0.5 and 0.9 < scores["kickstand"].slope < 1.1
    assert rms["possible"] < min(0.25, 0.8 * min(rms[name] for name in rms if name not in ("possible", "smoothed")))
    assert all(rms[name + " best"] < 0.5 * rms[name] for name in FILTERS if name + " best" in FILTERS)
    assert scores["GPS 1 Hz"].lag_ms > 300.0 > scores["GPS 10 Hz"].lag_ms


@pytest.mark.long
@pytest.mark.parametrize("calibrated", [runs.calibrated_by_poses, runs.calibrated_by_log])
def test_the_calibration_is_from_the_poses_alone(calibrated):
    """The slope of the ground and the rider's hand cause the error of the mount."""
    simulated = ride("street", 2, 60.0, pitch_change_deg=0.0, share=0.0)
    calibration = calibrated(simulated)
    assert np.any(calibration.gyro_sigma) == (calibrated is runs.calibrated_by_log)
    cosine = (np.trace(calibration.vehicle_from_sensor @ simulated.vehicle_from_sensor.T) - 1.0) / 2.0
    assert np.degrees(np.arccos(cosine)) < 1.5 and calibration.six_done and calibration.aligned
    assert calibration.accel_slope == pytest.approx([1.0] * 3, abs=0.002)


@pytest.fixture
def one_other(monkeypatch):
    """Compare with only one other filter, because each takes some seconds."""
    monkeypatch.setattr(estimators, "OTHERS", {"complementary": estimators.OTHERS["complementary"]})


@pytest.mark.long
def test_set_up_errors_of_the_job_are_simulated(one_other):
    jobs = [runs.Job("parked", 0, 60.0, error, pitch_change_deg=0.0) for error in (0.0, 1.5)]
    fair, off = (runs.ridden(job)[1]["complementary"] for job in jobs)
    assert np.mean(off - fair) == pytest.approx(-1.5, abs=0.3)


def test_a_refused_calibration_is_reported_not_scored(monkeypatch):
    def refuse(*_):
        raise InputError("the free pose reads 1.021 g")

    monkeypatch.setattr(runs, "fit_procedure", refuse)
    result = runs.run(runs.Job("parked", 0, seconds=20.0))
    assert (result.refusal, result.scores) == ("the free pose reads 1.021 g", {})


@pytest.mark.long
def test_recorded_motorcycle_has_its_known_scores(shared_data):
    """The slope is the share of the true lean that a filter shows. The reference is computed from speed and yaw
    rate."""
    path = shared_data / "motorcycle-ride.csv.gz"
    scores = runs.score_recording(path).scores
    assert scores["complementary"].slope == pytest.approx(0.40, abs=0.06)
    log = read_log(path)
    assert 15.0 < np.abs(runs.reference_lean(log, fit_ride(log).calibration)).max() < 25.0
    assert scores["kickstand"].rms_deg < scores["formula 0.3 s"].rms_deg < scores["formula"].rms_deg
    assert scores["kickstand"].rms_deg < 2.98 and 0.8 < scores["kickstand"].slope < 1.23


@pytest.mark.parametrize(
    ("fault", "seconds", "device", "misleading_s", "hidden_after_s"),
    [
        (None, 30.0, False, 0.0, None),
        ("gyro axis mirrored", 30.0, False, 3.0, 20.0),
        pytest.param("gyro axis at the end of its range", 20.0, True, 0.0, 2.0, marks=pytest.mark.long),
    ],
)
def test_a_fault_does_not_mislead_for_long(fault, seconds, device, misleading_s, hidden_after_s):
    outcome = integrity.run(FaultJob(fault and NAMED[fault], 1 - device, seconds, device=device))
    assert outcome.misleading_s <= misleading_s
    assert outcome.hidden_after_s < hidden_after_s if fault else outcome.available > 0.99
    assert not device or 0.0 < outcome.named_after_s < 5.0


@pytest.mark.parametrize("simulator", setting_off.SIMULATORS)
def test_the_next_ride_begins_with_what_the_first_ride_has_found(simulator, monkeypatch):
    """The bike was held 3 degrees from upright, without the six positions."""
    job = setting_off.BikeJob(simulator, "street", 14)
    assert (job.held_deg, job.six, job.start_c) == (-3.0, False, 32.0)
    monkeypatch.setattr(setting_off, "jobs", lambda *_: [job])
    bike = json.loads(works("evaluate", "--first-seconds", "--json").out)["rides"][0]
    assert bike["next_ride"]["first_deg"] < 0.8 and bike["next_ride"]["shown"] > 0.98
    assert simulator == "drawn" or bike["next_ride"]["first_deg"] < 0.7 * bike["first_ride"]["first_deg"]


def test_evaluate_prints_a_table(one_other):
    result = works("evaluate", "--profiles", "parked", "--seeds", 1, "--seconds", 60)
    assert "kickstand" in result.out and "parked (1)" in result.out and "nan" not in result.out
    assert max(map(len, result.out.splitlines())) <= 110


def no_change(part):
    """A function of a module, because the jobs go to other processes."""


@pytest.mark.long
def test_evaluate_prints_json_and_the_table_of_faults(monkeypatch, one_other):
    data = json.loads(works("evaluate", "--profiles", "parked", "--seeds", 1, "--seconds", 60, "--json").out)[
        "profiles"
    ]
    assert set(data) == {"parked"} and data["parked"]["kickstand"]["lag_ms"] is None
    assert math.isfinite(data["parked"]["formula"]["rms"])
    few = NAMED["gyro axis mirrored"], faults.Fault("nothing", faults.HARMLESS, no_change, seconds=5.0)
    for name, values in (("FAULTS", few), ("CLASSES", ()), ("MOUNTS", ())):
        monkeypatch.setattr(integrity, name, values)
    arguments = "evaluate", "--faults", "--seeds", "1", "--seconds", "60"
    table, data = works(*arguments).out, json.loads(works(*arguments, "--json").out)
    assert all(words in table for words in ("gyro axis mirrored", "nothing, 5 s", "hidden"))
    assert [fault["title"] for fault in data["faults"]] == ["none", "gyro axis mirrored", "nothing, 5 s"]
    assert data["rides"][0]["seed"] == 0 and data["rides"][0]["available"] > 0.9


@pytest.mark.long
def test_bands_of_simulated_and_recorded_rides(tmp_path):
    works("simulate", "--profile", "street", "--seed", "4", "--seconds", "120", "--road", "C", "--out", tmp_path)
    rides = json.loads(works("bands", tmp_path / "RIDE.csv", "--seconds", 100, "--json").out)["rides"]
    assert list(rides) == ["RIDE.csv", "street", *(f"street, road {road}" for road in "ABCD")]
    recorded, simulated = (rides[name]["vertical, g"] for name in ("RIDE.csv", "street, road C"))
    assert recorded[3] == pytest.approx(simulated[3], rel=0.3)
    works("simulate", "--profile", "parked", "--seconds", "100", "--out", tmp_path / "parked")
    refused(tmp_path, "bands", tmp_path / "parked" / "RIDE.csv", words="RIDE.csv")
