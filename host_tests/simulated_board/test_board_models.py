"""The models of the simulated board one by one: faults, the radio, the displays' memory, and `machine`."""

import errno
import io
import os
import sys
import time
from typing import Any

import pytest
from kickstand_tools.simulated_board.clock import Clock
from kickstand_tools.simulated_board.fakes import fake_bluetooth, fake_machine, framebuf
from kickstand_tools.simulated_board.fakes.fake_machine import ADC, I2C, SPI, UART, Pin, SoftI2C, Timer
from kickstand_tools.simulated_board.gps import Gps, sentence
from kickstand_tools.simulated_board.oled import Oled
from kickstand_tools.simulated_board.other_devices import Ds3231, Registers
from kickstand_tools.simulated_board.radio import EVENT_S, ROOM, Radio
from support.board_access import firmware, on_board, raised

SENSOR, LCD = 0x68, 0x27


def number(function, *args):
    """Return the number of the OSError that function(*args) raises."""
    error = raised(function, *args)
    assert isinstance(error, OSError)
    return error.args[0]


def sensor_bus(freq=400_000):
    return I2C(0, sda=Pin(4), scl=Pin(5), freq=freq, timeout=5000)


def outcomes(i2c, count=4, address=SENSOR):
    """Return the number of the error of each transfer, or "" for a transfer without an error."""
    found = []
    for _ in range(count):
        error = raised(i2c.readfrom_mem, address, 0x75, 1)
        found.append(error.args[0] if error else "")
    return found


@firmware()
def test_transfers_fail_from_the_nth_on(board):
    i2c = sensor_bus()
    for act, code in ((board.faults.nack, errno.EIO), (board.faults.timeout, errno.ETIMEDOUT)):
        board.sensor_bus.faults.clear()
        act(SENSOR)
        assert outcomes(i2c) == [code, "", "", ""]
        act(SENSOR, 2, 2)
        assert outcomes(i2c) == ["", code, code, ""]
        act(LCD)
        assert outcomes(i2c) == ["", "", "", ""]
        assert not board.sensor_bus.open


@firmware()
def test_transfers_fail_for_a_time(board):
    i2c = sensor_bus()
    for act, code in ((board.faults.nack_for, errno.EIO), (board.faults.timeout_for, errno.ETIMEDOUT)):
        now_s = board.clock.now_us / 1e6
        act(SENSOR, now_s + 0.1, 0.05)
        seen = []
        for until_s in (0.09, 0.105, 0.14, 0.16):
            board.clock.advance(max(0, round((now_s + until_s) * 1e6) - board.clock.now_us))
            seen += outcomes(i2c, 1)
        assert seen == ["", code, code, ""]


@firmware()
def test_one_byte_is_corrupted_or_cut(board):
    i2c = sensor_bus()
    board.faults.corrupt(SENSOR, byte=1, mask=0x81)
    assert [i2c.readfrom_mem(SENSOR, 0x1B, 2) for _ in range(2)] == [b"\x00\x81", b"\x00\x00"]
    board.faults.corrupt(SENSOR, nth=2)
    assert [i2c.readfrom_mem(SENSOR, 0x75, 1) for _ in range(3)] == [b"\x68", b"\x69", b"\x68"]
    board.faults.cut(SENSOR, board.clock.now_us / 1e6, 2)
    board.clock.advance(1)
    assert number(i2c.writeto_mem, SENSOR, 0x1B, b"\x08\x10\x18") == errno.EIO and not board.sensor_bus.open
    assert raised(i2c.writeto_mem, SENSOR, 0x1B, b"\x08\x10\x18") is None


def test_a_fault_ends_where_the_next_part_begins():
    def program(board):
        i2c = sensor_bus()
        board.faults.unplug_sensor(0.1, 0.1)
        board.faults.unplug_lcd(0.1)
        seen = []
        for until_s in (0.09, 0.15, 0.25):
            board.clock.advance(round(until_s * 1e6) - board.clock.now_us)
            seen.append((outcomes(i2c, 1)[0] == "", LCD in board.lcd_bus.devices))
        assert seen == [(True, True), (False, False), (True, False)]

    assert on_board(program)[0] == "returned"


