"""Decodes frames of the chip's FIFO, sums them up, and judges each axis by its counts.

A frame is one sample: 14 bytes, seven big-endian int16 in the order ax ay az temperature gx gy gz (register map
RM-MPU-6000A rev 4.2, pp. 29 to 31). On the board decode() and add_up() are the machine code of fifo_frames_viper.py;
elsewhere they are decode_python() and add_up_python(), which give the same results.
"""

from array import array

from micropython import const

from ..errors import NO_MACHINE_CODE, Notice, checked
from ..units import AXES

FRAME = const(14)  # bytes
SATURATED = const(32700)  # |counts|: from here on a reading is at the end of its range
LOOK_MS = const(400)

# Places in the array('i', 33) that add_up() keeps its notes in; in the machine code they are numbers. The hash of the
# last frame; how many times in a row it was repeated; how many repetitions make a frame dead; the number of frames at
# the end of the range in this call; the same in a row until now.
_HASH = const(0)
_REPEATS = const(1)
_LIMIT = const(2)
LOST = const(3)
_ROW = const(4)
# Since the last look: a bit for each column that was at its end; the number of frames in which one was, and in which
# one of the gyro's was; bits for axes that differed: y from x (bits 1 and 5), z from y (2 and 6), z from x (0 and 4).
# The number of samples until the next look.
_ENDS = const(5)
_CLIPPED = const(6)
_GYRO_CLIPPED = const(7)
_DIFFER = const(8)
DUE = const(9)
# |counts| of the accelerometer that hard vibration reaches, and the number of frames with so much since the last look.
_HARD = const(10)
_SHAKEN = const(11)
# From each of these on seven places, in the frame's order: the counts of the last frame; a bit for each value that
# their lowest four bits had since the last look; the largest |counts| since power-on.
_LAST = const(12)
_SEEN = const(19)
_PEAK = const(26)
_HIGH_BYTE = const(0x10000)  # in _SEEN: the high byte has changed
_WRAPPED = const(0x20000)  # in _SEEN: the counts jumped by _JUMP or more, but the high byte stayed
_JUMP = const(192)

# Looks in which an axis must be quiet to be ill, by dlpf 1 to 6, for the gyro in rows from 250 deg/s up. With the noise
# of the quietest chip (accelerometer 100 ug/sqrt(Hz), at 16 g; gyro 0.004 deg/s/sqrt(Hz)) a working axis at rest is
# that quiet once in 1e12 looks. 0: its noise is so much less than a count that nobody can tell.
_ACCEL_LOOKS = b"\x01\x01\x01\x04\x0f\x50"
_GYRO_LOOKS = b"\x01\x01\x01\x03\x05\x0b\x01\x01\x01\x03\x09\x25\x01\x01\x02\x0a\x3e\x00\x01\x02\x0e\x00\x00\x00"
_COLUMNS = (0, 1, 2, 4, 5, 6)  # of the axes
_WRAP_LOOKS = const(2)  # looks in which a stuck high byte must show
_WELL_LOOKS = const(2)  # successive looks without a fault that end one
_CLIP_LOOKS = const(2)  # successive looks with half of the samples at the end of the range that are a fault,
_RAIL_LOOKS = const(5)  # and with all of them: not the vibration, but the axis
# Half of 8 g and of 16 g. The low-pass hides most of a vibration: where so much is left, it was cut off before, and the
# mean of what was cut off unevenly is wrong. A range below 8 g has no such limit, because bends reach half of it.
_HARD_COUNTS = const(16384)
_SETUP_LOOKS = const(25)  # looks from one set-up of a chip with an ill axis to the next
_QUIET_LOOKS = const(150)  # looks until the same notice is shown again


def decode_python(frames, at, counts):
    """Put the frame that begins at byte `at` of frames into counts, array('h', 7)."""
    for i in range(7):
        counts[i] = _int16(frames, at + 2 * i)


