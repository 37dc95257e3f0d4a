"""InvenSense MPU6050 and the chips sold under its name: registers in, counts out.

Register map RM-MPU-6000A rev 4.2, product specification PS-MPU-6000A rev 3.4.

    chip = Mpu6050(i2c)
    chip.setup()
    chip.read()                        # chip.counts is now: ax ay az temperature gx gy gz

or, losing no sample while the program is busy elsewhere for up to 0.17 s:

    n = chip.fetch()
    chip.add_up(n)                     # chip.sums is now the sum of the n samples
    for k in range(n):
        chip.take(k)                   # or each of them: chip.counts, oldest first
"""

from array import array
from time import sleep_ms

from micropython import const

from .fifo_frames import FRAME, add_up, decode

_SMPLRT_DIV = const(0x19)  # p. 11
_CONFIG = const(0x1A)  # p. 13: DLPF_CFG
_GYRO_CONFIG = const(0x1B)  # p. 14
_ACCEL_CONFIG = const(0x1C)  # p. 15
_ACCEL_CONFIG2 = const(0x1D)  # MPU6500 family only: the accelerometer's own low-pass
_FIFO_EN = const(0x23)  # p. 16
_ACCEL_XOUT_H = const(0x3B)  # p. 29: fourteen bytes from here are one sampling instant
_USER_CTRL = const(0x6A)  # p. 38
_PWR_MGMT_1 = const(0x6B)  # p. 40
_FIFO_COUNT_H = const(0x72)  # p. 43; reading it latches the low byte
_FIFO_R_W = const(0x74)
_WHO_AM_I = const(0x75)  # p. 45

_RESET = const(0x80)
_CLOCK_PLL_GYRO_X = const(0x01)  # 1 % accurate; the internal oscillator after reset is off by up to 5 %

_FIFO_ALL = const(0xF8)  # temperature, gyro and accelerometer: the same fourteen bytes as a burst
_FIFO_ENABLE, _FIFO_RESET = const(0x40), const(0x04)
_FIFO_6886 = const(0x18)
MAX_FRAMES = 8  # in one transfer: 3 ms at 400 kHz; for catching up
FEW_FRAMES = 3  # else: a turn of the loop that took longer should not make the next one long too
FROZEN_MS = 100  # noise changes a living chip's readings in every sample

ACCEL_LSB_PER_G = {2: 16384, 4: 8192, 8: 4096, 16: 2048}
GYRO_LSB_PER_DPS = {250: 131.0, 500: 65.5, 1000: 32.8, 2000: 16.4}
SATURATED = 32700
# s, by DLPF: by how much the gyro's low-pass is late (register map p. 13, MPU6050). 0 stands for no low-pass.
GYRO_DELAY_S = (0.00098, 0.0019, 0.0028, 0.0048, 0.0083, 0.0134, 0.0186)

# WHO_AM_I: name, temperature counts per degree, temperature at 0 counts, has ACCEL_CONFIG2, bytes of FIFO
CHIPS = {
    0x68: ("MPU6050", 340.0, 36.53, False, 1024),
    0x70: ("MPU6500", 333.87, 21.0, True, 512),
    0x71: ("MPU9250", 333.87, 21.0, True, 512),
    0x72: ("MPU6500 0x72", 333.87, 21.0, True, 512),
    0x73: ("MPU9255", 333.87, 21.0, True, 512),
    0x74: ("MPU6515", 333.87, 21.0, True, 512),
    0x78: ("MPU6500 0x78", 333.87, 21.0, True, 512),
    0x98: ("ICM20689", 326.8, 25.0, True, 512),
    0x19: ("MPU6886", 326.8, 25.0, True, 512),
}


class UnknownChip(Exception):
    """A chip answers, but its WHO_AM_I (args[0]) is none that is known to be compatible."""


