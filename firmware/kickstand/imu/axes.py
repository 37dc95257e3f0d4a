"""Watches the counts of each axis.

A frame is one sample of 14 bytes: seven big-endian int16 in the order ax ay az temperature gx gy gz (register map
RM-MPU-6000A rev 4.2, pp. 29 to 31). add_up() of quick_viper.py adds frames up and takes the notes that are judged here.
"""

import gc
from array import array

from micropython import const

from ..errors import Notice, tried
from ..quick import load

FRAME = const(14)  # bytes
SATURATED = const(32700)  # a reading of this absolute value or more is at the end of its range
LOOK_MS = const(400)  # time between two looks

# Indices in the notes of add_up(), an array('i', 33). add_up() repeats these numbers.
_HASH = const(0)  # hash of the last frame
_REPEATS = const(1)  # number of successive repetitions of the last frame
_LIMIT = const(2)  # number of repetitions that make a frame dead
LOST = const(3)  # number of frames in the last call of add_up() with an axis at the end of its range
_ROW = const(4)  # number of successive frames with an axis at the end of its range
# The next four entries describe the frames since the last look
_ENDS = const(5)  # a bit for each column that was at the end of its range
_CLIPPED = const(6)  # number of frames with an axis at the end of its range
_GYRO_CLIPPED = const(7)  # number of frames with an axis of the gyro at the end of its range
_DIFFER = const(8)  # bits of pairs of axes that differed: x and y (bits 1 and 5), y and z (2 and 6), x and z (0 and 4)
DUE = const(9)  # number of samples until the next look
_HARD = const(10)  # absolute counts of the accelerometer that show hard vibration
_SHAKEN = const(11)  # number of frames that reached _HARD since the last look
# The next three are indices of the first of seven entries, which have the order of a frame
_LAST = const(12)  # counts of the last frame
_SEEN = const(19)  # bits 0 to 15; bit n is set if the lowest four bits of the counts have been n since the last look
_PEAK = const(26)  # largest absolute counts since power-on
_HIGH_BYTE = const(0x10000)  # bit in _SEEN that is set when the high byte changes
_WRAPPED = const(0x20000)  # bit in _SEEN that is set when the counts jump by 192 or more within one high byte

# Half of the range of 8 g or 16 g. The low-pass hides most of a vibration. If half of the range is left after the
# low-pass, the vibration was clipped before the low-pass. After clipping the mean is wrong, because the readings are
# clipped unevenly. A range below 8 g has no limit for vibration, because bends alone reach half of that range.
_HARD_COUNTS = const(16384)
_COLUMNS = (0, 1, 2, 4, 5, 6)  # the axes' columns in a frame
_ALL_DIFFER = const(0x77)
_TRIAL = const(
    b"\x7f\x00\x80\xff\xff\xff\x80\x00\x80\xff\x01\x00\xab\xcd"
)  # a frame for the trials of the machine code


def _decoding():
    return (b"\xab\xcd" + _TRIAL, 2, array("h", range(7))), 0x0DB12905


def _adding():
    """Return eight frames and the mark. Frames 2 and 4 are at the ends of the range. The last frame repeats the frame
    before it."""
    frames = bytearray(_TRIAL * 8)
    for k in range(7):
        frames[14 * k + 1] = frames[14 * k + 9] = 250 - 40 * k
    frames[28], frames[29], frames[66], frames[67] = 0x7F, 0xFF, 0x80, 0x00
    return (frames, 8, array("i", range(7)), array("i", range(33))), 0x1D5CFE7C


def lives(bits):
    """Return True if the counts of an axis had three values or more, and their lowest bit changed. bits: as _SEEN."""
    upper = bits & (bits - 1) & 0xFFFF  # without the lowest bit; 0 if the counts had only one value
    return upper & (upper - 1) and bits & 0x5555 and bits & 0xAAAA


decode, add_up = load("quick_viper", ("decode", _decoding), ("add_up", _adding))
del _decoding, _adding


