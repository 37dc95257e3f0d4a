"""The pages of the display.

A page is a function that returns two lines of 16 characters. To add a page called load, write load(), and add it to
MOTORCYCLE or CAR. CONTRIBUTING.md has the other steps.
"""

from ..board.display import DEGREE
from ..lean.bike_model import static_lean_deg
from ..rotation import vector
from ..units import const

RECORDING = "*"
_HALF_BAR = const(8)  # number of character cells on each side of the middle
# Code 0xFF is a full cell in the display's character ROM
_EMPTY_THEN_FULL = b"        \xff\xff\xff\xff\xff\xff\xff\xff"
_FULL_THEN_EMPTY = b"\xff\xff\xff\xff\xff\xff\xff\xff        "
_DEG_PER_COLUMN = 1.5  # degrees of lean per dot column; the bar ends at 60 degrees, because it has 8 cells of 5 columns

FALLEN = ("Fallen over?", "Lean over 65" + DEGREE)

# The words that are shown instead of the lean. The keys are values of LeanMeter.suppressed_reason while the alignment
# is in doubt, and of LeanMeter.odd.
NO_LEAN = {
    "other-side": "side was wrong?",
    "mount-moved": "mount has moved",
    "turned": "SIDE or presses?",
    "odd-left": "sensor odd: left",
    "odd-up": "sensor odd: up",
    "odd-pitch": "sensor odd: tilt",
}

_bar = bytearray(16)


def words(notice):
    """Return the two lines for a Notice or a Refusal. Without memory for the words, return its code."""
    try:
        from .messages import lines  # imported at the first notice, because it takes 4 KB of heap

        return lines(notice)
    except (ImportError, MemoryError):
        return notice.code, ""


def unsure(reason):
    """Return the two lines that replace a lean that is not trusted.

    Args:
        reason: the code of the reason, or None.
    """
    return "Lean  --", NO_LEAN.get(reason, "not sure yet")


def lean_bar(lean_deg):
    """Return a bar from the middle to the side of the lean, as 16 character codes.

    The codes 0 to 3 are glyphs with 1 to 4 dot columns filled from the left. The codes 4 to 7 are glyphs with 1 to 4
    dot columns filled from the right."""
    columns = min(5 * _HALF_BAR, int(abs(lean_deg) / _DEG_PER_COLUMN + 0.5))
    # the innermost dot column of each side is always on, to mark the middle
    right, left = (columns or 1, 1) if lean_deg > 0 else (1, columns or 1)
    full, rest = right // 5, right % 5
    _bar[_HALF_BAR:] = _FULL_THEN_EMPTY[_HALF_BAR - full : 2 * _HALF_BAR - full]
    if rest:
        _bar[_HALF_BAR + full] = rest - 1
    full, rest = left // 5, left % 5
    _bar[:_HALF_BAR] = _EMPTY_THEN_FULL[full : _HALF_BAR + full]
    if rest:
        _bar[_HALF_BAR - 1 - full] = rest + 3
    return _bar


def side_name(lean_deg):
    """Return "left" or "right", or "" within half a degree of upright."""
    return "right" if lean_deg >= 0.5 else "left" if lean_deg <= -0.5 else ""


def lean(meter):
    """The page with the lean, its side and its bar."""
    shown = meter.lean_deg
    return "Lean %3d%s %s" % (int(abs(shown) + 0.5), DEGREE, side_name(shown)), lean_bar(shown)


def recorded(line):
    """Return the line with the recording mark in its last column."""
    # padded by hand, because MicroPython's %-15s counts a degree sign as two bytes
    return line + " " * (15 - len(line)) + RECORDING


def recording(recorder):
    """The page with the duration of the recording, and the time until its beginning is erased."""
    seconds, room_s = recorder.seconds(), recorder.room_s()
    if room_s is None:
        room = "to USB"
    elif room_s == 0:
        room = "oldest is erased"
    else:
        room = "room %d min" % (room_s // 60) if room_s < 36_000 else "room %d h" % (room_s // 3600)
    return "Rec %9d:%02d" % (seconds // 60, seconds % 60), room


def maxima(meter):
    """The page with the largest lean to each side since the last reset of the maxima."""
    left, right = int(meter.max_left_deg + 0.5), int(meter.max_right_deg + 0.5)
    return "Max left   %3d%s" % (left, DEGREE), "Max right  %3d%s" % (right, DEGREE)


def acceleration(meter):
    """The page with acceleration or braking in g, and the peaks of both."""
    forward = meter.smooth_force[2]
    word = "Brake" if forward < -0.005 else "Accel"
    return "%s   %5.2f g" % (word, abs(forward)), "pk +%.2f / -%.2f" % (meter.max_accel_g, meter.max_brake_g)


def cornering(meter):
    """The page with the lateral and the vertical g of a car."""
    left = meter.smooth_force[0]
    side = "Left" if left > 0.005 else "Right"
    return "%-5s   %5.2f g" % (side, abs(left)), "Up      %5.2f g" % meter.smooth_force[1]


def formula(meter):
    """The page with the lean by Nicolae's formula as published, and the filter's lean for comparison."""
    leans = round(meter.lean_formula_deg), round(meter.lean_deg)
    return "Formula   %4d%s" % (leans[0], DEGREE), "Filter    %4d%s" % (leans[1], DEGREE)


def raw(meter):
    """The page with the calibrated readings in the sensor's own axes."""
    force, rate = vector(), vector()
    meter.calibration.apply(meter.reading, force, rate)
    rates = "%4d%4d%4d %s/s" % (int(rate[0]), int(rate[1]), int(rate[2]), DEGREE)
    return "%5.2f%5.2f%5.2fg" % tuple(force), rates


def not_aligned(meter, seconds, todo):
    """The page before the alignment, with tilt and g in the sensor's own axes (Nicolae's figure 3).

    Args:
        seconds: any time in seconds. Every two seconds the second line changes between "Not aligned" and `todo`.
        todo: the next step for the rider.
    """
    tilt = static_lean_deg(meter.smooth_force)
    hint = "Not aligned" if seconds % 4 < 2 else todo
    return "Raw %4d%s %+.2fg" % (round(tilt), DEGREE, meter.smooth_force[2]), hint


def live(phone):
    """The page with the receiver of the packets to a phone. phone: the Live."""
    return phone.lines()


MOTORCYCLE = (lean, maxima, acceleration, formula, raw)
CAR = (acceleration, cornering, raw)
