"""The simulated board of the page Try, run on CPython."""

import itertools
import json

import pytest
from kickstand_tools.simulated_board.clock import Clock
from kickstand_tools.simulated_board.lcd import Lcd
from kickstand_tools.web.device import STATE, WHOLE_TICKS, PageDevice, display


@pytest.fixture
def board(tmp_path, monkeypatch):
    """Return the board of the page Try. The board's flash is a new folder."""
    monkeypatch.chdir(tmp_path)
    device = PageDevice()
    yield device
    device.board.uninstall()


def ticks(device, until_s):
    device.run_to(until_s)
    return json.loads(device.take())


def texts(found):
    return [" ".join(tick["display"]["text"]) for tick in found if "display" in tick]


def last(found, name):
    return next(tick[name] for tick in reversed(found) if name in tick)


def test_the_page_gets_a_record_every_20_ms(board):
    found = ticks(board, 2.5)
    assert [round(50 * tick["t_s"]) for tick in found] == list(range(1, 1 + len(found))) and len(found) in (125, 126)
    assert any("On stand: press" in text for text in texts(found))
    assert found[-1]["phase"] == "kickstand" and found[-1]["lean_deg"] == pytest.approx(-12.0, abs=0.1)
    assert found[-1]["powered"] and found[-1]["speed_mps"] == 0.0
    assert last(found, "meter") == [None, None]  # the board is not aligned yet
    assert "display" in found[1]  # the dark display is sent too
    assert sum("display" in tick for tick in found) < 10  # a display is sent only if it has changed
    shown = last(found, "display")
    assert shown["codes"][0][:4] == list(b"Raw ") and found[1]["display"]["codes"] == [[0x20] * 16] * 2
    assert shown["lit"] and len(shown["cgram"]) == 64 and shown["shown_deg"] is None
    assert json.loads(board.take()) == []


def test_a_display_that_keeps_changing_is_sent_now_and_then(board):
    """Usually a display is sent only if it has not changed for 20 ms."""

    def change():
        board.board.lcd.changes += 1

    board.board.every(0.01, change)
    found = ticks(board, 1.0)
    sent = [k for k, tick in enumerate(found) if "display" in tick]
    assert sent[0] == WHOLE_TICKS == 10 and max(b - a for a, b in itertools.pairwise(sent)) <= 11


def test_a_press_aligns_and_the_bike_rides_on(board):
    """The rider presses the button on the kickstand and upright."""
    board.run_to(2.0)
    for pose, until_s in ((None, 6.5), ("upright", 14.0)):
        if pose:
            board.order("pose", pose)
            board.run_to(9.0)
        board.order("button", True)
        assert board.order("button", False) == pytest.approx(9.0 if pose else 2.0, abs=0.1)
        found = ticks(board, until_s)
    assert any("Aligned!" in text for text in texts(found))
    board.order("pose", 15.0)
    board.run_to(20.0)
    board.order("lean", 25.0)
    found = ticks(board, 24.0)
    lean_deg, forward_g = last(found, "meter")
    assert lean_deg == pytest.approx(25.0, abs=3.0) and forward_g == pytest.approx(0.0, abs=0.1)
    assert last(found, "display")["shown_deg"] == pytest.approx(25.0, abs=3.0)
    assert found[-1]["yaw_rate_dps"] < -10.0 and found[-1]["speed_mps"] == pytest.approx(15.0, abs=0.5)
    assert board.state()["trusted"] and set(board.state()) == set(STATE)


def test_power_and_plugs_may_be_pulled(board):
    board.run_to(2.0)
    for fitted in (False, False, True, True):
        board.order("sensor", fitted)
        found = ticks(board, board.board.clock.now_us / 1e6 + 2.0)
        if not fitted:
            assert board.state()["fault"] or "sensor" in texts(found)[-1].lower()
    board.order("power", False)
    found = ticks(board, 12.0)
    assert not board.powered and not found[-1]["powered"] and board.state() == {"view": "off"}
    assert not display(board.board.lcd)["lit"]
    board.order("display", "ssd1306")
    board.order("power", True)
    assert board.state() == {"view": "starting"}
    found = ticks(board, 15.0)
    shown = last(found, "display")
    assert found[-1]["powered"] and shown["lit"] and len(shown["pixels"]) == 1024
    assert any("On stand" in text for text in texts(found))


def align(device):
    """Press the button in both poses. Returns the records of the 13 s that this takes."""
    begin_s = device.board.clock.now_us / 1e6
    for at_s, pose in ((begin_s, "kickstand"), (begin_s + 6.5, "upright")):
        device.order("pose", pose)
        device.run_to(at_s + 2.0)
        device.order("button", True)
        device.order("button", False)
        device.run_to(at_s + 6.5)
    return json.loads(device.take())


def test_a_record_has_the_true_motion_in_its_unit(board):
    """The lean is in degrees with two digits, the speed in m/s with two, the yaw rate in deg/s with one."""
    board.order("pose", 15.0)
    board.run_to(8.0)
    board.order("lean", -20.0)
    found = ticks(board, 8.3)[-1]
    lean_deg, speed_mps, yaw_rate_dps, phase = board.bike.truth(found["t_s"])
    assert (found["lean_deg"], found["speed_mps"]) == (round(lean_deg, 2), round(speed_mps, 2))
    assert (found["yaw_rate_dps"], found["phase"]) == (round(yaw_rate_dps, 1), phase)
    assert found["lean_deg"] < -3.0 and found["yaw_rate_dps"] > 2.0  # yaw is positive to the left


