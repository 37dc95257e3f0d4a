"""Every display driver passes the same tests, on the simulated model of its own display. The tests also run on
MicroPython."""

import gc
import sys

from kickstand_tools.simulated_board.lcd import Lcd
from support.board_access import on_board

OLEDS = ("ssd1306", "sh1106")
KINDS = ("lcd",) + OLEDS
BUS_HZ = (None, 100_000)
TURN_MS = 10
LONGEST_US = 7500  # longest time of the transfers in a pass of 10 ms
OLD, NEW = ("Lean  19\xdf right", "first"), ("Lean  28\xdf left", "second line")


def as_text(lines):
    # Pad the lines by hand, because MicroPython's %-16s counts a degree sign as two bytes.
    return [line.replace("\xdf", "\xb0") + " " * (16 - len(line)) for line in lines]


def open_display(board, hz=None, kind="auto", wiring=1):
    from kickstand.board import i2c_bus
    from kickstand.board.display import Display

    return Display(lambda rate: i2c_bus.open_i2c(1, 6, 7, rate), hz, kind, wiring=wiring)


def turns(board, display, count, after=lambda: None):
    """Run this many passes of the loop. Return the duration of the longest pass in us."""
    from time import sleep_us, ticks_diff, ticks_ms, ticks_us  # type: ignore[attr-defined]

    longest = 0
    for _ in range(count):
        begun_us = ticks_us()
        display.tick(ticks_ms())
        took_us = ticks_diff(ticks_us(), begun_us)
        longest = max(longest, took_us)
        sleep_us(max(0, 1000 * TURN_MS - took_us))
        after()
    return longest


def on_each(hz=BUS_HZ, kinds=KINDS):
    """Decorate test(board, display), so that it runs with each display. At its start the display shows OLD."""

    def decorated(test):
        def with_each():
            for kind in kinds:
                for rate in hz:

                    def run(board, kind=kind, rate=rate):
                        display = open_display(board, rate)
                        display.show(*OLD)
                        turns(board, display, 60)
                        assert board.lcd.text() == as_text(OLD), (kind, rate, board.lcd.text())
                        test(board, display)

                    outcome, board = on_board(run, 1e6, display=kind)
                    assert outcome == "returned" and not board.too_fast, (kind, rate)

        return with_each

    return decorated


@on_each()
def test_it_shows_the_given_lines_and_their_changes(board, display):
    for lines in (NEW, ("", ""), ("0123456789ABCDEFGHI", "\xff\xff\x7e"), OLD):
        display.show(*lines)
        turns(board, display, 40)
        cut = [line[:16].replace("\xff", "\x01").replace("\x7e", "\x02") for line in as_text(lines)]
        seen = [line.replace("\u2588", "\x01").replace("\u2590", "\x01") for line in board.lcd.text()]
        assert [line.replace("\u2192", "\x02") for line in seen] == cut, (seen, cut)
    assert board.lcd.backlight


@on_each()
def test_no_turn_delays_the_loop(board, display):
    for k in range(20):
        display.show(f"{k * 1234567:016d}", f"{k * 7654321:016d}")
        longest = turns(board, display, 10)
        # An LCD needs longer: dashes first, then the new line
        limit = LONGEST_US if not board.lcd.address == 0x27 else 12_800
        assert longest <= limit, longest


@on_each()
def test_nothing_is_sent_while_nothing_changes(board, display):
    """The driver only checks five times per second that the display answers."""
    address = board.lcd.address
    before = board.lcd_bus.transfers[address]
    for _ in range(20):
        display.show(*OLD)
        turns(board, display, 10)
    assert board.lcd_bus.transfers[address] - before <= 11


@on_each((None,), ("lcd",))
def test_only_the_changed_part_of_a_line_is_sent(board, display):
    """For one changed character an LCD needs four bytes for the position and four for the character. For more
    characters the driver sends twice as many bytes."""
    sent, original = [], board.lcd.write_byte
    board.lcd.write_byte = lambda value: sent.append(value) or original(value)
    for line, count in (("Lean  18\xdf right", 4 * 2), ("Lean   4\xdf left", 2 * 4 * (1 + 9))):
        del sent[:]
        display.show(line, OLD[1])
        turns(board, display, 1)
        assert len(sent) == count, (line, len(sent))


