"""Tests the driver with registers that do not change on their own: its writes, its checks, and its use of the FIFO
count.

The values are from the register map RM-MPU-6000A rev 4.2, and from the data sheets of the other chips.
"""

from typing import Any

import pytest
from kickstand.lean import lean_filter
from kickstand_tools.simulated_board.mpu6050 import DLPF_DELAY_US, VARIANTS
from kickstand_tools.simulated_board.simulator import Board

SMPLRT_DIV, CONFIG, GYRO_CONFIG, ACCEL_CONFIG, ACCEL_CONFIG2, FIFO_EN = 0x19, 0x1A, 0x1B, 0x1C, 0x1D, 0x23
USER_CTRL, PWR_MGMT_1, FIFO_COUNT_H, FIFO_R_W, WHO_AM_I = 0x6A, 0x6B, 0x72, 0x74, 0x75
MPU6500, MPU6886 = 0x70, 0x19


@pytest.fixture(autouse=True)
def time():
    """Return the clock of a simulated board. The driver's waits advance the clock."""
    with Board(lambda t_s: (0, 0, 1, 0, 0, 0)) as board:
        yield board.clock


class Wires:
    """A machine.I2C whose device consists only of registers.

    stuck: registers that a write does not change.
    log: list of the writes as (register, value).
    times_us: time of each write by the clock.
    waiting: number of bytes in the FIFO.
    """

    def __init__(self, who_am_i=0x68, stuck=(), clock=None):
        self.registers = bytearray(128)
        self.registers[WHO_AM_I] = who_am_i
        self.stuck = stuck
        self.log, self.times_us = [], []
        self.clock = clock
        self.waiting = 0
        self.read_of_fifo = []

    def _expect(self, address):
        if address != 0x68:
            raise OSError(5)

    def writeto_mem(self, address, register, data):
        self._expect(address)
        for value in data:
            self.log.append((register, value))
            self.times_us.append(self.clock.now_us if self.clock else 0)
            if register not in self.stuck:
                self.registers[register] = value

    def readfrom_mem_into(self, address, register, buffer):
        self._expect(address)
        # each byte takes 25 us, so the driver must read only the bytes that it uses
        if register not in (FIFO_R_W, USER_CTRL):
            assert len(buffer) == {SMPLRT_DIV: 11, 0x3B: 14, FIFO_COUNT_H: 2}.get(register, 1)
        self.registers[FIFO_COUNT_H], self.registers[FIFO_COUNT_H + 1] = divmod(self.waiting, 256)
        if register == FIFO_R_W:
            self.read_of_fifo.append(len(buffer))
            return
        if register == USER_CTRL:
            assert len(buffer) <= 3
        buffer[:] = self.registers[register : register + len(buffer)]


def started(wires, **settings):
    from kickstand.imu.mpu6050 import Mpu6050

    chip = Mpu6050(wires, **settings)
    chip.setup()
    return chip


def test_setup_writes_the_values_of_the_register_map(time):
    wires = Wires(clock=time)
    chip = started(wires, accel_range_g=16, gyro_range_dps=1000, dlpf=2, rate_hz=100)
    assert wires.log == [
        (PWR_MGMT_1, 0x80),  # reset the chip
        (PWR_MGMT_1, 0x01),  # wake up, with the clock of the gyro's X axis, as the register map recommends (p. 40)
        (SMPLRT_DIV, 9),  # a sample rate of 1 kHz / (1 + 9)
        (CONFIG, 2),
        (GYRO_CONFIG, 0x10),
        (ACCEL_CONFIG, 0x18),
        (FIFO_EN, 0),
        (USER_CTRL, 0x04),  # FIFO_RESET works only while FIFO_EN is 0
        (USER_CTRL, 0x40),
        (FIFO_EN, 0xF8),
    ]
    assert (chip.accel_lsb_per_g, chip.gyro_lsb_per_dps) == (2048, 32.8)
    reset, awake, configured, *_ = wires.times_us
    assert awake - reset >= 100_000  # longest duration of a reset (p. 41)
    assert configured - awake >= 30_000  # start-up time of the gyro (PS-MPU-6000A, 6.1)
    assert wires.times_us[6] - wires.times_us[5] >= 4 * 4800  # the wait for the widest delay among the usual low-passes
    assert wires.times_us[-1] - reset < 200_000


