"""What each page says in two lines of 16 characters. Pure formatting: meter in, text out."""

from ..lean.formula import static_lean_deg
from ..rotation import vector
from . import messages
from .messages import DEGREE

ARROW = "\x7e"  # in the display's character ROM, as is the full block
RECORDING = "*"
_BLOCK = 0xFF
_HALF_BAR = 8  # cells to each side of the middle
_DEG_PER_COLUMN = 1.5  # 8 cells of 5 columns: the bar ends at 60 degrees

FALLEN = ("Fallen over?", "Lean over 65" + DEGREE)

_bar = bytearray(16)


def unsure(doubt):
    """No lean. doubt: the code of the reason, or None."""
    return "Lean  --", messages.doubt(doubt)


def lean_bar(lean_deg):
    """16 glyph codes: a bar from the middle to the side of the lean. Glyphs 0..3: 1..4 columns from the
    left, 4..7 from the right."""
    columns = min(5 * _HALF_BAR, int(abs(lean_deg) / _DEG_PER_COLUMN + 0.5))
    right = columns if lean_deg > 0 else 0
    left = columns if lean_deg < 0 else 0
    for cell in range(_HALF_BAR):
        # one column of each side is always on: the mark in the middle
        _bar[_HALF_BAR + cell] = _cell(max(1, right) - 5 * cell, 0)
        _bar[_HALF_BAR - 1 - cell] = _cell(max(1, left) - 5 * cell, 4)
    return _bar


def _cell(columns, first_glyph):
    if columns <= 0:
        return 0x20
    return _BLOCK if columns >= 5 else first_glyph + columns - 1


def progress_bar(done, total):
    """16 cells, filled up to done of total."""
    filled = 16 * done // total if total else 0
    return "\xff" * min(16, filled)


def side_name(lean_deg):
    """left, right, or nothing within half a degree of upright."""
    return "right" if lean_deg >= 0.5 else "left" if lean_deg <= -0.5 else ""


def lean(meter):
    """Lean with its side, and the bar."""
    shown = meter.lean_deg
    return "Lean %3d%s %s" % (int(abs(shown) + 0.5), DEGREE, side_name(shown)), lean_bar(shown)


def recorded(line):
    """The line with the mark of a ride being recorded in its last column."""
    return line + " " * (15 - len(line)) + RECORDING  # %-15s would count bytes, of which a degree sign is two


def recording(recorder):
    """How long the ride has been recorded, and for how long there is room until its beginning has to go."""
    seconds, room_s = recorder.seconds(), recorder.room_s()
    if room_s is None:
        room = "to USB"
    elif room_s == 0:
        room = "oldest is erased"
    else:
        room = "room %d min" % (room_s // 60) if room_s < 36_000 else "room %d h" % (room_s // 3600)
    return "Rec %9d:%02d" % (seconds // 60, seconds % 60), room


def maxima(meter):
    """The largest lean to each side since the reset."""
    return (
        "Max left   %3d%s" % (int(meter.max_left_deg + 0.5), DEGREE),
        "Max right  %3d%s" % (int(meter.max_right_deg + 0.5), DEGREE),
    )


def acceleration(meter):
    """Forward or braking g, and the peaks of both."""
    forward = meter.smooth_force[2]
    word = "Brake" if forward < -0.005 else "Accel"
    return "%s   %5.2f g" % (word, abs(forward)), "pk +%.2f / -%.2f" % (meter.max_accel_g, meter.max_brake_g)


def cornering(meter):
    """Lateral and vertical g of a car."""
    left = meter.smooth_force[0]
    return (
        "%-5s   %5.2f g" % ("Left" if left > 0.005 else "Right", abs(left)),
        "Up      %5.2f g" % meter.smooth_force[1],
    )


def formula(meter):
    """Nicolae's formula as it stands, beside the filter's lean: why there is a filter."""
    return (
        "Formula   %4d%s" % (round(meter.lean_formula_deg), DEGREE),
        "Filter    %4d%s" % (round(meter.lean_deg), DEGREE),
    )


def raw(meter):
    """Calibrated readings in the sensor's own axes."""
    force, rate = vector(), vector()
    meter.calibration.apply(meter.reading, force, rate)
    return (
        "%5.2f%5.2f%5.2fg" % (force[0], force[1], force[2]),
        "%4d%4d%4d %s/s" % (int(rate[0]), int(rate[1]), int(rate[2]), DEGREE),
    )


def not_aligned(meter, seconds, todo="On stand: press"):
    """Before alignment (the paper's figure 3): tilt and g of the sensor's axes, which are not the bike's."""
    tilt = static_lean_deg(meter.smooth_force)
    hint = "Not aligned" if seconds % 4 < 2 else todo
    return "Raw %4d%s %+.2fg" % (round(tilt), DEGREE, meter.smooth_force[2]), hint


def sensor_info(sensor, meter, seconds):
    """Which chip, how warm; what is calibrated, and in turn how often its FIFO overflowed and it was set up."""
    chip, calibration = sensor.chip, meter.calibration
    line1 = "%-9s%5.1f%sC" % (chip.name[:9], chip.temperature_c(meter.reading[3]), DEGREE)
    if seconds % 4 < 2:
        return line1, "6pos %-3s ali %s" % (_yes(calibration.six_done), _yes(calibration.aligned))
    return line1, "%d gaps %d starts" % (min(chip.overflows, 99), min(sensor.restarts, 99))


def _yes(flag):
    return "yes" if flag else "no"
