"""The app's state as data: what other programs get for each view of the display."""

from types import SimpleNamespace

import pytest
from kickstand.errors import Notice
from kickstand.state import state


def app(front, trusted=True, fault=None, message=None, aligned=True, recording=False, drive=True):
    """Replace an App with this view in front. message: the alignment's notice, if there is a speed source."""
    return SimpleNamespace(
        screen=SimpleNamespace(front=front),
        sensor=SimpleNamespace(fault=fault),
        drive=SimpleNamespace(message=message) if drive else None,
        trusted=trusted,
        meter=SimpleNamespace(lean_deg=-31.5),
        calibration=SimpleNamespace(aligned=aligned),
        recording=recording,
    )


PAGE = SimpleNamespace(name="lean")


def test_a_page_has_the_lean_and_no_code():
    assert state(app(PAGE)) == {
        "view": "lean", "code": None, "step": None, "pose": None, "entry": None, "trusted": True, "lean_deg": -31.5,
        "aligned": True, "recording": False, "fault": None,
    }  # fmt: skip


def test_a_lean_that_is_not_trusted_is_none():
    found = state(app(PAGE, trusted=False, aligned=False, recording=True))
    assert (found["trusted"], found["lean_deg"], found["aligned"], found["recording"]) == (False, None, False, True)


@pytest.mark.parametrize(
    ("front", "changed", "code", "fault"),
    [
        (SimpleNamespace(name="fault"), {"fault": Notice("no-sensor")}, "no-sensor", "no-sensor"),
        (PAGE, {"fault": Notice("no-sensor")}, None, "no-sensor"),
        (SimpleNamespace(name="question"), {"message": Notice("wrong-side")}, "wrong-side", None),
        (SimpleNamespace(name="notice", code="saved"), {}, "saved", None),
        (PAGE, {"message": Notice("wrong-side"), "drive": False}, None, None),
    ],
)
def test_the_code_is_that_of_what_is_shown(front, changed, code, fault):
    found = state(app(front, **changed))
    assert (found["view"], found["code"], found["fault"]) == (front.name, code, fault)


@pytest.mark.parametrize(
    ("number", "step"), list(enumerate(("ask", "take", "notice", "refused", "result", "ended", "compute")))
)
@pytest.mark.parametrize(("upright", "pose"), [(False, "kickstand"), (True, "upright")])
def test_an_alignment_has_its_step_and_pose(number, step, upright, pose):
    wizard = SimpleNamespace(name="align", state=number, upright=upright, problem=Notice("moved"))
    found = state(app(wizard))
    assert (found["step"], found["pose"], found["code"], found["entry"]) == (step, pose, "moved", None)


def test_six_positions_have_a_step_but_no_pose():
    found = state(app(SimpleNamespace(name="six", state=1, problem=None)))
    assert (found["view"], found["step"], found["pose"], found["code"]) == ("six", "take", None, None)


def test_the_menu_has_its_entry():
    found = state(app(SimpleNamespace(name="menu", entry="record")))
    assert (found["view"], found["entry"], found["step"], found["pose"]) == ("menu", "record", None, None)
