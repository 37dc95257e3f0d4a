"""Each notice and refusal is a sentence that says what to do. The words on a terminal and
on a page may differ."""

import json
import re
from dataclasses import fields

import pytest
from kickstand_tools import api
from kickstand_tools.calibration.mount import ForwardExchanged, ForwardOff, UpOff
from kickstand_tools.calibration.refusals import MountMoved
from kickstand_tools.checks.axes import RatesMisfit
from kickstand_tools.cli.main import kickstand
from kickstand_tools.common.messages import InputError, Message, Remedy, as_data
from kickstand_tools.imports.importing import ImportSign

SAMPLES = {"str": "x", "int": 3, "float": 160.0, "bool": False, "float | None": None, "Remedy": Remedy()}
WHOLE = {RatesMisfit: RatesMisfit((0, 1, 0), (1, 0, 0), (0, 0, 1)), MountMoved: MountMoved("vertical", 12.0)}


def classes(base=Message):
    for one in base.__subclasses__():
        yield from classes(one)
        if one.code:
            yield one


CLASSES = sorted(classes(), key=lambda one: one.code)


def sample(one):
    return WHOLE.get(one) or one(*map(value_of, fields(one)))


def value_of(field):
    """Return a value of a field. The fields of a kind() have no type."""
    any_value = "x" if field.name in ("axis", "by", "name", "phone", "pose", "side") else 160.0
    return SAMPLES.get(str(getattr(field.type, "__name__", field.type)), any_value)


def with_a_command(words):
    names = "|".join(kickstand.list_commands(None))
    return re.search(rf"(^|\s)--?\w|kickstand ({names})\b|\bcalibrate (two|six(?! pos)|ride|drive)\b", words)


@pytest.mark.parametrize("one", CLASSES, ids=lambda one: one.code)
def test_a_page_names_no_command(one):
    message = sample(one)
    for words in message.line(), message.line(page=True):
        assert words == words.strip() and "{" not in words and "\n" not in words and not words.endswith(".")
    assert not with_a_command(message.line(page=True)), message.line(page=True)


def test_each_code_is_one_class():
    codes = [one.code for one in CLASSES]
    assert len(codes) == len(set(codes)) > 60


def test_a_notice_has_the_words_of_terminal_and_page():
    for notice in UpOff(20.0, False), ForwardOff(30.0, "speed", True), ImportSign("X"):
        assert api.sentence(notice) != api.sentence(notice, page=True)
    assert "calibrate two --side right?" in ForwardExchanged(False, "left", 0.0).line()
    assert "to the other side than SIDE" in ForwardExchanged(False, "left", 0.0).line(page=True)


def test_the_data_of_a_notice_are_its_fields_in_order():
    (data,) = as_data([ForwardExchanged(False, "left", float("nan"))])
    assert (data["code"], data["values"]) == ("forward-exchanged", [False, "left", None])
    (data,) = as_data([WHOLE[RatesMisfit]])
    assert json.loads(json.dumps(data["values"])) == [[0, 1, 0], [1, 0, 0], [0, 0, 1]]


def test_a_file_that_is_not_a_calibration_is_refused(tmp_path):
    path = tmp_path / "A.cal.json"
    path.write_text("[]")
    with pytest.raises(InputError) as caught:
        api.read_calibration(path)
    assert str(caught.value) == f"{path} is no calibration: give a file made by kickstand calibrate"
    assert caught.value.line(page=True) == f"{path} is no calibration: give the .cal.json of the ride"
