"""Standard error that someone watches."""

import io

import command


class Watched(io.StringIO):
    """closed_after: so many characters can be written to it, then it is gone."""

    closed_after = 10**9

    def isatty(self) -> bool:
        return True

    def write(self, text: str) -> int:
        if self.tell() > self.closed_after:
            raise OSError(5, "Input/output error")
        return super().write(text)


def watched(monkeypatch, terminal: Watched, *arguments: object) -> str:
    """What someone sees of a command that works."""
    monkeypatch.setenv("TERM", "xterm")
    return command.works(*arguments, err=terminal).err
