"""Runs the app's own loop on the emulated board, and times each pass. bench.py starts this program and reads its
figures."""

import gc
import sys
from array import array
from time import ticks_diff, ticks_us

from kickstand import app as app_module
from kickstand.settings import Settings
from machine import mem16
from micropython import qstr_info
from uctypes import addressof, bytearray_at

SETTLE_TURNS = 150  # number of passes of the loop before the first pass that is recorded
# The heap use is recorded after this number of passes without garbage collection. The number is smaller on an ESP32,
# because its heap is small and only grows during a collection.
HEAP_TURNS = 3 if sys.platform == "esp32" else 10
MAX_PAUSES = 2000
MAX_TURNS_HZ = 200


class Config:
    """The settings of the bench that differ from the defaults, in the form of config.py."""

    SAMPLE_HZ = 200
    WATCHDOG = False


class Done(Exception):
    """Raised when the measuring time is over."""


class Canary:
    """A piece of heap without a reference, to detect garbage collections.

    A collection frees the piece, and the piece is soon overwritten. gc.mem_alloc() also shows collections, but takes 7
    ms.
    """

    MARK = 0x5AC3

    def arm(self):
        # Only the address, because a reference would keep the array alive
        self._address = addressof(array("H", [self.MARK] * 8))

    def died(self):
        return mem16[self._address] != self.MARK


class TimedGc:
    """Replaces the module gc in the app, and times the collections that the app starts."""

    def __init__(self, app):
        self._app = app

    def collect(self):
        """Collect garbage, and record the time, but not before the heap use is recorded, which a collection would hide.

        A collection here must not count as an automatic one, so the canary is armed again.
        """
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
    """The app, which records the costs of the passes of its loop, and stops after a given time."""

    def prepare(self, seconds, out):
        """Prepare the recording.

        seconds: recording time. out: a Sink to the host.
        """
        # Without a collection here, the arrays would be behind garbage in the heap, and lengthen each later collection
        gc.collect()
        turns = seconds * MAX_TURNS_HZ
        self._out, self._turns = out, turns
        self._until_us = seconds * 1_000_000
        self.count = -SETTLE_TURNS
        self.took = array("H", bytes(2 * turns))
        self.pauses = array("H", bytes(2 * MAX_PAUSES))  # us of each collection that the app started
        self.n_pauses = 0
        self.automatic = 0  # number of collections that the app did not start
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
        self.free_before = gc.mem_free()
        gc.disable()
        self._allocated = gc.mem_alloc()
        self._out.write(b"begin")
        self.slept_us = 0
        self._begun = ticks_us()

    def _note(self, turn, took):
        """Record the duration of a pass, in us, and end the recording when it is full."""
        elapsed_us = ticks_diff(ticks_us(), self._begun)
        if turn >= self._turns or elapsed_us >= self._until_us:
            self.elapsed_us = elapsed_us
            self.turns = turn
            self._out.write(b"end")
            raise Done
        self.took[turn] = took
        if self.count == HEAP_TURNS:
            self.heap_bytes = gc.mem_alloc() - self._allocated
            self._out.write(b"heap")
            gc.enable()
            gc.collect()
            self.canary.arm()
        elif self.count > HEAP_TURNS and self.canary.died():
            self.automatic += 1
            self.canary.arm()


def _attach(app):
    """Attach a phone that subscribes to everything.

    The radio is simulated, because a Pico has no radio, and the radio of an emulated ESP32 does not start.
    """
    sys.modules["bluetooth"] = __import__("bluetooth_guest")
    from kickstand.live.live import Live
    from kickstand.live.radio import Radio

    app.live = Live(Radio(), app)
    app.live.radio._ble.connect()


def run(seconds, out, chosen):
    """Run the app, and print one line, a dictionary of figures.

    seconds: recording time.
    out: a Sink to the host. out receives b"begin", then b"heap" after HEAP_TURNS, and b"end". Two arrays of 16-bit
        numbers follow: us of each pass, and us of each collection that the app started.
    chosen: values of settings, by name.
    """
    for name in chosen:
        setattr(Config, name, chosen[name])
    settings = Settings(Config)
    app = MeasuredApp(settings, settings.open_lcd(), settings.open_sensor())
    if settings.LIVE:
        _attach(app)
    app.prepare(seconds, out)
    assert app_module.gc is gc
    app_module.gc = TimedGc(app)

    def timed(sleep):
        def sleeping(duration):
            start = ticks_us()
            sleep(duration)
            app.slept_us += ticks_diff(ticks_us(), start)

        return sleeping

    app_module.sleep_us, app_module.sleep_ms = timed(app_module.sleep_us), timed(app_module.sleep_ms)
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
    }
    if app.live:
        figures["sent"] = app.live.radio._ble.sent
    qstr_info()
    for data in (app.took, app.pauses):
        out.write(bytearray_at(addressof(data), 2 * len(data)))
    print(figures)
