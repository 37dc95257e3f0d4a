"""mpu6050.decode_plainly as machine code. See there."""

import micropython


@micropython.viper
def decode(frames: ptr8, at: int, counts: ptr16):  # noqa: F821 the names are viper's
    for i in range(7):
        counts[i] = frames[at] << 8 | frames[at + 1]
        at += 2
