"""Finds faulty axes from the notes of add_up(). This module is imported only when an axis looks suspicious.

An axis is faulty in three cases:
* Its counts have at most two values, or their lowest bits do not change. The axis is dead, or its low byte is stuck.
* Its low byte wraps around while its high byte stays the same. The high byte is stuck.
* Its counts equal the counts of another axis.
"""

from micropython import const

from ..errors import Notice
from ..units import AXES

# Indices and bits in the notes of add_up(), as in axes.py, which imports this module
_ENDS = const(5)
_CLIPPED = const(6)
_GYRO_CLIPPED = const(7)
_DIFFER = const(8)
_SHAKEN = const(11)
_SEEN = const(19)
_HIGH_BYTE = const(0x10000)
_WRAPPED = const(0x20000)
_COLUMNS = (0, 1, 2, 4, 5, 6)  # the axes' columns in a frame

# The number of successive quiet looks that make an axis faulty. A look is quiet if the counts had at most two values,
# or if their lowest bit did not change. The columns are for dlpf 1 to 6. The gyro has one row per range, from 250 to
# 2000 deg/s. The limits are for the noise of the quietest chip: 100 ug/sqrt(Hz) of the accelerometer, at 16 g, and
# 0.004 deg/s/sqrt(Hz) of the gyro. With this noise a working axis at rest reaches its limit only once in 1e12 looks. A
# limit of 0 means that the noise is too far below one count to decide.
_ACCEL_LOOKS = (1, 1, 1, 4, 15, 80)
_GYRO_LOOKS = (
    (1, 1, 1, 3, 5, 11),
    (1, 1, 1, 3, 9, 37),
    (1, 1, 2, 10, 62, 0),
    (1, 2, 14, 0, 0, 0),
)
_WRAP_LOOKS = const(2)  # number of looks with a wrap that prove a stuck high byte
_WELL_LOOKS = const(2)  # number of successive looks without a fault that clear the fault
# Number of successive looks with half of the samples at the end of the range that make an axis faulty
_CLIP_LOOKS = const(2)
# Number of successive looks with all samples at the end of the range that prove a faulty axis instead of vibration
_RAIL_LOOKS = const(5)
_SETUP_LOOKS = const(25)  # number of looks between two set-ups of a chip with a faulty axis
_QUIET_LOOKS = const(150)  # number of looks before the same notice is shown again


class AxisJudge:
    """Decides from the notes of an AxisWatch which axes are faulty.

    Args:
        gyro_range: 0 (250 deg/s) to 3 (2000 deg/s).
        dlpf: the low-pass, as for Mpu6050.
    """

    def __init__(self, gyro_range, dlpf):
        self._limits = _ACCEL_LOOKS[dlpf - 1], _GYRO_LOOKS[gyro_range][dlpf - 1]
        # _quiet: number of successive quiet looks, per column
        # _wrapped: number of looks with a wrap since the high byte last changed, per column
        self._quiet, self._wrapped = bytearray(7), bytearray(7)
        # numbers of successive looks with clipping, without a fault, and with a faulty axis
        self._clips = self._well = self._ill = 0
        self._noticed = {}  # maps a notice's code to the number of the look that last showed the notice

    def look(self, watch, samples):
        """Judge the axes for AxisWatch.look(). Set the fault, notice and clipped of the watch.

        Args:
            watch: the AxisWatch.
            samples: number of samples since the last look.

        Returns:
            True if the chip should be set up.
        """
        notes = watch.notes
        lost, gyro = notes[_CLIPPED], notes[_GYRO_CLIPPED]
        watch.clipped += lost
        enough = 2 * lost < samples  # True if at least half of the samples were within the range
        shaken = 10 * notes[_SHAKEN] >= samples
        if shaken or not enough:
            self._clips += 1
        elif 4 * lost < samples:
            self._clips = 0
        fault = self._ill_axes(notes)
        if not enough:
            fault = _ill(notes[_ENDS]) if lost == samples and self._clips >= _RAIL_LOOKS else None
        self._ill = self._ill + 1 if fault else 0
        if not fault and (shaken or 10 * lost >= samples):
            clips = Notice("clips", "Gyro" if lost and 2 * gyro >= lost else "Accel")
            self._show(watch, clips)
            if self._clips >= _CLIP_LOOKS:
                fault = clips
        notes[_ENDS] = notes[_CLIPPED] = notes[_GYRO_CLIPPED] = notes[_DIFFER] = notes[_SHAKEN] = 0
        if fault:
            self._well = 0
            watch.fault = fault
            self._show(watch, fault)
        elif watch.fault and enough:
            self._well += 1
            if self._well >= _WELL_LOOKS:
                watch.fault = None
        return self._ill % _SETUP_LOOKS == 1

    def _ill_axes(self, notes):
        """Return a Notice for the faulty axes, or None."""
        quiet, wrapped = self._quiet, self._wrapped
        dead = equal = 0
        for i in _COLUMNS:
            limit = self._limits[i > 3]
            if limit == 1 and not notes[_DIFFER] >> i & 1:
                equal |= 1 << i | 1 << (i - 1 if i & 3 else i + 2)
            bits = notes[_SEEN + i]
            values = bits & 0xFFFF
            upper = values & (values - 1)  # clears the lowest bit; the result is 0 if the counts had only one value
            if not (upper & (upper - 1) and values & 0x5555 and values & 0xAAAA):
                if quiet[i] < 255:
                    quiet[i] += 1
                if quiet[i] < limit or not limit:
                    continue  # too few values to judge, so collect the values of more looks
                dead |= 1 << i
            else:
                quiet[i] = 0
                if bits & _HIGH_BYTE:
                    wrapped[i] = 0
                elif bits & _WRAPPED and wrapped[i] < _WRAP_LOOKS:
                    wrapped[i] += 1
                if wrapped[i] == _WRAP_LOOKS:
                    dead |= 1 << i
            notes[_SEEN + i] = 0
        return _ill(dead) if dead else _ill(equal, "equal") if equal else None

    def _show(self, watch, notice):
        """Show a notice for a moment, unless the same notice was shown in the last minute."""
        if watch.looks - self._noticed.get(notice.code, -_QUIET_LOOKS) >= _QUIET_LOOKS:
            self._noticed[notice.code] = watch.looks
            watch.notice = notice


def _ill(axes, how=None):
    """Return the Notice for faulty axes. The Notice names the gyro's faulty axes or, if the gyro has none, the
    accelerometer's faulty axes.

    Args:
        axes: one bit per column of a frame.
        how: the kind of fault. By default "dead" for the gyro and "stuck" for the accelerometer.
    """
    gyro = axes >> 4
    names = "".join([AXES[i] for i in range(3) if (gyro or axes) >> i & 1])
    return Notice("axis-ill", "Gyro" if gyro else "Accel", names, how or ("dead" if gyro else "stuck"))
