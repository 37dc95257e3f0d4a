"""The words of a terminal for what the firmware's own modules refuse and for what is remarkable in a log: one line,
by code (see kickstand.errors). Words that are the board's own, too, are in kickstand/console.py.

A new code of the tools goes into one of the tables below: _AXES or _MOUNT if it is a remark of that kind, else _OTHERS.
Callers ask for the kind (code in WRONG_AXES, WRONG_MOUNT or CONTRADICTING) and have no lists of codes of their own.
"""

from collections.abc import Callable, Iterable
from math import isfinite

from kickstand import console
from kickstand.errors import Notice, Refusal
from kickstand.units import AXES

from .common.errors import InputError
from .remedies import COMMANDS, Remedies

SWAPPED_DEG = 4.0  # an upright pose is hardly ever so far off; a pose on the kickstand taken for it is
UPSIDE_DOWN_DEG = 150.0
_AT_REST = "at rest up reads +1 g"
OPPOSITE_SIGN = f"do all accelerations have the opposite sign? {_AT_REST.capitalize()}"
_MOVED = {
    "between-stops": "two stops differ by over {0:.0f} degrees; those of a motorcycle on its kickstand do: is it one?",
    "vertical": "the vertical changed by {0:.0f} degrees during the drive",
    "parts": "the vertical is no longer where it was",
    "since-standing": "standing and driving differ by {0:.0f} degrees",
    "since-upright": "the upright pose and driving differ by {0:.0f} degrees",
    "forward": "forward is no longer where it was",
    "since-alignment": "it is no longer as it was aligned",
}


def _mount_moved(_: Remedies, how: str, *numbers: float) -> str:
    return "the mount has moved: " + _MOVED[how].format(*numbers)


def _frozen(_: Remedies, stretches: int, seconds: float, begin_s: float, end_s: float) -> str:
    """The sentence for frozen readings. begin_s, end_s: times of the first stretch."""
    line = f"the readings froze from {begin_s:.1f} to {end_s:.1f} s"
    if stretches > 1:
        line += f" and {stretches - 1} times more, {seconds:.1f} s in all"
    return line + ": they are left out, and the lean begins anew after each"


def _speed_unit(_: Remedies, factor: float) -> str:
    """The sentence for a speed in another unit. factor: change of the speed over the one that the force explains."""
    guess = "is it in m/s, and the right vehicle's?"
    if 3.0 < factor < 4.4:
        guess = "it is in km/h, m/s are needed"
    elif 1.8 < factor < 2.5:
        guess = "it is in mph or knots, m/s are needed"
    return f"the speed changes {factor:.1f} times as much as the force says: {guess}"


def _rates_misfit(_: Remedies, *exchange: list[int]) -> str:
    """exchange (3 rows of 3): a signed permutation; times the rates of the log it is those about x, y and z.

    A reversed axis of the accelerometer is the same as the two others reversed in the gyro, because accelerations of
    the opposite sign are as good as the right ones; likewise with two that are exchanged.
    """
    kept = [axis for k, axis in enumerate(AXES) if exchange[k][k] == 1]
    off = [axis for k, axis in enumerate(AXES) if exchange[k][k] != 1]
    moved = [axis for k, axis in enumerate(AXES) if exchange[k][k] == 0]
    signs = [sum(row) for row in exchange]
    what, or_else = "are in another order or of another sign", ""
    if len(kept) == 2:
        what = f"are reversed about {off[0]}"
    elif not moved:
        what, or_else = f"are reversed about {off[0]} and {off[1]}", f"along {kept[0]} are reversed"
    elif len(moved) == 2 and signs == [1, 1, 1]:
        what = f"about {moved[0]} and {moved[1]} are exchanged"
    elif len(moved) == 2 and signs == [-1, -1, -1]:
        or_else = f"along {moved[0]} and {moved[1]} are exchanged"
    right = ", ".join(("-" if sum(row) < 0 else "") + "g" + AXES[[abs(x) for x in row].index(1)] for row in exchange)
    return (
        "the rates do not belong to the accelerations, so the lean is wrong: "
        + (f"either the accelerations {or_else}, or " if or_else else "")
        + f"the rates {what}, and instead of gx, gy, gz right would be {right}"
    )


