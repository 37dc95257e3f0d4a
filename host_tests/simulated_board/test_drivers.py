"""The firmware's small drivers: the button, the SD card, an OLED's letters, and the differences between boards."""

import errno
import types

import framebuf  # pyright: ignore[reportMissingImports] the simulated board has it
import pytest
from kickstand_sim.simulated_board.clock import Clock
from kickstand_sim.simulated_board.contacts import Button as Contact
from kickstand_sim.simulated_board.fakes.fake_machine import SPI, Pin
from kickstand_sim.simulated_board.simulator import Board
from support.board_access import level, on_board

SHORT, LONG = "short", "long"
SECTORS = bytes(range(256)) * 2, b"\x55" * 512, b"\xaa" * 512


@pytest.mark.parametrize(
    ("closed_ms", "events"),
    [
        ([(100, 400)], [(420, SHORT)]),
        ([(100, 890)], [(910, SHORT)]),  # a press is long from 800 ms on
        ([(100, 1500)], [(920, LONG)]),
        ([(100, 300), (500, 1500), (1600, 1700)], [(320, SHORT), (1320, LONG), (1720, SHORT)]),
        ([(100 + 20 * k, 110 + 20 * k) for k in range(5)] + [(400, 500)], [(520, SHORT)]),  # bounces are no presses
        ([(100, 200), (210, 400)], [(420, SHORT)]),
        ([(0, 1500), (1600, 1700)], [(1720, SHORT)]),  # a press that began before the firmware is ignored
    ],
)
def test_presses_of_the_button(closed_ms, events):
    def program(board):
        from kickstand.board.button import LONG as long_press, Button

        clock = Clock()
        contact = Contact(clock)
        for begin_ms, end_ms in closed_ms:
            contact.turn(True, 1000 * begin_ms)
            contact.turn(False, 1000 * end_ms)
        clock.advance(0)
        button = Button(types.SimpleNamespace(value=lambda: 0 if contact.closed else 1))
        assert button.held() == (closed_ms[0][0] == 0)
        result = []
        for now_ms in range(0, 3000, 10):
            clock.advance(1000 * now_ms - clock.now_us)
            event = button.poll(now_ms)
            if event:
                result.append((now_ms, LONG if event == long_press else SHORT))
        assert result == events

    assert on_board(program)[0] == "returned"


def test_only_a_hard_interrupt_keeps_room_for_its_exceptions(monkeypatch):
    """Without this room, MicroPython ends the interrupt after an exception."""

    def program(board):
        from kickstand.speed.wheel import Wheel

        monkeypatch.setattr("micropython.alloc_emergency_exception_buf", sizes.append)
        for hard in (False, True):
            Wheel(Pin(14, Pin.IN, Pin.PULL_UP), 0.5, {"hard": hard}, [])

    sizes = []
    assert on_board(program)[0] == "returned" and sizes == [100]


def on_card(program, removed=False, **kind):
    """Run program(board) on a board with this SD card."""
    board = Board(level)
    board.fit_card(**kind)
    vars(board.card)["removed"] = removed
    with board:
        assert board.run(lambda: program(board), 100.0) == "returned"


def opened():
    from kickstand.board.sd_card import checked_card

    return checked_card(SPI(0), Pin(17))


def test_sectors_are_written_and_read_again():
    def program(board):
        card = opened()
        card.writeblocks(7, SECTORS[0])
        card.writeblocks(8, b"".join(SECTORS[1:]))
        assert [board.card.data.get(number) for number in (6, 7, 8, 9, 10)] == [None, *SECTORS, None]
        data = bytearray(1024)
        card.readblocks(8, data)
        assert bytes(data) == b"".join(SECTORS[1:]) and board.card.most_hz == 10_000_000
        assert [card.ioctl(op, 0) for op in (4, 5)] == [4096, 512]

    on_card(program, sectors=4096)


@pytest.mark.parametrize("count", [1, 3])
def test_a_rejected_sector_is_an_error_and_ends_the_write(count):
    """The next write works again."""

    def program(board):
        card = opened()
        board.card.rejects = 1
        with pytest.raises(OSError) as raised:
            card.writeblocks(7, b"".join(SECTORS[:count]))
        assert raised.value.args[0] == errno.EIO and board.card.data == {}
        card.writeblocks(7, b"".join(SECTORS[:count]))
        assert [board.card.data[7 + i] for i in range(count)] == list(SECTORS[:count])

    on_card(program)


def test_a_card_may_be_busy_for_half_a_second_but_not_for_ever():
    def program(board):
        card = opened()
        begin_us = board.clock.now_us
        board.card.busy_next_s = 0.5
        card.writeblocks(7, SECTORS[0])
        assert 0.5e6 <= board.clock.now_us - begin_us < 0.6e6
        board.card.stuck = True
        begin_us = board.clock.now_us
        with pytest.raises(OSError) as raised:
            card.writeblocks(7, SECTORS[0] + SECTORS[1])
        assert raised.value.args[0] == errno.ETIMEDOUT and 1.0e6 <= board.clock.now_us - begin_us < 2.5e6

    on_card(program)


PINS = types.SimpleNamespace(SD_SPI=0, SD_SCK=18, SD_MOSI=19, SD_MISO=16, SD_CS=17)


@pytest.mark.parametrize(
    ("kind", "pins", "reason"),
    [
        ({"driver": False}, {}, ("no-driver",)),
        ({"removed": True}, {}, ("no-card", "no SD card")),
        ({}, {"SD_CS": 99}, ("no-card",)),
    ],
)
def test_any_fault_of_the_cards_driver_is_a_card_error(kind, pins, reason):
    """Another error would restart the board again and again."""

    def program(board):
        from kickstand.board import sd_card
        from kickstand.errors import Refusal

        with pytest.raises(Refusal) as raised:
            sd_card.mount(types.SimpleNamespace(**vars(PINS) | pins))
        assert raised.value.args[: len(reason)] == reason

    on_card(program, **kind)


def on_canvas(draw):
    """Call draw(oled, canvas), where oled is the driver's module. Return the canvas and its pixels."""
    pixels, result = bytearray(1024), []

    def program(board):
        from kickstand.board import oled

        result.append(oled.Canvas(pixels))
        draw(oled, result[0])

    assert on_board(program)[0] == "returned"
    return result[0], pixels


def test_letters_of_an_oled():
    """The bars' patterns fill a letter from either side. Letters of double height have each row twice."""
    for code, columns in enumerate(
        ("##......", "####....", "######..", "########", "......##", "....####", "..######")
    ):
        _, pixels = on_canvas(lambda oled, canvas, code=code: oled.character(canvas, code, 0, 0))
        assert pixels == bytes([0xFF if column == "#" else 0 for column in columns]) + bytes(1016)
    canvas, pixels = on_canvas(lambda oled, canvas: canvas.tall("L\xffe", 2))
    plain = framebuf.FrameBuffer(bytearray(1024), 128, 64, framebuf.MONO_VLSB)
    plain.text("L", 0, 0, 1)
    for x in range(8):
        assert [canvas.pixel(x, 16 + y) for y in range(16)] == [plain.pixel(x, y // 2) for y in range(16)]
    assert all(canvas.pixel(x, y) for x in range(8, 16) for y in range(16, 32))
    assert not any(pixels[:256]) and not any(pixels[512:])
    canvas, _ = on_canvas(lambda oled, canvas: canvas.tall("\xff", 2, True))
    assert [canvas.pixel(x, 31) for x in (7, 8, 127)] == [0, 1, 1]