def test_the_meter_is_sent_with_its_digits(board):
    """The lean has one digit, the forward force three. Lean and forward force are missing before the alignment."""
    assert last(ticks(board, 2.0), "meter") == [None, None]
    sent = [tick["meter"] for tick in align(board)]
    lean_deg, forward_g = sent[-1]
    assert lean_deg == pytest.approx(0.0, abs=1.5) and forward_g == pytest.approx(0.0, abs=0.05)
    for values, digits in (([lean for lean, _ in sent if lean], 1), ([force for _, force in sent if force], 3)):
        assert all(round(value, digits) == value for value in values)
        assert any(round(value, digits - 1) != value for value in values)


def test_a_state_is_sent_when_it_changes(board):
    found = ticks(board, 3.0)
    sent = [tick["state"] for tick in found if "state" in tick]
    assert sent[0]["code"] == "starting" and sent[-1]["view"] == "not_aligned"
    assert sent[-1] == board.state() and set(sent[-1]) == set(STATE)
    assert all(a != b for a, b in itertools.pairwise(sent)) and len(sent) < 10


@pytest.mark.parametrize(("held_s", "pressed_s"), [(0.0, 0.1), (0.05, 0.1), (0.3, 0.3)])
def test_a_press_lasts_at_least_100_ms(board, held_s, pressed_s):
    board.run_to(2.0)
    pressed_at_s = board.order("button", True)
    board.run_to(pressed_at_s + held_s)
    board.order("button", False)
    board.run_to(pressed_at_s + pressed_s - 0.02)
    assert board.board.button.closed
    board.run_to(pressed_at_s + pressed_s + 0.02)
    assert not board.board.button.closed


def test_time_goes_on_in_safe_mode(board):
    """The button is held while the power is switched on. The firmware then ends, and the board waits for its power to
    be switched off."""
    board.run_to(2.0)
    board.order("power", False)
    assert board.order("power", False) == pytest.approx(2.0, abs=0.1)  # the board is already off
    board.order("button", True)
    board.run_to(2.2)
    board.order("power", True)
    found = ticks(board, 5.0)
    assert board.state() == {"view": "safe"} and last(found, "state") == {"view": "safe"}
    assert any("Safe mode" in text for text in texts(found))
    assert found[-1]["t_s"] == pytest.approx(5.0, abs=0.03) and "meter" not in found[-1]
    board.order("button", False)
    board.order("power", False)
    assert not board.powered and board.state() == {"view": "off"}
    board.order("power", True)
    board.run_to(8.0)
    assert board.state()["view"] != "safe"


def test_the_time_runs_to_the_wanted_time_while_off(board):
    board.run_to(2.0)
    board.order("power", False)
    found = ticks(board, 4.0)
    assert [round(50 * tick["t_s"]) for tick in found][-1] == 200
    assert board.order("power", True) == pytest.approx(4.0, abs=0.01)


def test_the_supply_is_cut_during_one_save(board):
    """The calibration of the first alignment is lost, and that of the second is kept."""
    board.order("cut_save", True)
    align(board)
    assert not board.powered
    board.order("power", True)
    found = align(board)
    assert any("On stand: press" in text for text in texts(found))
    assert board.powered and last(found, "meter")[0] == pytest.approx(0.0, abs=1.5)


def test_a_cut_can_be_cancelled(board):
    board.order("cut_save", True)
    board.order("cut_save", False)
    assert last(align(board), "meter")[0] == pytest.approx(0.0, abs=1.5)
    assert board.powered


def test_a_display_fitted_without_power_stays_dark(board):
    board.run_to(1.0)
    board.order("power", False)
    board.order("display", "lcd")
    found = ticks(board, 1.5)
    shown = last(found, "display")  # the display is sent again, because it was exchanged
    assert not shown["lit"] and shown["text"] == [" " * 16] * 2
    board.order("power", True)
    assert last(ticks(board, 3.0), "display")["lit"]
    board.order("display", "sh1106")  # a display that has power lights up after its initialisation
    assert "pixels" in last(ticks(board, 6.0), "display")


def test_an_oled_keeps_its_text_while_a_picture_arrives(board):
    """The text of a half received picture cannot be read."""
    board.order("display", "ssd1306")
    found = ticks(board, 3.0)
    assert texts(found) and not any(text.startswith("?") for text in texts(found))


def test_characters_are_sent_only_of_a_display_that_is_on():
    lcd = Lcd(Clock())
    lcd.ddram[0] = ord("A")
    blank = [[0x20] * 16] * 2
    for on, two_lines, codes in (
        (False, False, blank),
        (True, False, blank),
        (False, True, blank),
        (True, True, [[0x41] + [0x20] * 15, [0x20] * 16]),
    ):
        lcd.on, lcd.two_lines = on, two_lines
        assert display(lcd)["codes"] == codes
    lcd.ddram[:16] = b"Lean 12\xdf left   "
    assert display(lcd)["shown_deg"] == -12.0
    assert display(lcd)["cgram"] == [0] * 64
