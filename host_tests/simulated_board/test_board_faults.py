"""Each fault of the script. Also run under MicroPython."""

import errno
import os

from board_access import firmware, level, on_board, raised
from kickstand_tools.simulated_board.fakes.fake_machine import I2C, Pin


def check(firmware, until_s=30.0, **fitted):
    """The firmware must get to its end."""
    outcome, board = on_board(firmware, until_s, **fitted)
    assert outcome == "returned"
    return board


class Chip:
    """The sensor as a driver sees it."""

    def __init__(self, board, div=0):
        self.i2c = I2C(0, sda=Pin(4), scl=Pin(5), freq=400_000, timeout=5000)
        self.clock = board.clock
        self.set_up(div)

    def set_up(self, div=0):
        self.clock.advance(100_000)
        for register, value in ((0x6B, 1), (0x1B, 0x08), (0x1C, 0x10), (0x1A, 1), (0x19, div)):
            self.i2c.writeto_mem(0x68, register, bytes((value,)))
            self.clock.advance(60_000)

    def read(self, register=0x3B, count=14):
        return list(self.i2c.readfrom_mem(0x68, register, count))

    def error(self):
        """errno of a read, or None."""
        error = raised(self.read)
        return error.args[0] if error else None


def lcd_answers(board):
    return raised(I2C(1, sda=Pin(6), scl=Pin(7), freq=100_000).writeto, 0x27, b"\x08") is None


STILL = [0, 0, 0, 0, 0x10, 0x00]


@firmware()
def test_nack_of_the_nth_transfer(board):
    chip = Chip(board)
    board.faults.nack(0x68, nth=3, count=2)
    assert [chip.error() for _ in range(6)] == [None, None, errno.EIO, errno.EIO, None, None]
    board.faults.nack(0x68)
    assert [chip.error() for _ in range(2)] == [errno.EIO, None]


@firmware()
def test_nack_for_a_time_and_only_at_that_address(board):
    chip = Chip(board)
    now_s = board.clock.now_us / 1e6
    board.faults.nack_for(0x68, now_s + 0.1, 0.2)
    seen = []
    for _ in range(4):
        seen.append(chip.error())
        assert lcd_answers(board)
        board.clock.advance(110_000)
    assert seen == [None, errno.EIO, errno.EIO, None], seen


@firmware()
def test_time_out(board):
    chip = Chip(board)
    board.faults.timeout(0x68, nth=2)
    assert chip.error() is None
    start = board.clock.now_us
    assert chip.error() == errno.ETIMEDOUT
    assert 5000 <= board.clock.now_us - start < 5100
    assert chip.error() is None
    board.faults.timeout_for(0x68, board.clock.now_us / 1e6, 0.012)
    assert [chip.error() for _ in range(4)] == [errno.ETIMEDOUT] * 3 + [None]


@firmware()
def test_a_corrupted_byte(board):
    chip = Chip(board)
    good = chip.read()
    assert good[:6] == STILL
    board.faults.corrupt(0x68, nth=2, byte=4, mask=0x81)
    assert chip.read() == good
    assert chip.read() == good[:4] + [good[4] ^ 0x81] + good[5:]
    assert chip.read() == good


@firmware()
def test_a_corrupted_write(board):
    chip = Chip(board)
    board.faults.corrupt(0x68, byte=1, mask=0x10, read=False)
    chip.i2c.writeto_mem(0x68, 0x1B, b"\x08")
    assert chip.read(0x1B, 1) == [0x18]


def test_a_bit_slip():
    def bits(data):
        return "".join([f"{value:08b}" for value in data])

    def firmware(board):
        chip = Chip(board)
        good = bits(chip.read())
        assert good[8 * 2] == "1" and good[8 * 4] == "0"
        for byte in (2, 4):
            board.faults.bit_slip(0x68, byte=byte)
            first = 8 * byte
            assert bits(chip.read()) == good[: first + 1] + good[first:-1]
            assert bits(chip.read()) == good

    check(firmware, world=lambda t_s: (0.123, -1.1, 1.0, 99.0, -77.0, 1.0))


