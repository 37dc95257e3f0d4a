"""The times, counts and orders of the views: menu, ring of pages, notices, wizards and pictures."""

from types import SimpleNamespace
from typing import Any

import pytest
from kickstand.errors import AlignmentError, CaptureError, GyroError, Notice
from kickstand_tools.simulated_board.simulator import Board

SHORT, LONG = 1, 2  # as in board/button.py
CHIP = SimpleNamespace(accel_lsb_per_g=4096, gyro_lsb_per_dps=65.5, SATURATED=32700)


@pytest.fixture(autouse=True)
def _board():
    with Board(lambda t_s: (0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 25.0), display="ssd1306"):
        yield


def screen(leans=True, drive: Any = None, **given) -> Any:
    """Return a Screen of an aligned vehicle. The list `calls` collects what its menu does."""
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
    assert shown.lines(0)[0][1:] == found[0]  # the first entry follows the last one
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
    assert shown.front is shown.pages  # the recording waits
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
    shown.press(LONG, 3000)  # opens the menu above it
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


PAGES = ["lean", "maxima", "acceleration", "formula", "raw"]


def test_the_ring_of_pages_has_its_order():
    shown = screen()
    shown._meter.trusted = False
    assert names(shown, 6) == [*PAGES, "lean"]
    shown.recorder.active = True
    shown.pages.first()
    assert names(shown, 7) == [*PAGES, "recording", "lean"]
    shown.pages.live = SimpleNamespace(lines=lambda: ("live", ""))
    shown.pages.first()
    assert names(shown, 8) == [*PAGES, "live", "recording", "lean"]
    car = screen(False)
    car._meter.trusted = False
    assert names(car, 4) == ["acceleration", "cornering", "raw", "acceleration"]


def test_the_page_of_the_drive_follows_or_is_first(monkeypatch):
    from kickstand.ui import drive_page, pages

    monkeypatch.setattr(drive_page, "lines", lambda drive, now_ms: ("drive", ""))
    monkeypatch.setattr(pages, "not_aligned", lambda meter, seconds, line2="": ("not aligned", str(seconds) + line2))
    shown = screen(drive=SimpleNamespace(message=None, shown=True))
    shown._meter.trusted = False
    assert names(shown, 7) == [*PAGES, "drive", "lean"]
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
    assert shown.wizard is not None and shown.wizard.state == 1  # the press was for the kickstand pose


