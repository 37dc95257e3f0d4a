"""Runs trips on the simulated board, keeps tallies of them, and records broken invariants.

The invariants of this module are: the calibration is not lost, memory does not grow, and the program does not end.
watch.py has further invariants. __main__.py prints the tallies, and fails if an invariant was broken.
"""

import gc
import io
import os
import random
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable
from contextlib import redirect_stdout
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from kickstand_tools.simulated_board.simulator import Board
from kickstand_tools.simulation.scripted.sensor_errors import Sensor

from .trip import Trip, make_trip
from .watch import Watch

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
    found: list[str] = field(default_factory=list)  # one line per broken invariant

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
                    say(f"{said_h:.1f} h in {figures.host_s:.0f} s, {len(figures.found)} findings")
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
            watch.found.append(f"the board ended with {end!r} at {board.clock.now_us / 1e6:.1f} s")
    except Exception as error:
        watch.found.append(f"{type(error).__name__}: {error}")
        saves_cut = 0
    finally:
        gc.unfreeze()
    if "Traceback" in console.getvalue():
        watch.found.append("a traceback: " + console.getvalue()[-400:])
    lasted_s = board.clock.now_us / 1e6
    if len(blocks) > 2 and figures.trips >= WARM_TRIPS:
        growth = blocks[-1] - blocks[1]
        figures.keep_worst("memory_growth_blocks", growth)
        if growth > MAX_GROWTH:
            watch.found.append(f"memory has grown by {growth} blocks")
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
        watch.found.append("the alignment is lost")
    if not calibration.six_done:
        watch.found.append("the six positions are lost")
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
    figures.found += [f"trip {figures.trips} ({trip.kind}): {line}" for line in watch.found]
