"""The simulated wires of I2C and SPI, with machine.I2C, SoftI2C and Pin: times, errors, and a stuck bus."""

import errno

import pytest
from kickstand_tools.simulated_board.fakes import fake_machine, fake_time
from kickstand_tools.simulated_board.fakes.fake_machine import I2C, SPI, Pin, SoftI2C
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


@firmware(machine="esp32")
def test_soft_i2c_does_not_notice_that_sda_is_held(board):
    """The clock pulses of SoftI2C free the device. If the device keeps holding SDA, SoftI2C reads zeros."""
    i2c, data = SoftI2C(sda=Pin(21), scl=Pin(22)), bytearray(1)
    for bits, freed in ((1, True), (8, True), (60, False)):
        board.sensor_bus.hang(bits)
        data[0] = 0xFF
        error = raised(i2c.readfrom_mem_into, SENSOR, 0x75, data)
        assert (error is not None) == freed and (freed or data == b"\x00"), bits
    while board.sensor_bus.stuck():
        raised(i2c.readfrom_mem_into, SENSOR, 0x75, data)
    assert i2c.readfrom_mem(SENSOR, 0x75, 1) == b"\x68"


@pytest.mark.parametrize(
    ("machine", "pulses_per_s", "during", "after"),
    [("pico", 300, (5, 7), (0, 1)), ("esp32", 300, (0, 0), (5, 7)), ("esp32", 1000, (0, 0), (8, 9))],
)
def test_interrupts_of_an_esp32_wait_for_the_end_of_a_transfer(machine, pulses_per_s, during, after):
    """During a transfer of 10 ms, an ESP32 keeps at most eight interrupts. Their handlers run after the transfer, and
    see the pin's level at that time. On a Pico the handlers run at once."""

    def program(board):
        board.fit_wheel(lambda t_s: 10.0, pulses_per_metre=pulses_per_s / 10.0)
        pins = {"sda": Pin(4), "scl": Pin(5), "freq": 100_000}
        i2c = I2C(0, **pins) if machine == "pico" else SoftI2C(**pins)
        fake_time.sleep_ms(200)
        levels = []
        Pin(board.wheel_pin, Pin.IN, Pin.PULL_UP).irq(lambda pin: levels.append(pin.value()))
        i2c.readfrom_mem_into(SENSOR, 0x3B, bytearray(108))
        count = len(levels)
        fake_time.sleep_us(300)
        late = levels[count:]
        assert during[0] <= count <= during[1] and after[0] <= len(late) <= after[1] and len(set(late)) <= 1

    check(program, machine=machine, sensor_pins=[4, 5])


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
