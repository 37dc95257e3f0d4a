"""Drivers of character displays that are not behind a PCF8574. display.py finds them and loads this module.

Sources: data sheets Wuxi i-core AiP31068L, Sitronix ST7032, and Microchip MCP23008.
"""

from micropython import const

from .hd44780 import Lcd

# Commands of OwnI2c in each step. Every controller gets the commands of the ST7032: oscillator, contrast, booster,
# voltage follower. The others take them for addresses, which the next command replaces.
_WAKE = (b"\x00\x38", b"\x00\x39\x14\x73", b"\x00\x56\x6c", b"\x00\x38")
_IODIR, _IOCON, _GPIO = const(0), const(5), const(9)  # registers of an MCP23008
_SAME_REGISTER = const(0x20)  # bit of IOCON: the bytes of a transfer go to one register


class OwnI2c(Lcd):
    """A display whose controller has I2C, at 0x3E: AiP31068L, JHD1802, ST7032 (Waveshare LCD1602, Grove 16x2).

    It cannot be read."""

    COMMANDS = b"\x0c\x06\x02"  # display on, entry mode, return home, as for an HD44780

    def _wake(self, step):
        self._write(_WAKE[step])

    def _kept_power(self):
        self._write(b"\x00\x0c")  # "display on", because any write shows whether the display answers
        return True

    def _send(self, command, data):
        packed, n = self._packed, len(data)
        packed[0] = 0x80 if n else 0  # a command and another control byte, or only commands
        packed[1] = command
        packed[2] = 0x40  # characters
        packed[3 : 3 + n] = data
        self._write(memoryview(packed)[: 3 + n if n else 2])


class Mcp23008(Lcd):
    """A display behind an MCP23008 (Adafruit 292): RS GP1, E GP2, D4 to D7 GP3 to GP6, backlight GP7."""

    def __init__(self, wiring=1):
        super().__init__()
        self._rs, self._e, self._light, self._shift = 0x02, 0x04, 0x80, 1

    def _wake(self, step):
        if step == 0:
            self._i2c.writeto_mem(self._address, _IOCON, bytes((_SAME_REGISTER,)))
            self._i2c.writeto_mem(self._address, _IODIR, b"\0")
        super()._wake(step)

    def _write(self, levels):
        self._i2c.writeto_mem(self._address, _GPIO, levels)

    def _kept_power(self):
        self._i2c.readfrom_mem_into(self._address, _IOCON, self._port)
        return self._port[0] == _SAME_REGISTER
