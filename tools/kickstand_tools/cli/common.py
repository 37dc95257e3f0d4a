"""Parts that several commands share: arguments, options, the output of notices on standard error, and progress."""

import contextlib
import json
import sys
import time
from collections.abc import Callable, Iterable, Iterator
from inspect import cleandoc
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click
from rich.console import Console
from rich.progress import Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

from ..common.messages import Message, printable

if TYPE_CHECKING:
    from rich.table import Table

    from ..estimation.alignment import RideFit

Command = Callable[..., Any]
_Result = TypeVar("_Result")
_PATIENCE_S = 1.0  # work that takes less time shows no progress
_WIDTH = 110  # width in columns of a table that is not printed to a terminal


class Time(click.ParamType):
    """A time in a log: 60, 12.5, 1:00 or 1:02:03. A negative time (-1:30) counts from the end of the log."""

    name = "time"

    def convert(self, value: object, param: click.Parameter | None, ctx: click.Context | None) -> float:
        if isinstance(value, float):
            return value
        text = str(value)
        sign, cells = (-1.0, text[1:].split(":")) if text.startswith("-") else (1.0, text.split(":"))
        try:
            numbers = [*(int(cell) for cell in cells[:-1]), float(cells[-1])]
        except ValueError:
            numbers = [-1.0]
        seconds = sum(60**power * number for power, number in enumerate(reversed(numbers)))
        if len(cells) > 3 or min(numbers) < 0 or not seconds < float("inf"):
            self.fail(f"{text!r} is not a time: give seconds such as 60 or 12.5, or minutes and seconds such as 1:00")
        return sign * seconds


TIME = Time()
PATH = click.Path(path_type=Path)
PORT = click.option(
    "--port", help="Serial port of the board, such as COM3 or /dev/ttyACM0. Not needed with only one board."
)
DISPLAY = click.option(
    "--display", type=click.Choice(["lcd", "ssd1306", "sh1106"]), default="lcd", help="The board's display."
)
JSON = click.option("--json", "as_json", is_flag=True, help="Print JSON.")
VEHICLES = click.Choice(["motorcycle", "car"])


def file_argument(name: str, metavar: str, **more: Any) -> Command:
    """Return a decorator that adds an argument for a file's name. more: other arguments of click.argument()."""
    return click.argument(name, type=PATH, metavar=metavar, **more)


def out_option(words: str) -> Command:
    """Return a decorator that adds the required option --out with this help text."""
    return click.option("--out", required=True, type=PATH, help=words)


OUT = out_option("The file to write.")
OUT_LOG = out_option("The log to write, packed if it ends in .gz.")
OUT_DIRECTORY = out_option("The directory to write to.")
RIDE = file_argument("ride", "RIDE.csv")
CALIBRATION = click.option("--calibration", type=PATH, help="A CAL.json. Default: the file beside the ride.")


def from_to(start: str, end: str) -> Command:
    """Return a decorator that adds the options --from and --to, as from_s and to_s, with these help texts."""
    first = click.option("--from", "from_s", type=TIME, metavar="TIME", help=start)
    last = click.option("--to", "to_s", type=TIME, metavar="TIME", help=end)
    return lambda command: first(last(command))


STRETCH = from_to(
    "Where to begin: seconds from the beginning, or 1:30.", "Where to end. A negative time counts from the end."
)


def help_adds(text: str) -> Command:
    """Return a decorator that adds a paragraph to a command's help."""

    def add(command: Command) -> Command:
        command.__doc__ = f"{cleandoc(command.__doc__ or '')}\n\n{text}"
        return command

    return add


def ride_or_export(command: Command) -> Command:
    """Add the argument `ride` to a command: a log, or a recording that `import` can read."""
    words = "An export of a phone's app (file, folder or zip) is imported and aligned first."
    return file_argument("ride", "RIDE.csv|EXPORT")(help_adds(words)(command))


RIGHT_HANDED = help_adds(
    "The axes of the log must be right-handed. At rest, the axis that points up reads +1 g. Rates are right-handed "
    "about their axes."
)


