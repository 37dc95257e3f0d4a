"""A standard error that claims to be a terminal."""

import io

from support import command


class Watched(io.StringIO):
    """A stream that claims to be a terminal. Writing fails after closed_after characters."""

    closed_after = 10**9

    def isatty(self) -> bool:
        return True

    def write(self, text: str) -> int:
        if self.tell() > self.closed_after:
            raise OSError(5, "Input/output error")
        return super().write(text)


def watched(monkeypatch, terminal: Watched, *arguments: object) -> str:
    """Run a command that must succeed. Return its output to this terminal."""
    monkeypatch.setenv("TERM", "xterm")
    return command.works(*arguments, err=terminal).err
