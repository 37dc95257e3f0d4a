"""The sensor's FIFO: a ring of bytes. It does not know where frames begin, just as the chip's."""


class Fifo:
    """size: its capacity in bytes. count: number of bytes that wait to be read."""

    def __init__(self, size):
        self.size = size
        self.count = 0
        self._ring = bytearray(size)
        self._head = 0
        self._last = 0

    def clear(self):
        """Make it empty."""
        self.count = 0

    def push(self, byte, keep_old=False):
        """Add a byte. True if the FIFO was full: then the oldest byte is lost, or with keep_old the new one."""
        full = self.count == self.size
        if full:
            if keep_old:
                return True
            self._head = (self._head + 1) % self.size
            self.count -= 1
        self._ring[(self._head + self.count) % self.size] = byte
        self.count += 1
        return full

    def push_all(self, values, places, keep_old=False):
        """push() of values[place] for each of places, quickly. True if it was full for one of them."""
        if self.count + len(places) > self.size:
            full = False
            for place in places:
                full = self.push(values[place], keep_old) or full
            return full
        ring, size = self._ring, self.size
        at = (self._head + self.count) % size
        for place in places:
            ring[at] = values[place]
            at += 1
            if at == size:
                at = 0
        self.count += len(places)
        return False

    def pop(self):
        """Remove and return the oldest byte. An empty FIFO repeats the byte read last (register map 4.31)."""
        if self.count:
            self._last = self._ring[self._head]
            self._head = (self._head + 1) % self.size
            self.count -= 1
        return self._last

    def pop_into(self, buf):
        """Fill buf with what pop() returns, quickly."""
        ring, size, at = self._ring, self.size, self._head
        n = min(self.count, len(buf))
        for i in range(n):
            buf[i] = ring[at]
            at += 1
            if at == size:
                at = 0
        if n:
            self._last = buf[n - 1]
            self._head = at
            self.count -= n
        for i in range(n, len(buf)):
            buf[i] = self._last
