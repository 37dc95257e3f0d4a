"""Runs on the emulated Pico: the app's own loop with a stopwatch in it. bench.py is the host's end of it.

run(detail, seconds, out): the app for so long; with detail, what each stage took in each turn of its loop.
"""

import gc
from array import array
from time import ticks_diff, ticks_us

from kickstand import app as app_module
from kickstand.settings import Settings
from machine import mem16
from uctypes import addressof, bytearray_at

# Name, and which function is timed under it: module, class ("" for none), function.
STAGES = (
    ("decode", "mpu6050", "Mpu6050", "take"),
    ("calibrate and rotate", "transform", "Transform", "apply"),
    ("filter", "lean_filter", "LeanFilter", "update"),
    ("meter", "meter", "LeanMeter", "update"),
    ("fetch", "sensor", "Sensor", "fetch"),
    ("take", "sensor", "Sensor", "take"),
    ("page", "screen", "Screen", "lines"),
    ("display", "hd44780", "Lcd", "tick"),
)
BUS = len(STAGES)  # one more column: the sensor's transfers
COLUMNS = BUS + 1
SETTLE_TURNS = 150  # before anything is recorded
HEAP_TURNS = 5  # with the collector off
MAX_PAUSES = 2000
MAX_TURNS_HZ = 200


class Config:
    """config.py, as far as it matters here."""

    SAMPLE_HZ = 200
    WATCHDOG = False


class Done(Exception):
    """Enough turns."""


class Canary:
    """A piece of memory that nobody holds: overwritten some time after the next collection has freed it.

    gc.mem_alloc() would tell as well, but takes 7 ms.
    """

    MARK = 0x5AC3

    def arm(self):
        self._address = addressof(array("H", [self.MARK] * 8))  # an integer: the collector sees no pointer in it

    def died(self):
        return mem16[self._address] != self.MARK


class TimedBus:
    """A bus whose transfers are timed."""

    def __init__(self, i2c, spent):
        self._i2c = i2c
        self._spent = spent

    def _timed(self, function, *arguments):
        start = ticks_us()
        try:
            return function(*arguments)
        finally:
            self._spent[BUS] += ticks_diff(ticks_us(), start)

    def readfrom_mem_into(self, *arguments):
        return self._timed(self._i2c.readfrom_mem_into, *arguments)

    def writeto_mem(self, *arguments):
        return self._timed(self._i2c.writeto_mem, *arguments)


class TimedGc:
    """The collector, when the app calls it by itself."""

    def __init__(self, app):
        self._app = app

    def collect(self):
        app = self._app
        if app.count < HEAP_TURNS:
            return
        start = ticks_us()
        gc.collect()
        if app.n_pauses < MAX_PAUSES:
            app.pauses[app.n_pauses] = min(ticks_diff(ticks_us(), start), 65535)
            app.n_pauses += 1
        app.canary.arm()

    def __getattr__(self, name):
        return getattr(gc, name)


class MeasuredApp(app_module.App):
    """The app, which notes what its turns cost, and stops."""

    def prepare(self, seconds, out, spent):
        """seconds: how long to take notes.  spent: us of each stage in this turn, or None."""
        turns = seconds * MAX_TURNS_HZ
        self._out, self._spent, self._turns = out, spent, turns
        self._until_us = seconds * 1_000_000
        self.count = -SETTLE_TURNS
        self.took = array("H", bytes(2 * turns))
        self.stages = array("H", bytes(2 * turns * COLUMNS if spent else 0))
        self.pauses = array("H", bytes(2 * MAX_PAUSES))  # us of each collection that the app called for
        self.n_pauses = 0
        self.automatic = 0  # other collections
        self.canary = Canary()
        self.slept_us = 0

    def step(self):
        start = ticks_us()
        app_module.App.step(self)
        took = ticks_diff(ticks_us(), start)
        self.count += 1
        if self.count > 0:
            self._note(self.count - 1, min(took, 65535))
        elif self.count == 0:
            self._begin()

    def _begin(self):
        gc.collect()
        self.free_before = gc.mem_free()
        gc.disable()
        self._allocated = gc.mem_alloc()
        self._out.write(b"begin")
        self.slept_us = 0
        self._begun = ticks_us()
        self._clear()

    def _note(self, turn, took):
        elapsed_us = ticks_diff(ticks_us(), self._begun)
        if turn >= self._turns or elapsed_us >= self._until_us:
            self.elapsed_us = elapsed_us
            self.turns = turn
            self._out.write(b"end")
            raise Done
        self.took[turn] = took
        if self._spent:
            for i in range(COLUMNS):
                self.stages[turn * COLUMNS + i] = min(self._spent[i], 65535)
            self._clear()
        if self.count == HEAP_TURNS:
            self.heap_bytes = gc.mem_alloc() - self._allocated
            self._out.write(b"heap")
            gc.enable()
            gc.collect()
            self.canary.arm()
        elif self.count > HEAP_TURNS and self.canary.died():
            self.automatic += 1
            self.canary.arm()

    def _clear(self):
        if self._spent:
            for i in range(COLUMNS):
                self._spent[i] = 0


def _time_stages(spent):
    def timed(function, i):
        def run(*arguments):
            start = ticks_us()
            result = function(*arguments)
            spent[i] += ticks_diff(ticks_us(), start)
            return result

        return run

    for i in range(BUS):
        _, module, of, name = STAGES[i]
        owner = __import__("kickstand." + module, None, None, (module,))
        owner = getattr(owner, of) if of else owner
        setattr(owner, name, timed(getattr(owner, name), i))


def run(detail, seconds, out):
    """Prints one line, a dictionary of figures. Writes to out "begin", "end", then the arrays."""
    settings = Settings(Config)
    app = MeasuredApp(settings, app_module.open_lcd(settings))
    spent = array("I", bytes(4 * COLUMNS)) if detail else None
    app.prepare(seconds, out, spent)
    if detail:
        _time_stages(spent)
        reopen = app.sensor.reopen
        app.sensor.reopen = lambda: TimedBus(reopen(), spent)
    if hasattr(app_module, "gc"):
        app_module.gc = TimedGc(app)
    real_sleep_us = app_module.sleep_us

    def sleep_us(us):
        start = ticks_us()
        real_sleep_us(us)
        app.slept_us += ticks_diff(ticks_us(), start)

    app_module.sleep_us = sleep_us
    try:
        app.run()
    except Done:
        pass
    start = ticks_us()
    gc.collect()
    figures = {
        "collect_us": ticks_diff(ticks_us(), start),
        "turns": app.turns,
        "elapsed_us": app.elapsed_us,
        "slept_us": app.slept_us,
        "free_before": app.free_before,
        "free_after": gc.mem_free(),
        "heap_bytes": app.heap_bytes,
        "collections_by_app": app.n_pauses,
        "collections_automatic": app.automatic,
        "stages": [stage[0] for stage in STAGES] + ["read"],
    }
    for data in (app.took, app.pauses, app.stages):
        if data:
            out.write(bytearray_at(addressof(data), 2 * len(data)))
    print(figures)
