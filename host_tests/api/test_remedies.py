"""The remedy of a refusal in the words of other programs than the command."""

import pickle

import pytest
from kickstand.errors import Notice, Refusal
from kickstand_tools import api, refusals
from kickstand_tools.common.errors import InputError
from kickstand_tools.refusals import RefusedInput
from kickstand_tools.remedies import COMMANDS

OTHERS = {name: f"<{name}>" for name in COMMANDS} | {"name_units": "<{0}>", "other_side": "<{0}>"}


@pytest.mark.parametrize(
    ("error", "command", "other"),
    [
        (InputError("no such thing: look"), "no such thing: look", "no such thing: look"),
        (InputError("{x} is a zip", "import_zip"), f"{{x}} is a zip: {COMMANDS['import_zip']}", "zip: <import_zip>"),
        (InputError("units", "name_units", "a=g", "one of g"), "units: add --units a=g (one of g)", "units: <a=g>"),
        (
            RefusedInput(Refusal("not-leaning"), "A.csv", "!"),
            f"as a car: {COMMANDS['align_car']}!",
            "as a car: <align_car>!",
        ),
    ],
)
def test_refusal_gives_the_remedy_in_the_given_words(error, command, other):
    for one in (error, pickle.loads(pickle.dumps(error))):
        assert str(one).endswith(command)
        assert one.said(OTHERS).endswith(other)


def test_notices_too():
    for notice in Notice("up-off", 20.0, False), Notice("forward-off", 30.0, "speed", True), Notice("import-sign", "X"):
        assert refusals.sentence(notice) != refusals.sentence(notice, OTHERS)
        assert "<" in refusals.sentence(notice, OTHERS)
    assert "calibrate two --side right?" in refusals.sentence(Notice("forward-exchanged", False, "left", 0.0))
    assert "exchanged: <--side right>" in refusals.sentence(Notice("forward-exchanged", False, "left", 0.0), OTHERS)


def test_invalid_calibration_is_refused_in_the_given_words(tmp_path):
    path = tmp_path / "A.cal.json"
    path.write_text("[]")
    with pytest.raises(InputError) as caught:
        api.read_calibration(path)
    assert str(caught.value) == f"{path} is no calibration: give a file made by kickstand calibrate"
    assert caught.value.said(OTHERS).startswith(f"{path} is no calibration: <give_calibration>")