def test_supply_dip():
    def firmware(board, leaves, z):
        chip = Chip(board)
        assert chip.read()[:6] == STILL
        board.faults.supply_dip(board.clock.now_us / 1e6 + 0.5, leaves)
        board.clock.advance(490_000)
        assert chip.read()[:6] == STILL
        board.clock.advance(100_000)
        assert chip.read()[4:6] == z
        assert chip.read(0x1B, 2) == [0, 0]
        chip.set_up()
        assert chip.read()[:6] == STILL

    check(lambda board: firmware(board, "asleep", [0, 0]))
    check(lambda board: firmware(board, "frozen", [0x10, 0x00]))
    check(lambda board: firmware(board, "default_ranges", [0x40, 0x00]))


def moving(t_s):
    return (t_s / 100, 0.0, 1.0, t_s, 0.0, 0.0)


@firmware(world=moving)
def test_frozen_data(board):
    chip = Chip(board)
    now_s = board.clock.now_us / 1e6
    board.faults.freeze(now_s + 0.1, 1.0)
    before = chip.read()
    board.clock.advance(200_000)
    held = chip.read()
    assert held != before
    board.clock.advance(800_000)
    assert chip.read() == held
    assert chip.read(0x6B, 1) == [1] and chip.read(0x1B, 1) == [0x08]
    board.clock.advance(200_000)
    assert chip.read() != held


@firmware()
def test_all_zero_and_all_ones(board):
    chip = Chip(board)
    now_s = board.clock.now_us / 1e6
    board.faults.all_zero(now_s + 0.1, 0.1)
    board.faults.all_ones(now_s + 0.3, 0.1)
    seen = []
    for _ in range(5):
        board.clock.advance(50_000)
        seen.append(chip.read()[4:6])
        board.clock.advance(49_000)
    assert seen == [[0x10, 0], [0, 0], [0x10, 0], [0xFF, 0xFF], [0x10, 0]], seen


@firmware()
def test_sensor_unplugged_and_back(board):
    chip = Chip(board)
    now_s = board.clock.now_us / 1e6
    board.faults.unplug_sensor(now_s + 0.1, 0.5)
    assert chip.error() is None
    board.clock.advance(200_000)
    assert chip.error() == errno.EIO
    board.clock.advance(500_000)
    assert chip.read(0x6B, 1) == [0x40] and chip.read()[:6] == [0] * 6
    chip.set_up()
    assert chip.read()[:6] == STILL
    board.faults.unplug_sensor(board.clock.now_us / 1e6)
    board.clock.advance(10_000_000)
    assert chip.error() == errno.EIO


@firmware()
def test_lcd_unplugged_and_back(board):
    board.lcd.on = True
    board.lcd.ddram[0] = ord("x")
    assert board.lcd.text()[0][0] == "x"
    board.faults.unplug_lcd(0.1, 0.5)
    board.clock.advance(200_000)
    assert not lcd_answers(board) and board.lcd.text()[0] == " " * 16
    board.clock.advance(500_000)
    assert lcd_answers(board) and board.lcd.text()[0] == " " * 16


def test_files():
    def read(mode="rb"):
        with open("kickstand_board_test.cal", mode) as file:
            return file.read()

    def firmware(board):
        with open("kickstand_board_test.cal", "wb") as file:
            file.write(b"record")
        with open("kickstand_board_test.txt", "wb") as file:
            file.write(b"other")
        board.faults.file_error(".cal", 0.1, 0.1)
        board.faults.file_empty(".cal", 0.3, 0.1)
        assert read() == b"record"
        board.clock.advance(150_000)
        error = raised(read)
        assert isinstance(error, OSError) and error.args[0] == errno.EIO
        with open("kickstand_board_test.txt", "rb") as file:
            assert file.read() == b"other"
        board.clock.advance(100_000)
        assert read() == b"record"
        board.clock.advance(100_000)
        assert read() == b"" and read("r") == ""
        with open("kickstand_board_test.cal", "wb") as file:
            file.write(b"written")
        board.clock.advance(100_000)
        assert read() == b"written"

    try:
        check(firmware)
    finally:
        os.remove("kickstand_board_test.cal")
        os.remove("kickstand_board_test.txt")


def test_uninstalling_ends_file_faults():
    real = open

    def firmware(board):
        board.faults.file_error(".cal", 0.1, 100.0)
        board.clock.advance(200_000)
        assert open is not real

    check(firmware, world=level)
    assert open is real