@on_each()
def test_after_any_unplug_it_returns_and_shows_nothing_old(board, display):
    for gap_turns, gone_ms in ((0, 1), (0, 50), (5, 1), (40, 1)):
        display.show(*OLD)
        turns(board, display, 40)
        display.show(*NEW)
        turns(board, display, gap_turns % 7)  # the display may be removed during a transfer of the new lines
        # An LCD is also removed during its initialisation
        for begun in (0, 12) if isinstance(board.lcd, Lcd) else (0,):
            turns(board, display, begun)
            board.remove_lcd()
            board.clock.advance(1000 * gone_ms)
            turns(board, display, gap_turns)
            board.fit_lcd()
        seen = set()

        def see(seen=seen):
            if board.lcd.backlight:
                seen.add(board.lcd.text()[0])

        turns(board, display, 80, see)
        assert board.lcd.text() == as_text(NEW), (gap_turns, board.lcd.text())
        assert as_text(OLD)[0] not in seen, (gap_turns, seen)


@on_each((None,))
def test_a_transfer_cut_at_any_byte_is_repaired(board, display):
    """Until the change is complete, the display shows only the old or the new lean."""
    address = board.lcd.address
    good = as_text(OLD)[0], as_text(NEW)[0]
    for byte in range(1, 40, 3):
        seen = set()
        display.show(*OLD)
        turns(board, display, 50)
        board.faults.cut(address, 0.0, byte)
        display.show(*NEW)
        turns(board, display, 60, lambda seen=seen: seen.add(board.lcd.text()[0]))
        assert board.lcd.text() == as_text(NEW), (byte, board.lcd.text())
        assert all(line in good or "-" in line or line[:4] in ("?   ", "    ") for line in seen), seen


@on_each((None,))
def test_a_stuck_bus_is_freed(board, display):
    board.lcd_bus.hang(8)
    display.show(*NEW)
    turns(board, display, 200)
    assert board.lcd.text() == as_text(NEW)


def test_the_processor_is_reset_in_the_middle_of_a_part():
    """The display keeps its power and its text. The next start of the firmware must replace the text."""
    for kind in KINDS:
        for count in range(1, 12, 2):

            def run(board, kind=kind, count=count):
                display = open_display(board)
                display.show(*OLD)
                turns(board, display, 60)
                display.show(*NEW)
                turns(board, display, count)
                board.lcd_bus.hang(5)
                again = open_display(board)
                again.show("Kickstand", "starting")
                again.flush()
                assert board.lcd.text() == as_text(("Kickstand", "starting")), (kind, count, board.lcd.text())

            assert on_board(run, 1e6, display=kind)[0] == "returned"


@on_each((None,), ("lcd",))
def test_the_next_initialisation_repairs_an_lcd_out_of_step(board, display):
    seen = set()
    board.lcd.slip()
    display.show(*NEW)
    turns(board, display, 1100, lambda: seen.add(board.lcd.text()[0]))
    assert board.lcd.text() == as_text(NEW) and len(seen) > 2


def test_a_wrong_address_and_no_display_do_not_stop_the_loop():
    def run(board):
        display = open_display(board)
        display.show(*OLD)
        assert turns(board, display, 200) < LONGEST_US and display.address is None
        display.flush()

    assert on_board(run, 1e6, lcd_address=None)[0] == "returned"
    assert on_board(run, 1e6, lcd_address=0x50)[0] == "returned"


def test_any_address_of_a_backpack_is_found():
    for address in (0x20, 0x26, 0x38, 0x3F):

        def run(board, address=address):
            display = open_display(board)
            display.show(*OLD)
            turns(board, display, 400)
            assert display.address == address and board.lcd.text() == as_text(OLD)

        assert on_board(run, 1e6, lcd_address=address)[0] == "returned"


def test_both_addresses_of_an_oled_are_found():
    for address in (0x3C, 0x3D):

        def run(board, address=address):
            display = open_display(board)
            display.show(*OLD)
            turns(board, display, 100)
            assert display.address == address and display.draws and board.lcd.text() == as_text(OLD)

        assert on_board(run, 1e6, display="ssd1306", lcd_address=address)[0] == "returned"


def test_the_set_kind_is_used():
    """Controllers without a useful status, and displays at unusual addresses, need the setting."""
    for kind in KINDS:

        def run(board, kind=kind):
            display = open_display(board, None, kind)
            display.show(*OLD)
            turns(board, display, 60)
            assert board.lcd.text() == as_text(OLD) and display.draws == (kind != "lcd")

        assert on_board(run, 1e6, display=kind)[0] == "returned"


