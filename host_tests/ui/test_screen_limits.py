"""Tests the entries of the menu, the order of the pages, and how long notices are shown."""

from types import SimpleNamespace
from typing import Any

import pytest
from kickstand.errors import Notice
from kickstand_tools.simulated_board.simulator import Board

SHORT, LONG = 1, 2  # as in board/button.py
CHIP = SimpleNamespace(accel_lsb_per_g=4096, gyro_lsb_per_dps=65.5, SATURATED=32700)


@pytest.fixture(autouse=True)
def _board():
    with Board(lambda t_s: (0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 25.0), display="ssd1306"):
        yield


def screen(leans=True, drive: Any = None, **given) -> Any:
    """Return a Screen of an aligned vehicle. The list `calls` collects what the screen's menu does."""
    from kickstand.ui.screen import Screen

    calls: list = []
    meter = SimpleNamespace(fallen=False, trusted=True, lean_deg=12.0, suppressed_reason=None, odd=None)
    meter.max_left_deg = meter.max_right_deg = meter.max_accel_g = meter.max_brake_g = 0.0
    meter.smooth_force, meter.reset_maxima = [0.0, 1.0, 0.0], lambda: calls.append("reset")
    recorder = SimpleNamespace(active=given.get("recording", False), seconds=lambda: 61, room_s=lambda: 600)
    rides = SimpleNamespace(
        recorder=recorder,
        start=lambda: calls.append("start") or given.get("problem"),
        stop=lambda: calls.append("stop"),
    )
    sensor = SimpleNamespace(chip=CHIP, fault=None)
    calibration = SimpleNamespace(aligned=True, value=None)
    settings = SimpleNamespace(leans=leans, SAMPLE_HZ=200, SIDE="left")
    made: Any = Screen(settings, sensor, SimpleNamespace(lost=0), meter, calibration, drive, rides)
    made.calls, made.recorder = calls, recorder
    return made


def entries(shown) -> list[str]:
    """Return the names of the menu's entries, in their order."""
    shown.press(LONG, 0)
    found = []
    for _ in range(len(shown.menu._entries)):
        found.append(shown.lines(0)[0][1:])
        shown.press(SHORT, 0)
    assert shown.lines(0)[0][1:] == found[0]  # the first entry follows the last entry
    return found


REST = ["Six positions", "Reset maxima", "Sensor info"]


def test_the_entries_of_the_menu_and_their_order():
    assert entries(screen()) == ["Align the bike", *REST, "Record ride", "Leave menu"]
    drive = SimpleNamespace(message=None, shown=False)
    assert entries(screen(drive=drive)) == ["Align the bike", *REST, "Align by drive", "Record ride", "Leave menu"]
    assert entries(screen(False, drive)) == ["Align by drive", *REST, "Record ride", "Leave menu"]
    more = screen(recording=True)
    more.pages.own.append(lambda: ("", ""))
    more.pages.live = SimpleNamespace(stop=None)
    last = ["Stop recording", "Own pages", "Stop Bluetooth", "Leave menu"]
    assert entries(more) == ["Align the bike", *REST, *last]


def test_the_menu_counts_its_entries_from_one():
    shown = screen()
    shown.press(LONG, 0)
    assert shown.lines(0) == ("\x7eAlign the bike", "next 1/6 hold=ok")
    shown.press(SHORT, 0)
    assert shown.lines(0) == ("\x7eSix positions", "next 2/6 hold=ok")


def choose(shown, name, now_ms=0):
    shown.press(LONG, now_ms)
    while shown.menu.entry != name:
        shown.press(SHORT, now_ms)
    shown.press(LONG, now_ms)


def test_what_the_entries_of_the_menu_do():
    shown = screen()
    choose(shown, "Reset maxima")
    assert shown.calls == ["reset"] and shown.lines(1999) == ("Maxima reset", "") and shown.menu is None
    assert shown.lines(2000) != ("Maxima reset", "")
    shown = screen(recording=True)
    choose(shown, "Stop recording")
    assert shown.calls == ["stop"] and shown.lines(1999) == ("Recording ended", "")
    shown = screen()
    shown._sensor.fault = Notice("sensor-lost")
    for name in ("Align the bike", "Six positions", "Record ride"):
        choose(shown, name)
        assert shown.wizard is None and not shown.calls and shown.lines(0) == ("Sensor lost", "check wiring")


def test_a_recording_from_the_menu_is_shown_or_refused():
    shown = screen(problem=Notice("out-of-room", "28"))
    choose(shown, "Record ride")
    assert shown.calls == ["start"] and shown.lines(0) == ("Rec. stopped", "no room")
    shown = screen()
    choose(shown, "Record ride")
    assert shown.front is shown.pages  # the recording waits in the background
    shown = screen()
    shown._rides.start = lambda: setattr(shown.recorder, "active", True)
    choose(shown, "Record ride")
    assert shown.lines(0) == ("Rec         1:01", "room 10 min") and shown.front.name == "notice"


