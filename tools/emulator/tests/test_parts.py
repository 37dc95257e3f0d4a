"""Parts of the emulated boards, without running a program on them: wires, I2C, flash, file system, console and time."""

import hashlib
import io
import socket

import pytest
from kickstand_emulator import image
from kickstand_emulator.emulate import ConsoleServer
from kickstand_sim.simulated_board.clock import Clock
from kickstand_sim.simulated_board.i2c import Bus
from kickstand_tools.common.messages import InputError

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


def test_one_client_at_a_time_talks_to_the_console():
    received = []
    server = ConsoleServer(received.append, 0)
    server.say(b"to nobody")
    for word in (b"first", b"second"):
        with socket.create_connection(("127.0.0.1", server.port)) as client:
            server.poll()
            server.poll()  # the client stays, because nothing was sent yet
            client.sendall(word)
            while word not in received:
                server.poll()
            server.say(b"hello " + word)
            assert client.recv(100) == b"hello " + word
        for _ in range(3):
            server.poll()  # notices that the client has left
    assert received == [b"first", b"second"]
    with pytest.raises(InputError, match=f"port {server.port} cannot be opened"):
        ConsoleServer(received.append, server.port)
    with socket.create_connection(("127.0.0.1", server.port)) as client:
        client.sendall(b"third")
        while received[-1] != b"third":
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


@pytest.fixture
def cached(tmp_path, monkeypatch):
    """Make the tests' home directory the place of the image. Return the image's path."""
    monkeypatch.setattr(image.importlib.util, "find_spec", lambda name: name)
    monkeypatch.setattr(image.Path, "home", lambda: tmp_path)
    monkeypatch.setattr(image, "SHA256", hashlib.sha256(b"the image").hexdigest())
    return image.path()


def test_the_image_is_downloaded_once(cached, monkeypatch):
    urls = []
    monkeypatch.setattr(image.urllib.request, "urlopen", lambda url, **_: urls.append(url) or io.BytesIO(b"the image"))
    assert image.find() == image.find() == cached
    assert urls == [image.URL]
    assert cached.read_bytes() == b"the image"


def test_another_image_is_refused_and_kept(cached):
    cached.parent.mkdir(parents=True)
    cached.write_bytes(b"another image")
    with pytest.raises(InputError, match="is not the official image: remove it"):
        image.find()
    assert cached.read_bytes() == b"another image"


rp2040 = pytest.importorskip("rp2040py.rp2040")


@pytest.fixture(scope="module")
def chip():
    return rp2040.RP2040()


def nor_flash(chip):
    """Return the flash interface of a new chip, and a function that sends a command to the flash."""
    from kickstand_emulator.chip import TimedFlash
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
    from kickstand_emulator.chip import PowerCut

    flash, send = nor_flash(chip)
    operations = []
    flash.before_operation = lambda: operations.append(flash.operations)
    chip.flash[0x10000:0x30000] = bytes(0x20000)

    def duration_ms(*data):
        begin = chip.clock.nanos
        send(0x06)
        send(*data)
        return (chip.clock.nanos - begin) / 1e6

    assert duration_ms(0x20, 1, 0x10, 0) == pytest.approx(45.0)
    assert set(chip.flash[0x11000:0x12000]) == {0xFF} and chip.flash[0x10FFF] == chip.flash[0x12000] == 0
    assert duration_ms(0xD8, 2, 0, 0) == pytest.approx(150.0)
    assert duration_ms(0x02, 1, 0x10, 0, *b"\x12\x34") == pytest.approx(0.5)
    assert chip.flash[0x11000:0x11003] == b"\x12\x34\xff"
    assert duration_ms(0x9F) == 0.0  # reading the flash's identity takes no time
    assert flash.operations == 3 and operations == [1, 2, 3]
    flash.cut_power(2, 0.5)
    duration_ms(0x02, 1, 0x10, 4, 0x55)
    with pytest.raises(PowerCut):
        duration_ms(0x02, 1, 0x11, 0, 1, 2, 3, 4)
    assert chip.flash[0x11100:0x11104] == b"\x01\x02\xff\xff"
    chip.flash[0x10000:0x30000] = bytes(0x20000)
    for command, size in ((0x20, 4096), (0xD8, 65536)):
        flash, send = nor_flash(chip)
        flash.cut_power(1, 0.25)
        with pytest.raises(PowerCut):
            duration_ms(command, 1, 0, 0)
        assert bytes(chip.flash[0x10000:0x20000]).count(b"\xff") == size // 4


def i2c(chip, *devices):
    """Return a controller with bits of 8 + 12 cycles, and its bus. TX_EMPTY interrupts are configured as by the SDK."""
    from kickstand_emulator.chip import TimedI2C

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
    begin = chip.clock.nanos
    for _ in range(100):
        if condition(controller.read_uint32(RAW_INTERRUPTS)):
            return (chip.clock.nanos - begin) / BIT_NS
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
