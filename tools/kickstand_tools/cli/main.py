"""The command `kickstand`. If it refuses an input, it prints a line on standard error, writes no file and exits with 2.

Other packages add commands, which are click.Command objects, by entry points. For example, in pyproject.toml:

    [project.entry-points."kickstand.commands"]
    laps = "my_package.laps:laps_command"

A module is only imported if one of its commands runs, because most modules import numpy, which takes long. The list of
commands reads the help line in the text of the module.
"""

import ast
import contextlib
import functools
import os
import signal
import sys
import threading
import traceback
from collections.abc import Iterator
from importlib.machinery import PathFinder
from importlib.metadata import EntryPoint
from pathlib import Path

import click

from ..common import installation
from ..common.installation import DISTRIBUTION
from ..common.messages import InputError, cause, printable

GROUP = "kickstand.commands"
# The commands of each module, which contains the functions NAME_command
MODULES = {
    "board": ("check", "flash", "pull", "record", "status"),
    "calibrate": ("calibrate",),
    "ride": ("compare", "cut", "export", "import", "join", "overlay", "plot", "replay", "report", "smooth"),
    "simulated": ("demo", "simulate", "try", "web"),
}
COMMANDS = {
    name: EntryPoint(name, f"kickstand_tools.cli.{module}:{name}_command", GROUP)
    for module, names in MODULES.items()
    for name in names
}


class CommandGroup(click.Group):
    """The commands of COMMANDS, and commands of other packages with other names."""

    def list_commands(self, ctx: click.Context | None) -> list[str]:
        return sorted(COMMANDS.keys() | _added().keys())

    def get_command(self, ctx: click.Context | None, cmd_name: str) -> click.Command | None:
        if cmd_name in COMMANDS:
            return COMMANDS[cmd_name].load()
        entry_point = _added().get(cmd_name)
        if entry_point is None and cmd_name in installation.LEAVES:
            raise installation.not_installed(cmd_name)
        return _loaded(entry_point) if entry_point else None

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        commands = _added() | COMMANDS
        with formatter.section("Commands"):
            formatter.write_dl([(name, _help_line(commands[name])) for name in sorted(commands)])


@click.group(
    cls=CommandGroup,
    invoke_without_command=True,
    context_settings={"help_option_names": ["-h", "--help"], "show_default": True},
)
@click.version_option(package_name=DISTRIBUTION)
@click.pass_context
def kickstand(context: click.Context) -> None:
    """Lean meter for any motorcycle: install it on a board, calibrate it, replay rides."""
    if context.invoked_subcommand is None:
        click.echo(context.get_help())


def _added() -> dict[str, EntryPoint]:
    """Return the entry points of the commands that packages add, by the command's name."""
    return installation.entry_points(GROUP)


def _loaded(entry_point: EntryPoint) -> click.Command:
    """Load the command of an entry point. Raises InputError, which names the package, if loading fails."""
    try:
        loaded = installation.load(entry_point)
    except InputError:
        raise
    except (Exception, SystemExit) as error:
        raise _refusal(entry_point, f"{type(error).__name__}: {cause(error)}") from error
    if not isinstance(loaded, click.Command):
        raise _refusal(entry_point, f"{entry_point.value} is not a click command")
    return loaded


def _help_line(entry_point: EntryPoint) -> str:
    """Return the help line of a command: its short_help, or the first sentence of its docstring.

    The module is loaded only if its text does not define the command as a function. An error of loading is the help.
    """
    try:
        written = _written_help(entry_point)
    except (AttributeError, OSError, SyntaxError, ValueError):  # the error of loading the module says more
        written = None
    try:
        loaded = written or _loaded(entry_point)
        return loaded.get_short_help_str(limit=80)
    except InputError as error:
        return str(error)


def _written_help(entry_point: EntryPoint) -> click.Command | None:
    """Find the help of a command in the text of its module. Returns a command without options, or None."""
    package, *names = entry_point.module.split(".")
    spec = PathFinder.find_spec(package)
    folders = spec and spec.submodule_search_locations
    file = Path(folders[0], *names).with_suffix(".py") if folders and names else Path((spec and spec.origin) or "")
    if not file.is_file():
        return None
    node = _functions(file.read_bytes()).get(entry_point.attr)
    if node is None:
        return None
    calls = [call for call in node.decorator_list if ast.unparse(call).startswith(("click.command(", "click.group("))]
    if not calls:
        return None
    keywords = [word for call in calls if isinstance(call, ast.Call) for word in call.keywords]
    texts = {word.arg: ast.literal_eval(word.value) for word in keywords if word.arg in ("help", "short_help")}
    return click.Command(node.name, help=texts.get("help", ast.get_docstring(node)), short_help=texts.get("short_help"))


