"""Which result a period has, with the firmware's alignment and the search for moves replaced."""

from types import SimpleNamespace

import numpy as np
import pytest
from kickstand_fleet import evidence, files, period, signals
from kickstand_fleet.evidence import Intervals
from kickstand_fleet.forward import Forward
from kickstand_fleet.manifest import Period
from kickstand_fleet.moved import Move
from kickstand_tools.calibration.file import CalibrationFile
from kickstand_tools.common.errors import InputError, RefusedInput
from kickstand_tools.common.messages import Message
from kickstand_tools.logs.log import Log

THEIRS = Period("bus 12", "front", "car", ("a.csv",))
SURE, UNSURE = Forward(np.eye(3), 0.4, 0.9, 0.1), Forward(np.eye(3), 9.0, 9.5, 0.1)
MOVE = Move(0, 63.0, np.array([0.0, 9.0, 0.0]), np.ones(3))


def refusal(code):
    """Return a refusal of the firmware with any code."""
    return RefusedInput(type("Reason", (Message,), {"code": code, "text": f"refused: {code}"})())


def fit_of(reason="", lag_s: "float | None" = 0.3, halves_deg: "float | None" = 0.2):
    return SimpleNamespace(
        refusal=refusal(reason) if reason else None,
        reason=reason,
        lag_s=lag_s,
        halves_deg=halves_deg,
        used=12,
        turned=3,
        stops=4,
        bias_dps=np.array([1.0, 2.0, 3.0]),
    )


def log_of(name="a.csv"):
    t_s = np.arange(5.0)
    return Log(t_s, np.ones((5, 3)), np.zeros((5, 3)), np.full(5, 3.0), utc_s=1.79e9 + t_s, name=name)


def result(monkeypatch, fit, found=None, moves=(), mirrored=False):
    """Return the row of the alignment and what the searches were asked: suspected and the firmware's alignment."""
    asked = []
    monkeypatch.setattr(period, "_logs", lambda _: ([log_of()], []))
    monkeypatch.setattr(period, "fit_logs", lambda *_: fit)
    monkeypatch.setattr(evidence, "intervals", lambda log, kind, lag_s, bias: asked.append(lag_s) or log)
    monkeypatch.setattr(period, "find_moves", lambda driven, suspected: asked.append(suspected) or list(moves))
    monkeypatch.setattr(period, "find_forward", lambda driven, device: asked.append(device) or found)
    monkeypatch.setattr(period, "_mirrored", lambda driven: mirrored)
    monkeypatch.setattr(period, "_picture", lambda drive: [])
    monkeypatch.setattr(period, "brake_tests", lambda log, known: [])
    return period.work_on_period(THEIRS).alignment, asked


@pytest.mark.parametrize("reason", ["few-events", "not-stopped", "speed-unit"])
def test_a_refusal_without_another_method_is_final(monkeypatch, reason):
    row, asked = result(monkeypatch, fit_of(reason), SURE, [MOVE])
    assert (row["status"], row["reason"], row["message"], asked) == ("refused", reason, f"refused: {reason}", [])
    assert (row["stops"], row["events_used"], row["events_in_turns"], row["quality_deg"]) == (4, 12, 3, None)


@pytest.mark.parametrize(
    ("fit", "found", "status", "reason", "suspected"),
    [
        (fit_of(), SURE, "aligned", "", False),
        (fit_of(halves_deg=None), SURE, "aligned", "", False),
        (fit_of(halves_deg=1e3), SURE, "aligned", "", True),
        (fit_of(), UNSURE, "refused", "uncertain", False),
        (fit_of("uncertain"), SURE, "aligned", "", False),
        (fit_of("uncertain"), UNSURE, "refused", "uncertain", False),
        (fit_of("parts-differ"), SURE, "aligned", "", True),
        (fit_of("parts-differ"), None, "refused", "parts-differ", True),
        (fit_of("mount-moved"), SURE, "refused", "mount-moved", True),
        (fit_of("mount-moved", 9.0), SURE, "refused", "speed-late", True),
        (fit_of("mount-moved", None), SURE, "refused", "mount-moved", True),
    ],
)
def test_a_period_is_aligned_if_one_method_is_sure(monkeypatch, fit, found, status, reason, suspected):
    """The firmware's refusal is no alignment for the mean."""
    row, asked = result(monkeypatch, fit, found)
    assert (row["status"], row["reason"], bool(row["message"])) == (status, reason, bool(reason))
    assert asked == [fit.lag_s or 0.0, suspected, None if fit.reason else fit]
    known = status == "aligned"
    assert row["vehicle_from_sensor"] == (np.eye(3).ravel().tolist() if known else None)
    assert row["gyro_bias_dps"] == ([1.0, 2.0, 3.0] if known else None)


