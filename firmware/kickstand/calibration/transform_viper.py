"""The function products_python() of transform.py as machine code. Both functions must give the same integers."""

import micropython


@micropython.viper
def products(matrices: ptr32, sums: ptr32, n: int, out: ptr32):  # noqa: F821 the names are viper's
    x, y, z = sums[0], sums[1], sums[2]
    at = 0
    for i in range(6):
        if i == 3:
            x, y, z = sums[4], sums[5], sums[6]
        out[i] = matrices[at] * x + matrices[at + 1] * y + matrices[at + 2] * z + matrices[at + 3] * n
        at += 4