@pytest.mark.parametrize(
    ("accel_g", "accel_bits", "lsb_per_g", "gyro_dps", "gyro_bits", "lsb_per_dps"),
    [
        (2, 0x00, 16384, 250, 0x00, 131.0),
        (4, 0x08, 8192, 500, 0x08, 65.5),
        (8, 0x10, 4096, 1000, 0x10, 32.8),
        (16, 0x18, 2048, 2000, 0x18, 16.4),
    ],
)
def test_ranges_and_their_counts(accel_g, accel_bits, lsb_per_g, gyro_dps, gyro_bits, lsb_per_dps):
    """The expected values are from pages 14, 15, 29 and 31 of the register map."""
    wires = Wires()
    chip = started(wires, accel_range_g=accel_g, gyro_range_dps=gyro_dps)
    assert (wires.registers[ACCEL_CONFIG], wires.registers[GYRO_CONFIG]) == (accel_bits, gyro_bits)
    assert (chip.accel_range_g, chip.accel_lsb_per_g, chip.gyro_lsb_per_dps) == (accel_g, lsb_per_g, lsb_per_dps)


def test_one_burst_is_one_reading():
    """The registers 0x3B to 0x48 (p. 29) contain the accelerometer, the temperature and the gyro. The driver reads them
    in one transfer."""
    wires = Wires()
    chip = started(wires)
    wires.registers[0x3B:0x49] = bytes(range(0x70, 0x70 + 28, 2))
    chip.read()
    assert list(chip.counts[:2]) == [0x7072, 0x7476]
    assert list(chip.counts[4:]) == [(high << 8 | high + 2) - 65536 for high in (0x80, 0x84, 0x88)]


def test_the_delay_of_each_low_pass():
    """The delays of the gyro's low-pass are from p. 13 of the register map."""
    from kickstand.imu.mpu6050 import GYRO_DELAY_S

    assert GYRO_DELAY_S == {dlpf: DLPF_DELAY_US[dlpf] / 1e6 for dlpf in range(1, 7)}
    assert lean_filter.DELAY_S == GYRO_DELAY_S[3]  # the filter's default is the delay of the default low-pass


@pytest.mark.parametrize(
    ("who_am_i", "register"),
    [(0x68, r) for r in (SMPLRT_DIV, CONFIG, GYRO_CONFIG, ACCEL_CONFIG, PWR_MGMT_1)] + [(MPU6500, ACCEL_CONFIG2)],
)
def test_a_register_that_does_not_keep_its_setting_fails_setup(who_am_i, register):
    with pytest.raises(OSError, match="configuration does not read back"):
        started(Wires(who_am_i, stuck=(register,)))


@pytest.mark.parametrize("register", [FIFO_EN, USER_CTRL])
def test_a_fifo_that_does_not_start_fails_setup(register):
    with pytest.raises(OSError, match="FIFO does not read back"):
        started(Wires(stuck=(register,)))


@pytest.mark.parametrize("who_am_i", [0x68, MPU6500, MPU6886, 0x98])
def test_any_changed_register_ends_configured(who_am_i):
    wires = Wires(who_am_i)
    chip = started(wires)
    registers = [SMPLRT_DIV, CONFIG, GYRO_CONFIG, ACCEL_CONFIG, FIFO_EN, USER_CTRL, PWR_MGMT_1]
    if who_am_i != 0x68:
        registers.append(ACCEL_CONFIG2)
    assert chip.configured()
    for register in registers:
        kept = wires.registers[register]
        for other in (0, 0xFF, kept ^ 0x01) if register not in (FIFO_EN, USER_CTRL) else (0,):
            wires.registers[register] = other
            assert chip.configured() == (other == kept), hex(register)
        wires.registers[register] = kept
        assert chip.configured()


@pytest.mark.parametrize(("who_am_i", "bits"), [(0x68, 0xF8), (MPU6500, 0xF8), (0x98, 0xF8), (MPU6886, 0x18)])
def test_each_bit_of_the_fifo_that_the_chip_has_must_stay(who_am_i, bits):
    """Bits 7 to 3 of FIFO_EN stand for the temperature, gyro x, y and z, and the accelerometer. The MPU6886 has only
    bits 4 (gyro) and 3 (accelerometer)."""
    wires = Wires(who_am_i)
    chip = started(wires)
    for bit in range(8):
        wires.registers[FIFO_EN] = 0xF8 & ~(1 << bit)
        assert chip.configured() == (not bits & 1 << bit)


