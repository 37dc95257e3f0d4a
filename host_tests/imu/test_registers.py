"""The driver on registers that do not change on their own: its writes, its checks, and its use of the FIFO count.

The values are from the register map RM-MPU-6000A rev 4.2, and from the data sheets of the other chips.
"""

import pytest
from kickstand.lean import lean_filter
from kickstand_sim.simulated_board.mpu6050 import DLPF_DELAY_US, VARIANTS
from kickstand_sim.simulated_board.simulator import Board
from support.board_access import level

SMPLRT_DIV, CONFIG, GYRO_CONFIG, ACCEL_CONFIG, ACCEL_CONFIG2, FIFO_EN = 0x19, 0x1A, 0x1B, 0x1C, 0x1D, 0x23
USER_CTRL, PWR_MGMT_1, FIFO_COUNT_H, FIFO_R_W, WHO_AM_I = 0x6A, 0x6B, 0x72, 0x74, 0x75
MPU6500, MPU6886, ICM20689 = 0x70, 0x19, 0x98


@pytest.fixture(autouse=True)
def clock():
    """Return the clock of a simulated board. The driver's waits advance the clock."""
    with Board(level) as board:
        yield board.clock


class Wires:
    """A machine.I2C whose device consists only of registers.

    stuck: registers that a write does not change.
    writes: list of (register, value), and times_us: their times by the clock.
    waiting: number of bytes in the FIFO.
    frame: the bytes of each frame.
    failures: number of the next transfers that fail.
    """

    def __init__(self, who_am_i=0x68, stuck=(), clock=None):
        self.registers = bytearray(128)
        self.registers[WHO_AM_I] = who_am_i
        self.stuck, self.clock = stuck, clock
        self.writes, self.times_us, self.fifo_reads = [], [], []
        self.waiting = self.failures = 0
        self.frame = bytes(14)

    def _transfer(self, address):
        self.failures -= 1
        if address != 0x68 or self.failures >= 0:
            raise OSError(5)

    def writeto_mem(self, address, register, data):
        self._transfer(address)
        for value in data:
            self.writes.append((register, value))
            self.times_us.append(self.clock.now_us if self.clock else 0)
            if register not in self.stuck:
                self.registers[register] = value

    def readfrom_mem_into(self, address, register, buffer):
        self._transfer(address)
        if register == FIFO_R_W:
            self.fifo_reads.append(len(buffer))
            buffer[:] = self.frame * (len(buffer) // 14)
            return
        # each byte takes 25 us, so the driver must read only the bytes that it uses
        limit = {SMPLRT_DIV: 11, 0x3B: 14, FIFO_COUNT_H: 2, USER_CTRL: 3}.get(register, 1)
        assert len(buffer) == limit or (register == USER_CTRL and len(buffer) == 1)
        self.registers[FIFO_COUNT_H], self.registers[FIFO_COUNT_H + 1] = divmod(self.waiting, 256)
        buffer[:] = self.registers[register : register + len(buffer)]


def started(wires, **settings):
    from kickstand.imu.mpu6050 import Mpu6050

    chip = Mpu6050(wires, **settings)
    chip.setup()
    return chip


def test_setup_writes_the_values_of_the_register_map(clock):
    wires = Wires(clock=clock)
    chip = started(wires, accel_range_g=16, gyro_range_dps=1000, dlpf=2, rate_hz=100)
    assert wires.writes == [
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
    assert (chip.accel_lsb_per_g, chip.gyro_lsb_per_dps, chip.period_ms) == (2048, 32.8, 10)
    reset, awake, configured, *_ = wires.times_us
    assert awake - reset >= 100_000  # longest duration of a reset (p. 41)
    assert configured - awake >= 30_000  # start-up time of the gyro (PS-MPU-6000A, 6.1)
    assert wires.times_us[6] - wires.times_us[5] >= 4 * 4800  # the wait for the widest delay among the usual low-passes
    assert wires.times_us[-1] - reset < 200_000


@pytest.mark.parametrize(
    ("accel_g", "gyro_dps", "bits", "lsb_per_g", "lsb_per_dps"),
    [(2, 250, 0x00, 16384, 131.0), (4, 500, 0x08, 8192, 65.5), (8, 1000, 0x10, 4096, 32.8),
     (16, 2000, 0x18, 2048, 16.4)],
)  # fmt: skip
def test_ranges_and_their_counts(accel_g, gyro_dps, bits, lsb_per_g, lsb_per_dps):
    """The expected values are from pages 14, 15, 29 and 31 of the register map."""
    wires = Wires()
    chip = started(wires, accel_range_g=accel_g, gyro_range_dps=gyro_dps)
    assert wires.registers[ACCEL_CONFIG] == wires.registers[GYRO_CONFIG] == bits
    assert (chip.accel_range_g, chip.accel_lsb_per_g, chip.gyro_lsb_per_dps) == (accel_g, lsb_per_g, lsb_per_dps)


def test_delays_and_low_passes_of_the_register_map():
    """DLPF_CFG selects the gyro's bandwidth and delay (p. 13). The low-pass of a rate is the widest below half of the
    rate. The filter's default is the delay of the default low-pass."""
    from kickstand.imu.mpu6050 import GYRO_DELAY_S
    from kickstand.setting_table import MIN_DLPF

    assert GYRO_DELAY_S == {dlpf: DLPF_DELAY_US[dlpf] / 1e6 for dlpf in range(1, 7)}
    assert lean_filter.DELAY_S == GYRO_DELAY_S[3]
    bands_hz = (256, 188, 98, 42, 20, 10, 5)
    assert MIN_DLPF == {r: next(k for k, hz in enumerate(bands_hz) if hz < r / 2) for r in (50, 100, 125, 200)}


def test_one_burst_is_one_reading():
    """The registers 0x3B to 0x48 (p. 29) contain the accelerometer, the temperature and the gyro."""
    wires = Wires()
    chip = started(wires)
    wires.registers[0x3B:0x49] = bytes(range(0x70, 0x70 + 28, 2))
    chip.read()
    assert list(chip.counts[:2]) == [0x7072, 0x7476]
    assert list(chip.counts[4:]) == [(high << 8 | high + 2) - 65536 for high in (0x80, 0x84, 0x88)]


@pytest.mark.parametrize(
    ("who_am_i", "register", "part"),
    [(0x68, r, "configuration") for r in (SMPLRT_DIV, CONFIG, GYRO_CONFIG, ACCEL_CONFIG, PWR_MGMT_1)]
    + [(MPU6500, ACCEL_CONFIG2, "configuration"), (0x68, FIFO_EN, "FIFO"), (0x68, USER_CTRL, "FIFO")],
)
def test_a_register_that_does_not_keep_its_setting_fails_setup(who_am_i, register, part):
    with pytest.raises(OSError, match=f"{part} does not read back"):
        started(Wires(who_am_i, stuck=(register,)))


@pytest.mark.parametrize(("who_am_i", "fifo_bits"), [(0x68, 0xF8), (MPU6500, 0xF8), (ICM20689, 0xF8), (MPU6886, 0x18)])
def test_any_changed_register_ends_configured(who_am_i, fifo_bits):
    """Bits 7 to 3 of FIFO_EN stand for the temperature, gyro x, y and z, and the accelerometer. The MPU6886 has only
    bits 4 (gyro) and 3 (accelerometer). Only the MPU6050 lacks ACCEL_CONFIG2."""
    wires = Wires(who_am_i)
    chip = started(wires)
    settings = [SMPLRT_DIV, CONFIG, GYRO_CONFIG, ACCEL_CONFIG, PWR_MGMT_1] + [ACCEL_CONFIG2] * (who_am_i != 0x68)
    changes = [(register, wires.registers[register] ^ bit) for register in settings for bit in (0x01, 0x80)]
    changes += [(PWR_MGMT_1 + 1, 1 << bit) for bit in range(6)] + [(USER_CTRL, 0)]
    changes += [(FIFO_EN, 0xF8 & ~bit) for bit in (0x80, 0x40, 0x20, 0x10, 0x08) if fifo_bits & bit]
    for register, value in changes:
        original, wires.registers[register] = wires.registers[register], value
        assert not chip.configured(), (hex(register), value)
        wires.registers[register] = original
        assert chip.configured()
    wires.registers[FIFO_EN] = fifo_bits
    assert chip.configured()


def test_the_number_of_a_chip_must_be_known_or_accepted_and_read_twice():
    from kickstand.imu.mpu6050 import Mpu6050, UnknownChip

    chip = Mpu6050(Wires(0x55))
    with pytest.raises(UnknownChip) as unknown:
        chip.setup()
    assert unknown.value.args == (0x55,) and chip.name == "WHO 0x55" and chip.address == 0x68
    wires = Wires(0x55)
    accepted = started(wires, accept=0x55, dlpf=4)
    assert (ACCEL_CONFIG2, 4) in wires.writes
    wires.registers[ACCEL_CONFIG2] = 0  # the chip may lack ACCEL_CONFIG2
    assert accepted.configured() and accepted.temperature_c(333.87) == pytest.approx(22.0)
    assert Mpu6050(Wires(0x68), accept=0x55).identify() == 0x68
    assert Mpu6050(Wires(0x68), address=0x69).identify() == 0x68  # at the other address

    class Misread(Wires):
        """WHO_AM_I is read as 0x78 at first. Both numbers belong to known chips, and differ by one bit."""

        def readfrom_mem_into(self, address, register, buffer):
            super().readfrom_mem_into(address, register, buffer)
            self.registers[WHO_AM_I] = 0x68

    with pytest.raises(OSError, match="reads differently"):
        Mpu6050(Misread(0x78)).identify()


def test_the_simulated_board_models_every_chip_of_the_driver():
    """Each chip of the driver has its own simulated model. Without a model of its own, a chip would be tested as an
    MPU6050. The FIFO of the model may be larger than the part that the driver uses."""
    from kickstand.imu.mpu6050 import CHIPS

    assert set(CHIPS) == set(VARIANTS)
    for who_am_i, (_, (counts_per_c, zero_c, has_accel_config2, fifo_bytes, bits)) in CHIPS.items():
        model = VARIANTS[who_am_i]
        assert (counts_per_c, zero_c, has_accel_config2) == (model.counts_per_c, model.zero_c, model.has_accel_config2)
        assert fifo_bytes == (512 if who_am_i == MPU6886 else model.fifo_bytes)
        assert bits == (0x18 if model.temperature_in_fifo else 0xF8)


@pytest.mark.parametrize(
    ("who_am_i", "name", "zero_c", "per_degree"),
    [
        (0x68, "MPU6050", 36.53, 340.0),  # from RM-MPU-6000A p. 30
        (MPU6500, "MPU6500", 21.0, 333.87),  # MPU-6500 register map p. 33, with the sensitivity of the data sheet
        (0x71, "MPU9250", 21.0, 333.87),
        (ICM20689, "ICM20689", 25.0, 326.8),  # values from table 3 of the data sheet
        (MPU6886, "MPU6886", 25.0, 326.8),
    ],
)
def test_temperature_by_the_data_sheet(who_am_i, name, zero_c, per_degree):
    chip = started(Wires(who_am_i))
    assert chip.name == name and chip.temperature_c(0) == zero_c
    assert chip.temperature_c(10 * per_degree) == pytest.approx(zero_c + 10.0)


@pytest.mark.parametrize(
    ("frames", "taken", "left"),
    [(0, 0, 0), (1, 1, 0), (3, 3, 0), (4, 3, 1), (7, 3, 4), (8, 8, 0), (9, 8, 1), (20, 8, 12), (72, 8, 64)],
)
def test_how_many_frames_are_read_and_left(frames, taken, left):
    """The driver reads at most three frames at a time, or eight to catch up. The MPU6050's FIFO has 1024 bytes, enough
    for 73 frames. With 72 frames the FIFO has not overflowed."""
    wires = Wires()
    chip = started(wires)
    wires.waiting = 14 * frames
    assert (chip.fetch(), chip.frames_left, chip.overflows) == (taken, left, 0)
    assert wires.fifo_reads == ([14 * taken] if taken else []) and chip.least_free_samples() == 73 - frames
    assert chip.waiting() == 14 * frames


@pytest.mark.parametrize(("who_am_i", "size"), [(0x68, 1024), (MPU6500, 512), (ICM20689, 512), (MPU6886, 512)])
def test_a_fifo_that_may_have_overflowed_is_emptied(who_am_i, size):
    """The FIFO has 1024 bytes, or 512 bytes (MPU-6500 register map p. 31). The FIFO is full if fewer than 14 bytes are
    free."""
    wires = Wires(who_am_i)
    chip = started(wires)
    restart = [(FIFO_EN, 0), (USER_CTRL, 0x04), (USER_CTRL, 0x40), (FIFO_EN, 0xF8)]
    limit = (size - 14) // 14
    for waiting, frames, remaining, overflows in (
        (14 * limit, 8, limit - 8, 0),
        (size - 14, 8, limit - 8, 0),  # there is room for one frame, and a frame is being written
        (14, 1, 0, 0),
        (14 * (limit + 1), 0, 0, 1),
        (size, 0, 0, 2),
        (28, 2, 0, 2),
        (5, 0, 0, 2),
    ):
        wires.writes.clear()
        emptied = chip.overflows < overflows
        wires.waiting = waiting
        assert (chip.fetch(), chip.frames_left, chip.overflows) == (frames, remaining, overflows), waiting
        assert wires.writes == (restart if emptied else [])
    assert chip.least_free_samples() == 0


def test_whole_frames_are_read_while_the_chip_writes_one():
    """The loop may meet the chip in the middle of a frame for many passes. Bytes that the bus lost or doubled look the
    same, but then the temperature jumps."""
    wires = Wires()
    chip = started(wires)
    wires.frame = bytes(range(1, 15))
    for waiting, frames in ((28, 2), *[(28 + 5, 2)] * 20, (9, 0)):
        wires.waiting = waiting
        assert (chip.fetch(), chip.overflows) == (frames, 0)
    wires.frame = bytes(range(101, 115))
    wires.waiting = 28
    assert (chip.fetch(), chip.overflows) == (2, 0), "a heated chip, with whole frames"
    for temperature in (b"\x00\x05", b"\xff\xfa"):  # the sign changes at 36.5 degrees C
        wires.frame, wires.waiting = bytes(6) + temperature + bytes(range(6)), 28 + 5 * (temperature[0] > 0)
        assert (chip.fetch(), chip.overflows) == (2, 0)
    wires.frame, wires.waiting = bytes(range(1, 15)), 28 + 5
    assert (chip.fetch(), chip.overflows, chip.frames_left) == (0, 1, 0)


@pytest.mark.parametrize(("rate_hz", "good"), [(200, 20), (100, 10)])
def test_readings_that_repeat_for_100_ms_are_frozen(rate_hz, good):
    """The first reading counts as new. After a set-up the repetitions are counted again from the first reading, which
    repeats the last reading before the set-up."""
    wires = Wires()
    wires.frame = bytes(range(1, 15))
    chip = started(wires, rate_hz=rate_hz)
    for count in (good, good - 1):
        wires.waiting = 14
        for _ in range(count):
            assert (chip.fetch(), chip.add_up(1)) == (1, 1)
        chip.take(0)
        assert list(chip.counts) == list(chip.sums) == [0x0102 + 0x202 * k for k in range(7)]
        assert (chip.fetch(), chip.add_up(1)) == (1, 0)
        wires.waiting = 0
        chip.setup()


def test_a_write_or_a_read_of_a_register_that_fails_is_repeated_once():
    from kickstand.imu.mpu6050 import Mpu6050

    wires = Wires()
    chip = Mpu6050(wires)
    for failures in (1, 2):
        for use in (lambda: chip.write_register(CONFIG, 4), lambda: chip.read_register(CONFIG)):
            wires.failures = failures
            if failures == 2:
                with pytest.raises(OSError):
                    use()
            else:
                assert use() in (None, 4)
    assert wires.writes == [(CONFIG, 4)]
