"""The SD card on SPI whose pins config.py names."""

import os

from machine import Pin

from ..errors import CardError
from . import port

MOUNT = "/sd"


def mount(settings):
    """Mount the card, unless it is mounted; return its directory. settings: a Settings. Raises CardError.

    For a card that does not get ready this takes 5 s or more."""
    # A mounted card is listed without a size. A folder in the flash, to which a card's files were copied, has one.
    if any(entry[0] == MOUNT[1:] and len(entry) == 3 for entry in os.ilistdir("/")):
        return MOUNT
    pins = settings.SD_SCK, settings.SD_MOSI, settings.SD_MISO, settings.SD_CS
    try:
        card = port.open_sd_card(settings.SD_SPI, *[Pin(pin) for pin in pins])
        os.mount(card, MOUNT)
    except ImportError:
        raise CardError("no-driver")
    except Exception as error:  # whatever the driver raises: else the board would restart again and again
        raise CardError("no-card", str(error))
    return MOUNT
