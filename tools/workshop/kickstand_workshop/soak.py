"""Tests the firmware on the simulated board for hours, with random rides, faults and presses.

    python -m kickstand_workshop.soak --hours 24 --seed 1

trip.py makes a random trip. Watch checks invariants during a trip. After a trip the calibration must not be lost,
memory must not have grown, and the program must not have ended. The program prints a table and the broken invariants.
The exit status is 1 if an invariant was broken.
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
from contextlib import chdir, redirect_stdout
from dataclasses import dataclass, field
from typing import Any

import click
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
EXPLAINED_S = 10.0  # longest time for which a fault's message may stay after the fault
SAYS_WHY = re.compile("No sensor|Sensor |Readings lost|Kickstand|Lean  --")
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
WORST = {
    "wrong_s": "longest time of a lean over 10 degrees wrong, s",
    "error_deg": "largest error that stood for a second, degrees",
    "stale_s": "longest time of a lean without readings, s",
    "without_s": "longest time without a lean while riding, s",
    "memory_growth_blocks": "growth of memory in a trip, blocks",
}


class Watch:
    """Checks the invariants during a trip."""

    def __init__(self, board: Board, trip: Trip) -> None:
        self.violations: list[str] = []  # one line per broken invariant
        self.worst = dict.fromkeys(WORST, 0.0)  # largest value of each figure
        self.changes = 0  # of the display
        self._board, self._trip = board, trip
        self._t_s, self._text = 0.0, ["", ""]
        self._errors: list[float] = []
        self._counts = (0, 0)  # transfers to the sensor and readings at the last look
        self._since: dict[str, float] = {}  # last look at which a condition did not hold, by its name
        board.every(LOOK_S, self._look)

    def _lasts(self, name: str, holds: bool) -> float:
        """Return for how long a condition has held."""
        if not holds:
            self._since[name] = self._t_s
        return self._t_s - self._since.get(name, 0.0)

    def _note(self, name: str, value: float) -> None:
        self.worst[name] = max(self.worst[name], value)

    def _report(self, fault: str) -> None:
        if not self.violations or self.violations[-1].split(" at ")[0] != fault:
            self.violations.append(f"{fault} at {self._t_s:.1f} s: {'|'.join(self._text)}")

    def _look(self) -> None:
        """Check all invariants at this moment."""
        self._t_s = self._board.clock.now_us / 1e6
        if self._t_s > self._trip.until_s:
            return
        text = self._board.lcd.text()
        self.changes += text != self._text
        self._text = text
        if text[0].startswith(("Error", "Incomplete", "config.py")):
            self._report("the program has failed")
        faulty = any(begin <= self._t_s < end for _, begin, end in self._trip.faults)
        lean = shown_lean(text)
        self._check_readings(lean, faulty)
        self._check_accuracy(lean)
        self._check_message(text[0], faulty)

    def _check_readings(self, lean: float | None, faulty: bool) -> None:
        """Check that the program asks the sensor, and shows a lean only with new readings."""
        sensor = self._board.sensor
        counts = self._board.sensor_bus.transfers.get(SENSOR, 0), sensor.fifo.bytes_read + sensor.tally().read
        is_idle, is_stale = (count == previous for count, previous in zip(counts, self._counts))
        self._counts = counts
        if self._lasts("idle", is_idle and not faulty) > STILL_S:
            self._report("the program hangs")
        stale_s = self._lasts("stale", is_stale and lean is not None and not self._display_is_excused())
        self._note("stale_s", stale_s)
        if stale_s > STALE_S:
            self._report("an old lean is shown")

    def _check_accuracy(self, lean: float | None) -> None:
        """Check the shown lean. It may be as old as LAG_S. An error must last for a second to count."""
        error = 0.0
        if lean is not None:
            truths = (self._trip.ride.truth(max(0.0, self._t_s - k * LAG_S / 6)) for k in range(7))
            error = min(abs(lean - true.lean_deg) for true in truths)
        self._errors = [*self._errors[-9:], error]
        self._note("error_deg", min(self._errors))
        wrong_s = max(0.0, self._lasts("wrong", error > WRONG_DEG) - LOOK_S)
        self._note("wrong_s", wrong_s)
        if wrong_s > WRONG_S:
            self._report("a wrong lean is shown as good")

    def _check_message(self, line: str, faulty: bool) -> None:
        """Check that a message does not replace the lean of a riding bike long after a fault."""
        says_why = SAYS_WHY.match(line) is not None and not faulty and self._trip.ride.truth(self._t_s).speed_mps >= 4.0
        without_s = max(0.0, self._lasts("without", says_why) - LOOK_S)
        self._note("without_s", without_s)
        if without_s > EXPLAINED_S and not line.startswith("Lean"):
            self._report("a fault is over and still shown")

    def _display_is_excused(self) -> bool:
        """Return True if the program cannot change the display: it does not answer, or the program gets no time."""
        return any(
            begin <= self._t_s < end + (QUIET_S if "display" in name else 0.0)
            for name, begin, end in self._trip.faults
            if "display" in name or name == "FIFO overflows"
        )


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

    def count(self, trip: Trip, watch: Watch, lasted_s: float) -> None:
        """Add a trip that has ended after lasted_s."""
        self.trips += 1
        self.hours += lasted_s / 3600
        self.rides[trip.kind] += 1
        self.faults.update(name for name, at_s, _ in trip.faults if at_s < lasted_s)
        self.presses += sum(at_s < lasted_s for at_s, _ in trip.presses)
        self.pages += watch.changes
        self.worst = {name: max(value, self.worst.get(name, 0.0)) for name, value in watch.worst.items()}
        self.violations += [f"trip {self.trips} ({trip.kind}): {line}" for line in watch.violations]

    def table(self) -> str:
        """Format the tallies as a table in Markdown."""
        rows = [
            ("simulated time", f"{self.hours:.1f} h in {self.host_s / 60:.0f} minutes, seed {self.seed}"),
            ("trips", f"{self.trips}, of which {self.alignments} on a bike not aligned before"),
            *((f"rides: {name}", str(n)) for name, n in sorted(self.rides.items())),
            *((name, str(n)) for name, n in sorted(self.faults.items())),
            ("power cut in a save", str(self.saves_cut)),
            ("presses", str(self.presses)),
            ("changes of the display", str(self.pages)),
            *((words, f"{self.worst.get(name, 0.0):.1f}") for name, words in WORST.items()),
            ("found", str(len(self.violations))),
        ]
        return "\n".join(("| tried or seen | |", "|---|---|", *(f"| {name} | {value} |" for name, value in rows)))


class SoakBike:
    """A bike with its sensor, its speed source, its config.py and its flash, which is the current directory."""

    def __init__(self, chance: random.Random) -> None:
        self.part = Sensor(seed=chance.randrange(10**6), share=PART_SHARE)
        self.speed = chance.choice((None, None, "gps", "wheel"))
        sample_hz = chance.choice((50, 100, 200, 200))
        self.config = {"SPEED": self.speed, "SAMPLE_HZ": sample_hz, "RECORD": chance.random() < 0.4}
        if sample_hz < 200:
            self.config["DLPF"] = 4 if sample_hz == 100 else 5
        self.aligned = False  # True if the flash has an alignment
        with self.board():
            self._do_six_positions()

    def store(self) -> Any:
        from kickstand.calibration.store import Store

        return Store(WHO_AM_I, RANGE_G, os.getcwd())

    def _do_six_positions(self) -> None:
        """Store a calibration by six positions, which come before the mounting on the bike."""
        from kickstand.calibration.parameters import Calibration

        calibration = Calibration()
        calibration.six_done = True
        calibration.set_accel(
            [-o / s for o, s in zip(self.part.accel_offset_g, self.part.accel_scale, strict=True)],
            [1.0 / s for s in self.part.accel_scale],
        )
        self.store().save(calibration)

    def board(self, trip: Trip | None = None) -> Board:
        """Return a board on this bike. Without a trip the board lies at rest."""
        if trip is None:
            return Board(lambda t_s: (0.0, 0.0, 1.0, 0.0, 0.0, 0.0))
        board = Board(self.part.world(trip.ride.motion))
        if self.speed == "gps":
            board.fit_gps(lambda t_s: trip.ride.truth(t_s).speed_mps, faults=trip.gps_faults)
        elif self.speed == "wheel":
            board.fit_wheel(lambda t_s: trip.ride.truth(t_s).speed_mps)
        return board


def soak(hours: float, seed: int = 1, say: Callable[[str], None] = lambda line: None) -> Tallies:
    """Run trips for some hours on the board's clock. say() gets the progress after each hour.

    The same seed gives the same trips. All files are in a temporary directory.
    """
    figures = Tallies(seed)
    begun, said_h = time.monotonic(), 0.0
    chance = random.Random(seed)
    while figures.hours < hours:
        with tempfile.TemporaryDirectory() as flash, chdir(flash):
            bike = SoakBike(chance)
            for _ in range(TRIPS_WITH_A_BIKE):
                _run(bike, make_trip(chance, bike.speed, bike.aligned), figures)
                figures.host_s = time.monotonic() - begun
                if figures.hours >= said_h + 1.0:
                    said_h = figures.hours
                    say(f"{said_h:.1f} h in {figures.host_s:.0f} s, {len(figures.violations)} findings")
                if figures.hours >= hours:
                    break
    return figures


def _run(bike: SoakBike, trip: Trip, figures: Tallies) -> None:
    """Run the firmware during a trip, and add the trip to the figures."""
    board = bike.board(trip)
    for at_s, for_s in trip.presses:
        board.press(at_s, for_s)
    for method, arguments in trip.calls:
        getattr(board.faults, method)(*arguments)
    if trip.cut_save is not None:
        board.faults.cut_file(".cal", trip.cut_save)
    watch = Watch(board, trip)
    blocks: list[int] = []
    board.every(60.0, lambda: blocks.append(_blocks()))
    _run_firmware(board, trip.until_s, bike.config, watch.violations)
    figures.saves_cut += board.faults.files_cut
    if len(blocks) > 2 and figures.trips >= WARM_TRIPS:
        growth = watch.worst["memory_growth_blocks"] = blocks[-1] - blocks[1]
        if growth > MAX_GROWTH:
            watch.violations.append(f"memory has grown by {growth} blocks")
    # The board must have a calibration, its old one or a new one. The power may have been cut in a save
    calibration = bike.store().load()
    if bike.aligned and not calibration.aligned:
        watch.violations.append("the alignment is lost")
    if not calibration.six_done:
        watch.violations.append("the six positions are lost")
    figures.alignments += calibration.aligned and not bike.aligned
    bike.aligned = calibration.aligned
    figures.count(trip, watch, board.clock.now_us / 1e6)


def _run_firmware(board: Board, until_s: float, config: dict[str, Any], violations: list[str]) -> None:
    """Run the firmware until the power cut. Add to the violations if it ends earlier or prints a traceback."""
    console = io.StringIO()
    gc.collect()
    gc.freeze()  # the app often collects garbage. Scanning all earlier objects would take too long
    try:
        with board, redirect_stdout(console):
            end = board.run_firmware(until_s, **config)
        if end != "off":
            violations.append(f"the board ended with {end!r} at {board.clock.now_us / 1e6:.1f} s")
    except Exception as error:
        violations.append(f"{type(error).__name__}: {error}")
    finally:
        gc.unfreeze()
    if "Traceback" in console.getvalue():
        violations.append("a traceback: " + console.getvalue()[-400:])


def _blocks() -> int:
    gc.collect()
    return sys.getallocatedblocks()


@click.command(context_settings={"max_content_width": 120})
@click.option("--hours", default=24.0, show_default=True, help="Simulated hours.")
@click.option("--seed", default=1, show_default=True, help="Seed of the random numbers.")
def main(hours: float, seed: int) -> None:
    """Test the firmware on the simulated board for hours, with random rides, faults and presses."""
    figures = soak(hours, seed, say=lambda line: click.echo(line, err=True))
    click.echo(figures.table())
    for line in figures.violations:
        click.echo(line, err=True)
    sys.exit(1 if figures.violations else 0)


if __name__ == "__main__":
    main()
