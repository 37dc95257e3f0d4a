"""A line on standard error that is drawn again and again, if standard error is a terminal."""

import contextlib
import sys
from types import TracebackType

from rich.console import Console
from rich.live import Live


class LiveLine:
    """with LiveLine() as line: line.show(text). A terminal that is closed meanwhile is no error: the work goes on."""

    def __init__(self) -> None:
        self.watched = sys.stderr.isatty()
        console = Console(stderr=True) if self.watched else Console(quiet=True)
        self._live = Live(console=console, auto_refresh=False, transient=True)

    def __enter__(self) -> "LiveLine":
        self._live.start()
        return self

    def show(self, text: str) -> None:
        """Draw text in the place of the one before."""
        with contextlib.suppress(OSError):
            self._live.update(text, refresh=True)

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        with contextlib.suppress(OSError):
            self._live.stop()