@functools.cache  # most modules define several commands
def _functions(text: bytes) -> dict[str, ast.FunctionDef]:
    return {node.name: node for node in ast.parse(text).body if isinstance(node, ast.FunctionDef)}


def _owner(error: Exception) -> str:
    """Return the name of the package that added the running command, which has failed, or "kickstand"."""
    # The attribute `module` of an entry point raises an error if its value is invalid
    tops = {entry_point: entry_point.value.partition(":")[0].partition(".")[0] for entry_point in _added().values()}
    packages = {top: _package(entry_point) for entry_point, top in tops.items()}
    for frame, _ in traceback.walk_tb(error.__traceback__):
        package = packages.get(frame.f_globals.get("__name__", "").partition(".")[0], DISTRIBUTION)
        if package not in installation.OURS:
            return package
    return "kickstand"


def _package(entry_point: EntryPoint) -> str:
    return entry_point.dist.name if entry_point.dist else entry_point.value


def _refusal(entry_point: EntryPoint, reason: str) -> InputError:
    name, package = entry_point.name, _package(entry_point)
    command_text = f"the command {name} of the package {package}"
    return InputError(f"{command_text} cannot be loaded ({reason}): update or uninstall it")


def main(arguments: list[str] | None = None) -> None:
    """Run a command and exit with its status. This is the console script."""
    # Limit numpy to one thread, before a command imports it. The matrices are small, so more threads would only double
    # the processor time
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    try:
        with _ended_by_signals():
            sys.exit(kickstand.main(arguments, prog_name="kickstand", standalone_mode=False))
    except _Ended as ended:
        _refuse("stopped", 128 + ended.number)
    except InputError as error:
        _refuse(str(error))
    except click.Abort:
        _refuse("stopped", 130)
    except click.UsageError as error:
        command = error.ctx.command_path if error.ctx else "kickstand"
        message = error.format_message()
        _refuse(f"{message}{'' if message.endswith(('.', '?')) else '.'} See {command} --help.")
    except click.ClickException as error:
        _refuse(error.format_message())
    except OSError as error:
        about = f"{error.filename}: " if error.filename else ""
        _refuse(f"{about}{cause(error)}: {_remedy(error)}")
    except MemoryError:
        _refuse("not enough memory: use a shorter part of the log, or close other programs")
    except RecursionError:
        _refuse("the data in a file is nested too deeply: the file is damaged, or not meant for this command")
    except UnicodeError as error:
        _refuse(f"a file name or a text has characters that cannot be used here ({error}): rename the file")
    except Exception as error:
        if sys.flags.dev_mode:  # python -X dev shows the traceback for debugging
            raise
        _refuse(f"unexpected {type(error).__name__}: {error}: a fault in {_owner(error)}, please report it")


def _remedy(error: OSError) -> str:
    if error.filename and isinstance(error, FileNotFoundError | NotADirectoryError):
        return "check the name and its directory"
    if error.filename and isinstance(error, IsADirectoryError):
        return "give the name of a file"
    return "check the disk, the file or the connection, then repeat this"


class _Ended(BaseException):
    """A signal asked this program to end. number: number of the signal."""

    def __init__(self, number: int) -> None:
        super().__init__(number)
        self.number = number


@contextlib.contextmanager
def _ended_by_signals() -> Iterator[None]:
    """A context in which `kill` and a closed terminal raise _Ended, so temporary files are removed."""

    def end(number: int, _frame: object) -> None:
        raise _Ended(number)

    handlers = {}
    if threading.current_thread() is threading.main_thread():
        names = ("SIGTERM", "SIGHUP")  # Windows has no SIGHUP, and nohup ignores it
        numbers = [getattr(signal, name) for name in names if hasattr(signal, name)]
        handlers = {n: signal.signal(n, end) for n in numbers if signal.getsignal(n) == signal.SIG_DFL}
    try:
        yield
    finally:
        for number, handler in handlers.items():
            signal.signal(number, handler)


def _refuse(text: str, status: int = 2) -> None:
    """Exit with one printable line on standard error."""
    line = " ".join(text.split())
    print("kickstand: " + printable(line), file=sys.stderr)
    sys.exit(status)
