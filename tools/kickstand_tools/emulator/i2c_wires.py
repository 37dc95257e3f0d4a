"""The I2C devices as GPIO pins see them, bit by bit: for I2C.scan(), SoftI2C and for freeing a stuck bus.

rp2040py emulates only the controllers. MicroPython drives the pins itself for writes of length 0, as in scan(), and
the firmware does so to free a bus.
"""

from rp2040py.gpio_pin import GPIOPin, GPIOPinState

from ..simulated_board.i2c import Bus

_IDLE, _LISTENS, _SENDS = 0, 1, 2


class Wires:
    """Follows the levels that the chip drives on two pins, answers as the devices do, and sets the pins' inputs.

    The board has pull-ups: a wire that nobody pulls low is high.
    """

    def __init__(self, bus: Bus, sda: GPIOPin, scl: GPIOPin) -> None:
        self._bus, self._sda, self._scl = bus, sda, scl
        self._shown = {sda: -1, scl: -1}
        self.release()
        sda.add_listener(self._changed)
        scl.add_listener(self._changed)

    def release(self) -> None:
        """The chip drives neither pin: to be called after its reset, at which rp2040py calls no listener."""
        self._driven_sda = self._driven_scl = 1
        self._pull = 0  # 1 while a device pulls SDA low
        self._mode = _IDLE
        self._bit = self._byte = 0
        self._address = True
        self._bus.set_scl(1)
        self._bus.set_sda(1)
        self._show()

    def _changed(self, _value: GPIOPinState, _before: GPIOPinState) -> None:
        sda = 0 if self._sda.value == GPIOPinState.LOW else 1
        scl = 0 if self._scl.value == GPIOPinState.LOW else 1
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
            if scl and sda:
                self._mode = _IDLE
                self._bus.stop()
            elif scl:
                self._mode, self._address, self._bit, self._byte = _LISTENS, True, 0, 0
        self._show()

    def _clock_rises(self) -> None:
        self._bit += 1
        if self._mode == _LISTENS and self._bit <= 8:
            self._byte = self._byte << 1 | self._driven_sda
        elif self._mode == _SENDS and self._bit == 9 and self._driven_sda:
            self._mode = _IDLE  # not acknowledged: it was the last byte

    def _clock_falls(self) -> None:
        if self._mode == _LISTENS and self._bit == 8:
            self._pull = self._take()
        elif self._bit == 9:
            self._next_byte()
        elif self._mode == _SENDS:
            self._pull = 0 if self._bit == 8 or self._byte >> (7 - self._bit) & 1 else 1

    def _take(self) -> int:
        """Pass on the byte that has arrived. 1 if it is acknowledged."""
        if not self._address:
            return 1 if self._bus.write_byte(self._byte) else 0
        return 1 if self._bus.start(self._byte >> 1, bool(self._byte & 1)) else 0

    def _next_byte(self) -> None:
        if self._address and self._pull and self._byte & 1:
            self._mode = _SENDS
        self._address = False
        self._bit = 0
        self._byte = self._bus.read_byte() if self._mode == _SENDS else 0
        self._pull = 1 if self._mode == _SENDS and not self._byte & 0x80 else 0

    def _show(self) -> None:
        self._level(self._scl, self._bus.scl_level())
        self._level(self._sda, 0 if self._pull else self._bus.sda_level())

    def _level(self, pin: GPIOPin, level: int) -> None:
        if self._shown[pin] != level:  # rp2040py takes the same level again for an edge
            self._shown[pin] = level
            pin.set_input_value(bool(level))
