"""Models the registers of the InvenSense MPU6050 and of other chips sold under its name.

Sources: RM-MPU-6000A rev 4.2, PS-MPU-6000A rev 3.4; MPU-6500 RM rev 2.1; ICM-20689 and MPU-6886 data sheets. If these
documents are ambiguous, the model is strict: a status bit appears only if INT_ENABLE enables it, and writes during
start-up are lost. The low-pass only delays, because world() returns filtered values. Of the modelled chips, only the
MPU6050 has a self-test. Not modelled: DMP, auxiliary I2C.
"""

from collections import namedtuple

from .clock import NEVER_US

SMPLRT_DIV, CONFIG, GYRO_CONFIG, ACCEL_CONFIG, ACCEL_CONFIG2 = 0x19, 0x1A, 0x1B, 0x1C, 0x1D
SELF_TEST_X, SELF_TEST_A = 0x0D, 0x10  # the registers of y and z are between them
FIFO_EN, INT_ENABLE, INT_STATUS = 0x23, 0x38, 0x3A
ACCEL_XOUT_H, TEMP_OUT_H, GYRO_XOUT_H, GYRO_ZOUT_L = 0x3B, 0x41, 0x43, 0x48
SIGNAL_PATH_RESET, USER_CTRL, PWR_MGMT_1 = 0x68, 0x6A, 0x6B
FIFO_COUNTH, FIFO_COUNTL, FIFO_R_W, WHO_AM_I = 0x72, 0x73, 0x74, 0x75
READ_ONLY = (INT_STATUS, FIFO_COUNTH, FIFO_COUNTL, FIFO_R_W, WHO_AM_I)  # and the data registers

RESET, SLEEP = 0x80, 0x40  # PWR_MGMT_1
FIFO_ENABLED, FIFO_RESET, SIG_COND_RESET = 0x40, 0x04, 0x01  # USER_CTRL
DATA_RDY, FIFO_OFLOW = 0x01, 0x10  # INT_STATUS

START_UP_US = 90_000  # start-up time after power-on and reset; the data sheet's worst case is 100 ms
WAKE_US = 30_000  # time from sleep to the first sample, the gyro's start-up time (PS 6.1)
GYRO_LSB_PER_DPS = (131.0, 65.5, 32.8, 16.4)  # one per range, which bits 4 and 3 of GYRO_CONFIG select
DLPF_DELAY_US = (980, 1900, 2800, 4800, 8300, 13400, 18600, 980)  # delay of the gyro's low-pass, by DLPF_CFG

ACCEL_TRIMS, GYRO_TRIMS = (13, 17, 22), (9, 14, 11)  # factory trim codes of x, y, z (RM pp. 9 to 11)

# Numbers of samples since the last change of the rate: of all, and of those that were read from the data registers
Tally = namedtuple("Tally", ("taken", "read"))
# The temperature in degrees C is counts / counts_per_c + zero_c.
# temperature_in_fifo: True if the FIFO stores the temperature with accelerometer and gyro for any FIFO_EN.
Variant = namedtuple(
    "Variant",
    ("power_after_reset", "counts_per_c", "zero_c", "has_accel_config2", "fifo_bytes", "temperature_in_fifo"),
)
VARIANTS = {  # by WHO_AM_I, for the same chips as CHIPS in firmware/kickstand/imu/mpu6050.py
    0x68: Variant(0x40, 340.0, 36.53, False, 1024, False),  # MPU6050
    0x70: Variant(0x01, 333.87, 21.0, True, 512, False),  # MPU6500
    0x71: Variant(0x01, 333.87, 21.0, True, 512, False),  # MPU9250
    0x72: Variant(0x01, 333.87, 21.0, True, 512, False),  # MPU6500 clone
    0x73: Variant(0x01, 333.87, 21.0, True, 512, False),  # MPU9255
    0x74: Variant(0x01, 333.87, 21.0, True, 512, False),  # MPU6515
    0x78: Variant(0x40, 333.87, 21.0, True, 512, False),  # MPU6500 clone
    0x98: Variant(0x40, 326.8, 25.0, True, 512, False),  # ICM20689
    0x19: Variant(0x40, 326.8, 25.0, True, 1024, True),  # MPU6886
    0x12: Variant(0x41, 326.8, 25.0, True, 1008, True),  # ICM20602
    0x11: Variant(0x41, 326.8, 25.0, True, 1008, True),  # ICM20600
}


