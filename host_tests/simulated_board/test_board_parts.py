"""The firmware's small drivers one by one: the button, the SD card, an OLED's letters, and an ESP32's heap."""

import errno
import gc
import importlib
import sys
import types

import pytest
from kickstand_tools.simulated_board.fakes import chips, framebuf
from kickstand_tools.simulated_board.fakes.fake_machine import SPI, Pin
from support.board_access import on_board

SHORT, LONG = "short", "long"
SECTORS = bytes(range(256)) * 2, b"\x55" * 512, b"\xaa" * 512


def events(held, until_ms, every_ms=10, begin_ms=0):
    """Return [(time, event)] of a button that is held in these stretches [(from, to)], all in ms."""
    now = [begin_ms]
    pin = types.SimpleNamespace(value=lambda: 0 if any(a <= now[0] < b for a, b in held) else 1)
    found = []

    def program(board):
        from kickstand.board import button as driver

        button = driver.Button(pin)
        while now[0] < until_ms:
            event = button.poll(now[0])
            if event:
                found.append((now[0], {driver.SHORT: SHORT, driver.LONG: LONG}[event]))
            now[0] += every_ms

    assert on_board(program)[0] == "returned"
    return found


def test_a_press_is_short_until_800_ms_and_long_once():
    assert events([(100, 400)], 2000) == [(420, SHORT)]
    assert events([(100, 890)], 2000) == [(910, SHORT)]
    assert events([(100, 1500)], 3000) == [(920, LONG)]
    assert events([(100, 300), (500, 1500), (1600, 1700)], 3000) == [
        (320, SHORT),
        (1320, LONG),
        (1720, SHORT),
    ]


def test_bounces_under_20_ms_are_no_presses():
    bounces = [(100 + 20 * k, 110 + 20 * k) for k in range(5)]
    assert events(bounces, 2000) == []
    assert events([*bounces, (200, 300)], 2000) == [(320, SHORT)]
    assert events([(100, 200), (210, 400)], 2000) == [(420, SHORT)]


def test_a_press_that_began_before_the_firmware_is_ignored():
    assert events([(0, 1500), (1600, 1700)], 3000) == [(1720, SHORT)]


def card_driver(board):
    from kickstand.board.spi_card import CheckedCard

    return CheckedCard(SPI(0), Pin(17))


def on_card(program, **kind):
    """Run program(board, card) with the driver of this SD card."""
    from kickstand_tools.simulated_board.simulator import Board

    board = Board(lambda t_s: (0.0, 0.0, 1.0, 0.0, 0.0, 0.0))
    board.fit_card(**kind)
    board.install()
    try:
        assert board.run(lambda: program(board, card_driver(board)), 100.0) == "returned"
    finally:
        board.uninstall()
        sys.modules.pop("kickstand.board.spi_card", None)


def test_sectors_are_written_and_read_again():
    def program(board, card):
        card.writeblocks(7, SECTORS[0])
        card.writeblocks(8, b"".join(SECTORS[1:]))
        assert [board.card.data.get(number) for number in (6, 7, 8, 9, 10)] == [None, *SECTORS, None]
        data = bytearray(1024)
        card.readblocks(8, data)
        assert bytes(data) == b"".join(SECTORS[1:])
        assert board.card.most_hz == 10_000_000

    on_card(program)


@pytest.mark.parametrize("count", [1, 3])
def test_a_rejected_sector_is_an_error_and_ends_the_write(count):
    """The next write works again."""

    def program(board, card):
        board.card.rejects = 1
        with pytest.raises(OSError) as raised:
            card.writeblocks(7, b"".join(SECTORS[:count]))
        assert raised.value.args[0] == errno.EIO
        assert board.card.data == {}
        card.writeblocks(7, b"".join(SECTORS[:count]))
        assert [board.card.data[7 + i] for i in range(count)] == list(SECTORS[:count])

    on_card(program)


def test_a_card_may_be_busy_for_half_a_second_but_not_for_ever():
    def program(board, card):
        begun_us = board.clock.now_us
        board.card.busy_next_s = 0.5
        card.writeblocks(7, SECTORS[0])
        assert 0.5e6 <= board.clock.now_us - begun_us < 0.6e6
        board.card.stuck = True
        begun_us = board.clock.now_us
        with pytest.raises(OSError) as raised:
            card.writeblocks(7, SECTORS[0] + SECTORS[1])
        assert raised.value.args[0] == errno.ETIMEDOUT
        assert 1.0e6 <= board.clock.now_us - begun_us < 2.5e6

    on_card(program)


