"""Corrects rp2040py's I2C controllers, and connects them to the models' buses.

As on the real chip, each bit takes time, an absent device causes EIO at once, and a disabled controller releases the
wires.
"""

from collections.abc import Callable

from kickstand_sim.simulated_board.i2c import Bus
from rp2040py.peripherals import i2c
from rp2040py.rp2040 import RP2040

_CYCLE_NS = 8  # length of a clock cycle at 125 MHz
_POLLED = (i2c.IC_RAW_INTR_STAT, i2c.IC_RXFLR, i2c.IC_TX_ABRT_SOURCE)


class TimedI2C(i2c.RPI2C):
    """rp2040py's I2C controller on a bus of simulated_board. The SCL count registers set the length of a bit.

    The SDK waits for the end of each byte in a loop that only reads registers. Emulating this loop would make a
    transfer ten times as slow on the host. To avoid this, the first read of a register in the loop advances the time to
    the end of the byte. As a result, interrupts are late by up to the duration of a byte.
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
        """Read a register. Some reads advance the time to the end of the byte (see the class)."""
        if self._then is not None and offset in _POLLED:
            self._clock.tick(max(0.0, self._due_ns - self._clock.nanos))
        return super().read_uint32(offset)

    def write_uint32(self, offset: int, value: int) -> None:
        """Write a register. A write that disables the controller during a transfer releases the wires."""
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
