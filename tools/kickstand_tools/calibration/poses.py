"""Calibration from recorded poses, by the firmware's own modules."""

from collections.abc import Callable
from pathlib import Path
from statistics import median

from kickstand.calibration import six_position, two_position
from kickstand.calibration.still_pose import StillPose
from kickstand.errors import AlignmentError, CalibrationError, CaptureError

from ..errors import InputError
from ..logs.reader import read_log
from ..refusals import sentence
from .file import CalibrationFile

_MICRO = 1_000_000  # StillPose sums integers: millionths of g and deg/s
_SATURATED = 1_990_000  # the range a still pose needs is 1 g; an axis at 2 g is at its end
_EQUAL_TILT_DEG = 3.0  # the free pose has to stand out from its nearest side by this

Print = Callable[[str], None]


def read_pose(path: Path) -> StillPose:
    """One still pose, averaged. Raises InputError naming the file."""
    log = read_log(path)
    capture = StillPose(_MICRO, _MICRO, _SATURATED, len(log.readings))
    where = f"{path}: pose refused"
    for line, reading in enumerate(log.readings, 1):
        if not capture.add([round(value * _MICRO) for value in reading]):
            where = f"{path}, sample {line}"
            break
    try:
        capture.finish()
    except CaptureError as error:
        raise InputError(f"{where}: {sentence(error)}: capture this pose again") from error
    return capture


def six(paths: list[Path], say: Print) -> CalibrationFile:
    """Offset and slope from six poses in any order, checked against a seventh, free one where it is given.

    say: called with each line of the summary. Raises InputError.
    """
    if len(paths) not in (6, 7):
        raise InputError(
            f"{len(paths)} captures given: six are needed, one for each side up, or seven with a free pose"
        )
    refuse_same_file(paths)
    captures = [read_pose(path) for path in paths]
    by_side, free = _sides(paths, captures)
    poses = [_accel(captures[k]) for k in by_side]
    try:
        offset, slope = six_position.fit(poses)
        error_g = (
            None if free is None else six_position.check_free_pose(offset, slope, _accel(captures[free]))
        )
    except CalibrationError as error:
        raise InputError(_with_file(error, by_side, free, paths)) from error
    for side, k in zip(six_position.SIDES, by_side, strict=True):
        tilt = six_position.tilt_deg(_accel(captures[k]))
        say(f"{side} up: {paths[k]}, {captures[k].count} samples, {tilt:.1f} degrees off its axis")
    if free is not None and error_g is not None:
        good = "good" if abs(error_g) <= six_position.FREE_GOOD_G else "usable; under 10 mg would be good"
        say(
            f"free pose: {paths[free]}, {captures[free].count} samples, "
            f"{error_g * 1000:+.1f} mg from 1 g: {good}"
        )
    bias = [median(_gyro(capture)[i] for capture in captures) for i in range(3)]
    say("offset     " + _axes(offset, "%+.4f g"))
    say("slope      " + _axes(slope, "%.4f"))
    say("gyro bias  " + _axes(bias, "%+.2f deg/s"))
    beyond = six_position.beyond_sheet(offset, slope)
    if beyond:
        say(f"warning: {', '.join(beyond)} is beyond the data sheet (50 mg, z 80 mg, slope 3 %): used anyway")
    if free is None:
        say("warning: no free pose: six poses fit exactly whatever they were, only a seventh can tell")
    say("not aligned yet: next is kickstand calibrate two")
    return CalibrationFile(offset=list(offset), slope=list(slope), bias=bias, six_done=True)


