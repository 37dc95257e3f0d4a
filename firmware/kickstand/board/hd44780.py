"""HD44780 character display, 16x2, behind a PCF8574 port expander (the usual I2C backpack).

    lcd = Lcd(lambda: i2c)
    lcd.show("Lean  23\xdf right", bar)
    lcd.tick()           # at most one changed line, or a step of the initialisation

Everything is sent in 4-bit mode, what has changed of a line packed into one transfer (6 ms at 100 kHz for all of
it). Wiring of the backpack: P0 RS, P1 R/W, P2 E, P3 backlight, P4..P7 D4..D7.
"""

from time import sleep_ms, ticks_diff, ticks_ms

from micropython import const

_RS = const(0x01)
_E = const(0x04)
_LIGHT = const(0x08)
_LINE_ADDRESSES = (0x80, 0xC0)  # "set DDRAM address" of each line
_CGRAM_ADDRESS = const(0x40)

ADDRESSES = (0x27, 0x3F)  # PCF8574 and PCF8574A with all address jumpers open
COLUMNS = 16
_NEVER = b"\xfe" * COLUMNS  # a code that no text uses: a line that is said to hold it will be written again
REINIT_MS = 10_000  # noise can put the nibbles out of step, for ever without this
PROBE_MS = 200
REOPEN_PROBES = 5
STEP_MS = 5  # the longest wait that the initialisation asks for is 4.1 ms
_POWER_UP = const(-8)  # steps: after its power came up a display is deaf for 40 ms

# Initialisation by instruction (data sheet, figure 24). One step a tick, STEP_MS apart, so that the loop
# never waits. First a nibble at a time until the display is in 4-bit mode whatever state it was in, then
# whole bytes: function set 4 bit, 2 lines; display on, no cursor; entry mode left to right; home, which
# undoes a shifted display.
_NIBBLES = (0x30, 0x30, 0x30, 0x20)
_COMMANDS = b"\x28\x0c\x06\x02"
_GLYPH_PARTS = const(4)  # 64 bytes of character patterns, 16 at a time
_STEPS = len(_NIBBLES) + len(_COMMANDS) + _GLYPH_PARTS


def _bar_glyphs():
    """Eight 5x8 patterns: 1 to 4 columns filled from the left, then 1 to 4 from the right."""
    rows = bytearray()
    for columns in range(1, 5):
        rows.extend(bytes([0x1F & ~(0x1F >> columns)] * 8))
    for columns in range(1, 5):
        rows.extend(bytes([(1 << columns) - 1] * 8))
    return rows


class Lcd:
    """A display that may be absent, or come and go.

    reopen: called to free the bus, returns it as a machine.I2C.  addresses: where to look for the display.
    """

    def __init__(self, reopen, addresses=ADDRESSES):
        self._reopen = reopen
        self._i2c = None
        self._addresses = addresses
        self._wanted = [bytearray(b" " * COLUMNS), bytearray(b" " * COLUMNS)]
        self._shown = [bytearray(COLUMNS), bytearray(COLUMNS)]
        self._packed = bytearray(4 * (COLUMNS + 1))
        self._port = bytearray(1)
        self._glyphs = _bar_glyphs()
        self.address = None  # None: no display answers
        self._step = 0
        self._probes = 0
        self._acted_ms = None
        self._seen_ms = 0
        self._init_ms = 0

    def show(self, line1, line2):
        """What the lines should say: str, or bytes for glyphs (0..7) and ROM codes. Padded and cut to 16;
        sent by tick()."""
        self._put(self._wanted[0], line1)
        self._put(self._wanted[1], line2)

    def tick(self, now_ms):
        """Do the next piece of work; call it about every 10 ms. Raises SettingsError for pins that cannot be used, and
        nothing else."""
        if self._acted_ms is not None and ticks_diff(now_ms, self._acted_ms) < (
            STEP_MS if self.address else PROBE_MS
        ):
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
            elif ticks_diff(now_ms, self._seen_ms) >= PROBE_MS:
                self._seen_ms = self._acted_ms = now_ms
                if not self._kept_power():
                    self._step = _POWER_UP
            elif self._refresh():
                self._acted_ms = now_ms
            elif ticks_diff(now_ms, self._init_ms) >= REINIT_MS:
                self._step = 0
        except OSError:
            self.address = None
            self._step = _POWER_UP

    def flush(self):
        """Tick until everything is on the display: before the loop runs, or when it has failed. About 0.1
        s."""
        self._acted_ms = None
        for _ in range(_STEPS + 4):
            self.tick(ticks_ms())
            if self.address is None:
                return
            sleep_ms(STEP_MS)

    def _put(self, line, text):
        for i in range(COLUMNS):
            if i < len(text):
                code = text[i]
                line[i] = code if isinstance(code, int) else ord(code) & 0xFF
            else:
                line[i] = 0x20

    def _probe(self):
        if self._probes % REOPEN_PROBES == 0:  # a stuck bus has to be freed; every time would cost too much
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
        self._step = _POWER_UP  # of one that is there at once the power came up with ours

    def _initialise(self, step):
        if step < len(_NIBBLES):
            nibble = _NIBBLES[step] | _LIGHT
            self._i2c.writeto(self.address, bytes((nibble | _E, nibble)))
        elif step < len(_NIBBLES) + len(_COMMANDS):
            self._send(_COMMANDS[step - len(_NIBBLES)], b"")
        else:
            quarter = (step - len(_NIBBLES) - len(_COMMANDS)) * COLUMNS
            self._send(_CGRAM_ADDRESS + quarter, memoryview(self._glyphs)[quarter : quarter + COLUMNS])
            for shown in self._shown:  # whatever is there now is to be written again
                shown[:] = _NEVER

    def _kept_power(self):
        """False after a loose wire, however short: the pins of a PCF8574 come up high, and E rests low. To be asked
        before anything is sent, because that leaves E low again. OSError: it is gone."""
        self._i2c.readfrom_into(self.address, self._port)
        return not self._port[0] & _E

    def _refresh(self):
        """Send what has changed of one line. False: nothing has."""
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
                self._send(_LINE_ADDRESSES[i] + first, memoryview(wanted)[first : last + 1])
                shown[:] = wanted
                return True
        return False

    def _send(self, command, data):
        """One command byte and the data behind it in one transfer."""
        packed = self._packed
        self._pack(0, command, _LIGHT)
        for i in range(len(data)):
            self._pack(4 * (i + 1), data[i], _LIGHT | _RS)
        self._i2c.writeto(self.address, memoryview(packed)[: 4 * (len(data) + 1)])

    def _pack(self, at, value, control):
        """Two nibbles, each latched by the falling edge of E. RS is set up in the byte that raises E: 90 us
        before it falls."""
        packed = self._packed
        high = value & 0xF0 | control
        low = value << 4 & 0xF0 | control
        packed[at] = high | _E
        packed[at + 1] = high
        packed[at + 2] = low | _E
        packed[at + 3] = low
