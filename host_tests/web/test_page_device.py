"""The page runs the firmware's own loop: the display shows the same content at the same times."""

import json
from pathlib import Path

from support.mpy import run_mpy
from support.web import page_repeated

# The orders include safe mode: the button is held while the power is switched on.
ORDERS = [
    *([1.0, "button", True], [1.2, "button", False], [5.0, "pose", "upright"]),
    *([6.0, "sensor", False], [7.3, "sensor", True]),
    *([9.0, "power", False], [9.5, "button", True], [9.7, "power", True], [11.2, "button", False]),
    *([12.0, "power", False], [12.3, "power", True]),
]
UNTIL_S = 14.0


def run(kind, orders, flash):
    flash.mkdir()
    given = json.dumps({"orders": orders, "until_s": UNTIL_S})
    return json.loads(run_mpy(Path(page_repeated.__file__), kind, stdin=given, directory=flash).splitlines()[-1])


def test_the_page_turns_the_loop_as_the_firmware_does(tmp_path):
    page = run("page", ORDERS, tmp_path / "page")
    loop = run("loop", page["orders"], tmp_path / "loop")
    shown = {display["text"][0].rstrip() for _, display in page["displays"]}
    assert {"", "Kickstand", "Stand: hold", "Now upright:", "Calibration", "Safe mode"} <= shown
    assert page["displays"] == loop["displays"]


def test_a_press_that_comes_with_its_release_counts(tmp_path):
    """Press and release come together if the browser stalls for longer than the press."""
    page = run("page", [[1.0, "button", True], [1.0, "button", False]], tmp_path / "page")
    assert any(display["text"][0].startswith("Stand: hold") for _, display in page["displays"])
