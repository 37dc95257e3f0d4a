"""Every display driver passes the same tests, on the simulated model of its own display. Also runs on MicroPython."""

import gc
import sys

from kickstand_sim.simulated_board.lcd import Lcd
from other_displays import Mcp23008, OwnI2c
from support.board_access import on_board

OLEDS = ("ssd1306", "sh1106")
KINDS = ("lcd",) + OLEDS
TURN_MS = 10
OLD, NEW = ("Lean  19\xdf right", "first"), ("Lean  28\xdf left", "second line")


def as_text(lines):
    # Pad the lines by hand, because MicroPython's %-16s counts a degree sign as two bytes.
    return [line.replace("\xdf", "\xb0") + " " * (16 - len(line)) for line in lines]


def open_display(board, hz=None, kind="auto", wiring=1):
    from kickstand.board import port
    from kickstand.board.display import Display

    return Display(lambda rate: port.open_i2c(1, 6, 7, rate), hz, kind, wiring=wiring)


def turns(board, display, count, after=lambda: None):
    """Run this many passes of the loop. Return the duration of the longest pass in us."""
    from time import sleep_us, ticks_diff, ticks_ms, ticks_us  # type: ignore[attr-defined]

    longest_us = 0
    for _ in range(count):
        begin_us = ticks_us()
        display.tick(ticks_ms())
        turn_us = ticks_diff(ticks_us(), begin_us)
        longest_us = max(longest_us, turn_us)
        sleep_us(max(0, 1000 * TURN_MS - turn_us))
        after()
    return longest_us


def check_lines(board, display, lines, count=60):
    """Show these lines, and check that the display shows them after this many passes."""
    display.show(*lines)
    turns(board, display, count)
    assert board.lcd.text() == as_text(lines), board.lcd.text()


def run(test, **board):
    outcome, board = on_board(test, 1e6, **board)
    assert outcome == "returned" and not board.too_fast


def on_each(hz=(None,), kinds=KINDS):
    """Decorate test(board, display), so that it runs with each display. At its start the display shows OLD."""

    def decorated(test):
        def with_each():
            for kind in kinds:
                for rate in hz:

                    def program(board, rate=rate):
                        display = open_display(board, rate)
                        check_lines(board, display, OLD)
                        test(board, display)

                    run(program, display=kind)

        return with_each

    return decorated


@on_each((None, 100_000))
def test_lines_appear_without_delaying_the_loop(board, display):
    """While nothing changes, the driver only checks five times per second that the display answers."""
    for lines in (NEW, ("", ""), ("0123456789ABCDEFGHI", "\xff\xff\x7e"), OLD):
        display.show(*lines)
        turns(board, display, 40)
        cut = [line[:16].replace("\xff", "\x01").replace("\x7e", "\x02") for line in as_text(lines)]
        displayed = [line.replace("\u2588", "\x01").replace("\u2590", "\x01") for line in board.lcd.text()]
        assert [line.replace("\u2192", "\x02") for line in displayed] == cut, (displayed, cut)
    transfers = board.lcd_bus.transfers[board.lcd.address]
    for _ in range(20):
        display.show(*OLD)
        turns(board, display, 10)
    assert 8 <= board.lcd_bus.transfers[board.lcd.address] - transfers <= 11 and board.lcd.backlight
    for k in range(20):
        display.show(f"{k * 1234567:016d}", f"{k * 7654321:016d}")
        # An LCD needs longer: dashes first, then the new line
        assert turns(board, display, 10) <= (13_200 if isinstance(board.lcd, Lcd) else 7500)


@on_each(kinds=("lcd",))
def test_an_lcd_gets_only_the_changed_part_of_a_line(board, display):
    """For one changed character an LCD needs four bytes for the position, four for the character, and one before each,
    because RS must be stable before E rises. For more characters the driver sends twice as many bytes."""
    sent, write = [], board.lcd.write_byte
    board.lcd.write_byte = lambda value: sent.append(value) or write(value)
    for line, count in (("Lean  18\xdf right", 2 * 5), ("Lean   4\xdf left", 2 * (5 + 1 + 4 * 9))):
        del sent[:]
        display.show(line, OLD[1])
        turns(board, display, 1)
        assert len(sent) == count, (line, len(sent))


@on_each((None, 100_000))
def test_after_any_unplug_it_returns_and_shows_nothing_old(board, display):
    for gap_turns, gone_ms in ((0, 1), (0, 50), (5, 1), (40, 1)):
        check_lines(board, display, OLD, 40)
        display.show(*NEW)
        turns(board, display, gap_turns % 7)  # the display may be removed during a transfer of the new lines
        # An LCD is also removed during its initialisation
        for begun in (0, 12) if isinstance(board.lcd, Lcd) else (0,):
            turns(board, display, begun)
            board.remove_lcd()
            assert not board.lcd.backlight and not "".join(board.lcd.text()).strip()
            board.clock.advance(1000 * gone_ms)
            turns(board, display, gap_turns)
            board.fit_lcd()
        lines = set()

        def look(lines=lines):
            if board.lcd.backlight:
                lines.add(board.lcd.text()[0])

        turns(board, display, 80, look)
        assert board.lcd.text() == as_text(NEW) and as_text(OLD)[0] not in lines, (gap_turns, lines)


@on_each()
def test_a_transfer_cut_at_any_byte_is_repaired(board, display):
    """Until the change is complete, the display shows only the old or the new lean."""
    leans = as_text(OLD)[0], as_text(NEW)[0]
    for byte in range(1, 40, 3):
        check_lines(board, display, OLD, 50)
        board.faults.cut(board.lcd.address, 0.0, byte)
        lines = set()
        display.show(*NEW)
        turns(board, display, 60, lambda lines=lines: lines.add(board.lcd.text()[0]))
        assert board.lcd.text() == as_text(NEW), (byte, board.lcd.text())
        assert all(line in leans or "-" in line or line[:4] in ("?   ", "    ") for line in lines), lines