def test_files_fail_while_their_fault_lasts(tmp_path):
    path = tmp_path / "a.cal"
    path.write_text("whole")

    def program(board):
        for act, outcome in ((board.faults.file_error, OSError), (board.faults.file_empty, "")):
            at_s = board.clock.now_us / 1e6 + 0.1
            act(".cal", at_s, 0.1)
            assert open(path).read() == "whole"
            board.clock.advance(150_000)
            if outcome is OSError:
                assert isinstance(raised(open, path), OSError)
            else:
                assert open(path).read() == "" and open(path, "rb").read() == b""
            board.clock.advance(100_000)
            assert open(path).read() == "whole"
        board.faults.disk_full(board.clock.now_us / 1e6 + 0.1, 0.1)
        board.clock.advance(150_000)
        with open(tmp_path / "b", "w") as file:
            assert number(file.write, "x") == errno.ENOSPC
        board.clock.advance(100_000)
        with open(tmp_path / "b", "w") as file:
            assert file.write("x") == 1

    assert on_board(program, 10.0)[0] == "returned"
    assert open is io.open


def test_the_power_is_cut_in_the_middle_of_a_file(tmp_path):
    def program(board):
        board.faults.cut_file(".cal", 3)
        with open(tmp_path / "a.txt", "w") as file:
            file.write("whole")
        with open(tmp_path / "a.cal", "w") as file:
            file.write("ab")
            file.write("cdef")

    outcome, board = on_board(program)
    assert (outcome, board.faults.files_cut) == ("off", 1)
    assert ((tmp_path / "a.txt").read_text(), (tmp_path / "a.cal").read_text()) == ("whole", "abc")


def test_each_new_block_of_a_slow_flash_takes_its_time(tmp_path):
    def program(board):
        board.faults.slow_flash(0.0, 100.0, 0.25)
        board.clock.advance(1)
        began_us = board.clock.now_us
        with open(tmp_path / "a", "wb") as file:
            file.write(bytes(10))
            assert board.clock.now_us - began_us == 250_000
            file.write(bytes(4086))
            assert board.clock.now_us - began_us == 250_000
            file.write(bytes(4097))
        assert board.clock.now_us - began_us == 750_000

    assert on_board(program, 10.0)[0] == "returned"


def test_a_busy_processor_loses_time_several_times():
    def program(board):
        board.faults.busy(0.1, 0.05, times=2)
        board.clock.advance(99_000)
        assert board.clock.now_us == 99_000
        board.clock.advance(2_000)
        assert board.clock.now_us >= 150_000
        board.clock.advance(40_000)
        assert board.clock.now_us >= 230_000

    assert on_board(program)[0] == "returned"


class Phone:
    def __init__(self):
        self.heard_data, self.drops = [], 0

    def heard(self, handle, data):
        self.heard_data.append((handle, data))

    def dropped(self):
        self.drops += 1


def connected(pairs=False, secret=None, **config):
    """Return a radio with a service, its phone, and the list of the events that the firmware gets."""
    phone, told = Phone(), []
    radio: Any = Radio(Clock(), pairs)

    def irq(event, data):
        told.append((event, *data))
        return secret if event == 29 else None

    radio.irq, radio.config, radio.active = irq, config, True
    uuid = fake_bluetooth.UUID
    handles = radio.register([(uuid(0x180F), [(uuid(1), 0x02 | 0x08), (uuid(2), 0x02 | 0x0200)])])
    assert not radio.connect(phone)  # the radio does not advertise yet
    radio.found = b"advertised"
    assert radio.connect(phone) and not radio.connect(Phone())
    return radio, phone, told, handles[0]


