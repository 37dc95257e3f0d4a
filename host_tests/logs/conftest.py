"""Logs as text, and the sizes of the blocks in which they are read."""

import io

import pytest
from kickstand_tools.logs import reader
from support import command


@pytest.fixture
def small_blocks(monkeypatch):
    """Return a function that makes the blocks of a log small: bytes of text, and samples of a log in memory."""

    def limit(size: int, samples: int = 55) -> None:
        monkeypatch.setattr(reader, "BLOCK_BYTES", size)
        monkeypatch.setattr(reader, "BLOCK_SAMPLES", samples)

    return limit


@pytest.fixture
def text_log():
    """Return a function that makes an open log of rows. more: the names of further columns."""

    def open_log(*rows: str, more: str = "") -> io.BytesIO:
        return io.BytesIO("".join(f"{line}\n" for line in (command.HEADER + more, *rows)).encode())

    return open_log
