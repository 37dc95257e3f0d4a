"""Tests the estimators on simulated and recorded rides, and the command `kickstand evaluate`."""

import json
import math
import re

import numpy as np
import pytest
from kickstand.units import STANDARD_GRAVITY
from kickstand_tools.calibration.file import CalibrationFile
from kickstand_tools.common.errors import InputError
from kickstand_tools.logs.log import Log
from kickstand_tools.replay.replay import replay
from kickstand_tools.simulation.ride import ride
from kickstand_workshop.evaluation import estimators, real_ride, runs
from kickstand_workshop.evaluation.estimators import Samples
from support.command import refused, works

pytestmark = pytest.mark.long  # long, because each process that gets one of the tests computes the rides of a fixture

THERE = [name for name in estimators.OTHERS if estimators.PACKAGES.get(name) not in estimators.missing()]


def leaned(lean_deg: float, roll_s: float = 1.5) -> Samples:
    """Simulate a bike at rest. The bike leans from upright to lean_deg within roll_s, and keeps this lean for the same
    time."""
    n = int(roll_s * 200)
    lean = np.radians(np.concatenate((np.linspace(0.0, lean_deg, n), np.full(n, lean_deg))))
    rate = np.zeros((2 * n, 3))
    rate[:n, 2] = lean_deg / roll_s
    force = np.column_stack((np.sin(lean), np.cos(lean), np.zeros(2 * n)))
    return Samples(np.arange(2 * n) / 200.0, force, rate)


@pytest.mark.parametrize("name", THERE)
@pytest.mark.parametrize("lean_deg", [30.0, -25.0])
def test_every_filter_has_the_signs_right(name, lean_deg):
    shown = estimators.OTHERS[name](leaned(lean_deg))
    assert shown[-1] == pytest.approx(lean_deg, abs=2.0)
    assert shown[150] == pytest.approx(lean_deg / 2.0, abs=3.0)


@pytest.fixture(scope="module")
def swept():
    return runs.run(runs.Job("sweeper", 1, seconds=120.0, traces=True))


def test_every_estimator_is_scored(swept):
    assert swept.refusal is None
    names = {"kickstand", "smoothed", "formula", "formula 0.3 s", "possible", "GPS 1 Hz", "GPS 10 Hz"}
    assert set(swept.scores) == {*names, *THERE}
    for lean in swept.traces.values():
        assert lean.shape == swept.traces["time"].shape
        assert np.all(np.isfinite(lean))


def test_filters_that_trust_the_force_decay_in_a_held_turn(swept):
    """In a long turn, the lean of filters that trust the force decays. Riders complain about this decay, which is the
    reason for this project."""
    assert swept.scores["complementary"].slope < 0.5
    assert 0.85 < swept.scores["formula"].slope < 1.1
    assert swept.scores["formula 0.3 s"].rms_deg < 0.5 * swept.scores["formula"].rms_deg
    assert swept.scores["kickstand"].rms_deg < swept.scores["formula 0.3 s"].rms_deg
    assert swept.scores["smoothed"].rms_deg < 0.6 * swept.scores["kickstand"].rms_deg
    assert 0.9 < swept.scores["kickstand"].slope < 1.1


def test_no_live_filter_beats_the_oracle(swept):
    """The oracle knows the speed, the alignment and the sensor's errors, so its lean has the least error."""
    others = [score.rms_deg for name, score in swept.scores.items() if name not in ("possible", "smoothed")]
    assert swept.scores["possible"].rms_deg < min(0.25, 0.8 * min(others))


def test_best_gains_are_far_better_than_the_defaults(swept):
    for name in [name for name in THERE if name + " best" in THERE]:
        assert swept.scores[name + " best"].rms_deg < 0.5 * swept.scores[name].rms_deg


def test_course_of_a_receiver_is_late_at_one_hertz(swept):
    slow, quick = (swept.scores[f"GPS {hz} Hz"] for hz in (1, 10))
    assert slow.lag_ms > 300.0 > quick.lag_ms
    assert quick.slope == pytest.approx(1.0, abs=0.15)


