"""What the background alignment does with verdicts, problems, answers and old speeds."""

from types import SimpleNamespace
from typing import Any

import pytest
from kickstand_tools.simulated_board.simulator import Board


def said(problem):
    return problem and (problem.code, *problem.values)


def background(real=False, leans=True, speed=None, **given: Any) -> Any:
    """Return a BackgroundAlignment with stand-ins for the meter and the drive. The list `calls` collects their calls.

    real: True to keep the real _adopt() and _restart(), False to replace them by stand-ins.
    given: values of the stand-ins, and of attributes.
    """
    with Board(lambda t_s: (0, 0, 1, 0, 0, 0)):
        from kickstand.drive_alignment.background import BackgroundAlignment
    calls: list = []
    calibration = SimpleNamespace(aligned=given.pop("aligned", True), vehicle_from_sensor=[1, 0, 0, 0, 1, 0, 0, 0, 1])
    meter = SimpleNamespace(
        calibration=calibration, distrust=lambda code: calls.append(("distrust", code)), trim_deg=1.5,
        reset_maxima=lambda: calls.append("maxima"), speed_mps=given.pop("meter_mps", 0.0),
    )  # fmt: skip
    made: Any = BackgroundAlignment(leans, speed, meter, SimpleNamespace())
    made.drive = SimpleNamespace(
        problem=given.pop("problem", None), ready=given.pop("ready", True), quality_deg=0.7,
        standing=SimpleNamespace(standing=given.pop("standing", True), bias=[0.1, 0.2, 0.3]),
        interrupt=lambda: calls.append("interrupt"), update=lambda *values: calls.append(("update", *values)),
        measure_speed=lambda *values: calls.append(("speed", *values)), matrix=lambda out: None,
    )  # fmt: skip
    made._speed_ms = 0
    for name, value in given.items():
        setattr(made, name, value)
    made.calls = calls
    if not real:
        made._adopt = lambda new: calls.append(("adopt", new))
        made._restart = lambda: calls.append("restart")
    return made


def test_a_speed_is_fresh_for_three_seconds():
    made = background(_speed_mps=4.0)
    assert made.fresh_speed(2999) == 4.0 and made.fresh_speed(3000) is None and made.fresh_speed(0) is None


@pytest.mark.parametrize(
    ("given", "away"),
    [
        ({"_speed_mps": 2.0}, False),
        ({"_speed_mps": 2.1}, True),
        ({"meter_mps": 9.0}, False),
        ({"meter_mps": 2.1, "problem": "stuck"}, True),
        ({"meter_mps": 2.0, "problem": "stuck"}, False),
        ({"meter_mps": 9.0, "message": SimpleNamespace(code="other-side")}, False),
        ({"meter_mps": 9.0, "message": SimpleNamespace(code="store")}, True),
    ],
)
def test_a_vehicle_is_away_above_two_mps(given, away):
    made = background(standing=False, **given)
    assert made._away() is away
    before = made.message
    made._look(0)
    assert made.message is (None if away else before)


@pytest.mark.parametrize(
    ("verdict", "given", "calls", "code"),
    [
        (1, {}, [("distrust", None)], None),
        (2, {}, [("adopt", False)], None),
        (2, {"ready": False}, [], None),
        (3, {}, [("distrust", "other-side")], "other-side"),
        (4, {}, [("distrust", "mount-moved")], "mount-moved"),
        (0, {}, [], None),
        (1, {"leans": False}, [], None),
        (2, {"leans": False}, [("adopt", False)], None),
        (3, {"leans": False}, [("adopt", True)], None),
        (4, {"leans": False, "ready": False}, [], None),
        (4, {"leans": False}, [("adopt", True)], None),
        (4, {"_answered": ["mount-moved"]}, [], None),
        (0, {"_asked": True}, [("adopt", True)], None),
        (0, {"_asked": True, "ready": False}, [], None),
        (1, {"aligned": False}, [("adopt", True)], None),
        (1, {"standing": False}, [], None),
        (1, {"_speed_ms": None}, [], None),
    ],
)
def test_each_verdict_has_its_reaction(monkeypatch, verdict, given, calls, code):
    made = background(**given)
    from kickstand.drive_alignment import background as module

    monkeypatch.setattr(module, "compare", lambda *_: verdict)
    made._look(0)
    assert made.calls == calls
    assert (made.message and made.message.code) == code


def test_a_problem_is_said_only_if_an_alignment_is_in_use():
    problem = SimpleNamespace(code="speed-stuck")
    for aligned in (True, False):
        made = background(problem=problem, aligned=aligned)
        made._look(0)
        assert made.calls == ["restart"] and made.result is problem
        assert made.message is (problem if aligned else None)


