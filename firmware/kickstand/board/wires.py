"""Says what is wrong with the two wires of an I2C bus, and who answers on it. Imported after a fault, and by
kickstand.status() and kickstand.check().

sda, scl: GPIO numbers. After wire_fault() and exchanged() the bus must be opened again, because its pins were used
otherwise.
"""

from time import sleep_us

from machine import Pin, SoftI2C

from ..errors import Notice

_FIRST, _LAST = 0x08, 0x77  # addresses that the standard leaves to devices (UM10204, table 4)
_SETTLE_US = 100  # an internal pull of 80 kOhm charges the 400 pF that a bus may have in 32 us
_SLOW_HZ = 100_000
_TIMEOUT_US = 1000


def wire_fault(sda, scl):
    """None, or a Notice: a wire that stays low, or that nothing pulls up. The pull-ups are on the modules: without one
    a wire is open, or the module has no power. Each pin's own weak pull-ups and pull-downs show it."""
    wires = (("SDA", sda), ("SCL", scl))
    fault = None
    for name, pin in wires:
        if not _level(pin, Pin.PULL_UP):
            fault = fault or Notice("wire-low", name, pin)
    open_wires = [wire for wire in wires if not _level(wire[1], Pin.PULL_DOWN)]
    for _, pin in wires:
        Pin(pin, Pin.IN, None)  # an ESP32 would keep the pull-down
    if fault or not open_wires:
        return fault
    return Notice("no-pull-ups", sda, scl) if len(open_wires) == 2 else Notice("no-pull-up", *open_wires[0])


def _level(pin, pull):
    pin = Pin(pin, Pin.IN, pull)
    sleep_us(_SETTLE_US)
    return pin.value()


def answering(i2c, addresses=range(_FIRST, _LAST + 1)):
    """The addresses that answer on a machine.I2C, a list."""
    status = bytearray(1)
    found = []
    for address in addresses:
        try:
            i2c.readfrom_into(address, status)
        except OSError:
            continue
        found.append(address)
    return found


def exchanged(sda, scl, addresses):
    """True if one of these addresses answers with SDA and SCL in each other's place."""
    i2c = SoftI2C(Pin(sda), Pin(scl), freq=_SLOW_HZ, timeout=_TIMEOUT_US)  # its SCL comes first
    return bool(answering(i2c, addresses))
