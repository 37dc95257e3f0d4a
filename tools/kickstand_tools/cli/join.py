"""The command `kickstand join`: a phone's or watch's track is put to a ride."""

from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import TYPE_CHECKING

import click

from .common import warn

if TYPE_CHECKING:
    from ..joining.joined import Joined

_PATH = click.Path(path_type=Path)


@click.command(short_help="Put a phone's or a watch's track to a ride without GPS.")
@click.argument("ride", type=_PATH, metavar="RIDE.csv")
@click.argument("track", type=_PATH, metavar="TRACK.gpx|.fit")
@click.option("--out", required=True, type=_PATH, help="The log to write, packed if it ends in .gz.")
def join(ride: Path, track: Path, out: Path) -> None:
    """Put the track of a phone or a watch to a ride of a board without GPS.

    When the ride was is found out by how ride and track turn and speed up. The written log has the track's positions,
    times and speeds. A track of another ride is refused.
    """
    from ..calibration.file import calibration_path
    from ..joining.joined import join_track, write_joined
    from ..joining.track_files import read_track
    from ..output import check_output
    from ..progress import Bar, spinner

    check_output(out, [ride, track])
    with spinner("reading the track"):
        given = read_track(track)
    with Bar("reading") as bar:
        joined = join_track(ride, given, bar.reach)
    warn(ride, joined.notices)
    with Bar("writing") as bar:
        count = write_joined(out, joined, bar.reach)
    for line in _lines(joined):
        click.echo(line)
    click.echo(f"written: {out}, {count} positions")
    if calibration_path(ride).is_file() and not calibration_path(out).exists():
        click.echo(f"next: kickstand report {out} --calibration {calibration_path(ride)}")


def _lines(joined: "Joined") -> list[str]:
    found, began = joined.match, joined.match.start_utc_s
    late_s = began - joined.track.utc_s[0]
    when = (datetime(1970, 1, 1, tzinfo=UTC) + timedelta(seconds=began)).strftime("%Y-%m-%d %H:%M:%S.%f")[:-4]
    side = "after" if late_s >= 0.0 else "before"
    lines = [
        f"the ride began at {when} UTC by the track's clock, +- {found.sigma_s:.2f} s: {abs(late_s):.2f} s {side} the "
        "track's first point",
        f"match: correlation {found.correlation:.2f} over {found.common_s / 60.0:.1f} minutes",
    ]
    if abs(found.drift) * found.common_s > 3.0 * found.sigma_s:  # less is not known from a ride of this length
        lines.append(f"the ride's clock is {abs(found.drift) * 1e6:.0f} ppm {'slow' if found.drift > 0.0 else 'fast'}")
    return [*lines, "the log's own speed stays"] if joined.own_speed else lines