def _forward_exchanged(remedies: Remedies, car: bool, side: str, roll_deg: float | None) -> str:
    """The sentence for forward and backward exchanged. side: the kickstand's side in the calibration by two poses, ""
    if unknown. roll_deg: error of up, None if unknown."""
    line = "forward and backward are exchanged: "
    if car:
        line += remedies["align_driving"]
    elif roll_deg is not None and abs(roll_deg) > SWAPPED_DEG:
        line += "were the poses swapped?"
    else:
        other = {"left": "--side right", "right": "--side left"}.get(side, "with the other --side")
        line += remedies["other_side"].format(other) + ("" if roll_deg is not None else " Or were the poses swapped?")
    return line + " Or, if no board wrote this log, " + OPPOSITE_SIGN


def _up_off(remedies: Remedies, angle_deg: float, car: bool) -> str:
    line = f"the calibration's up is {angle_deg:.0f} degrees off, so nothing computed with it is right: "
    line += f"is it another mount's? {_again(remedies, car)}"
    return f"{line}. Or {OPPOSITE_SIGN}" if angle_deg > UPSIDE_DOWN_DEG else line


def _pose_off(_: Remedies, angle_deg: float) -> str:
    """angle_deg: > 0 to the right."""
    side = "right" if angle_deg > 0.0 else "left"
    return (
        f"on straights the bike is in balance {abs(angle_deg):.1f} degrees to the {side} of what the "
        "calibration takes for upright, and the smoothed lean counts from there: a pose that was not upright does "
        "that, and a sensor without its six positions; if it is luggage on one side, the lean is that much off"
    )


def _forward_off(remedies: Remedies, angle_deg: float, by: str, car: bool) -> str:
    """The sentence for a yaw error. angle_deg: from the calibration's forward to the ride's, > 0 to the left."""
    side = "left" if angle_deg > 0.0 else "right"
    wrong = "braking and cornering are" if car else "lean, braking and cornering are"
    return (
        f"by the {by} of this ride forward is {abs(angle_deg):.0f} degrees to the {side} of the calibration's, so "
        f"{wrong} wrong: is it another mount's? {_again(remedies, car)}"
    )


def _again(remedies: Remedies, car: bool) -> str:
    return remedies["align_again_car" if car else "align_again"]