@pytest.mark.parametrize(
    ("error", "reason"),
    [(ImportError("no module"), "no-driver"), (OSError("no SD card"), "no-card"), (ValueError("bad pin"), "no-card")],
)
def test_any_fault_of_the_cards_driver_is_a_card_error(error, reason, monkeypatch):
    """Another error would restart the board again and again."""
    found = []

    def program(board):
        from kickstand.board import port, sd_card
        from kickstand.errors import CardError

        def opened(*_pins):
            raise error

        monkeypatch.setattr(port, "open_sd_card", opened)
        pins = types.SimpleNamespace(SD_SPI=0, SD_SCK=18, SD_MOSI=19, SD_MISO=16, SD_CS=17)
        with pytest.raises(CardError) as raised:
            sd_card.mount(pins)
        found.append(raised.value.args)

    assert on_board(program)[0] == "returned"
    assert found[0][0] == reason
    assert reason == "no-driver" or str(error) in found[0]


def oled():
    """Return the driver's module. The import of the module needs a board's `time`."""
    found = []

    def program(board):
        from kickstand.board import oled

        found.append(oled)

    assert on_board(program)[0] == "returned"
    return found[0]


def columns(code):
    """Return the lit columns of a character that is drawn at the left edge, if each is lit in all eight rows."""
    character = oled().character
    pixels = bytearray(1024)
    character(framebuf.FrameBuffer(pixels, 128, 64, framebuf.MONO_VLSB), code, 0, 0)
    assert set(pixels) <= {0, 0xFF}
    assert not any(pixels[8:])
    return "".join("#" if pixels[x] else "." for x in range(8))


def test_the_bars_patterns_fill_a_letter_from_either_side():
    assert [columns(code) for code in (0, 1, 2, 3)] == ["##......", "####....", "######..", "########"]
    assert [columns(code) for code in (4, 5, 6, 7)] == ["......##", "....####", "..######", "########"]
    assert columns(0xFF) == "########"


