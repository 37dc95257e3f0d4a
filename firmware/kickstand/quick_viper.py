"""The functions that process each sample, as machine code. quick.py loads them.

As machine code decode() takes 7 us, in Python 140 us. A frame is one sample of 14 bytes, see axes.py.
"""

import micropython
from micropython import const

_FLOOR = const(0x2EDBE6FF)  # the float 1e-10


@micropython.viper
def decode(frames: ptr8, at: int, counts: ptr16):  # noqa: F821 the names are viper's
    """Decode a frame of the chip's FIFO.

    Args:
        frames: bytes; the frame begins at byte `at`.
        counts: array('h', 7) for the result.
    """
    for i in range(7):
        value = frames[at] << 8 | frames[at + 1]
        counts[i] = value - 65536 if value > 32767 else value
        at += 2


@micropython.viper
def add_up(frames: ptr8, n: int, sums: ptr32, watch: ptr32) -> int:  # noqa: F821
    """Add up the counts of n frames, and update the notes of the AxisWatch.

    A frame with an axis at the end of its range is skipped and counted in watch[3]. The good frames move to the
    beginning of `frames`. The function stops at the first dead frame. A frame is dead if the six bytes of its force are
    all 0x00 or all 0xFF, or if it repeats the previous frame too often.

    Args:
        frames: bytearray of 14 bytes per frame.
        sums: array('i', 7) for the result, in the order of a frame.
        watch: AxisWatch.notes. axes.py explains its indices.

    Returns:
        The number of frames added. After a dead frame this number plus watch[3] is less than n.
    """
    for i in range(7):
        sums[i] = 0
    watch[3] = 0
    watch[9] -= n
    good = 0
    index = 0
    for k in range(n):
        first = frames[index]
        equal_bytes = 0  # number of bytes of the force that equal its first byte
        mark = 0  # hash of all bytes but the temperature, which a working chip may repeat
        for i in range(14):
            byte = frames[index + i]
            if i < 6 and byte == first:
                equal_bytes += 1
            if i < 6 or i > 7:
                mark = (mark * 31 + byte) & 0xFFFFFF
        if equal_bytes == 6 and (first == 0 or first == 255):
            return good
        watch[1] = watch[1] + 1 if mark == watch[0] else 0
        watch[0] = mark
        if watch[1] >= watch[2]:
            return good
        ends = 0  # has a bit for each column at the end of its range
        shaken = 0
        for i in range(7):
            value = frames[index] << 8 | frames[index + 1]
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
            bits = 1 << (value & 15)
            if value >> 8 != last >> 8:
                bits |= 0x10000
            elif value - last >= 192 or last - value >= 192:
                bits |= 0x20000
            watch[19 + i] |= bits
            if i & 3 and value != watch[11 + i]:
                watch[8] |= 1 << i
            if i & 3 == 2 and value != watch[10 + i]:
                watch[8] |= 1 << i - 2
            index += 2
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
            for i in range(index - 14, index):
                frames[i - last] = frames[i]
        good += 1
    return good


@micropython.viper
def products(matrices: ptr32, sums: ptr32, n: int, out: ptr32):  # noqa: F821
    """Compute out[0:3] = A (sums[0:3], n) and out[3:6] = B (sums[4:7], n). The last column of A and B has the offsets.

    Args:
        matrices: the 3x4 matrices A and B, row by row, array('i', 24).
        sums: sums of counts in the chip's order, array('i', 7).
        n: number of samples in the sums.
        out: array('i', 6) for the result.
    """
    x, y, z = sums[0], sums[1], sums[2]
    index = 0
    for i in range(6):
        if i == 3:
            x, y, z = sums[4], sums[5], sums[6]
        out[i] = matrices[index] * x + matrices[index + 1] * y + matrices[index + 2] * z + matrices[index + 3] * n
        index += 4


@micropython.viper
def add_products(out: ptr32, factors: ptr32, source: ptr32, n: int, rows: int):  # noqa: F821
    """Compute add_products_python() of lean/kalman.py for 32-bit floats, without heap.

    The code takes floats apart and computes with integers. A 32-bit float (IEEE 754 binary32) has a sign, 8 bits of
    exponent and 23 bits of mantissa; the mantissa's first bit is always 1 and not stored. Each sum is rounded once,
    to the nearest float. A float below 1.2e-38 counts as 0. An infinite sum, or a sum over 3.4e38, becomes not-a-
    number. Positive floats have the same order as their bits.
    """
    for i in range(rows):
        a = factors[i]
        a_exponent = (a >> 23) & 255
        if a_exponent == 0:
            continue
        if a_exponent == 255:
            a_exponent = 1024  # an infinite factor makes every product too large
        a_exponent -= 126
        # the mantissa is split into halves of 12 bits, because a product must fit in 31 bits
        a_high = ((a >> 12) & 0x7FF) | 0x800
        a_low = a & 0xFFF
        index = i * n
        for k in range(i + 1 if rows > 1 else n):
            b = source[k]
            exponent = (b >> 23) & 255
            if exponent:
                # From here on mantissas have 30 bits, six more than a float's. The product's mantissa begins with 01
                # or 1. A value is mantissa x 2^(exponent - 156).
                if exponent == 255:
                    exponent = 1024
                exponent += a_exponent
                high = ((b >> 12) & 0x7FF) | 0x800
                low = b & 0xFFF
                value = (a_high * high << 6) + ((a_high * low + a_low * high + (a_low * low >> 12)) >> 6)
                if (a ^ b) >> 31:
                    value = 0 - value
                c = out[index]
                shift = ((c >> 23) & 255) - exponent
                if shift > 0:
                    exponent += shift
                    value >>= shift if shift < 31 else 31
                    shift = 0
                if shift > -31 and exponent + shift:
                    low = (((c & 0x7FFFFF) | 0x800000) << 6) >> (0 - shift)
                    value += 0 - low if c >> 31 else low
                if value:
                    sign = 0
                    if value < 0:
                        value = 0 - value
                        sign = 1
                    if value >> 30:
                        value >>= 1
                        exponent += 1
                    while value < 0x20000000:
                        value <<= 1
                        exponent -= 1
                    if exponent > 254:
                        value = 0 - 1  # not-a-number, in which all bits are 1
                    elif exponent > 0:
                        value = sign << 31 | (exponent << 23) + ((value + 32) >> 6) - 0x800000
                    else:
                        value = 0
                out[index] = value
                if rows > 1:
                    out[k * n + i] = value
            index += 1
        if rows > 1:
            b = out[index - 1]
            if (b < _FLOOR or b >> 31) and (b >> 23) & 255 < 255:  # too small or negative, and a number
                out[index - 1] = _FLOOR
