"""Emulates a Pico with the parts that are wired to it, for tests, bench, replay and `kickstand emulate`."""

from collections.abc import Callable
from typing import Any

from kickstand_tools.deploy import bytecode
from kickstand_tools.simulated_board.i2c import Bus
from kickstand_tools.simulated_board.simulator import Board
from rp2040py.gpio_pin import GPIOPinState

from . import flash_image, image
from .chip import EmulatedChip, EmulatedClock
from .console import QuietConsole
from .device import LEVEL, EmulatedDevice
from .flash_memory import PowerCut
from .host_link import GUEST, HostLink
from .i2c_wires import Wires


class Pico(EmulatedDevice):
    """An emulated Pico. See EmulatedDevice."""

    NAME, FLASH, MPY, SINK = "Pico", flash_image.PICO, bytecode.PICO, GUEST

    def __init__(
        self, world: Callable[[float], tuple] | None = None, files: dict[str, bytes] | None = None, **fitted: Any
    ) -> None:
        self.chip = EmulatedChip(image.find())
        super().__init__(Board(world or (lambda t_s: LEVEL), clock=EmulatedClock(self.chip.clock), **fitted))
        self._wires = [self._wired(bus) for bus in self.board.buses]
        for bus in self.board.buses:
            self.chip.connect(bus.sda // 2 % 2, bus)
        self.console = QuietConsole(self.chip.rp2040.usb_ctrl, self._received)
        self.chip.on_reset = self._chip_reset
        self.put_files(files or {})

    # Power and time

    @property
    def time_s(self) -> float:
        """The emulated time since this object was created, in s."""
        return self.chip.clock.nanos / 1e9

    def power_on(self) -> None:
        """Switch on the power of the chip and of all parts."""
        self._reset()
        self.board.power_on()
        self.chip.power_on()
        self.powered = True

    def power_off(self) -> None:
        """Cut the power. Only the content of the flash is kept."""
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
        """True while the sensor sends data over I2C."""
        return self.chip.controllers[0].reading()

    def reset(self) -> None:
        """Reset the chip, like an expired watchdog."""
        self.chip.reset()

    def stop(self) -> None:
        """Make run() return after the current instruction."""
        self.chip.stop()

    def stall(self, seconds: float) -> None:
        """Advance the time while the processor is stopped, as during a long flash operation.

        A program never starts such an operation in the middle of an I2C transfer. The method therefore first waits for
        a millisecond without a transfer.
        """
        previous = None
        while previous != (begun := [dict(bus.transfers) for bus in self.board.buses]) or self._transferring():
            previous = begun
            self.run(0.001)
        self.chip.sleep(seconds)

    def _transferring(self) -> bool:
        return any(bus.open for bus in self.board.buses)

    # The flash

    @property
    def file_system(self) -> bytes:
        """The part of the flash that holds the files. It can be assigned."""
        return bytes(self.chip.rp2040.flash[self.FLASH.start : self.FLASH.start + self.FLASH.size])

    @file_system.setter
    def file_system(self, system: bytes) -> None:
        self.chip.rp2040.flash[self.FLASH.start : self.FLASH.start + self.FLASH.size] = system

    # The console

    def listen(self, sink: Callable[[bytes], Any]) -> None:
        HostLink(self.chip, b"", sink)

    def send(self, data: bytes) -> None:
        """Send data to the board's console as fast as the board accepts data."""
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
