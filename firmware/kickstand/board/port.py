"""The differences between boards: I2C, interrupts, how to disarm the watchdog, and how the heap grows.

The usual pins are in setting_table.py, the driver of the SD card in sd_card.py. No other module depends on the kind of
board.
"""

import gc
import sys
from time import sleep_us

import machine
from machine import Pin

IS_ESP32 = sys.platform == "esp32"
# The board and its chip, such as "Raspberry Pi Pico with RP2040" or "ESP32C3 module with ESP32-C3"
MACHINE = getattr(sys.implementation, "_machine", "")

# Extra arguments of Pin.irq(). An ESP32 has only soft interrupts, and transfers by SoftI2C delay them. On a Pico soft
# interrupts would be lost during a transfer to the display.
PIN_IRQ = {} if IS_ESP32 else {"hard": True}
ONLY_MS_YIELD = IS_ESP32  # there sleep_us() gives no time to the radio and the idle task, only sleep_ms() does

_ESP32_HZ = 240_000_000
# Largest clock of SoftI2C, with half a period of 2 us. At 400 kHz, half a period is 1 us, but the MPU6050 needs 1.3 us
_SOFT_I2C_HZ = 250_000
_HALF_PERIOD_US = 5  # half a period of SCL while a bus is freed, so SCL runs at 100 kHz
# Time-out in bit times. On a Pico the time-out is for a whole transfer, which has at most 136 bytes. On an ESP32 the
# time-out is for each bit. The default of 50 ms would stop the loop for too long.
_TIMEOUT_BITS = 2000
_TURN_BYTES = 2300  # bytes of heap that one pass of the app's loop uses, at most 2270 on a Pico
_FEWEST_TURNS = 6

_WATCHDOG_MS = 8000  # the watchdog of a Pico allows at most 8388 ms
_WEEK_MS = 604_800_000  # a week. An ESP32 counts a time-out in 32 bits, with four counts per ms, so it allows 12 days

_watchdog = None


def begin():
    """Prepare the chip. Call this function at the start of the firmware, before other modules are imported."""
    # Collect garbage often while the other modules are loaded. Otherwise lasting objects would be placed behind the
    # garbage, far along the heap. Then every later collection would scan the heap up to those objects. App resets the
    # threshold before its loop begins.
    gc.threshold(80_000)
    if IS_ESP32 and machine.freq() < _ESP32_HZ:  # MicroPython starts a classic ESP32 with 160 MHz
        try:
            machine.freq(_ESP32_HZ)
        except ValueError:  # the C series and the H2 run at their highest frequency from the start
            pass


def _set(pin, value):
    pin.value(value)
    sleep_us(_HALF_PERIOD_US)


def free(sda_pin, scl_pin):
    """Make a device release SDA (NXP UM10204, section 3.1.16, bus clear). Return True if SDA is high afterwards.

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
    """Free a bus, and open it as a machine.I2C, or as a SoftI2C on an ESP32. Raises OSError if SDA stays low,
    ValueError for pins that the controller cannot use.

    An ESP32's machine.I2C has three problems. Up to MicroPython 1.28 machine.I2C ignores the time-out, and waits up to
    0.1 s for each byte of a stalled transfer. The whole transfer then takes longer than the watchdog allows. Later
    versions count the time-out in ticks of 10 ms, so with 5 ms every transfer fails. And a C3 has only one I2C
    controller.

    Args:
        controller: number of the controller, not used on an ESP32.
        sda_pin, scl_pin: GPIO numbers.
        frequency: clock in Hz.
    """
    if not free(sda_pin, scl_pin):
        raise OSError("SDA is held low")
    sda, scl, timeout_us = Pin(sda_pin), Pin(scl_pin), _TIMEOUT_BITS * 1_000_000 // frequency
    if IS_ESP32:
        return machine.SoftI2C(scl, sda, freq=min(frequency, _SOFT_I2C_HZ), timeout=timeout_us)
    return machine.I2C(controller, sda=sda, scl=scl, freq=frequency, timeout=timeout_us)


def turns_to_collect():
    """Return the number of passes of the app's loop between two garbage collections.

    These passes use three quarters of the free heap. If they used it up, a collection would run in the middle of a
    pass. An ESP32's heap starts with 64 KB and grows only after a collection that frees too little."""
    free = gc.mem_free()
    if IS_ESP32:
        import esp32  # type: ignore[import-not-found]

        # mem_free() also counts the possible growth of the heap, which is the largest block of ESP-IDF's heap
        free -= max(region[2] for region in esp32.idf_heap_info(esp32.HEAP_DATA))
    return max(_FEWEST_TURNS, free * 3 // (4 * _TURN_BYTES))


def start_watchdog():
    """Start and return a machine.WDT. The board resets if its feed() is not called for 8 s."""
    global _watchdog
    _watchdog = machine.WDT(timeout=_WATCHDOG_MS)
    return _watchdog


def rest_watchdog():
    """Stop a started watchdog from resetting the board.

    After Ctrl-C nothing feeds the watchdog any more, and a reset in the middle of a copy would break an installation.
    machine.WDT has no method to stop it."""
    if _watchdog is None:
        return
    if IS_ESP32:
        # A long time-out instead: an ESP32 accepts a new time-out, and a soft reset keeps it
        machine.WDT(timeout=_WEEK_MS)
        return
    # Data sheets RP2040 section 4.7.6 and RP2350 section 12.9.7: ENABLE is bit 30 of the watchdog's CTRL, at its base
    # address. Sections 2.1.2 and 2.1.3: a write to address + 0x3000 clears the bits that are 1.
    base = 0x400D8000 if "RP2350" in MACHINE else 0x40058000
    machine.mem32[base + 0x3000] = 1 << 30
