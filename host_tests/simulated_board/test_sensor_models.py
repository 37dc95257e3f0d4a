"""The model of the sensor by the register map: counts, sample rates, FIFO, self-test, and faults."""

import pytest
from kickstand_tools.simulated_board.clock import Clock
from kickstand_tools.simulated_board.mpu6050 import Fifo, Mpu6050


def test_a_fifo_loses_the_oldest_or_the_newest_bytes():
    fifo = Fifo(4)
    assert fifo.pop(2) == b"\0\0"
    assert not fifo.push(b"abc") and not fifo.push(b"d") and fifo.count == 4
    assert fifo.push(b"e") and fifo.pop(2) == b"bc"
    assert fifo.push(b"xyz", keep_old=True) and fifo.pop(9) == b"dexyyyyyy"
    assert fifo.count == 0 and fifo.pop() == b"y"
    fifo.push(b"abc")
    fifo.clear()
    assert fifo.count == 0


def sensor(world=lambda t_s: (0.5, -0.25, 1.0, 10.0, -20.0, 30.0, 36.53), who_am_i=0x68, **registers):
    """Return a sensor that is awake, after its first sample. registers: {name: value} to write."""
    clock = Clock()
    made = Mpu6050(clock, world, who_am_i)
    clock.advance(100_000)
    write(made, 0x6B, 0x01)
    clock.advance(100_000)
    for name, value in registers.items():
        write(
            made,
            {"config": 0x1A, "gyro": 0x1B, "accel": 0x1C, "divider": 0x19, "fifo": 0x23, "user": 0x6A}[name],
            value,
        )
    clock.advance(100_000)
    return made


def write(made, register, *values):
    made.start(0x68, False)
    for value in (register, *values):
        made.write_byte(value)


def words(made, register, count):
    """Read signed 16-bit numbers."""
    write(made, register)
    made.start(0x68, True)
    data = bytes(made.read_byte() for _ in range(2 * count))
    return [int.from_bytes(data[2 * k : 2 * k + 2], "big", signed=True) for k in range(count)]


def test_counts_of_the_smallest_ranges():
    assert words(sensor(), 0x3B, 7) == [8192, -4096, 16384, 0, 1310, -2620, 3930]


