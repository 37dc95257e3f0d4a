"""The command `kickstand calibrate ride`."""

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

import click

from .calibrate import OUT, PATH, along_axes, matrix_lines, print_lines
from .common import on_right_handed_axes, warn

if TYPE_CHECKING:
    from ..calibration.ride.fit import RideFit


@click.command(short_help="The alignment of a motorcycle, from riding with bends.")
@click.argument("log", type=PATH, metavar="LOG.csv")
@click.option(
    "--phone",
    type=click.Choice(["portrait", "landscape", "flat"]),
    help="How a phone was mounted, to check the result: upright or on its side with the screen to the rider, or flat.",
)
@OUT
@on_right_handed_axes
def ride(log: Path, phone: str | None, out: Path) -> None:
    """How the sensor sits on a motorcycle, from any ride with bends: no poses, and no speed, are needed."""
    from ..calibration.file import write_calibration
    from ..calibration.ride.fit import fit_ride
    from ..output import check_output
    from ..progress import Bar

    check_output(out, [log])
    with Bar("aligning") as bar:
        found = fit_ride(log, phone, bar.reach)
    warn(log, found.notices)
    print_lines(_ride_lines(found))
    write_calibration(out, found.calibration)
    click.echo(f"written: {out}")


def _ride_lines(found: "RideFit") -> Iterable[str]:
    begin, end = found.used_s
    yield (
        f"used: {begin:.0f} to {end:.0f} s of the log, {found.riding_s:.0f} s of it riding, "
        f"leaning {found.lean_deg:.0f} degrees rms"
    )
    yield f"known to: roll {found.roll_deg:.1f}, pitch {found.pitch_deg:.1f}, yaw {found.yaw_deg:.1f} degrees"
    roll, pitch, yaw = (abs(angle) for angle in found.halves_deg)
    yield f"two halves of the ride differ by: roll {roll:.1f}, pitch {pitch:.1f}, yaw {yaw:.1f} degrees"
    if found.lag_s is not None:
        yield f"speed: {max(0.0, found.lag_s):.1f} s late"
    if found.phone_deg is not None:
        yield f"phone: mounted as --phone says, within {found.phone_deg:.0f} degrees"
    yield "gyro bias  " + along_axes(found.calibration.gyro_bias_dps, "%+.2f deg/s")
    yield "offset     " + along_axes(found.calibration.accel_offset_g, "%+.4f g")
    yield from matrix_lines(found.calibration.vehicle_from_sensor)
    yield "upright is where the bike is balanced on straights; a ride does not tell the accelerometer's slopes"
