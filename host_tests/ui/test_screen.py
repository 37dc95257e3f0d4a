"""Events and what the display then shows: notices, menu, faults, questions, and the ring of pages."""

import sys

import pytest
from kickstand.errors import Notice
from panel import LONG, SHORT, Panel

PAGES = ["lean", "maxima", "acceleration", "formula", "raw"]
WHEEL = {"SPEED": "wheel", "PULSES_PER_METRE": 0.5}
REST = ["Six positions", "Reset maxima", "Sensor info"]


def entries(panel):
    """Return the names of the menu's entries. The first entry follows the last."""
    names = [panel.press(LONG)[0][1:]]
    while (name := panel.press(SHORT)[0][1:]) != names[0]:
        names.append(name)
    panel.lines(panel.now_ms + 60_000)
    return names


class Live:
    """The page of a phone's connection."""

    def lines(self):
        return "live", ""

    def stop(self):
        pass


class User:
    """The owner's pages."""

    def __init__(self, count=1):
        self.pages = [lambda: ("own", "")] * count


@pytest.mark.parametrize(
    ("config", "names"),
    [
        ({}, ["Align the bike", *REST, "Record ride", "Leave menu"]),
        (WHEEL, ["Align the bike", *REST, "Align by drive", "Record ride", "Leave menu"]),
        (WHEEL | {"VEHICLE": "car"}, ["Align by drive", *REST, "Record ride", "Leave menu"]),
    ],
)
def test_the_entries_of_the_menu_and_their_order(config, names):
    panel = Panel(**config)
    assert entries(panel) == names
    panel.app.user, panel.app.live = User(), Live()
    panel.choose("Record ride")
    assert entries(panel)[-4:] == ["Stop recording", "Own pages", "Stop Bluetooth", "Leave menu"]


def test_the_menu_resets_maxima_and_records():
    panel = Panel()
    panel.meter.max_left_deg = 30.0
    assert panel.choose("Reset maxima") == ("Maxima reset", "") == panel.lines(1999)
    assert panel.lines(2000)[0].startswith("Lean") and panel.meter.max_left_deg == 0.0
    assert panel.choose("Record ride")[0] == "Rec         0:00" and panel.screen.view == "notice"
    panel.stand()
    assert panel.lines(4000)[0] == "Lean   0°      *"  # only the first page shows that a ride is recorded
    assert not panel.press(SHORT)[0].endswith("*")
    assert panel.choose("Stop recording") == ("Recording ended", "")
    assert not panel.app.rides.recorder.active and "kickstand.ui.menu" not in sys.modules  # a closed menu takes no heap


def test_a_recording_that_is_refused_says_why(monkeypatch):
    panel = Panel()
    monkeypatch.setitem(sys.modules, "kickstand.rides.recorder", None)
    assert panel.choose("Record ride") == ("Incomplete:", "flash it again") and not panel.app.rides.recorder.active


def test_a_press_is_for_what_a_notice_covers():
    panel = Panel(**WHEEL)
    panel.app.notices.append(Notice("out-of-room", "28"))
    assert panel.lines() == ("Rec. stopped", "no room")
    assert panel.press(SHORT, 100)[0].startswith("Max left")
    panel.app.notices.append(Notice("out-of-room", "28"))
    panel.app.drive.message = Notice("aligned", 0.4)
    assert panel.lines(200)[0] == "Rec. stopped"
    assert panel.press(LONG, 300) == ("Aligned by drive", "error about 0.4°")  # unread, so it is not answered
    assert panel.screen.menu is None and panel.press(LONG)[0].startswith("Lean") and panel.app.drive.message is None


@pytest.mark.parametrize(("event", "lines"), [(SHORT, "Lean"), (LONG, "Side corrected")])
def test_a_question_goes_to_the_first_page_and_is_answered(event, lines):
    """A long press agrees, which exchanges forward and backward, and left and right."""
    panel = Panel(**WHEEL)
    panel.walk(3)
    panel.app.drive.message = Notice("other-side")
    assert panel.lines() == ("Side was wrong?", "hold = fix")
    assert panel.press(event)[0].startswith(lines)
    assert panel.app.calibration.value.vehicle_from_sensor[0] == pytest.approx(-1.0 if event == LONG else 1.0)


def test_a_fault_hides_the_pages_and_the_menu_the_fault():
    panel = Panel()
    panel.sensor.fault = Notice("sensor-lost")
    lost = ("Sensor lost", "check wiring")
    assert panel.lines() == lost == panel.press(SHORT)
    for entry in ("Align the bike", "Six positions", "Record ride"):
        assert panel.choose(entry) == lost and panel.screen.wizard is None
        assert panel.screen.view == "notice" and panel.lines(panel.now_ms + 2000) == lost
    assert panel.now_ms == 6000 and panel.choose("Sensor info") == ("On its I2C bus:", "nothing")
    assert panel.lines(8000) == lost
    panel.press(SHORT)
    panel.sensor.fault = None
    assert panel.lines()[0].startswith("Lean")


@pytest.mark.parametrize(
    ("config", "recording", "live", "own", "names"),
    [
        ({}, False, False, 0, PAGES),
        ({}, True, False, 0, [*PAGES, "recording"]),
        ({}, True, True, 2, [*PAGES, "live", "recording", "own", "own"]),
        (WHEEL | {"VEHICLE": "car"}, False, False, 0, ["acceleration", "cornering", "raw", "drive"]),
    ],
)
def test_short_presses_show_each_page_once(config, recording, live, own, names):
    panel = Panel(**config)
    if recording:
        panel.app.rides.start()
    panel.app.live, panel.app.user = Live() if live else None, User(own)
    assert panel.walk(2 * len(names)) == 2 * names
    if own:
        assert panel.choose("Own pages") == ("own", "")


def test_the_page_of_the_drive_follows_the_others_or_is_first():
    panel = Panel(**WHEEL)
    assert panel.choose("Align by drive")[0] == "Brakings   0/6" or panel.screen.view == "drive"
    assert panel.walk(2 * 6) == ["drive", *PAGES] * 2


def test_without_an_alignment_a_press_begins_it_and_own_pages_are_in_the_menu():
    panel = Panel(aligned=False)
    panel.app.user = User()
    assert panel.choose("Own pages") == ("own", "") and panel.press(SHORT)[1] == "Not aligned"
    assert panel.press(SHORT) == ("Stand: hold", "")


@pytest.mark.parametrize(
    ("meter", "lines"),
    [
        ({}, ("Lean  12° right", True)),
        ({"lean_deg": 64.9}, ("Lean  65° right", True)),
        ({"lean_deg": -65.0}, ("Lean  --", "not sure yet")),
        ({"suppressed_reason": "mount-moved"}, ("Lean  --", "mount has moved")),
        ({"fallen": True}, ("Fallen over?", "Lean over 65°")),
    ],
)
def test_a_lean_is_shown_only_if_it_is_trusted(meter, lines):
    panel = Panel()
    vars(panel.meter).update({"lean_deg": 12.0} | meter)
    assert panel.lines() == lines or (panel.lines()[0], len(panel.lines()[1])) == (lines[0], 16)
    panel.app.lcd.draws = True
    assert len(panel.content()) == (2 if "fallen" in meter else 3)
    panel.app.late = True
    assert panel.lines()[0] == ("Fallen over?" if "fallen" in meter else "Lean  --")


def test_a_display_that_draws_gets_pictures_of_three_pages():
    panel = Panel()
    panel.app.lcd.draws = True
    counts = []
    for _ in PAGES:
        counts.append(len(panel.content()))
        panel.press(SHORT)
    assert counts == [3, 3, 3, 2, 2]