def test_an_unknown_number_is_an_unknown_chip_unless_accepted():
    from kickstand.imu.mpu6050 import Mpu6050, UnknownChip

    chip = Mpu6050(Wires(0x55))
    with pytest.raises(UnknownChip) as unknown:
        chip.setup()
    assert unknown.value.args == (0x55,)
    assert chip.name == "WHO 0x55"
    wires = Wires(0x55)
    accepted = started(wires, accept=0x55, dlpf=4)
    assert (ACCEL_CONFIG2, 4) in wires.log
    wires.registers[ACCEL_CONFIG2] = 0  # the chip may lack ACCEL_CONFIG2
    assert accepted.configured()
    assert accepted.temperature_c(333.87) == pytest.approx(22.0)
    assert Mpu6050(Wires(0x68), accept=0x55).identify() == 0x68


def test_a_number_that_reads_differently_each_time_is_an_error():
    """WHO_AM_I is read as 0x68 and as 0x78. Both numbers belong to known chips, and differ by one bit."""
    from kickstand.imu.mpu6050 import Mpu6050

    wires = Wires(0x68)
    chip = Mpu6050(wires)
    read = wires.readfrom_mem_into
    answers = [0x78, 0x68]

    def misread(address, register, buffer):
        read(address, register, buffer)
        buffer[0] = answers.pop(0)

    wires.readfrom_mem_into = misread
    with pytest.raises(OSError, match="reads differently"):
        chip.identify()
    wires.readfrom_mem_into = read
    assert chip.identify() == 0x68


def test_the_simulated_board_models_every_chip_of_the_driver():
    """Each chip of the driver has its own simulated model. Without a model of its own, a chip would be tested as an
    MPU6050. The FIFO of the model may be larger than the part that the driver uses."""
    from kickstand.imu.mpu6050 import CHIPS

    assert set(CHIPS) == set(VARIANTS)
    for who_am_i, (_, counts_per_c, zero_c, has_accel_config2, fifo_bytes, bits) in CHIPS.items():
        model = VARIANTS[who_am_i]
        assert (counts_per_c, zero_c, has_accel_config2) == (model.counts_per_c, model.zero_c, model.has_accel_config2)
        assert fifo_bytes == (512 if who_am_i == MPU6886 else model.fifo_bytes)
        assert bits == (0x18 if model.temperature_in_fifo else 0xF8)


@pytest.mark.parametrize(
    ("frames", "read", "left"),
    [(0, 0, 0), (1, 1, 0), (3, 3, 0), (4, 3, 1), (7, 3, 4), (8, 8, 0), (9, 8, 1), (20, 8, 12), (72, 8, 64)],
)
def test_how_many_frames_are_read_and_left(frames, read, left):
    """The driver reads at most three frames at a time, or eight to catch up. The MPU6050's FIFO has 1024 bytes, enough
    for 73 frames. With 72 frames the FIFO has not overflowed."""
    wires = Wires()
    chip = started(wires)
    wires.waiting = 14 * frames
    assert chip.fetch() == read
    assert (chip.frames_left, chip.overflows) == (left, 0)
    assert wires.read_of_fifo == ([14 * read] if read else [])


@pytest.mark.parametrize(("who_am_i", "most"), [(0x68, 72), (MPU6500, 35), (0x98, 35), (MPU6886, 35)])
def test_a_fifo_that_may_have_overflowed_is_emptied(who_am_i, most):
    """The FIFO has 1024 bytes, or 512 bytes (MPU-6500 register map p. 31). The FIFO is full if fewer than 14 bytes are
    free."""
    wires = Wires(who_am_i)
    chip = started(wires)
    wires.waiting = 14 * most
    assert chip.fetch() == 8
    wires.waiting = (1024 if who_am_i == 0x68 else 512) - 14  # the FIFO still has room for one frame
    assert (chip.fetch(), chip.overflows) == (0, 0)
    wires.waiting = 14
    assert chip.fetch() == 1
    for number, waiting in enumerate((14 * (most + 1), 1024 if who_am_i == 0x68 else 512), 1):
        del wires.log[:]
        wires.waiting = waiting
        assert chip.fetch() == 0
        assert (chip.overflows, chip.frames_left) == (number, 0)
        assert wires.log == [(FIFO_EN, 0), (USER_CTRL, 0x04), (USER_CTRL, 0x40), (FIFO_EN, 0xF8)]
    assert len(wires.read_of_fifo) == 2


