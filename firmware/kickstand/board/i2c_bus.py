"""Opens I2C buses, and frees a bus that a device blocks (NXP UM10204, section 3.1.16, bus clear)."""

from time import sleep_us

from machine import Pin

from . import port

_HALF_PERIOD_US = 5  # half a period of SCL while a bus is freed, so SCL runs at 100 kHz
# Time-out in bit times. On a Pico the time-out is for a whole transfer, which has at most 136 bytes. On an ESP32 the
# time-out is for each bit. The default of 50 ms would stop the loop for too long.
_TIMEOUT_BITS = 2000


def _set(pin, value):
    pin.value(value)
    sleep_us(_HALF_PERIOD_US)


def free(sda_pin, scl_pin):
    """Make a device release SDA. Return True if SDA is high afterwards.

    If the microcontroller resets in the middle of a read, the device waits for clock pulses and holds SDA low forever.
    Up to nine pulses let the device finish its byte, and a STOP condition ends the transfer. MicroPython sends neither.

    Args:
        sda_pin, scl_pin: GPIO numbers.
    """
    scl = Pin(scl_pin, Pin.OPEN_DRAIN, value=1)
    sda = Pin(sda_pin, Pin.OPEN_DRAIN, value=1)
    for _ in range(9):
        sleep_us(_HALF_PERIOD_US)
        if sda.value():
            break
        _set(scl, 0)
        scl.value(1)
    scl.value(0)
    _set(sda, 0)
    _set(scl, 1)
    _set(sda, 1)
    return bool(sda.value())


def open_i2c(controller, sda_pin, scl_pin, frequency):
    """Free the bus and open it, see port.open_i2c(). Raises OSError if SDA stays low, ValueError for pins that the
    controller cannot use.

    Args:
        controller: number of the I2C controller.
        sda_pin, scl_pin: GPIO numbers.
        frequency: clock in Hz.
    """
    if not free(sda_pin, scl_pin):
        raise OSError("SDA is held low")
    timeout_us = _TIMEOUT_BITS * 1_000_000 // frequency
    return port.open_i2c(controller, Pin(sda_pin), Pin(scl_pin), frequency, timeout_us)
