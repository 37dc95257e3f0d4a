"""No command loses existing data if the power is cut or the disk is full at a random moment.

Each case runs a command in a fork of this process. A timer's signal ends the fork without a handler, like kill -9, or
the disk of the fork fails. The test then examines the remaining files.
"""

import gzip
import os
import random
import resource
import shutil
import signal
import time
from pathlib import Path

import pytest
import ride_boards
from kickstand_tools.logs.reader import read_log
from ride_boards import RideBoard, Stream, half_seconds
from support import command, fake_board
from support.recordings import ride_writer

pytestmark = pytest.mark.skipif(not hasattr(os, "fork"), reason="this system has no fork()")

WEATHER = b"# my weather station\nwhile True: pass\n"


class Scene:
    """The files and the board of a command.

    arguments: the command line.
    board: the board, or None.
    lost(): returns one sentence for each loss since the scene was created.
    """

    arguments: list
    board = None

    def __init__(self, place: Path):
        self.place, self.out, self.contents = place, place / "out", {}
        self.out.mkdir(parents=True)
        self.keep("out/notes.txt", b"mine")

    def keep(self, name, data=None):
        """Add a file that must not be lost. A command may replace it by a complete file of the same kind."""
        path = self.place / name
        path.parent.mkdir(parents=True, exist_ok=True)
        if data is not None:
            path.write_bytes(data)
        self.contents[path] = path.read_bytes()
        return path

    def plug(self, patch):
        if self.board:
            fake_board.plug_in(patch, self.board)

    def lost(self):
        return [
            f"{path.name} was lost or cut"
            for path, content in self.contents.items()
            if not path.exists() or not (path.read_bytes() == content or is_complete(path))
        ]


def is_complete(path: Path) -> bool:
    """Return True for a file that a command has written completely."""
    data = gzip.decompress(path.read_bytes()) if path.suffix == ".gz" else path.read_bytes()
    if path.suffix in (".csv", ".gz"):
        return data.endswith(b"\n") and data.startswith(b"t_s,") and len(data) > 20_000
    return path.suffix == ".json" and data.strip().endswith(b"}")


class Pull(Scene):
    """Three rides on the board."""

    def __init__(self, place, _source):
        super().__init__(place)
        self.board = RideBoard(place / "flash")
        self.readings = {}
        for ride in (1, 2, 3):
            blocks, turns = ride_writer.blocks(2, ride=ride, length=lambda _: 2048)
            self.board.put(f"000/{ride:02}/00000.rid", blocks)
            self.readings[ride] = len(turns)
        self.arguments = ["pull", "--out", self.out, "--delete"]

    def plug(self, patch):
        self.board.plug_in(patch)

    def lost(self):
        return super().lost() + [
            f"ride {ride} is neither on the board nor here"
            for ride, count in self.readings.items()
            if f"000/{ride:02}/00000.rid" not in self.board.paths()
            and not any(len(read_log(path).time_us) == count for path in self.out.glob(f"ride-{ride:05}-*.gz"))
        ]


class Record(Scene):
    """A recording beside an earlier recording."""

    def __init__(self, place, _source):
        super().__init__(place)
        self.keep("out/old.csv", b"yesterday\n")
        self.arguments = ["record", "--out", self.out / "ride.csv.gz"]
        self.place, self.stream = place, Stream(half_seconds(12)[0], "ctrl-c")

    def plug(self, patch):
        ride_boards.plug_in(patch, self.place, self.stream)


class Flash(Scene):
    """A used board with a user's program, notes, rides and calibration."""

    def __init__(self, place, _source):
        super().__init__(place)
        for name in ("rides/000/01/00000.rid", "user.py", "kickstand_a.cal"):
            self.keep(f"flash/{name}", name.encode())
        (place / "flash" / "main.py").write_bytes(WEATHER)
        self.board = fake_board.FakeBoard(place / "flash")
        self.arguments = ["flash", "--yes"]

    def lost(self):
        programs = [path.read_bytes() for path in (self.place / "flash").glob("*.py")]
        return super().lost() + ([] if WEATHER in programs else ["main.py of another project"])


class Smooth(Scene):
    """A command that replaces the results of an earlier run. source: the folder of a simulated ride."""

    def __init__(self, place, source):
        super().__init__(place)
        for name in ("RIDE.csv", "RIDE.cal.json"):
            shutil.copy(source / name, place / name)
            self.keep(name)
        result = self.keep("out/old.csv", b"t_s,of,before\n")
        self.arguments = ["smooth", place / "RIDE.csv", "--calibration", place / "RIDE.cal.json", "--out", result]


@pytest.fixture(scope="module")
def source(tmp_path_factory):
    """Return the folder of a simulated ride with its calibration."""
    path = tmp_path_factory.mktemp("source")
    command.works("simulate", "--profile", "street", "--seconds", 20, "--out", path)
    command.works("calibrate", "two", path / "KICKSTAND.csv", path / "UPRIGHT.csv", "--out", path / "RIDE.cal.json")
    command.works(*Smooth(path / "smooth", path).arguments)  # each fork finds the modules already imported
    return path


def in_a_fork(scene, fault, share=0.0, usual_s=1.0):
    """Run the scene's command in a fork. Return its duration in s.

    share: the share of usual_s or of the file after which the fault happens.
    usual_s: duration of the command without a fault.
    """
    begin_s = time.monotonic()
    child = os.fork()
    if not child:
        try:
            null = os.open(os.devnull, os.O_WRONLY)
            os.dup2(null, 1)
            os.dup2(null, 2)
            scene.plug(pytest.MonkeyPatch())
            if fault == "full":
                signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
                resource.setrlimit(resource.RLIMIT_FSIZE, (round(60_000 * share**2), resource.RLIM_INFINITY))
            elif fault in ("kill", "term"):
                handler = (lambda *_: os.kill(os.getpid(), signal.SIGTERM)) if fault == "term" else signal.SIG_DFL
                signal.signal(signal.SIGALRM, handler)
                signal.setitimer(signal.ITIMER_REAL, max(1e-4, share * usual_s))
            command.run(*scene.arguments)
        finally:
            os._exit(0)
    os.waitpid(child, 0)
    return time.monotonic() - begin_s


OFTEN = {(Record, "full"), (Pull, "kill"), (Flash, "kill"), (Smooth, "kill")}
KINDS = [(scene, fault) for scene in (Record, Pull, Flash, Smooth) for fault in ("kill", "full", "term")]


@pytest.mark.parametrize(
    ("scene", "fault", "count"),
    [(*kind, 2) for kind in KINDS if kind in OFTEN]
    + [pytest.param(*kind, 8, marks=pytest.mark.long) for kind in KINDS],
    ids=lambda value: getattr(value, "__name__", value),
)
def test_no_existing_file_is_lost(scene, fault, count, source, tmp_path):
    chance = random.Random(f"{scene.__name__} {fault}")
    usual_s = in_a_fork(scene(tmp_path / "usual", source), "none") if fault in ("kill", "term") else 0.0
    losses = []
    for k in range(count):
        trial = scene(tmp_path / str(k), source)
        in_a_fork(trial, fault, chance.random(), usual_s)
        losses += trial.lost()
        if fault != "kill":
            losses += [f"{path.name} was left" for path in trial.out.glob(".*")]
    assert losses == []
