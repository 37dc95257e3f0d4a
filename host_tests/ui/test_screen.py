"""The stack of views: the front view is shown and gets the press, and an ended view is removed at once."""

import types

import pytest
from kickstand.errors import CaptureError, Notice
from kickstand_tools.simulated_board.simulator import Board

SHORT, LONG = 1, 2  # as in board/button.py


class Drive:
    """Replaces alignment by driving. The alignment has a question until the rider answers."""

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
    """The alignment gets no sample even in the 100 ms until the next page is shown. In that time the last sample would
    save the alignment."""
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


def test_pages_of_the_owner_follow_the_last_page(screen):
    screen.pages.own += [lambda: ("one", ""), lambda: ("two", "")]
    screen._meter.trusted = False  # while the lean is not trusted, each page always shows the same lines
    shown = []
    from kickstand.ui import page_ring

    ring = [page.__name__ for page in page_ring.MOTORCYCLE]
    for k in range(len(ring) + 3):
        line = first_line(screen, 100 * k)
        shown.append((screen.pages.name, line))
        screen.press(SHORT, 100 * k + 50)
    assert [name for name, _ in shown] == [*ring, "own", "own", ring[0]]
    assert [line for name, line in shown if name == "own"] == ["one", "two"]


def test_the_menu_shows_the_owners_pages_without_an_alignment(screen):
    screen._calibration.aligned = False
    screen.pages.own.append(lambda: ("one", "mine"))
    screen.pages.show_own(0)
    assert screen.lines(0) == ("one", "mine")
    screen.press(SHORT, 100)
    assert screen.pages._own_at is None


def test_only_the_first_page_shows_that_a_ride_is_recorded(screen):
    screen._rides.recorder.active = True
    assert [len(line) for line in screen.lines(0)] == [16, 16]
    assert screen.lines(0)[0].endswith("*")
    screen.press(SHORT, 100)
    assert not screen.lines(200)[0].endswith("*")


def test_a_display_that_draws_gets_a_picture_of_the_first_page(screen):
    assert len(screen.lines(0)) == 2
    screen.pages.draws = True
    assert len(screen.lines(100)) == 3
    screen._meter.trusted = False
    assert screen.lines(200)[:2] == ("Lean  --", "not sure yet")
    assert len(screen.lines(200)) == 3


def test_the_menu_asks_for_alignment_by_driving(drive, screen):
    from kickstand.ui import page_ring

    asked = []
    drive.ask = lambda: asked.append(True)
    screen.press(LONG, 0)
    for k in range(10):
        if "Align by drive" in first_line(screen, 100 * k):
            break
        screen.press(SHORT, 100 * k + 50)
    screen.press(LONG, 1500)
    assert asked == [True]
    assert screen.pages._at == len(page_ring.MOTORCYCLE)  # the page that follows the motorcycle's pages


def test_the_problem_of_a_pose_is_known_until_the_next_pose(screen):
    screen.press(LONG, 0)
    screen.press(LONG, 100)
    problem = CaptureError("moved")
    screen.wizard._spoilt(problem, 200)
    assert screen.wizard.problem is problem
    assert screen.lines(300) == ("Moved!", "Hold it still")
    screen.press(SHORT, 400)
    assert screen.wizard.problem is None


def test_a_menu_ends_20_s_after_the_last_press(screen):
    screen.press(LONG, 0)
    screen.press(SHORT, 15_000)
    assert first_line(screen, 34_900).startswith("\x7e")  # the code of the arrow before the chosen entry
    assert first_line(screen, 35_000).startswith("Lean")
    assert screen.menu is None


def test_the_pages_use_a_short_press_and_leave_a_long_one(screen):
    assert screen.pages.press(SHORT, 0) is True
    assert screen.pages.press(LONG, 100) is False