@on_each()
def test_a_stuck_bus_is_freed(board, display):
    board.lcd_bus.hang(8)
    check_lines(board, display, NEW, 200)


@on_each(kinds=("lcd",))
def test_the_next_initialisation_repairs_an_lcd_out_of_step(board, display):
    lines = set()
    board.lcd.slip()
    display.show(*NEW)
    turns(board, display, 1100, lambda: lines.add(board.lcd.text()[0]))
    assert board.lcd.text() == as_text(NEW) and len(lines) > 2


def test_a_display_is_found_at_each_of_its_addresses():
    for kind, address in (
        ("lcd", 0x20), ("lcd", 0x26), ("lcd", 0x38), ("lcd", 0x3F), ("ssd1306", 0x3C), ("ssd1306", 0x3D),
        ("lcd", None), ("lcd", 0x50),
    ):  # fmt: skip

        def program(board, kind=kind, address=address):
            display = open_display(board)
            if address in (None, 0x50):  # no display, or a wrong address: the loop is not delayed
                display.show(*OLD)
                assert turns(board, display, 200) < 7500 and display.address is None
                display.flush()
                return
            check_lines(board, display, OLD, 400)
            assert display.address == address and display.draws == (kind != "lcd")

        run(program, display=kind, lcd_address=address)


def test_each_kind_and_wiring_of_the_settings_works():
    """Controllers without a useful status, and displays at unusual addresses, need the setting."""
    for kind, wiring in (("lcd", 1), ("lcd", 2), ("lcd", 3), ("lcd", 4), ("ssd1306", 1), ("sh1106", 1)):

        def program(board, kind=kind, wiring=wiring):
            board.lcd.wiring = wiring
            display = open_display(board, None, kind, wiring)
            for lines in (OLD, NEW):
                check_lines(board, display, lines)
            assert board.lcd.backlight and display.draws == (kind != "lcd")
            board.lcd.power_off()
            board.lcd.power_on()
            check_lines(board, display, NEW)

        run(program, display=kind)


def test_character_displays_without_a_pcf8574_are_driven():
    """A display with I2C in its controller cannot be read, so a loss of power is noticed only by a failed transfer."""
    for kind, address, gone_ms in ((OwnI2c, 0x3E, 300), (Mcp23008, 0x20, 1), (Mcp23008, 0x27, 300)):

        def program(board, kind=kind, address=address, gone_ms=gone_ms):
            board.remove_lcd()
            board.lcd = kind(board.clock)
            board.lcd.address = address
            board.fit_lcd()
            display = open_display(board)
            for lines in (OLD, NEW):
                check_lines(board, display, lines, 400)
            assert board.lcd.backlight and not display.draws and display.address == address
            display.show(*OLD)
            assert turns(board, display, 60) < 12_800
            board.remove_lcd()
            turns(board, display, gone_ms // TURN_MS)
            board.fit_lcd()
            check_lines(board, display, NEW, 400)
            board.remove_lcd()
            turns(board, display, 30)
            board.change_display("lcd")
            check_lines(board, display, OLD, 200)

        run(program)


def test_a_panel_of_32_rows_shows_both_lines():
    """Two lines of letters with 16 rows fill the display. The picture moves down by one or two rows. The last rows of
    the letters are blank, so nothing is lost."""

    def program(board):
        display = open_display(board, None, "ssd1306-32")
        starts = set()
        for lines in (OLD, NEW, OLD):
            display.show(lines[0], lines[1], (lambda canvas: 1 / 0,))
            turns(board, display, 60)
            assert board.lcd.text() == as_text(lines) and not display.draws
        assert board.lcd.rows == 32 and not board.lcd.alternate
        for _ in range(25):
            turns(board, display, 1010)
            starts.add(board.lcd.start_line)
            assert not any(board.lcd.pages()[3][x] & 0x80 for x in range(128))
        assert starts == {0, 62, 63}

    run(program, display="ssd1306")


def test_the_rows_of_a_larger_display_are_blanked():
    """The third and fourth row of a 20x4 display show the memory behind the first two rows. An earlier program may have
    written to the memory behind the rows."""

    def program(board):
        board.lcd.ddram[0x10:0x28] = board.lcd.ddram[0x50:0x68] = b"x" * 24
        display = open_display(board)
        check_lines(board, display, OLD)
        assert bytes(board.lcd.ddram[0x10:0x28]) == bytes(board.lcd.ddram[0x50:0x68]) == b" " * 24
        board.lcd.ddram[0x14] = 0x55  # noise
        turns(board, display, 1100)
        assert board.lcd.ddram[0x14] == 0x20

    run(program)


@on_each()
def test_hundreds_of_unplugs_take_no_memory(board, display):
    """Only MicroPython reports the memory in use, so only a run on MicroPython checks it."""
    count = 300 if sys.implementation.name == "micropython" else 20
    used = []
    for k in range(count):
        board.remove_lcd()
        turns(board, display, 2)
        board.fit_lcd()
        display.show(str(k), "")
        turns(board, display, 3 + k % 30)
        if k % 100 == 50 and hasattr(gc, "mem_alloc"):
            gc.collect()
            used.append(gc.mem_alloc())  # type: ignore[attr-defined]
    turns(board, display, 100)
    assert board.lcd.text()[0].strip() == str(count - 1)
    assert not used or used[-1] - used[0] < 1500, used
