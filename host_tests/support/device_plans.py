"""Runs a device plan on either engine, in a directory that simulates the board's flash."""

import contextlib
import functools
import gc
import importlib
import json
import math
import re
import shutil
import sys
import tempfile
import warnings
from pathlib import Path

from support import device_runs
from support.mpy import BOARD_HEAP, run_mpy

SCRIPT = Path(device_runs.__file__)

# The bike is on the stand until 8 s and upright until 18 s. Then the bike rides two bends at 15 m/s, with a lean of 30
# degrees to the left and of 40 degrees to the right.
RIDE = [
    ["kickstand", 8.0],
    ["upright", 8.0],
    ["accelerate", 15.0, 6.0],
    ["turn", -30.0, 5.0],
    ["turn", 40.0, 5.0],
    ["straight", 6.0],
]
LEFT_S, RIGHT_S, STRAIGHT_S = 30.0, 38.0, 44.0  # times near the end of each bend, and on the straight after the bends
PRESSES = [[2, 0.15], [12, 0.15]]
ALIGNED = {"ride": RIDE, "presses": PRESSES, "until": 46}


class Record:
    """The content of the display over time."""

    def __init__(self, answer, console):
        self.frames = answer["frames"]
        self.ends = answer["ends"]
        self.last = tuple(answer["last"])
        self.too_fast = answer["too_fast"]
        self.touched = answer["touched"]
        self.rides = answer.get("rides")  # files on the SD card: {path: content}
        self.card_hz = answer.get("card_hz")
        self.phones = answer.get("phones", [])
        self.console = console

    def at(self, t_s):
        """Return both lines of the display at t_s."""
        displayed = ["", ""]
        for start, line1, line2 in self.frames:
            if start <= t_s + 1e-6:
                displayed = [line1, line2]
        return displayed

    def first(self, pattern, after=0.0):
        """Return the first time from `after` on at which a line matches, or infinity without such a line."""
        for start, line1, line2 in self.frames:
            if start >= after and (re.search(pattern, line1) or re.search(pattern, line2)):
                return start
        return math.inf

    def lean_at(self, t_s):
        """Return the lean on the display in degrees, positive to the right.

        Returns None if the display shows no lean, or a half-written line.
        """
        match = re.fullmatch(r"Lean +(\d+)° (right|left |     )[ *]", self.at(t_s)[0])
        return match and int(match[1]) * (-1 if match[2] == "left " else 1)

    def leans(self, from_s, until_s):
        """Return every lean shown between two times."""
        displayed = [self.lean_at(from_s)] + [self.lean_at(f[0]) for f in self.frames if from_s < f[0] < until_s]
        return [lean for lean in displayed if lean is not None]


WORLD_KEYS = ("lean", "ride", "poses", "seed", "remount")


@functools.lru_cache(maxsize=8)
def _shared_world(key):
    """Return device_runs.world_of() of a description. Runs in the same world share its readings, which take time."""
    world, ride = device_runs.world_of(json.loads(key))
    return functools.lru_cache(maxsize=20_000)(world), ride


def world_of(plan):
    """Return (world, ride) of a plan, as device_runs.world_of() does."""
    motion = {key: plan[key] for key in WORLD_KEYS if key in plan}
    motion["config"] = {"VEHICLE": (plan.get("config") or {}).get("VEHICLE")}
    return _shared_world(json.dumps(motion))


@contextlib.contextmanager
def on_flash(flash):
    """Make a directory the working directory and the first on the import path, as a board's flash is.

    The app collects garbage often. Objects of earlier tests are excluded, because scanning them takes minutes.
    """
    _forget_the_riders_modules()  # a test of another folder may have left its own
    sys.path.insert(0, str(flash))
    importlib.invalidate_caches()
    writes_none, sys.dont_write_bytecode = sys.dont_write_bytecode, True
    gc.freeze()
    try:
        with contextlib.chdir(flash), warnings.catch_warnings():
            warnings.simplefilter("ignore", ResourceWarning)  # a board that loses its power closes no file
            yield
            gc.collect()
    finally:
        gc.unfreeze()
        sys.dont_write_bytecode = writes_none
        sys.path.remove(str(flash))
        _forget_the_riders_modules()


def _forget_the_riders_modules():
    for name in ("user", "config"):
        sys.modules.pop(name, None)


def run(engine, flash, plan, capsys=None, fit=None):
    """Run a plan and return its Record.

    flash: a directory that keeps its content between runs, as a board's flash.
    fit: fit(board) changes the board before power-on, on CPython only.
    """
    if engine == "cpython":
        with on_flash(flash):
            answer = json.loads(json.dumps(device_runs.run_device(plan, fit, world_of(plan))))
        return Record(answer, capsys.readouterr().out if capsys else "")
    heap = "8M" if "card" in plan else BOARD_HEAP
    output = run_mpy(SCRIPT, heap=heap, stdin=json.dumps(plan), directory=flash)
    console, _, answer = output.rstrip("\n").rpartition("\n")
    return Record(json.loads(answer), console)


@functools.cache
def _aligned_once():
    """Return a directory with the content of the flash after a run of ALIGNED. The directory exists until this process
    ends."""
    directory = tempfile.TemporaryDirectory()
    run("cpython", directory.name, ALIGNED)
    return directory


def align(flash):
    """Write the alignment that a run of ALIGNED finds into a directory that simulates a board's flash."""
    shutil.copytree(_aligned_once().name, flash, dirs_exist_ok=True)


def spoilt(column, change, from_s=0.0, until_s=math.inf):
    """Return fit(board), which changes a column of the readings between two times by change(value)."""

    def fit(board):
        world = board.sensor.world

        def ill(t_s):
            reading = list(world(t_s))
            if from_s <= t_s < until_s:
                reading[column] = change(reading[column])
            return reading

        board.sensor.world = ill

    return fit
