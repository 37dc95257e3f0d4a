"""The command `kickstand overlay`: a ride's lean over a video of it."""

from pathlib import Path

import click

from .common import TIME, warn

_PATH = click.Path(path_type=Path)


@click.command(short_help="Draw the lean over a video of the ride.")
@click.argument("ride", type=_PATH, metavar="RIDE.csv")
@click.option("--calibration", type=_PATH, help="A CAL.json; if not given, the one beside the ride.")
@click.option("--video", type=_PATH, help="A video of the ride; without it a transparent clip is written.")
@click.option(
    "--offset",
    type=TIME,
    metavar="TIME",
    help="The ride's time at the video's first picture: 12.5 if the video begins 12.5 s after the ride, -3 if 3 s "
    "before it. Not needed for a GoPro on the bike.",
)
@click.option("--fps", type=click.Choice(["30", "60"]), help="Pictures a second; if not given, the video's, or 30.")
@click.option("--from", "from_s", type=TIME, metavar="TIME", help="Only from this time of the ride on: 90 or 1:30.")
@click.option("--to", "to_s", type=TIME, metavar="TIME", help="Only up to there; negative: from the end.")
@click.option(
    "--height", type=click.IntRange(240, 4320), help="Of the video that a clip is for, pixels; if not given, 1080."
)
@click.option("--mph", is_flag=True, help="Miles an hour instead of kilometres.")
@click.option("--live", is_flag=True, help="The lean that the display showed, not the smoothed one.")
@click.option("--out", required=True, type=_PATH, help="FILE.mp4 with --video, else FILE.mov or FILE.webm.")
def overlay(
    ride: Path,
    calibration: Path | None,
    video: Path | None,
    offset: float | None,
    fps: str | None,
    from_s: float | None,
    to_s: float | None,
    height: int | None,
    mph: bool,
    live: bool,
    out: Path,
) -> None:
    """Draw lean, forces, speed and maxima over a video, or as a transparent clip to lay over one.

    .mov is ProRes 4444, .webm is VP9, both with alpha. The lean is the smoothed one: from the whole ride, and nearer to
    the truth than what the display showed. Where it is not known the gauge shows --.
    """
    from ..calibration.file import calibration_beside
    from ..output import check_output
    from ..overlay.overlay import overlay
    from ..progress import Bar

    calibration = calibration or calibration_beside(ride)
    check_output(out, [ride, calibration, *([video] if video else [])])
    rate = float(fps) if fps else None
    with Bar("reading and drawing") as bar:
        made = overlay(ride, out, calibration, video, offset, rate, from_s, to_s, height, mph, live, bar.reach)
    warn(ride, made.notices)
    if made.correlation is not None:
        click.echo(
            f"the video begins at {made.offset_s:.2f} s of the ride, as the camera's gyro has it (correlation "
            f"{made.correlation:.2f}): --offset {made.offset_s:.2f}"
        )
    click.echo(f"written: {out}, {made.pictures} pictures, {made.end_s - made.begin_s:.1f} s, {made.fps:g} a second")