# Words by code: {0}, {1} ... are the refusal's values, a name is what to do (remedies.py). Where a text is not enough,
# a function makes the words of the remedies and the values.
_Table = dict[str, str | Callable[..., str]]
# The log's axes, their signs or the unit of the rates are wrong: to be corrected before anything is made of the log
_AXES: _Table = {
    "mirrored": "the sensor turns against the track, so left and right are exchanged: were all accelerations "
    "turned? " + _AT_REST.capitalize(),
    "left-handed": "the rates turn the force the wrong way, so the lean is wrong: are the axes left-handed (reverse "
    "one in both sensors) or the gyro of the opposite sign (reverse all its rates)? " + _AT_REST.capitalize(),
    "rates-in-radians": "in bends the rates are those of {0:.0f} m/s: are they in rad/s? deg/s are needed",
    "rates-misfit": _rates_misfit,
}
# The calibration is not of this mount
_MOUNT: _Table = {
    "up-off": _up_off,
    "forward-off": _forward_off,
    "forward-exchanged": _forward_exchanged,
    "upside-down": "the sensor's {0} points down: if it is not mounted upside down, all accelerations are of the "
    "opposite sign, and left and right get exchanged: reverse them (" + _AT_REST + ")",
    "another-mount": "the calibration given is of a mount {0:.0f} degrees from this one: its offset and slope are used",
}
_OTHERS: _Table = {
    "absurd-readings": "readings that no vehicle gives, at {0:.1f} s up to {1:.0f} deg/s and {2:.1f} g, where the lean "
    "is not known: check the sensor, and the units in the log",
    "axis-dead": "{0} is dead: from {2:.1f} s on it does not change for {1:.0f} s while others do; these readings are "
    "left out, and the lean is not known there: check the sensor and its solder joints, or replace it",
    "gyro-saturated": "gyro {0} is at the end of its range {1} times, {2:.1f} s in all, first at {3:.1f} s: these "
    "readings are left out: fix the sensor firmly, or set a larger GYRO_RANGE_DPS",
    "accel-clipped": "accelerometer {0} is at the end of its range ({1:.1f} g) in {2} samples, first at {3:.1f} s: "
    "what it averages to is wrong there: mount the sensor more softly, or set a larger ACCEL_RANGE_G",
    "readings-misfit": "the readings do not fit together again and again, first at {1:.0f} s, {0:.0f} s in all; the "
    "board shows no lean there: is the sensor's mount loose, or the sensor ill?",
    "sensor-odd": "no sound gyro fits this ride: its error of scale or axes comes out at {0:.0f} standard deviations, "
    "so the smoothed lean is not certain, and its standard deviation says so: is an axis of the gyro ill?",
    "moved": "moved or knocked",
    "vibration": "not still: vibration",
    "tilting": "not still: slowly tilting",
    "saturated": "saturated: the accelerometer is at the end of its range",
    "too-few": "too short: {0} samples, at least {1} needed",
    "frozen-pose": "frozen: every reading is the same, check the sensor and its wires",
    "stuck-accel": "the accelerometer's reading along {0} never changes: check the sensor",
    "dead-gyro": "the gyro's rate about {0} never changes: check the sensor",
    "noisy-gyro": "the gyro is very noisy about {0}: engine off, or check the sensor",
    "gyro-scale": "by the turns between the poses the gyro's rates about {0} are {1:+.0f} % off: check the sensor, and "
    "the unit of the rates",
    "gyro-reversed": "by the turns between the poses the gyro's rates about {0} have the wrong sign: check the sensor, "
    "and the axes of the log",
    "gyro-misfit": "by the gyro a turn between two poses is {0:.1f} degrees off: repeat the six positions; if it "
    "happens again, an axis of the gyro is late, clipped or dead",
    "unproved-gyro": "no turn between the poses shows that the gyro is right about {0}: turn the sensor about it too",
    "gyro-tilt": "between the poses are {0:.1f} degrees, by the gyro {1:.1f}: repeat the poses, or check the sensor",
    "gyro-offset": "turning, or a gyro offset of over {0:.0f} deg/s",
    "dead-axis": "axis {0} barely changes when turned over: {1:.2f} g",
    "unclear": "the six poses do not determine the calibration: repeat them, each side once",
    "odd-axis": "axis {0}: offset {1:.3f} g, slope {2:.3f} is past any real sensor: repeat the six poses",
    "side-tilted": "side {0} was {1:.0f} degrees off: within {2:.0f} is needed",
    "free-pose-off": "the free pose reads {0:.3f} g instead of 1: repeat the six poses, held still",
    "not-one-g": "{0} reading is {1:.3f} g, not 1 g: calibrate six positions first, or check the sensor",
    "same-pose": "both poses are the same ({0:.1f} degrees apart): one on the kickstand, one upright",
    "tilt-small": "only {0:.1f} degrees between the poses: at least {1:.0f} are needed, lean the bike further",
    "tilt-large": "{0:.0f} degrees between the poses: no kickstand leans over {1:.0f}, repeat both poses",
    "speed-negative": "the speed is {0:.1f} m/s: it must not be negative",
    "speed-stuck": "the speed is stuck at {0:.1f} m/s while the vehicle speeds up and brakes",
    "speed-late": "the speed is {0:.1f} s late: under 2 s are needed",
    "no-speed": "no speed: it needs a speed, from a GPS or a wheel",
    "not-driven": "it only stood still: drive, and brake in a straight line {0} times",
    "not-stopped": "it never stood still: a stop of {0:.0f} s is needed for the vertical",
    "few-events": (
        "only {0} of {1} braking events in a straight line, {2} more were not straight: not enough for forward"
    ),
    "parts-differ": (
        "two parts of the drive disagree by {0:.0f} degrees about forward: did the mount move? Else drive on"
    ),
    "uncertain": "forward is known to {0:.1f} degrees only, after {1} braking events: drive on",
    "nul-end": "its end is {0} NUL bytes, as after a loss of power: they are left out",
    "not-the-bikes": "in {0:.0f} % of the riding the accelerations are not those of a bike on its wheels, so the "
    "smoothed lean is less exact there: is the sensor in a soft mount or in a pocket? Fix it firmly",
    "cut-gzip": "the file was cut: what is missing at its end is lost, copy it again if you can",
    "cut-line": "line {0}, the last one, was cut: it is left out",
    "times-spread": "the times are rounded ({0} of {1} repeat the one before): they are spread evenly, by up to "
    "{2:.3f} s",
    "rows-share": "this format holds times to {2:g} s: {0} samples became {1} rows, those with the same time "
    "their mean",
    "smooth-slow": "the smoothed lean needs 10 samples a second: where the log has fewer, the lean is the one that the "
    "display showed",
    "ride-short": "only {0:.0f} s of riding: at least {1:.0f} s with bends are needed",
    "no-bends": "it hardly leans ({0:.1f} degrees rms): a motorcycle's ride with bends to both sides is needed",
    "not-leaning": "in bends it is pushed aside and does not lean, as a car: {align_car}",
    "ride-contradicts": "no one mounting explains these readings: was the sensor moved, or are axes exchanged between "
    "accelerometer and gyro?",
    "ride-halves": "two halves of the ride disagree by {0:.0f} degrees: did the mount move? Give a part in which "
    "it did not",
    "ride-uncertain": "the alignment is known to {0:.1f} degrees in roll, {1:.1f} in pitch and {2:.1f} in yaw "
    "only: a longer ride is needed, with bends to both sides",
    "phone-otherwise": "by the ride the phone is turned by {1:.0f} degrees against {0}: mounted another way? "
    "{phone_otherwise}",
    "phone-upside-down": "for a phone mounted {0} all accelerations have the opposite sign: " + _AT_REST,
    "import-speed-unit": "{0} has no unit, and the positions do not show it, so the speed is left out: {speed_unit}",
    "import-sign": "which sign accelerations have in {0} is not certain, and no track with turns shows it: "
    + _AT_REST
    + ", else the ride is mirrored and {sign}",
    "import-damaged": "damaged rows that are left out: {0}; a cell or a time is no number, a time is out of order, "
    "a row has too many cells, or a reading is past any sensor's",
    "import-slow": "{0:.3g} samples per second: at least 20 are needed to find a lean: record it faster",
    "import-short": "it lasts {0:.0f} s: to find the alignment from it, at least {1:.0f} s of riding are needed",
    "car-replayed": "the calibration is a car's, whose display shows no lean: lean_deg is that of a motorcycle which "
    "would feel the same, and lean_sigma_deg is nan",
    "mount-moved": _mount_moved,
    "frozen-readings": _frozen,
    "speed-unit": _speed_unit,
    "pose-off": _pose_off,
}
_WORDS = _AXES | _MOUNT | _OTHERS
WRONG_AXES, WRONG_MOUNT = frozenset(_AXES), frozenset(_MOUNT)
# The log contradicts its calibration so that it cannot show how exact that is. Where forward and backward are exchanged
# it can: the error of roll then shows whether the poses were swapped.
CONTRADICTING = WRONG_AXES | WRONG_MOUNT - {"forward-exchanged"}