def add_up_python(frames, n, sums, watch):
    """Add n frames into sums, array('i', 7). Return how many are in the sums.

    A frame with an axis at the end of its range is left out: it is counted in watch[LOST], and the good frames after it
    move up in `frames`, so that the good ones are the first ones there. It stops at the first dead frame: the result
    and watch[LOST] then add up to less than n. A frame is dead if the six bytes of its force are all 0x00 or all 0xFF,
    or if it is like so many frames before it. watch: AxisWatch.notes.
    """
    for i in range(7):
        sums[i] = 0
    watch[LOST] = good = 0
    watch[DUE] -= n
    for k in range(n):
        at = k * FRAME
        first = frames[at]
        same = 0  # number of bytes of the force that equal the first one
        mark = 0  # the hash
        for i in range(FRAME):
            byte = frames[at + i]
            if i < 6 and byte == first:
                same += 1
            if i < 6 or i > 7:  # without the temperature: a working chip may repeat it
                mark = (mark * 31 + byte) & 0xFFFFFF
        if same == 6 and (first == 0 or first == 255):
            return good
        watch[_REPEATS] = watch[_REPEATS] + 1 if mark == watch[_HASH] else 0
        watch[_HASH] = mark
        if watch[_REPEATS] >= watch[_LIMIT]:
            return good
        ends = shaken = 0  # ends: a bit for each column at the end of its range
        for i in range(7):
            value, last = _int16(frames, at + 2 * i), watch[_LAST + i]
            watch[_LAST + i] = value
            watch[_SEEN + i] |= 1 << (value & 15)
            if value >> 8 != last >> 8:
                watch[_SEEN + i] |= _HIGH_BYTE
            elif not -_JUMP < value - last < _JUMP:
                watch[_SEEN + i] |= _WRAPPED
            if i & 3 and value != watch[_LAST - 1 + i]:
                watch[_DIFFER] |= 1 << i
            if i & 3 == 2 and value != watch[_LAST - 2 + i]:
                watch[_DIFFER] |= 1 << i - 2
            size = abs(value)
            if size > watch[_PEAK + i]:
                watch[_PEAK + i] = size
            if size >= SATURATED and i != 3:
                ends |= 1 << i
            if size >= watch[_HARD] and i < 3:
                shaken = 1
        watch[_SHAKEN] += shaken
        if ends:
            watch[_ENDS] |= ends
            watch[LOST] += 1
            watch[_ROW] += 1
            watch[_CLIPPED] += 1
            watch[_GYRO_CLIPPED] += ends > 7
            continue
        watch[_ROW] = 0
        for i in range(7):
            sums[i] += watch[_LAST + i]
        if good < k:
            for i in range(FRAME):
                frames[good * FRAME + i] = frames[at + i]
        good += 1
    return good


def _int16(frames, at):
    """The big-endian int16 at byte `at`. struct.unpack_from() would put a tuple on the heap for each frame."""
    value = frames[at] << 8 | frames[at + 1]
    return value - 65536 if value > 32767 else value


