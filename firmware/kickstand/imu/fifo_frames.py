"""Decodes frames of the chip's FIFO and sums them up.

A frame is one sample: 14 bytes, seven big-endian int16 in the order ax ay az temperature gx gy gz (register map
RM-MPU-6000A rev 4.2, pp. 29 to 31). On the board decode() and add_up() are the machine code of fifo_frames_viper.py;
elsewhere they are decode_python() and add_up_python(), which give the same results.
"""

from array import array

from ..errors import NO_MACHINE_CODE, checked

FRAME = 14  # bytes


def decode_python(frames, at, counts):
    """Put the frame that begins at byte `at` of frames into counts, array('h', 7)."""
    for i in range(7):
        counts[i] = _int16(frames, at + 2 * i)


def add_up_python(frames, n, sums, watch):
    """Add n frames into sums, array('i', 7), and return n; stop at the first bad frame and return how many came before.

    A frame is bad if the six bytes of its force are all 0x00 or all 0xFF, or if it is like watch[2] frames before it.
    watch: array('i', 3) that the caller keeps from call to call: a hash of the last frame, how many times in a row it
    has been repeated, and how many repetitions make a frame bad.
    """
    for i in range(7):
        sums[i] = 0
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
            return k
        watch[1] = watch[1] + 1 if mark == watch[0] else 0
        watch[0] = mark
        if watch[1] >= watch[2]:
            return k
        for i in range(7):
            sums[i] += _int16(frames, at + 2 * i)
    return n


def _int16(frames, at):
    """The big-endian int16 at byte `at`. struct.unpack_from() would put a tuple on the heap for each frame."""
    value = frames[at] << 8 | frames[at + 1]
    return value - 65536 if value > 32767 else value


try:
    from .fifo_frames_viper import add_up, decode
except NO_MACHINE_CODE:
    add_up, decode = add_up_python, decode_python
else:
    _ENDS = b"\x7f\xff\x80\x00\xff\xff\x00\x80\x80\xff\x01\x00\xab\xcd"
    decode = checked(decode, decode_python, _ENDS, 0, array("h", range(7)))
    # array("i", (12493472, 3, 9)): a watch whose last frame has the same hash as this one
    add_up = checked(add_up, add_up_python, _ENDS, 1, array("i", range(7)), array("i", (12493472, 3, 9)))
