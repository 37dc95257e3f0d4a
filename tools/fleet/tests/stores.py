"""A store of files in memory that fails on demand, for fsspec: a full or forbidden place, and marks of its files."""

from typing import Any

import fsspec
from fsspec.implementations.memory import MemoryFileSystem


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

    def cat_file(self, path, *arguments, **options):
        self._check(path)
        return super().cat_file(path, *arguments, **options)

    def pipe_file(self, path, value, *arguments, **options):
        self._check(path)
        return super().pipe_file(path, value, *arguments, **options)

    def put_file(self, lpath, rpath, *arguments, **options):
        self._check(rpath)
        return super().put_file(lpath, rpath, *arguments, **options)

    def glob(self, path, *arguments, **options):
        self._check(path)
        return super().glob(path, *arguments, **options)

    def ls(self, path, detail=True, **options):
        self._check(path)
        entries: Any = super().ls(path, detail=True, **options)
        return [entry | self.marks for entry in entries]


fsspec.register_implementation("failing", FailingStore, clobber=True)
fsspec.register_implementation("absent", "no_such_library.Store", clobber=True)
