"""Register-level model of the InvenSense MPU6050 and of the chips sold under its name.

RM-MPU-6000A rev 4.2, PS-MPU-6000A rev 3.4; MPU-6500 RM rev 2.1; ICM-20689, MPU-6886 data sheets. Where they
leave room the model is strict: a status bit appears only if INT_ENABLE asks for it; start-up writes are lost.
Not modelled: the low-pass but for its delay (world() is what has passed it), self-test, DMP, auxiliary I2C.
"""

from .fifo import Fifo

SMPLRT_DIV, CONFIG, GYRO_CONFIG, ACCEL_CONFIG, ACCEL_CONFIG2 = 0x19, 0x1A, 0x1B, 0x1C, 0x1D
FIFO_EN, INT_ENABLE, INT_STATUS = 0x23, 0x38, 0x3A
ACCEL_XOUT_H, GYRO_ZOUT_L = 0x3B, 0x48
SIGNAL_PATH_RESET, USER_CTRL, PWR_MGMT_1 = 0x68, 0x6A, 0x6B
FIFO_COUNTH, FIFO_COUNTL, FIFO_R_W, WHO_AM_I = 0x72, 0x73, 0x74, 0x75

RESET, SLEEP = 0x80, 0x40  # PWR_MGMT_1
FIFO_ENABLED, FIFO_RESET, SIG_COND_RESET = 0x40, 0x04, 0x01  # USER_CTRL
DATA_RDY, FIFO_OFLOW = 0x01, 0x10  # INT_STATUS

START_UP_US = 90_000  # after power-on and reset: the sheet's worst case is 100 ms
WAKE_US = 30_000  # from sleep to the first sample: gyro start-up time, PS 6.1

# WHO_AM_I: (PWR_MGMT_1 after reset, counts per degree C, degrees C at 0 counts, has ACCEL_CONFIG2, FIFO size,
#            the temperature goes into the FIFO with accelerometer and gyro, whatever FIFO_EN says)
VARIANTS = {
    0x68: (0x40, 340.0, 36.53, False, 1024, False),  # MPU6050
    0x70: (0x01, 333.87, 21.0, True, 512, False),  # MPU6500
    0x71: (0x01, 333.87, 21.0, True, 512, False),  # MPU9250
    0x72: (0x01, 333.87, 21.0, True, 512, False),  # MPU6500 clone
    0x73: (0x01, 333.87, 21.0, True, 512, False),  # MPU9255
    0x74: (0x01, 333.87, 21.0, True, 512, False),  # MPU6515
    0x78: (0x40, 333.87, 21.0, True, 512, False),  # MPU6880
    0x98: (0x40, 326.8, 25.0, True, 512, False),  # ICM20689
    0x19: (0x40, 326.8, 25.0, True, 1024, True),  # MPU6886
}

_NEVER = 1 << 60
_GYRO_LSB = (131.0, 65.5, 32.8, 16.4)
_DELAY_US = (980, 1900, 2800, 4800, 8300, 13400, 18600, 980)  # of the gyro's low-pass, by DLPF_CFG
_READ_ONLY = (INT_STATUS, FIFO_COUNTH, FIFO_COUNTL, FIFO_R_W, WHO_AM_I)