class AxisWatch:
    """Watches each axis for faults. The noise of a working axis always changes its counts (product specification
    PS-MPU-6000A rev 3.4, sections 6.1 and 6.2). If an axis looks suspicious, axis_judge.py is imported and judges it.

    A look is a check of all samples since the previous look, LOOK_MS earlier.

    Args:
        rate_hz: samples per second.
        accel_range: 0 (2 g) to 3 (16 g).
        gyro_range: 0 (250 deg/s) to 3 (2000 deg/s).
        dlpf: the low-pass, as for Mpu6050.
        repeats: number of repetitions that make a frame dead.

    Attributes:
        notes: the notes of add_up().
        fault: a Notice while an axis is faulty or half of the samples are at the end of the range, else None.
        notice: a Notice to show for a moment, or None. The caller that shows the Notice sets it to None.
    """

    def __init__(self, rate_hz, accel_range, gyro_range, dlpf, repeats):
        self.notes = array("i", [0] * 33)
        self.notes[_LIMIT] = repeats
        self.notes[_HARD] = _HARD_COUNTS if accel_range > 1 else 32769
        self.notes[DUE] = self._look = rate_hz * LOOK_MS // 1000
        self._settings = gyro_range, dlpf
        self._judge = self.fault = self.notice = None
        self._looks = 0

    def restart(self):
        """Drop the samples since the last look, because the chip was set up."""
        self._begin()
        self.notes[_ROW] = self.notes[_REPEATS] = 0

    def _begin(self):
        """Begin the notes of the next look."""
        notes = self.notes
        for i in range(_ENDS, DUE):
            notes[i] = 0
        for i in range(_SEEN, _PEAK):
            notes[i] = 0
        notes[_SHAKEN] = 0
        notes[DUE] = self._look

    def clips(self):
        """Return a Notice if all samples of the last 0.1 s or more were at the end of the range, else None."""
        notes = self.notes
        if notes[_ROW] < notes[_LIMIT]:
            return None
        return Notice("clips", "Gyro" if notes[_ENDS] > 7 else "Accel")

    def shaken(self, skipped):
        """Return how hard the sensor was shaken since power-on.

        Args:
            skipped: number of samples that were skipped because an axis was at the end of its range.

        Returns:
            peaks: the largest absolute counts of the three axes of the accelerometer.
            share: the share of samples that were skipped, from 0 to 1.
        """
        return tuple(self.notes[_PEAK : _PEAK + 3]), skipped / max(1, self._looks * self._look)

    def look(self):
        """Judge the samples since the last look. Call this method when notes[DUE] is 0 or less.

        Returns:
            True if the chip should be set up, because that may repair an axis. The result is True once when a fault
            begins, and then every 10 s while the fault lasts.
        """
        notes, setup = self.notes, False
        self._looks += 1
        if self._judge is None:
            # A fault if the judge cannot be imported: memory is short, or the firmware is incomplete
            self.fault = None if self._well() else tried(self._load)[1]
        if self._judge:
            counted = notes[_ENDS:DUE], notes[_SHAKEN], notes[_SEEN:_PEAK], self._look - notes[DUE]
            self.fault, notice, setup = self._judge.look(self.fault, *counted)
            self.notice = notice or self.notice
        self._begin()
        return setup

    def _well(self):
        """Return True if all axes certainly work."""
        notes = self.notes
        if notes[_DIFFER] & _ALL_DIFFER != _ALL_DIFFER or notes[_CLIPPED] or notes[_SHAKEN]:
            return False
        for i in _COLUMNS:
            bits = notes[_SEEN + i]
            if not (lives(bits) and (bits & _HIGH_BYTE or bits < _WRAPPED)):
                return False
        return True

    def _load(self):
        gc.collect()  # without a collection the imported module, which stays loaded, would be placed behind garbage
        from .axis_judge import AxisJudge

        self._judge = AxisJudge(lives, *self._settings)
