"""Shows a progress bar or a spinner during work that takes over a second, if standard error is a terminal.

If standard error is not a terminal, long work can print lines of progress instead (see lines_s of Bar).
"""

import contextlib
import sys
import time
from collections.abc import Iterator

from rich.console import Console
from rich.progress import Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

PATIENCE_S = 1.0


class Bar:
    """A progress bar, used as `with Bar("replaying", total) as bar: bar.advance(n)`.

    If a function reports (done, total), pass bar.reach to it and leave out total.

    what: text in front of the bar.
    total: amount of work; None if unknown.
    patience_s: the bar appears at the first progress after this time.
    lines_s: seconds between two lines if standard error is not a terminal; None for no lines.
    """

    def __init__(
        self, what: str, total: int | None = None, patience_s: float = PATIENCE_S, lines_s: float | None = None
    ) -> None:
        self._progress = Progress(console=Console(stderr=True), transient=True)
        self._task = self._progress.add_task(what, total=total)
        self._patience_s = patience_s
        self._begin_s = time.monotonic()
        self._wanted = sys.stderr.isatty()
        self._shown = False
        self._lines_s = None if self._wanted else lines_s
        self._said_s = self._begin_s

    def __enter__(self) -> "Bar":
        if self._wanted:
            self._show()
        return self

    def advance(self, amount: int) -> None:
        """Add `amount` to the work done."""
        self._progress.advance(self._task, amount)
        self._show()

    def reach(self, done: int, total: int) -> None:
        """Set the work done and the total. total: 0 if unknown."""
        self._progress.update(self._task, completed=done, total=total or None)
        self._show()

    def _show(self) -> None:
        if self._wanted and not self._shown and time.monotonic() - self._begin_s >= self._patience_s:
            self._progress.start()
            self._shown = True
        if self._lines_s is not None and time.monotonic() - self._said_s >= self._lines_s:
            self._said_s = time.monotonic()
            task = self._progress.tasks[0]
            print(f"{task.description}: {task.percentage:.0f} %", file=sys.stderr, flush=True)

    def describe(self, what: str) -> None:
        """Change the text in front of the bar."""
        self._progress.update(self._task, description=what)

    def reach_in(self, what: str, done: int, total: int) -> None:
        """Set the text, the work done and the total. total: 0 if unknown."""
        self.describe(what)
        self.reach(done, total)

    def __exit__(self, *_: object) -> None:
        if self._shown:
            self._progress.stop()


@contextlib.contextmanager
def spinner(what: str) -> Iterator[None]:
    """Show a spinner during work whose progress is unknown."""
    if not sys.stderr.isatty():
        yield
        return
    columns = SpinnerColumn(), TextColumn("{task.description}"), TimeElapsedColumn()
    with Progress(*columns, console=Console(stderr=True), transient=True) as progress:
        progress.add_task(what)
        yield
