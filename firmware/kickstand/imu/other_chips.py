"""Identifies the chips on the sensor's bus. This module is imported after a fault, and by kickstand.status().

Sources: the chips' data sheets and the register maps of their makers' drivers. The module only reads registers, because
a write could set a clock or damage another chip's calibration.
"""

from .mpu6050 import CHIPS

_WHO_AM_I = 0x75
_PWR_MGMT_1 = 0x6B
_AS_AN_MPU = (0x40, 0x41, 0x01)  # values of PWR_MGMT_1 in chips like the MPU6050, after power-on and after a set-up
OTHER, MOTION, SUPPORTED = 0, 1, 2  # kinds of devices; MOTION is a motion sensor without support in this firmware
_TIME_BYTES = 10  # number of registers to read from a clock; the time is in seven of them, from register 0 or 3 on

# Chips with an identification register. The columns are two addresses, the register, its content (all in hexadecimal)
# and the name.
_MOTION = """
68 69 75 47 ICM-42688
68 69 75 db ICM-42688-V
68 69 75 42 ICM-42605
68 69 75 44 ICM-42686
68 69 75 67 ICM-42670
68 69 75 60 ICM-42607
68 69 75 6f IIM-42652
68 69 75 4e ICM-40627
68 69 75 3b ICM-40609
68 69 72 e9 ICM-45686
68 69 72 e5 ICM-45605
68 69 00 d1 BMI160
68 69 00 24 BMI270
68 69 00 27 BMI260
68 69 00 0f BMI088
68 69 00 ea ICM-20948
68 69 00 e1 ICM-20649
68 69 00 e0 ICM-20648
6a 6b 0f 69 LSM6DS3
6a 6b 0f 6a LSM6DSL
6a 6b 0f 6b LSM6DSR
6a 6b 0f 6c LSM6DSO
6a 6b 0f 70 LSM6DSV
6a 6b 0f 68 LSM9DS1
6a 6b 0f d4 L3GD20
6a 6b 0f d7 L3GD20H
6a 6b 00 05 QMI8658
28 29 00 a0 BNO055
18 19 00 fa BMI055
18 19 00 1e BMI088
18 19 0f 33 LIS3DH
1d 53 00 e5 ADXL345
"""
# Other devices. The columns are the first address, the last address (in hexadecimal) and the name.
_OTHERS = """
76 77 barometer
1e 1e compass
0c 0d compass
2c 2c compass
50 57 EEPROM
51 51 clock
6f 6f clock
3c 3d display
20 27 display
38 3f display
"""


def name_of(i2c, address):
    """Identify the device that answers at an address.

    Args:
        i2c: a machine.I2C.
        address: the I2C address.

    Returns:
        name: the device's name, "" if it is unknown.
        kind: OTHER, MOTION or SUPPORTED; OTHER if it is unknown.
    """
    at_mpu = address & 0xFE == 0x68
    # register 0 of a chip like the MPU6050 can hold any number, so it does not identify a chip
    skipped = 0x00 if at_mpu and _reads(i2c, address, _PWR_MGMT_1) in _AS_AN_MPU else -1
    mark = " %02x " % address
    for line in _MOTION.split("\n"):
        if mark in " %s " % line[:5]:
            cells = line.split(" ")
            register = int(cells[2], 16)
            if register != skipped and _reads(i2c, address, register) == int(cells[3], 16):
                return cells[4], MOTION
    if at_mpu:
        if is_clock(i2c, address):
            return "clock", OTHER
        chip = CHIPS.get(who_am_i(i2c, address))
        return (chip[0], SUPPORTED) if chip else ("", OTHER)
    for line in _OTHERS.split("\n"):
        cells = line.split(" ")
        if len(cells) == 3 and int(cells[0], 16) <= address <= int(cells[1], 16):
            return cells[2], OTHER
    return "", OTHER


def who_am_i(i2c, address):
    """Return the value of the register that is WHO_AM_I in an MPU6050, or -1 without an answer."""
    return _reads(i2c, address, _WHO_AM_I)


def is_clock(i2c, address):
    """Return True if the first registers hold a time. The clocks DS1307, DS3231 and PCF8523 have the same address as
    the sensor."""
    try:
        time = i2c.readfrom_mem(address, 0, _TIME_BYTES)
    except OSError:
        return False
    # The registers hold seconds, minutes, hours, day of the week, date, month and year. In a PCF8523 these seven begin
    # at register 3, and the date comes before the day of the week.
    return _is_time(time, 0, 4, 3) or _is_time(time, 3, 6, 7)


def _is_time(time, at, date_at, day_at):
    limits = ((at, 0x7F, 0, 59), (at + 1, 0x7F, 0, 59), (at + 2, 0x3F, 0, 32), (date_at, 0x3F, 1, 31))
    limits += ((day_at, 0xFF, 0, 7), (at + 5, 0x1F, 1, 12), (at + 6, 0xFF, 0, 99))
    for index, mask, least, highest in limits:
        value = time[index] & mask
        if value & 15 > 9 or not least <= (value >> 4) * 10 + (value & 15) <= highest:
            return False
    return True


def _reads(i2c, address, register):
    """Return the value of a register, or -1 without an answer."""
    try:
        return i2c.readfrom_mem(address, register, 1)[0]
    except OSError:
        return -1
