"""No command loses existing data if the power is cut, the disk is full or the cable is pulled at a random moment.

Each case runs a command in a fork of this process. A timer's signal ends the fork without a handler, like kill -9, or
the disk or the cable of the fork fails. The test then examines the remaining files.
"""

import contextlib
import gzip
import os
import random
import resource
import shutil
import signal
import time
import types
from pathlib import Path

import pytest
from kickstand.rides import ride_paths
from kickstand_tools.common import output
from kickstand_tools.deploy import board_console
from kickstand_tools.logs.reader import read_log
from support import command, fake_board
from support.recordings import ride_writer
from test_cli_pull import left, put
from test_cli_record import Clocks, Stream, Streaming, half_seconds

pytestmark = pytest.mark.skipif(not hasattr(os, "fork"), reason="this system has no fork()")

WEATHER = b"# my weather station\nwhile True: pass\n"
OFTEN = [("record", "full"), ("pull", "kill"), ("pull", "cable"), ("flash", "cable"), ("smooth", "kill")]
# number of random moments at which each case is tested: FAST for the cases in OFTEN, and ALL for all cases in a nightly
# run
FAST, ALL = 2, 10


class Scene:
    """The files and the board of a command.

    arguments: the command line.
    plug(monkeypatch): connects the board, in the fork.
    lost(): returns one sentence for each loss since the scene was created.
    """

    def __init__(self, place: Path):
        self.place = place
        self.out = place / "out"
        self.out.mkdir(parents=True)
        (self.out / "notes.txt").write_text("mine")
        self.kept = {self.out / "notes.txt": [b"mine"]}  # {path: contents that the file may have}

    def keep(self, path: Path) -> None:
        self.kept[path] = [path.read_bytes()]

    def plug(self, patch):
        pass

    def lost(self):
        return [
            f"{path.name} was lost or cut"
            for path, contents in self.kept.items()
            if not path.exists() or not (path.read_bytes() in contents or is_whole(path))
        ]


def is_whole(path: Path) -> bool:
    """Return True for a file that a command has written completely."""
    data = gzip.decompress(path.read_bytes()) if path.suffix == ".gz" else path.read_bytes()
    if path.suffix in (".csv", ".gz"):
        return data.endswith(b"\n") and data.startswith(b"t_s,") and len(data) > 20_000
    ends = {".json": b"}", ".png": b"IEND\xaeB`\x82", ".html": b"</html>"}
    return path.suffix in ends and data.strip().endswith(ends[path.suffix])


class Pull(Scene):
    """Three rides on the board, one of which was pulled earlier."""

    def __init__(self, place):
        super().__init__(place)
        self.board = fake_board.FakeBoard(place / "flash")
        self.whole = {}
        for ride in (1, 2, 3):
            blocks, turns = ride_writer.blocks(4, ride=ride)
            put(self.board, f"000/{ride:02}/00000.rid", blocks)
            self.whole[ride] = len(turns)
        self.arguments = ["pull", "--out", self.out, "--delete"]

    def plug(self, patch):
        fake_board.plug_in(patch, self.board)
        patch.setattr(ride_paths, "directory", lambda _settings: "rides")
        patch.setattr(ride_paths, "os", self.board.modules["os"])
        settings = types.SimpleNamespace(VEHICLE="motorcycle")
        self.board.modules["kickstand"] = types.SimpleNamespace(settings=types.SimpleNamespace(load=lambda: settings))
        self.board.modules["kickstand.rides"] = types.SimpleNamespace(ride_paths=ride_paths)

    def lost(self):
        there = left(self.board)
        return super().lost() + [
            f"ride {ride} is neither on the board nor here"
            for ride, count in self.whole.items()
            if f"000/{ride:02}/00000.rid" not in there
            and not any(len(read_log(path).time_us) == count for path in self.out.glob(f"ride-{ride:05}-*.gz"))
        ]


class Record(Scene):
    """A recording beside an earlier recording."""

    def __init__(self, place):
        super().__init__(place)
        (self.out / "old.csv").write_text("yesterday\n")
        self.keep(self.out / "old.csv")
        self.arguments = ["record", "--out", self.out / "ride.csv.gz"]
        self.board = Streaming(place)
        self.board.serial = Stream(half_seconds(12)[0], "ctrl-c")

    def plug(self, patch):
        patch.setattr(board_console, "time", Clocks)
        fake_board.plug_in(patch, self.board)


class Flash(Scene):
    """A used board with a user's program, notes, rides and calibration."""

    def __init__(self, place):
        super().__init__(place)
        self.root = place / "flash"
        self.board = fake_board.FakeBoard(self.root)
        self.own = {"rides/000/01/00000.rid": b"ride", "user.py": b"mine", "kickstand_a.cal": b"calibration"}
        for name, data in self.own.items():
            (self.root / name).parent.mkdir(parents=True, exist_ok=True)
            (self.root / name).write_bytes(data)
        (self.root / "main.py").write_bytes(WEATHER)
        self.arguments = ["flash", "--yes"]

    def plug(self, patch):
        fake_board.plug_in(patch, self.board)

    def lost(self):
        programs = [path.read_bytes() for path in self.root.glob("*.py")]
        gone = [name for name, data in self.own.items() if (self.root / name).read_bytes() != data]
        return super().lost() + gone + ([] if WEATHER in programs else ["main.py of another project"])


