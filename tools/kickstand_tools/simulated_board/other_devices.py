"""Models other devices on the sensor's bus, in place of the sensor or beside it."""


class Registers:
    """A device with registers and an advancing pointer.

    contents: {register: value}. Other registers read 0.
    writable: the registers that store written values.
    """

    SIZE = 128  # number of registers, after which the pointer restarts

    def __init__(self, address, contents=(), writable=()):
        self.address = address
        self.registers = bytearray(self.SIZE)
        for register, value in dict(contents).items():
            self.registers[register] = value
        self.writable = set(writable)
        self.written = []  # the registers written so far
        self._pointer, self._first = 0, False

    def start(self, address, read):
        """Receive START and address. Returns True to acknowledge."""
        self._first = not read
        return True

    def write_byte(self, value):
        """Receive the register's number, then data. Returns True to acknowledge."""
        if self._first:
            self._pointer, self._first = value % self.SIZE, False
            return True
        self.written.append(self._pointer)
        if self._pointer in self.writable:
            self.registers[self._pointer] = value
        self._pointer = (self._pointer + 1) % self.SIZE
        return True

    def read_byte(self):
        """Return the content of the register at the pointer."""
        value = self.registers[self._pointer]
        self._pointer = (self._pointer + 1) % self.SIZE
        return value


class Ds3231(Registers):
    """A real-time clock that has the MPU6050's address. clock: a Clock."""

    SIZE = 19

    def __init__(self, clock, address=0x68):
        super().__init__(address, {3: 0x03, 4: 0x25, 5: 0x11, 6: 0x26, 0x0E: 0x1C}, range(0x0F))
        self._clock = clock

    def start(self, address, read):
        seconds = self._clock.now_us // 1_000_000 + 42_015
        for register, value in enumerate((seconds % 60, seconds // 60 % 60, seconds // 3600 % 24)):
            self.registers[register] = value // 10 << 4 | value % 10
        return super().start(address, read)