@pytest.mark.parametrize(
    ("given", "trusted"),
    [({}, True), ({"lean_deg": 65.0}, True), ({"lean_deg": -65.1}, False), ({"fallen": True}, False)]
    + [({"trusted": False}, False)],
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
    shown = screen()
    shown.pages.draws = True
    assert [len(shown.pages._page(page)) for page in shown.pages._pages[:3]] == [3, 3, 3]
    function, *values, recording = shown.pages._page(shown.pages._pages[0])[2]
    assert function.__name__ == "_lean" and values == [12, "right", 12] and not recording
    shown.recorder.active = True
    assert shown.pages._page(shown.pages._pages[0])[2][-1]
    shown.pages.draws = False
    assert len(shown.pages._page(shown.pages._pages[0])) == 2


# the alignment with two poses


def align_wizard(pressed=False) -> Any:
    from kickstand.ui.align_wizard import AlignWizard

    made: Any = AlignWizard(CHIP, 200, SimpleNamespace(value="old", save=lambda *_: None), "right", pressed)
    return made


def test_an_alignment_asks_and_takes_each_pose():
    made = align_wizard()
    assert made.lines(0) == ("On the stand,", "press button") and made.state == 0 and not made.upright
    made.press(SHORT, 0)
    assert made.lines(0) == ("Stand: hold", "") and made.state == 1
    made._pose_done(SimpleNamespace(gyro=[0.0] * 3), 0)
    assert made.lines(0) == ("Now upright:", "hold it, press") and made.state == 0 and made.upright
    made.press(SHORT, 0)
    assert made.lines(0) == ("Upright: hold", "") and made.state == 1
    assert align_wizard(True).lines(0) == ("Stand: hold", "")
    assert (made.POSE_SECONDS, made._taker._take_count, made._turn._period_us) == (3, 600, 5000)


def test_the_progress_of_a_pose_is_a_bar():
    made = align_wizard(True)
    made._taker = SimpleNamespace(restless=False)
    made._progress(300, 600)
    assert made.lines(0) == ("Stand: hold", "\xff" * 8)
    made._progress(0, 600)
    assert made.lines(0) == ("Stand: hold", "")
    made._taker.restless = True
    made._progress(0, 600)
    assert made.lines(0) == ("Stand: hold", "not still yet")


@pytest.mark.parametrize(
    ("tilt", "waited_ms", "fresh", "line1", "line2"),
    [(8.0, 89_999, True, "Aligned!   8.0\xdf", "Ride safely")]
    + [
        (7.94, 90_000, False, "Aligned!   7.9\xdf", "Little, 8\xdf best"),
        (12.3, 0, True, "Aligned!  12.3\xdf", "Ride safely"),
    ],
)
def test_the_result_of_an_alignment_is_shown_for_4_s(monkeypatch, tilt, waited_ms, fresh, line1, line2):
    from kickstand.ui import align_wizard as module

    seen = []
    monkeypatch.setattr(module, "align", lambda *given: seen.append(given) or ("new", tilt))
    monkeypatch.setattr(module, "check_turn", lambda *given: seen.append(given[:3]))
    made = align_wizard(True)
    made._calibration.save = lambda *given: seen.append(given)
    poses = SimpleNamespace(gyro=[0.0] * 3), SimpleNamespace(gyro=[1.0] * 3)
    made._pose_done(poses[0], 1000)
    assert made._turn.running
    made._pose_done(poses[1], 1000 + waited_ms)
    assert seen == [("old", *poses, "right"), ("old", *poses), ("new", fresh)]
    assert made.state == 4 and made.lines(4999 + waited_ms) == (line1, line2) and not made.ended
    assert made.lines(5000 + waited_ms) is None and made.ended


def test_presses_and_refusals_of_a_wizard(capsys):
    made = align_wizard(True)
    made._refuse(AlignmentError("tilt-small", 1.2, 3.0))
    assert made.lines(0) == ("Tilt only 1.2\xdf", "Need 3\xdf or more") and made.state == 3
    assert not made._turn.running and capsys.readouterr().out == ""
    made.press(SHORT, 0)
    assert made.state == 0 and made.lines(0) == ("On the stand,", "press button")
    made._refuse(GyroError("gyro-reversed", "x"))
    assert "wrong sign" in capsys.readouterr().out
    made.press(LONG, 0)
    assert made.ended and made.state == 5 and made.lines(0) is None
    made = align_wizard()
    made._show_for(9000, 4, 0, "a", "b")
    made.press(SHORT, 0)
    assert made.ended


def test_samples_are_taken_only_during_a_pose():
    made = align_wizard()
    seen: list = []
    made._taker = SimpleNamespace(
        step=lambda counts: seen.append(counts) or made.step, settled="settled", pose="pose", progress=lambda: (3, 9),
        restart=lambda: None, averaging=True,
    )  # fmt: skip
    made._settled = lambda *given: seen.append(("settled", *given))
    made._pose_done = lambda *given: seen.append(("done", *given))
    made._progress = lambda *given: seen.append(("progress", *given))
    made.sample([1], 5)
    assert not seen
    made.state = 1
    for made.step in (0, 1, 2, 3):
        made.sample([1], 5)
    steps = [call for call in seen if call != [1]]
    assert steps == [("progress", 3, 9), ("settled", "settled", 5), ("progress", 3, 9), ("done", "pose", 5)]
    made._turn = SimpleNamespace(add=lambda *given: seen.append(given))
    made.follow([0], 2, 10_000, 5)
    assert seen[-1] == ([0], 2, 10_000, True)
    made.state = 0
    made.follow([0], 2, 10_000, 5)
    assert seen[-1] == ([0], 2, 10_000, False)
    assert made.bears(None, 0) and not made.bears(Notice("clips", "Gyro"), 0)


# the six positions


def six(**given) -> Any:
    from kickstand.ui.six_wizard import SixWizard

    made: Any = SixWizard(CHIP, 200, SimpleNamespace(value=None, save=lambda *_: None))
    for name, value in given.items():
        setattr(made, name, value)
    return made


def test_six_positions_ask_for_the_missing_sides():
    made = six()
    assert made.lines(0) == ("Side up, still:", "any of the six")
    made._sides = [0, -1, 1, 2, -1, 3]
    made._next_pose()
    assert made.lines(0) == ("Side up, still:", "-x +z")
    made._fitted = ([0.0] * 3, [1.0] * 3)
    made._next_pose()
    assert made.lines(0) == ("Check: slant it", "and hold still")
    made._unproved = "y"
    made._next_pose()
    assert made.lines(0) == ("Slant it again,", "another way")
    assert made._taker._take_count == 400


def test_the_progress_of_a_side_is_named():
    made = six(_side=3)
    made._progress(0, 400)
    assert made.lines(0)[0] == "Side up, still:"
    made._progress(100, 400)
    assert made.lines(0) == ("Side -y, hold", "\xff" * 4)
    made._fitted = ([0.0] * 3, [1.0] * 3)
    made._progress(200, 400)
    assert made.lines(0) == ("Check, hold", "\xff" * 8)


@pytest.mark.parametrize(
    ("accel", "lines"),
    [([0.0, 0.0, 1.0], None), ([0.0, 0.49, 0.87], None), ([0.0, 0.52, 0.855], ("Not on a side:", "31\xdf off"))]
    + [([1.0, 0.0, 0.0], ("Side +x is done", "1/6, turn it"))],
)
def test_a_side_is_accepted_up_to_30_degrees_and_once(accel, lines):
    made = six(_sides=[0, -1, -1, -1, -1, -1])
    before = made.lines(0)
    made._settled(accel, 0)
    assert made.lines(1499) == (lines or before)
    assert made.lines(1500)[0] == "Side up, still:"
    if lines:
        assert made.state == 1


def test_the_slanted_pose_is_at_least_20_degrees_off():
    """The slope and the offset of the fit apply: 0.8 * 0.4 + 0.02 is 0.34, of 1 g 19.9 degrees."""
    for x, lines in ((0.4, ("Slant it more:", "19\xdf is too flat")), (0.41, ("Check: slant it", "and hold still"))):
        made = six(_fitted=([0.02, 0.0, 0.0], [0.8, 1.0, 1.0]))
        made._next_pose()
        made._settled([x, 0.0, 0.94], 0)
        assert made.lines(0) == lines


def test_a_spoilt_turn_may_be_repeated_up_to_12_poses():
    made = six(_poses=[0] * 10, _sides=[0, 1, 2, 3, 4, -1])
    assert not made._again()
    made._turn.running, made._turn.quick, made._turn.lost = True, False, True
    assert not made._again()  # 10 poses, the repeated one, the missing side, and the slanted pose are 13
    made._poses = [0] * 9
    assert made._again()
    made._turn.running = False
    assert not made._again()
    made._turn.running, made._turn.lost = True, False
    assert not made._again()


def test_a_turn_that_is_too_fast_is_said_once():
    made = six()
    made._turn.running, made._turn.quick, made._turn.lost = True, True, False
    made._followed(0)
    assert made.lines(0) == ("Turned too fast:", "turn it slower") and made.state == 2
    made._next_pose()
    made._followed(0)
    assert made.state == 1


@pytest.mark.parametrize(
    ("fault", "running", "bears"),
    [(Notice("clips", "Gyro"), True, True), (Notice("clips", "Gyro"), False, False)]
    + [(Notice("clips", "Accel"), True, False), (Notice("sensor-lost"), True, False), (None, True, False)],
)
def test_only_rates_at_the_end_of_the_range_are_borne(fault, running, bears):
    made = six()
    made._turn.start([0.0] * 3)
    made._turn.running = running
    assert made.bears(fault, 0) is bears
    assert made._turn.quick is bears


def test_the_result_of_six_positions(monkeypatch):
    from kickstand.ui import six_wizard

    monkeypatch.setattr(six_wizard, "six_position_calibration", lambda *given: given)
    saved = []
    fit = SimpleNamespace(offset="o", slope="s", unproved=(), matrices=lambda: "m")
    made = six(_fit=fit, _poses=[0] * 4, _bias=[4.0, 8.0, -4.0], _error=-0.0124)
    made._calibration.save = saved.append
    made._computed(0)
    assert saved == [("o", "s", [1.0, 2.0, -1.0], "m")] and made._fit is None
    assert made.lines(5999) == ("Saved, err 12 mg", "Now align it") and made.lines(6000) is None


def test_an_unproved_gyro_needs_another_pose_up_to_12():
    fit = SimpleNamespace(unproved=("z", "x"))
    made = six(_fit=fit, _poses=[0] * 11)
    made._computed(0)
    assert made._unproved == "z" and made.lines(0) == ("Slant it again,", "another way")
    with pytest.raises(GyroError):
        six(_fit=fit, _poses=[0] * 12)._computed(0)


def test_turns_between_poses_are_kept_unless_they_are_spoilt():
    made = six(_side=2)
    made._pose_done(SimpleNamespace(accel="a", gyro=[1.0, 2.0, 3.0]), 0)
    assert made._turns == [] and made._poses == ["a"] and made._sides == [-1, -1, 0, -1, -1, -1]
    assert made.lines(0) == ("Side +y done", "1/6, turn it") and made._turn.running
    made._turn.quick = True
    made._pose_done(SimpleNamespace(accel="b", gyro=[1.0, 2.0, 3.0]), 0)
    assert made._turns == [None] and made._sides[2] == 0  # the first pose of a side is kept
    made._pose_done(SimpleNamespace(accel="c", gyro=[1.0, 2.0, 3.0]), 0)
    assert len(made._turns) == 2 and made._turns[1][1] == made._turn.seconds
    assert made._bias == [3.0, 6.0, 9.0]


def test_a_spoilt_pose_of_six_is_a_notice():
    made = six()
    made._spoilt(CaptureError("moved"), 0)
    assert made.state == 2 and made.lines(1499) == ("Moved!", "Hold it still")


# pictures


def test_the_arc_and_its_scale():
    from kickstand.ui import glance

    rows = [102 - round((10_000 - x * x) ** 0.5) for x in range(61)]
    assert list(glance._ARC) == rows
    pixels = [[glance._SCALE.pixel(x, y) for y in range(32)] for x in range(128)]
    for x in range(61):
        for column in (64 + x, 64 - x):
            length = 7 if x in (0, 30, 60) else 1
            lit = [y for y in range(32) if pixels[column][y]]
            assert lit == list(range(rows[x], rows[x] + length))
    assert not any(map(any, pixels[:4])) and not any(map(any, pixels[125:]))


def test_the_degree_sign_follows_the_number():
    """The number 12 begins at column 38 and ends at column 94. The sign has a side at 91 and at 96."""
    from kickstand.ui import glance

    calls: list = []
    canvas = SimpleNamespace(
        blit=lambda *_: None, text=lambda *_: None, vline=lambda *given: calls.append(("v", *given)),
        hline=lambda *given: calls.append(("h", *given)),
    )  # fmt: skip
    glance._lean(canvas, 12, "", 0, False)
    assert calls[1:] == [("v", 91, 17, 4, 1), ("h", 92, 16, 4, 1), ("v", 96, 17, 4, 1), ("h", 92, 21, 4, 1)]
    assert calls[0] == ("v", 64, 2, 7, 1)


def test_a_lean_is_rounded_away_from_zero():
    from kickstand.ui import glance

    for deg, number, side, column in ((9.5, 10, "right", 10), (-9.5, 10, "left", -10), (9.49, 9, "right", 9)):
        found = glance.lean(SimpleNamespace(lean_deg=deg), False)
        assert found[1:4] == (number, side, column)


def test_the_band_of_a_reason_is_centred():
    from kickstand.ui import glance

    for reason, spaces in (("a" * 16, 0), ("a" * 15, 1), ("a" * 14, 1), ("a" * 13, 2)):
        seen: list = []
        canvas = SimpleNamespace(
            fill_rect=lambda *_: None, hline=lambda *_: None, tall=lambda *given, seen=seen: seen.append(given)
        )
        glance._unsure(canvas, reason)
        assert seen == [(" " * spaces + reason, 5, True)]


def test_each_digit_has_its_own_120_bytes():
    """The glyphs are drawn from bands of 8 rows; the 1 has a column of 40 rows or less, and the 8 is symmetric."""
    from kickstand.ui import glance

    assert len(glance._GLYPHS) == 10 and len(glance.DIGITS) == 1200
    for digit, glyph in enumerate(glance._GLYPHS):
        bands = glance.DIGITS[120 * digit : 120 * (digit + 1)]
        for x, y in ((0, 0), (12, 3), (5, 20), (20, 30), (12, 39), (23, 17)):
            assert glyph.pixel(x, y) == bands[24 * (y // 8) + x] >> y % 8 & 1
    assert (glance.DIGIT_WIDTH, glance.DIGIT_HEIGHT) == (24, 40)