class Mpu6050:
    """One chip.

    clock: has now_us.
    world(t_s): (fx, fy, fz in g, wx, wy, wz in deg/s[, temp_c]) along the chip's axes, with analogue errors.
    clock_error: how much faster than nominal it samples, as a fraction (0.01 = 1 %).
    """

    def __init__(self, clock, world, who_am_i=0x68, address=0x68):
        self.address = address
        self.clock = clock
        self.world = world
        self.clock_error = 0.0
        self._override = None
        self.who_am_i = who_am_i
        self._variant = VARIANTS.get(who_am_i, VARIANTS[0x68])
        self.fifo = Fifo(self._variant[4])
        self._regs = bytearray(128)
        self._pointer = 0
        self._expect_pointer = False
        self.power_on()

    def power_on(self):
        """Every register as after power-on and after a reset; writes are lost for START_UP_US."""
        regs = self._regs
        for i in range(128):
            regs[i] = 0
        regs[PWR_MGMT_1] = self._variant[0]
        regs[WHO_AM_I] = self.who_am_i
        self.fifo.clear()
        self._fifo_registers = ()
        self._accel_lsb, self._gyro_lsb = 16384, 131.0
        self._busy_us = self.clock.now_us + START_UP_US
        self._reset_us = self._busy_us
        self._period_ns = 0
        self._due_us = _NEVER
        if not regs[PWR_MGMT_1] & SLEEP:
            self._start_sampling(self._busy_us + WAKE_US)

    def supply_dip(self, leaves="asleep"):
        """What a sag leaves: "asleep" (zeros), "frozen" (asleep, last data), "default_ranges" (but awake)."""
        self._update()
        data = bytes(self._regs[ACCEL_XOUT_H : GYRO_ZOUT_L + 1])
        self.power_on()
        if leaves == "frozen":
            self._regs[ACCEL_XOUT_H : GYRO_ZOUT_L + 1] = data
        elif leaves == "default_ranges":
            self._busy_us = self.clock.now_us
            self._regs[PWR_MGMT_1] = 0x01
            self._start_sampling(self._busy_us)

    def override(self, value):
        """A fault from now on: "freeze" (no new data), the byte that all data bytes read as, or None."""
        self._update()
        self._override = value

    def peek(self, register):
        """A register as it is, without the side effects of a read."""
        self._update()
        return self._regs[register]

    # The I2C side

    def start(self, address, read):
        """START and address: until the next START the data are of one sampling instant. True: ACK."""
        self._update()
        self._expect_pointer = not read
        return True

    def write_byte(self, value):
        """First the register address, then data. True: ACK, whether or not the write has an effect."""
        if self._expect_pointer:
            self._pointer = value & 0x7F
            self._expect_pointer = False
        else:
            self._write(self._pointer, value)
            if self._pointer != FIFO_R_W:
                self._pointer = (self._pointer + 1) & 0x7F
        return True

    def read_byte(self):
        """The register pointed at; then the pointer moves on, except at FIFO_R_W."""
        register = self._pointer
        if register == FIFO_R_W:
            return self.fifo.pop()
        self._pointer = (register + 1) & 0x7F
        value = self._regs[register]
        if register == INT_STATUS:
            self._regs[INT_STATUS] = 0
        elif register == FIFO_COUNTH:  # reading the high byte latches both
            value = self.fifo.count >> 8
            self._regs[FIFO_COUNTL] = self.fifo.count & 0xFF
        elif register == PWR_MGMT_1 and self.clock.now_us < self._reset_us:
            value |= RESET
        return value

    def stop(self):
        """STOP."""

    # Registers

    def _write(self, register, value):
        now = self.clock.now_us
        if now < self._busy_us or register in _READ_ONLY or ACCEL_XOUT_H <= register <= GYRO_ZOUT_L:
            return
        if register == ACCEL_CONFIG2 and not self._variant[3]:
            return
        if register == PWR_MGMT_1 and value & RESET:
            self.power_on()
            return
        old = self._regs[register]
        self._regs[register] = value
        if register == PWR_MGMT_1:
            if value & SLEEP:
                self._due_us = _NEVER  # the data registers hold still
            elif old & SLEEP:
                self._busy_us = now + WAKE_US
                self._start_sampling(self._busy_us)
        elif register in (SMPLRT_DIV, CONFIG):
            if self._due_us != _NEVER and self._rate_ns() != self._period_ns:
                self._start_sampling(now)
        elif register == GYRO_CONFIG:
            self._gyro_lsb = _GYRO_LSB[value >> 3 & 3]
        elif register == ACCEL_CONFIG:
            self._accel_lsb = 16384 >> (value >> 3 & 3)
        elif register == FIFO_EN:
            self._fifo_registers = self._chosen(value)
        elif register == USER_CTRL:
            if value & FIFO_RESET and not value & FIFO_ENABLED:
                self.fifo.clear()
            if value & SIG_COND_RESET:
                self._clear_data()
            self._regs[USER_CTRL] = value & 0xF8  # the reset bits clear themselves
        elif register == SIGNAL_PATH_RESET:
            self._clear_data()
            self._regs[SIGNAL_PATH_RESET] = 0

    def _clear_data(self):
        for i in range(ACCEL_XOUT_H, GYRO_ZOUT_L + 1):
            self._regs[i] = 0

    def _chosen(self, enabled):
        """The data registers that FIFO_EN sends to the FIFO, in order."""
        if self._variant[5]:  # bit 4: gyro and temperature, bit 3: accelerometer and temperature
            enabled = (0xF0 if enabled & 0x10 else 0) | (0x88 if enabled & 0x08 else 0)
        chosen = list(range(0x3B, 0x41)) if enabled & 0x08 else []
        for bit, register in ((0x80, 0x41), (0x40, 0x43), (0x20, 0x45), (0x10, 0x47)):
            if enabled & bit:
                chosen += [register, register + 1]
        return tuple(chosen)

    # Sampling

    def _fast(self):
        return self._regs[CONFIG] & 7 in (0, 7)  # no low-pass: the gyro runs at 8 kHz

    def _rate_ns(self):
        base = 125_000 if self._fast() else 1_000_000
        return int(base * (1 + self._regs[SMPLRT_DIV]) / (1.0 + self.clock_error))

    def _start_sampling(self, first_us):
        self._period_ns = self._rate_ns()
        self._first_us = first_us
        self._next = 0  # number of the sample that comes next
        self._due_us = first_us

    def _sample_us(self, number):
        return self._first_us + (number * self._period_ns + 999) // 1000

    def _update(self):
        """Take the samples that have fallen due since the last look."""
        now = self.clock.now_us
        if now < self._due_us:
            return
        last = (now - self._first_us) * 1000 // self._period_ns
        if self._fifo_registers and self._regs[USER_CTRL] & FIFO_ENABLED:
            # What would be pushed out again before anyone can look is left out: the FIFO ends up the same
            kept = self.fifo.size // len(self._fifo_registers) + 2
            for number in range(max(self._next, last + 1 - kept), last + 1):
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
            self._measure(max(0, self._sample_us(number) - _DELAY_US[regs[CONFIG] & 7]))
        else:
            for i in range(ACCEL_XOUT_H, GYRO_ZOUT_L + 1):
                regs[i] = self._override
        regs[INT_STATUS] |= DATA_RDY & regs[INT_ENABLE]

    def _measure(self, t_us):
        values = force = self.world(t_us / 1e6)
        if self._fast():  # the accelerometer is sampled at 1 kHz all the same
            force = self.world((t_us - t_us % 1000) / 1e6)
        temp_c = values[6] if len(values) > 6 else 25.0
        self._put(0x3B, force[0] * self._accel_lsb)
        self._put(0x3D, force[1] * self._accel_lsb)
        self._put(0x3F, force[2] * self._accel_lsb)
        self._put(0x41, (temp_c - self._variant[2]) * self._variant[1])
        self._put(0x43, values[3] * self._gyro_lsb)
        self._put(0x45, values[4] * self._gyro_lsb)
        self._put(0x47, values[5] * self._gyro_lsb)

    def _put(self, register, counts):
        counts = min(32767, max(-32768, round(counts)))
        self._regs[register] = counts >> 8 & 0xFF
        self._regs[register + 1] = counts & 0xFF

    def _queue(self):
        if self._override == "freeze":
            return
        keep_old = self._variant[3] and bool(self._regs[CONFIG] & 0x40)  # FIFO_MODE of the MPU6500 family
        for register in self._fifo_registers:
            if self.fifo.push(self._regs[register], keep_old):
                self._regs[INT_STATUS] |= FIFO_OFLOW & self._regs[INT_ENABLE]
