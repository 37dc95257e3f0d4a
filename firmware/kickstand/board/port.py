"""What differs between the boards: default pins, kind of interrupt, SD card, and how a started watchdog is put to rest.
Nothing else knows the port."""

import gc
import sys

import machine

# While the other modules are loaded: what that leaves would push what stays to the far end of the heap, and make
# every later collection long. The loop sets it back.
gc.threshold(32_768)

IS_ESP32 = sys.platform == "esp32"

if IS_ESP32:
    SENSOR_PINS, LCD_PINS, BUTTON_PIN = (21, 22), (18, 19), 4  # (SDA, SCL)
    GPS_UART, GPS_PINS, WHEEL_PIN = 2, (17, 16), 27  # (TX, RX)
    PIN_IRQ = {}  # always soft
    SD_SPI = (2, 3)  # slots of machine.SDCard; 0 and 1 are no SPI
else:  # Raspberry Pi Pico and Pico 2
    SENSOR_PINS, LCD_PINS, BUTTON_PIN = (4, 5), (6, 7), 15
    GPS_UART, GPS_PINS, WHEEL_PIN = 1, (8, 9), 14
    PIN_IRQ = {"hard": True}  # a soft one is lost while the display is written to
    SD_SPI = (0, 1)

_WATCHDOG_MS = 8000  # rp2 allows 8388 at most
_HOUR_MS = 3_600_000


_watchdog = None


def start_watchdog():
    """The board resets itself when feed() is not called for 8 s."""
    global _watchdog
    _watchdog = machine.WDT(timeout=_WATCHDOG_MS)
    return _watchdog


def rest_watchdog():
    """Give the console to the user: after Ctrl-C nothing feeds the watchdog, and a board that resets in the
    middle of a copy could not be deployed to. machine.WDT itself cannot be stopped."""
    if _watchdog is None:
        return
    if IS_ESP32:
        machine.WDT(timeout=_HOUR_MS)  # this port takes a new time-out
        return
    # RP2040 data sheet 4.7.6 and RP2350 12.9.7: CTRL.ENABLE is bit 30; a write at +0x3000 clears the bits
    # given
    base = 0x400D8000 if "RP2350" in getattr(sys.implementation, "_machine", "") else 0x40058000
    machine.mem32[base + 0x3000] = 1 << 30


def open_sd_card(number, sck, mosi, miso, cs):
    """The card as a block device. number: one of SD_SPI.  Pins.  Raises ImportError, OSError, ValueError."""
    if IS_ESP32:
        from machine import SDCard

        return SDCard(slot=number, sck=sck, mosi=mosi, miso=miso, cs=cs)
    from machine import SPI
    from sdcard import SDCard  # type: ignore[import-not-found]

    return SDCard(SPI(number, sck=sck, mosi=mosi, miso=miso), cs)
