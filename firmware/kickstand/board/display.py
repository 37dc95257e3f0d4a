"""Finds the display on the bus, and loads the driver for its kind.

    display = Display(lambda hz: machine.I2C(1, sda=machine.Pin(6), scl=machine.Pin(7), freq=hz))
    display.show("Hello", "world")
    while True:
        display.tick(time.ticks_ms())  # one step of the work
        time.sleep_ms(10)

A driver (hd44780.Lcd, oled.Oled) has the following members. host_tests/simulated_board/test_display.py tests each
driver.

begin(i2c, address, hz, fresh)  prepares for a display that has just answered. fresh: True if the display may have been
                                powered just now.
show(line1, line2, picture)     stores the lines and the picture to show. A line is bytes, or a str with codes below
                                256, of 16 characters.
tick(now_ms)                    does one step and uses the bus for 3 ms (OLED) or at most 13 ms (LCD). Raises OSError if
                                the display does not answer.
busy                            True while something must still be sent.
draws                           True if the display shows pictures. Other displays show only the two lines. A picture is
                                a tuple (draw, values...). The driver calls draw(canvas, values...) with a blank
                                framebuf.FrameBuffer of 128x64 pixels.

After a loss of power or a failed transfer, the driver sets the display up again. The display stays dark or shows dashes
until its content is correct.
"""

from time import sleep_ms, ticks_diff, ticks_ms

import micropython

from ..errors import attempt
from ..units import const

_OLED_ADDRESSES = const((0x3C, 0x3D))
# 0x27 and 0x3F are the addresses of a backpack's PCF8574 and PCF8574A with all jumpers open
ADDRESSES = (0x27, 0x3F) + _OLED_ADDRESSES
_OWN_I2C = const(0x3E)  # address of a controller with I2C, see other_lcds.py
_FAMILY = tuple(range(0x20, 0x27)) + tuple(range(0x38, 0x3C)) + (_OWN_I2C,)  # other addresses of a backpack
LCD_HZ, OLED_HZ = 100_000, 400_000  # fastest clocks of a PCF8574 and of the OLEDs
DEGREE = "\xdf"  # code of the degree sign in the character ROM of an HD44780
STOPPED = "Kickstand", "stopped"  # text of the display after the firmware has ended
KINDS = ("auto", "lcd", "ssd1306", "sh1106", "ssd1306-32")
_PROBE_MS = const(200)  # time between two searches for a missing display
# Longest time between two searches. While a driver cannot be loaded, the time is doubled, but not beyond MOST_WAIT_MS
MOST_WAIT_MS = 60_000
_REOPEN_PROBES = const(5)  # number of searches without a display after which the bus is freed
# A display found within this time after the start may have been powered together with the board
_POWER_UP_MS = const(40)
_FLUSH_STEPS = const(60)
_STEP_MS = const(5)