def test_a_phone_connects_writes_and_disconnects():
    """The numbers of the events are those of MicroPython's `bluetooth`."""
    radio, phone, told, (first, second) = connected()
    assert told == [(1, 0, 0, b"\x01\x02\x03\x04\x05\x06")]
    assert radio.write(first, bytes(range(30))) and told[-1] == (3, 0, first)
    assert radio.read(first) == bytes(range(20))
    assert not radio.write(second, b"x") and radio.read(second) is None
    assert len({first, second}) == 2 and radio.services == [(0x180F, [(1, 0x0A, first), (2, 0x0202, second)])]
    radio.drop()
    assert told[-1][0] == 2 and phone.drops == 1 and radio.phone is None and radio.connections == 1


def test_notifications_come_with_the_next_connection_event():
    radio, phone, _, (first, _) = connected()
    radio.notify(first, b"a")
    radio._clock.advance(round(EVENT_S * 1e6) - 1)
    assert phone.heard_data == []
    radio._clock.advance(1)
    assert phone.heard_data == [(first, b"a")]
    radio.away = True
    radio.notify(first, b"b")
    radio._clock.advance(round(EVENT_S * 1e6))
    assert len(phone.heard_data) == 1
    radio.away = False
    radio._clock.advance(round(EVENT_S * 1e6))
    assert phone.heard_data[1:] == [(first, b"b")]


@pytest.mark.parametrize(("pairs", "kept"), [(True, ROOM), (False, 50)])
def test_an_esp32_keeps_few_notifications(pairs, kept):
    radio, _, _, (first, _) = connected(pairs)
    assert [radio.notify(first, b"x") for _ in range(50)].count(True) == kept


def test_a_phone_that_knows_the_pin_pairs_and_is_known_again():
    radio, _, told, (_, second) = connected(True, mitm=True, bond=True)
    assert told[0] == (29, 2, 0, b"\x01\x02\x03\x04\x05\x06") and not radio.paired
    radio.take_passkey(123456)
    assert not radio.give_pin(111111) and told[-1] == (31, 0, 3, 0)
    assert radio.read(second) is None
    assert radio.give_pin(123456) and told[-1] == (30, 2, b"\x01\x02\x03\x04\x05\x06", b"\x00key")
    assert radio.read(second) == b""
    assert connected(True, secret=b"key", bond=True)[0].paired
    assert not connected(True, secret=b"key")[0].paired


@pytest.mark.parametrize("machine", ["pico w", "esp32"])
def test_bluetooth_has_the_errors_of_the_ports(machine):
    def program(board):
        ble = fake_bluetooth.BLE()
        assert hasattr(ble, "gap_passkey") == (machine == "esp32")
        board.radio.fails = True
        assert number(ble.active, True) == errno.ETIMEDOUT
        board.radio.fails = False
        assert number(ble.gap_advertise, 1) == errno.ENODEV
        assert ble.active(True) and ble.active()
        assert ble.config("mac") == (0, board.radio.address)
        assert isinstance(raised(lambda: ble.config(colour=1)), ValueError)
        assert (raised(lambda: ble.config(bond=True)) is None) == (machine == "esp32")
        assert not ble.gap_disconnect(0)
        assert isinstance(raised(ble.gatts_notify, None, 1), TypeError)
        began_us = board.clock.now_us
        assert number(ble.gatts_notify, 0, 1) == errno.ENOTCONN
        assert board.clock.now_us - began_us == fake_bluetooth.NOTIFY_US
        ble.gap_advertise(1, b"a", resp_data=b"b")
        assert (board.radio.found, board.radio.named) == (b"a", b"b")
        phone = Phone()
        board.radio.connect(phone)
        assert number(ble.gap_advertise, 1) == errno.ENOMEM
        assert ble.gap_disconnect(0) and phone.drops == 1
        assert not ble.active(False)

    assert on_board(program, machine=machine)[0] == "returned"


def commands(oled, *values):
    oled.start(oled.address, False)
    oled.write_byte(0x00)
    for value in values:
        oled.write_byte(value)


