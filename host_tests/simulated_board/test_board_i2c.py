"""The simulated wires of I2C, with machine.I2C and machine.Pin."""

import errno

from kickstand_tools.simulated_board.fakes import fake_machine, fake_time
from kickstand_tools.simulated_board.fakes.fake_machine import I2C, Pin, SoftI2C
from support.board_access import firmware, on_board, raised


def open_sensor(freq=400_000, timeout=5000):
    return I2C(0, sda=Pin(4), scl=Pin(5), freq=freq, timeout=timeout)


def check(firmware, **fitted):
    """Run the firmware on a board, check that it returns, and return the board."""
    outcome, board = on_board(firmware, **fitted)
    assert outcome == "returned"
    return board


def test_a_missing_chip_gives_an_error():
    def firmware(board, sda, scl, number):
        i2c = I2C(0, sda=Pin(sda), scl=Pin(scl), freq=400_000)
        start = board.clock.now_us
        error = raised(i2c.readfrom_mem_into, 0x68, 0x75, bytearray(1))
        assert isinstance(error, OSError) and error.args[0] == number
        assert board.clock.now_us - start == 25

    check(lambda board: firmware(board, 4, 5, errno.EIO), sensor_address=None)
    check(lambda board: firmware(board, 21, 22, errno.ENODEV), sensor_address=None, port="esp32")


def transfer_us(board, i2c, count, error_number):
    """Return the duration of a burst of `count` bytes. The burst must end with this error, or without an error for
    None."""
    start = board.clock.now_us
    error = raised(i2c.readfrom_mem_into, 0x68, 0x3B, bytearray(count))
    assert (error.args[0] if error else None) == error_number, error
    return board.clock.now_us - start


@firmware(machine="esp32", i2c_driver="new")
def test_the_new_driver_of_an_esp32_counts_ticks_of_10_ms(board):
    for timeout, ticks in ((5000, 0), (9999, 0), (10_000, 1), (20_000, 2)):
        i2c = I2C(0, sda=Pin(21), scl=Pin(22), timeout=timeout)
        assert transfer_us(board, i2c, 14, None if ticks else errno.ENODEV) == (390 if ticks else 0)
        board.faults.timeout(0x68)
        assert transfer_us(board, i2c, 112, errno.ENODEV) // 10_000 == ticks
        board.sensor_bus.faults.clear()


@firmware(until_s=20.0, machine="esp32", i2c_driver="legacy")
def test_an_esp32s_old_driver_waits_longer_than_the_watchdog(board):
    i2c = I2C(0, sda=Pin(21), scl=Pin(22), timeout=5000)
    assert transfer_us(board, i2c, 14, None) == 390
    board.faults.timeout(0x68)
    assert transfer_us(board, i2c, 112, errno.ETIMEDOUT) // 100_000 == 114


@firmware(machine="esp32")
def test_soft_i2c_does_not_notice_that_sda_is_held(board):
    """The clock pulses of SoftI2C free the device. If the device keeps holding SDA, SoftI2C reads zeros."""
    i2c = SoftI2C(sda=Pin(21), scl=Pin(22))
    for bits, freed in ((1, True), (8, True), (60, False)):
        board.sensor_bus.hang(bits)
        data = bytearray(b"\xff")
        error = raised(i2c.readfrom_mem_into, 0x68, 0x75, data)
        assert (error is not None) == freed, bits
        if not freed:
            assert data == b"\x00"
    while board.sensor_bus.stuck():
        raised(i2c.readfrom_mem_into, 0x68, 0x75, data)
    assert i2c.readfrom_mem(0x68, 0x75, 1) == b"\x68"


