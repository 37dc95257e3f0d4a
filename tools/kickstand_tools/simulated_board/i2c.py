"""A pair of I2C wires with devices on them: who answers, and what the wires' own faults do.

A controller (the fake machine.I2C, or an emulated chip's) calls start, write_byte, read_byte, stop; how long
the bits take is the controller's to know. Pins call set_scl and set_sda.
"""


class Bus:
    """sda, scl: numbers of the pins it is wired to. open: a transfer is under way."""

    def __init__(self, clock, sda, scl):
        self.clock = clock
        self.sda = sda
        self.scl = scl
        self.devices = {}  # by address
        self.transfers = {}  # by address: how many were begun
        self.faults = []  # faults.TransferFault
        self._fault = None  # of the transfer under way
        self._device = None
        self.open = False
        self._driven_scl = 1
        self._driven_sda = 1
        self._stuck_bits = -1  # zero bits a hung device has still to send; 0: waits for ACK; -1: none hangs

    def attach(self, device):
        """Solder a device on."""
        self.devices[device.address] = device

    def detach(self, device):
        """Take it off, also in the middle of a transfer."""
        self.devices.pop(device.address, None)
        if self._device is device:
            self._device = None

    def max_hz(self):
        """The clock of the slowest device."""
        return min([400_000] + [getattr(d, "max_hz", 400_000) for d in self.devices.values()])

    # For a controller

    def start(self, address, read):
        """START or repeated START, and address. True: acknowledged. False: not. None: the wires are held."""
        if self._stuck_bits > 0:
            return None
        self._stuck_bits = -1  # a device that waits for its ACK gives up at a START
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
        """True: acknowledged."""
        if self._device is None:
            return False
        if self._fault is not None:
            value = self._fault.on_write(value)
        return self._device.write_byte(value)

    def read_byte(self):
        """0xFF where nothing pulls the wire down."""
        if self._device is None:
            return 0xFF
        value = self._device.read_byte()
        return value if self._fault is None else self._fault.on_read(value)

    def stop(self):
        """STOP: the transfer is over."""
        if self._device is not None:
            self._device.stop()
        self._device = self._fault = None
        self.open = False

    def hang(self, bits=8):
        """The controller is gone in the middle of a read: a device holds SDA low for `bits` more clocks."""
        self.stop()
        self._stuck_bits = bits

    def power_off(self):
        """Whatever was going on is over."""
        self.stop()
        self._stuck_bits = -1

    def _find_fault(self, address, number):
        for fault in self.faults:
            if fault.applies(address, number, self.clock.now_us):
                return fault
        return None

    # For pins

    def scl_level(self):
        """0 or 1."""
        return self._driven_scl

    def sda_level(self):
        """0 or 1: low if anyone pulls it low."""
        return 0 if self._stuck_bits > 0 else self._driven_sda

    def set_scl(self, level):
        """Drive SCL low (0) or let it go (1)."""
        edge = level - self._driven_scl
        self._driven_scl = level
        if self._stuck_bits > 0 and edge < 0:
            self._stuck_bits -= 1
        elif self._stuck_bits == 0 and edge > 0:  # the ninth clock: go on with the next byte if acknowledged
            self._stuck_bits = -1 if self._driven_sda else 9

    def set_sda(self, level):
        """Drive SDA low (0) or let it go (1). START and STOP free a device that has let go of SDA."""
        if self._stuck_bits == 0 and self._driven_scl and level != self._driven_sda:
            self._stuck_bits = -1
        self._driven_sda = level
