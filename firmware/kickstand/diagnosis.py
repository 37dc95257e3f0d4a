"""Finds out why a device on an I2C bus cannot be used, and who else answers there. Imported after a fault, and by
kickstand.status().

sda, scl: GPIO numbers.  reopen: called to free the bus, returns it as a machine.I2C.
"""

from .board import wires
from .errors import Notice
from .imu.mpu6050 import NotKept
from .imu.other_chips import MOTION, OTHER, SUPPORTED, name_of, who_am_i

SENSOR_ADDRESSES = (0x68, 0x69)
MOTION_ADDRESSES = SENSOR_ADDRESSES + (0x6A, 0x6B)
_NOTHING = (0x00, 0xFF, -1)  # no chip of the MPU6050's family has this WHO_AM_I


def scan(sda, scl, reopen, addresses):
    """(notice, devices): what is wrong with the wires of a bus, a Notice or None; who answers there, a list of
    (address, name, kind), see other_chips.name_of(). addresses: where the device that is missed would be.

    Takes 0.1 s, and leaves the bus open. Raises what reopen() raises, except OSError."""
    notice = wires.wire_fault(sda, scl)
    devices = []
    try:
        i2c = reopen()
        if not notice:
            devices = [(address,) + name_of(i2c, address) for address in wires.answering(i2c)]
            if not devices and wires.exchanged(sda, scl, addresses):
                notice = Notice("exchanged", sda, scl)
            reopen()
    except OSError:
        notice = notice or Notice("wire-low", "SDA", sda)
    return notice, devices


def explain_sensor(sda, scl, reopen, chip, error):
    """(notice, addresses): why the chip could not be set up, a Notice; the I2C addresses that answer on its bus.

    chip: an Mpu6050.  error: the OSError or UnknownChip of the attempt. Raises what reopen() raises, except OSError."""
    notice, devices = scan(sda, scl, reopen, MOTION_ADDRESSES)
    if not notice:
        kept = not isinstance(error, NotKept)
        first = SENSOR_ADDRESSES if kept else (chip.address,)
        devices.sort(key=lambda device: device[0] not in first)
        notice = _judged(devices, reopen(), kept) or Notice("no-sensor", sda, scl)
    return notice, sorted([device[0] for device in devices])


def _judged(devices, i2c, kept):
    """The Notice for what answers on the sensor's bus, None if nothing there concerns the sensor. kept: False if a chip
    was found and does not keep its settings; it is the first of the devices."""
    if not kept and devices and devices[0][2] != MOTION and devices[0][1] != "clock":
        return Notice("not-kept", devices[0][0])
    for address, name, kind in devices:
        if kind == MOTION:
            return Notice("other-chip", name, address)
    for address, _, kind in devices:
        if kind == SUPPORTED:
            return Notice("bus-errors", address)
    for address, name, _ in devices:
        if address in SENSOR_ADDRESSES and not name:
            number = who_am_i(i2c, address)
            return Notice("no-chip", number & 0xFF, address) if number in _NOTHING else Notice("unknown-chip", number)
    for address, name, kind in devices:
        if kind == OTHER and name and name != "display":
            return Notice("other-device", name, address)
    return None
