"""The commands of `kickstand` that read a recorded ride: replay, smooth, report, plot, export, cut."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
from kickstand.errors import Notice

from .common import TIME, on_right_handed_axes, warn

if TYPE_CHECKING:
    from ..logs.reader import Source

_PATH = click.Path(path_type=Path)
_OUT = click.option("--out", required=True, type=_PATH, help="The file to write.")
_CALIBRATION = click.option("--calibration", type=_PATH, help="A CAL.json; if not given, the one beside the ride.")
_FROM = click.option(
    "--from", "from_s", type=TIME, metavar="TIME", help="Leave out what is before: seconds from the beginning, or 1:30."
)
_TO = click.option(
    "--to", "to_s", type=TIME, metavar="TIME", help="Leave out what is after; a negative time counts from the end."
)


_LIVE = click.option("--live", is_flag=True, help="The lean that the display showed, not the smoothed one.")


def _stretch(command: Callable[..., Any]) -> Callable[..., Any]:
    return _FROM(_TO(command))


@click.command(short_help="Find the lean as the firmware shows it during the ride.")
@click.argument("log", type=_PATH, metavar="LOG.csv")
@_CALIBRATION
@_stretch
@click.option("--engine", type=click.Choice(["cpython", "micropython", "rp2040"]), default="cpython")
@_OUT
@on_right_handed_axes
def replay(
    log: Path, calibration: Path | None, from_s: float | None, to_s: float | None, engine: str, out: Path
) -> None:
    """Run the firmware's own lean meter over a recorded log."""
    from ..calibration.file import calibration_beside, read_calibration
    from ..output import check_output
    from ..progress import Bar
    from ..replay.replay import replay_to_csv

    calibration = calibration or calibration_beside(log)
    check_output(out, [log, calibration])
    parameters = read_calibration(calibration)
    with Bar("replaying") as bar:
        count, notices = replay_to_csv(_part(log, from_s, to_s), parameters, engine, out, bar.reach)
    warn(log, notices)
    if not parameters.aligned:
        click.echo(
            f"warning: {calibration} is not aligned: this is the lean of the sensor, not of the bike",
            err=True,
        )
    click.echo(f"written: {out}, {count} samples")


@click.command(short_help="Find the lean afterwards, from the whole ride.")
@click.argument("ride", type=_PATH, metavar="RIDE.csv")
@_CALIBRATION
@_stretch
@_OUT
@on_right_handed_axes
def smooth(ride: Path, calibration: Path | None, from_s: float | None, to_s: float | None, out: Path) -> None:
    """Find the lean afterwards, from the whole ride, each sample with its standard deviation."""
    from ..calibration.file import calibration_beside, read_calibration
    from ..output import check_output
    from ..progress import Bar
    from ..smoothing.smooth import smooth_to_csv

    calibration = calibration or calibration_beside(ride)
    check_output(out, [ride, calibration])
    parameters = read_calibration(calibration)
    with Bar("smoothing") as bar:
        count, notices = smooth_to_csv(_part(ride, from_s, to_s), parameters, out, bar.reach)
    warn(ride, notices)
    click.echo(f"written: {out}, {count} samples")


@click.command(short_help="Write a ride for another program.")
@click.argument("ride", type=_PATH, metavar="RIDE.csv")
@click.option("--to", "form", required=True, type=click.Choice(["csv", "gpx", "vbo", "racechrono", "parquet"]))
@_CALIBRATION
@_LIVE
@_OUT
@on_right_handed_axes
def export(ride: Path, form: str, calibration: Path | None, live: bool, out: Path) -> None:
    """Write a ride as maps (gpx), Circuit Tools (vbo), RaceChrono or data frames (parquet, csv) open it.

    The lean is the smoothed one: from the whole ride, and nearer to the truth than what the display showed.
    """
    from ..analysis.export.export import export
    from ..analysis.ride import open_ride
    from ..calibration.file import calibration_beside
    from ..output import check_output
    from ..progress import Bar

    calibration = calibration or calibration_beside(ride)
    check_output(out, [ride, calibration])
    notices: list[Notice] = []
    with Bar("exporting") as bar:
        count = export(open_ride(ride, calibration, smoothed=not live), form, out, bar.reach, notices)
    warn(ride, notices)
    click.echo(f"written: {out}, {count} rows")


@click.command(short_help="Print maxima, time at large leans, and brake tests.")
@click.argument("ride", type=_PATH, metavar="RIDE.csv")
@_CALIBRATION
@_stretch
@_LIVE
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
@on_right_handed_axes
def report(
    ride: Path, calibration: Path | None, from_s: float | None, to_s: float | None, live: bool, as_json: bool
) -> None:
    """A ride in a page: maxima, time at large leans, and each stop as a brake test has it.

    The lean is the smoothed one: from the whole ride, and nearer to the truth than what the display showed.
    """
    from rich.console import Console

    from ..analysis.overview import overview
    from ..analysis.report import as_data, page
    from ..analysis.ride import open_ride
    from ..progress import Bar

    with Bar("reading") as bar:
        seen = overview(open_ride(_part(ride, from_s, to_s), calibration, smoothed=not live), bar.reach)
    warn(ride, seen.notices)
    if as_json:
        click.echo(json.dumps(as_data(seen)))
    else:
        Console().print(page(seen))


@click.command(short_help="Draw a ride, as a picture and as a page to zoom into.")
@click.argument("ride", type=_PATH, metavar="RIDE.csv")
@_CALIBRATION
@_stretch
@click.option("--tiles", is_flag=True, help="Streets below the track: the page asks a server for them when it is open.")
@_LIVE
@click.option("--out", required=True, type=_PATH, help="The directory to write to.")
@on_right_handed_axes
def plot(
    ride: Path,
    calibration: Path | None,
    from_s: float | None,
    to_s: float | None,
    tiles: bool,
    live: bool,
    out: Path,
) -> None:
    """Draw a ride: a picture (PNG) and a page to zoom into (HTML).

    The lean is the smoothed one: from the whole ride, and nearer to the truth than what the display showed.
    """
    from ..analysis.overview import overview
    from ..analysis.plot import plot
    from ..analysis.ride import open_ride
    from ..progress import Bar, spinner

    plot.check(out)
    with Bar("reading") as bar:
        seen = overview(open_ride(_part(ride, from_s, to_s), calibration, smoothed=not live), bar.reach)
    warn(ride, seen.notices)
    with spinner("drawing"):
        written = list(plot.draw(seen, out, tiles))
    for path in written:
        click.echo(f"written: {path}")


@click.command(short_help="Cut a stretch out of a log.")
@click.argument("log", type=_PATH, metavar="LOG.csv")
@_stretch
@_OUT
def cut(log: Path, from_s: float | None, to_s: float | None, out: Path) -> None:
    """Cut a stretch out of a log: a still pose for calibrate two or six, or one ride of several."""
    from ..logs.cut import cut_log
    from ..output import check_output
    from ..progress import Bar

    if from_s is None and to_s is None:
        raise click.UsageError("Give --from, --to or both: seconds from the beginning of the log.")
    check_output(out, [log])
    notices: list[Notice] = []
    with Bar("cutting") as bar:
        count, seconds = cut_log(log, out, from_s, to_s, bar.reach, notices)
    warn(log, notices)
    click.echo(f"written: {out}, {count} samples, {seconds:.1f} s")


def _part(log: Path, from_s: float | None, to_s: float | None) -> "Source":
    from ..logs.stretch import Stretch

    return log if from_s is None and to_s is None else Stretch(log, from_s, to_s)
