"""The commands that read a recorded ride: import, join, compare, replay, smooth, report, plot, export, cut, overlay."""

import json
from collections.abc import Iterator
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import click
from rich.console import Console
from rich.table import Table

from ..analysis.export import export_with_notices
from ..analysis.overview import Overview, overview
from ..analysis.page import check_drawing, draw_ride
from ..analysis.report import as_data, page
from ..analysis.ride import Ride, calibration_beside, open_ride
from ..calibration.file import CalibrationFile, calibration_path, read_calibration
from ..checks.log import check_log
from ..common.messages import InputError, WrongAxes
from ..common.output import check_output, whole_file
from ..estimation.alignment import fit_ride
from ..estimation.smooth import smooth_to_csv
from ..imports.importing import NAMES, Imported, import_of_app, import_recording, write_imported
from ..joining import agreement
from ..joining.joined import Joined, join_track, write_joined
from ..joining.track import read_track
from ..logs.log import Log, Source, Stretch
from ..logs.reader import copy_rows, is_log, read_log
from ..overlay.overlay import overlay
from ..replay.replay import replay_to_csv
from . import common
from .common import Bar, spinner, with_bar


@click.command()
@common.file_argument("source", "FILE|DIR|ZIP")
@common.OUT_LOG
@click.option(
    "--columns",
    metavar="t=NAME,ax=NAME,...",
    help="For a table of an unknown format: the columns of t, ax, ay, az, gx, gy, gz; also speed, lat, lon, temp. "
    "#3 means the third column.",
)
@click.option(
    "--units",
    metavar="a=UNIT,g=UNIT,...",
    help="The units of t, a (or ax, ay, az), g (or gx, gy, gz) and speed. A - before the unit reverses the sign.",
)
@common.from_to(
    "Where to begin, in seconds; negative: before the end.", "Where to end, in seconds; negative: before the end."
)
@common.RIGHT_HANDED
@common.help_adds(
    f"Known: {', '.join(NAMES)}. In any other table of accelerations (with gravity) and rates of rotation, columns and "
    "units are found from the values. If some are uncertain, the command shows the --columns and --units to type. "
    "Raw counts of a sensor have the unit counts, or counts/131 for 131 counts per deg/s."
)
def import_command(
    source: Path, out: Path, columns: str | None, units: str | None, from_s: float | None, to_s: float | None
) -> None:
    """Convert a recording of another app or logger to a log."""
    check_output(out, _files(source))
    named = _pairs(columns, "--columns") if columns is not None else None
    with spinner("importing"):
        imported = import_recording(source, named, _pairs(units or "", "--units"), from_s, to_s)
        write_imported(out, imported)
    Console().print(_import_table(imported))
    common.print_lines(f"{column.quantity}: {column.why}" for column in imported.taken if column.why)
    common.warn(source, imported.notices)
    t_s, gaps_s = imported.log.t_s, imported.gaps_s
    count = "1 gap" if len(gaps_s) == 1 else f"{len(gaps_s)} gaps"
    gaps = f", {count} of {gaps_s.sum():.1f} s in all" if len(gaps_s) else ""
    common.echo(f"written: {out}, {len(t_s)} samples in {t_s[-1]:.1f} s, {imported.rate_hz:.0f} per second{gaps}")
    if imported.vehicle_axes:
        common.echo("x is left, y up, z forward, as far as the logger was mounted so")
    calibration = calibration_path(out)
    if calibration.exists():
        common.echo(f"{calibration} belongs to an earlier ride.")
        common.echo("If the sensor has been moved since, recalibrate: kickstand calibrate ride")
    elif imported.shortfalls:
        common.warn(source, imported.shortfalls)
    elif not any(isinstance(notice, WrongAxes) for notice in imported.notices):
        common.echo(f"next: kickstand calibrate ride {out} --out {calibration}")
        common.echo(f"      kickstand report {out}")
        common.echo(f"      kickstand plot {out} --out plots")


@click.command()
@common.RIDE
@common.file_argument("track", "TRACK.gpx|.fit")
@common.OUT_LOG
def join_command(ride: Path, track: Path, out: Path) -> None:
    """Add the track of a phone or a watch to a ride of a board without GPS.

    The time offset is found by matching the turns and accelerations of ride and track. The written log has the track's
    positions, times and speeds. A track of another ride is refused.
    """
    check_output(out, [ride, track])
    with spinner("reading the track"):
        points = read_track(track)
    joined = with_bar("reading", join_track, ride, points)
    common.warn(ride, joined.notices)
    count = with_bar("writing", write_joined, out, joined)
    common.print_lines(_joined_lines(joined))
    common.echo(f"written: {out}, {count} positions")
    if calibration_path(ride).is_file() and not calibration_path(out).exists():
        common.echo(f"next: kickstand report {out} --calibration {calibration_path(ride)}")


