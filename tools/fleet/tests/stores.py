"""A store of files in memory that fails on demand, for fsspec: a full or forbidden place, and marks of its files."""

from typing import Any

import fsspec
from fsspec.implementations.memory import MemoryFileSystem


def _checked(name, place=0):
    """Return a method that checks the path, its argument number `place`."""

    def checked(self, *arguments, **options):
        self._check(arguments[place])
        return getattr(MemoryFileSystem, name)(self, *arguments, **options)

    return checked


class FailingStore(MemoryFileSystem):
    """A store at failing://. refused: part of a path. Access to such a path raises `error`.

    marks: additional entries of each file in a listing.
    """

    protocol = "failing"
    store: dict[str, Any] = {}
    pseudo_dirs = [""]
    refused, error, marks = "", None, {}

    @classmethod
    def fail(cls, refused="", error: Exception | None = None):
        cls.refused, cls.error = refused, error

    @classmethod
    def clear(cls):
        cls.fail()
        cls.store.clear()
        cls.pseudo_dirs[:] = [""]
        cls.marks = {}

    @classmethod
    def _strip_protocol(cls, path):
        return super()._strip_protocol(str(path).replace("failing://", "memory://"))

    def _check(self, path):
        if self.error and self.refused in path:
            raise self.error

    cat_file, pipe_file, glob = map(_checked, ("cat_file", "pipe_file", "glob"))
    put_file = _checked("put_file", 1)

    def ls(self, path, detail=True, **options):
        self._check(path)
        entries: Any = super().ls(path, detail=True, **options)
        return [entry | self.marks for entry in entries]


fsspec.register_implementation("failing", FailingStore, clobber=True)
fsspec.register_implementation("absent", "no_such_library.Store", clobber=True)
