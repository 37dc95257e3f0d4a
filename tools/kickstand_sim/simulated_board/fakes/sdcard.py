"""Replaces micropython-lib's driver `sdcard`, with the same interface.

write() and write_token() are left out. These two methods are faulty in that driver, and the firmware has its own
(kickstand/board/sd_card.py).
"""

# pyright: reportAttributeAccessIssue=false
# `time` is MicroPython's module, and a subclass adds the missing methods

import time

_TRIES = 100


class SDCard:
    """A block device.

    spi: a machine.SPI.
    cs: a machine.Pin.
    baudrate: clock rate in Hz after the card is ready.
    """

    def __init__(self, spi, cs, baudrate=1320000):
        self.spi = spi
        self.cs = cs
        self.init_card(baudrate)

    def init_card(self, baudrate):
        """Initialise the card. Raises OSError."""
        self.cs.init(self.cs.OUT, value=1)
        self.spi.init(baudrate=100000, phase=0, polarity=0)
        self.spi.write(b"\xff" * 16)
        if not any(self.cmd(0, 0) == 1 for _ in range(5)):
            raise OSError("no SD card")
        if self.cmd(8, 0x1AA, 4) != 1:
            raise OSError("couldn't determine SD card version")
        for _ in range(_TRIES):
            time.sleep_ms(50)
            self.cmd(58, 0, 4)
            self.cmd(55, 0)
            if self.cmd(41, 0x40000000) == 0:
                break
        else:
            raise OSError("timeout waiting for v2 card")
        if self.cmd(9, 0, 0, False) != 0:
            raise OSError("no response from SD card")
        csd = bytearray(16)
        self.readinto(csd)
        self.sectors = (int.from_bytes(csd[7:10], "big") + 1) * 1024
        self.cmd(16, 512)
        self.spi.init(baudrate=baudrate, phase=0, polarity=0)

    def cmd(self, cmd, arg, final=0, release=True):
        """Send a command. Returns the first byte of the answer, -1 without an answer."""
        self.cs(0)
        self.spi.write(bytes([0x40 | cmd]) + arg.to_bytes(4, "big") + b"\x95")
        for _ in range(_TRIES):
            response = self.spi.read(1, 0xFF)[0]
            if not response & 0x80:
                self.spi.read(abs(final), 0xFF)
                if release:
                    self._release()
                return response
        self._release()
        return -1

    def readinto(self, buf):
        """Read the data that the card sends after a command. Raises OSError."""
        self.cs(0)
        for _ in range(_TRIES):
            if self.spi.read(1, 0xFF)[0] == 0xFE:
                break
            time.sleep_ms(1)
        else:
            self._release()
            raise OSError("timeout waiting for response")
        self.spi.write_readinto(b"\xff" * len(buf), buf)
        self.spi.write(b"\xff\xff")
        self._release()

    def readblocks(self, block_num, buf):
        """Read blocks for the file system. Raises OSError."""
        view = memoryview(buf)
        for i in range(len(buf) // 512):  # the real driver reads several blocks with CMD18
            if self.cmd(17, block_num + i, release=False) != 0:
                self.cs(1)
                raise OSError(5)
            self.readinto(view[i * 512 : (i + 1) * 512])

    def writeblocks(self, block_num, buf):
        """Write blocks for the file system. Raises OSError."""
        count = len(buf) // 512
        if self.cmd(24 if count == 1 else 25, block_num) != 0:
            raise OSError(5)
        if count == 1:
            self.write(0xFE, buf)
            return
        view = memoryview(buf)
        for i in range(count):
            self.write(0xFC, view[i * 512 : (i + 1) * 512])
        self.write_token(0xFD)

    def ioctl(self, op, arg):
        """Answer the file system's queries."""
        return self.sectors if op == 4 else 512 if op == 5 else None

    def _release(self):
        self.cs(1)
        self.spi.write(b"\xff")