def test_letters_of_double_height_have_each_row_twice():
    pixels = bytearray(1024)
    canvas = oled().Canvas(pixels)
    canvas.tall("L\xffe", 2)
    plain = framebuf.FrameBuffer(bytearray(1024), 128, 64, framebuf.MONO_VLSB)
    plain.text("L", 0, 0, 1)
    for x in range(8):
        assert [canvas.pixel(x, 16 + y) for y in range(16)] == [plain.pixel(x, y // 2) for y in range(16)]
    assert all(canvas.pixel(x, y) for x in range(8, 16) for y in range(16, 32))
    assert not any(pixels[:256]) and not any(pixels[512:])
    canvas.fill(0)
    canvas.tall("\xff", 2, True)
    assert [canvas.pixel(x, 31) for x in (7, 8, 127)] == [0, 1, 1]


def test_a_picture_is_redrawn_only_for_other_values():
    drawn = []

    def program(board):
        from time import sleep_ms, ticks_ms  # type: ignore[attr-defined]

        from kickstand.board import i2c_bus
        from kickstand.board.display import Display

        def draw(canvas, width, label):
            drawn.append((width, label))
            canvas.fill_rect(0, 0, width, 8, 1)

        display = Display(lambda hz: i2c_bus.open_i2c(1, 6, 7, hz))
        for width in (3, 3, 5):
            display.show("a", "b", (draw, width, "x"))
            for _ in range(60):
                display.tick(ticks_ms())
                sleep_ms(10)
            row = board.lcd.pixels()[0]
            assert row == 0xFF << 8 - width & 0xFF

    assert on_board(program, 100.0, display="ssd1306")[0] == "returned"
    assert drawn == [(3, "x"), (5, "x")]


@pytest.mark.parametrize(("free", "turns"), [(1_000_000, 50), (100_000, 10), (61_000, 3), (0, 3)])
def test_garbage_is_collected_more_often_in_a_small_heap(free, turns, monkeypatch):
    """One pass of the loop uses 2000 bytes of heap. Between two collections, the passes may use half of the present
    free heap. The heap may still grow by 60 KB."""
    from kickstand.board import port

    heap = types.SimpleNamespace(HEAP_DATA=4, idf_heap_info=lambda _: [(9, 9, 20_000, 9), (9, 9, 60_000, 9)])
    monkeypatch.setitem(sys.modules, "esp32", heap)
    monkeypatch.setattr(gc, "mem_free", lambda: free, raising=False)
    assert port.turns_to_collect(50) == 50
    monkeypatch.setattr(port, "IS_ESP32", True)
    assert port.turns_to_collect(50) == turns


def fresh_port(monkeypatch, machine):
    """Return the module of the differences between boards, as a board of this kind imports it."""
    monkeypatch.setitem(chips.MACHINES, "tested", machine)
    found = []

    def program(board):
        from kickstand.board import port

        found.append(importlib.reload(port))

    try:
        assert on_board(program, machine="tested")[0] == "returned"
        return types.SimpleNamespace(**vars(found[0]))
    finally:
        assert on_board(program)[0] == "returned"  # the board of the other tests is a Pico


CLASSIC = (1, 3, 6, 7, 8, 9, 10, 11)


@pytest.mark.parametrize(
    ("chip", "taken"),
    [
        ("ESP32", CLASSIC),
        ("ESP32-UNICORE", CLASSIC),
        ("ESP32-PICO-D4", CLASSIC),
        ("ESP32-D2WD", CLASSIC),
        ("ESP32-S2", (19, 20)),
        ("ESP32S3", (19, 20)),
        ("ESP32C3", (18, 19)),
        ("ESP32C6", (12, 13)),
        ("ESP32H2", (26, 27)),
        ("ESP32P4", ()),
    ],
)
def test_pins_that_the_chip_needs_are_taken(chip, taken, monkeypatch):
    """An output on a pin that the chip itself needs would stop the board. Only a classic chip has pins without
    outputs."""
    port = fresh_port(monkeypatch, f"Some board with {chip}")
    assert port.IS_ESP32 and port.TAKEN_PINS == taken
    assert port.INPUT_PINS == ((34, 35, 36, 37, 38, 39) if taken == CLASSIC else ())
    assert port.SENSOR_PINS == port.LCD_PINS == port.GPS_PINS == (None, None)  # an unknown board has no usual pins
    assert port.BUTTON_PIN is port.WHEEL_PIN is None


@pytest.mark.parametrize(
    ("machine", "sensor", "gps", "button"),
    [
        ("Generic ESP32 module with ESP32", (21, 22), (17, 16), 4),
        ("Generic ESP32 module with SPIRAM with ESP32", (21, 22), (None, None), 4),
        ("Raspberry Pi Pico with RP2040", (4, 5), (8, 9), 15),
        ("Another board with RP2040", (None, None), (None, None), None),
    ],
)
def test_known_boards_have_usual_pins(machine, sensor, gps, button, monkeypatch):
    port = fresh_port(monkeypatch, machine)
    assert (port.SENSOR_PINS, port.GPS_PINS, port.BUTTON_PIN) == (sensor, gps, button)


@pytest.mark.parametrize(
    ("entries", "opened"),
    [
        ([("lib", 0x4000, 0, 0), ("sd", 0x4000, 0)], 0),
        # The listing has a folder in flash, and another mounted file system
        ([("sd", 0x4000, 0, 0), ("other", 0x4000, 0)], 1),
    ],
)
def test_a_card_is_mounted_once(entries, opened, monkeypatch):
    calls = []

    def program(board):
        from kickstand.board import port, sd_card

        there = types.SimpleNamespace(ilistdir=lambda _: entries, mount=lambda *given: calls.append(given))
        monkeypatch.setattr(sd_card, "os", there)
        monkeypatch.setattr(port, "open_sd_card", lambda *_: "card")
        pins = types.SimpleNamespace(SD_SPI=0, SD_SCK=18, SD_MOSI=19, SD_MISO=16, SD_CS=17)
        assert sd_card.mount(pins) == "/sd"

    assert on_board(program)[0] == "returned"
    assert calls == [("card", "/sd")] * opened


def test_the_usual_backpack_needs_no_setting():
    def program(board):
        from kickstand.board.hd44780 import Lcd
        from kickstand.board.i2c_bus import open_i2c

        driver = Lcd()
        driver.show("a", "b")
        driver.begin(open_i2c(1, 6, 7, 100_000), 0x27, 100_000, True)
        while driver.busy:
            driver.tick(board.clock.now_us // 1000)
            board.clock.advance(10_000)
        assert [line.rstrip() for line in board.lcd.text()] == ["a", "b"] and board.lcd.backlight

    assert on_board(program, 10.0)[0] == "returned"