@pytest.mark.parametrize("calibrated", [runs.calibrated_by_poses, runs.calibrated_by_log])
def test_the_calibration_is_from_the_poses_alone(calibrated):
    made = ride("street", 2, 60.0, pitch_change_deg=0.0, share=0.0)
    calibration = calibrated(made)
    assert np.any(calibration.gyro_sigma) == (calibrated is runs.calibrated_by_log)
    matrix = calibration.vehicle_from_sensor
    turned = np.degrees(np.arccos((np.trace(matrix @ made.vehicle_from_sensor.T) - 1.0) / 2.0))
    assert turned < 1.5  # the slope of the ground and the rider's hand cause this error
    assert calibration.accel_slope == pytest.approx([1.0] * 3, abs=0.002)
    assert calibration.six_done and calibration.aligned


@pytest.fixture
def one_other(monkeypatch):
    """Compare with only one other filter, because each takes some seconds."""
    monkeypatch.setattr(estimators, "OTHERS", {"complementary": estimators.OTHERS["complementary"]})


def test_set_up_errors_of_the_job_are_simulated(one_other):
    jobs = [runs.Job("parked", 0, 60.0, error, pitch_change_deg=0.0, traces=True) for error in (0.0, 1.5)]
    fair, off = (runs.run(job).traces["complementary"] for job in jobs)
    assert np.mean(off - fair) == pytest.approx(-1.5, abs=0.3)


def test_a_refused_calibration_is_reported_not_scored(monkeypatch):
    def refuse(*_):
        raise InputError("the free pose reads 1.021 g")

    monkeypatch.setattr(runs, "fit_procedure", refuse)
    result = runs.run(runs.Job("parked", 0, seconds=60.0))
    assert result.refusal == "the free pose reads 1.021 g"
    assert not result.scores


C, S = np.cos(0.3), np.sin(0.3)
MOUNTED = CalibrationFile(
    gyro_bias_dps=np.array([1.0, -2.0, 0.5]),
    vehicle_from_sensor=np.array([[C, 0.0, S], [0.0, 1.0, 0.0], [-S, 0.0, C]]),
    aligned=True,
)


def recorded() -> Log:
    """Simulate a ride on a level road with a phone that is rotated about the vertical. After 2 s the bike accelerates
    straight ahead, and after 20 s it turns to the left."""
    n, rate = 3000, 50.0
    t = np.arange(n) / rate
    speed = np.clip((t - 2.0) * 2.0, 0.0, 10.0)
    yaw = np.where(t > 20.0, 0.4, 0.0)
    lean = -np.arctan(speed * yaw / STANDARD_GRAVITY)
    forward = np.gradient(speed, t) / STANDARD_GRAVITY
    size = np.hypot(1.0, speed * yaw / STANDARD_GRAVITY)
    vehicle = np.column_stack((np.zeros(n), size, forward))  # in a balanced turn the force is in the bike's plane
    rates = np.degrees(np.column_stack((yaw * np.sin(lean), yaw * np.cos(lean), np.gradient(lean, t))))
    mounting = MOUNTED.vehicle_from_sensor
    speeds = np.where(np.arange(n) % 50 == 0, speed, np.nan)
    return Log(t, vehicle @ mounting, rates @ mounting + MOUNTED.gyro_bias_dps, speeds, name="made.csv")


def test_the_reference_is_speed_times_yaw_rate():
    log = recorded()
    reference = real_ride.reference_lean(log, MOUNTED)
    lean = np.arctan(10.0 * 0.4 / STANDARD_GRAVITY)
    expected = -np.degrees(np.arctan(10.0 * 0.4 * np.cos(lean) / STANDARD_GRAVITY))
    assert reference[2500] == pytest.approx(expected, abs=0.3)
    assert abs(reference[900]) < 0.5


def test_a_recording_without_speed_is_refused():
    log = recorded()
    log.speed_mps[:] = np.nan
    with pytest.raises(InputError, match="no speed"):
        real_ride.reference_lean(log, MOUNTED)


