"""Driver for an HD44780 character display, 16x2, behind a PCF8574 port expander (the usual I2C backpack).

    lcd = Lcd(lambda: machine.I2C(1, sda=machine.Pin(6), scl=machine.Pin(7), freq=100_000))
    lcd.show("Hello", "world")
    while True:
        lcd.tick(time.ticks_ms())  # sends at most one changed line, or does one step of the initialisation
        time.sleep_ms(10)

Sources: data sheets Hitachi HD44780U (ADE-207-272) and NXP PCF8574. The display is driven in 4-bit mode. The part of a
line that has changed is sent in one transfer, which takes 6 ms for a whole line at 100 kHz. Wiring of the backpack: P0
RS, P1 R/W, P2 E, P3 backlight, P4..P7 D4..D7.
"""

from time import sleep_ms, ticks_diff, ticks_ms

from micropython import const

_RS = const(0x01)  # bits of the port expander
_E = const(0x04)
_LIGHT = const(0x08)
_LINE_ADDRESSES = (0x80, 0xC0)  # instruction "set DDRAM address" for the beginning of each line (table 6)
_CGRAM_ADDRESS = const(0x40)  # instruction "set CGRAM address" (table 6)

ADDRESSES = (0x27, 0x3F)  # PCF8574 and PCF8574A with all address jumpers open
COLUMNS = 16
_DASHES = b"-" * COLUMNS
_NO_TEXT = "\n"
_NEVER = b"\xfe" * COLUMNS  # a character code that no text uses: marks a line as not yet written
REINIT_MS = 10_000  # time between initialisations: noise can put the nibbles out of step, and nothing else repairs that
PROBE_MS = 200  # time between two checks whether a display is connected
REOPEN_PROBES = 5  # while there is no display the bus is freed once in so many checks
STEP_MS = 5  # time between two steps: the longest wait that the initialisation requires is 4.1 ms
_POWER_UP_MS = const(40)  # time after power-up in which the display takes no instruction
_POWER_UP = const(-8)  # the step that the initialisation then begins with

# Initialisation by instruction (data sheet, figure 24), one step a tick, STEP_MS apart, so that the loop never waits.
# First single nibbles, which bring the display into 4-bit mode from whatever state it was in. Then whole bytes:
# function set (4 bit, 2 lines); display on, no cursor; entry mode left to right; return home, which undoes a shift. The
# first three take 37 us each, less than a transfer.
_NIBBLES = (0x30, 0x30, 0x30, 0x20)
_COMMANDS = b"\x28\x0c\x06\x02"
_GLYPH_PARTS = const(4)  # the 64 bytes of character patterns are sent 16 at a time
_STEPS = len(_NIBBLES) + 1 + _GLYPH_PARTS


def _bar_glyphs():
    """64 bytes, the patterns of characters 0 to 7: 1 to 4 of 5 columns filled from the left, then 1 to 4 from the
    right."""
    rows = bytearray()
    for columns in range(1, 5):
        rows.extend(bytes([0x1F & ~(0x1F >> columns)] * 8))
    for columns in range(1, 5):
        rows.extend(bytes([(1 << columns) - 1] * 8))
    return rows