def test_a_frame_that_is_being_written_is_waited_for_once():
    wires = Wires()
    chip = started(wires)
    for waiting, read, left in ((28 + 5, 0, 3), (42, 3, 0), (14 + 13, 0, 2), (28, 2, 0)):
        wires.waiting = waiting
        assert chip.fetch() == read
        assert (chip.frames_left, chip.overflows) == (left, 0)
    wires.waiting = 33
    assert chip.fetch() == 0
    wires.waiting = 47  # two odd numbers in a row mean that an overflow has cut off part of a frame
    assert chip.fetch() == 0
    assert (chip.overflows, chip.frames_left) == (1, 0)
    wires.waiting = 5
    assert chip.fetch() == 0
    assert chip.overflows == 1  # the emptied FIFO has an odd number of bytes for the first time


@pytest.mark.parametrize(("rate_hz", "good"), [(200, 20), (100, 10)])
def test_readings_that_repeat_for_100_ms_are_frozen(rate_hz, good):
    """The first reading counts as new. After a set-up the repetitions are counted again from the first reading."""
    wires = Wires()
    chip = started(wires, rate_hz=rate_hz)
    wires.waiting = 14
    chip._frames[0:14] = bytes(range(1, 15))

    def accepted():
        count = 0
        while chip.fetch() == 1 and chip.add_up(1) == 1:
            count += 1
        return count

    assert accepted() == good
    wires.waiting = 0
    chip.setup()
    wires.waiting = 14
    assert accepted() == good - 1  # the first reading repeats the last reading before the set-up


@pytest.mark.parametrize(
    ("who_am_i", "name", "zero_c", "per_degree"),
    [
        (0x68, "MPU6050", 36.53, 340.0),  # from RM-MPU-6000A p. 30
        (MPU6500, "MPU6500", 21.0, 333.87),  # MPU-6500 register map p. 33, with the sensitivity of the data sheet
        (0x71, "MPU9250", 21.0, 333.87),
        (0x98, "ICM20689", 25.0, 326.8),  # values from table 3 of the data sheet
        (MPU6886, "MPU6886", 25.0, 326.8),
    ],
)
def test_temperature_by_the_data_sheet(who_am_i, name, zero_c, per_degree):
    chip = started(Wires(who_am_i))
    assert chip.name == name
    assert chip.temperature_c(0) == zero_c
    assert chip.temperature_c(10 * per_degree) == pytest.approx(zero_c + 10.0)


def test_a_write_or_a_read_that_fails_is_repeated_once():
    from kickstand.imu.mpu6050 import Mpu6050

    wires: Any = Wires(0x68)
    chip = Mpu6050(wires)
    failures = []

    def failing(function):
        def call(*arguments):
            if failures:
                raise failures.pop()
            return function(*arguments)

        return call

    wires.writeto_mem, wires.readfrom_mem_into = failing(wires.writeto_mem), failing(wires.readfrom_mem_into)
    failures[:] = [OSError(5)]
    chip.write_register(CONFIG, 4)
    assert wires.log == [(CONFIG, 4)]
    failures[:] = [OSError(5)]
    assert chip.read_register(CONFIG) == 4
    for use in (lambda: chip.write_register(CONFIG, 5), lambda: chip.read_register(CONFIG)):
        failures[:] = [OSError(5), OSError(5)]
        with pytest.raises(OSError):
            use()
    assert wires.log == [(CONFIG, 4)]


def test_the_low_pass_of_a_rate_is_the_widest_under_half_of_it():
    """The values of DLPF_CFG are from the register map, p. 13. DLPF_CFG selects the gyro's bandwidth; the value 0
    selects 256 Hz."""
    from kickstand.imu.mpu6050 import MIN_DLPF

    hz = [256, 188, 98, 42, 20, 10, 5]
    widest = {rate: next(k for k, band in enumerate(hz) if band < rate / 2) for rate in (50, 100, 125, 200)}
    assert widest == MIN_DLPF


def test_a_row_of_samples_at_the_end_of_the_range_clips():
    """20 samples in a row, which are 0.1 s, are a fault. Each axis is a bit. The accelerometer's three bits are below
    the gyro's."""
    from kickstand.imu import fifo_frames

    watch = fifo_frames.AxisWatch(200, 3, 1, 3, 20)
    for row, ends, said in ((19, 0b0001, None), (20, 0b0001, "Accel"), (20, 0b0100, "Accel"), (21, 0b10000, "Gyro")):
        watch.notes[fifo_frames._ROW], watch.notes[fifo_frames._ENDS] = row, ends
        found = watch.clips()
        assert (found and (found.code, *found.values)) == (said and ("clips", said)), (row, ends)