class Fifo:
    """The chip's FIFO. It contains bytes without marks between frames.

    size: its capacity in bytes. bytes_read: number of bytes that were read so far.
    """

    def __init__(self, size):
        self.size = size
        self.bytes_read = 0
        self._last = bytes(1)
        self.clear()

    @property
    def count(self):
        return len(self._waiting)

    def clear(self):
        self._waiting = b""

    def push(self, data, keep_old=False):
        """Add bytes. Returns True if the FIFO was full and bytes are lost: the oldest, or the new ones if keep_old."""
        waiting = self._waiting + data
        self._waiting = waiting[: self.size] if keep_old else waiting[-self.size :]
        return len(waiting) > self.size

    def pop(self, count=1):
        """Remove and return the oldest bytes. An empty FIFO repeats the byte that was read last (RM 4.31)."""
        data, self._waiting = self._waiting[:count], self._waiting[count:]
        self.bytes_read += len(data)
        if data:
            self._last = data[-1:]
        return data + self._last * (count - len(data))


class Mpu6050:
    """A chip.

    clock: a Clock. The model reads its now_us.
    world: function world(t_s) that returns (fx, fy, fz in g, wx, wy, wz in deg/s[, temp_c]) along the chip's axes. The
        values include the chip's offset and scale errors.
    self_test: result of each axis's self-test, as a share of its factory trim. The first three are the accelerometer's,
        then come the gyro's. 1.0 is correct. At 0.0 the axis does not respond.
    clock_error: relative error of the chip's sample rate, positive if it is too fast (0.01 is 1 %).
    """

    def __init__(self, clock, world, who_am_i=0x68, address=0x68):
        self.address = address
        self.clock = clock
        self.world = world
        self.clock_error = 0.0
        self.self_test = [1.0] * 6
        self._override = None
        self.who_am_i = who_am_i
        self._variant = VARIANTS.get(who_am_i, VARIANTS[0x68])  # tests also use chips unknown to the driver
        self.fifo = Fifo(self._variant.fifo_bytes)
        self._regs = bytearray(128)
        self._pointer = 0
        self._expect_pointer = False
        self._next = 0  # number of the next sample
        self._seen, self._seen_number = 0, -1  # samples read from the data registers, and _next at the last of them
        self.power_on()

    def power_on(self):
        """Set every register as after power-on or reset. Writes are lost for START_UP_US."""
        regs = self._regs
        regs[:] = bytes(128)
        regs[PWR_MGMT_1] = self._variant.power_after_reset
        regs[WHO_AM_I] = self.who_am_i
        if self.who_am_i == 0x68:
            for k in range(3):
                regs[SELF_TEST_X + k] = ACCEL_TRIMS[k] >> 2 << 5 | GYRO_TRIMS[k]
                regs[SELF_TEST_A] |= (ACCEL_TRIMS[k] & 3) << (4 - 2 * k)
        self.fifo.clear()
        self._fifo_registers = ()
        self._accel_lsb, self._gyro_lsb = 16384, 131.0
        self._busy_us = self.clock.now_us + START_UP_US
        self._reset_us = self._busy_us
        self._period_ns = 0
        self._due_us = NEVER_US
        if not regs[PWR_MGMT_1] & SLEEP:
            self._start_sampling(self._busy_us + WAKE_US)

    def supply_dip(self, leaves="asleep"):
        """Lose the power and the configuration for a short time.

        leaves: the state after the loss, one of:
            "asleep": asleep, all data is 0.
            "frozen": asleep, the last data stays.
            "default_ranges": awake with other scales.
            "torn": asleep, and the rates of the frame that is being read are garbage.
        """
        self._update()
        data = bytes(self._regs[ACCEL_XOUT_H : GYRO_ZOUT_L + 1])
        self.power_on()
        if leaves == "frozen":
            self._regs[ACCEL_XOUT_H : GYRO_ZOUT_L + 1] = data
        elif leaves == "torn":
            self.fifo.push(data[:8] + b"\x18" * 6)
        elif leaves == "default_ranges":
            self._busy_us = self.clock.now_us
            self._regs[PWR_MGMT_1] = 0x01
            self._start_sampling(self._busy_us)

    def override(self, value):
        """Begin or end a fault. value: "freeze" for no new data, the value of every data byte, or None to end it."""
        self._update()
        self._override = value

    @property
    def frame_bytes(self):
        """Return the size of a frame in the FIFO, 0 if nothing goes to the FIFO."""
        return len(self._fifo_registers)

    def tally(self):
        """Return the Tally."""
        self._update()
        return Tally(self._next, self._seen)

    def peek(self, register):
        """Return the content of a register, without the side effects of a read."""
        self._update()
        return self._regs[register]

    # The I2C side

    def start(self, address, read):
        """Receive START and address. Data that is read until the next START comes from one sample."""
        self._update()
        self._expect_pointer = not read
        if read and self._pointer == ACCEL_XOUT_H and self._seen_number != self._next:
            self._seen, self._seen_number = self._seen + 1, self._next
        return True

    def write_byte(self, value):
        """Receive the register address, then data. The chip acknowledges every write."""
        if self._expect_pointer:
            self._pointer = value & 0x7F
            self._expect_pointer = False
        else:
            self._write(self._pointer, value)
            if self._pointer != FIFO_R_W:
                self._pointer = (self._pointer + 1) & 0x7F
        return True

    def read_byte(self):
        """Return the content of the register at the pointer. The pointer then advances, except at FIFO_R_W."""
        register = self._pointer
        if register == FIFO_R_W:
            return self.fifo.pop()[0]
        self._pointer = (register + 1) & 0x7F
        value = self._regs[register]
        if register == INT_STATUS:
            self._regs[INT_STATUS] = 0
        elif register == FIFO_COUNTH:  # reading the high byte latches both bytes
            value = self.fifo.count >> 8
            self._regs[FIFO_COUNTL] = self.fifo.count & 0xFF
        elif register == PWR_MGMT_1 and self.clock.now_us < self._reset_us:
            value |= RESET
        return value

    def read_into(self, buf):
        """Fill buf as repeated read_byte() would. Bytes from the FIFO are read in one step."""
        if self._pointer == FIFO_R_W:
            buf[:] = self.fifo.pop(len(buf))
            return
        for i in range(len(buf)):
            buf[i] = self.read_byte()

    # Registers

    def _write(self, register, value):
        """Write a register, with the effects of the real chip. Some registers cannot be written."""
        now = self.clock.now_us
        if now < self._busy_us or register in READ_ONLY or ACCEL_XOUT_H <= register <= GYRO_ZOUT_L:
            return
        if register == ACCEL_CONFIG2 and not self._variant.has_accel_config2:
            return
        if register == PWR_MGMT_1 and value & RESET:
            self.power_on()
            return
        if register == FIFO_EN and self._variant.temperature_in_fifo:
            value &= 0x18  # the other bits do not exist
        old = self._regs[register]
        self._regs[register] = value
        if register == PWR_MGMT_1:
            if value & SLEEP:
                self._due_us = NEVER_US  # the data registers keep their content
            elif old & SLEEP:
                self._busy_us = now + WAKE_US
                self._start_sampling(self._busy_us)
        elif register in (SMPLRT_DIV, CONFIG):
            if self._due_us != NEVER_US and self._rate_ns() != self._period_ns:
                self._start_sampling(now)
        elif register == GYRO_CONFIG:
            self._gyro_lsb = GYRO_LSB_PER_DPS[value >> 3 & 3]
        elif register == ACCEL_CONFIG:
            self._accel_lsb = 16384 >> (value >> 3 & 3)
        elif register == FIFO_EN:
            self._fifo_registers = self._chosen(value)
        elif register == USER_CTRL:
            if value & FIFO_RESET and not value & FIFO_ENABLED:
                self.fifo.clear()
            if value & SIG_COND_RESET:
                self._fill_data(0)
            self._regs[USER_CTRL] = value & 0xF8  # the reset bits clear themselves
        elif register == SIGNAL_PATH_RESET:
            self._fill_data(0)
            self._regs[SIGNAL_PATH_RESET] = 0

    def _fill_data(self, value):
        self._regs[ACCEL_XOUT_H : GYRO_ZOUT_L + 1] = bytes([value] * 14)

    def _chosen(self, enabled):
        """Return the data registers that FIFO_EN sends to the FIFO, in order."""
        if self._variant.temperature_in_fifo:  # bit 4: gyro and temperature, bit 3: accelerometer and temperature
            enabled = (0xF0 if enabled & 0x10 else 0) | (0x88 if enabled & 0x08 else 0)
        chosen = list(range(0x3B, 0x41)) if enabled & 0x08 else []
        for bit, register in ((0x80, 0x41), (0x40, 0x43), (0x20, 0x45), (0x10, 0x47)):
            if enabled & bit:
                chosen += [register, register + 1]
        return tuple(chosen)

    # Sampling

    def _fast(self):
        return self._regs[CONFIG] & 7 in (0, 7)  # without low-pass the gyro runs at 8 kHz

    def _rate_ns(self):
        base = 125_000 if self._fast() else 1_000_000
        return int(base * (1 + self._regs[SMPLRT_DIV]) / (1.0 + self.clock_error))

    def _start_sampling(self, first_us):
        self._period_ns = self._rate_ns()
        self._first_us = first_us
        self._next = 0
        self._due_us = first_us

    def _sample_us(self, number):
        return self._first_us + (number * self._period_ns + 999) // 1000

    def _update(self):
        """Take the samples scheduled since the last call."""
        now = self.clock.now_us
        if now < self._due_us:
            return
        last = (now - self._first_us) * 1000 // self._period_ns
        if self._fifo_registers and self._regs[USER_CTRL] & FIFO_ENABLED:
            # Skip samples that later samples would push out of the FIFO, because its final content is the same
            capacity = self.fifo.size // len(self._fifo_registers) + 2
            for number in range(max(self._next, last + 1 - capacity), last + 1):
                self._sample(number)
                self._queue()
        else:
            self._sample(last)
        self._next = last + 1
        self._due_us = self._sample_us(self._next)

    def _sample(self, number):
        if self._override == "freeze":
            return
        regs = self._regs
        if self._override is None:
            self._measure(max(0, self._sample_us(number) - DLPF_DELAY_US[regs[CONFIG] & 7]))
        else:
            self._fill_data(self._override)
        regs[INT_STATUS] |= DATA_RDY & regs[INT_ENABLE]

    def _measure(self, t_us):
        values = force = self.world(t_us / 1e6)
        if self._fast():  # the accelerometer always runs at 1 kHz
            force = self.world((t_us - t_us % 1000) / 1e6)
        temp_c = values[6] if len(values) > 6 else 25.0
        if (self._regs[GYRO_CONFIG] | self._regs[ACCEL_CONFIG]) & 0xE0 and self.who_am_i == 0x68:
            values, force = self._with_self_test(values, force)
        for k in range(3):
            self._put(ACCEL_XOUT_H + 2 * k, force[k] * self._accel_lsb)
            self._put(GYRO_XOUT_H + 2 * k, values[3 + k] * self._gyro_lsb)
        self._put(TEMP_OUT_H, (temp_c - self._variant.zero_c) * self._variant.counts_per_c)

    def _with_self_test(self, values, force):
        """Return the readings, with the factory trims added for the axes in self-test (RM p. 11)."""
        force, values = list(force[:3]), list(values)
        for k in range(3):
            if self._regs[ACCEL_CONFIG] & 0x80 >> k:
                force[k] += self.self_test[k] * 0.34 * (0.92 / 0.34) ** ((ACCEL_TRIMS[k] - 1) / 30)
            if self._regs[GYRO_CONFIG] & 0x80 >> k:
                trim_dps = 25 * 1.046 ** (GYRO_TRIMS[k] - 1)
                sign = -1 if k == 1 else 1  # the manual's formula for y has a minus
                values[3 + k] += sign * self.self_test[3 + k] * trim_dps
        return values, force

    def _put(self, register, counts):
        counts = min(32767, max(-32768, round(counts)))
        self._regs[register] = counts >> 8 & 0xFF
        self._regs[register + 1] = counts & 0xFF

    def _queue(self):
        if self._override == "freeze":
            return
        # FIFO_MODE exists in the MPU6500 family
        keep_old = self._variant.has_accel_config2 and bool(self._regs[CONFIG] & 0x40)
        frame = bytes([self._regs[register] for register in self._fifo_registers])
        if self.fifo.push(frame, keep_old):
            self._regs[INT_STATUS] |= FIFO_OFLOW & self._regs[INT_ENABLE]
