"""Finds faulty axes from what an AxisWatch has counted.

An axis is faulty in three cases:
* Its counts have at most two values, or their lowest bits do not change. The axis is dead, or its low byte is stuck.
* Its low byte wraps around while its high byte stays the same. The high byte is stuck.
* Its counts equal the counts of another axis.
"""

from micropython import const

from ..errors import Notice
from ..units import AXES

# Bits of the counts that were seen, as in axes.py, which imports this module when an axis looks suspicious
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
    """Decides which axes are faulty.

    Args:
        lives: the function of axes.py.
        gyro_range: 0 (250 deg/s) to 3 (2000 deg/s).
        dlpf: the low-pass, as for Mpu6050.
    """

    def __init__(self, lives, gyro_range, dlpf):
        self._lives = lives
        self._limits = _ACCEL_LOOKS[dlpf - 1], _GYRO_LOOKS[gyro_range][dlpf - 1]
        # _quiet: number of successive quiet looks, per column
        # _seen: bits seen since the first of them, per column
        # _wrapped: number of looks with a wrap since the high byte last changed, per column
        self._quiet, self._wrapped, self._seen = bytearray(7), bytearray(7), [0] * 7
        # numbers of successive looks with clipping, without a fault, and with a faulty axis
        self._clips = self._well = self._ill = self._looks = 0
        self._noticed = {}  # maps a notice's code to the number of the look that last showed the notice

    def look(self, fault, frames, shaken, seen, samples):
        """Judge the axes by the samples since the last look.

        Args:
            fault: the Notice of the fault so far, or None.
            frames: four numbers, as from _ENDS to _DIFFER in axes.py.
            shaken: number of frames with hard vibration.
            seen: bits of the counts that were seen, as _SEEN in axes.py, per column.
            samples: number of samples.

        Returns:
            fault: the Notice of the fault now, or None.
            notice: a Notice to show for a moment, or None.
            setup: True if the chip should be set up.
        """
        self._looks += 1
        ends, lost, gyro, differ = frames
        enough = 2 * lost < samples  # True if at least half of the samples were within the range
        shaken = 10 * shaken >= samples
        if shaken or not enough:
            self._clips += 1
        elif 4 * lost < samples:
            self._clips = 0
        notice = ill = self._ill_axes(differ, seen)
        if not enough:
            notice = ill = _ill(ends) if lost == samples and self._clips >= _RAIL_LOOKS else None
        self._ill = self._ill + 1 if ill else 0
        if not ill and (shaken or 10 * lost >= samples):
            notice = Notice("clips", "Gyro" if lost and 2 * gyro >= lost else "Accel")
            ill = notice if self._clips >= _CLIP_LOOKS else None
        if ill:
            self._well, fault = 0, ill
        elif fault and enough:
            self._well += 1
            if self._well >= _WELL_LOOKS:
                fault = None
        return fault, self._unseen(notice), self._ill % _SETUP_LOOKS == 1

    def _ill_axes(self, differ, seen):
        """Return a Notice for the faulty axes, or None. differ, seen: as for look()."""
        quiet, wrapped = self._quiet, self._wrapped
        dead = equal = 0
        for i in _COLUMNS:
            limit = self._limits[i > 3]
            if limit == 1 and not differ >> i & 1:
                equal |= 1 << i | 1 << (i - 1 if i & 3 else i + 2)
            self._seen[i] = bits = self._seen[i] | seen[i]
            if not self._lives(bits):
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
            self._seen[i] = 0
        return _ill(dead) if dead else _ill(equal, "equal") if equal else None

    def _unseen(self, notice):
        """Return the notice, or None if the same notice was shown in the last minute."""
        if not notice or self._looks - self._noticed.get(notice.code, -_QUIET_LOOKS) < _QUIET_LOOKS:
            return None
        self._noticed[notice.code] = self._looks
        return notice


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