class RefusedInput(InputError):
    """Data that the firmware's own modules refuse. code, values: those of the refusal, as in kickstand.errors.

    where: put before the sentence, the file as a rule; advice: after it.
    """

    def __init__(self, refusal: Refusal, where: str = "", advice: str = "") -> None:
        self._given = Refusal(refusal.code, *refusal.values), where, advice
        super().__init__(self.said(COMMANDS))
        self.code = refusal.code
        self.values = refusal.values

    def said(self, remedies: Remedies) -> str:
        """See InputError."""
        refusal, where, advice = self._given
        line = f"{sentence(refusal, remedies)}{advice}"
        return f"{where}: {line}" if where else line

    def __reduce__(self) -> tuple[type["RefusedInput"], tuple[Refusal, str, str]]:
        """Pickled as it was made: another process may raise it."""
        return RefusedInput, self._given


def sentence(refusal: Refusal | Notice, remedies: Remedies = COMMANDS) -> str:
    """One line, without the full stop at its end: what is wrong, and where it helps what to do, in these words.

    >>> sentence(Notice("same-pose", 0.4))
    'both poses are the same (0.4 degrees apart): one on the kickstand, one upright'
    """
    words = _WORDS.get(refusal.code, "")
    if callable(words):
        return words(remedies, *refusal.values)
    return words.format(*refusal.values, **remedies) or console.sentence(refusal)


def as_data(notices: Iterable[Notice]) -> list[dict[str, object]]:
    """Code, values and words of each, for JSON; None for a value that is not finite."""

    def plain(value: object) -> object:
        return (round(value, 3) if isfinite(value) else None) if isinstance(value, float) else value

    return [
        {"code": notice.code, "values": [plain(value) for value in notice.values], "words": sentence(notice)}
        for notice in notices
    ]
