"""Models an SD card on SPI (SD Physical Layer Simplified Specification, chapter 7)."""

SECTOR = 512
_EMPTY = bytes(SECTOR)
_IDLE = 0x01
_ACCEPTED, _WRITE_ERROR = 0x05, 0x0D  # data responses
_DATA, _MULTIPLE, _STOP = 0xFE, 0xFC, 0xFD  # tokens


class SdCard:
    """An SD card.

    sectors: number of sectors.
    cs: the pin that selects the card.
    init_s: time until the card is ready after CMD0. None: it is never ready.
    read_s: time from the command to the data.
    busy_s: time for which the card is busy after each written sector.
    driver: False if the board lacks the driver.

    These faults can be set at any time:
        rejects: how many of the next writes to reject.
        busy_next_s: time for which the card is busy after the next sector only.
        stuck: True to keep a busy card busy.
        removed: True if no card answers.

    data: {number: content} of the written sectors, except sectors of zeros.
    most_hz: the highest clock rate so far.
    """

    def __init__(self, clock, sectors=1 << 20, cs=17, init_s=0.1, read_s=0.0005, busy_s=0.002, driver=True):
        self.data = {}
        self.cs = cs
        self.driver = driver
        self.rejects = 0
        self.busy_next_s = None
        self.stuck = False
        self.removed = False
        self.busy_s = busy_s
        self.most_hz = 0
        self._sectors = sectors
        self._clock = clock
        self._init_s = init_s
        self._read_s = read_s
        self._ready_us = None  # the time at which the card becomes ready after CMD0
        self._busy_us = 0  # the card is busy until this time
        self._command = b""
        self._answer = b""
        self._at = 0
        self._writing = 0  # the start token of the expected sector, 0 if no sector is expected
        self._taking = 0  # number of bytes of a sector that are still expected, including the checksum
        self._sector = 0
        self._selected = False

    def select(self, level):
        self._selected = not level
        self._command = b""
        if level:
            self._answer = b""

    def exchange(self, data):
        """Receive data, and return the bytes that the card sends at the same time."""
        if not self._selected or self.removed:
            return b"\xff" * len(data)
        # Whole sectors at once, to save time. Shorter data may contain a command, which has 6 bytes.
        if self._taking == SECTOR + 2 and len(data) == SECTOR:
            self._content, self._taking = bytes(data), 2
            return b"\xff" * SECTOR
        remaining = len(self._answer) - self._at
        if remaining >= len(data) > 6:
            self._at += len(data)
            return self._answer[self._at - len(data) : self._at]
        return bytes([self._exchange(value) for value in data])

    def _exchange(self, value):
        """Receive a byte, and return the byte that the card sends at the same time."""
        if self._taking:
            self._taking -= 1
            if not self._taking:
                self._write()
            return 0xFF
        if self._at < len(self._answer) and not self._command and value == 0xFF:
            self._at += 1
            return self._answer[self._at - 1]
        if self._clock.now_us < self._busy_us:
            return 0x00
        if self._writing and not self._command:
            if value == self._writing:
                self._taking = SECTOR + 2
                return 0xFF
            if value == _STOP and self._writing == _MULTIPLE:
                self._writing = 0
                self._answer, self._at = b"\xff", 0
                self._be_busy()
                return 0xFF
        if self._command or value & 0xC0 == 0x40:  # the first byte of a command begins with the bits 01
            self._command += bytes([value])
            if len(self._command) == 6:
                command, self._command = self._command, b""
                self._answer, self._at = self._obey(command[0] & 0x3F, int.from_bytes(command[1:5], "big")), 0
        return 0xFF

    def _obey(self, number, argument):
        """Do a command, and return the bytes of its answer."""
        now_us = self._clock.now_us
        if number == 0:  # GO_IDLE_STATE
            self._ready_us = None if self._init_s is None else now_us + int(self._init_s * 1e6)
            self._writing = 0
            return b"\xff\x01"
        ready = self._ready_us is not None and now_us >= self._ready_us
        state = bytes([0xFF, 0 if ready else _IDLE])
        if number == 8:  # SEND_IF_COND
            return state + b"\x00\x00\x01\xaa"
        if number == 58:  # READ_OCR
            return state + b"\xc0\xff\x80\x00"
        if number == 9:  # SEND_CSD
            size = (self._sectors // 1024 - 1).to_bytes(3, "big")
            return state + b"\xff\xfe\x40" + bytes(6) + size + bytes(6) + b"\xff\xff"
        if number == 17:  # READ_SINGLE_BLOCK
            self._clock.advance(int(self._read_s * 1e6))
            return state + b"\xff\xfe" + self.data.get(argument, _EMPTY) + b"\xff\xff"
        if number in (24, 25):  # WRITE_BLOCK, WRITE_MULTIPLE_BLOCK
            self._sector, self._writing = argument, _DATA if number == 24 else _MULTIPLE
        return state

    def _write(self):
        if self.rejects:
            self.rejects -= 1
            self._answer, self._at = bytes([0xE0 | _WRITE_ERROR]), 0
        else:
            self._keep(self._sector, self._content)
            self._answer, self._at = bytes([0xE0 | _ACCEPTED]), 0
            self._be_busy()
        self._sector += 1
        if self._writing == _DATA:
            self._writing = 0

    def _be_busy(self):
        busy_s, self.busy_next_s = self.busy_next_s or self.busy_s, None
        self._busy_us = 1 << 60 if self.stuck else self._clock.now_us + int(busy_s * 1e6)

    def _keep(self, sector, content):
        if content == _EMPTY:
            self.data.pop(sector, None)
        else:
            self.data[sector] = content

    # For a computer's card reader: a block device for os.VfsFat

    def readblocks(self, number, buf):
        for i in range(len(buf) // SECTOR):
            buf[i * SECTOR : (i + 1) * SECTOR] = self.data.get(number + i, _EMPTY)

    def writeblocks(self, number, buf):
        for i in range(len(buf) // SECTOR):
            self._keep(number + i, bytes(buf[i * SECTOR : (i + 1) * SECTOR]))

    def ioctl(self, op, argument):
        return {4: self._sectors, 5: SECTOR}.get(op, 0)
