"""The model of the sensor by the register map: counts, sample rates, FIFO, self-test, and faults."""

import pytest
from kickstand_sim.simulated_board.clock import Clock
from kickstand_sim.simulated_board.mpu6050 import START_UP_US, WAKE_US, Mpu6050
from support.board_access import counts, level, read, write

DIVIDER, GYRO, ACCEL, POWER = 0x19, 0x1B, 0x1C, 0x6B


def tilted(t_s):
    return 0.5, -0.25, 1.0, 10.0, -20.0, 30.0, 36.53


def sensor(world=tilted, who_am_i=0x68, registers=()):
    """Return a sensor that is awake and has sampled, after these (register, value) were written."""
    chip = Mpu6050(Clock(), world, who_am_i)
    chip.clock.advance(START_UP_US)
    write(chip, POWER, 0x01)
    chip.clock.advance(WAKE_US)
    for register, value in registers:
        write(chip, register, value)
    chip.clock.advance(100_000)
    return chip


def test_reset_values_and_the_time_of_a_reset():
    """A reset forgets everything, and the chip's data is 0 until it is woken."""
    chip = Mpu6050(Clock(), level)
    chip.clock.advance(START_UP_US)
    for _ in range(2):
        values = [read(chip, register)[0] for register in range(0x80) if register != 0x74]
        trims = values[0x0D:0x11]
        assert all(trims) and {k: v for k, v in enumerate(values) if v and k not in range(0x0D, 0x11)} == {
            POWER: 0x40, 0x74: 0x68  # WHO_AM_I, because the list lacks 0x74
        }  # fmt: skip
        write(chip, POWER, 0x01)
        write(chip, GYRO, 0x18)
        chip.clock.advance(100_000)
        assert counts(chip)[2] == 16384
        write(chip, POWER, 0x80)
        assert read(chip, POWER) == [0xC0] and read(chip, DIVIDER, 3) == [0, 0, 0]
        chip.clock.advance(START_UP_US)
    assert counts(chip) == [0] * 7


@pytest.mark.parametrize(
    ("code", "lsb_g", "lsb_dps"), [(0, 16384, 131.0), (1, 8192, 65.5), (2, 4096, 32.8), (3, 2048, 16.4)]
)
def test_counts_of_each_range(code, lsb_g, lsb_dps):
    registers = (GYRO, code << 3), (ACCEL, code << 3)
    data = counts(sensor(registers=registers))
    assert data == [lsb_g // 2, -lsb_g // 4, lsb_g, 0, *(round(rate * lsb_dps) for rate in (10, -20, 30))]
    beyond = counts(sensor(lambda t_s: (40.0, -40.0, 0.0, 4000.0, -4000.0, 0.0), registers=registers))
    assert [beyond[k] for k in (0, 1, 4, 5)] == [32767, -32768] * 2


@pytest.mark.parametrize(
    ("who_am_i", "temp_c", "count"),
    [(0x68, 46.53, 3400), (0x70, 31.0, 3339), (0x98, 35.0, 3268), (0x19, 15.0, -3268), (0x68, None, -3920)],
)
def test_temperature_of_each_chip(who_am_i, temp_c, count):
    """Without a temperature the sensor has 25 degrees."""
    assert counts(sensor(lambda t_s: level(t_s) if temp_c is None else (*level(t_s), temp_c), who_am_i))[3] == count


@pytest.mark.parametrize(("axis", "bit"), [(0, 0x80), (1, 0x40), (2, 0x20)])
def test_the_self_test_adds_the_factory_trim(axis, bit):
    """Formulas of the register map, pages 10 and 11, with the trim codes 13, 17, 22 and 9, 14, 11."""
    accel = 4096 * 0.34 * (0.92 / 0.34) ** (((13, 17, 22)[axis] - 1) / 30)
    gyro = 25 * 131 * 1.046 ** ((9, 14, 11)[axis] - 1) * (-1 if axis == 1 else 1)
    chip = sensor(lambda t_s: (0.0,) * 6, registers=((ACCEL, bit | 0x10), (GYRO, bit)))
    for share in (1.0, 0.5):
        chip.self_test[axis] = chip.self_test[3 + axis] = share
        chip.clock.advance(10_000)
        data = counts(chip)
        added = [accel * share if k == axis else gyro * share if k == 4 + axis else 0 for k in range(7) if k != 3]
        assert data[:3] + data[4:] == pytest.approx(added, abs=1)
