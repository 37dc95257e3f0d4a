"""The format of a recorded ride: blocks of a few thousand bytes, each readable without the others.

A block has these parts, in this order:
1. the head
2. the calibration as store.pack() writes it; only blocks of format 2 have the calibration's matrices
3. the entries
4. zeros
5. the positions, the last position first
6. the tail: the number of entries, and the CRC32 of everything before it

The head has these fields:
* magic, format version, length in bytes
* number of the ride, number of the block in the ride
* time since power-on in us
* temperature at the block's end, in hundredths of a degree Celsius
* counts per g, ten times the counts per deg/s, samples per second
* firmware version, number of positions
* delay of the gyro's low-pass in tenths of a millisecond; 0 in rides up to version 0.3.0

An entry describes the samples of one pass of the main loop by the number of samples (n), the microseconds since the
previous samples (dt_us), and the sums of the samples' six counts (ax ay az gx gy gz). From these numbers a replay
computes the same mean as the board. An entry can also be a speed. Then n is 0, and the speed in cm/s follows.

A position has five numbers: the index of the entry with the next samples after the fix, and the four numbers of
Gps.place(). Readers up to version 0.4.0 do not know positions. These readers skip the positions like the zeros, and
read the rest.

Each number is stored as its difference from a prediction. The prediction of dt_us is n sample periods. The prediction
of each other number is its value in the previous entry. The difference is written in an adaptive Rice code (R. F. Rice,
JPL publication 79-22), most significant bit first:
1. Zigzag coding turns the difference into a size >= 0. The differences 0, -1, 1, -2, ... become 0, 1, 2, 3, ...
2. k is log2 of the mean of the last sizes, rounded down.
3. The code is (size >> k) ones, a zero, and the low k bits of the size.
4. If the code would begin with LIMIT ones or more, it is LIMIT ones and then the size in RAW_BITS bits.
"""

import struct
from array import array
from binascii import crc32

from ..calibration.store import BODY_LENGTH, WHOLE_BODY_LENGTH
from ..quick import load
from ..units import __version__, const

MAGIC = b"KRID"
_VERSION = const(1)
_WHOLE_VERSION = const(2)  # format of a block whose calibration has matrices
BODY_LENGTHS = {_VERSION: BODY_LENGTH, _WHOLE_VERSION: WHOLE_BODY_LENGTH}
HEAD = "<4sHHIIqhHHH10sBB"
_TEMPERATURE_AT = struct.calcsize("<4sHHIIq")
_PLACES_AT = struct.calcsize("<4sHHIIqhHHH10s")
PLACE = "<HHIii"
TAIL = "<HI"
BLOCK = 4096  # bytes in a flash block, the unit of erasing
FIELDS = 9  # number of values in an entry: n, dt_us, the sums of ax ay az gx gy gz, speed
_SPEED = 8  # index of the speed in an entry
LIMIT = 12
RAW_BITS = 31
MEAN_SHIFT = 4  # a mean covers about the last 16 sizes, and is stored multiplied by 16
START_MEAN = 128 << MEAN_SHIFT
MAX_SIZE = 1 << 20  # largest size in a mean; larger sizes count as MAX_SIZE, because the mean must fit in 32 bits
MAX_DT_US = 1 << 29  # the longest time between two passes that an entry can hold
_HEAD_LENGTH = struct.calcsize(HEAD)
_TAIL_LENGTH = struct.calcsize(TAIL)
_PLACE_LENGTH = struct.calcsize(PLACE)
_WORST = (FIELDS + 1) * (LIMIT + RAW_BITS) // 8 + 2  # the most bytes that samples and a speed can take together
# Indices in the state of the coder, an array('i', 22). The first FIELDS values are the previous entry. The other values
# are:
# * from _MEANS on, the mean size of each of the FIELDS values
# * _PENDING: the bits that do not yet fill a byte; _BITS: the number of these bits
# * _AT: the index of the next byte in the buffer
# * _PERIOD: the sample period in us
_MEANS, _PENDING, _BITS, _AT, _PERIOD = 9, 18, 19, 20, 21


def block_length(index):
    """Return the number of bytes in ride block `index` of a file. A ride block fills the littlefs block of the same
    index.

    Each block of littlefs except the first begins with 4-byte pointers to earlier blocks. A block has one pointer, and
    one more pointer for each time that its index can be halved (littlefs, SPEC.md, CTZ skip-lists). A ride block that
    ends together with a block of littlefs is never copied when the file grows."""
    if index == 0:
        return BLOCK
    length = BLOCK - 4
    while index % 2 == 0:
        index //= 2
        length -= 4
    return length


