"""The MPU6050 at its registers. Also run under MicroPython."""

from board_access import counts, level, read, write
from kickstand_tools.simulated_board.clock import Clock
from kickstand_tools.simulated_board.mpu6050 import START_UP_US, VARIANTS, WAKE_US, Mpu6050


def ramp(t_s):
    """Every figure tells the time: 1 count a millisecond in the widest gyro range, and so on."""
    return (t_s, -t_s, 1.0, t_s * 10.0, 0.0, -t_s * 10.0, 25.0)


def awake(world=level, who_am_i=0x68, div=9, dlpf=3):
    """A clock and a chip that samples at 1000 / (1 + div) Hz, some time after start."""
    clock = Clock()
    chip = Mpu6050(clock, world, who_am_i)
    clock.advance(START_UP_US)
    write(chip, 0x6B, 0x01)
    clock.advance(WAKE_US)
    write(chip, 0x19, div, dlpf)
    clock.advance(50_000)
    return clock, chip


def test_reset_values():
    clock = Clock()
    chip = Mpu6050(clock, level)
    clock.advance(START_UP_US)
    expected = [0] * 128
    expected[0x6B], expected[0x75] = 0x40, 0x68
    assert read(chip, 0, 0x74) + [0] + read(chip, 0x75, 11) == expected


def test_who_am_i_variants():
    for who_am_i, (power, _, _, _, size, _) in VARIANTS.items():
        clock = Clock()
        chip = Mpu6050(clock, level, who_am_i)
        clock.advance(START_UP_US)
        assert read(chip, 0x75) == [who_am_i]
        assert read(chip, 0x6B) == [power]
        assert chip.fifo.size == size
    assert set(VARIANTS) == {0x68, 0x70, 0x71, 0x72, 0x73, 0x74, 0x78, 0x98, 0x19}


def test_reset_takes_time_and_forgets_everything():
    clock, chip = awake()
    write(chip, 0x1B, 0x18)
    write(chip, 0x6B, 0x80)
    assert read(chip, 0x6B) == [0x80 | 0x40]
    assert read(chip, 0x19, 3) == [0, 0, 0]
    write(chip, 0x6B, 0x01)
    clock.advance(START_UP_US)
    assert read(chip, 0x6B) == [0x40]
    assert counts(chip) == [0] * 7


def test_ranges_and_saturation():
    def world(t_s):
        return (1.5, -1.5, 0.5, 200.0, -200.0, 300.0)

    for bits, lsb_per_g, lsb_per_dps in ((0, 16384, 131.0), (1, 8192, 65.5), (2, 4096, 32.8), (3, 2048, 16.4)):
        clock, chip = awake(world)
        write(chip, 0x1B, bits << 3, bits << 3)
        clock.advance(20_000)
        values = counts(chip)
        assert values[:3] == [1.5 * lsb_per_g, -1.5 * lsb_per_g, 0.5 * lsb_per_g]
        assert values[4:6] == [round(200 * lsb_per_dps), round(-200 * lsb_per_dps)]
        assert values[6] == (32767 if bits == 0 else round(300 * lsb_per_dps))
    _, chip = awake(lambda t_s: (9.0, -9.0, 2.0, 0.0, 0.0, -999.0))
    assert counts(chip)[:3] == [32767, -32768, 32767]
    assert counts(chip)[6] == -32768


def test_sample_rate():
    for div, dlpf, period_us in (
        (0, 3, 1000),
        (4, 1, 5000),
        (9, 6, 10_000),
        (255, 2, 256_000),
        (79, 0, 10_000),
        (7, 7, 1000),
    ):
        clock, chip = awake(ramp, div=div, dlpf=dlpf)
        write(chip, 0x38, 0x01)
        clock.advance(2 * period_us)
        seen, times = read(chip, 0x3A)[0], []
        for _ in range(4 * period_us // 125):
            clock.advance(125)
            seen = read(chip, 0x3A)[0]
            if seen:
                times.append(clock.now_us)
        assert len(times) == 4, (div, dlpf, times)
        assert times[3] - times[0] == 3 * period_us


def test_a_clock_error_moves_the_samples():
    clock, chip = awake(ramp, div=9)
    chip.clock_error = 0.01
    write(chip, 0x19, 8)
    write(chip, 0x19, 9)
    write(chip, 0x38, 0x01)
    samples = 0
    for _ in range(10_000):
        clock.advance(1000)
        samples += read(chip, 0x3A)[0]
    assert samples == 1010


def test_the_low_pass_delays():
    for dlpf, delay_us in ((1, 1900), (3, 4800), (6, 18_600)):
        clock, chip = awake(ramp, div=0, dlpf=dlpf)
        clock.advance(1_000_000)
        sampled_us = clock.now_us - clock.now_us % 1000  # START_UP_US and WAKE_US are whole milliseconds
        assert abs(counts(chip)[0] - (sampled_us - delay_us) * 16384 / 1e6) <= 0.5
