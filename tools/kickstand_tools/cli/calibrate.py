"""The commands of `kickstand calibrate`: six, two, drive, ride."""

from collections.abc import Iterable
from pathlib import Path

import click
from kickstand.calibration.poses import WARN_TILT_DEG
from kickstand.calibration.six_position import SIDES
from kickstand.drive_alignment import alignment
from kickstand.units import AXES

from ..analysis.overview import yaw_cost_deg
from ..calibration import drive_events as events
from ..calibration.drive import DriveFit, fit_drive
from ..calibration.file import CalibrationFile, read_calibration, write_calibration
from ..calibration.mount import contradiction, of_calibration
from ..calibration.poses import (
    GOOD_FREE_POSE_G,
    SixPositions,
    TwoPositions,
    fit_procedure,
    fit_six_positions,
    fit_two_positions,
)
from ..checks.log import check_log
from ..common.messages import OPPOSITE_SIGN
from ..common.output import check_output
from ..estimation.alignment import RideFit, fit_ride
from ..logs.reader import read_log
from .common import OUT, PATH, RIGHT_HANDED, VEHICLES, echo, file_argument, known_to, print_lines, warn, with_bar


@click.group(no_args_is_help=False)
def calibrate_command() -> None:
    """Compute a calibration from recorded poses or drives."""


@calibrate_command.command()
@file_argument("poses", "LOG.csv | POSE.csv...", nargs=-1, required=True)
@OUT
def six(poses: tuple[Path, ...], out: Path) -> None:
    """Measure the sensor's errors, from six still poses.

    Each side is up once, in any order. One log of the whole procedure calibrates accelerometer and gyro. Lay the sensor
    still for three seconds on each side, and once at a slant. The turns between the poses calibrate the gyro. Six logs
    of one pose each give only offset and slope of the accelerometer. A seventh log, of a slanted pose, checks them.
    """
    check_output(out, list(poses))
    fit = fit_procedure(poses[0]) if len(poses) == 1 else fit_six_positions(poses)
    print_lines(_six_lines(fit))
    _write(out, fit.calibration)


@calibrate_command.command()
@file_argument("kickstand", "KICKSTAND.csv")
@file_argument("upright", "UPRIGHT.csv")
@click.option("--calibration", type=PATH, help="The result of `kickstand calibrate six`, which is extended.")
@click.option("--side", type=click.Choice(["left", "right"]), default="left", help="The side of the kickstand.")
@OUT
@RIGHT_HANDED
def two(kickstand: Path, upright: Path, calibration: Path | None, side: str, out: Path) -> None:
    """Align to the bike, from poses on the kickstand and upright.

    The result says how the sensor is mounted.
    """
    check_output(out, [kickstand, upright])
    earlier = read_calibration(calibration) if calibration else None
    fit = fit_two_positions(kickstand, upright, earlier, side)
    print_lines(_two_lines(fit))
    warn(upright, of_calibration(fit.calibration, earlier))
    _write(out, fit.calibration)


@calibrate_command.command()
@file_argument("logs", "LOG.csv...", nargs=-1, required=True)
@click.option("--calibration", type=PATH, help="An earlier calibration, by six positions or two poses.")
@click.option("--vehicle", type=VEHICLES, help="Default: motorcycle if calibrated by two poses, otherwise car.")
@click.option("--method", type=click.Choice(["improved", "published"]), default="improved")
@OUT
@RIGHT_HANDED
def drive(logs: tuple[Path, ...], calibration: Path | None, vehicle: str | None, method: str, out: Path) -> None:
    """Align to any vehicle, from driving with braking.

    The logs must have a speed, stops, and straight-line braking."""
    check_output(out, list(logs))
    earlier = read_calibration(calibration) if calibration else None
    several = len(logs) > 1

    def tell(event: events.DriveEvent) -> None:
        print_lines(_event_lines(event, several))

    fit = with_bar("driving", fit_drive, logs, earlier, vehicle, method, on_event=tell)
    for name, notice in fit.notices:
        warn(name, [notice])
    warn(logs[0], of_calibration(fit.calibration))
    if earlier and not fit.poses:
        for log in logs:
            problem = contradiction(check_log(read_log(log), axes=False).bins, earlier)
            warn(log, [problem] if problem else [])
    print_lines(_drive_lines(fit, several))
    _write(out, fit.calibration)


