"""A standard error that claims to be a terminal."""

import io

from support import command


class Watched(io.StringIO):
    """A stream that claims to be a terminal."""

    def isatty(self) -> bool:
        return True


def watched(monkeypatch, terminal: Watched, *arguments: object) -> str:
    """Run a command that must succeed. Return its output to this terminal."""
    monkeypatch.setenv("TERM", "xterm")
    return command.works(*arguments, err=terminal).err