def _encoding():
    entry = array("i", (2, 9999, -30000, 30000, -1, 0, 255, -256, 0))
    # The state has a previous entry, small and large means, and three pending bits
    state = array("i", (3, 1, -1, 29000, 70, -7, 254, 77, 0) + tuple(range(16, 160, 16)) + (5, 3, 0, 5000))
    return (entry, state, bytearray(40)), 0x72657E63


(encode,) = load("rides/block_viper", ("encode", _encoding))
del _encoding


class RideBlock:
    """A ride block to fill. Call begin(), then add() until full() is True, then close(). Then buffer[:length] is the
    block.

    Args:
        period_us: nominal time from one sample to the next.

    Attributes:
        buffer: bytearray of BLOCK bytes.
        length: length of the block in bytes, with head and tail.
        count: number of entries so far.
    """

    def __init__(self, period_us):
        self.buffer = bytearray(BLOCK)
        self._state = array("i", [0] * (_PERIOD + 1))
        self._state[_PERIOD] = period_us
        self._entry = array("i", [0] * FIELDS)
        self._temperature = 0  # temperature of the last entry, in counts
        self._reserved = 0  # bytes kept free for the next position; 0 before the first position

    def begin(self, length, ride, sequence, time_us, chip, sample_hz, body):
        """Begin an empty block.

        Args:
            length: length of the block in bytes, with head and tail.
            ride: number of the ride.
            sequence: number of the block in the ride.
            time_us: time from power-on to the last sample before the block.
            chip: an Mpu6050.
            sample_hz: samples per second.
            body: the calibration as bytes, from store.pack().
        """
        state = self._state
        for i in range(FIELDS):
            state[i] = 0
            state[_MEANS + i] = START_MEAN
        state[0] = 1  # not 0, because the prediction divides by the n of the previous samples
        state[_PENDING] = state[_BITS] = 0
        state[_AT] = _HEAD_LENGTH + len(body)
        # close() replaces the two zeros by the temperature and the number of positions
        numbers = MAGIC, _WHOLE_VERSION if len(body) > BODY_LENGTH else _VERSION, length, ride, sequence, time_us, 0
        rates = chip.accel_lsb_per_g, int(10 * chip.gyro_lsb_per_dps + 0.5), sample_hz
        version, delay = __version__.encode()[:10], int(10_000 * chip.gyro_delay_s + 0.5)
        struct.pack_into(HEAD, self.buffer, 0, *numbers, *rates, version, 0, delay)
        self.buffer[_HEAD_LENGTH : state[_AT]] = body
        self._chip = chip
        self.length = length
        self.count = self._places = 0
        self._end = length - _TAIL_LENGTH  # index in the buffer where the positions begin

    def add(self, sums, n, dt_us):
        """Append the samples of a pass of the loop.

        Args:
            sums: the sums of the samples' seven counts.
            n: number of samples.
            dt_us: microseconds since the previous samples.
        """
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
        """Append the speed at the next samples, in cm/s."""
        self._entry[0] = 0
        self._entry[_SPEED] = cm_per_s
        encode(self._entry, self._state, self.buffer)
        self.count += 1

    def add_place(self, place):
        """Append the position at the next samples.

        Args:
            place: the result of Gps.place().
        """
        end = self._end - _PLACE_LENGTH
        if not self._reserved:
            self._reserved = _PLACE_LENGTH
            if self._state[_AT] + _WORST > end:
                return  # the first position of a block is dropped, because no room was kept for it
        struct.pack_into(PLACE, self.buffer, end, self.count, place[0], place[1], place[2], place[3])
        self._end = end
        self._places += 1

    def full(self):
        """Return True if samples, a speed and a position of the largest size would no longer fit."""
        return self._state[_AT] + _WORST + self._reserved > self._end

    def close(self):
        """Complete the block: write the temperature, the last bits and the tail."""
        state, buffer = self._state, self.buffer
        struct.pack_into("<h", buffer, _TEMPERATURE_AT, int(100 * self._chip.temperature_c(self._temperature)))
        index = state[_AT]
        if state[_BITS]:
            buffer[index] = (state[_PENDING] << (8 - state[_BITS])) & 0xFF
            index += 1
        while index < self._end:
            buffer[index] = 0
            index += 1
        buffer[_PLACES_AT] = self._places
        tail = self.length - _TAIL_LENGTH
        struct.pack_into("<H", buffer, tail, self.count)
        struct.pack_into("<I", buffer, tail + 2, crc32(memoryview(buffer)[: tail + 2]))
