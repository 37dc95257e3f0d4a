"""The MPU6050's FIFO."""

from support.board_access import read, write
from test_board_sensor import awake

FRAME = 12


def numbered(t_s):
    """Return a reading that encodes its time in ms, in accelerometer x (range 2 g) and gyro z (range 250 deg/s)."""
    ms = round(t_s * 1000)
    return (ms / 16384, 0.5, 1.0, 0.0, 0.0, ms / 131.0)


def filling(who_am_i=0x68, fifo_en=0x78):
    """Return a chip at 1 kHz. The chip's FIFO was just emptied and enabled."""
    clock, chip = awake(numbered, who_am_i, div=0, dlpf=1)
    write(chip, 0x38, 0x11)
    write(chip, 0x23, fifo_en)
    write(chip, 0x6A, 0x04)
    write(chip, 0x6A, 0x40)
    return clock, chip


def waiting(chip):
    high, low = read(chip, 0x72, 2)
    return high << 8 | low


def frames(chip, count, size=FRAME):
    """Return (accelerometer x, gyro z) of whole frames."""
    found = []
    for _ in range(count):
        data = read(chip, 0x74, size)
        found.append((data[0] << 8 | data[1], data[-2] << 8 | data[-1]))
    return found


def test_the_frame_is_what_fifo_en_says():
    for fifo_en, size in ((0x78, 12), (0x08, 6), (0x70, 6), (0xF8, 14), (0x10, 2), (0x80, 2), (0x00, 0)):
        clock, chip = filling(fifo_en=fifo_en)
        clock.advance(5000)
        assert waiting(chip) == 5 * size
    clock, chip = filling(fifo_en=0xF8)
    clock.advance(1000)
    frame = read(chip, 0x74, 14)
    assert frame == read(chip, 0x3B, 14)


def test_the_count_is_latched_by_its_high_byte():
    clock, chip = filling()
    clock.advance(30_000)
    assert read(chip, 0x72) == [360 >> 8]
    clock.advance(30_000)
    assert read(chip, 0x73) == [360 & 0xFF]
    assert waiting(chip) == 720


def test_overflow_loses_the_oldest_and_the_alignment():
    for who_am_i, size in ((0x68, 1024), (0x70, 512), (0x19, 1024)):
        frame = 14 if who_am_i == 0x19 else FRAME
        clock, chip = filling(who_am_i)
        whole = size // frame
        clock.advance(whole * 1000)
        assert waiting(chip) == whole * frame
        assert read(chip, 0x3A)[0] & 0x10 == 0
        clock.advance(1000)
        assert waiting(chip) == size
        assert read(chip, 0x3A)[0] & 0x10
        assert read(chip, 0x3A)[0] & 0x10 == 0, "cleared by reading"
        # The oldest frame has lost its beginning, so the first byte is from its middle.
        lost = (whole + 1) * frame - size
        read(chip, 0x74, frame - lost)
        clock.advance(0)
        x, gyro = frames(chip, 1, frame)[0]
        assert x == gyro


def test_fifo_reset_acts_only_while_disabled():
    clock, chip = filling()
    clock.advance(5000)
    write(chip, 0x6A, 0x44)
    assert waiting(chip) == 60
    assert read(chip, 0x6A) == [0x40]
    write(chip, 0x6A, 0x04)
    assert waiting(chip) == 0
    assert read(chip, 0x6A) == [0]
    clock.advance(5000)
    assert waiting(chip) == 0
