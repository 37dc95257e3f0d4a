"""Drivers of character displays that are not behind a PCF8574. display.py finds them and loads this module.

Sources: data sheets Wuxi i-core AiP31068L, Sitronix ST7032, and Microchip MCP23008.
"""

from micropython import const

from .hd44780 import Lcd

# Commands of OwnI2c in the first steps. Every controller gets the commands of the ST7032: oscillator, contrast,
# booster, voltage follower. The others take them for addresses, which the next command replaces. The last step is that
# of an HD44780: display on, entry mode, return home.
_STEPS = (b"\x00\x38", b"\x00\x39\x14\x73", b"\x00\x56\x6c", b"\x00\x38", b"\x00\x0c\x06\x02")
_IODIR, _IOCON, _GPIO = const(0), const(5), const(9)  # registers of an MCP23008
_SAME_REGISTER = const(0x20)  # bit of IOCON: the bytes of a transfer go to one register


class OwnI2c(Lcd):
    """A display whose controller has I2C, at 0x3E: AiP31068L, JHD1802, ST7032 (Waveshare LCD1602, Grove 16x2).

    It cannot be read."""

    def _initialise(self, step):
        if step < len(_STEPS):
            self._i2c.writeto(self._address, _STEPS[step])
        else:
            super()._initialise(step)

    def _kept_power(self):
        self._i2c.writeto(self._address, b"\x00\x0c")  # "display on", because any write shows whether it answers
        return True

    def _send(self, command, data):
        packed, n = self._packed, len(data)
        packed[0] = 0x80  # a command, then another control byte
        packed[1] = command
        packed[2] = 0x40  # characters
        packed[3 : 3 + n] = data
        self._i2c.writeto(self._address, memoryview(packed)[: 3 + n])


class _Expander:
    """An MCP23008 with the methods that Lcd uses of a bus with a PCF8574."""

    def __init__(self, i2c):
        self._i2c = i2c

    def writeto(self, address, levels):
        self._i2c.writeto_mem(address, _GPIO, levels)

    def readfrom_into(self, address, port):
        """Read all pins as high if the chip has lost its settings, as a PCF8574 after power-up."""
        self._i2c.readfrom_mem_into(address, _IOCON, port)
        port[0] = 0 if port[0] == _SAME_REGISTER else 0xFF


class Mcp23008(Lcd):
    """A display behind an MCP23008 (Adafruit 292): RS GP1, E GP2, D4 to D7 GP3 to GP6, backlight GP7."""

    def __init__(self, wiring=1):
        super().__init__()
        self._rs, self._e, self._light, self._shift = 0x02, 0x04, 0x80, 1

    def begin(self, i2c, address, hz, fresh):
        self._bus = i2c
        super().begin(_Expander(i2c), address, hz, fresh)

    def _initialise(self, step):
        if step == 0:
            self._bus.writeto_mem(self._address, _IOCON, bytes((_SAME_REGISTER,)))
            self._bus.writeto_mem(self._address, _IODIR, b"\0")  # all pins are outputs
        super()._initialise(step)