def test_recorded_motorcycle_has_its_known_scores(shared_data):
    """The slope is the share of the true lean that a filter shows. The complementary filter had a slope of 0.40 in this
    recording, with another calibration. With forward from braking and up from the first second, the lean meter had an
    rms error of 2.98 degrees and a slope of 1.226."""
    made = real_ride.compare(shared_data / "motorcycle-ride.csv.gz")
    scores, leans = made.scores, made.traces
    assert scores["complementary"].slope == pytest.approx(0.40, abs=0.06)
    assert 15.0 < np.abs(leans["reference"]).max() < 25.0
    assert scores["kickstand"].rms_deg < scores["formula 0.3 s"].rms_deg < scores["formula"].rms_deg
    assert 0.8 < scores["kickstand"].slope < 1.23
    assert scores["kickstand"].rms_deg < 2.98


def test_the_command_prints_a_table_and_writes_json_and_picture(tmp_path, one_other):
    pytest.importorskip("matplotlib")
    out = tmp_path / "out"
    more = "--seeds", 1, "--seconds", 60
    result = works("evaluate", "--profiles", "street,parked", *more, "--out", out)
    assert "kickstand" in result.out
    assert "street (1)" in result.out
    assert "nan" not in result.out
    assert max(map(len, result.out.splitlines())) <= 110
    data = json.loads((out / "evaluation.json").read_text())
    assert set(data["profiles"]) == {"street", "parked"}
    assert data["profiles"]["parked"]["kickstand"]["lag_ms"] is None
    assert (out / "lean.png").read_bytes().startswith(b"\x89PNG")
    # --json prints to standard output
    again = json.loads(works("evaluate", "--profiles", "parked", *more, "--json").out)
    assert again["profiles"]["parked"] == data["profiles"]["parked"]
    assert math.isfinite(again["profiles"]["parked"]["formula"]["rms"])


def test_an_unknown_profile_is_refused(tmp_path):
    refused(tmp_path, "evaluate", "--profiles", "street,moon", "--out", tmp_path / "x", words="no profile moon")


def test_bands_of_simulated_and_recorded_rides_are_shown(tmp_path):
    works("simulate", "--profile", "street", "--seed", "4", "--seconds", "120", "--road", "C", "--out", tmp_path)
    found = json.loads(works("bands", tmp_path / "RIDE.csv", "--seconds", 100, "--json").out)
    assert list(found["rides"]) == ["RIDE.csv", "street", *(f"street, road {road}" for road in "ABCD")]
    recorded, same = (found["rides"][name]["vertical, g"] for name in ("RIDE.csv", "street, road C"))
    assert recorded[3] == pytest.approx(same[3], rel=0.3)


def test_bands_of_a_recording_without_riding_are_refused(tmp_path):
    works("simulate", "--profile", "parked", "--seconds", "100", "--out", tmp_path)
    refused(tmp_path, "bands", tmp_path / "RIDE.csv", words="RIDE.csv")


def test_simulate_states_both_leans_on_the_stand(tmp_path):
    """The two poses are not taken where the ride starts. The two places have different ground, so the stand leans the
    bike differently."""
    arguments = "--profile", "street", "--seconds", "20", "--pitch-change", "0", "--out", tmp_path
    said = works("simulate", *arguments).out.splitlines()[-1]
    pose, begin = (float(number) for number in re.findall(r"-\d+\.\d", said))
    made = [tmp_path / name for name in ("KICKSTAND.csv", "UPRIGHT.csv")]
    found = works("calibrate", "two", *made, "--out", tmp_path / "C.json").out
    tilt = re.search(r"([\d.]+) degrees from the kickstand", found)
    # The tilt is inexact, because the six positions are not used
    assert tilt and float(tilt[1]) == pytest.approx(-pose, abs=0.8)
    truth = (tmp_path / "TRUTH.csv").read_text().splitlines()[1]
    assert float(truth.split(",")[1]) == pytest.approx(begin, abs=0.05)
    assert abs(pose - begin) > 1.0


def test_a_wheelie_is_not_treated_as_a_faulty_sensor():
    """The filter's equations do not hold in a wheelie, so its innovations are large. When the filter treated large
    innovations as a fault, it restarted, and the rms error was 4.0 degrees."""
    made = ride("wheelie", 2, 120.0)
    shown = replay(runs.as_log(made), runs.calibrated_by_log(made))
    error = (np.asarray(shown.lean_deg) - made.truth["lean_deg"])[made.truth["speed_mps"] > 5.0]
    assert np.sqrt(np.mean(error**2)) < 0.6
