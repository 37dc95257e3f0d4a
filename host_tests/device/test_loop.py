"""The app's loop: its rate, its garbage collections, and the heap of an ESP32."""

import contextlib
import gc
import itertools
import json

import pytest
from support.mpy import run_mpy


def test_loop_has_100_turns_a_second_and_never_catches_up(with_app):
    def use(board, app):
        app.begin()
        for _ in range(100):  # until display and sensor are set up
            app.step()
        begin_us = board.clock.now_us
        for _ in range(50):
            app.step()
        lasted_us = board.clock.now_us - begin_us
        board.clock.at(board.clock.now_us, lambda: board.clock.advance(35_000))
        app.step()
        late_us = board.clock.now_us
        app.step()
        return lasted_us, board.clock.now_us - late_us

    lasted_us, after_us = with_app(use)
    assert lasted_us == pytest.approx(500_000, abs=1000) and after_us == pytest.approx(10_000, abs=1000)


@contextlib.contextmanager
def collections_at(now):
    """Append now() to the returned list at each complete garbage collection."""
    times = []

    def note(phase, info):
        if phase == "start" and info["generation"] == 2:
            times.append(now())

    gc.callbacks.append(note)
    try:
        yield times
    finally:
        gc.callbacks.remove(note)


@pytest.mark.parametrize(
    ("config", "fitted", "turns"),
    [
        ({}, {}, 40),
        ({}, {"display": "ssd1306"}, 23),
        ({"SPEED": "wheel"}, {}, 23),
        ({"user.py": True}, {}, 23),
        ({"LIVE": True}, {"machine": "pico w"}, 23),
    ],
    ids=["nothing else", "OLED", "speed source", "user.py", "phone"],
)
def test_garbage_is_collected_after_so_many_turns(config, fitted, turns, with_app, tmp_path):
    """Parts that use heap shorten the interval from the second collection on, if they are not there at the start."""
    if config.pop("user.py", False):
        (tmp_path / "user.py").write_text("")

    def use(board, app):
        if "LIVE" in config:
            from kickstand.live import live, radio

            live.attach(radio.Radio(None), app)
        gc.freeze()
        app.begin()
        numbers = [0]
        with collections_at(lambda: numbers[0]) as collections:
            for number in range(40 + 3 * turns):
                numbers[0] = number
                app.step()
        gc.unfreeze()
        return collections

    collections = with_app(use, config, **fitted)
    gaps = [later - earlier for earlier, later in itertools.pairwise(collections)]
    assert collections[0] in (turns - 1, 39) and gaps and set(gaps) == {turns}


_SCRIPT = """
import gc, json, sys
from array import array
from kickstand_tools.simulated_board.simulator import Board
board = Board(lambda t_s: (0.0, 1.0, 0.0, 0.0, 0.0, 0.0))
board.install()
board.remove_lcd()  # its driver would not find the piece of memory that it takes once

class Esp32:
    HEAP_DATA = 4
    could_grow = 60000
    def idf_heap_info(self, capabilities):
        return [(90000, 70000, self.could_grow, 1000), (9000, 5000, 4000, 1000)]

sys.modules["esp32"] = Esp32()
from kickstand import devices
from kickstand.app import App
from kickstand.board import port
from kickstand.settings import Settings

port.IS_ESP32 = True
real_free = gc.mem_free
class Gc:  # as the ESP32's, which counts what the heap could grow by
    collect, threshold, mem_alloc = gc.collect, gc.threshold, gc.mem_alloc
    def mem_free():
        return real_free() + Esp32.could_grow
port.gc = Gc

settings = Settings(object)
class Turns:  # of fixed size: a list that grows would take heap
    def __init__(self):
        self.changes, self.n = array('i', [0] * 3000), 0
    def append(self, change):
        self.changes[self.n] = change
        self.n += 1
turns = Turns()
class Watched(App):
    def turn(self):
        before = gc.mem_alloc()
        super().turn()
        turns.append(gc.mem_alloc() - before)

def run():  # all parts opened after power-on, which forgets the pins
    Watched(settings, devices.open_lcd(settings), devices.open_sensor(settings)).run()

board.run(run, 4.0)
used = sorted(turns.changes[:turns.n])[turns.n * 9 // 10]  # of heap, by a turn and by the models in it
port._TURN_BYTES = used
TURNS = port.turns_to_collect
if not PLAN:
    port.turns_to_collect = lambda most: most
gc.collect()
room = bytearray(4 * used)  # this part of the free heap is one piece, the rest are gaps
ballast = []
for size in (1 << 20, 1 << 14, 1 << 10, 1 << 8):
    try:
        while True:
            ballast.append(bytearray(size))
    except MemoryError:  # no such piece is left: smaller ones fill the rest
        pass
room = None
gc.collect()
free = real_free() // used
turns.n = 0
plan = TURNS(25)
board.run(run, 12.0)
ballast = None
gc.collect()
within = sum(1 for k in range(100, turns.n) if turns.changes[k] < 0)
print(json.dumps({"free": free, "turns": turns.n, "within": within, "plan": plan, "used": used}))
"""


@pytest.mark.parametrize("plan", [True, pytest.param(False, marks=pytest.mark.long)])
def test_small_heap_is_collected_between_turns_only(plan):
    """MicroPython's unix port with a nearly full heap, as on an ESP32. Objects of the unix port are twice as large, and
    the simulated parts use heap too, so the test first measures how much heap one pass uses.

    plan: False to replace the firmware's check of the free heap. Then garbage is collected during passes, which proves
    that the heap of the test is small enough.
    """
    result = json.loads(run_mpy(_SCRIPT.replace("PLAN", str(plan)), heap="4M").splitlines()[-1])
    assert 8 < result["free"] < 20  # number of passes until the heap is full
    assert 3 <= result["plan"] <= 10
    assert result["turns"] > 500
    assert (result["within"] == 0) is plan, result