class Display:
    """A display that you may plug in or out at any time.

    Args:
        reopen: reopen(hz) frees the bus and returns it as a machine.I2C.
        bus_hz: clock of the bus. None selects the fastest clock that the display allows.
        kind: one of KINDS.
        addresses: addresses at which to look for the display.
        contrast, inverted: see Oled.
        wiring: see Lcd.

    Attributes:
        address: address of the display, or None while no display answers.
        draws: True if the display shows pictures.
    """

    def __init__(self, reopen, bus_hz=None, kind="auto", addresses=ADDRESSES, contrast=255, inverted=False, wiring=1):
        self._reopen = reopen
        self._bus_hz = bus_hz
        self._kind = kind
        self._addresses = addresses
        self._look = contrast, inverted
        self._wiring = wiring
        self._i2c = self._driver = None
        self._wanted = "", "", None
        self._status = bytearray(1)
        self.address = None
        self.draws = False
        self._probes = 0  # number of successive searches that found no display
        self._probed_ms = None
        self._wait_ms = _PROBE_MS
        self._fresh = ticks_ms() < _POWER_UP_MS

    def show(self, line1, line2, picture=None):
        """Set the lines and the picture that tick() will send."""
        self._wanted = line1, line2, picture  # stored for a display that is plugged in later
        if self._driver:
            self._driver.show(line1, line2, picture)

    def tick(self, now_ms):
        """Do the next step of the display's work. Call this method about every 10 ms. now_ms: ticks_ms().

        Raises SettingsError for pins that cannot be used, and nothing else."""
        try:
            if self.address is not None:
                self._driver.tick(now_ms)
            elif self._probed_ms is None or ticks_diff(now_ms, self._probed_ms) >= self._wait_ms:
                first, self._probed_ms = self._probed_ms is None, now_ms
                self._probe(first)
        except OSError:
            self.address = None
            self._probed_ms = now_ms
            self._fresh = True

    def flush(self):
        """Send everything now, in about 0.1 s. Use this method before the loop runs or after the loop has failed."""
        self._probed_ms = None
        for _ in range(_FLUSH_STEPS):
            self.tick(ticks_ms())
            if self.address is None or not self._driver.busy:
                return
            sleep_ms(_STEP_MS)

    def end(self, line1, line2):
        """Show two lines until power-off, because the firmware ends. Raises nothing; Ctrl-C does not interrupt this
        method.

        The display is set up again, because a transfer may have been interrupted."""
        interrupt = getattr(micropython, "kbd_intr", None)  # MicroPython on a computer has no kbd_intr
        if interrupt:
            interrupt(-1)
        try:
            if self._wanted[:2] != (line1, line2):
                self.address = None
                self._fresh = True
                self.show(line1, line2)
                self.flush()
        except Exception:  # ignored, because nothing can report an error after the firmware has ended
            pass
        finally:
            if interrupt:
                interrupt(3)

    def _probe(self, first):
        """Look for the display at each address. The first search at power-on and the only search of flush() ask all
        other addresses of a backpack too, the later searches one of them in turn."""
        if self._probes % _REOPEN_PROBES == 0:  # only at some searches, because freeing a stuck bus takes long
            self._i2c = self._reopen(self._bus_hz or LCD_HZ)
        self._probes += 1
        for address in self._addresses:
            if self._answers(address):
                return
        if self._addresses is ADDRESSES and self._kind in ("auto", "lcd"):
            for k in range(len(_FAMILY) if first else 1):
                if self._answers(_FAMILY[(self._probes + k) % len(_FAMILY)]):
                    return
        # No display was found. A display that answers later has just been powered, and may be another display
        self._fresh = True
        self._wait_ms = _PROBE_MS

    def _answers(self, address):
        try:
            if address == _OWN_I2C:  # a controller with I2C may not answer a read
                self._i2c.writeto(address, b"\1")
            else:
                self._i2c.readfrom_into(address, self._status)
        except OSError:
            return False
        self._probes = 0
        if attempt(None, self._begin, address):  # attempt() reports a missing driver or too little memory
            self._wait_ms = min(2 * self._wait_ms, MOST_WAIT_MS)
        else:
            self.address, self._wait_ms = address, _PROBE_MS
        return True

    def _begin(self, address):
        oled = self._kind[0] == "s" or (self._kind == "auto" and address in _OLED_ADDRESSES)
        if oled:
            from .oled import Oled as Driver

            arguments = (self._kind,) + self._look
        else:
            from .hd44780 import Lcd as Driver

            arguments = (self._wiring,)
            # A PCF8574 puts this byte on its pins, where no wiring has E, and returns it. For an MCP23008 it is the
            # number of a register that is 0
            status = self._status
            self._i2c.writeto(address, b"\1")
            try:
                self._i2c.readfrom_into(address, status)
            except OSError:
                status[0] = 0
            if status[0] != 1 and (address == _OWN_I2C or not status[0]):
                from . import other_lcds

                Driver = other_lcds.OwnI2c if address == _OWN_I2C else other_lcds.Mcp23008
        if type(self._driver) is not Driver:
            self._driver = None  # frees its memory
            self._driver = Driver(*arguments)  # type: ignore[arg-type]
            self._driver.show(*self._wanted)
            self.draws = self._driver.draws
        hz = self._bus_hz or (OLED_HZ if oled else LCD_HZ)
        if hz != (self._bus_hz or LCD_HZ):
            self._i2c = self._reopen(hz)
        self._driver.begin(self._i2c, address, hz, self._fresh)
        self._fresh = False
