"""The firmware calls the owner's code in user.py at the right times. The lean continues, whatever that code does."""

import re
import sys

import pytest
from support import engines

# An aligned bike turns to the left. The rider presses through all pages, back to the first.
PLAN = {
    "ride": [["upright", 2.0], ["accelerate", 15.0, 4.0], ["turn", -30.0, 7.0]],
    "until": 13.0,
    "turn_to": [[3, "raw"], [6.5, "lean"]],
}
COMPLETE = """
calls = []
def setup(app):
    print("setup", app.settings.SIDE)
def on_lean(lean_deg, trusted, meter):
    calls.append(trusted)
    if len(calls) in (4, 110):
        print("lean", len(calls), trusted, round(lean_deg), round(meter.lean_deg))
def on_press(event):
    print("press", event)
def page_b(app):
    return ("Page two", len(calls))
def page(app):
    return "My page", len(calls)
"""


@pytest.fixture
def run_user(aligned, run):
    """Return run_user(source of user.py, plan, engine), which returns the Record of an aligned board."""

    def run_user(source, plan=PLAN, engine="micropython"):
        (aligned / "user.py").write_text(source)
        return run(plan, engine)

    return run_user


def lean_is_right(record):
    lean = record.lean_at(PLAN["until"] - 0.5)
    return lean is not None and abs(lean + 30) < 4


@pytest.mark.parametrize("engine", engines.ENGINES)
def test_each_function_is_called(engine, run_user):
    """The own pages follow the others in alphabetical order."""
    plan = PLAN | {"turn_to": [[3, "own"]], "presses": [[7.0, 0.15], [8.0, 0.15]]}
    record = run_user(COMPLETE, plan, engine)
    assert "setup left" in record.console and record.console.count("press 1") == 7
    assert re.search(r"lean 4 (True|False)", record.console)
    ((trusted, lean, meter),) = re.findall(r"lean 110 (\w+) (-?\d+) (-?\d+)", record.console)
    assert (trusted, lean) == ("True", meter) and abs(int(lean) + 30) < 4
    assert record.at(6.9)[0].startswith("My page") and record.at(6.9)[1].strip().isdigit()
    assert record.at(7.9)[0].startswith("Page two")
    assert lean_is_right(record)


@pytest.mark.parametrize(
    ("engine", "source", "shown", "words"),
    [
        ("cpython", "1 / 0", "user.py import", "import is left out: ZeroDivisionError"),
        ("micropython", "def on_lean(:", "user.py import", "import is left out: SyntaxError"),
        ("micropython", "def on_lean(*a):\n    raise SystemExit", "user.py on_lean", "on_lean is left out: SystemExit"),
        ("cpython", "import time\ndef on_lean(*a):\n    time.sleep_ms(1000)", "user.py on_lean", "left out: 10"),
        ("cpython", "import time\ndef on_lean(*a):\n    time.sleep_ms(60)", "user.py on_lean", "left out: 6"),
        ("cpython", "def on_lean(*a):\n    raise MemoryError", "user.py left out", "too little memory (on_lean)"),
        # With a full heap the console may have no room for the sentence, and then prints the code user-memory.
        ("micropython", "kept = []\ndef on_lean(*a):\n    kept.append(bytearray(40000))", "user.py left out", "user"),
    ],
)  # fmt: skip
def test_error_is_reported_once_and_the_lean_continues(engine, source, shown, words, run_user):
    record = run_user(source, engine=engine)
    assert record.first(shown) < 11
    assert record.console.count(words) == 1
    assert record.ends == ["off"] and lean_is_right(record)


@pytest.mark.parametrize(
    ("engine", "display", "body", "words"),
    [
        ("cpython", "lcd", "return ('a', 'b', 5)", "page is left out: not two lines"),
        ("cpython", "lcd", "return None", "page is left out: not two lines"),
        ("micropython", "lcd", "1 / 0", "page is left out: ZeroDivisionError"),
        ("cpython", "ssd1306", "return 5, 6, (lambda canvas: 1 / 0,)", "picture is left out: ZeroDivisionError"),
    ],
)
def test_invalid_page_is_disabled(engine, display, body, words, run_user):
    plan = PLAN | {"turn_to": [[3, "own"], [6.5, "lean"]], "board": {"display": display}}
    record = run_user(f"def page(app):\n    {body}", plan, engine)
    assert record.console.count("is left out") == record.console.count(words) == 1
    assert record.first("user.py page") < 8
    assert lean_is_right(record)


def test_without_a_user_py_its_module_is_not_loaded(run, aligned):
    """The module that runs user.py would use 3 KB of a board's heap."""
    names = []
    plan = {"until": 1.0, "board": {"machine": "pico"}}
    for source in (None, ""):
        if source is not None:
            (aligned / "user.py").write_text(source)
        run(plan, fit=lambda board: board.at(0.9, lambda: names.append("kickstand.user_code" in sys.modules)))
    assert names == [False, True]


@pytest.mark.parametrize(
    ("calls_ms", "notices"),
    [
        ([50] * 9, []),
        ([52] * 4 + [10] + [60] * 4, [("user-slow", 52)]),
        ([52] * 7, [("user-slow", 52), ("user-failed", "52 ms")]),
        ([52, 10, 52, 52, 52, 52, 60], [("user-slow", 52), ("user-failed", "60 ms")]),
        ([300], [("user-slow", 300)]),
        ([302], [("user-slow", 302), ("user-failed", "302 ms")]),
    ],
)
def test_slow_calls_are_reported_once_and_too_many_disable(calls_ms, notices, with_app, tmp_path):
    """A call over 50 ms is slow. Five slow calls in a row, or one over 300 ms, disable the function. The import and
    setup() may take any time."""

    def use(board, app):
        for ms in calls_ms:
            app.user.call("on_press", ms)
        return [(notice.code, *notice.values) for notice in app.notices]

    source = "import time\ntime.sleep_ms(900)\ndef setup(app):\n    time.sleep_ms(900)\n"
    source += "def on_press(ms):\n    time.sleep_ms(ms)\n"
    (tmp_path / "user.py").write_text(source)
    assert with_app(use) == [(code, "on_press", value) for code, value in notices]
