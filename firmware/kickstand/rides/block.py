"""The format of a recorded ride: blocks of a few thousand bytes, each readable without the others.

A block has these parts: a head (magic, format version, length, ride, sequence, time in us since power-on, temperature
at the block's end in hundredths of a degree Celsius, counts per g, ten times the counts per deg/s, samples per second,
firmware version, number of positions, delay of the gyro's low-pass in tenths of a millisecond, 0 in rides up to version
0.3.0); the calibration as store.pack() writes it, with matrices in blocks of format 2; the entries; zeros; the
positions, the last one first; a tail (number of entries, CRC32 of everything before it).

An entry describes one pass of the main loop, App.turn(), called "a turn" here. It has the number of samples (n), the
microseconds since the previous turn, and the sums of the samples' six counts (ax ay az gx gy gz). This keeps the exact
mean that the lean was computed from. An entry can also be a speed: n = 0, then centimetres per second.

A position is the number of its entry (a turn) and the four numbers of Gps.place(). Readers up to version 0.4.0 do not
know positions: they skip these bytes like the zeros and read the rest.

Each number is stored as its difference from a prediction: n sample periods for the time, the values of the previous
turn for the others. The difference is written in an adaptive Rice code (R. F. Rice, JPL publication 79-22), most
significant bit first. Zigzag coding makes the difference a size >= 0: 0, -1, 1, -2, ... become 0, 1, 2, 3, ... k is
log2 of the mean of the last sizes. The code is (size >> k) ones, a zero, and the low k bits of the size. If that would
take LIMIT ones or more, the code is LIMIT ones and then the size in RAW_BITS bits.
"""

import struct
from array import array
from binascii import crc32

from ..calibration.store import BODY_LENGTH, WHOLE_BODY_LENGTH
from ..errors import NO_MACHINE_CODE, checked
from ..units import __version__, const

MAGIC = b"KRID"
_VERSION = const(1)
_WHOLE_VERSION = const(2)  # the calibration has matrices
BODY_LENGTHS = {_VERSION: BODY_LENGTH, _WHOLE_VERSION: WHOLE_BODY_LENGTH}
HEAD = "<4sHHIIqhHHH10sBB"
_TEMPERATURE_AT = struct.calcsize("<4sHHIIq")
_PLACES_AT = struct.calcsize("<4sHHIIqhHHH10s")
PLACE = "<HHIii"
TAIL = "<HI"
BLOCK = 4096  # bytes in a flash block, the unit of erasing
FIELDS = 9  # values of an entry: n, dt_us, sums of ax ay az gx gy gz, speed
_SPEED = 8  # index of the speed in an entry
LIMIT = 12
RAW_BITS = 31
MEAN_SHIFT = 4  # a mean covers about the last 16 sizes, and is stored times 16
START_MEAN = 128 << MEAN_SHIFT
MAX_SIZE = 1 << 20  # a larger size counts as this in the mean, because the mean must fit in 32 bits
MAX_DT_US = 1 << 29  # the longest time between two turns that an entry can hold
_HEAD_LENGTH = struct.calcsize(HEAD)
_TAIL_LENGTH = struct.calcsize(TAIL)
_PLACE_LENGTH = struct.calcsize(PLACE)
_WORST = (FIELDS + 1) * (LIMIT + RAW_BITS) // 8 + 2  # the most bytes that a turn and a speed can take
# Indices in the coder's state, array('i', 22). From 0 on, FIELDS values: the previous entry. From _MEANS on, FIELDS
# values: the mean size of each field. Then: bits that do not yet fill a byte, their number, the index of the next byte
# in the buffer, and the sample period in us.
_MEANS, _PENDING, _BITS, _AT, _PERIOD = 9, 18, 19, 20, 21


def block_length(index):
    """Return the number of bytes in ride block `index` of a file: as many as the littlefs block with the same number
    can hold.

    Each block of littlefs except the first begins with 4-byte pointers to earlier blocks: one pointer, plus one for
    each time that the block's number can be halved (littlefs, SPEC.md, CTZ skip-lists). A ride block that ends where a
    block of littlefs ends is never copied when the file grows."""
    if index == 0:
        return BLOCK
    length = BLOCK - 4
    while index % 2 == 0:
        index //= 2
        length -= 4
    return length


def encode_python(entry, state, out):
    """Append an entry, array('i', FIELDS), to the buffer out. Update state, the coder's array('i', 22).

    On the board, encode() is the machine code of block_viper.py; elsewhere it is this function. Both write the same
    bytes."""
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
        if i or n:  # a speed (n = 0) does not replace the n of the previous turn
            state[i] = value