def two(
    kickstand: Path, upright: Path, before: CalibrationFile | None, side: str, say: Print
) -> CalibrationFile:
    """Matrix and gyro bias from the pose on the kickstand and the one upright; offset and slope as before.

    side: where the kickstand leans the bike to, "left" or "right". Raises InputError.
    """
    refuse_same_file([kickstand, upright])
    result = before or CalibrationFile()
    first, second = read_pose(kickstand), read_pose(upright)
    try:
        aligned, tilt = two_position.align(result.to_firmware(), first, second, side)
    except AlignmentError as error:
        raise InputError(f"{kickstand} and {upright}: {sentence(error)}") from error
    matrix, bias = list(aligned.vehicle_from_sensor), list(_gyro(first))
    say(f"kickstand: {kickstand}, {first.count} samples")
    say(f"upright:   {upright}, {second.count} samples, {tilt:.1f} degrees from the kickstand on the {side}")
    say("gyro bias  " + _axes(bias, "%+.2f deg/s"))
    for name, row in (("left", 0), ("up", 3), ("forward", 6)):
        say(f"{name:<10} " + _axes(matrix[row : row + 3], "%+.4f"))
    if tilt < two_position.WARN_TILT_DEG:
        say(
            f"warning: under {two_position.WARN_TILT_DEG:.0f} degrees, 1 degree of pitch turns forward by over "
            "7: lean further"
        )
    if not result.six_done:
        say("warning: no six-position calibration: an offset of 50 mg is 3 degrees of lean")
    return CalibrationFile(
        result.offset, result.slope, bias, matrix, True, result.six_done, result.notes, side=side
    )


def _sides(paths: list[Path], captures: list[StillPose]) -> tuple[list[int], int | None]:
    """Index of the capture of each side in the order of SIDES, and that of the free pose (None without one).

    Of seven captures the free one shares its nearest side with another and is further from the axis.
    """
    found: dict[int, list[int]] = {}
    for k, capture in enumerate(captures):
        found.setdefault(six_position.side_of(_accel(capture)), []).append(k)
    free = None
    missing = [name for i, name in enumerate(six_position.SIDES) if i not in found]
    for side, same in found.items():
        same.sort(key=lambda k: six_position.tilt_deg(_accel(captures[k])))
        names = " and ".join(str(paths[k]) for k in same)
        if len(same) > 1 and (missing or len(captures) == 6):
            sides = f"side {', '.join(missing)} is missing, and " if missing else ""
            raise InputError(
                f"{sides}side {six_position.SIDES[side]} is there {len(same)} times ({names}): one each"
            )
        if len(same) > 1:
            free = same[-1]
            near, far = (six_position.tilt_deg(_accel(captures[k])) for k in same)
            if far < six_position.FREE_TILT_DEG or far - near < _EQUAL_TILT_DEG:
                raise InputError(
                    f"side {six_position.SIDES[side]} is there twice ({names}): the seventh pose has to be "
                    f"slanted, over {six_position.FREE_TILT_DEG:.0f} degrees from every side"
                )
    return [found[side][0] for side in range(6)], free


def _with_file(error: CalibrationError, by_side: list[int], free: int | None, paths: list[Path]) -> str:
    """The refusal in words with the file it is about in front, where it is about one."""
    reason = sentence(error)
    if error.code == "side-tilted":
        k = by_side[six_position.SIDES.index(error.values[0])]
        return f"{paths[k]}: {reason}: capture this side again"
    return f"{paths[free]}: {reason}" if free is not None and error.code == "free-pose-off" else reason


def refuse_same_file(paths: list[Path]) -> None:
    """Raise InputError if a file is given twice."""
    seen: dict[Path, Path] = {}
    for path in paths:
        if path.resolve() in seen:
            raise InputError(f"{path} is given twice: each one has to be a recording of its own")
        seen[path.resolve()] = path


def _accel(capture: StillPose) -> list[float]:
    assert capture.accel is not None  # read_pose has finished it
    return capture.accel


def _gyro(capture: StillPose) -> list[float]:
    assert capture.gyro is not None
    return capture.gyro


def _axes(values, form: str) -> str:
    return "  ".join(f"{axis} " + form % value for axis, value in zip("xyz", values, strict=True))
