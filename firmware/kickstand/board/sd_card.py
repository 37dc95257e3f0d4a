"""Mounts the SD card on the SPI pins set in config.py."""

import os

from machine import Pin

from ..errors import CardError
from . import port

MOUNT = "/sd"


def mount(settings):
    """Mount the card unless it is already mounted. Return the card's directory. settings: a Settings. Raises CardError.

    If the card does not become ready, the attempt takes 5 s or more."""
    # The directory of a mounted card is listed without a size. A folder in flash with the same name has a size.
    if any(entry[0] == MOUNT[1:] and len(entry) == 3 for entry in os.ilistdir("/")):
        return MOUNT
    pins = settings.SD_SCK, settings.SD_MOSI, settings.SD_MISO, settings.SD_CS
    try:
        card = port.open_sd_card(settings.SD_SPI, *[Pin(pin) for pin in pins])
        os.mount(card, MOUNT)
    except ImportError:
        raise CardError("no-driver")
    # any error of the driver must be caught: otherwise the board would restart again and again
    except Exception as error:
        raise CardError("no-card", str(error))
    return MOUNT