@pytest.mark.parametrize(("kind", "supply", "off"), [("ssd1306", (0x8D, 0x14), 0x10), ("sh1106", (0xAD, 0x8B), 0x8A)])
def test_a_panel_is_dark_without_its_own_supply(kind, supply, off):
    oled = Oled(Clock(), kind=kind)
    commands(oled, 0xAF)
    assert not oled.backlight
    commands(oled, 0xAE, *supply, 0xAF)
    assert oled.backlight and oled.read_byte() & 0x40 == 0
    commands(oled, 0xAE, supply[0], off, 0xAF)
    assert not oled.backlight
    commands(oled, 0xAE)
    assert oled.read_byte() & 0x40


@pytest.mark.parametrize("kind", ["ssd1306", "sh1106"])
def test_each_command_takes_its_arguments(kind):
    """After each of these commands and its arguments, the next command is understood. The test shows that no command
    takes too many or too few bytes."""
    for code in (0x81, 0xA8, 0xD3, 0xD5, 0xD9, 0xDA, 0xDB):
        oled = Oled(Clock(), kind=kind)
        commands(oled, code, 0x12, 0x45)
        assert oled.start_line == 5 and oled.unknown == 0, hex(code)
        commands(oled, 0x81, 0x77)
        assert oled.contrast == 0x77
        commands(oled, 0xDA, 0x02)
        assert not oled.alternate
        commands(oled, 0xFF)
        assert oled.unknown == 1


def test_each_change_of_an_oled_is_counted():
    oled = Oled(Clock())
    commands(oled, 0xB0)
    before = oled.changes
    for value, changed in ((0x81, 1), (0x81, 0)):
        commands(oled, 0xB0, 0x00, 0x10)
        mark = oled.changes
        oled.start(oled.address, False)
        oled.write_byte(0x40)
        oled.write_byte(value)
        assert oled.changes - mark == changed
    assert oled.changes > before


@firmware(10.0)
def test_transfers_take_the_time_of_their_bits(board):
    """START, address and STOP take 11 bits, and each byte takes nine."""
    for kind in (sensor_bus(100_000), SoftI2C(sda=Pin(4), scl=Pin(5), freq=100_000)):
        for act, bits in (
            (lambda kind=kind: kind.writeto(SENSOR, b"\x75"), 10 + 9),
            (lambda kind=kind: kind.readfrom(SENSOR, 3), 10 + 27 + 1),
            (lambda kind=kind: kind.readfrom_mem(SENSOR, 0x75, 2), 10 + 9 + 10 + 18 + 1),
        ):
            began_us = board.clock.now_us
            act()
            assert board.clock.now_us - began_us == 10 * bits
            assert not board.sensor_bus.open
    board.sensor_bus.hang(60)
    began_us = board.clock.now_us
    kind.readfrom_into(SENSOR, bytearray(2))
    assert board.clock.now_us - began_us == 10 * (10 + 18 + 1)


@firmware()
def test_parts_that_are_not_there_read_as_open_inputs(board):
    spi = SPI(0, baudrate=1_000_000)
    assert spi.read(3) == b"\xff\xff\xff"
    data = bytearray(2)
    spi.readinto(data)
    assert data == b"\xff\xff"
    began_us = board.clock.now_us
    spi.write(bytes(100))
    assert board.clock.now_us - began_us == 820
    assert ADC(26).read_u16() == 0
    board.volts[26] = 1.65
    assert ADC(Pin(26)).read_u16() == 32767
    board.volts[26] = 5.0
    assert ADC(26).read_u16() == 65535


@firmware(10.0)
def test_a_timer_calls_once_or_again_until_it_is_stopped(board):
    calls = []
    timer = Timer(period=10, mode=Timer.PERIODIC, callback=lambda one: calls.append(board.clock.now_us))
    board.clock.advance(35_000)
    assert calls == [10_000, 20_000, 30_000]
    timer.init(freq=100, mode=Timer.ONE_SHOT, callback=lambda one: calls.append("once"))
    board.clock.advance(50_000)
    assert calls[3:] == ["once"]
    timer.init(period=10, callback=calls.append)
    timer.deinit()
    board.clock.advance(50_000)
    assert len(calls) == 4


