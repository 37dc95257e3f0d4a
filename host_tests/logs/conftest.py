"""Logs as text, and the size of the chunks in which they are read."""

import io

import pytest
from kickstand_tools.logs import reader
from support import command


@pytest.fixture
def small_chunks(monkeypatch):
    """Return a function that sets the bytes of text that are read at once."""
    return lambda size: monkeypatch.setattr(reader, "CHUNK_BYTES", size)


@pytest.fixture
def text_log():
    """Return a function that makes an open log of rows. more: the names of further columns."""

    def open_log(*rows: str, more: str = "") -> io.BytesIO:
        return io.BytesIO("".join(f"{line}\n" for line in (command.HEADER + more, *rows)).encode())

    return open_log