def edges_in_a_transfer(machine, pulses_per_s):
    """Return the number of interrupts during a transfer of 10 ms, and the pin's levels at the interrupts in the 0.3 ms
    after it."""
    seen, counted = [], []

    def firmware(board):
        board.fit_wheel(lambda t_s: 10.0, pulses_per_metre=pulses_per_s / 10.0)
        pins = {"sda": Pin(4), "scl": Pin(5), "freq": 100_000}
        i2c = I2C(0, **pins) if machine == "pico" else SoftI2C(**pins)
        fake_time.sleep_ms(200)
        Pin(board.wheel_pin, Pin.IN, Pin.PULL_UP).irq(lambda pin: seen.append(pin.value()))
        i2c.readfrom_mem_into(0x68, 0x3B, bytearray(108))
        counted.append(len(seen))
        fake_time.sleep_us(300)

    check(firmware, machine=machine, sensor_pins=[4, 5])
    return counted[0], seen[counted[0] :]


def test_interrupts_of_an_esp32_wait_for_the_end_of_a_transfer():
    """During a transfer, an ESP32 keeps at most eight interrupts. The interrupts' handlers run after the transfer, and
    see the pin's level at that time. On a Pico the handlers run at once."""
    assert edges_in_a_transfer("pico", 300)[0] in (5, 6, 7)
    during, after = edges_in_a_transfer("esp32", 300)
    assert during == 0 and len(after) in (5, 6, 7) and len(set(after)) == 1
    during, after = edges_in_a_transfer("esp32", 1000)
    assert during == 0 and len(after) in (8, 9)  # one more edge may come after the transfer


def test_a_classic_esp32_crashes_if_a_flash_pin_is_driven():
    def drive(number):
        Pin(number)  # creating a Pin without a mode changes nothing
        Pin(number, Pin.OPEN_DRAIN)

    for machine, number, outcome in (
        ("esp32", 6, "reset"),
        ("lora32", 11, "reset"),
        ("esp32", 12, "returned"),
        ("c3", 6, "returned"),
        ("pico", 6, "returned"),
    ):
        assert on_board(lambda board: drive(number), machine=machine)[0] == outcome  # noqa: B023 called at once

    def read(board):
        assert isinstance(raised(drive, 34), ValueError)
        assert Pin(34, Pin.IN, Pin.PULL_UP).value() == 0  # without a pull-up the pin floats
        assert Pin(33, Pin.IN, Pin.PULL_UP).value() == 1

    check(read, machine="esp32")


def test_a_bus_that_is_too_fast_for_the_display_is_seen():
    def at(freq):
        return lambda board: open_sensor(freq)

    assert check(at(400_000), one_bus=True).too_fast
    assert not check(at(100_000), one_bus=True).too_fast
    assert not check(at(400_000)).too_fast


def pulses_until_free(board):
    """Free the bus as a driver does: send clock pulses until SDA is high, then STOP. Return the number of pulses."""
    scl = Pin(5, Pin.OPEN_DRAIN, value=1)
    sda = Pin(4, Pin.OPEN_DRAIN, value=1)
    count = 0
    while not sda.value() and count < 20:
        scl.value(0)
        scl.value(1)
        count += 1
    sda.value(0)
    sda.value(1)
    return count


def test_a_stuck_bus_times_out_until_it_is_clocked_free():
    def firmware(board, bits):
        board.sensor_bus.hang(bits)
        i2c = open_sensor(timeout=5000)
        start = board.clock.now_us
        error = raised(i2c.readfrom_mem_into, 0x68, 0x75, bytearray(1))
        assert isinstance(error, OSError) and error.args[0] == errno.ETIMEDOUT
        assert 5000 <= board.clock.now_us - start < 5100
        assert i2c.scan() == []
        assert pulses_until_free(board) == bits
        assert open_sensor().readfrom_mem(0x68, 0x75, 1) == b"\x68"

    check(lambda board: firmware(board, 1))
    check(lambda board: firmware(board, 5))
    check(lambda board: firmware(board, 8))


def test_a_reset_in_the_middle_of_a_read_hangs_the_bus():
    def firmware(board):
        i2c = open_sensor(100_000)
        board.clock.at(board.clock.now_us + 1000, fake_machine.reset)
        i2c.readfrom_mem_into(0x68, 0x3B, bytearray(14))

    outcome, board = on_board(firmware)
    assert outcome == "reset"
    assert board.sensor_bus.sda_level() == 0 and board.lcd_bus.sda_level() == 1
    assert board.clock.now_us == 1000
