"""The heap of an ESP32 is small at the start. The firmware still collects garbage only between two passes of the loop.

The test runs MicroPython's unix port with a nearly full heap, as on an ESP32. Objects of the unix
port are twice as large, and the simulated parts also use heap. So the test first measures how much heap one pass uses.
"""

import json
from types import SimpleNamespace

import pytest
from kickstand_tools.simulated_board.simulator import Board
from kickstand_tools.simulation.scripted import sensor_errors
from support.mpy import run_mpy

_SCRIPT = """
import gc, json, sys
from array import array
from kickstand_tools.simulated_board.simulator import Board
from kickstand_tools.simulation.scripted import sensor_errors
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


@pytest.mark.parametrize("plan", [True, False])
def test_the_garbage_is_collected_between_turns(plan):
    """plan: True if the firmware checks the free heap. Without this check garbage is collected during passes, which
    proves that the heap of the test is small enough."""
    found = json.loads(run_mpy(_SCRIPT.replace("PLAN", str(plan)), heap="4M").splitlines()[-1])
    assert 8 < found["free"] < 20  # number of passes until the heap is full
    assert 3 <= found["plan"] <= 10
    assert found["turns"] > 500
    assert (found["within"] == 0) is plan, found


def _nothing(*_):
    return None


# A part of the app that does nothing
IDLE = SimpleNamespace(
    begin=_nothing, poll=_nothing, feed=_nothing, press=_nothing, lean=_nothing, take_problem=_nothing,
    check_memory=_nothing, period_ms=0, speed=SimpleNamespace(take_problem=_nothing),
)  # fmt: skip


@pytest.mark.parametrize("part", ["drive", "live", "user"])
def test_a_part_that_uses_heap_shortens_the_next_wait(part, tmp_path, monkeypatch):
    """The part uses heap in the first pass, when four collections are already planned. Only the first collection is
    still made as planned."""
    monkeypatch.chdir(tmp_path)
    turns = [0]  # number of passes between two collections
    with Board(sensor_errors.resting(sensor_errors.Sensor(), (0, 1, 0))) as board:
        from kickstand import app, devices, settings

        monkeypatch.setattr(app.gc, "collect", lambda: turns.append(0))
        chosen = settings.Settings(None)

        def run():
            device = app.App(chosen, devices.open_lcd(chosen), devices.open_sensor(chosen))
            device.begin()
            turns[:] = [0]
            for _ in range(app._COLLECT_TURNS + 3 * app._COLLECT_TURNS_DRIVING):
                turns[-1] += 1
                device.step()
                setattr(device, part, IDLE)

        board.run(run, 10.0)
    assert turns == [app._COLLECT_TURNS, *3 * [app._COLLECT_TURNS_DRIVING], 0]