@calibrate_command.command()
@file_argument("log", "LOG.csv")
@click.option(
    "--phone",
    type=click.Choice(["portrait", "landscape", "flat"]),
    help="How a phone was mounted, to check the result: upright or on its side with the screen to the rider, or flat.",
)
@OUT
@RIGHT_HANDED
def ride(log: Path, phone: str | None, out: Path) -> None:
    """Align to a motorcycle, from riding with bends. No poses and no speed are needed."""
    check_output(out, [log])
    fit = with_bar("aligning", fit_ride, log, phone)
    warn(log, fit.notices)
    print_lines(_ride_lines(fit))
    _write(out, fit.calibration)


def _write(out: Path, calibration: CalibrationFile) -> None:
    write_calibration(out, calibration)
    echo(f"written: {out}")


def _six_lines(fit: SixPositions) -> Iterable[str]:
    """Yield the lines about a calibration from six positions."""
    for side, pose, tilt in zip(SIDES, fit.sides, fit.tilt_deg, strict=True):
        yield f"{side} up: {pose.name}, {pose.samples} samples, {tilt:.1f} degrees off its axis"
    if fit.free_pose and fit.free_pose_error_g is not None:
        good = "good" if abs(fit.free_pose_error_g) <= GOOD_FREE_POSE_G else "usable; under 10 mg would be good"
        yield (
            f"free pose: {fit.free_pose.name}, {fit.free_pose.samples} samples, "
            f"{fit.free_pose_error_g * 1000:+.1f} mg from 1 g: {good}"
        )
    yield "offset     " + _along_axes(fit.calibration.accel_offset_g, "%+.4f g")
    yield "slope      " + _along_axes(fit.calibration.accel_slope, "%.4f")
    yield "gyro bias  " + _along_axes(fit.calibration.gyro_bias_dps, "%+.2f deg/s")
    if fit.turns:
        matrix, sigma = fit.calibration.gyro_matrix, fit.calibration.gyro_sigma
        scales, errors = 100.0 * (1.0 / matrix.diagonal() - 1.0), 100.0 * sigma.diagonal()
        yield f"gyro scale  {_along_axes(scales, '%+.2f %%')}, by {fit.turns} turns, known to {max(errors):.1f} %"
        if fit.turns < fit.all_turns:
            left_out = fit.all_turns - fit.turns
            yield f"warning: {left_out} of {fit.all_turns} turns left out, too quick or with a gap: turn more slowly"
    if fit.beyond_sheet:
        axes = ", ".join(fit.beyond_sheet)
        yield f"warning: {axes} is beyond the data sheet (50 mg, z 80 mg, slope 3 %): used anyway"
    if fit.free_pose is None:
        yield "warning: no free pose: any six poses fit exactly, only a seventh pose can show an error"
    yield "not aligned yet: next run kickstand calibrate two"


def _two_lines(fit: TwoPositions) -> Iterable[str]:
    """Yield the lines about an alignment from two poses."""
    calibration, first, second = fit.calibration, fit.kickstand, fit.upright
    side = calibration.kickstand_side
    yield f"kickstand: {first.name}, {first.samples} samples"
    yield (
        f"upright:   {second.name}, {second.samples} samples, "
        f"{fit.tilt_deg:.1f} degrees from the kickstand on the {side}"
    )
    yield "gyro bias  " + _along_axes(calibration.gyro_bias_dps, "%+.2f deg/s")
    yield from _matrix_lines(calibration.vehicle_from_sensor)
    if fit.tilt_deg < WARN_TILT_DEG:
        cost_deg = yaw_cost_deg(7.0)
        yield (
            f"warning: under {WARN_TILT_DEG:.0f} degrees, 1 degree of pitch turns forward by over 7, which usually "
            f"costs about {cost_deg:.1f} degrees of lean: lean further, or calibrate drive after it"
        )
    if not calibration.six_done:
        yield "warning: no six-position calibration: an offset of 50 mg is 3 degrees of lean: calibrate six first"


