"""The simulated wires of I2C and SPI, with machine.I2C, SoftI2C and Pin: times, errors, and a stuck bus."""

import errno

import pytest
from kickstand_sim.simulated_board.fakes import fake_machine
from kickstand_sim.simulated_board.fakes.fake_machine import I2C, SPI, Pin, SoftI2C
from support.board_access import firmware, on_board, raised

SENSOR, LCD = 0x68, 0x27


def sensor_bus(freq=400_000, timeout=5000):
    return I2C(0, sda=Pin(4), scl=Pin(5), freq=freq, timeout=timeout)


def check(program, **fitted):
    """Run program(board) on a board, check that it returns, and return the board."""
    outcome, board = on_board(program, **fitted)
    assert outcome == "returned"
    return board


def read_byte(i2c, address=SENSOR):
    """Return the number of the error of a transfer, or "" without an error."""
    error = raised(i2c.readfrom_mem, address, 0x75, 1)
    return error.args[0] if error else ""


@pytest.mark.parametrize(("machine", "pins", "code"), [("pico", (4, 5), errno.EIO), ("esp32", (21, 22), errno.ENODEV)])
def test_a_missing_chip_gives_an_error_at_once(machine, pins, code):
    def program(board):
        i2c = I2C(0, sda=Pin(pins[0]), scl=Pin(pins[1]), freq=400_000)
        begin_us = board.clock.now_us
        assert read_byte(i2c) == code and board.clock.now_us - begin_us == 25

    check(program, sensor_address=None, machine=machine)


@firmware(10.0)
def test_transfers_take_the_time_of_their_bits(board):
    """START, address and STOP take 11 bits, and each byte takes nine."""
    for i2c in (sensor_bus(100_000), SoftI2C(sda=Pin(4), scl=Pin(5), freq=100_000)):
        for transfer, bits in (
            (lambda: i2c.writeto(SENSOR, b"\x75"), 10 + 9),  # noqa: B023 called at once
            (lambda: i2c.readfrom(SENSOR, 3), 10 + 27 + 1),  # noqa: B023
            (lambda: i2c.readfrom_mem(SENSOR, 0x75, 2), 10 + 9 + 10 + 18 + 1),  # noqa: B023
        ):
            begin_us = board.clock.now_us
            transfer()
            assert board.clock.now_us - begin_us == 10 * bits and not board.sensor_bus.open
    spi = SPI(0, baudrate=1_000_000)
    begin_us = board.clock.now_us
    spi.write(bytes(100))
    assert board.clock.now_us - begin_us == 820


def transfer_us(board, i2c, count, code):
    """Return the duration of a burst of `count` bytes. The burst must end with this error, or without one for None."""
    begin_us = board.clock.now_us
    error = raised(i2c.readfrom_mem_into, SENSOR, 0x3B, bytearray(count))
    assert (error.args[0] if error else None) == code, error
    return board.clock.now_us - begin_us


@pytest.mark.parametrize("bits", [1, 5, 8])
def test_a_stuck_bus_times_out_until_it_is_clocked_free(bits):
    """As a driver does: send clock pulses until SDA is high, then STOP."""

    def program(board):
        board.sensor_bus.hang(bits)
        i2c = sensor_bus()
        assert 5000 <= transfer_us(board, i2c, 1, errno.ETIMEDOUT) < 5100 and i2c.scan() == []
        scl, sda = (Pin(number, Pin.OPEN_DRAIN, value=1) for number in (5, 4))
        pulses = 0
        while not sda.value() and pulses < 20:
            scl.value(0)
            scl.value(1)
            pulses += 1
        sda.value(0)
        sda.value(1)
        assert pulses == bits and read_byte(sensor_bus()) == ""

    check(program)


def test_a_reset_in_the_middle_of_a_read_hangs_the_bus():
    def program(board):
        i2c = sensor_bus(100_000)
        board.clock.at(board.clock.now_us + 1000, fake_machine.reset)
        i2c.readfrom_mem_into(SENSOR, 0x3B, bytearray(14))

    outcome, board = on_board(program)
    assert (outcome, board.clock.now_us) == ("reset", 1000)
    assert (board.sensor_bus.sda_level(), board.lcd_bus.sda_level()) == (0, 1)