class AxisWatch:
    """Judges each axis. A working one is never quiet: its noise changes the counts (product specification PS-MPU-6000A
    rev 3.4, sections 6.1 and 6.2). So an axis is ill if its counts have only two values or keep their lowest bit (it is
    dead, or its low byte is stuck), if they jump through 256 counts while their high byte stays (which is stuck), or if
    they equal those of another axis.

    rate_hz: samples a second. accel_range, gyro_range: 0 (2 g, 250 deg/s) to 3 (16 g, 2000 deg/s). dlpf: see Mpu6050.
    repeats: repetitions of a frame that make it dead.

    notes: what add_up() notes. fault: None, or a Notice: an axis is ill, or half of the samples are at the end of the
    range. clipped: samples that were left out since power-on, because an axis was at its end.
    """

    def __init__(self, rate_hz, accel_range, gyro_range, dlpf, repeats):
        self.notes = array("i", [0] * 33)
        self.notes[_LIMIT] = repeats
        self.notes[_HARD] = _HARD_COUNTS if accel_range > 1 else 32769
        self.notes[DUE] = self._look = rate_hz * LOOK_MS // 1000
        self._limits = _ACCEL_LOOKS[dlpf - 1], _GYRO_LOOKS[6 * gyro_range + dlpf - 1]
        # For each column: successive looks in which it was quiet; looks in which it wrapped since its high byte changed
        self._quiet, self._wrapped = bytearray(7), bytearray(7)
        self._clips = self._well = self._ill = 0  # successive looks: clipped; without a fault; with an ill axis
        self._looks = 0
        self._noticed = {}  # number of the look at which a code was last shown
        self._shown = self.fault = None  # _shown: the Notice that is still to be shown
        self.clipped = 0

    def restart(self):
        """Forget the samples since the last look, because the chip was set up."""
        notes = self.notes
        notes[_REPEATS] = notes[_ROW] = notes[_ENDS] = notes[_CLIPPED] = notes[_GYRO_CLIPPED] = notes[_DIFFER] = 0
        notes[_SHAKEN] = 0
        for i in range(7):
            notes[_SEEN + i] = 0
        notes[DUE] = self._look

    def take_notice(self):
        """Return a Notice that is to be shown for a moment, or None, and clear it."""
        notice, self._shown = self._shown, None
        return notice

    def clips(self):
        """A Notice if the last samples, those of 0.1 s or more, were all at the end of the range; else None."""
        notes = self.notes
        if notes[_ROW] < notes[_LIMIT]:
            return None
        return Notice("clips", "Gyro" if notes[_ENDS] > 7 else "Accel")

    def shaken(self):
        """Since power-on: the largest |counts| of the accelerometer's axes (3), and the share of lost samples."""
        return self.notes[_PEAK : _PEAK + 3], self.clipped / max(1, self._looks * self._look)

    def look(self):
        """Judge the samples since the last look. To be called when notes[DUE] is 0 or less. Returns True if the chip
        should be set up, which may cure an axis: when it fell ill, and now and then."""
        notes = self.notes
        samples = self._look - notes[DUE]
        notes[DUE] = self._look
        self._looks += 1
        lost, gyro = notes[_CLIPPED], notes[_GYRO_CLIPPED]
        self.clipped += lost
        enough = 2 * lost < samples  # good ones to judge by
        shaken = 10 * notes[_SHAKEN] >= samples
        if shaken or not enough:
            self._clips += 1
        elif 4 * lost < samples:
            self._clips = 0
        fault = self._ill_axes()
        if not enough:
            fault = _ill(notes[_ENDS]) if lost == samples and self._clips >= _RAIL_LOOKS else None
        self._ill = self._ill + 1 if fault else 0
        if not fault and (shaken or 10 * lost >= samples):
            clips = Notice("clips", "Gyro" if lost and 2 * gyro >= lost else "Accel")
            self._notice(clips)
            if self._clips >= _CLIP_LOOKS:
                fault = clips
        notes[_ENDS] = notes[_CLIPPED] = notes[_GYRO_CLIPPED] = notes[_DIFFER] = notes[_SHAKEN] = 0
        if fault:
            self._well = 0
            self.fault = fault
            self._notice(fault)
        elif self.fault and enough:
            self._well += 1
            if self._well >= _WELL_LOOKS:
                self.fault = None
        return self._ill % _SETUP_LOOKS == 1

    def _ill_axes(self):
        """A Notice for axes that are ill, or None."""
        notes, quiet, wrapped = self.notes, self._quiet, self._wrapped
        dead = equal = 0
        for i in _COLUMNS:
            limit = self._limits[i > 3]
            if limit == 1 and not notes[_DIFFER] >> i & 1:
                equal |= 1 << i | 1 << (i - 1 if i & 3 else i + 2)
            seen = notes[_SEEN + i]
            values = seen & 0xFFFF
            more = values & (values - 1)  # without its lowest 1: 0 if there was one value
            if not (more & (more - 1) and values & 0x5555 and values & 0xAAAA):
                if quiet[i] < 255:
                    quiet[i] += 1
                if quiet[i] < limit or not limit:
                    continue  # the values of several looks are put together
                dead |= 1 << i
            else:
                quiet[i] = 0
                if seen & _HIGH_BYTE:
                    wrapped[i] = 0
                elif seen & _WRAPPED and wrapped[i] < _WRAP_LOOKS:
                    wrapped[i] += 1
                if wrapped[i] == _WRAP_LOOKS:
                    dead |= 1 << i
            notes[_SEEN + i] = 0
        return _ill(dead) if dead else _ill(equal, "equal") if equal else None

    def _notice(self, notice):
        if self._looks - self._noticed.get(notice.code, -_QUIET_LOOKS) >= _QUIET_LOOKS:
            self._noticed[notice.code] = self._looks
            self._shown = notice


def _ill(axes, how=None):
    """The Notice for these axes, a bit for each column: of the gyro, or if none of its is ill of the accelerometer."""
    gyro = axes >> 4
    names = "".join([AXES[i] for i in range(3) if (gyro or axes) >> i & 1])
    return Notice("axis-ill", "Gyro" if gyro else "Accel", names, how or ("dead" if gyro else "stuck"))


try:
    from .fifo_frames_viper import add_up, decode
except NO_MACHINE_CODE:
    add_up, decode = add_up_python, decode_python
else:
    _FRAME = b"\x7f\x00\x80\xff\xff\xff\x80\x00\x80\xff\x01\x00\xab\xcd"
    decode = checked(decode, decode_python, _FRAME, 0, array("h", range(7)))
    # Eight frames: numbers 2 and 4 are at the ends of the range, the last one repeats the one before
    _TRIAL = bytearray(_FRAME * 8)
    for _k in range(7):
        _TRIAL[14 * _k + 1] = _TRIAL[14 * _k + 9] = 250 - 40 * _k
    _TRIAL[28], _TRIAL[29], _TRIAL[66], _TRIAL[67] = 0x7F, 0xFF, 0x80, 0x00
    add_up = checked(add_up, add_up_python, _TRIAL, 8, array("i", range(7)), AxisWatch(20, 2, 1, 3, 2).notes)
    del _TRIAL
