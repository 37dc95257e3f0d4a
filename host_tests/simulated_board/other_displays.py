"""Models of character displays that are not behind a PCF8574. Runs on MicroPython too."""

from kickstand_sim.simulated_board.lcd import Lcd


class OwnI2c:
    """A controller with I2C that cannot be read, as an ST7032. A control byte comes first: bit 7 is set if another
    control byte follows the next byte, and bit 6 if characters follow, not commands."""

    address, max_hz, backlight, changes = 0x3E, 400_000, True, 0

    def __init__(self, clock):
        self.power_on()

    def power_on(self):
        self.ram, self.place, self.on, self.in_patterns = bytearray(b" " * 128), 0, False, False

    power_off = power_on

    def start(self, address, read):
        self.is_control = True
        return not read

    def write_byte(self, value):
        if self.is_control:
            self.repeats, self.is_text, self.is_control = value & 0x80, value & 0x40, False
            return True
        if self.is_text:
            if not self.in_patterns:
                self.ram[self.place & 127] = value
            self.place += 1
        elif value & 0xC0:
            self.place, self.in_patterns = value & 0x7F, not value & 0x80
        elif value & 0x38 == 0x08:
            self.on = bool(value & 4)
        if self.repeats:
            self.is_control = True
        return True

    def text(self):
        lines = [self.ram[start : start + 16] if self.on else b" " * 16 for start in (0, 0x40)]
        return ["".join(["\xb0" if code == 0xDF else chr(code) for code in line]) for line in lines]


class Mcp23008(Lcd):
    """An HD44780 behind an MCP23008, as Adafruit's 292: RS GP1, E GP2, D4 to D7 GP3 to GP6, backlight GP7."""

    max_hz = 1_700_000

    def power_on(self):
        super().power_on()
        self.registers, self.pointer = bytearray(b"\xff" + bytes(10)), 0

    def start(self, address, read):
        self.is_pointer = not read
        return True

    def write_byte(self, value):
        if self.is_pointer:
            self.pointer, self.is_pointer = value, False
            return True
        if self.pointer < 11:
            self.registers[self.pointer] = value
        if self.pointer == 9 and not self.registers[0]:
            control = (value >> 1 & 1) | (value & 4) | (value >> 4 & 8)
            super().write_byte(value << 1 & 0xF0 | control)
        self._next()
        return True

    def read_byte(self):
        value = self.registers[self.pointer] if self.pointer < 11 else 0
        self._next()
        return value

    def _next(self):
        if not self.registers[5] & 0x20:
            self.pointer += 1
