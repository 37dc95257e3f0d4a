"""Tests how wrong leans that are shown as good are judged, the simulated faults, and `kickstand evaluate --faults`."""

import json

import numpy as np
import pytest
from kickstand_workshop.evaluation import faults, integrity
from kickstand_workshop.evaluation.faults import FAULTS, Fault
from kickstand_workshop.evaluation.integrity import FaultJob, Trace
from support.command import refused, works

STEP_S = 0.1
NAMED = {fault.title: fault for fault in FAULTS}


def trace(error_deg, shown=None, first_s=10.0, end_s=100.0):
    """Return 60 s of riding at a lean of 20 degrees, with 10 samples per second.

    error_deg: error of the displayed lean, a number or shape (600).
    shown: True where the lean is shown, shape (600). None if it is always shown.
    first_s, end_s: time of the start and the end of the fault.
    """
    n = 600
    time = np.linspace(0.0, STEP_S * (n - 1), n)
    shown = np.ones(n, dtype=bool) if shown is None else shown
    true = np.full(n, 20.0)
    return Trace(time, true + error_deg, np.ones(n), shown, true, np.full(n, 15.0), np.nan, first_s, end_s)


def during(*spans):
    mask = np.zeros(600, dtype=bool)
    for first_s, end_s in spans:
        mask[round(first_s / STEP_S) : round(end_s / STEP_S)] = True
    return mask


def test_wrong_lean_over_a_second_misleads():
    error = np.where(during((12, 12.9), (20, 22), (30, 33)), 9.0, 7.9)
    outcome = integrity.judge(FaultJob(None, 0), trace(error))
    assert outcome.misleading_s == pytest.approx(5.0)
    assert outcome.longest_s == pytest.approx(3.0)
    assert outcome.available == 1.0


def test_a_hidden_lean_does_not_mislead():
    wrong = during((20, 30))
    outcome = integrity.judge(FaultJob(None, 0), trace(30.0 * wrong, ~wrong))
    assert outcome.misleading_s == 0.0
    assert outcome.available == pytest.approx(5 / 6)
    assert outcome.hidden_after_s == pytest.approx(10.0)
    assert outcome.diagram.sum() == pytest.approx(60.0)
    assert outcome.diagram[-1].sum() == pytest.approx(10.0)


@pytest.mark.parametrize(("back_s", "right"), [(28.0, True), (29.8, False)])
def test_recovery_is_judged_ten_seconds_after_the_end(back_s, right):
    shown = ~during((15, back_s))
    assert integrity.judge(FaultJob(None, 0), trace(0.0, shown, end_s=20.0)).recovered is right
    assert integrity.judge(FaultJob(None, 0), trace(0.0, shown)).recovered is None


def readings(seconds=60.0, up_g=1.0):
    """Return readings of a bike that is still and upright, with noise."""
    n = int(200 * seconds)
    made = np.random.default_rng(0).normal(0.0, 0.01, (n, 7))
    made[:, 1] += up_g
    return made


@pytest.mark.parametrize("fault", FAULTS, ids=lambda fault: fault.title)
def test_each_fault_changes_readings_while_it_lasts(fault):
    before = readings(up_g=1.3)
    ill = faults.apply(fault, before, 200.0, 20.0, 4, np.eye(3))
    changed = (ill.readings != before).any(axis=1) | ill.lost
    assert changed.any()
    assert not changed[: ill.first].any()
    assert not changed[ill.end :].any()
    assert ill.first == (0 if fault.from_start else 4000)
    assert ill.end - ill.first == (12000 - ill.first if fault.seconds is None else round(200 * fault.seconds))


def test_slipping_mount_turns_force_and_rate_equally():
    before = readings()
    ill = faults.apply(NAMED["mount slips by 20 degrees"], before, 200.0, 20.0, 2, np.eye(3))
    assert np.linalg.norm(ill.readings[:, :3], axis=1) == pytest.approx(np.linalg.norm(before[:, :3], axis=1))
    assert abs(ill.readings[ill.first :, 0].mean()) == pytest.approx(np.sin(np.radians(20.0)), abs=1e-3)


def test_a_ride_without_a_fault_shows_its_lean():
    outcome = integrity.run(FaultJob(None, 1, 60.0))
    assert outcome.misleading_s == 0.0
    assert outcome.available > 0.99


def test_a_mirrored_axis_does_not_mislead_for_long():
    outcome = integrity.run(FaultJob(NAMED["gyro axis mirrored"], 1, 60.0))
    assert outcome.misleading_s < 3.0
    assert outcome.hidden_after_s < 20.0


def test_a_reading_at_the_end_of_the_range_counts_as_lost():
    ill = faults.apply(NAMED["gyro axis at the end of its range, 1 s"], readings(), 200.0, 20.0, 0, np.eye(3))
    assert ill.saturated.sum() == 200


def test_whole_device_is_judged_by_its_display():
    outcome = integrity.run(FaultJob(NAMED["gyro axis at the end of its range"], 0, 20.0, device=True))
    assert outcome.misleading_s == 0.0
    assert outcome.hidden_after_s < 2.0
    assert 0.0 < outcome.named_after_s < 5.0


def no_change(part):
    pass


def test_the_command_prints_the_tables_and_writes_both_files(tmp_path, monkeypatch):
    few = NAMED["gyro axis mirrored"], Fault("nothing", faults.HARMLESS, no_change, seconds=5.0)
    monkeypatch.setattr(integrity, "FAULTS", few)
    monkeypatch.setattr(integrity, "CLASSES", ())
    monkeypatch.setattr(integrity, "MOUNTS", ())
    out = tmp_path / "out"
    more = "--faults", "--seeds", "1", "--seconds", "60"
    result = works("evaluate", *more, "--out", out)
    for words in ("gyro axis mirrored", "nothing, 5 s", "hidden", "no fault"):
        assert words in result.out
    found = json.loads((out / "faults.json").read_text())
    assert [fault["title"] for fault in found["faults"]] == ["none", "gyro axis mirrored", "nothing, 5 s"]
    assert (out / "faults.png").stat().st_size > 10_000
    assert json.loads(works("evaluate", *more, "--json").out)["rides"][0]["seed"] == 0


def test_options_of_faults_are_refused_without_it(tmp_path):
    refused(tmp_path, "evaluate", "--whole-device", words="belong to --faults")
