"""Connects the I2C devices to GPIO pins, bit by bit.

rp2040py emulates only the I2C controllers, but software also drives the pins directly. MicroPython drives the pins for
SoftI2C and for writes of length 0, as in I2C.scan(). The firmware drives the pins to free a stuck bus.
"""

from collections.abc import Callable

from kickstand_sim.simulated_board.i2c import Bus

_IDLE, _LISTENS, _SENDS = 0, 1, 2


class Wires:
    """Follows the levels that the chip drives on two pins, and sets the pins' inputs to the answers of the devices.

    set_sda, set_scl: functions that are called with the new level when the level of SDA or SCL changes.

    The board has pull-ups, so a wire is high unless the chip or a device pulls it low.
    """

    def __init__(self, bus: Bus, set_sda: Callable[[int], None], set_scl: Callable[[int], None]) -> None:
        self._bus, self._set_sda, self._set_scl = bus, set_sda, set_scl
        self._sda = self._scl = -1
        self.release()

    def release(self) -> None:
        """Record that the chip drives neither pin, for example after its reset."""
        self._driven_sda = self._driven_scl = 1
        self._pull = 0  # 1 while a device pulls SDA low
        self._mode = _IDLE
        self._bit = self._byte = 0
        self._address = True
        self._bus.release()
        self.show()

    def driven(self, sda: int, scl: int) -> None:
        """Record the levels that the chip drives. 0 pulls a wire low, and 1 releases it."""
        if scl != self._driven_scl:
            self._driven_scl = scl
            self._bus.set_scl(scl)
            if scl:
                self._clock_rises()
            else:
                self._clock_falls()
        if sda != self._driven_sda:
            self._driven_sda = sda
            self._bus.set_sda(sda)
            if scl and sda:  # STOP
                self._mode = _IDLE
                self._bus.stop()
            elif scl:  # START
                self._mode, self._address, self._bit, self._byte = _LISTENS, True, 0, 0
        self.show()

    def _clock_rises(self) -> None:
        self._bit += 1
        if self._mode == _LISTENS and self._bit <= 8:
            self._byte = self._byte << 1 | self._driven_sda
        elif self._mode == _SENDS and self._bit == 9 and self._driven_sda:
            self._mode = _IDLE  # wait for a START, because the chip does not acknowledge the last byte that it reads

    def _clock_falls(self) -> None:
        if self._mode == _LISTENS and self._bit == 8:
            self._pull = self._pass_on()
        elif self._bit == 9:
            self._next_byte()
        elif self._mode == _SENDS:
            self._pull = 0 if self._bit == 8 or self._byte >> (7 - self._bit) & 1 else 1

    def _pass_on(self) -> int:
        """Pass the received byte to the bus. Returns 1 if the device acknowledges the byte."""
        if not self._address:
            return 1 if self._bus.write_byte(self._byte) else 0
        return 1 if self._bus.start(self._byte >> 1, bool(self._byte & 1)) else 0

    def _next_byte(self) -> None:
        if self._address and self._pull and self._byte & 1:  # an acknowledged address, to read
            self._mode = _SENDS
        self._address = False
        self._bit = 0
        self._byte = self._bus.read_byte() if self._mode == _SENDS else 0
        self._pull = 1 if self._mode == _SENDS and not self._byte & 0x80 else 0

    def show(self) -> None:
        """Set only the inputs that have changed, because rp2040py treats a repeated level as an edge."""
        scl, sda = self._bus.scl_level(), 0 if self._pull else self._bus.sda_level()
        if scl != self._scl:
            self._scl = scl
            self._set_scl(scl)
        if sda != self._sda:
            self._sda = sda
            self._set_sda(sda)