class Lcd:
    """A display that may be absent, or come and go.

    reopen: called to free the bus, returns it as a machine.I2C.  addresses: I2C addresses to look for it at.
    address: where it was found, or None while no display answers.
    """

    def __init__(self, reopen, addresses=ADDRESSES):
        self._reopen = reopen
        self._i2c = None
        self._addresses = addresses
        self._wanted = [bytearray(b" " * COLUMNS), bytearray(b" " * COLUMNS)]
        self._shown = [bytearray(COLUMNS), bytearray(COLUMNS)]
        self._texts = [_NO_TEXT, _NO_TEXT]  # the text that each line showed last, if it was a str
        self._changed = True  # a line may have to be sent
        self._packed = bytearray(4 * (COLUMNS + 1))
        self._port = bytearray(1)
        self._glyphs = _bar_glyphs()
        self.address = None
        # the step of the initialisation; negative while the display, powered with the board, does not listen yet
        self._step = _POWER_UP if ticks_ms() < _POWER_UP_MS else 0
        self._probes = 0  # successive probes that found nothing
        self._acted_ms = None  # when something was last sent
        self._seen_ms = 0  # when the display last answered
        self._init_ms = 0  # when the initialisation last ended

    def show(self, line1, line2):
        """Set the text of the two lines, to be sent by tick(). Each is padded or cut to 16 characters.

        A str of characters below 256, or bytes. Codes 0 to 7 are the patterns of _bar_glyphs(), the others those of
        the display's ROM."""
        self._put(0, line1)
        self._put(1, line2)

    def tick(self, now_ms):
        """Do the next step of the work: at most one line. Call it about every 10 ms. now_ms: ticks_ms().

        Raises SettingsError for pins that cannot be used, and nothing else."""
        if self._acted_ms is not None and ticks_diff(now_ms, self._acted_ms) < (STEP_MS if self.address else PROBE_MS):
            return
        try:
            if self.address is None:
                self._acted_ms = now_ms
                self._probe()
            elif self._step < _STEPS:
                self._acted_ms = now_ms
                if self._step > 0 and not self._kept_power():
                    self._step = _POWER_UP
                if self._step >= 0:
                    self._initialise(self._step)
                self._step += 1
                self._init_ms = self._seen_ms = now_ms
            elif self._changed and self._refresh():  # comes first: the text on the display may be too old
                self._seen_ms = self._acted_ms = now_ms
            elif ticks_diff(now_ms, self._seen_ms) >= PROBE_MS:
                self._seen_ms = self._acted_ms = now_ms
                if not self._kept_power():
                    self._step = _POWER_UP
            elif ticks_diff(now_ms, self._init_ms) >= REINIT_MS:
                self._step = 0
        except OSError:
            self.address = None
            self._step = _POWER_UP

    def flush(self):
        """Send everything now, in about 0.1 s: for texts shown before the loop runs or after it has failed."""
        self._acted_ms = None
        for _ in range(_STEPS - _POWER_UP + 4):
            self.tick(ticks_ms())
            if self.address is None:
                return
            sleep_ms(STEP_MS)

    def _put(self, number, text):
        line = self._wanted[number]
        if isinstance(text, str):
            if text == self._texts[number]:  # mostly so; converting it would take 0.2 ms
                return
            self._texts[number] = text
            for i in range(COLUMNS):
                line[i] = ord(text[i]) & 0xFF if i < len(text) else 0x20
        else:
            self._texts[number] = _NO_TEXT
            for i in range(COLUMNS):
                line[i] = text[i] if i < len(text) else 0x20
        self._changed = True

    def _probe(self):
        """Look for the display at each address."""
        if self._probes % REOPEN_PROBES == 0:  # a stuck bus has to be freed, but to do so each time would take too long
            self._i2c = self._reopen()
        self._probes += 1
        for address in self._addresses:
            try:
                self._i2c.readfrom_into(address, self._port)
            except OSError:
                continue
            self.address = address
            self._probes = 0
            return
        # Not found: if it answers later it was just powered, so it is given its 40 ms.
        self._step = _POWER_UP

    def _initialise(self, step):
        if step < len(_NIBBLES):
            nibble = _NIBBLES[step] | _LIGHT
            self._i2c.writeto(self.address, bytes((nibble | _E, nibble)))
        elif step == len(_NIBBLES):
            for command in _COMMANDS:
                self._send(command, b"")
        else:
            quarter = (step - len(_NIBBLES) - 1) * COLUMNS
            self._send(_CGRAM_ADDRESS + quarter, memoryview(self._glyphs)[quarter : quarter + COLUMNS])
            for shown in self._shown:  # both lines have to be written again
                shown[:] = _NEVER
            self._changed = True

    def _kept_power(self):
        """False if the display lost its power since the last transfer, however short. Raises OSError if it is gone.

        The PCF8574's pins are high after power-up, but every transfer leaves E low. So it must be asked before
        anything is sent."""
        self._i2c.readfrom_into(self.address, self._port)
        return not self._port[0] & _E

    def _refresh(self):
        """Send the changed part of one line; False if no line has changed."""
        for i in (0, 1):
            wanted, shown = self._wanted[i], self._shown[i]
            if shown != wanted:
                if not self._kept_power():
                    self._step = _POWER_UP
                    return True
                first, last = 0, COLUMNS - 1
                while shown[first] == wanted[first]:
                    first += 1
                while shown[last] == wanted[last]:
                    last -= 1
                at = _LINE_ADDRESSES[i] + first
                if last > first:  # a transfer that breaks off must not leave half a number or the wrong side
                    self._send(at, memoryview(_DASHES)[first : last + 1])
                self._send(at, memoryview(wanted)[first : last + 1])
                shown[:] = wanted
                return True
        self._changed = False
        return False

    def _send(self, command, data):
        """Send an instruction and the data that follow it in one transfer."""
        packed = self._packed
        self._pack(0, command, _LIGHT)
        for i in range(len(data)):
            self._pack(4 * (i + 1), data[i], _LIGHT | _RS)
        self._i2c.writeto(self.address, memoryview(packed)[: 4 * (len(data) + 1)])

    def _pack(self, at, value, control):
        """Put a byte into _packed as two nibbles, each with E high and then low: the falling edge latches it.

        RS changes in the byte that raises E: at 100 kHz that is 90 us before E falls."""
        packed = self._packed
        high = value & 0xF0 | control
        low = value << 4 & 0xF0 | control
        packed[at] = high | _E
        packed[at + 1] = high
        packed[at + 2] = low | _E
        packed[at + 3] = low
