"""Driver for the InvenSense MPU6050 and the chips sold under its name. It returns raw counts.

Sources: register map RM-MPU-6000A rev 4.2 (the page numbers below); product specification PS-MPU-6000A rev 3.4.

    from time import sleep_ms
    from machine import I2C, Pin
    from kickstand.imu.mpu6050 import Mpu6050

    chip = Mpu6050(I2C(0, sda=Pin(4), scl=Pin(5), freq=400_000))
    chip.setup()
    chip.read()  # the newest sample: chip.counts is now ax ay az temperature gx gy gz
    print(chip.name, chip.temperature_c(chip.counts[3]), "degrees C")
    while True:
        for k in range(chip.fetch()):  # every sample since the last fetch(), oldest first
            chip.take(k)
            print([count / chip.accel_lsb_per_g for count in chip.counts[0:3]], "g")
        sleep_ms(10)  # the chip's FIFO keeps the samples for up to 0.17 s at 200 samples per second
"""

from array import array
from time import sleep_ms

from micropython import const

from .axes import FRAME, SATURATED, AxisWatch, add_up, decode

# The registers that setup() writes follow one another: SMPLRT_DIV (p. 11), CONFIG with DLPF_CFG (p. 13), GYRO_CONFIG
# (p. 14), ACCEL_CONFIG (p. 15) and, if the chip has it, ACCEL_CONFIG2. ACCEL_CONFIG2 sets the low-pass of the
# accelerometer alone.
_SMPLRT_DIV = const(0x19)
_FIFO_EN = const(0x23)  # p. 16
_ACCEL_XOUT_H = const(0x3B)  # p. 29; the fourteen bytes from this register on are one sample
_USER_CTRL = const(0x6A)  # p. 38
_PWR_MGMT_1 = const(0x6B)  # p. 40
_FIFO_COUNT_H = const(0x72)  # p. 43; reading this register latches the low byte in the next register
_FIFO_R_W = const(0x74)  # p. 44
_WHO_AM_I = const(0x75)  # p. 45

_RESET = const(0x80)  # bit of PWR_MGMT_1
_STANDBY = const(0x3F)  # bits of PWR_MGMT_2 (p. 42), the register after PWR_MGMT_1; each bit turns an axis off
# Value of PWR_MGMT_1 that selects the gyro's clock, which is accurate to 1 %. The oscillator that runs after a reset is
# off by up to 5 %.
_CLOCK_PLL_GYRO_X = const(0x01)
_FIFO_ALL = const(0xF8)  # value of FIFO_EN for the fourteen bytes of temperature, gyro and accelerometer
_FIFO_ENABLE = const(0x40)  # bit of USER_CTRL
_FIFO_RESET = const(0x04)  # bit of USER_CTRL

ACCEL_LSB_PER_G = {2: 16384, 4: 8192, 8: 4096, 16: 2048}  # counts per g for each range in g (p. 29)
GYRO_LSB_PER_DPS = {250: 131.0, 500: 65.5, 1000: 32.8, 2000: 16.4}  # counts per deg/s for each range in deg/s (p. 31)
# For each dlpf, the delay of the gyro in seconds (p. 13)
GYRO_DELAY_S = {1: 0.0019, 2: 0.0028, 3: 0.0048, 4: 0.0083, 5: 0.0134, 6: 0.0186}

# The supported chips by WHO_AM_I: name, at most 12 characters, and kind. A kind has, in this order:
# * temperature counts per degree C
# * the temperature in degrees C at 0 counts
# * True if the chip has the register ACCEL_CONFIG2 (0x1D)
# * usable size of its FIFO in bytes
# * bits of FIFO_EN that must read back as written
# Also add a new chip to VARIANTS in tools/kickstand_sim/simulated_board/mpu6050.py and to the parts in the README. A
# chip with other registers (LSM6DS3, BMI160) needs a driver with the same methods. Settings.open_sensor() must open
# that driver.
MPU6500 = (333.87, 21.0, True, 512, 0xF8)
ICM20602 = (326.8, 25.0, True, 1008, 0x18)  # FIFO_EN has no bit for the temperature, which is always stored
CHIPS = {
    0x68: ("MPU6050", (340.0, 36.53, False, 1024, 0xF8)),
    0x70: ("MPU6500", MPU6500),
    0x71: ("MPU9250", MPU6500),
    0x72: ("MPU6500 0x72", MPU6500),
    0x73: ("MPU9255", MPU6500),
    0x74: ("MPU6515", MPU6500),
    0x78: ("MPU6500 0x78", MPU6500),
    0x98: ("ICM20689", (326.8, 25.0, True, 512, 0xF8)),
    0x19: ("MPU6886", (326.8, 25.0, True, 512, 0x18)),  # as ICM20602
    0x12: ("ICM20602", ICM20602),
    0x11: ("ICM20600", ICM20602),
}
_LSB_PER_C = const(0)
_ZERO_C = const(1)
_HAS_ACCEL_CONFIG2 = const(2)
_FIFO_BYTES = const(3)
_FIFO_EN_BITS = const(4)

