"""Runs trips on the simulated board, keeps tallies of them, and records broken invariants.

The calibration is not lost, memory does not grow, and the program does not end. Watch has further invariants.
__main__.py prints the tallies, and fails if an invariant was broken.
"""

import gc
import io
import os
import random
import re
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable
from contextlib import redirect_stdout
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from kickstand_sim.simulated_board.lcd import shown_lean
from kickstand_sim.simulated_board.simulator import Board
from kickstand_sim.simulation.scripted.sensor_errors import Sensor

from .trip import QUIET_S, SENSOR, Trip, make_trip

LOOK_S = 0.1
WRONG_DEG, WRONG_S = 10.0, 5.0  # a lean with an error over WRONG_DEG may be shown for at most WRONG_S
LAG_S = 0.6  # a shown lean is right if it was the true lean at some moment of the last LAG_S seconds
STILL_S = 2.0  # time without a transfer to the sensor after which the program counts as hanging
# Longest time for which a lean may be shown without new readings: half a second, and the time for a page and a check
STALE_S = 0.7
SAYS_WHY = re.compile("No sensor|Sensor |Readings lost|Kickstand|Lean  --")


class Watch:
    """Checks the invariants during a trip.

    violations: One line per broken invariant.
    wrong_s: Longest time for which a lean with an error over WRONG_DEG was shown.
    error_deg: Largest error that was shown for a second.
    stale_s: Longest time for which a lean was shown while no sample was read.
    without_s: Longest time without a lean while the bike was riding without a fault.
    changes: Number of changes of the display.
    """

    def __init__(self, board: Board, trip: Trip, readings: Callable[[], int]) -> None:
        self.violations: list[str] = []
        self.wrong_s = self.error_deg = self.stale_s = self.without_s = 0.0
        self.changes = 0
        self._board, self._trip, self._readings = board, trip, readings
        self._text = ["", ""]
        self._wrong_since: float | None = None
        self._errors: list[float] = []
        self._read = (0, 0.0)
        self._transfers = (0, 0.0)
        self._why_since: float | None = None
        board.every(LOOK_S, self._look)

    def _report(self, fault: str) -> None:
        line = f"{fault} at {self._board.clock.now_us / 1e6:.1f} s: {'|'.join(self._text)}"
        if not self.violations or self.violations[-1].split(" at ")[0] != fault:
            self.violations.append(line)

    def _look(self) -> None:
        t_s = self._board.clock.now_us / 1e6
        if t_s > self._trip.until_s:
            return
        text = self._board.lcd.text()
        if text != self._text:
            self._text = text
            self.changes += 1
        if text[0].startswith(("Error", "Incomplete", "config.py")):
            self._report("the program has failed")
        busy = self._during_fault(t_s)
        self._alive(t_s, busy)
        lean = shown_lean(text)
        self._accurate(t_s, lean)
        self._fresh(t_s, lean)
        self._explained(t_s, text[0])

    def _during_fault(self, t_s: float) -> bool:
        return any(begin <= t_s < end for _, begin, end in self._trip.faults)

    def _alive(self, t_s: float, busy: bool) -> None:
        count = self._board.sensor_bus.transfers.get(SENSOR, 0)
        if count != self._transfers[0] or busy:
            self._transfers = (count, t_s)
        elif t_s - self._transfers[1] > STILL_S:
            self._report("the program hangs")

    def _accurate(self, t_s: float, lean: float | None) -> None:
        error = 0.0
        if lean is not None:
            error = min(abs(lean - self._trip.ride.truth(max(0.0, t_s - k * LAG_S / 6))[0]) for k in range(7))
        self._errors = [*self._errors[-9:], error]
        self.error_deg = max(self.error_deg, min(self._errors))
        if error <= WRONG_DEG:
            self._wrong_since = None
            return
        self._wrong_since = self._wrong_since if self._wrong_since is not None else t_s
        self.wrong_s = max(self.wrong_s, t_s - self._wrong_since)
        if self.wrong_s > WRONG_S and t_s - self._wrong_since > WRONG_S:
            self._report("a wrong lean is shown as good")

    def _fresh(self, t_s: float, lean: float | None) -> None:
        """Check that a lean disappears when no more readings arrive, unless the display cannot be reached."""
        count = self._readings()
        # The program cannot change the display if the display does not answer or the program gets no processor time
        excused = any(
            begin <= t_s < end + (QUIET_S if "display" in name else 0.0)
            for name, begin, end in self._trip.faults
            if "display" in name or name == "FIFO overflows"
        )
        if count != self._read[0] or lean is None or excused:
            self._read = (count, t_s)
            return
        self.stale_s = max(self.stale_s, t_s - self._read[1])
        if t_s - self._read[1] > STALE_S:
            self._report("an old lean is shown")

    def _explained(self, t_s: float, line: str) -> None:
        """Check that the lean replaces a fault's message when the fault is over."""
        if self._trip.ride.truth(t_s)[1] < 4.0 or self._during_fault(t_s) or not SAYS_WHY.match(line):
            self._why_since = None
            return
        self._why_since = self._why_since if self._why_since is not None else t_s
        self.without_s = max(self.without_s, t_s - self._why_since)
        if t_s - self._why_since > 10.0 and not line.startswith("Lean"):
            self._report("a fault is over and still shown")