def test_a_short_press_closes_the_sensor_info(monkeypatch):
    from kickstand.ui import pages

    monkeypatch.setattr(pages, "sensor_info", lambda sensor, lost, meter, seconds: ("info", str(seconds)))
    shown = screen()
    assert shown.lines(0)[0] != "info"
    choose(shown, "Sensor info")
    assert shown.lines(2999) == ("info", "2") and shown.front.name == "info"
    shown.press(SHORT, 3000)
    assert shown.lines(3000)[0] != "info"
    choose(shown, "Sensor info")
    shown.press(LONG, 3000)  # open the menu in front of the sensor's page
    assert shown.menu is not None and shown._info_open


def test_a_question_is_answered_by_a_long_press():
    answers = []
    drive = SimpleNamespace(message=Notice("other-side"), shown=False, answer=answers.append)
    shown = screen(drive=drive)
    shown.pages._at = 3
    assert shown.lines(0) == ("Side was wrong?", "hold = fix") and shown.pages._at == 0
    shown.press(SHORT, 0)
    shown.press(LONG, 0)
    assert answers == [False, True] and shown.menu is None


def test_a_fault_ends_a_wizard_that_does_not_bear_it():
    for bears, wizard in ((True, True), (False, False)):
        shown = screen()
        shown.wizard = SimpleNamespace(bears=lambda fault, now_ms, bears=bears: bears)
        shown.interrupt(0)
        assert (shown.wizard is not None) is wizard
        assert (shown._notice.code == "stopped") is not bears
    assert shown._notice.lines(0) == ("Calibration", "stopped: fault")


def names(shown, count) -> list[str]:
    found = []
    for _ in range(count):
        shown.lines(0)
        found.append(shown.pages.name)
        shown.press(SHORT, 0)
    return found


def ring(leans=True) -> list[str]:
    """Return the names of the pages that every board has, in their order."""
    from kickstand.ui import page_ring

    return [page.__name__ for page in (page_ring.MOTORCYCLE if leans else page_ring.CAR)]


def test_pages_of_parts_follow_those_of_every_board():
    every = ring()
    shown = screen()
    shown._meter.trusted = False
    assert names(shown, len(every) + 1) == [*every, every[0]]
    shown.recorder.active = True
    shown.pages.first()
    assert names(shown, len(every) + 2) == [*every, "recording", every[0]]
    shown.pages.live = SimpleNamespace(lines=lambda: ("live", ""))
    shown.pages.first()
    assert names(shown, len(every) + 3) == [*every, "live", "recording", every[0]]
    car, of_car = screen(False), ring(False)
    car._meter.trusted = False
    assert names(car, len(of_car) + 1) == [*of_car, of_car[0]]


def test_the_page_of_the_drive_follows_or_is_first(monkeypatch):
    from kickstand.ui import drive_page, pages

    monkeypatch.setattr(drive_page, "lines", lambda drive, now_ms: ("drive", ""))
    monkeypatch.setattr(pages, "not_aligned", lambda meter, seconds, line2="": ("not aligned", str(seconds) + line2))
    shown = screen(drive=SimpleNamespace(message=None, shown=True))
    shown._meter.trusted = False
    every = ring()
    assert names(shown, len(every) + 2) == [*every, "drive", every[0]]
    shown._calibration.aligned = False
    shown.pages.drive()
    assert shown.lines(2999) == ("drive", "")
    shown.press(SHORT, 0)
    assert shown.lines(2999) == ("not aligned", "2drive and brake")
    shown.press(SHORT, 0)
    assert shown.lines(0) == ("drive", "")
    shown._drive.shown = False
    assert shown.lines(2999) == ("not aligned", "2") and shown.pages.name == "not_aligned"
    shown.press(SHORT, 0)
    assert shown.wizard is not None and shown.wizard.state == 1  # the press counts for the kickstand pose


@pytest.mark.parametrize(
    ("given", "trusted"),
    [
        ({}, True),
        ({"lean_deg": 65.0}, True),
        ({"lean_deg": -65.1}, False),
        ({"fallen": True}, False),
        ({"trusted": False}, False),
    ],
)
def test_a_lean_is_shown_only_if_it_is_trusted(given, trusted):
    shown = screen()
    vars(shown._meter).update(given)
    assert shown.pages.trusted is trusted
    shown.pages.late = True
    assert not shown.pages.trusted
    shown.pages.late, shown._calibration.aligned = False, False
    assert not shown.pages.trusted


def test_a_reason_for_no_lean_is_shown():
    shown = screen()
    shown._meter.trusted, shown._meter.odd = False, "odd-up"
    assert shown.lines(0) == ("Lean  --", "sensor odd: up")
    shown._meter.suppressed_reason = "mount-moved"
    assert shown.lines(0) == ("Lean  --", "mount has moved")
    shown._meter.fallen = True
    assert shown.lines(0)[0] == "Fallen over?"


def test_a_picture_is_for_the_pages_that_have_one():
    from kickstand.ui import pages

    shown = screen()
    shown.pages.draws = True
    assert all(len(shown.pages._page(page)) == 3 for page in (pages.lean, pages.maxima, pages.acceleration))
    function, *values, recording = shown.pages._page(shown.pages._pages[0])[2]
    assert function.__name__ == "_lean" and values == [12, "right", 12] and not recording
    shown.recorder.active = True
    assert shown.pages._page(shown.pages._pages[0])[2][-1]
    shown.pages.draws = False
    assert len(shown.pages._page(shown.pages._pages[0])) == 2
