"""The commands of `kickstand` that talk to a board: flash, status, check, pull, record."""

import contextlib
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import click
from rich.console import Console
from rich.live import Live

from ..common import installation
from ..common.messages import InputError
from ..deploy.check import check
from ..deploy.flash import flash
from ..deploy.status import status
from ..rides.pull import PulledRide, pull
from ..rides.stream import LiveReading, record
from .common import OUT, PATH, PORT, Bar, echo, warning

_NAMED_ONE_BY_ONE = 5


@click.command()
@PORT
@click.option("--config", is_flag=True, help="Also replace the board's config.py, which is otherwise kept.")
@click.option("--yes", is_flag=True, help="Rename files of another project on the board without asking.")
def flash_command(port: str | None, config: bool, yes: bool) -> None:
    """Copy the firmware to a board, and start it. The board must run MicroPython."""
    with Bar("") as bar:
        result = flash(port, config, bar.reach_in, agree=None if yes else _agree)
    echo(f"{result.board} on {result.port}")
    for line in result.others:
        echo(f"kept: {line}")
    if result.config:
        echo(f"config.py is {result.config}")
        if installation.installed() and result.config.parent == installation.firmware():
            echo("to change settings, copy that file to a folder of your own, edit it, and run this command there")
    for setting in result.unused:
        echo(f"note: {setting} is not used, because a '#' is in front of it: remove it, and flash --config")
    if result.why_sources:
        echo(f"note: {result.why_sources}: the board gets the sources and starts more slowly")
    update = result.update
    if update.config_differs:
        echo("kept: config.py on the board is not this version's; --config would replace it")
    if len(update.obsolete) > _NAMED_ONE_BY_ONE:
        echo(f"removed: {len(update.obsolete)} files that are no longer part of the firmware")
    else:
        for path in update.obsolete:
            echo(f"removed: {path[1:]} is no longer part of the firmware")
    echo(
        f"copied {len(update.copy)} files, {sum(map(len, update.copy.values())) / 1000:.1f} kB, and verified them; "
        f"{len(update.keep)} left as they were"
    )
    echo("restarted: the display shows the rest")


def _agree(lines: list[str]) -> None:
    """Ask the user for permission to rename files on the board. Raises InputError if the user refuses."""
    if not sys.stdin.isatty():
        raise InputError(f"{'; '.join(lines)}: run kickstand flash --yes for that")
    for line in lines:
        echo(line, err=True)
    if not click.confirm("Install Kickstand on this board?", err=True):
        raise InputError("nothing was changed on the board")


@click.command()
@PORT
@click.option("--wirings", is_flag=True, help="If a character display stays blank, try each LCD_WIRING on it.")
def status_command(port: str | None, wirings: bool) -> None:
    """Show a board's versions, settings, sensor, display and calibration."""
    echo(status(port, wirings))


@click.command()
@PORT
def check_command(port: str | None) -> None:
    """Measure a board and everything wired to it, in two minutes.

    Each figure is printed with its limit. Keep the sensor still. The exit status is 1 if a figure exceeds its limit."""
    checked = check(port, echo)
    echo(checked.verdict)
    if checked.faults:
        raise click.exceptions.Exit(1)


@click.command()
@PORT
@click.option("--out", type=PATH, default=Path(), help="The directory to write to. Default: the current one.")
@click.option("--delete", is_flag=True, help="Delete completely fetched rides from the board.")
def pull_command(port: str | None, out: Path, delete: bool) -> None:
    """Fetch the rides that a board has recorded. Each ride is a log with its calibration."""

    def say(ride: PulledRide) -> None:
        for problem in ride.problems:
            warning(problem)
        if ride.log:
            echo(f"written: {ride.log}, {ride.seconds / 60:.1f} min, {ride.readings} readings")
        if ride.deleted:
            echo(f"deleted from the board: ride {ride.number}")
        elif delete:
            warning(f"ride {ride.number}: not deleted from the board, because it was not fetched completely")

    with Bar("") as bar:
        result = pull(port, out, delete, bar.reach_in, say)
    if not result.rides:
        echo(f"no rides on the board at {result.port}: start one with Record ride in its menu")


@click.command()
@PORT
@OUT
def record_command(port: str | None, out: Path) -> None:
    """Write a log live over USB until Ctrl-C. The board's display continues to work."""
    with contextlib.ExitStack() as stack:
        show: list[Callable[[str], None]] = []

        def begin(name: str) -> None:
            echo(f"recording from {name}: press Ctrl-C to stop")
            show.append(stack.enter_context(_live_line()))

        result = record(port, out, begin, lambda reading: show[0](_live_text(reading)))
    for note in result.notes:
        warning(note)
    echo(f"written: {result.log}, {result.seconds:.1f} s, {result.readings} readings, and {result.calibration.name}")


@contextlib.contextmanager
def _live_line() -> Iterator[Callable[[str], None]]:
    """A context that gives a function to redraw a line on standard error, if that is a terminal."""
    console = Console(stderr=True) if sys.stderr.isatty() else Console(quiet=True)
    line = Live(console=console, auto_refresh=False, transient=True)

    def show(text: str) -> None:
        with contextlib.suppress(OSError):
            line.update(text, refresh=True)

    line.start()
    try:
        yield show
    finally:
        with contextlib.suppress(OSError):
            line.stop()


def _live_text(reading: LiveReading) -> str:
    """Format a reading as one line, with the lean as a bar to the left or right, or in a car with the forces."""
    how_long = f"{reading.rate_hz:3.0f} readings/s  {reading.seconds // 60:.0f}:{reading.seconds % 60:04.1f}"
    _, lean, forward_g, left_g = reading.moments[-1] if reading.moments else (None, None, None, None)
    if left_g is not None:  # only an aligned car has this value
        side = "left " if left_g > 0.0 else "right"
        return f"forward {forward_g:+.2f} g  {side} {abs(left_g):.2f} g  {how_long}"
    if lean is None:  # an uncertain lean is not shown, as on the display
        return f"{'lean --' if reading.aligned else 'not aligned'}  {how_long}"
    bar = "#" * min(20, round(abs(lean) / 3))
    picture = f"{bar if lean < 0 else '':>20}|{bar if lean > 0 else '':<20}"
    return f"{picture} lean {lean:+5.1f} deg  forward {forward_g:+.2f} g  {how_long}"
