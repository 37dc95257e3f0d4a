"""The SD card on SPI whose pins config.py names."""

import os

from machine import Pin

from ..errors import CardError
from . import port

MOUNT = "/sd"


def mount(settings):
    """Mount the card, unless that was done before; return its directory. settings: a Settings. Raises CardError.

    A card that does not get ready takes 5 s or more."""
    # What is mounted is listed without a size, unlike a folder in the flash: a card's files, copied there, may be one.
    if any(entry[0] == MOUNT[1:] and len(entry) == 3 for entry in os.ilistdir("/")):
        return MOUNT
    pins = settings.SD_SCK, settings.SD_MOSI, settings.SD_MISO, settings.SD_CS
    try:
        card = port.open_sd_card(settings.SD_SPI, *[Pin(pin) for pin in pins])
        os.mount(card, MOUNT)
    except ImportError:
        raise CardError("no-driver")
    except Exception as error:  # whatever a driver raises: the board must not restart for it, again and again
        raise CardError("no-card", str(error))
    return MOUNT
