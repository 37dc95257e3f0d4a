"""A file in flash that takes its time."""

_BLOCK = 4096  # bytes of flash that are erased at once


class ErasedFile:
    """A file that is written to flash: erase() is called for each block that it begins."""

    def __init__(self, file, erase):
        self._file = file
        self._erase = erase
        self._room = 0  # bytes that are left in the block

    def write(self, data):
        self._room -= len(data)
        while self._room < 0:
            self._erase()
            self._room += _BLOCK
        return self._file.write(data)

    def flush(self):
        self._file.flush()

    def close(self):
        self._file.close()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()
