"""Finds out why the sensor or the display cannot be used, and which devices answer on an I2C bus.

A device is identified by its registers (sources: the chips' data sheets and the register maps of their makers'
drivers). They are only read, because a write could set a clock or damage another chip's calibration.

This module is imported after a fault, and by kickstand.status() and kickstand check. These arguments have the same
meaning in all functions:
* sda, scl: the GPIO numbers of the bus.
* reopen: reopen() frees the bus and returns it as a machine.I2C.
* chip: an Mpu6050.
"""

from time import sleep_ms, sleep_us

from machine import Pin, SoftI2C
from micropython import const

from .errors import Notice
from .imu.axes import FRAME
from .imu.mpu6050 import CHIPS, NotKept

_SENSOR_ADDRESSES = const((0x68, 0x69))
MOTION_ADDRESSES = _SENSOR_ADDRESSES + (0x6A, 0x6B)
_NOTHING = (0x00, 0xFF, -1)  # values of WHO_AM_I that no chip of the MPU6050's family has
_FIRST, _LAST = 0x08, 0x77  # range of the addresses for devices (UM10204, table 4)
# Waiting time after switching a pull-up, in us. A bus may have at most 400 pF. An internal pull-up of 80 kOhm charges
# this capacitance in 32 us.
_SETTLE_US = 100
_DISCHARGE_US = 1
_SLOW_HZ = 100_000
_TIMEOUT_US = 1000
_INT_ENABLE = const(0x38)  # register map p. 27; bit 0 enables the signal that a sample is ready
_INT_STATUS = const(0x3A)  # p. 28
_PERIODS = 4  # number of sample periods to wait while the FIFO fills
_WHO_AM_I = 0x75
_PWR_MGMT_1 = 0x6B
_AS_AN_MPU = (0x40, 0x41, 0x01)  # values of PWR_MGMT_1 in chips like the MPU6050, after power-on and after a set-up
OTHER, MOTION, SUPPORTED = 0, 1, 2  # kinds of devices; MOTION is a motion sensor without support in this firmware
_TIME_BYTES = 10  # number of registers to read from a clock; the time is in seven of them, from register 0 or 3 on