def test_two_passes_of_counts_are_fed_together():
    made = background()
    applied = []
    made._calibration = SimpleNamespace(apply=lambda means, force, rate: applied.append(means))
    made.feed([1] * 7, 1, 5000, 0)
    assert not applied and made._fed_ms == 0
    made.feed([8] * 7, 2, 10_000, 300)
    assert applied == [[3.0] * 7] and made.calls == [("update", made._force, made._rate, 15_000)]
    assert (made._n, made._us, made._turns, made._total) == (0, 0, 0, [0] * 7)
    made.feed([1] * 7, 1, 5000, 300)
    made.feed([1] * 7, 1, 5000, 601)  # 601 ms is 301 ms after the previous call
    assert "interrupt" in made.calls and made._n == 1 and made._fed_ms == 601


def test_the_result_is_looked_at_once_a_second():
    speeds = iter([None, 6.0, None, None, None])
    made = background(speed=SimpleNamespace(poll=lambda now: next(speeds), age_us=70), _fed_ms=0)
    looks = []
    made._look = looks.append
    made._share = lambda speed: speed
    assert [made.poll(now) for now in (0, 500, 999, 1000, 2001)] == [None, 6.0, None, None, None]
    assert looks == [0, 1000, 2001] and ("speed", 6.0, 70) in made.calls
    assert made._speed_mps == 6.0 and made._speed_ms == 500
    assert made.calls.count("interrupt") == 1 and made._fed_ms is None  # the last reading is over 1 s old


def test_an_answer_exchanges_forward_and_backward():
    for agreed, code, expected in ((True, "other-side", True), (False, "other-side", False), (True, "store", False)):
        made = background(message=SimpleNamespace(code=code))
        saved = []
        made._save = lambda matrix, trim, saved=saved: saved.append((list(matrix), trim)) or True
        made.answer(agreed)
        assert bool(saved) is expected and made._answered == [code]
        assert (("distrust", None) in made.calls) is (code == "other-side")
        if expected:
            assert saved == [([-1, 0, 0, 0, 1, 0, 0, 0, -1], -1.5)] and made.message.code == "side-fixed"
            assert "maxima" in made.calls
        else:
            assert made.message is None


def test_a_saved_alignment_has_the_whole_bias():
    made = background()
    seen = []
    made._meter.calibration.with_alignment = lambda *values: values
    made._calibration = SimpleNamespace(gyro_bias=[1.0, 2.0, 3.0])
    made._active = SimpleNamespace(refine=seen.append)
    assert made._save("matrix", 0.5) is True
    assert seen == [("matrix", pytest.approx([1.1, 2.2, 3.3]), 0.5, True)]


@pytest.mark.parametrize(
    ("given", "up", "bias", "shown"),
    [
        ({}, True, True, False),
        ({"leans": False}, False, True, False),
        ({"aligned": False}, False, False, False),
        ({"_asked": True}, False, True, False),
        ({"leans": False, "aligned": False}, False, False, True),
        ({"shown": True}, True, True, True),
    ],
)
def test_a_new_drive_knows_what_the_alignment_knows(given, up, bias, shown):
    """A motorcycle's upright pose is the vertical, unless the drive must replace the alignment. The bias of an aligned
    sensor is subtracted already."""
    made = background(real=True, _total=[9] * 7, **{"shown": False} | given)
    made.result = "old"
    made._restart()
    assert (made.drive.vertical._from_pose is not None) is up
    assert made.drive._bias_given is bias and made.drive.standing.bias == [0.0] * 3
    assert made.drive.vertical.is_car is not made._leans and made.shown is shown
    assert made.result is None and made._total == [0] * 7


def test_a_request_begins_a_drive_that_replaces_the_alignment():
    made = background(shown=False, _answered=["other-side"], message="m")
    made.ask()
    assert made.shown and made._asked and made._answered == [] and made.message is None
    made.begin()
    assert made._asked is False and made.calls == ["restart", "restart"]


def test_an_adopted_alignment_is_saved_with_its_trim():
    for new, trim in ((True, 0.0), (False, 1.5)):
        made = background(real=True, _asked=True)
        saved = []
        made._save = lambda matrix, trim_deg, saved=saved: saved.append(trim_deg) or True
        made._adopt(new)
        assert saved == [trim] and said(made.result) == ("aligned", 0.7)
        assert (made.message is made.result, made._asked, "maxima" in made.calls) == (
            new,
            not new,
            new,
        )
        made._save, made.result = (lambda *_: False), None
        made._adopt(new)
        assert made.result is None


def test_an_old_speed_is_forgotten_even_if_nobody_asks():
    made = background(speed=SimpleNamespace(poll=lambda now: None))
    made._look = lambda now: None
    made.poll(2999)
    assert made._speed_ms == 0
    made.poll(3999)
    assert made._speed_ms is None