@pytest.mark.parametrize(
    ("code", "lsb_g", "lsb_dps"), [(0, 16384, 131.0), (1, 8192, 65.5), (2, 4096, 32.8), (3, 2048, 16.4)]
)
def test_counts_of_each_range(code, lsb_g, lsb_dps):
    made = sensor(gyro=code << 3, accel=code << 3)
    assert words(made, 0x3B, 3) == [lsb_g // 2, -lsb_g // 4, lsb_g]
    assert words(made, 0x43, 3) == [round(10 * lsb_dps), round(-20 * lsb_dps), round(30 * lsb_dps)]


def test_counts_end_at_the_end_of_the_range():
    assert words(sensor(lambda t_s: (3.0, -3.0, 0.0, 300.0, -300.0, 0.0)), 0x3B, 2) == [32767, -32768]
    assert words(sensor(lambda t_s: (3.0, -3.0, 0.0, 300.0, -300.0, 0.0)), 0x43, 2) == [32767, -32768]


@pytest.mark.parametrize(
    ("who_am_i", "temp_c", "counts"),
    [(0x68, 46.53, 3400), (0x70, 31.0, 3339), (0x98, 35.0, 3268), (0x19, 15.0, -3268), (0x68, None, -3920)],
)
def test_temperature_of_each_chip(who_am_i, temp_c, counts):
    """Without a temperature the sensor has 25 degrees."""
    force = (0.0, 0.0, 1.0, 0.0, 0.0, 0.0)
    assert words(sensor(lambda t_s: force if temp_c is None else (*force, temp_c), who_am_i), 0x41, 1) == [counts]


@pytest.mark.parametrize(
    ("config", "divider", "samples"),
    [(1, 9, 100), (1, 0, 1000), (0, 79, 100), (0, 7, 1000), (6, 4, 200), (7, 15, 500)],
)
def test_samples_per_second(config, divider, samples):
    """The gyro runs at 8 kHz without a low-pass, otherwise at 1 kHz."""
    made = sensor(config=config, divider=divider, fifo=0x08)
    write(made, 0x6A, 0x04)
    write(made, 0x6A, 0x40)
    made.clock.advance(100_000)
    made.start(0x68, False)
    assert made.fifo.count == pytest.approx(6 * samples / 10, abs=6)


def test_the_order_of_the_fifo():
    """Bits of FIFO_EN: temperature, x, y, z of the gyro, accelerometer. The data is in the order of the registers."""
    for enabled, count in ((0xF8, 14), (0x08, 6), (0x70, 6), (0x80, 2), (0x50, 4)):
        made = sensor(config=1, divider=99, fifo=enabled)
        write(made, 0x6A, 0x04)
        write(made, 0x6A, 0x40)
        made.clock.advance(100_100)
        made.start(0x68, False)
        assert made.fifo.count == count
    assert made.fifo.pop(4) == (1310).to_bytes(2, "big") + (3930).to_bytes(2, "big")


@pytest.mark.parametrize(("axis", "bit"), [(0, 0x80), (1, 0x40), (2, 0x20)])
def test_the_self_test_adds_the_factory_trim(axis, bit):
    """Formulas of the register map, pages 10 and 11, with the trim codes 13, 17, 22 and 9, 14, 11."""
    still = sensor(lambda t_s: (0.0,) * 6)
    plain = words(still, 0x3B, 7)
    made = sensor(lambda t_s: (0.0,) * 6, accel=bit | 0x10, gyro=bit)
    found = words(made, 0x3B, 7)
    trims_g, trims_dps = (13, 17, 22), (9, 14, 11)
    accel = 4096 * 0.34 * (0.92 / 0.34) ** ((trims_g[axis] - 1) / 30)
    gyro = 25 * 131 * 1.046 ** (trims_dps[axis] - 1) * (-1 if axis == 1 else 1)
    assert found[axis] - plain[axis] == pytest.approx(accel, abs=1) and found[4 + axis] == pytest.approx(gyro, abs=1)
    assert [found[k] for k in range(3) if k != axis] == [0, 0] and [found[4 + k] for k in range(3) if k != axis] == [
        0,
        0,
    ]
    made.self_test[axis], made.self_test[3 + axis] = 0.5, 0.0
    made.clock.advance(10_000)
    assert words(made, 0x3B, 7)[axis] == pytest.approx(accel / 2, abs=1) and words(made, 0x3B, 7)[4 + axis] == 0


def test_faults_of_the_data():
    made = sensor()
    made.override(0xFF)
    made.clock.advance(10_000)
    assert words(made, 0x3B, 2) == [-1, -1]
    made.override("freeze")
    made.world = lambda t_s: (0.0,) * 6
    made.clock.advance(10_000)
    assert words(made, 0x3B, 2) == [-1, -1]
    made.override(None)
    made.clock.advance(10_000)
    assert words(made, 0x3B, 2) == [0, 0]


@pytest.mark.parametrize(
    ("leaves", "power", "data"),
    [("asleep", 0x40, 0), ("frozen", 0x40, 8192), ("default_ranges", 0x01, 8192), ("torn", 0x40, 0)],
)
def test_a_dip_of_the_supply(leaves, power, data):
    made = sensor(accel=0x08)
    made.world = lambda t_s: (0.5, 0.0, 0.0, 0.0, 0.0, 0.0)
    made.clock.advance(10_000)
    assert words(made, 0x3B, 1) == [4096]
    made.supply_dip(leaves)
    made.clock.advance(10_000)
    assert made.peek(0x6B) == power
    assert words(made, 0x3B, 1) == [4096 if leaves == "frozen" else data]
    assert made.fifo.count == (14 if leaves == "torn" else 0)
