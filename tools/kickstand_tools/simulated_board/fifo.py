"""The sensor's FIFO: a ring of bytes that knows nothing of frames."""


class Fifo:
    """size in bytes. count: bytes waiting."""

    def __init__(self, size):
        self.size = size
        self.count = 0
        self._ring = bytearray(size)
        self._head = 0
        self._last = 0

    def clear(self):
        """Forget everything."""
        self.count = 0

    def push(self, byte, keep_old=False):
        """Add a byte. True if it was one too many: then the oldest is lost, or with keep_old this one."""
        full = self.count == self.size
        if full:
            if keep_old:
                return True
            self._head = (self._head + 1) % self.size
            self.count -= 1
        self._ring[(self._head + self.count) % self.size] = byte
        self.count += 1
        return full

    def pop(self):
        """The oldest byte. When there is none, the byte that was read last (register map 4.31)."""
        if self.count:
            self._last = self._ring[self._head]
            self._head = (self._head + 1) % self.size
            self.count -= 1
        return self._last