def test_a_move_comes_before_mirrored_axes_and_these_before_uncertainty(monkeypatch):
    row, _ = result(monkeypatch, fit_of(), SURE, [MOVE], mirrored=True)
    assert row["reason"] == "mount-moved" and "by 9 degrees in a.csv at 63 s" in row["message"]
    row, _ = result(monkeypatch, fit_of(), SURE, mirrored=True)
    assert row["reason"] == "left-handed"


@pytest.mark.parametrize(("handedness", "mirrored"), [(-0.51, True), (-0.5, True), (-0.49, False), (1.0, False)])
def test_axes_are_mirrored_if_bends_push_to_the_wrong_side(monkeypatch, handedness, mirrored):
    monkeypatch.setattr(evidence, "handedness", lambda *_: handedness)
    assert period._mirrored([driven(16)]) is mirrored
    assert period._mirrored([]) is False


def driven(count, weight=1.0):
    t_s = np.arange(count) + 0.5
    terms = np.column_stack((np.ones(count), 1e-3 * np.arange(count), np.full(count, 0.2), np.zeros(count)))
    force = np.tile([0.25, 1.0, 0.123456], (count, 1))
    return Intervals(t_s, force, terms, np.full(count, weight), np.full(count, 9.0), np.zeros((count, 3, 3)))


@pytest.mark.parametrize(("count", "points"), [(80, 80), (160, 160), (161, 81), (320, 160), (321, 107)])
def test_a_picture_has_at_most_160_points(count, points):
    logs = [driven(count // 2), driven(5, weight=0.0), driven(count - count // 2)]
    made = period._picture(period._Drive(fit_of(), logs, [], SURE))  # type: ignore[arg-type]
    assert len(made) == points and made[0] == [0.0, 0.123, 0.2, 0.25]
    assert period._picture(period._Drive(fit_of(), logs)) == []  # type: ignore[arg-type]


def test_a_stop_has_its_columns():
    names = ("start_s", "initial_speed_mps", "duration_s", "distance_m", "mfdd_mps2", "peak_mps2", "jerk_mps3")
    stop = SimpleNamespace(**{name: k + 0.5 for k, name in enumerate((*names, "side_m", "heading_deg"))})
    stop.speed_from = "log"
    row = period._stop_row(stop, log_of())  # type: ignore[arg-type]
    assert row == vars(stop) | {"utc_s": 1.79e9 + 0.5}


@pytest.mark.parametrize("signals_to", [None, "out/signals"])
def test_signals_are_written_on_demand(monkeypatch, signals_to):
    written = []
    monkeypatch.setattr(period, "brake_tests", lambda log, known: [])
    monkeypatch.setattr(signals, "write", lambda *given: written.append(given))
    known, log = CalibrationFile(aligned=True), log_of()
    period._add_drive(period.PeriodResult({}), THEIRS, log, known, signals_to)
    assert written == ([("out/signals", THEIRS, log, known)] if signals_to else [])


def test_each_log_that_is_not_used_has_its_reason(monkeypatch):
    def open_log(path):
        if path == "gone":
            raise InputError("gone: there is no such file")
        if path == "disk":
            raise OSError(5, "Input/output error")
        return log_of(path)

    def usable(log, _):
        if log.name == "few":
            raise refusal("few-events")
        return log

    monkeypatch.setattr(files, "open_log", open_log)
    monkeypatch.setattr(period, "usable", usable)
    logs, errors = period._logs(Period("v", "m", "car", ("a", "gone", "few", "disk", "b")))
    assert [log.name for log in logs] == ["a", "b"]
    assert [(row["log"], row["reason"], row["message"]) for row in errors] == [
        ("gone", "unreadable", "gone: there is no such file"),
        ("few", "few-events", "refused: few-events"),
        ("disk", "unreadable", "Input/output error"),
    ]