# Number of trips with the same bike. The next bike has another sensor, mounting and speed source, and an empty flash
TRIPS_WITH_A_BIKE = 8
# Limits of the sensor's errors, as a share of the data sheet's limits. The six positions calibrate offset and scale
# before the first trip
PART_SHARE = 0.5
WHO_AM_I, RANGE_G = 0x68, 8
WARM_TRIPS = 3  # trips in which memory may grow, because modules are imported when they are first needed
# Largest growth from a trip's second minute to its end, in memory blocks. The recording of a ride uses a few hundred
# blocks
MAX_GROWTH = 3000


@dataclass
class Tallies:
    """Counts and worst figures of all trips."""

    seed: int  # seed of the random numbers
    hours: float = 0.0  # simulated time
    trips: int = 0  # number of trips
    rides: Counter[str] = field(default_factory=Counter)  # number of trips with each kind of ride
    faults: Counter[str] = field(default_factory=Counter)  # number of faults, by name
    presses: int = 0  # number of presses
    saves_cut: int = 0  # number of times the power was cut while a calibration was saved
    alignments: int = 0  # number of trips that aligned a bike for the first time
    pages: int = 0  # number of changes of the display
    worst: dict[str, float] = field(default_factory=dict)  # largest value of each figure, by name
    host_s: float = 0.0  # time on this computer
    violations: list[str] = field(default_factory=list)  # one line per broken invariant

    def keep_worst(self, name: str, value: float) -> None:
        """Keep the value if it is the largest value with this name."""
        self.worst[name] = max(self.worst.get(name, 0.0), value)


class SoakBoard:
    """A board with its sensor and its config.py. flash: the directory used as its flash."""

    def __init__(self, chance: random.Random, flash: Path) -> None:
        self.flash = flash
        self.part = Sensor(seed=chance.randrange(10**6), share=PART_SHARE)
        self.speed = chance.choice((None, None, "gps", "wheel"))
        self.config = {
            "SPEED": self.speed,
            "SAMPLE_HZ": chance.choice((50, 100, 200, 200)),
            "RECORD": chance.random() < 0.4,
        }
        if self.config["SAMPLE_HZ"] < 200:
            self.config["DLPF"] = 4 if self.config["SAMPLE_HZ"] == 100 else 5
        self.aligned = False  # True if the flash has an alignment

    def store(self) -> Any:
        from kickstand.calibration.store import Store

        return Store(WHO_AM_I, RANGE_G, str(self.flash))

    def do_six_positions(self) -> None:
        """Store a calibration by six positions, as if the rider did them before mounting the sensor on the bike."""
        from kickstand.calibration.parameters import Calibration

        calibration = Calibration()
        calibration.six_done = True
        calibration.set_accel(
            [-o / s for o, s in zip(self.part.accel_offset_g, self.part.accel_scale, strict=True)],
            [1.0 / s for s in self.part.accel_scale],
        )
        self.store().save(calibration)


def soak(hours: float, seed: int = 1, say: Callable[[str], None] = lambda line: None) -> Tallies:
    """Run trips. The same seed gives the same trips. All files are in a temporary directory.

    hours: total time on the board's clock. say: function that is called with the progress after each of these hours.
    """
    figures = Tallies(seed)
    begun, said_h = time.monotonic(), 0.0
    chance = random.Random(seed)
    bike: SoakBoard | None = None
    directory = os.getcwd()
    with tempfile.TemporaryDirectory() as folder:
        try:
            while figures.hours < hours:
                if figures.trips % TRIPS_WITH_A_BIKE == 0:
                    flash = Path(folder, str(figures.trips))
                    flash.mkdir()
                    os.chdir(flash)
                    bike = SoakBoard(chance, flash)
                    with _board_of(bike, None):
                        bike.do_six_positions()
                assert bike
                _run(bike, make_trip(chance, bike.speed, bike.aligned), figures)
                figures.host_s = time.monotonic() - begun
                if figures.hours >= said_h + 1.0:
                    said_h = figures.hours
                    say(f"{said_h:.1f} h in {figures.host_s:.0f} s, {len(figures.violations)} findings")
        finally:
            os.chdir(directory)
    return figures