@click.command()
@common.file_argument("a", "A.csv")
@common.file_argument("b", "B.csv")
@click.option("--calibration-a", type=common.PATH, help="The CAL.json of A. Default: the file beside A.")
@click.option("--calibration-b", type=common.PATH, help="The CAL.json of B. Default: the file beside B.")
@click.option("--plot", "picture", type=common.PATH, metavar="FILE.png", help="Draw both leans and their difference.")
@common.JSON
@common.RIGHT_HANDED
def compare_command(
    a: Path, b: Path, calibration_a: Path | None, calibration_b: Path | None, picture: Path | None, as_json: bool
) -> None:
    """Compare the leans of two devices on one bike.

    Give two recordings of the same ride. The devices can be two phones, or a phone and the board. The clocks are
    aligned by matching the rates of rotation.
    """
    paths = [given or calibration_beside(log) for log, given in ((a, calibration_a), (b, calibration_b))]
    if picture is not None:
        agreement.check_picture(picture)
        check_output(picture, [a, b, *paths])
    of_a, of_b = (read_calibration(path) for path in paths)
    agreed = with_bar("comparing", agreement.compare_rides, a, b, of_a, of_b)
    for log, notices in zip((a, b), agreed.notices.values()):
        common.warn(log, notices)
    if picture is not None:
        with whole_file(picture) as path:
            agreement.draw(path, agreed)
    if as_json:
        common.echo(json.dumps(agreed.as_data()))
    else:
        common.print_lines(agreement.words(agreed))
        common.print_lines([f"written: {picture}"] if picture is not None else [])


@click.command()
@common.ride_or_export
@common.CALIBRATION
@common.STRETCH
@click.option("--engine", type=click.Choice(["cpython", "micropython", "rp2040"]), default="cpython")
@common.OUT
@common.RIGHT_HANDED
def replay_command(ride: Path, calibration: Path | None, engine: str, out: Path, **stretch: float | None) -> None:
    """Run the firmware's own lean meter over a recorded log."""
    _check_output(out, ride, calibration)
    log, parameters = _log_of(ride, calibration)
    count, notices = with_bar("replaying", replay_to_csv, _stretch(log, **stretch), parameters, engine, out)
    common.warn(ride, notices)
    if not parameters.aligned:
        common.warning(
            f"{calibration or calibration_path(ride)} is not aligned: this is the lean of the sensor, not of the bike"
        )
    common.echo(f"written: {out}, {count} samples")


@click.command()
@common.ride_or_export
@common.CALIBRATION
@common.STRETCH
@common.OUT
@common.RIGHT_HANDED
def smooth_command(ride: Path, calibration: Path | None, out: Path, **stretch: float | None) -> None:
    """Compute the lean afterwards from the whole ride. Each sample has a standard deviation."""
    _check_output(out, ride, calibration)
    log, parameters = _log_of(ride, calibration)
    count, notices = with_bar("smoothing", smooth_to_csv, _stretch(log, **stretch), parameters, out)
    common.warn(ride, notices)
    common.echo(f"written: {out}, {count} samples")


@click.command()
@common.ride_or_export
@common.CALIBRATION
@click.option("--to", "form", required=True, type=click.Choice(["csv", "gpx", "vbo", "racechrono", "parquet"]))
@common.live
@common.OUT
@common.RIGHT_HANDED
def export_command(ride: Path, form: str, calibration: Path | None, live: bool, out: Path) -> None:
    """Export a ride for another program.

    The programs are maps (gpx), Circuit Tools (vbo), RaceChrono, and data frames (parquet, csv).
    """
    _check_output(out, ride, calibration)
    count, notices = with_bar("exporting", export_with_notices, _opened(ride, calibration, live), form, out)
    common.warn(ride, notices)
    common.echo(f"written: {out}, {count} rows")


