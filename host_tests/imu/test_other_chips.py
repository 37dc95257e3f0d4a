"""Other chips at the addresses of the sensor are named by their registers. The values are from their data sheets."""

import pytest
from kickstand_sim.simulated_board.simulator import Board

OTHER, MOTION, SUPPORTED = 0, 1, 2
WHO_AM_I, PWR_MGMT_1 = 0x75, 0x6B
# Registers of two clocks that show 23:59:37 in binary-coded decimals: seconds, minutes, hours. The order of the next
# four registers depends on the chip.
DS3231 = [0x37, 0x59, 0x23, 0x05, 0x26, 0x11, 0x26, 0, 0, 0]  # after the time: day of the week, date, month, year
PCF8523 = [0, 0, 0, 0x37, 0x59, 0x23, 0x26, 0x04, 0x11, 0x26]  # after the time: date, day of the week, month, year


@pytest.fixture
def chips():
    with Board(lambda t_s: (0, 0, 1, 0, 0, 0)):  # the driver needs the clock of a board
        from kickstand import diagnosis

        yield diagnosis


class Wires:
    """A machine.I2C with a device at one address. registers: {register: value}. All other registers are 0."""

    def __init__(self, address, registers):
        self._address, self._registers = address, registers

    def readfrom_mem(self, address, register, count):
        if address != self._address:
            raise OSError(5)
        return bytes(self._registers.get(register + k, 0) for k in range(count))


@pytest.mark.parametrize(
    ("address", "registers", "named"),
    [
        (0x68, {WHO_AM_I: 0x68}, ("MPU6050", SUPPORTED)),
        (0x69, {WHO_AM_I: 0x68}, ("MPU6050", SUPPORTED)),
        (0x68, {WHO_AM_I: 0x47, 0x00: 0x55}, ("ICM-42688", MOTION)),
        (0x69, {0x00: 0x24}, ("BMI270", MOTION)),
        (0x6A, {0x0F: 0x69}, ("LSM6DS3", MOTION)),
        (0x6B, {0x0F: 0x6C}, ("LSM6DSO", MOTION)),
        (0x28, {0x00: 0xA0}, ("BNO055", MOTION)),
        (0x53, {0x00: 0xE5}, ("ADXL345", MOTION)),
        (0x53, {0x00: 0xE4}, ("EEPROM", OTHER)),
        (0x76, {}, ("barometer", OTHER)),
        (0x57, {}, ("EEPROM", OTHER)),
        (0x58, {}, ("", OTHER)),
        (0x27, {}, ("display", OTHER)),
        # Register 0 of chips like the MPU6050 can hold any number. WHO_AM_I names these chips.
        *[((0x68), {WHO_AM_I: 0x68, PWR_MGMT_1: power, 0: 0xD1}, ("MPU6050", SUPPORTED)) for power in (0x40, 0x41, 1)],
        (0x68, {WHO_AM_I: 0x68, PWR_MGMT_1: 0x02, 0: 0xD1}, ("BMI160", MOTION)),
        (0x68, {WHO_AM_I: 0x55, PWR_MGMT_1: 0x40}, ("", OTHER)),
        (0x68, dict(enumerate(DS3231)), ("clock", OTHER)),
        (0x68, dict(enumerate(PCF8523)), ("clock", OTHER)),
    ],
)
def test_a_device_is_named_by_its_registers(chips, address, registers, named):
    assert chips.name_of(Wires(address, registers), address) == named
