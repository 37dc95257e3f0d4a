"""The firmware calls the owner's code in user.py at the right times. The lean continues, whatever the owner's code
does."""

import re
import sys

import pytest
from support import device_plans, engines

POSES = {"ride": device_plans.RIDE, "presses": device_plans.PRESSES, "until": device_plans.LEFT_S + 0.5}
# The board is already aligned. The bike turns to the left, and the rider presses through all pages, back to the first.
PLAN = {"ride": [["upright", 2.0], ["accelerate", 15.0, 6.0], ["turn", -30.0, 6.0]], "until": 14.0}
PLAN["turn_to"] = [[3, "raw"], [7.5, "lean"]]
WHOLE = """
import gc
calls = []
def setup(app):
    print("setup", app.settings.SIDE)
def on_lean(lean_deg, trusted, meter):
    calls.append(trusted)
    if len(calls) in (100, 280):
        print("lean", len(calls), trusted, round(lean_deg), meter.trusted)
def on_press(event):
    print("press", event)
def page(app):
    return "My page", len(calls)
def page_two(app):
    return ("Page two", "")
"""


@pytest.fixture
def run(tmp_path, monkeypatch, capsys):
    """Return run(source of user.py, plan), which returns the Record. By default the run is on MicroPython, to test its
    exceptions, memory and printing."""

    def run(source, plan=PLAN, engine="micropython"):
        if plan["ride"] == PLAN["ride"]:
            device_plans.align(tmp_path)
        (tmp_path / "user.py").write_text(source)
        monkeypatch.syspath_prepend(str(tmp_path))
        return device_plans.run(engine, tmp_path, plan, capsys)

    return run


def goes_on(record, t_s=13.5):
    """Return True if the display shows the right lean at the end of the left turn."""
    lean = record.lean_at(t_s)
    return lean is not None and abs(lean + 30) < 4


@pytest.mark.parametrize("engine", engines.ENGINES)
def test_each_function_is_called(run, engine):
    record = run(WHOLE, POSES, engine)
    console = record.console
    assert "setup left" in console and console.count("press 1") == 2
    assert "lean 100 False" in console  # the sensor is not aligned yet
    assert re.search(r"lean 280 True -\d\d? True", console)
    assert goes_on(record, device_plans.LEFT_S)


def test_its_pages_follow_the_others_and_are_in_the_menu(run):
    # "Own pages" is the sixth entry of the menu.
    presses = [[2, 1.2]] + [[4 + 0.5 * k, 0.15] for k in range(5)] + [[8, 1.2], [10, 0.15], [11, 0.15]]
    record = run(WHOLE, POSES | {"presses": presses, "until": 13})
    assert record.at(7.5)[0].startswith("→Own pages"), record.frames
    assert record.at(9.8)[0].startswith("My page")
    assert record.at(10.8)[0].startswith("Page two")
    assert "press" in record.at(12.9)[1] or "Not aligned" in record.at(12.9)[1]
    presses = [*device_plans.PRESSES, [26, 0.15]]
    record = run(WHOLE, POSES | {"presses": presses, "turn_to": [[20, "own"]], "until": 28})
    assert record.at(25.8)[0].startswith("My page") and record.at(25.8)[1].strip().isdigit()
    assert record.at(27)[0].startswith("Page two")


@pytest.mark.parametrize(
    ("source", "shown", "said"),
    [
        ("1 / 0", "user.py import", "import is left out: ZeroDivisionError"),
        ("def on_lean(:", "user.py import", "import is left out: SyntaxError"),
        ("def on_lean(*a):\n    {}['x']", "user.py on_lean", "on_lean is left out: KeyError"),
        ("def on_lean(*a):\n    raise SystemExit", "user.py on_lean", "on_lean is left out: SystemExit"),
        ("import time\ndef on_lean(*a):\n    time.sleep_ms(1000)", "user.py on_lean", "on_lean is left out: 10"),
        ("import time\ndef on_lean(*a):\n    time.sleep_ms(60)", "user.py on_lean", "on_lean is left out: 6"),
        ("def on_lean(*a):\n    raise MemoryError", "user.py left out", "it leaves too little memory (on_lean)"),
    ],
)
def test_an_error_is_reported_once_and_the_lean_continues(run, source, shown, said):
    record = run(source)
    assert record.first(shown) < 12
    assert record.console.count(said) == 1, record.console
    assert goes_on(record)


def test_a_function_that_is_slow_at_times_is_kept(run):
    source = "import time\npage_number = 3\ncalls = []\ndef on_lean(*a):\n    calls.append(0)\n"
    record = run(source + "    if len(calls) % 20 == 0:\n        time.sleep_ms(60)")
    assert record.console.count("on_lean took 6") == 1 and "on_lean is left out" not in record.console
    assert goes_on(record)


@pytest.mark.parametrize(
    ("display", "body", "said"),
    [
        ("lcd", "return ('a', 'b', 5)", "page is left out"),
        ("lcd", "1 / 0", "page is left out"),
        ("ssd1306", "return 5, 6, (lambda canvas: 1 / 0,)", "picture is left out"),
    ],
)
def test_an_invalid_page_is_disabled(run, display, body, said):
    plan = PLAN | {"turn_to": [[3, "own"], [7.5, "lean"]], "board": {"display": display}}
    record = run(f"def page(app):\n    {body}", plan)
    assert record.console.count("user.py: page is left out") + record.console.count("picture is left out") == 1
    assert said in record.console
    assert goes_on(record)


def test_user_py_is_disabled_before_memory_runs_out(run):
    record = run("kept = []\ndef on_lean(*a):\n    kept.append(bytearray(40000))")
    assert record.first("user.py left out") < 30
    assert record.console.count("it leaves too little memory") == 1
    assert goes_on(record)


def test_without_a_user_py_its_module_is_not_loaded(run, tmp_path):
    """The module that runs user.py would use 3 KB of a board's heap."""
    sys.modules.pop("kickstand.user_code", None)
    device_plans.run("cpython", tmp_path, PLAN | {"until": 1.0})
    assert "kickstand.user_code" not in sys.modules
    run("", PLAN | {"until": 1.0}, "cpython")
    assert "kickstand.user_code" in sys.modules
    sys.modules.pop("kickstand.user_code")


@pytest.mark.parametrize("name", ["__dir__", "__getattr__"])
def test_a_module_that_raises_when_inspected_is_disabled(run, name):
    """The lean continues, and the board does not restart. The test needs CPython, because MicroPython does not call a
    module's __dir__()."""
    record = run(f"def {name}(*_):\n    raise ValueError('mine')\n", engine="cpython")
    assert goes_on(record)
