"""Models a pair of I2C wires with devices on them, and faults of the wires.

A controller (the fake machine.I2C or that of an emulated chip) calls start, write_byte, read_byte and stop, and
advances the time for the bits. Pins that drive the wires directly call set_scl and set_sda.
"""

from .clock import NEVER_US


class TransferFault:
    """A fault in the transfers number `first` to `last` to one address, if they begin between from_us and until_us.

    kind: one of:
        "nack": the transfers are not acknowledged.
        "timeout": the wires are held.
        "cut": in one transfer no byte from number `byte` on is acknowledged.
        "corrupt": in the byte number `byte` that is read, the bits of mask are inverted.
    """

    def __init__(self, kind, address, first, last, from_us=0, until_us=NEVER_US, byte=0, mask=0):
        self.kind = kind
        self.mask = mask
        self._address = address
        self._numbers = (first, last)
        self._times = (from_us, until_us)
        self._byte = byte
        self._count = 0

    def applies(self, address, number, now_us):
        """Return True if the transfer that begins now has this fault."""
        first, last = self._numbers
        start, end = self._times
        return address == self._address and first <= number <= last and start <= now_us < end

    def begin(self, read):
        """Begin after a START. Returns True if the device may answer, False for NACK, None if the wires are held."""
        self._count = 0
        return {"nack": False, "timeout": None}.get(self.kind, True)

    def on_write(self, value):
        """Return the byte that the device receives for `value`, or None if it does not acknowledge.

        Byte 0 is the first byte, usually the register address.
        """
        self._count += 1
        if self.kind != "cut" or self._count <= self._byte:
            return value
        self._numbers = (0, -1)
        return None

    def on_read(self, value):
        """Return the byte that the controller receives when a device sends value."""
        number = self._count
        self._count += 1
        return value ^ self.mask if self.kind == "corrupt" and number == self._byte else value


GOOD, OPEN, LOW = "good", "open", "low"  # states of a wire: good; without pull-up; touching ground


class Bus:
    """A bus.

    sda, scl: numbers of the microcontroller's pins.
    open: True during a transfer.
    sda_wire, scl_wire: GOOD, OPEN or LOW.
    """

    def __init__(self, clock, sda, scl):
        self.clock = clock
        self.sda = sda
        self.scl = scl
        self.sda_wire = self.scl_wire = GOOD
        self.devices = {}  # {address: device}
        self.transfers = {}  # {address: number of transfers so far}
        self.faults = []  # a list of TransferFault
        self._fault = None  # the fault of the current transfer
        self._device = None
        self.open = False
        self._driven_scl = 1
        self._driven_sda = 1
        self._stuck_bits = -1  # zero bits that a hung device still sends; 0: it waits for ACK; -1: no device hangs

    def attach(self, device):
        self.devices[device.address] = device

    def detach(self, device):
        """Disconnect a device, even in the middle of a transfer."""
        self.devices.pop(device.address, None)
        if self._device is device:
            self._device = None

    def max_hz(self):
        return min([400_000] + [getattr(d, "max_hz", 400_000) for d in self.devices.values()])

    # For a controller

    def stuck(self):
        """True while an interrupted device holds SDA low."""
        return self._stuck_bits > 0

    def start(self, address, read):
        """Send START or repeated START, and the address.

        Returns True if a device acknowledges, False if no device does, None if a device holds SDA low.
        """
        if self._stuck_bits > 0 or not self.sda_wire == self.scl_wire == GOOD:
            return None
        self._stuck_bits = -1  # START frees a device that waits for ACK
        if not self.open:
            self.open = True
            number = self.transfers.get(address, 0) + 1
            self.transfers[address] = number
            if self.faults:
                self._fault = self._find_fault(address, number)
        if self._fault is not None:
            answer = self._fault.begin(read)
            if not answer:
                return answer
        self._device = self.devices.get(address)
        return self._device.start(address, read) if self._device else False

    def write_byte(self, value):
        """Send a byte. Returns True if a device acknowledges."""
        if self._device is None:
            return False
        if self._fault is not None:
            value = self._fault.on_write(value)
            if value is None:
                return False
        return self._device.write_byte(value)

    def read_byte(self):
        """Receive a byte. The result is 0xFF if no device pulls the wire low."""
        if self._device is None:
            return 0xFF
        value = self._device.read_byte()
        return value if self._fault is None else self._fault.on_read(value)

    def read_into(self, buf):
        if self._device is not None and self._fault is None and hasattr(self._device, "read_into"):
            self._device.read_into(buf)
            return
        for i in range(len(buf)):
            buf[i] = self.read_byte()

    def stop(self):
        self._device = self._fault = None
        self.open = False

    def hang(self, bits=8):
        """Interrupt a read. The controller stops, and the device holds SDA low for `bits` more clocks."""
        self.stop()
        self._stuck_bits = bits

    def power_off(self):
        self.stop()
        self._stuck_bits = -1

    def _find_fault(self, address, number):
        for fault in self.faults:
            if fault.applies(address, number, self.clock.now_us):
                return fault
        return None

    # For pins

    def scl_level(self, pulled_up=False):
        """Return the level of SCL, 0 or 1. pulled_up: True if the pin's own pull-up is on."""
        return self._level(self._driven_scl, self.scl_wire, pulled_up)

    def sda_level(self, pulled_up=False):
        """Return the level of SDA, 0 if the controller or a device pulls it low. pulled_up: see scl_level()."""
        return self._level(0 if self._stuck_bits > 0 else self._driven_sda, self.sda_wire, pulled_up)

    @staticmethod
    def _level(driven, wire, pulled_up):
        return 0 if wire == LOW or (wire == OPEN and not pulled_up) else driven

    def release(self):
        self.set_scl(1)
        self.set_sda(1)

    def set_scl(self, level):
        """Drive SCL low (0) or release it (1)."""
        edge = level - self._driven_scl
        self._driven_scl = level
        if self._stuck_bits > 0 and edge < 0:
            self._stuck_bits -= 1
        elif self._stuck_bits == 0 and edge > 0:  # the ninth clock: the device sends its next byte if acknowledged
            self._stuck_bits = -1 if self._driven_sda else 9

    def set_sda(self, level):
        """Drive SDA low (0) or release it (1). START and STOP free a device that waits for ACK."""
        if self._stuck_bits == 0 and self._driven_scl and level != self._driven_sda:
            self._stuck_bits = -1
        self._driven_sda = level


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