@firmware()
def test_pins_are_those_of_the_controllers(board):
    assert isinstance(raised(lambda: I2C(0, sda=Pin(6), scl=Pin(7))), ValueError)
    assert isinstance(raised(lambda: I2C(0, sda=Pin(4), scl=Pin(7))), ValueError)
    assert isinstance(raised(lambda: UART(0, tx=Pin(8), rx=Pin(9))), ValueError)
    assert isinstance(raised(lambda: UART(1, tx=Pin(8), rx=Pin(8))), ValueError)
    assert isinstance(raised(Pin, 60), ValueError) and isinstance(raised(Pin, None), TypeError)
    assert isinstance(raised(lambda: fake_machine.WDT(timeout=8389)), ValueError)
    uart = UART(1, tx=Pin(8), rx=Pin(9))
    uart.write("a\n")
    uart.write(b"b")
    assert board.sent == b"a\nb" and uart.any() == 0 and uart.read(5) is None


def test_a_sentence_ends_with_its_check_sum():
    """The sentence is from a real receiver."""
    body = "GPGGA,092750.000,5321.6802,N,00630.3372,W,1,8,1.03,61.7,M,55.2,M,,"
    assert sentence(body) == f"${body}*76\r\n"


def heard(seconds, **kind):
    """Return [(time of its last byte in s, sentence)] of a receiver."""
    clock, found, text = Clock(), [], []
    gps = Gps(clock, lambda t_s: 10.0 * t_s, **kind)

    def receive(data):
        text.append(data)
        if b"\n" in data:
            *whole, rest = b"".join(text).decode("ascii", "replace").split("\r\n")
            found.extend((clock.now_us / 1e6, one) for one in whole)
            text[:] = [rest.encode()]

    gps.connect(receive)
    clock.advance(round(seconds * 1e6))
    return found


def test_a_receiver_sends_each_fix_late_and_byte_by_byte():
    (time_s, rmc), (_, gsa), (last_s, vtg) = heard(2.0, place=lambda t_s: (-48.5, -11.25))
    assert rmc.startswith("$GPRMC,115941.00,A,4830.00000,S,01115.00000,W,19.438,84.4,211126,,,A*")
    assert gsa.startswith("$GPGSA,A,3,") and vtg.startswith("$GPVTG,84.4,T,,M,19.438,N,36.000,K,A*")
    size = sum(len(one) + 2 for one in (rmc, gsa, vtg))
    assert last_s == pytest.approx(1.0 + 0.2 + size * 10 / 9600, abs=0.001)
    assert 1.2 < time_s < last_s
    faster = heard(1.5, hz=5, latency_s=0.05, baud=115_200, kinds=("RMC",), talker="GN")
    first = next(one for _, one in faster if "RMC" in one)
    assert first.startswith("$GNRMC,115940.20,A,4807.03800,N,01131.00000,E,3.888")
    assert faster[0][0] == pytest.approx(0.25, abs=0.02) and not any("VTG" in one for _, one in faster)
    assert len(faster) in (12, 14)


def test_a_receiver_may_have_no_fix_or_repeat_itself():
    faults = [["void", 2.0, 3.0], ["stuck", 4.0, 5.0]]
    found = [one for _, one in heard(6.6, kinds=("RMC",), faults=faults) if "RMC" in one]
    assert [one.split(",")[2] for one in found] == ["A", "V", "A", "A", "A", "A"]
    assert "V,,,,,,,211126,,,N*" in found[1]
    assert found[3] == found[2] and found[4] != found[3]
    unplugged = heard(4.6, faults=[["unplugged", 1.9, 2.9]])
    assert {int(time_s) for time_s, _ in unplugged} == {1, 3, 4}
    garbled = heard(3.6, kinds=("RMC",), faults=[["garbled", 2.0, 3.0]])
    whole = [text == sentence(text[1:-3]).strip() for _, text in garbled]
    assert whole[:2] == [True, True] and not all(whole)


