"""Emulates a Pico with the parts that are wired to it, for tests, bench, replay and `kickstand emulate`."""

from collections.abc import Callable
from typing import Any

from kickstand_sim.simulated_board.i2c import Bus
from kickstand_tools.deploy import firmware_files
from rp2040py.gpio_pin import GPIOPinState
from rp2040py.memory_map import RAM_START_ADDRESS
from rp2040py.peripherals.peripheral import BasePeripheral
from rp2040py.peripherals.usb import RPUSBController
from rp2040py.usb.cdc import USBCDC

from . import flash_image, image
from .chip import EmulatedChip, EmulatedClock, PowerCut
from .device import EmulatedDevice
from .i2c_wires import Wires


class QuietConsole(USBCDC):
    """The board's USB console, for a host that sends nothing while it has no data.

    rp2040py's USB host answers every ready buffer with an empty packet, unlike a real host. The Pico would spend two
    thirds of its time on 34,000 empty packets per second.

    received: Function that is called with the board's output.
    """

    def __init__(self, usb: RPUSBController, received: Callable[[bytes], None]) -> None:
        super().__init__(usb)
        self._others = usb.on_endpoint_read
        self._armed: list[int] = []  # sizes of the buffers that are ready for data
        self._waiting = bytearray()
        usb.on_endpoint_read = self._on_armed
        self.on_serial_data = lambda data: received(bytes(data))

    def send(self, data: bytes) -> None:
        self._waiting += data
        self._give()

    def _on_armed(self, endpoint: int, size: int) -> None:
        if endpoint == self._out_endpoint:
            self._armed.append(size)
            self._give()
        elif self._others:
            self._others(endpoint, size)

    def _give(self) -> None:
        while self._armed and self._waiting:
            size = self._armed.pop(0)
            packet = bytes(self._waiting[:size])
            del self._waiting[:size]
            self.usb.endpoint_read_done(self._out_endpoint, packet)

    def _on_controller_reset(self) -> None:
        super()._on_controller_reset()
        self._armed = []
        self._waiting = bytearray()


_PLACE = 0x40068  # address of the registers, shifted right by 12 bits. On the real chip the address is reserved
_COUNT, _FILL, _TAKE = 0x0, 0x4, 0x8

GUEST = """
from machine import mem32
from uctypes import addressof
class Source:
    def __init__(self):
        self.buffer = bytearray(512)
        self.address = addressof(self.buffer)
        self.view = memoryview(self.buffer)
    def read(self, count):
        mem32[0x40068000] = count
        mem32[0x40068004] = self.address
        return self.view[:mem32[0x40068000]]
class Sink:
    def write(self, data):
        mem32[0x40068000] = len(data)
        mem32[0x40068008] = addressof(data)
"""


class HostLink(BasePeripheral):
    """The registers of the link.

    source: Bytes that Source.read() on the Pico returns, in this order.
    sink: Function that is called with the bytes that the Pico's code passes to Sink.write().
    """

    def __init__(self, chip: EmulatedChip, source: bytes, sink: Callable[[bytes], Any]) -> None:
        super().__init__(chip.rp2040, "HOST_LINK")
        self._source = source
        self._sink = sink
        self._at = self._count = 0
        chip.rp2040.peripherals[_PLACE] = self

    def read_uint32(self, offset: int) -> int:
        """Return the number of bytes that the last FILL copied."""
        return self._count

    def write_uint32(self, offset: int, value: int) -> None:
        """COUNT sets the number of bytes that FILL copies to the address `value` in RAM, or TAKE copies from it."""
        start = value - RAM_START_ADDRESS
        if offset == _COUNT:
            self._count = value
        elif offset == _FILL:
            data = self._source[self._at : self._at + self._count]
            self._at += len(data)
            self._count = len(data)
            self.rp2040.sram[start : start + len(data)] = data
        elif offset == _TAKE:
            self._sink(bytes(self.rp2040.sram[start : start + self._count]))


class Pico(EmulatedDevice):
    """An emulated Pico. See EmulatedDevice."""

    NAME, FLASH, MPY, SINK = "Pico", flash_image.PICO, firmware_files.PICO, GUEST

    def __init__(
        self, world: Callable[[float], tuple] | None = None, files: dict[str, bytes] | None = None, **fitted: Any
    ) -> None:
        self.chip = EmulatedChip(image.find())
        super().__init__(EmulatedClock(self.chip.clock), world, **fitted)
        self._wires = [self._wired(bus) for bus in self.board.buses]
        for bus in self.board.buses:
            self.chip.connect(bus.sda // 2 % 2, bus)
        self.console = QuietConsole(self.chip.rp2040.usb_ctrl, self._received)
        self.chip.on_reset = self._chip_reset
        self.put_files(files or {})

    # Power and time

    @property
    def time_s(self) -> float:
        return self.chip.clock.nanos / 1e9

    def power_on(self) -> None:
        self._reset()
        self.board.power_on()
        self.chip.power_on()
        self.powered = True

    def power_off(self) -> None:
        self.powered = False
        self.chip.power_off()
        self.board.power_off()
        self._reset()

    def run(self, seconds: float, between: Callable[[], None] | None = None) -> None:
        """Advance the time. After a PowerCut this method returns early, and `powered` is False."""
        if not self.powered:
            self.chip.sleep(seconds)
            return
        try:
            self.chip.run(seconds, between)
        except PowerCut:
            self.power_off()

    @property
    def reading(self) -> bool:
        return self.chip.controllers[0].reading()

    def reset(self) -> None:
        self.chip.reset()

    def stop(self) -> None:
        self.chip.stop()

    def stall(self, seconds: float) -> None:
        """Advance the time while the processor is stopped, as during a long flash operation.

        A program never starts such an operation in an I2C transfer, so this waits for a millisecond without one.
        """
        previous, buses = None, self.board.buses
        while previous != (begun := [dict(bus.transfers) for bus in buses]) or any(bus.open for bus in buses):
            previous = begun
            self.run(0.001)
        self.chip.sleep(seconds)

    # The flash

    @property
    def file_system(self) -> bytes:
        return bytes(self.chip.rp2040.flash[self.FLASH.start : self.FLASH.start + self.FLASH.size])

    @file_system.setter
    def file_system(self, system: bytes) -> None:
        self.chip.rp2040.flash[self.FLASH.start : self.FLASH.start + self.FLASH.size] = system

    # The console

    def listen(self, sink: Callable[[bytes], Any]) -> None:
        HostLink(self.chip, b"", sink)

    def send(self, data: bytes) -> None:
        self.console.send(data)

    # The wires

    def _wired(self, bus: Bus) -> Wires:
        sda, scl = (self.chip.rp2040.gpio[pin] for pin in (bus.sda, bus.scl))
        wires = Wires(bus, *(lambda level, pin=pin: pin.set_input_value(bool(level)) for pin in (sda, scl)))

        def changed(*_: object) -> None:
            wires.driven(*(0 if pin.value == GPIOPinState.LOW else 1 for pin in (sda, scl)))

        sda.add_listener(changed)
        scl.add_listener(changed)
        return wires

    def _set_pin(self, number: int, level: int) -> None:
        pin = self.chip.rp2040.gpio[number]
        if level:
            pin.release_input()
        else:
            pin.set_input_value(False)

    def _chip_reset(self) -> None:
        self.resets += 1
        self._reset()

    def _reset(self) -> None:
        self._raw = False
        for wires in self._wires:
            wires.release()