class Computed(Scene):
    """A command that replaces the results of an earlier run. source: the folder of a simulated ride."""

    def __init__(self, place, source, verb):
        super().__init__(place)
        for name in ("RIDE.csv", "RIDE.cal.json"):
            shutil.copy(source / name, place / name)
            self.keep(place / name)
        ride, out = place / "RIDE.csv", self.out / "old.csv"
        out.write_bytes(b"t_s,of,before\n")
        self.arguments = {
            "import": ["import", ride, "--out", out],
            "smooth": ["smooth", ride, "--calibration", place / "RIDE.cal.json", "--out", out],
            "plot": ["plot", ride, "--calibration", place / "RIDE.cal.json", "--out", self.out],
        }[verb]
        self.keep(out)
        for name in ("RIDE.png", "RIDE.html"):
            (self.out / name).write_bytes(b"an earlier picture")
            self.keep(self.out / name)


@pytest.fixture(scope="module")
def source(tmp_path_factory):
    """Return the folder of a simulated ride with its calibration."""
    place = tmp_path_factory.mktemp("source")
    command.works("simulate", "--profile", "street", "--seconds", 20, "--out", place)
    command.works("calibrate", "two", place / "KICKSTAND.csv", place / "UPRIGHT.csv", "--out", place / "RIDE.cal.json")
    for verb in ("import", "smooth"):  # import now, so each fork finds the modules already imported
        (made := place / verb).mkdir()
        command.works(*Computed(made, place, verb).arguments)
    return place


def in_a_fork(scene, fault, share, usual_s=1.0):
    """Run the scene's command in a fork. Return its duration in s.

    share: the share of usual_s, of the file or of the transfer after which the fault happens.
    usual_s: duration of the command without a fault.
    """
    begun_s = time.monotonic()
    child = os.fork()
    if not child:
        try:
            null = os.open(os.devnull, os.O_WRONLY)
            os.dup2(null, 1)
            os.dup2(null, 2)
            patch = pytest.MonkeyPatch()
            scene.plug(patch)
            if fault == "full":
                signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
                resource.setrlimit(resource.RLIMIT_FSIZE, (round(60_000 * share**2), resource.RLIM_INFINITY))
            elif fault == "cable":
                cut(scene.board, share)
            elif fault == "term":
                signal.signal(signal.SIGALRM, lambda *_: os.kill(os.getpid(), signal.SIGTERM))
                signal.setitimer(signal.ITIMER_REAL, max(1e-4, share * usual_s))
            elif fault == "kill":
                signal.signal(signal.SIGALRM, signal.SIG_DFL)
                signal.setitimer(signal.ITIMER_REAL, max(1e-4, share * usual_s))
            command.run(*scene.arguments)
        finally:
            os._exit(0)
    os.waitpid(child, 0)
    return time.monotonic() - begun_s


def cut(board, share):
    """Let the cable be pulled after a share of the changes to the board's flash, or of the board's output."""
    left = [round(share * (30 if isinstance(board.serial, Stream) else 300))]

    def pulled(*_):
        left[0] -= 1
        if left[0] <= 0:
            raise ConnectionError("device disconnected")

    waiting = board.serial.inWaiting

    def in_waiting():
        pulled()
        return waiting()

    board.before_change = pulled
    board.serial.inWaiting = in_waiting


SCENES = {"record": Record, "pull": Pull, "flash": Flash}
KINDS = [(verb, fault) for verb in SCENES for fault in ("kill", "full", "cable", "term")]
KINDS += [(verb, fault) for verb in ("import", "smooth", "plot") for fault in ("kill", "full", "term")]


@pytest.mark.parametrize(
    ("verb", "fault", "count"),
    [
        *((*kind, FAST) for kind in OFTEN),
        *(pytest.param(*kind, ALL, marks=pytest.mark.nightly) for kind in KINDS),
    ],
)
def test_no_existing_file_is_lost(verb, fault, count, source, tmp_path):
    """The nightly run tests 21 pairs of a command and a fault, with 10 random moments each."""
    chance = random.Random(f"{verb} {fault}")

    def scene(k):
        place = tmp_path / str(k)
        place.mkdir()
        (place / "flash").mkdir()
        return SCENES[verb](place) if verb in SCENES else Computed(place, source, verb)

    usual_s = in_a_fork(scene("usual"), "none", 1.0)
    lost = []
    for k in range(count):
        tried = scene(k)
        in_a_fork(tried, fault, chance.random(), usual_s)
        lost += tried.lost()
        if fault != "kill":
            lost += [f"{path.name} was left" for path in tried.out.glob(".*")]
    assert lost == []


def test_a_killed_command_that_writes_in_place_loses_data(source, tmp_path, monkeypatch):
    """A command without a temporary file loses an earlier result, so the test above can fail."""

    @contextlib.contextmanager
    def in_place(path):
        yield path

    monkeypatch.setattr(output, "whole_file", in_place)
    lost = []
    for k in range(3):
        (tmp_path / str(k)).mkdir()
        tried = Computed(tmp_path / str(k), source, "smooth")
        in_a_fork(tried, "full", 0.3 + 0.1 * k)
        lost += tried.lost()
    assert lost
