"""The stack of views: the front view is shown and gets the press, and an ended view is removed at once."""

import types

import pytest
from kickstand.errors import Notice
from kickstand_tools.simulated_board.simulator import Board

SHORT, LONG = 1, 2  # as in board/button.py


class Drive:
    """Alignment by driving that has a question, until it is answered."""

    shown = False

    def __init__(self):
        self.message = None
        self.answers = []

    def answer(self, agreed):
        self.answers.append(agreed)
        self.message = None


@pytest.fixture
def drive():
    return Drive()


@pytest.fixture
def sensor():
    chip = types.SimpleNamespace(accel_lsb_per_g=4096, gyro_lsb_per_dps=65.5, SATURATED=32700)
    return types.SimpleNamespace(chip=chip, fault=None)


@pytest.fixture
def screen(sensor, drive):
    """An aligned motorcycle's Screen, on a simulated board, for MicroPython's clock."""
    meter = types.SimpleNamespace(fallen=False, trusted=True, lean_deg=12.0, suppressed_reason=None, odd=None)
    meter.max_left_deg = meter.max_right_deg = 0.0
    calibration = types.SimpleNamespace(aligned=True, value=None)
    rides = types.SimpleNamespace(recorder=types.SimpleNamespace(active=False))
    settings = types.SimpleNamespace(leans=True, SAMPLE_HZ=200, SIDE="left")
    with Board(lambda t_s: (0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 25.0)):
        from kickstand.ui.screen import Screen

        yield Screen(settings, sensor, None, meter, calibration, drive, rides)


def first_line(screen, now_ms):
    return screen.lines(now_ms)[0]


def test_a_cancelled_alignment_gets_no_more_samples(screen):
    """Not even during the 100 ms until the next page: the last sample would save it."""
    screen.press(LONG, 0)
    screen.press(LONG, 100)
    assert screen.wizard is not None
    assert first_line(screen, 200) == "On the stand,"
    screen.press(LONG, 300)
    assert screen.wizard is None
    assert first_line(screen, 300).startswith("Lean")


def test_a_menu_that_is_left_is_gone_at_once(screen):
    screen.press(LONG, 0)
    for k in range(6):
        screen.press(SHORT, 100 * k)
    assert "Leave menu" in first_line(screen, 600)
    screen.press(LONG, 700)
    assert first_line(screen, 700).startswith("Lean")


def test_a_press_is_for_what_a_notice_covers(screen):
    screen.notify(Notice("out-of-room", "28"), 0)
    assert screen.lines(0) == ("Rec. stopped", "no room")
    screen.press(SHORT, 100)
    assert first_line(screen, 100).startswith("Max left")


def test_a_question_under_a_notice_is_not_answered_unread(drive, screen):
    screen.notify(Notice("out-of-room", "28"), 0)
    drive.message = Notice("other-side")
    assert screen.lines(0)[0] == "Rec. stopped"
    screen.press(LONG, 100)
    assert drive.answers == []
    assert first_line(screen, 100) == "Side was wrong?"
    screen.press(LONG, 200)
    assert drive.answers == [True]


def test_a_fault_hides_the_pages_and_the_menu_the_fault(sensor, screen):
    sensor.fault = Notice("sensor-lost")
    assert screen.lines(0) == ("Sensor lost", "check wiring")
    screen.press(SHORT, 100)
    screen.press(LONG, 200)
    assert "Align the bike" in first_line(screen, 200)
    screen.press(LONG, 300)
    assert screen.wizard is None
    assert screen.lines(300) == ("Sensor lost", "check wiring")
    sensor.fault = None
    assert first_line(screen, 2400).startswith("Lean")