@click.command()
@common.ride_or_export
@common.CALIBRATION
@common.STRETCH
@common.live
@common.JSON
@common.RIGHT_HANDED
def report_command(ride: Path, calibration: Path | None, live: bool, as_json: bool, **stretch: float | None) -> None:
    """Summarise a ride: maxima, time at large leans, and stops as brake tests."""
    ride_overview = _overview(ride, calibration, live, **stretch)
    if as_json:
        common.echo(json.dumps(as_data(ride_overview)))
    else:
        Console().print(page(ride_overview))


@click.command()
@common.ride_or_export
@common.CALIBRATION
@common.STRETCH
@click.option("--tiles", is_flag=True, help="Show streets below the track. The open page loads them from a server.")
@common.live
@common.OUT_DIRECTORY
@common.RIGHT_HANDED
def plot_command(
    ride: Path, calibration: Path | None, tiles: bool, live: bool, out: Path, **stretch: float | None
) -> None:
    """Draw a ride as a picture (PNG) and as a page that you can zoom (HTML)."""
    check_drawing(out)
    ride_overview = _overview(ride, calibration, live, **stretch)
    with spinner("drawing"):
        written = list(draw_ride(ride_overview, out, tiles))
    common.print_lines(f"written: {path}" for path in written)


@click.command()
@common.file_argument("log", "LOG.csv")
@common.STRETCH
@common.OUT
def cut_command(log: Path, from_s: float | None, to_s: float | None, out: Path) -> None:
    """Cut a stretch out of a log.

    Use it for a still pose for calibrate two or six, or for one of several rides.
    """
    if from_s is None and to_s is None:
        raise click.UsageError("Give --from, --to or both: seconds from the beginning of the log.")
    check_output(out, [log])
    with Bar("cutting") as bar:
        recording = read_log(log, 1, bar.reach)
        rows = recording.rows_between(from_s, to_s)
        part = recording.between(from_s, to_s)
        notices = check_log(part).notices
        copy_rows(log, out, rows)
    common.warn(log, notices)
    common.echo(f"written: {out}, {len(part.t_s)} samples, {part.t_s[-1]:.1f} s")


@click.command()
@common.RIDE
@common.CALIBRATION
@click.option("--video", type=common.PATH, help="A video of the ride. Without a video, a transparent clip is written.")
@click.option(
    "--offset",
    "offset_s",
    type=common.TIME,
    metavar="TIME",
    help="The ride's time at the video's first picture: 12.5 if the video begins 12.5 s after the ride, -3 if it "
    "begins 3 s before. Not needed for a GoPro on the bike.",
)
@click.option("--fps", type=click.Choice(["30", "60"]), help="Frames per second. Default: as in the video, or 30.")
@common.from_to("Begin at this time of the ride: 90 or 1:30.", "End at this time; negative: before the end.")
@click.option(
    "--height",
    type=click.IntRange(240, 4320),
    help="Height, in pixels, of the video that you will lay the clip over. Default: 1080.",
)
@click.option("--mph", is_flag=True, help="Show miles per hour, not km/h.")
@common.live
@common.out_option("FILE.mp4 with --video, else FILE.mov or FILE.webm.")
def overlay_command(
    ride: Path, calibration: Path | None, video: Path | None, fps: str | None, out: Path, **options: Any
) -> None:
    """Draw the lean over a video, or write it as a transparent clip.

    The gauge also shows forces, speed and maxima. .mov is ProRes 4444, .webm is VP9, both with alpha. The lean is --
    while the lean is unknown.
    """
    _check_output(out, ride, calibration, *([video] if video else []))
    rate = float(fps) if fps else None
    drawn = with_bar("reading and drawing", overlay, ride, out, calibration, video, fps=rate, **options)
    common.warn(ride, drawn.notices)
    if drawn.correlation is not None:
        common.echo(
            f"the video begins at {drawn.offset_s:.2f} s of the ride, found with the camera's gyro (correlation "
            f"{drawn.correlation:.2f}): --offset {drawn.offset_s:.2f}"
        )
    seconds = drawn.end_s - drawn.begin_s
    common.echo(f"written: {out}, {drawn.pictures} frames, {seconds:.1f} s, {drawn.fps:g} per second")


def _check_output(out: Path, source: Path, calibration: Path | None, *inputs: Path) -> None:
    """Raise InputError if writing to `out` would fail, or would destroy the ride, its calibration or another input."""
    check_output(out, [*_files(source), calibration or calibration_path(source), *inputs])


def _files(source: Path) -> list[Path]:
    """Return the files of a source: all files below a directory, or else the source itself."""
    return sorted(source.rglob("*")) if source.is_dir() else [source]


