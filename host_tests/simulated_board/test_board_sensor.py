"""The registers of the simulated MPU6050."""

from kickstand_tools.simulated_board.clock import Clock
from kickstand_tools.simulated_board.mpu6050 import START_UP_US, WAKE_US, Mpu6050
from support.board_access import counts, level, read, write


def ramp(t_s):
    """Return a motion whose values encode the time: 1 count per millisecond in the widest gyro range."""
    return (t_s, -t_s, 1.0, t_s * 10.0, 0.0, -t_s * 10.0, 25.0)


def awake(world=level, who_am_i=0x68, div=9, dlpf=3):
    """Return a clock, and a chip that has started and samples at 1000 / (1 + div) Hz."""
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
    found = read(chip, 0, 0x74) + [0] + read(chip, 0x75, 11)
    assert all(found[0x0D:0x11])  # the factory's trim, which differs from chip to chip
    assert found[:0x0D] + [0] * 4 + found[0x11:] == expected


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


def test_the_low_pass_delays():
    for dlpf, delay_us in ((1, 1900), (3, 4800), (6, 18_600)):
        clock, chip = awake(ramp, div=0, dlpf=dlpf)
        clock.advance(1_000_000)
        sampled_us = clock.now_us - clock.now_us % 1000  # START_UP_US and WAKE_US are whole milliseconds
        assert abs(counts(chip)[0] - (sampled_us - delay_us) * 16384 / 1e6) <= 0.5
