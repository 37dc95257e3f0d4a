"""I2C controllers opened, and stuck buses freed (NXP UM10204, section 3.1.16)."""

from time import sleep_us

from machine import I2C, Pin

_HALF_PERIOD_US = 5
_TIMEOUT_BITS = (
    2000  # on rp2 this is for a whole transfer: 112 bytes at most. The default of 50 ms would stall the loop
)


def free(sda_pin, scl_pin):
    """Clock out whatever a device was sending when the controller was reset, then STOP. True if SDA is
    released.

    MicroPython does not do this; a microcontroller reset in the middle of a read leaves SDA low for ever.
    """
    scl = Pin(scl_pin, Pin.OPEN_DRAIN, value=1)
    sda = Pin(sda_pin, Pin.OPEN_DRAIN, value=1)
    for _ in range(9):
        sleep_us(_HALF_PERIOD_US)
        if sda.value():
            break
        scl.value(0)
        sleep_us(_HALF_PERIOD_US)
        scl.value(1)
    scl.value(0)
    sda.value(0)
    sleep_us(_HALF_PERIOD_US)
    scl.value(1)
    sleep_us(_HALF_PERIOD_US)
    sda.value(1)
    sleep_us(_HALF_PERIOD_US)
    return bool(sda.value())


def open_i2c(controller, sda_pin, scl_pin, frequency):
    """A freed bus as machine.I2C. controller: its number; pins: GPIO numbers; frequency in Hz. Raises OSError when it
    cannot be freed, ValueError for pins that the controller cannot use."""
    if not free(sda_pin, scl_pin):
        raise OSError("SDA is held low")
    timeout_us = _TIMEOUT_BITS * 1_000_000 // frequency
    return I2C(controller, sda=Pin(sda_pin), scl=Pin(scl_pin), freq=frequency, timeout=timeout_us)