class Mpu6050:
    """One chip on one bus.

    i2c: a machine.I2C.  address: 0x68, or 0x69 with AD0 high.  accel_range_g: 2, 4, 8, 16.  gyro_range_dps:
    250, 500, 1000, 2000. dlpf: 1 (184 Hz) to 6 (5 Hz).  rate_hz: 1000 divided by 1 to 256.  accept: a further
    WHO_AM_I to treat as an MPU6500. counts: array('h', 7) of the last read() or take(), in the chip's order;
    sums: array('i', 7) of the last add_up().
    """

    def __init__(
        self, i2c, address=0x68, accel_range_g=8, gyro_range_dps=500, dlpf=3, rate_hz=200, accept=None
    ):
        self._i2c = i2c
        self._address = address
        self._accept = accept
        self.who_am_i = 0
        self.accel_range_g = accel_range_g
        self.accel_lsb_per_g = ACCEL_LSB_PER_G[accel_range_g]
        self.gyro_lsb_per_dps = GYRO_LSB_PER_DPS[gyro_range_dps]
        accel_bits = (2, 4, 8, 16).index(accel_range_g) << 3
        gyro_bits = (250, 500, 1000, 2000).index(gyro_range_dps) << 3
        # 0x19..0x1D as they should read; 0x1D is compared only where it exists
        self._configuration = bytes((1000 // rate_hz - 1, dlpf, gyro_bits, accel_bits, dlpf))
        self._one = bytearray(1)
        self._readback = bytearray(_FIFO_EN - _SMPLRT_DIV + 1)
        self._two = bytearray(2)
        self._frames = bytearray(FRAME * MAX_FRAMES)
        # slices made once, because each slice takes heap
        self._some_frames = [memoryview(self._frames)[: FRAME * n] for n in range(MAX_FRAMES + 1)]
        self.left = 0  # frames that the last fetch() left in the FIFO
        self.overflows = 0  # of the FIFO, or its frames out of step
        self._odd = False
        self._started = False  # the FIFO too
        self._full = 0  # bytes from which on the FIFO may have overflowed
        self.counts = array("h", [0] * 7)
        self.sums = array("i", [0] * 7)
        self._watch = array("i", (0, 0, rate_hz * FROZEN_MS // 1000))

    @property
    def name(self):
        """What the chip is, by its WHO_AM_I."""
        return self._chip()[0] if self.who_am_i in CHIPS else "WHO 0x%02X" % self.who_am_i

    def connect(self, i2c):
        """Use a bus that was opened again."""
        self._i2c = i2c

    def identify(self):
        """Read WHO_AM_I; return it. Raises UnknownChip, OSError."""
        self.who_am_i = self._read(_WHO_AM_I)
        if self._read(_WHO_AM_I) != self.who_am_i:  # a calibration belongs to one chip
            raise OSError("MPU6050 WHO_AM_I reads differently each time")
        if self.who_am_i not in CHIPS and self.who_am_i != self._accept:
            raise UnknownChip(self.who_am_i)
        self._full = self._chip()[4] - FRAME
        return self.who_am_i

    def setup(self):
        """Reset and configure the chip: 0.2 s. Raises OSError (also when the configuration does not read
        back), UnknownChip."""
        self.identify()
        self._write(_PWR_MGMT_1, _RESET)
        sleep_ms(100)
        self._write(_PWR_MGMT_1, _CLOCK_PLL_GYRO_X)
        sleep_ms(60)  # writes that come too early are lost without an error
        for i in range(5 if self._chip()[3] else 4):
            self._write(_SMPLRT_DIV + i, self._configuration[i])
        self._started = False
        if not self.configured():
            raise OSError("MPU6050 configuration does not read back")
        sleep_ms(20)  # until the filter has seen its first samples
        self.restart_fifo()
        self._started = True
        self._watch[1] = 0

    def configured(self):
        """True if the chip is awake with the configuration written by setup(). Raises OSError."""
        self._i2c.readfrom_mem_into(self._address, _SMPLRT_DIV, self._readback)  # and on to FIFO_EN
        self._i2c.readfrom_mem_into(self._address, _USER_CTRL, self._two)  # and PWR_MGMT_1
        # 0x1D only where it is known to exist: an accepted unknown chip is given it, and may ignore it
        for i in range(5 if self.who_am_i in CHIPS and self._chip()[3] else 4):
            if self._readback[i] != self._configuration[i]:
                return False
        return self._two[1] == _CLOCK_PLL_GYRO_X and (
            not self._started or self._fifo_runs(self._readback[_FIFO_EN - _SMPLRT_DIV], self._two[0])
        )

    def read(self):
        """The newest sample in one burst into counts; allocates nothing. Raises OSError."""
        self._i2c.readfrom_mem_into(self._address, _ACCEL_XOUT_H, self._some_frames[1])
        self.take(0)

    def fetch(self):
        """Read the samples that wait in the FIFO, up to MAX_FRAMES; return how many. Raises OSError.

        After an overflow the FIFO's frames are out of step: it is emptied, overflows counts it, and 0 is
        returned.
        """
        self._i2c.readfrom_mem_into(self._address, _FIFO_COUNT_H, self._two)
        waiting = self._two[0] << 8 | self._two[1]
        odd = waiting % FRAME != 0
        if waiting > self._full or (odd and self._odd):
            self.overflows += 1
            self.left = 0
            self.restart_fifo()
            return 0
        self._odd = odd
        n = waiting // FRAME
        if odd:  # a frame is just coming in; if it still is the next time, the frames are out of step
            self.left = n + 1
            return 0
        if n >= MAX_FRAMES:
            self.left = n - MAX_FRAMES
            n = MAX_FRAMES
        elif n > FEW_FRAMES:
            self.left = n - FEW_FRAMES
            n = FEW_FRAMES
        else:
            self.left = 0
        if n:
            self._i2c.readfrom_mem_into(self._address, _FIFO_R_W, self._some_frames[n])
        return n

    def take(self, k):
        """Frame k of the last fetch() into counts; allocates nothing."""
        decode(self._frames, k * FRAME, self.counts)

    def add_up(self, n):
        """The sum of the first n frames of the last fetch() into sums, in the chip's order, up to one that only a dead
        chip sends: all zeros, all ones, or the same for FROZEN_MS. How many they are; allocates nothing."""
        return add_up(self._frames, n, self.sums, self._watch)

    def restart_fifo(self):
        """Empty the FIFO and let it fill: after an overflow, or a transfer that broke off. Raises OSError."""
        self._write(_FIFO_EN, 0)
        self._write(_USER_CTRL, _FIFO_RESET)  # acts only while the FIFO is not enabled
        self._write(_USER_CTRL, _FIFO_ENABLE)
        self._write(_FIFO_EN, _FIFO_ALL)
        self._odd = False
        if not self._fifo_runs(self._read(_FIFO_EN), self._read(_USER_CTRL)):
            raise OSError("MPU6050 FIFO does not read back")

    def _fifo_runs(self, fifo_en, user_ctrl):
        chosen = _FIFO_6886 if self.who_am_i == 0x19 else _FIFO_ALL  # the MPU6886 always adds the temperature
        return fifo_en & chosen == chosen and user_ctrl & _FIFO_ENABLE != 0

    def temperature_c(self, counts):
        """Degrees Celsius from temperature counts (p. 30, and the sheets of the other chips)."""
        chip = self._chip()
        return counts / chip[1] + chip[2]

    def _chip(self):
        return CHIPS.get(self.who_am_i, CHIPS[0x70])

    def _read(self, register):
        self._i2c.readfrom_mem_into(self._address, register, self._one)
        return self._one[0]

    def _write(self, register, value):
        self._one[0] = value
        self._i2c.writeto_mem(self._address, register, self._one)
