"""Computes kalman.py's add_products_python() for 32-bit floats in machine code, without heap.

The code takes floats apart and computes with integers. A 32-bit float (IEEE 754 binary32) has a sign, 8 bits of
exponent and 23 bits of mantissa; the mantissa's first bit is always 1 and not stored. Each sum is rounded once, to the
nearest float. A float below 1.2e-38 counts as 0. An infinite sum, or a sum over 3.4e38, becomes not-a-number.
"""

import micropython


@micropython.viper
def add_products(out: ptr32, factors: ptr32, source: ptr32, n: int, rows: int):  # noqa: F821 the names are viper's
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
