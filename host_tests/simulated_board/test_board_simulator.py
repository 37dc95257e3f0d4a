"""The simulated board as a whole: power, resets, watchdog, button, and its modules' installation."""

import sys

from kickstand_tools.simulated_board.fakes import fake_machine, fake_time
from kickstand_tools.simulated_board.fakes.fake_machine import WDT, Pin
from kickstand_tools.simulated_board.simulator import Board
from support.board_access import firmware, level, on_board, raised


def test_power_is_lost_by_off_and_kept_by_reset():
    seen = []

    def firmware():
        seen.append((board.sensor.peek(0x1B), fake_machine.reset_cause(), fake_time.ticks_ms(), board.lcd.on))
        board.clock.advance(200_000)
        board.sensor.start(0x68, False)
        for value in (0x1B, 0x18):
            board.sensor.write_byte(value)
        board.lcd.on = True
        if len(seen) == 1:
            fake_machine.reset()
        fake_time.sleep_ms(60_000)

    with Board(level) as board:
        assert board.run(firmware, 1.0) == "reset"
        assert board.run(firmware, 2.0) == "off"
        assert not board.lcd.on
        assert board.run(firmware, 3.0) == "off"
    on, off = fake_machine.PWRON_RESET, fake_machine.WDT_RESET
    assert seen == [(0, on, 0, False), (0x18, off, 0, True), (0, on, 0, False)], seen
    assert board.boots == 3 and board.clock.now_us == 3_000_000


def test_its_register_stops_the_watchdog():
    def firmware(board):
        WDT(timeout=1000)
        fake_machine.mem32[0x40058000 + 0x3000] = 1 << 30
        fake_time.sleep_ms(3000)
        WDT(timeout=1000)

    outcome, board = on_board(firmware, 60.0)
    assert outcome == "returned"
    board.clock.advance(5_000_000)


def test_the_watchdog_of_an_esp32_counts_in_32_bits():
    def wait(days):
        WDT(timeout=days * 86_400_000)
        fake_time.sleep_ms(60_000_000)

    assert on_board(lambda board: wait(12), 100_000.0, port="esp32")[0] == "returned"
    assert on_board(lambda board: wait(13), 100_000.0, port="esp32")[0] == "reset"


def levels(board, until_us):
    """Return (time, level) of each change of the button's pin."""
    pin = Pin(15, Pin.IN, Pin.PULL_UP)
    changes, last = [], 1
    while board.clock.now_us < until_us:
        now = pin.value()
        if now != last:
            changes.append((board.clock.now_us, now))
            last = now
        board.clock.advance(18)
    return changes


@firmware(2.0)
def test_a_press_bounces_and_then_holds(board):
    board.press(0.1, 0.2)
    changes = levels(board, 500_000)
    down = [t for t, _ in changes if t < 200_000]
    up = [t for t, _ in changes if t >= 200_000]
    assert len(down) > 2 and len(up) > 2, "no bounce"
    assert len(down) % 2 == 1 and len(up) % 2 == 1, "the last level is not the right one"
    assert 100_000 <= down[0] < 100_100 and down[-1] < 105_000
    assert 300_000 <= up[0] < 300_100 and up[-1] < 305_000
    board.press()
    assert levels(board, 510_000)[0][1] == 0


def test_cpython_has_no_machine_code():
    """From Python 3.14 on, the types in viper code raise no error. But run by CPython, the code would give wrong
    results."""
    if sys.implementation.name == "cpython":
        assert isinstance(raised(sys.modules["micropython"].viper, None), NameError)
