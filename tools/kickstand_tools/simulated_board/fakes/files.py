"""Files on a flash that takes its time, that is full, or whose supply is cut."""

_BLOCK = 4096  # bytes of flash that are erased at once


class _Wrapped:
    """What the two below leave to the file itself."""

    def __init__(self, file):
        self._file = file

    def flush(self):
        self._file.flush()

    def close(self):
        self._file.close()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()


class ErasedFile(_Wrapped):
    """A file that is written to flash: erase() is called for each block that it begins."""

    def __init__(self, file, erase):
        super().__init__(file)
        self._erase = erase
        self._room = 0  # bytes that are left in the block

    def write(self, data):
        self._room -= len(data)
        while self._room < 0:
            self._erase()
            self._room += _BLOCK
        return self._file.write(data)


class FailingFile(_Wrapped):
    """A file of which `length` bytes can be written, then `error` is raised."""

    def __init__(self, file, length, error):
        super().__init__(file)
        self._left, self._error = length, error

    def write(self, data):
        count = self._file.write(data[: self._left])
        self._left -= count
        if count < len(data):
            self._file.flush()
            raise self._error
        return count