def _append(state, out, code, length):
    """Append the `length` bits of code to the buffer out."""
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
except NO_MACHINE_CODE:
    encode = encode_python
else:
    _ENTRY = array("i", (2, 9999, -30000, 30000, -1, 0, 255, -256, 0))
    # a trial state: the previous entry, means from small to large, and three pending bits
    _STATE = array("i", (3, 1, -1, 29000, 70, -7, 254, 77, 0) + tuple(range(16, 160, 16)) + (5, 3, 0, 5000))
    encode = checked(encode, encode_python, _ENTRY, _STATE, bytearray(40))


class RideBlock:
    """A ride block to fill: call begin(), add() until full(), close(). Then buffer[:length] is the block.

    period_us: nominal time from one sample to the next.  count: entries so far.
    """

    def __init__(self, period_us):
        self.buffer = bytearray(BLOCK)
        self._state = array("i", [0] * (_PERIOD + 1))
        self._state[_PERIOD] = period_us
        self._entry = array("i", [0] * FIELDS)
        self._temperature = 0  # temperature of the last turn, in counts
        self._reserved = 0  # bytes kept free for the next position; 0 before the first position

    def begin(self, length, ride, sequence, time_us, chip, sample_hz, body):
        """Begin an empty block. length: in bytes, with head and tail.  ride, sequence: the numbers of the ride and of
        the block in it.  time_us: time of the last sample before the block, since power-on.  chip: an Mpu6050.
        sample_hz: samples per second.  body: the calibration, from store.pack()."""
        state = self._state
        for i in range(FIELDS):
            state[i] = 0
            state[_MEANS + i] = START_MEAN
        state[0] = 1  # the prediction divides by the n of the previous turn
        state[_PENDING] = state[_BITS] = 0
        state[_AT] = _HEAD_LENGTH + len(body)
        # close() writes the two zeros: temperature and number of positions
        numbers = MAGIC, _WHOLE_VERSION if len(body) > BODY_LENGTH else _VERSION, length, ride, sequence, time_us, 0
        rates = chip.accel_lsb_per_g, int(10 * chip.gyro_lsb_per_dps + 0.5), sample_hz
        version, delay = __version__.encode()[:10], int(10_000 * chip.gyro_delay_s + 0.5)
        struct.pack_into(HEAD, self.buffer, 0, *numbers, *rates, version, 0, delay)
        self.buffer[_HEAD_LENGTH : state[_AT]] = body
        self._chip = chip
        self.length = length
        self.count = self._places = 0
        self._end = length - _TAIL_LENGTH  # where the positions begin

    def add(self, sums, n, dt_us):
        """Append a turn: the sums of n samples' seven counts, and the microseconds since the previous turn."""
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
        """Append a speed in cm/s. It belongs to the next turn."""
        self._entry[0] = 0
        self._entry[_SPEED] = cm_per_s
        encode(self._entry, self._state, self.buffer)
        self.count += 1

    def add_place(self, place):
        """Append a position. place: the result of Gps.place(). The position belongs to the next turn."""
        end = self._end - _PLACE_LENGTH
        if not self._reserved:
            self._reserved = _PLACE_LENGTH
            if self._state[_AT] + _WORST > end:
                return  # the first position of a block is dropped, because no room was kept for it
        struct.pack_into(PLACE, self.buffer, end, self.count, place[0], place[1], place[2], place[3])
        self._end = end
        self._places += 1

    def full(self):
        """True if the longest possible turn and speed, and a position, might no longer fit."""
        return self._state[_AT] + _WORST + self._reserved > self._end

    def close(self):
        """Complete the block: write the temperature, the last bits and the tail."""
        state, buffer = self._state, self.buffer
        struct.pack_into("<h", buffer, _TEMPERATURE_AT, int(100 * self._chip.temperature_c(self._temperature)))
        at = state[_AT]
        if state[_BITS]:
            buffer[at] = (state[_PENDING] << (8 - state[_BITS])) & 0xFF
            at += 1
        while at < self._end:
            buffer[at] = 0
            at += 1
        buffer[_PLACES_AT] = self._places
        tail = self.length - _TAIL_LENGTH
        struct.pack_into("<H", buffer, tail, self.count)
        struct.pack_into("<I", buffer, tail + 2, crc32(memoryview(buffer)[: tail + 2]))
