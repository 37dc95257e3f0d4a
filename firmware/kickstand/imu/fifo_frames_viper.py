"""The functions decode_python() and add_up_python() of fifo_frames.py as machine code.

As machine code decode() takes 7 us, in Python 140 us. Both versions must give the same results.
host_tests/imu/test_batches.py compares them.
"""

import micropython


@micropython.viper
def decode(frames: ptr8, at: int, counts: ptr16):  # noqa: F821 the names are viper's
    for i in range(7):
        counts[i] = frames[at] << 8 | frames[at + 1]
        at += 2


@micropython.viper
def add_up(frames: ptr8, n: int, sums: ptr32, watch: ptr32) -> int:  # noqa: F821
    for i in range(7):
        sums[i] = 0
    watch[3] = 0
    watch[9] -= n
    good = 0
    at = 0
    for k in range(n):
        first = frames[at]
        same = 0
        mark = 0
        for i in range(14):
            byte = frames[at + i]
            if i < 6 and byte == first:
                same += 1
            if i < 6 or i > 7:
                mark = (mark * 31 + byte) & 0xFFFFFF
        if same == 6 and (first == 0 or first == 255):
            return good
        watch[1] = watch[1] + 1 if mark == watch[0] else 0
        watch[0] = mark
        if watch[1] >= watch[2]:
            return good
        ends = 0
        shaken = 0
        for i in range(7):
            value = frames[at] << 8 | frames[at + 1]
            if value > 32767:
                value -= 65536
            last = watch[12 + i]
            watch[12 + i] = value
            if value < 0:
                value = 0 - value
            if value > watch[26 + i]:
                watch[26 + i] = value
            if value >= 32700 and i != 3:
                ends |= 1 << i
            if value >= watch[10] and i < 3:
                shaken = 1
            # Read the value back from the array, as `last` was read. Read back from the array, both values are unsigned
            # on a 64-bit computer.
            value = watch[12 + i]
            seen = 1 << (value & 15)
            if value >> 8 != last >> 8:
                seen |= 0x10000
            elif value - last >= 192 or last - value >= 192:
                seen |= 0x20000
            watch[19 + i] |= seen
            if i & 3 and value != watch[11 + i]:
                watch[8] |= 1 << i
            if i & 3 == 2 and value != watch[10 + i]:
                watch[8] |= 1 << i - 2
            at += 2
        watch[11] += shaken
        if ends:
            watch[5] |= ends
            watch[3] += 1
            watch[4] += 1
            watch[6] += 1
            if ends > 7:
                watch[7] += 1
            continue
        watch[4] = 0
        for i in range(7):
            sums[i] += watch[12 + i]
        if good < k:
            last = (k - good) * 14
            for i in range(at - 14, at):
                frames[i - last] = frames[i]
        good += 1
    return good