def _drive_lines(fit: DriveFit, has_several_logs: bool) -> Iterable[str]:
    """Yield the lines about an alignment by driving."""
    yield f"{fit.vehicle}, method {fit.method}: {fit.used} used, {fit.turned} in turns not used"
    yield f"stops: {fit.stops}"
    ready = f"ready after {fit.ready_s:.0f} s" + (" of all logs" if has_several_logs else "")
    yield f"quality: {fit.quality_deg:.1f} degrees about the vertical, {fit.attitude_deg:.1f} in all; {ready}"
    if fit.lag_s is not None:
        yield f"speed: {fit.lag_s:.1f} s late; two halves of the drive differ by {fit.halves_deg:.1f} degrees"
    if fit.poses:
        yaw_deg = abs(fit.poses.yaw_deg)
        if fit.poses.verdict == alignment.REVERSED:
            yield (
                "warning: the two poses had forward and backward exchanged: the kickstand is on the other side, "
                f"or, if no board wrote this log, {OPPOSITE_SIGN}"
            )
        elif fit.poses.verdict == alignment.MOVED:
            yield f"warning: the mount is {yaw_deg:.0f} degrees off its place in the two poses: was it moved since?"
        else:
            cost_deg = yaw_cost_deg(yaw_deg)
            costs = f", which usually costs about {cost_deg:.1f} degrees of lean" if cost_deg >= 0.05 else ""
            yield f"the two poses had forward {yaw_deg:.1f} degrees off{costs}: now corrected"
    yield from _matrix_lines(fit.calibration.vehicle_from_sensor)
    if not fit.calibration.six_done:
        warning = "warning: no six-position calibration: an offset of 50 mg tilts the vertical by 3 degrees"
        yield f"{warning}: calibrate six first"


def _event_lines(event: events.DriveEvent, has_several_logs: bool) -> Iterable[str]:
    """Describe an event in a line of text. With several logs, also name each log before its first event."""
    if event.what in (events.LOG_BEGINS, events.LOG_WITHOUT_EVENTS):
        if has_several_logs:
            yield f"{event.log}:" if event.what == events.LOG_BEGINS else "           no braking in it"
        return
    words = {
        events.USED: f"in a straight line: event {event.counted}"
        + (f" of {event.needed} needed" if event.counted <= event.needed else ""),
        events.TURNING: "in a turn: not counted",
        events.READY: f"ready: forward known to {event.quality_deg:.1f} degrees",
        events.NOT_READY: "no longer ready" + (f": {event.refusal.line()}" if event.refusal else ""),
        events.PROBLEM: event.refusal.line() if event.refusal else "",
    }
    yield f"{event.t_s:7.1f} s  {words[event.what]}"


def _ride_lines(fit: RideFit) -> Iterable[str]:
    """Yield the lines about an alignment from a ride."""
    begin, end = fit.used_s
    stood = f"{fit.standing_s:.0f} s of these certainly standing"
    leaning = f"otherwise leaning {fit.lean_deg:.0f} degrees rms"
    yield f"used: {max(begin, 0.0):.0f} to {end:.0f} s of the log, {stood}, {leaning}"
    yield known_to(fit)
    roll, pitch, yaw = (abs(angle) for angle in fit.halves_deg)
    yield f"two halves of the ride differ by: roll {roll:.1f}, pitch {pitch:.1f}, yaw {yaw:.1f} degrees"
    if fit.lag_s is not None:
        yield f"speed: {max(0.0, fit.lag_s):.1f} s late"
    if fit.phone_deg is not None:
        yield f"phone: mounted as --phone says, within {fit.phone_deg:.0f} degrees"
    yield "gyro bias  " + _along_axes(fit.calibration.gyro_bias_dps, "%+.2f deg/s")
    yield "offset     " + _along_axes(fit.calibration.accel_offset_g, "%+.4f g")
    yield from _matrix_lines(fit.calibration.vehicle_from_sensor)
    yield "upright means balanced on straights; a ride does not show the accelerometer's slopes"


def _matrix_lines(vehicle_from_sensor) -> Iterable[str]:
    for name, row in zip(("left", "up", "forward"), vehicle_from_sensor, strict=True):
        yield f"{name:<10} " + _along_axes(row, "%+.4f")


def _along_axes(values, form: str) -> str:
    return "  ".join(f"{axis} " + form % value for axis, value in zip(AXES, values, strict=True))
