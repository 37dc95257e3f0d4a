"""A recorded ride: blocks of a few thousand bytes, each of which can be read without the others. Pure format.

A block: head (magic, format version, length, ride, sequence, time in us since power-on, hundredths of a degree
Celsius at its end, counts per g, ten times the counts per deg/s, samples per second, firmware version),
the calibration as store.pack() writes it, turns, filling, tail (number of entries, CRC32 of everything before it).

An entry is one turn of the loop: how many samples came in (n), the microseconds since the turn before and the sums
of their six counts, so that the mean that the lean was computed from is kept exactly. Or it is a speed: n = 0, then
centimetres a second. Each number is kept as the difference from what was to be expected (the time from n, the
others from the turn before) by an adaptive Rice code: zigzag, k = log2 of the mean size of late, size >> k in ones
ended by a zero, then k bits; from LIMIT ones on there is no zero, and RAW_BITS of the size follow. Most significant
bit first.
"""

import struct
from array import array
from binascii import crc32

from .. import __version__
from ..calibration.store import BODY_LENGTH

MAGIC = b"KRID"
VERSION = 1
HEAD = "<4sHHIIqhHHH12s"
_TEMPERATURE_AT = struct.calcsize("<4sHHIIq")
TAIL = "<HI"
BLOCK = 4096  # of the flash
FIELDS = 9  # n, dt_us, sums of ax ay az gx gy gz, speed
_SPEED = 8
LIMIT = 12
RAW_BITS = 31
MEAN_SHIFT = 4  # the mean of about the last 16 sizes, times 16
START_MEAN = 128 << MEAN_SHIFT
MAX_SIZE = 1 << 20  # that a mean is told of
MAX_DT_US = 1 << 29
_HEAD_LENGTH = struct.calcsize(HEAD) + BODY_LENGTH
_TAIL_LENGTH = struct.calcsize(TAIL)
_WORST = (FIELDS + 1) * (LIMIT + RAW_BITS) // 8 + 2  # bytes of a turn and a speed
_MEANS, _PENDING, _BITS, _AT, _PERIOD = 9, 18, 19, 20, 21  # the coder's state, after the entry before


def block_length(index):
    """Bytes of block `index` of a file: what littlefs puts into its own block of that number beside 4-byte pointers
    to blocks before (SPEC.md of littlefs, CTZ skip-lists). Blocks that end where its own do are never copied."""
    if index == 0:
        return BLOCK
    length = BLOCK - 4
    while index % 2 == 0:
        index //= 2
        length -= 4
    return length


def encode_plainly(entry, state, out):
    """Append an entry."""
    n, before = entry[0], state[0]
    for i in range(_SPEED) if n else (0, _SPEED):
        value, guess = entry[i], state[i]
        if i == 1:
            guess = n * state[_PERIOD]
        elif 1 < i < _SPEED and n != before:
            guess = guess * n // before
        difference = value - guess
        size = (difference << 1) ^ (difference >> 31)
        mean = state[_MEANS + i]
        k = 0
        while mean >> (k + MEAN_SHIFT + 1):
            k += 1
        ones = size >> k
        if ones < LIMIT:
            _append(state, out, (1 << (ones + 1)) - 2, ones + 1)
            _append(state, out, size & ((1 << k) - 1), k)
        else:
            _append(state, out, (1 << LIMIT) - 1, LIMIT)
            _append(state, out, size, RAW_BITS)
        state[_MEANS + i] = mean + min(size, MAX_SIZE) - (mean >> MEAN_SHIFT)
        if i or n:  # a speed leaves the n of the turn before
            state[i] = value


def _append(state, out, code, length):
    pending = state[_PENDING] << length | code
    bits = state[_BITS] + length
    while bits >= 8:
        bits -= 8
        out[state[_AT]] = pending >> bits
        state[_AT] += 1
        pending &= (1 << bits) - 1
    state[_PENDING], state[_BITS] = pending, bits


try:
    from .block_viper import encode
except (ImportError, NameError, SyntaxError):  # CPython, or a port without viper
    encode = encode_plainly


class RideBlock:
    """One block being filled: begin(), add() until full(), close(); then buffer[:length] is the block.

    period_us: nominal, of one sample.  count: entries so far.
    """

    def __init__(self, period_us):
        self.buffer = bytearray(BLOCK)
        self._state = array("i", [0] * (_PERIOD + 1))
        self._state[_PERIOD] = period_us
        self._entry = array("i", [0] * FIELDS)
        self._temperature = 0  # counts, of the last turn
        self.length = 0
        self.count = 0

    def begin(self, length, ride, sequence, time_us, chip, sample_hz, body):
        """An empty block of so many bytes. time_us: of the last sample before it, since power-on.  chip: an Mpu6050.
        body: of store.pack()."""
        state = self._state
        for i in range(FIELDS):
            state[i] = 0
            state[_MEANS + i] = START_MEAN
        state[0] = 1  # something to divide by
        state[_PENDING] = state[_BITS] = 0
        state[_AT] = _HEAD_LENGTH
        version = __version__.encode()[:12]
        struct.pack_into(
            HEAD,
            self.buffer,
            0,
            MAGIC,
            VERSION,
            length,
            ride,
            sequence,
            time_us,
            0,  # temperature, known at close()
            chip.accel_lsb_per_g,
            int(10 * chip.gyro_lsb_per_dps + 0.5),
            sample_hz,
            version,
        )
        self.buffer[_HEAD_LENGTH - BODY_LENGTH : _HEAD_LENGTH] = body
        self._chip = chip
        self.length = length
        self.count = 0

    def add(self, sums, n, dt_us):
        """One turn: the sums of n samples' seven counts, and the microseconds since the turn before."""
        entry = self._entry
        entry[0] = n
        entry[1] = dt_us
        entry[2] = sums[0]
        entry[3] = sums[1]
        entry[4] = sums[2]
        entry[5] = sums[4]
        entry[6] = sums[5]
        entry[7] = sums[6]
        self._temperature = sums[3] // n
        encode(entry, self._state, self.buffer)
        self.count += 1

    def add_speed(self, cm_per_s):
        """A new speed, which belongs to the turn after it."""
        self._entry[0] = 0
        self._entry[_SPEED] = cm_per_s
        encode(self._entry, self._state, self.buffer)
        self.count += 1

    def full(self):
        """True when there is no room for any entry that might come."""
        return self._state[_AT] + _WORST + _TAIL_LENGTH > self.length

    def close(self):
        """Write the temperature, the last bits and the tail."""
        state, buffer = self._state, self.buffer
        struct.pack_into("<h", buffer, _TEMPERATURE_AT, int(100 * self._chip.temperature_c(self._temperature)))
        at = state[_AT]
        if state[_BITS]:
            buffer[at] = (state[_PENDING] << (8 - state[_BITS])) & 0xFF
            at += 1
        tail = self.length - _TAIL_LENGTH
        while at < tail:
            buffer[at] = 0
            at += 1
        struct.pack_into("<H", buffer, tail, self.count)
        struct.pack_into("<I", buffer, tail + 2, crc32(memoryview(buffer)[: tail + 2]))