_MAX_FRAMES = const(8)  # most frames in one transfer, which then takes 3 ms at 400 kHz
# Most frames in one transfer while fewer than _MAX_FRAMES are in the FIFO. Because of this limit, one slow pass of the
# loop does not slow the next pass.
_FEW_FRAMES = const(3)
_STEP = const(512)  # largest change of the temperature between two fetches, in counts: 1.5 degrees C
# Longest time for which readings may stay equal, because noise changes every sample of a working chip
_FROZEN_MS = const(100)


class UnknownChip(Exception):
    """The chip that answers is not in CHIPS. args[0] is its WHO_AM_I."""


class NotKept(OSError):
    """A chip answers, but registers do not read back as written. args[0] says in words which registers."""


class Mpu6050:
    """One chip on one bus.

    Args:
        i2c: a machine.I2C.
        address: the I2C address to try first, 0x68, or 0x69 with AD0 high.
        accel_range_g: 2, 4, 8 or 16.
        gyro_range_dps: 250, 500, 1000 or 2000.
        dlpf: DLPF_CFG, the low-pass, from 1 (184 Hz) to 6 (5 Hz).
        rate_hz: samples per second. The rate must be 1000 divided by an integer from 1 to 256.
        accept: a WHO_AM_I that is not in CHIPS. A chip with this number is treated as an MPU6500.

    Attributes:
        address: the I2C address of the chip. Until a set-up succeeds, each set-up also tries the other address.
        who_am_i: the content of the chip's WHO_AM_I; 0 before setup().
        name: the chip's name in CHIPS, or its WHO_AM_I in hexadecimal, at most 12 characters; "" before setup().
        counts: the counts of the last read() or take(), array('h', 7): ax ay az temperature gx gy gz.
        sums: the sums of the last add_up(), array('i', 7), in the same order.
        accel_lsb_per_g: counts per g.
        gyro_lsb_per_dps: counts per deg/s.
        period_ms: time from one sample to the next.
        gyro_delay_s: delay of the gyro that the low-pass causes.
        overflows: number of times that the FIFO was emptied and samples were lost.
        frames_left: number of samples that the last fetch() left in the FIFO.
        axes: an AxisWatch, which judges each axis.
    """

    saturated = SATURATED

    def __init__(self, i2c, address=0x68, accel_range_g=16, gyro_range_dps=500, dlpf=3, rate_hz=200, accept=None):
        self._i2c = i2c
        self.address = address
        self._accept = accept
        self.who_am_i, self.name = 0, ""
        self.accel_range_g = accel_range_g
        self.accel_lsb_per_g = ACCEL_LSB_PER_G[accel_range_g]
        self.gyro_lsb_per_dps = GYRO_LSB_PER_DPS[gyro_range_dps]
        self.gyro_delay_s = GYRO_DELAY_S[dlpf]
        self.period_ms = 1000 // rate_hz
        accel_bits = (2, 4, 8, 16).index(accel_range_g) << 3
        gyro_bits = (250, 500, 1000, 2000).index(gyro_range_dps) << 3
        # values of the five registers from SMPLRT_DIV on
        self._configuration = bytes((self.period_ms - 1, dlpf, gyro_bits, accel_bits, dlpf))
        self._one, self._two, self._three = bytearray(1), bytearray(2), bytearray(3)
        self._readback = bytearray(_FIFO_EN - _SMPLRT_DIV + 1)
        self._frames = bytearray(FRAME * _MAX_FRAMES)
        self._in_step = False  # True if the frames hold samples from after the last start of the FIFO
        # Entry n is a view of the first n frames. The views are created once, because each slice takes heap.
        self._some_frames = [memoryview(self._frames)[: FRAME * n] for n in range(_MAX_FRAMES + 1)]
        self.frames_left = self.overflows = 0
        self._most = 0  # largest number of bytes found in the FIFO
        self._settled = False  # True once a chip was started at this address, so the other address is not tried
        self._started = False  # True once setup() is complete and the FIFO fills
        self._full = 0  # number of bytes in the FIFO above which it may have overflowed
        self.counts, self.sums = array("h", [0] * 7), array("i", [0] * 7)
        self.axes = AxisWatch(rate_hz, accel_bits >> 3, gyro_bits >> 3, dlpf, rate_hz * _FROZEN_MS // 1000)

    def connect(self, i2c):
        """Use another machine.I2C from now on."""
        self._i2c = i2c

    def identify(self):
        """Read WHO_AM_I and return it. Raises UnknownChip, or OSError from the bus."""
        try:
            return self._identify()
        except (UnknownChip, OSError) as error:
            if self._settled:
                raise
            # Try the other address: AD0 may be wired the other way, or a clock chip may use the first address
            self.address ^= 1
            try:
                return self._identify()
            except (UnknownChip, OSError) as other:
                self.address ^= 1
                raise error if isinstance(error, UnknownChip) or isinstance(other, OSError) else other

    def _identify(self):
        self.who_am_i = number = self.read_register(_WHO_AM_I)
        self.name = CHIPS[number][0] if number in CHIPS else "WHO 0x%02X" % number
        # WHO_AM_I is read twice, because a misread number would select the calibration of another chip.
        if self.read_register(_WHO_AM_I) != self.who_am_i:
            raise OSError("MPU6050 WHO_AM_I reads differently each time")
        if self.who_am_i not in CHIPS and self.who_am_i != self._accept:
            raise UnknownChip(self.who_am_i)
        self._full = self._kind()[_FIFO_BYTES] - FRAME
        return self.who_am_i

    def setup(self):
        """Identify, reset and configure the chip, and start its FIFO. This takes 0.2 s.

        Raises:
            UnknownChip: the chip is not in CHIPS.
            NotKept: registers do not read back as written.
            OSError: a transfer on the bus failed.
        """
        for wait_ms in self.configure():
            sleep_ms(wait_ms)
        self.start()

    def configure(self):
        """Do the steps of setup() except start(), as a generator.

        Before each pause the generator yields the milliseconds to wait. The caller can do other work during the pauses.
        Raises the same errors as setup()."""
        self._started = False
        self.identify()
        self.write_register(_PWR_MGMT_1, _RESET)
        yield 100
        self.write_register(_PWR_MGMT_1, _CLOCK_PLL_GYRO_X)
        yield 60  # ms to wait, because a write too soon after a reset is lost without an error
        for i in range(5 if self._kind()[_HAS_ACCEL_CONFIG2] else 4):
            self.write_register(_SMPLRT_DIV + i, self._configuration[i])
        if not self.configured():
            raise NotKept("MPU6050 configuration does not read back")
        yield 20  # ms until the low-pass has settled

    def start(self):
        """Start the FIFO of a configured chip. Raises OSError as restart_fifo() does."""
        self.restart_fifo()
        self._started = self._settled = True
        self.axes.restart()

    def configured(self):
        """Return True if the chip is awake and has the configuration that setup() wrote. After start() the FIFO must
        run too. Raises OSError from the bus."""
        self._read_into(_SMPLRT_DIV, self._readback)  # SMPLRT_DIV to FIFO_EN
        self._read_into(_USER_CTRL, self._three)  # USER_CTRL, PWR_MGMT_1 and PWR_MGMT_2
        # Skip ACCEL_CONFIG2 of an accepted unknown chip, because the chip may not have that register.
        for i in range(5 if self.who_am_i in CHIPS and self._kind()[_HAS_ACCEL_CONFIG2] else 4):
            if self._readback[i] != self._configuration[i]:
                return False
        if self._three[1] != _CLOCK_PLL_GYRO_X or self._three[2] & _STANDBY:
            return False
        return not self._started or self._fifo_runs(self._readback[_FIFO_EN - _SMPLRT_DIV], self._three[0])

    def read(self):
        """Read the newest sample into counts, in one burst. Takes no heap. Raises OSError from the bus."""
        self._read_into(_ACCEL_XOUT_H, self._some_frames[1])
        self.take(0)

    def fetch(self):
        """Read samples from the FIFO, and set frames_left.

        After an overflow the frames no longer begin at multiples of 14 bytes. If the FIFO has overflowed, fetch()
        empties the FIFO, increments overflows and returns 0. Only whole frames are read: the chip may be writing one.
        Bytes that were lost or doubled on the bus leave a part of a frame too. Then the frames are cut at wrong places,
        and the temperature jumps, which counts as an overflow.

        Returns:
            The number of samples read: _MAX_FRAMES if the FIFO holds at least that many, else at most _FEW_FRAMES.

        Raises:
            OSError: a transfer on the bus failed, or restart_fifo() failed.
        """
        self._i2c.readfrom_mem_into(self.address, _FIFO_COUNT_H, self._two)
        waiting = self._two[0] << 8 | self._two[1]
        if waiting > self._most:
            self._most = waiting
        if waiting > self._full:
            return self._overflowed()
        n = waiting // FRAME  # the chip may be writing one more frame, whose bytes stay
        taken = _MAX_FRAMES if n >= _MAX_FRAMES else _FEW_FRAMES if n > _FEW_FRAMES else n
        self.frames_left = n - taken
        if taken:
            before = self._temperature(0) if waiting % FRAME and self._in_step else None
            self._i2c.readfrom_mem_into(self.address, _FIFO_R_W, self._some_frames[taken])
            if before is not None and (self._jumped(before, 0) or self._jumped(before, taken - 1)):
                return self._overflowed()
            self._in_step = True
        return taken

    def _jumped(self, before, k):
        """Return True if the temperature of sample k differs too much from a temperature before it."""
        # The mask makes the difference right where the temperature changes its sign, at 36.5 degrees C
        return (self._temperature(k) - before + _STEP) & 0xFFFF > 2 * _STEP

    def _overflowed(self):
        self.overflows += 1
        self.frames_left = 0
        self.restart_fifo()
        return 0

    def _temperature(self, k):
        """Return the temperature of sample k of the last fetch(), in counts, as two bytes without a sign."""
        return self._frames[FRAME * k + 6] << 8 | self._frames[FRAME * k + 7]

    def least_free_samples(self):
        """Return the smallest free space that any fetch() has found in the FIFO, in samples."""
        return max(0, self._full + FRAME - self._most) // FRAME

    def take(self, k):
        """Put sample k of the last fetch() into counts. Sample 0 is the oldest. Takes no heap."""
        decode(self._frames, k * FRAME, self.counts)

    def add_up(self, n):
        """Add up the first n samples of the last fetch() into sums. Return the number of samples added. Takes no heap.

        Samples at the end of the range are skipped and counted in axes.notes[LOST]. Afterwards take() returns only the
        other samples. The method stops at a sample that only a dead chip sends: all bits of the force are 0 or all are
        1, or the reading did not change for _FROZEN_MS."""
        return add_up(self._frames, n, self.sums, self.axes.notes)

    def restart_fifo(self):
        """Empty the FIFO and start it again, after an overflow or an incomplete transfer. Raises OSError from the bus,
        or NotKept."""
        self.write_register(_FIFO_EN, 0)
        self.write_register(_USER_CTRL, _FIFO_RESET)  # the reset works only while the FIFO is disabled (p. 38)
        self.write_register(_USER_CTRL, _FIFO_ENABLE)
        self.write_register(_FIFO_EN, _FIFO_ALL)
        self._in_step = False
        if not self._fifo_runs(self.read_register(_FIFO_EN), self.read_register(_USER_CTRL)):
            raise NotKept("MPU6050 FIFO does not read back")

    def realign(self):
        """Empty the FIFO if a failed transfer has left a part of a frame in it. Raises OSError as restart_fifo()
        does."""
        self._in_step = False
        if self.waiting() % FRAME:
            self.restart_fifo()

    def _fifo_runs(self, fifo_en, user_ctrl):
        """Return True if these values of the two registers mean that the FIFO stores all three sensors."""
        bits = self._kind()[_FIFO_EN_BITS]
        return fifo_en & bits == bits and user_ctrl & _FIFO_ENABLE != 0

    def temperature_c(self, counts):
        """Convert counts of the temperature to degrees C (p. 30, and the data sheets of the other chips)."""
        kind = self._kind()
        return counts / kind[_LSB_PER_C] + kind[_ZERO_C]

    def _kind(self):
        return CHIPS[self.who_am_i][1] if self.who_am_i in CHIPS else MPU6500  # also for an accepted chip

    def waiting(self):
        """Return the number of bytes in the FIFO. Raises OSError from the bus."""
        self._read_into(_FIFO_COUNT_H, self._two)
        return self._two[0] << 8 | self._two[1]

    # A failed transfer of a register is tried once more. Without this second attempt a moment of bad contact would
    # require a whole set-up of the chip. A failed read of the FIFO is not repeated, because the chip has already
    # dropped the bytes.

    def read_register(self, register):
        """Return the content of a register. Raises OSError from the bus."""
        self._read_into(register, self._one)
        return self._one[0]

    def _read_into(self, register, buf):
        try:
            self._i2c.readfrom_mem_into(self.address, register, buf)
        except OSError:
            self._i2c.readfrom_mem_into(self.address, register, buf)

    def write_register(self, register, value):
        """Set a register. Raises OSError from the bus."""
        self._one[0] = value
        try:
            self._i2c.writeto_mem(self.address, register, self._one)
        except OSError:
            self._i2c.writeto_mem(self.address, register, self._one)
