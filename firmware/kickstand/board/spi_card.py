"""micropython-lib's driver for SD cards on SPI, with corrected writing.

The original returns silently when the card rejects the data, waits without limit while the card is busy, and allocates
heap for each byte while it waits.
"""

from errno import EIO, ETIMEDOUT
from time import ticks_diff, ticks_ms

from sdcard import SDCard  # type: ignore[import-not-found]

from ..units import const

_CLOCK_HZ = const(10_000_000)  # at the driver's default of 1.32 MHz, one block of a ride would take 25 ms
# a card may be busy for 250 to 500 ms (SD Physical Layer Simplified Specification, section 4.6.2.2)
_BUSY_MS = const(1000)
_ACCEPTED = 0x05  # data response, section 7.3.3.1


class CheckedCard(SDCard):
    """An SD card whose writes are checked. spi: a machine.SPI. cs: a machine.Pin. Raises OSError."""

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
        """Write one sector. The driver calls this method for each sector. After a fault the method skips the remaining
        sectors."""
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