# Chips with an identification register. The columns are two addresses, the register, then each content (all in
# hexadecimal) with the chip's name.
_MOTION = """
68 69 75 47 ICM-42688 db ICM-42688-V 42 ICM-42605 44 ICM-42686 67 ICM-42670 60 ICM-42607 6f IIM-42652
68 69 75 4e ICM-40627 3b ICM-40609
68 69 72 e9 ICM-45686 e5 ICM-45605
68 69 00 d1 BMI160 24 BMI270 27 BMI260 0f BMI088 ea ICM-20948 e1 ICM-20649 e0 ICM-20648
6a 6b 0f 69 LSM6DS3 6a LSM6DSL 6b LSM6DSR 6c LSM6DSO 70 LSM6DSV 68 LSM9DS1 d4 L3GD20 d7 L3GD20H
6a 6b 00 05 QMI8658
28 29 00 a0 BNO055
18 19 00 fa BMI055 1e BMI088
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


def wire_fault(sda, scl):
    """Return a Notice if a wire stays low or nothing pulls it up, else None.

    The pull-ups are on the modules. Without a pull-up a wire is open, or the module has no power. The test uses the
    weak pull-ups and pull-downs inside the pins."""
    wires = (("SDA", sda), ("SCL", scl))
    fault = None
    for name, pin in wires:
        if not _level(pin, Pin.PULL_UP):
            fault = fault or Notice("wire-low", name, pin)
    open_wires = [wire for wire in wires if not _level(wire[1], Pin.PULL_DOWN)]
    for _, pin in wires:
        Pin(pin, Pin.IN, None)  # remove the pull-down, because an ESP32 would keep it
    if fault or not open_wires:
        return fault
    return Notice("no-pull-ups", sda, scl) if len(open_wires) == 2 else Notice("no-pull-up", *open_wires[0])


def _level(pin, pull):
    if pull == Pin.PULL_DOWN:
        # An RP2350 keeps a pin that was high at 2.2 V against its pull-down (erratum RP2350-E9), so pull it low first
        Pin(pin, Pin.OUT, value=0).value()  # reading it takes the time until it is low
        sleep_us(_DISCHARGE_US)
    pin = Pin(pin, Pin.IN, pull)
    sleep_us(_SETTLE_US)
    return pin.value()


def answering(i2c, addresses=range(_FIRST, _LAST + 1)):
    """List the addresses that answer on a machine.I2C."""
    status = bytearray(1)
    answers = []
    for address in addresses:
        try:
            i2c.readfrom_into(address, status)
        except OSError:
            continue
        answers.append(address)
    return answers


def exchanged(sda, scl, addresses):
    """Return True if one of the addresses answers when SDA and SCL are exchanged."""
    # SoftI2C takes SCL first, so the wires are exchanged
    i2c = SoftI2C(Pin(sda), Pin(scl), freq=_SLOW_HZ, timeout=_TIMEOUT_US)
    return bool(answering(i2c, addresses))


def scan(sda, scl, reopen, addresses):
    """Examine a bus. The scan takes 0.1 s and leaves the bus open.

    Args:
        addresses: the addresses at which the missing device may answer.

    Returns:
        notice: a Notice for a fault of the wires, or None.
        devices: list of (address, name, kind) of each device that answers, see name_of().

    Raises:
        The errors of reopen(), except OSError.
    """
    notice = wire_fault(sda, scl)
    devices = []
    try:
        i2c = reopen()
        if not notice:
            devices = [(address,) + name_of(i2c, address) for address in answering(i2c)]
            if not devices and exchanged(sda, scl, addresses):
                notice = Notice("exchanged", sda, scl)
            reopen()
    except OSError:
        notice = notice or Notice("wire-low", "SDA", sda)
    return notice, devices


def explain(sda, scl, reopen, chip, error):
    """Explain a failed set-up, or test the FIFO.

    Args:
        error: the OSError or UnknownChip that the set-up raised, or None to test the FIFO.

    Returns:
        notice: a Notice with the reason; None if the FIFO works.
        addresses: sorted list of the I2C addresses that answer on the bus; empty after a test of the FIFO.

    Raises:
        The errors of reopen(), except OSError. The errors of fifo_fault().
    """
    if error is None:
        return fifo_fault(chip), []
    notice, devices = scan(sda, scl, reopen, MOTION_ADDRESSES)
    if not notice:
        kept = not isinstance(error, NotKept)
        first = _SENSOR_ADDRESSES if kept else (chip.address,)
        devices.sort(key=lambda device: device[0] not in first)
        notice = _judged(devices, reopen(), kept) or Notice("no-sensor", sda, scl)
    return notice, sorted([device[0] for device in devices])


def _judged(devices, i2c, kept):
    """Return a Notice if a device on the sensor's bus explains the fault, else None.

    Args:
        devices: the devices from scan().
        i2c: a machine.I2C.
        kept: False if the first device is a chip that does not keep its settings.
    """
    if not kept and devices and devices[0][2] != MOTION and devices[0][1] != "clock":
        return Notice("not-kept", devices[0][0])
    for address, name, kind in devices:
        if kind == MOTION:
            return Notice("other-chip", name, address)
    for address, _, kind in devices:
        if kind == SUPPORTED:
            return Notice("bus-errors", address)
    for address, name, _ in devices:
        if address in _SENSOR_ADDRESSES and not name:
            number = who_am_i(i2c, address)
            return Notice("no-chip", number & 0xFF, address) if number in _NOTHING else Notice("unknown-chip", number)
    for address, name, kind in devices:
        if kind == OTHER and name and name != "display":
            return Notice("other-device", name, address)
    return None


def fifo_fault(chip):
    """Return the Notice "sensor-fifo" if the chip measures but its FIFO does not work, else None.

    values[0] of the Notice is the fault in words. The test takes up to 0.3 s and leaves the FIFO empty. Raises OSError
    from the bus."""
    chip.restart_fifo()
    left = chip.waiting()  # not 0 if a sample has arrived since the restart of the FIFO
    chip.write_register(_INT_ENABLE, 1)
    reading = _reading(chip)
    sleep_ms(_PERIODS * chip.period_ms)
    waiting = chip.waiting()
    measures = chip.read_register(_INT_STATUS) & 1 or _reading(chip) != reading
    chip.write_register(_INT_ENABLE, 0)
    fault = None
    if left > FRAME * _PERIODS:
        fault = "stays full"
    elif measures and waiting <= left:
        fault = "stays empty" if not left else "stands still"
    elif measures and _repeats(chip):
        fault = "repeats"
    chip.restart_fifo()
    return Notice("sensor-fifo", fault) if fault else None


def _reading(chip):
    chip.read()
    return tuple(chip.counts)


def _repeats(chip):
    """Return True if the FIFO repeats one frame while the data registers change."""
    first = _reading(chip)
    frames = set()
    for _ in range(3):
        sleep_ms(_PERIODS * chip.period_ms)
        for k in range(chip.fetch()):
            chip.take(k)
            frames.add(tuple(chip.counts))
    return len(frames) == 1 and _reading(chip) != first


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
            _, _, register, *chips = line.split(" ")
            content = "%02x" % _reads(i2c, address, int(register, 16))
            if int(register, 16) != skipped and content in chips:
                return chips[chips.index(content) + 1], MOTION
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