def live(command: Command) -> Command:
    """Add the option --live to a command: it uses the lean that the display showed instead of the smoothed lean."""
    words = "The lean is smoothed: computed from the whole ride, and more exact than the lean that the display showed."
    option = click.option("--live", is_flag=True, help="Use the lean that the display showed, not the smoothed lean.")
    return option(help_adds(words)(command))


def known_to(fit: "RideFit") -> str:
    """Return the standard errors of an alignment by a ride, in words."""
    return f"known to: roll {fit.roll_deg:.1f}, pitch {fit.pitch_deg:.1f}, yaw {fit.yaw_deg:.1f} degrees"


def warn(log: Path | str, notices: Iterable[Message]) -> None:
    """Print a warning for each notice. log: name of the log."""
    for notice in notices:
        warning(f"{log}: {notice.line()}")


def echo(text: object = "", err: bool = False) -> None:
    """Print text. Control characters are made visible, because names of files in a zip may contain them."""
    click.echo(printable(str(text)), err=err)


def warning(text: str) -> None:
    """Print a line on standard error."""
    echo(f"warning: {text}", err=True)


def print_lines(lines: Iterable[str]) -> None:
    for line in lines:
        echo(line)


def show(data: dict[str, Any] | None, *tables: "Table") -> None:
    """Print data as JSON, or else tables. Without a terminal the console is wide enough for a table."""
    if data is not None:
        echo(json.dumps(data))
        return
    console = Console()
    (console if console.is_terminal else Console(width=_WIDTH)).print(*tables)


class Bar:
    """A progress bar, used as `with Bar("replaying", total) as bar: bar.advance(n)`.

    It is shown if standard error is a terminal. If a function reports (done, total), pass bar.reach to it and leave out
    total.

    what: text in front of the bar.
    total: amount of work; None if unknown.
    patience_s: the bar appears at the first progress after this time.
    lines_s: seconds between two lines if standard error is not a terminal; None for no lines.
    """

    def __init__(
        self, what: str, total: int | None = None, patience_s: float = _PATIENCE_S, lines_s: float | None = None
    ) -> None:
        self._progress = Progress(console=Console(stderr=True), transient=True)
        self._task = self._progress.add_task(what, total=total)
        self._patience_s = patience_s
        self._begin_s = self._line_s = time.monotonic()
        self._wanted = sys.stderr.isatty()
        self._shown = False
        self._lines_s = None if self._wanted else lines_s

    def __enter__(self) -> "Bar":
        if self._wanted:
            self._show()
        return self

    def advance(self, amount: int) -> None:
        """Add `amount` to the work done."""
        self._update(advance=amount)

    def reach(self, done: int, total: int) -> None:
        """Set the work done and the total. total: 0 if unknown."""
        self._update(completed=done, total=total or None)

    def reach_in(self, what: str, done: int, total: int) -> None:
        """Set the text, the work done and the total. total: 0 if unknown."""
        self._update(description=what, completed=done, total=total or None)

    def _update(self, **changes: Any) -> None:
        self._progress.update(self._task, **changes)
        self._show()

    def _show(self) -> None:
        now_s = time.monotonic()
        if self._wanted and not self._shown and now_s - self._begin_s >= self._patience_s:
            self._progress.start()
            self._shown = True
        if self._lines_s is not None and now_s - self._line_s >= self._lines_s:
            self._line_s = now_s
            task = self._progress.tasks[0]
            print(f"{task.description}: {task.percentage:.0f} %", file=sys.stderr, flush=True)

    def __exit__(self, *_: object) -> None:
        if self._shown:
            self._progress.stop()


def with_bar(what: str, function: Callable[..., _Result], *arguments: Any, **options: Any) -> _Result:
    """Call a function that has the parameter `progress`, and show a progress bar meanwhile."""
    with Bar(what) as bar:
        return function(*arguments, progress=bar.reach, **options)


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