def test_other_devices_keep_what_is_written():
    device = Registers(0x50, {0: 1, 1: 2, 2: 3}, writable=(1,))
    device.start(0x50, False)
    for value in (1, 9, 9):
        assert device.write_byte(value)
    device.start(0x50, False)
    device.write_byte(0)
    device.start(0x50, True)
    assert [device.read_byte() for _ in range(3)] == [1, 9, 3]
    assert device.written == [1, 2]


def test_a_clock_at_the_sensors_address_counts_in_decimal_digits():
    clock = Clock()
    device = Ds3231(clock)
    for advance_s, digits in ((0, [0x15, 0x40, 0x11]), (50, [0x05, 0x41, 0x11]), (50_000, [0x25, 0x34, 0x01])):
        clock.advance(advance_s * 1_000_000)
        device.start(0x68, False)
        device.write_byte(0)
        device.start(0x68, True)
        assert [device.read_byte() for _ in range(3)] == digits


@pytest.mark.parametrize(
    ("kind", "counts"),
    [
        ("ssd1306", {0x20: 1, 0x21: 2, 0x22: 2, 0x8D: 1, 0x26: 6, 0x27: 6, 0x29: 5, 0x2A: 5, 0xA3: 2, 0x2E: 0}),
        ("sh1106", {0xAD: 1, 0x30: 0, 0x33: 0, 0xE0: 0, 0xEE: 0}),
    ],
)
def test_each_chip_has_commands_of_its_own(kind, counts):
    """Each command has as many arguments as in the data sheet. The other kind of chip ignores the command or does not
    know it."""
    for code, count in counts.items():
        oled = Oled(Clock(), kind=kind)
        commands(oled, code, *([0xFF] * count), 0x45)
        assert (oled.start_line, oled.unknown) == (5, 0), hex(code)


@firmware(10.0)
def test_an_interrupt_comes_at_the_chosen_edge_only(board):
    pin = Pin(board.button_pin, Pin.IN, Pin.PULL_UP)
    for trigger, edges in ((Pin.IRQ_FALLING, {0}), (Pin.IRQ_RISING, {1}), (Pin.IRQ_FALLING | Pin.IRQ_RISING, {0, 1})):
        seen = []
        pin.irq(lambda one, seen=seen: seen.append(board.pin_level(one.id)), trigger)
        board.press()
        board.clock.advance(1_000_000)
        assert set(seen) == edges
    pin.irq(None)
    count = len(seen)
    board.press()
    board.clock.advance(1_000_000)
    assert len(seen) == count


def test_the_real_modules_are_restored():
    before = {name: sys.modules.get(name) for name in ("machine", "time", "os", "sys", "bluetooth", "esp32")}
    seen = []

    def program(board):
        seen.append(hasattr(time, "ticks_ms") and hasattr(os, "ilistdir") and "esp32" in sys.modules)

    assert on_board(program, machine="esp32")[0] == "returned"
    assert seen == [True]
    assert {name: sys.modules.get(name) for name in before} == before
    assert not hasattr(time, "ticks_ms") and not hasattr(os, "ilistdir")


@pytest.mark.parametrize("end", [(9, 3), (3, 9), (9, 9), (0, 5), (5, 0)])
def test_a_line_is_the_same_in_every_direction(end):
    """A line that is mirrored at the picture's middle equals the line that is drawn to the mirrored end."""
    width, height = end

    def pixels(x1, y1, x2, y2):
        canvas = framebuf.FrameBuffer(bytearray(32 * 4), 32, 32, framebuf.MONO_VLSB)
        canvas.line(x1, y1, x2, y2, 1)
        return {(x, y) for x in range(32) for y in range(32) if canvas.pixel(x, y)}

    line = pixels(15, 15, 15 + width, 15 + height)
    assert {(15, 15), (15 + width, 15 + height)} <= line and len(line) == 1 + max(width, height)
    for across, along in ((-1, 1), (1, -1), (-1, -1)):
        found = pixels(15, 15, 15 + across * width, 15 + along * height)
        assert found == {(15 + across * (x - 15), 15 + along * (y - 15)) for x, y in line}