@on_each((None,))
def test_a_replaced_display_is_detected(board, display):
    for kind in OLEDS + ("lcd", "lcd", "sh1106"):
        board.change_display(kind)
        display.show(*NEW)
        turns(board, display, 200)
        assert board.lcd.text() == as_text(NEW), kind


@on_each((None,), ("ssd1306",))
def test_a_status_that_is_never_on_leaves_no_oled_dark(board, display):
    board.lcd.read_byte = lambda: 0xFF
    board.remove_lcd()
    board.fit_lcd()
    display.show(*NEW)
    changes = set()
    turns(board, display, 200, lambda: changes.add(board.lcd.on))
    assert board.lcd.text() == as_text(NEW) and board.lcd.on


def test_no_status_leaves_an_oled_dark():
    """The driver recognises the two kinds of controller by their status. The driver sends the supply commands of both
    kinds to every controller. If the driver mistakes one kind for the other, the picture is only two columns off."""
    for kind in OLEDS:
        for identity in range(16):

            def run(board, identity=identity):
                board.lcd.identity = identity
                display = open_display(board)
                display.show(*OLD)
                turns(board, display, 60)
                assert board.lcd.backlight and board.lcd.unknown == 0, identity
                sure = {"ssd1306": (1, 3, 6, 15), "sh1106": (0, 8, 12)}[board.lcd.kind]
                assert identity not in sure or board.lcd.text() == as_text(OLD), identity

            assert on_board(run, 1e6, display=kind)[0] == "returned"


def test_a_panel_of_32_rows_shows_both_lines():
    """Two lines of letters with 16 rows fill the display. The picture moves down by one or two rows. The last rows of
    the letters are blank, so nothing is lost."""

    def run(board):
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
            assert not any(page[x] & 0x80 for page in (board.lcd.pages()[3],) for x in range(128))
        assert starts == {0, 62, 63}

    assert on_board(run, 1e6, display="ssd1306")[0] == "returned"


def test_each_wiring_of_a_backpack_works():
    for wiring in (1, 2, 3, 4):

        def run(board, wiring=wiring):
            board.lcd.wiring = wiring
            display = open_display(board, None, "auto", wiring)
            for lines in (OLD, NEW):
                display.show(*lines)
                turns(board, display, 60)
                assert board.lcd.text() == as_text(lines) and board.lcd.backlight, wiring
            board.lcd.power_off()
            board.lcd.power_on()
            turns(board, display, 60)
            assert board.lcd.text() == as_text(NEW), wiring

        assert on_board(run, 1e6)[0] == "returned"


def test_the_rows_of_a_larger_display_are_blanked():
    """The third and fourth row of a 20x4 display show the memory behind the first two rows. An earlier program may have
    written to the memory behind the rows."""

    def run(board):
        board.lcd.ddram[0x10:0x28] = board.lcd.ddram[0x50:0x68] = b"x" * 24
        display = open_display(board)
        display.show(*OLD)
        turns(board, display, 60)
        assert board.lcd.text() == as_text(OLD)
        assert bytes(board.lcd.ddram[0x10:0x28]) == bytes(board.lcd.ddram[0x50:0x68]) == b" " * 24
        board.lcd.ddram[0x14] = 0x55  # noise
        turns(board, display, 1100)
        assert board.lcd.ddram[0x14] == 0x20

    assert on_board(run, 1e6)[0] == "returned"


@on_each((None,), OLEDS)
def test_an_oled_is_rewritten_no_earlier(board, display):
    board.lcd.ram[200] ^= 0xFF
    noise = board.lcd.ram[200]
    turns(board, display, 800)
    assert board.lcd.ram[200] == noise
    turns(board, display, 210)
    assert board.lcd.ram[200] != noise


@on_each((None,), OLEDS)
def test_an_oled_is_rewritten_every_ten_seconds_and_moves(board, display):
    board.lcd.ram[200] ^= 0xFF
    starts = set()
    for _ in range(25):
        turns(board, display, 1010)
        starts.add(board.lcd.start_line)
        assert board.lcd.on and board.lcd.text() == as_text(OLD), board.lcd.text()
        assert board.lcd.unknown == 0  # the model got no unknown command
    assert starts == {0, 1, 2}


@on_each((None,))
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
