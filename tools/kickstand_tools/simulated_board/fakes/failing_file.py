"""A file on a flash that is full, or whose supply is cut."""


class FailingFile:
    """A file of which `length` bytes can be written, then `error` is raised."""

    def __init__(self, file, length, error):
        self._file, self._left, self._error = file, length, error

    def write(self, data):
        count = self._file.write(data[: self._left])
        self._left -= count
        if count < len(data):
            self._file.flush()
            raise self._error
        return count

    def flush(self):
        self._file.flush()

    def close(self):
        self._file.close()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self._file.close()