def _board_of(bike: SoakBoard, trip: Trip | None) -> Board:
    world = bike.part.world(trip.ride.motion) if trip else (lambda t_s: (0.0, 0.0, 1.0, 0.0, 0.0, 0.0))
    board = Board(world)
    if trip:

        def speed(t_s: float) -> float:
            return trip.ride.truth(t_s)[1]

        if bike.speed == "gps":
            board.fit_gps(speed, faults=trip.gps_faults)
        elif bike.speed == "wheel":
            board.fit_wheel(speed)
    return board


def _run(bike: SoakBoard, trip: Trip, figures: Tallies) -> None:
    """Run one trip, from power-on to power-off, and record its results."""
    board = _board_of(bike, trip)
    readings = 0
    for at_s, for_s in trip.presses:
        board.press(at_s, for_s)
    for method, arguments in trip.calls:
        getattr(board.faults, method)(*arguments)
    watch = Watch(board, trip, lambda: readings)
    blocks: list[int] = []
    board.every(60.0, lambda: blocks.append(_blocks()))
    console = io.StringIO()
    gc.collect()
    gc.freeze()  # the app often collects garbage. Scanning all earlier objects would take too long
    try:
        with board, redirect_stdout(console):
            from kickstand import settings, start
            from kickstand.imu import mpu6050

            def counted(frames: Any, n: int, sums: Any, repeats: Any) -> int:
                nonlocal readings
                readings += n
                return add_up(frames, n, sums, repeats)

            add_up, load = mpu6050.add_up, settings.load
            mpu6050.add_up = counted
            settings.load = lambda: settings.Settings(type("Config", (), bike.config))
            try:
                if trip.cut_save is not None:
                    board.faults.cut_file(".cal", trip.cut_save)
                end = board.run(start.main, trip.until_s)
                saves_cut = board.faults.files_cut
            finally:
                mpu6050.add_up, settings.load = add_up, load
        if end != "off":
            watch.violations.append(f"the board ended with {end!r} at {board.clock.now_us / 1e6:.1f} s")
    except Exception as error:
        watch.violations.append(f"{type(error).__name__}: {error}")
        saves_cut = 0
    finally:
        gc.unfreeze()
    if "Traceback" in console.getvalue():
        watch.violations.append("a traceback: " + console.getvalue()[-400:])
    lasted_s = board.clock.now_us / 1e6
    if len(blocks) > 2 and figures.trips >= WARM_TRIPS:
        growth = blocks[-1] - blocks[1]
        figures.keep_worst("memory_growth_blocks", growth)
        if growth > MAX_GROWTH:
            watch.violations.append(f"memory has grown by {growth} blocks")
    _check_calibration(bike, watch, figures)
    _count(figures, trip, watch, lasted_s, saves_cut)


def _blocks() -> int:
    """Return the number of memory blocks in use."""
    gc.collect()
    return sys.getallocatedblocks()


def _check_calibration(bike: SoakBoard, watch: Watch, figures: Tallies) -> None:
    """Check that the board still has a calibration, its old one or a new one. The power may have been cut in a save."""
    calibration = bike.store().load()
    if bike.aligned and not calibration.aligned:
        watch.violations.append("the alignment is lost")
    if not calibration.six_done:
        watch.violations.append("the six positions are lost")
    if calibration.aligned and not bike.aligned:
        figures.alignments += 1
    bike.aligned = calibration.aligned


def _count(figures: Tallies, trip: Trip, watch: Watch, lasted_s: float, saves_cut: int) -> None:
    figures.trips += 1
    figures.hours += lasted_s / 3600
    figures.rides[trip.kind] += 1
    figures.faults.update(name for name, at_s, _ in trip.faults if at_s < lasted_s)
    figures.presses += sum(at_s < lasted_s for at_s, _ in trip.presses)
    figures.saves_cut += saves_cut
    figures.pages += watch.changes
    for name in ("wrong_s", "error_deg", "stale_s", "without_s"):
        figures.keep_worst(name, getattr(watch, name))
    figures.violations += [f"trip {figures.trips} ({trip.kind}): {line}" for line in watch.violations]
