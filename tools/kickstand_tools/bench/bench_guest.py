"""Runs on the emulated Pico: the app's own loop with a stopwatch in it. bench.py is the host's end of it.

run(detail, seconds, out): the app for so long; with detail, what each stage took in each turn of its loop.
"""

import gc
from array import array
from time import ticks_diff, ticks_us

from kickstand import app as app_module
from kickstand.devices import open_lcd
from kickstand.settings import Settings
from machine import mem16
from uctypes import addressof, bytearray_at

# Name, and which method is timed under it: module, class, method with what it is called with.
STAGES = (
    ("decode and sum", "imu.mpu6050", "Mpu6050", "add_up(self, n)"),
    ("calibrate and rotate", "calibration.transform", "Transform", "apply_sum(self, sums, n, force, rate)"),
    ("filter", "lean.lean_filter", "LeanFilter", "update(self, force, rate, dt_us)"),
    ("meter", "lean.meter", "LeanMeter", "update_sum(self, sums, n, dt_us)"),
    ("fetch", "imu.sensor", "Sensor", "fetch(self, now_ms)"),
    ("page", "ui.screen", "Screen", "lines(self, now_ms)"),
    ("display", "board.hd44780", "Lcd", "tick(self, now_ms)"),
)
NOTHING = ("apply_sum", "tick")  # is what these return
BUS = len(STAGES)  # one more column: the sensor's transfers
COLUMNS = BUS + 1
SETTLE_TURNS = 150  # before anything is recorded
HEAP_TURNS = 10  # with the collector off
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

    def readfrom_mem_into(self, address, register, buffer):
        start = ticks_us()
        try:
            self._i2c.readfrom_mem_into(address, register, buffer)
        finally:
            self._spent[BUS] += ticks_diff(ticks_us(), start)

    def writeto_mem(self, address, register, buffer):
        start = ticks_us()
        try:
            self._i2c.writeto_mem(address, register, buffer)
        finally:
            self._spent[BUS] += ticks_diff(ticks_us(), start)


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
        app_module.fill_gaps(app_module.SINGLE_GAPS)  # as the app does
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
        self._spent_bytes = bytearray_at(addressof(spent), 4 * COLUMNS) if spent else None
        self.pauses = array("H", bytes(2 * MAX_PAUSES))  # us of each collection that the app called for
        self.n_pauses = 0
        self.automatic = 0  # other collections
        self.canary = Canary()
        self.slept_us = 0

    def turn(self):
        start = ticks_us()
        app_module.App.turn(self)
        took = ticks_diff(ticks_us(), start)
        self.count += 1
        if self.count > 0:
            self._note(self.count - 1, min(took, 65535))
        elif self.count == 0:
            self._begin()

    def _begin(self):
        gc.collect()
        app_module.fill_gaps(app_module.SINGLE_GAPS)  # as the app does
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
            self._out.write(self._spent_bytes)  # at once: what is kept here takes room from what is measured
            self._clear()
        if self.count == HEAP_TURNS:
            self.heap_bytes = gc.mem_alloc() - self._allocated
            self._out.write(b"heap")
            gc.enable()
            gc.collect()
            app_module.fill_gaps(app_module.SINGLE_GAPS)
            self.canary.arm()
        elif self.count > HEAP_TURNS and self.canary.died():
            self.automatic += 1
            self.canary.arm()

    def _clear(self):
        if self._spent:
            for i in range(COLUMNS):
                self._spent[i] = 0


# No *arguments and few locals: both would take memory that is freed when it returns, and make what is measured search
# from there for more
_TIMED = """
def {name}({parameters}):
    begin({i})
    {result}function({parameters})
    end({i})
{back}
"""


def _timed(spent, function, i, signature, returns):
    """function with a stopwatch: its time is added to spent[i]."""
    starts = array("I", bytes(4 * BUS))

    def begin(i):
        starts[i] = ticks_us()

    def end(i):
        spent[i] += ticks_diff(ticks_us(), starts[i])

    name, parameters = signature[:-1].split("(")
    result, back = ("result = ", "    return result") if returns else ("", "")
    scope = {"function": function, "begin": begin, "end": end}
    exec(_TIMED.format(name=name, parameters=parameters, i=i, result=result, back=back), scope)
    return scope[name]


def _time_stages(spent):
    for i in range(BUS):
        _, module, of, method = STAGES[i]
        name = method.split("(")[0]
        owner = getattr(__import__("kickstand." + module, None, None, (module,)), of)
        setattr(owner, name, _timed(spent, getattr(owner, name), i, method, name not in NOTHING))


def _stopwatch_us(spent):
    """What timing a call adds to the call."""
    def function(self, n):
        pass

    took = []
    for call in (function, _timed(spent, function, 0, "timed(self, n)", True)):
        start = ticks_us()
        for _ in range(100):
            call(None, 0)
        took.append(ticks_diff(ticks_us(), start))
    return (took[1] - took[0]) // 100


def run(detail, seconds, out, chosen):
    """Prints one line, a dictionary of figures. Writes to out "begin", with detail an array('I') for each turn, "end",
    then the other arrays. chosen: settings by name."""
    for name in chosen:
        setattr(Config, name, chosen[name])
    settings = Settings(Config)
    app = MeasuredApp(settings, open_lcd(settings))
    spent = array("I", bytes(4 * COLUMNS)) if detail else None
    app.prepare(seconds, out, spent)
    if detail:
        _time_stages(spent)
        reopen = app.sensor.reopen
        app.sensor.reopen = lambda: TimedBus(reopen(), spent)
    assert app_module.gc is gc
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
        "stopwatch_us": _stopwatch_us(spent) if detail else 0,
        "stages": [stage[0] for stage in STAGES] + ["read"],
    }
    for data in (app.took, app.pauses):
        out.write(bytearray_at(addressof(data), 2 * len(data)))
    print(figures)