def _imported(source: Path, calibration: Path | None) -> tuple[Path | Log, Path | CalibrationFile | None]:
    """Import an app's export or a table, and find its calibration. Other files, such as a log, are returned unchanged.

    The calibration is the file of the option --calibration, or the file beside the source. Without a file, the
    recording is aligned by its bends, and a line on standard error says so.
    """
    imported = None
    if not is_log(source):
        with spinner("importing"):
            imported = import_of_app(source)
    if imported is None:
        return source, calibration
    line = f"{source}: imported from {imported.app}, {len(imported.log.t_s)} samples, {imported.rate_hz:.0f} per second"
    default = calibration_path(source)
    path = calibration or (default if default.exists() else None)
    if path is not None:
        parameters = read_calibration(path)
    else:
        fit = with_bar("aligning", fit_ride, imported.log)
        parameters = fit.calibration
        line += f"; aligned by its bends, {common.known_to(fit)}"
    common.echo(line, err=True)
    return imported.log, parameters


def _opened(source: Path, calibration: Path | None, live: bool, **stretch: float | None) -> Ride:
    """Open a ride, which may have to be imported."""
    log, parameters = _imported(source, calibration)
    return with_bar("reading", open_ride, _stretch(log, **stretch), parameters, smoothed=not live)


def _log_of(source: Path, calibration: Path | None) -> tuple[Path | Log, CalibrationFile]:
    """Return the log of a ride, which may have to be imported, and its calibration, which need not be aligned."""
    log, parameters = _imported(source, calibration)
    if isinstance(parameters, CalibrationFile):
        return log, parameters
    return log, read_calibration(parameters or calibration_beside(source))


def _overview(source: Path, calibration: Path | None, live: bool, **stretch: float | None) -> Overview:
    """Return the overview of a ride from _opened(). Print all its notices."""
    ride_overview = with_bar("computing the lean", overview, _opened(source, calibration, live, **stretch))
    common.warn(source, ride_overview.notices)
    return ride_overview


def _stretch(log: Path | Log, from_s: float | None = None, to_s: float | None = None) -> Source:
    """Return the part of a log that the options --from and --to select."""
    return log if from_s is None and to_s is None else Stretch(log, from_s, to_s)


def _pairs(text: str, option: str) -> dict[str, str]:
    """Parse the value of an option, in the form KEY=VALUE,KEY=VALUE. Raises InputError if the form is wrong."""
    pairs = {}
    for part in text.split(",") if text.strip() else []:
        key, equals, value = (word.strip() for word in part.partition("="))
        if not key or not equals or not value:
            raise InputError(f"{option}: {part!a} is not NAME=VALUE; separate the pairs with commas")
        if key in pairs:
            raise InputError(f"{option}: {key!a} is given twice")
        pairs[key] = value
    return pairs


def _import_table(imported: Imported) -> Table:
    table = Table(title=imported.app, title_justify="left", box=None, pad_edge=False)
    for title in ("quantity", "from", "unit", "rate", "axes and sign"):
        table.add_column(title, overflow="fold")
    for column in imported.taken:
        rate = f"{column.rate_hz:{'.0f' if column.rate_hz >= 10.0 else '.2g'}} Hz" if column.rate_hz else ""
        table.add_row(column.quantity, column.source, column.unit, rate, column.sign)
    return table


def _joined_lines(joined: Joined) -> Iterator[str]:
    match, began = joined.match, joined.match.start_utc_s
    late_s = began - joined.track.utc_s[0]
    date = (datetime(1970, 1, 1, tzinfo=UTC) + timedelta(seconds=began)).strftime("%Y-%m-%d %H:%M:%S.%f")[:-4]
    side = "after" if late_s >= 0.0 else "before"
    yield (
        f"the ride began at {date} UTC by the track's clock, +- {match.sigma_s:.2f} s: {abs(late_s):.2f} s {side} the "
        "track's first point"
    )
    yield f"match: correlation {match.correlation:.2f} over {match.common_s / 60.0:.1f} minutes"
    if abs(match.drift) * match.common_s > 3.0 * match.sigma_s:  # a smaller drift is uncertain
        yield f"the ride's clock is {abs(match.drift) * 1e6:.0f} ppm {'slow' if match.drift > 0.0 else 'fast'}"
    if joined.own_speed:
        yield "the log's own speed is kept"
