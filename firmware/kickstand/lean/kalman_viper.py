"""kalman.py's add_products_python() for 32-bit floats as machine code, which takes no heap.

Floats are taken apart and put together as integers. IEEE 754 binary32: a sign, 8 bits of exponent and 23 of the
mantissa, whose first bit is not stored. Each sum is rounded once, to the nearest float. A float below 1.2e-38 counts as
0. What is infinite, or would exceed 3.4e38, is not-a-number.
"""

import micropython


@micropython.viper
def add_products(out: ptr32, factors: ptr32, source: ptr32, rows: int, n: int):  # noqa: F821 the names are viper's
    not_a_number = 0 - 1  # all bits are 1
    at = 0
    for i in range(rows):
        a = factors[i]
        a_exponent = (a >> 23) & 255
        a_high = ((a >> 12) & 0x7FF) | 0x800  # the mantissa in halves of 12 bits: a product must fit in 31 bits
        a_low = a & 0xFFF
        for k in range(n):
            b = source[k]
            c = out[at]
            exponent = (b >> 23) & 255
            c_exponent = (c >> 23) & 255
            if a_exponent == 255 or exponent == 255 or c_exponent == 255:
                out[at] = not_a_number
            elif a_exponent and exponent:
                # Mantissas have 30 bits from here on: six more than a float's, and that of the product begins with 01
                # or 1. The value of both is mantissa x 2^(exponent - 156).
                exponent += a_exponent - 126
                high = ((b >> 12) & 0x7FF) | 0x800
                low = b & 0xFFF
                value = (a_high * high << 6) + ((a_high * low + a_low * high + (a_low * low >> 12)) >> 6)
                if ((a ^ b) >> 31) & 1:
                    value = 0 - value
                shift = c_exponent - exponent
                if shift > 0:
                    exponent = c_exponent
                    value >>= shift if shift < 31 else 31
                    shift = 0
                if c_exponent and shift > -31:
                    low = ((c & 0x7FFFFF) | 0x800000) << 6 >> (0 - shift)
                    value += 0 - low if (c >> 31) & 1 else low
                sign = 0
                if value < 0:
                    value = 0 - value
                    sign = 1
                if value >> 30:
                    value >>= 1
                    exponent += 1
                while value and value < 0x20000000:
                    value <<= 1
                    exponent -= 1
                if value == 0 or exponent <= 0:
                    out[at] = 0
                elif exponent > 254:
                    out[at] = not_a_number
                else:
                    out[at] = sign << 31 | (exponent << 23) + ((value + 32) >> 6) - 0x800000
            at += 1
