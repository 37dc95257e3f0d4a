"""Frames of the chip's FIFO, or of one burst: fourteen bytes, seven big-endian int16, one sampling instant."""

FRAME = 14


def decode_plainly(frames, at, counts):
    """Seven big-endian int16 from byte `at` of frames into counts, array('h', 7)."""
    for i in range(7):
        value = frames[at] << 8 | frames[at + 1]
        counts[i] = value - 65536 if value > 32767 else value
        at += 2


def add_up_plainly(frames, n, sums, watch):
    """Sum n frames into sums, array('i', 7), up to the first that is no reading; return how many they are.

    No reading is one whose force is all zeros or all ones, nor, after watch[2] times, one that is like the one before.
    watch: array('i', 3), kept from call to call: a mark of the last frame, how often it has come again, and that limit.
    """
    for i in range(7):
        sums[i] = 0
    at = 0
    for k in range(n):
        first = frames[at]
        same = 0
        mark = 0
        for i in range(FRAME):
            byte = frames[at + i]
            if i < 6 and byte == first:
                same += 1
            if i < 6 or i > 7:  # the temperature may well stand still
                mark = (mark * 31 + byte) & 0xFFFFFF
        if same == 6 and (first == 0 or first == 255):
            return k
        watch[1] = watch[1] + 1 if mark == watch[0] else 0
        watch[0] = mark
        if watch[1] >= watch[2]:
            return k
        for i in range(7):
            value = frames[at] << 8 | frames[at + 1]
            sums[i] += value - 65536 if value > 32767 else value
            at += 2
    return n


try:
    from .fifo_frames_viper import add_up, decode
except (ImportError, NameError, SyntaxError):  # CPython, or a port without viper
    add_up, decode = add_up_plainly, decode_plainly
