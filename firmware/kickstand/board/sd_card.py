"""Mounts the SD card on the SPI pins set in config.py.

An ESP32 has a driver of its own. Elsewhere this is micropython-lib's driver for SD cards on SPI, with corrected
writing. The original returns silently when the card rejects the data, waits without limit while the card is busy, and
allocates heap for each byte while it waits.
"""

import os
from errno import EIO, ETIMEDOUT
from time import ticks_diff, ticks_ms

from machine import Pin

from ..errors import Refusal
from ..units import const
from . import port

MOUNT = "/sd"
_CLOCK_HZ = const(10_000_000)  # at the driver's default of 1.32 MHz, one block of a ride would take 25 ms
# a card may be busy for 250 to 500 ms (SD Physical Layer Simplified Specification, section 4.6.2.2)
_BUSY_MS = const(1000)
_ACCEPTED = 0x05  # data response, section 7.3.3.1


def mount(settings):
    """Mount the card unless it is already mounted. Return the card's directory. settings: a Settings. Raises Refusal.

    If the card does not become ready, the attempt takes 5 s or more."""
    # The directory of a mounted card is listed without a size. A folder in flash with the same name has a size.
    if any(entry[0] == MOUNT[1:] and len(entry) == 3 for entry in os.ilistdir("/")):
        return MOUNT
    pins = settings.SD_SCK, settings.SD_MOSI, settings.SD_MISO, settings.SD_CS
    try:
        sck, mosi, miso, cs = [Pin(pin) for pin in pins]
        if port.IS_ESP32:
            from machine import SDCard

            card = SDCard(slot=settings.SD_SPI, sck=sck, mosi=mosi, miso=miso, cs=cs)
        else:
            from machine import SPI

            card = checked_card(SPI(settings.SD_SPI, sck=sck, mosi=mosi, miso=miso), cs)
        os.mount(card, MOUNT)
    except ImportError:
        raise Refusal("no-driver")
    # any error of the driver must be caught: otherwise the board would restart again and again
    except Exception as error:
        raise Refusal("no-card", str(error))
    return MOUNT


def checked_card(spi, cs):
    """Return an SD card whose writes are checked. spi: a machine.SPI. cs: a machine.Pin. Raises OSError, and
    ImportError without the driver."""
    from sdcard import SDCard  # type: ignore[import-not-found]

    class CheckedCard(SDCard):
        def __init__(self, spi, cs):
            self._byte = bytearray(1)
            self._fault = 0
            super().__init__(spi, cs, baudrate=_CLOCK_HZ)

        def writeblocks(self, block_num, buf):
            """Write sectors for the file system. Raises OSError, also if the card rejects the data."""
            self._fault = 0
            super().writeblocks(block_num, buf)
            if self._fault:
                raise OSError(self._fault)

        def write(self, token, buf):
            """Write one sector. The driver calls this method for each sector. After a fault it skips the others."""
            if self._fault:
                return
            self._send(token)
            self.spi.write(buf)
            self.spi.write(b"\xff\xff")  # two bytes of a check sum, which the card ignores
            if self._receive() & 0x1F == _ACCEPTED:
                self._wait()
            else:
                self._fault = EIO
            self._release()

        def write_token(self, token):
            """End a write of several sectors. The driver calls this method."""
            self._send(token)
            self._receive()
            self._wait()
            self._release()

        def _send(self, token):
            self.cs(0)
            self._byte[0] = token
            self.spi.write(self._byte)

        def _receive(self):
            self.spi.readinto(self._byte, 0xFF)
            return self._byte[0]

        def _wait(self):
            begun_ms = ticks_ms()
            while self._receive() == 0:
                if ticks_diff(ticks_ms(), begun_ms) > _BUSY_MS:
                    self._fault = ETIMEDOUT
                    return

        def _release(self):
            self.cs(1)
            self.spi.write(b"\xff")

    return CheckedCard(spi, cs)
