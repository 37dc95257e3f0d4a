"""The command `kickstand`. If it refuses an input, it prints one line on standard error and writes no file.

The exit status is then 2.
"""

import contextlib
import os
import signal
import sys
import threading
from collections.abc import Iterator
from importlib.metadata import EntryPoint

import click

from ..common import installation
from ..common.installation import DISTRIBUTION
from ..common.messages import InputError, cause, printable
from . import added

# The commands of each module, which contains the functions NAME_command. A module is imported only if one of its
# commands runs, because most modules import numpy, which takes long. The list of commands reads their docstrings.
MODULES = {
    "board": ("check", "flash", "pull", "record", "status"),
    "calibrate": ("calibrate",),
    "ride": ("compare", "cut", "export", "import", "join", "overlay", "plot", "replay", "report", "smooth"),
    "simulated": ("simulate",),
    "without_a_board": ("demo", "try", "web"),
}
COMMANDS = {
    name: EntryPoint(name, f"kickstand_tools.cli.{module}:{name}_command", added.GROUP)
    for module, names in MODULES.items()
    for name in names
}


class CommandGroup(click.Group):
    """The commands of COMMANDS, and commands of other packages (see added.py)."""

    def list_commands(self, ctx: click.Context | None) -> list[str]:
        return sorted(COMMANDS.keys() | added.entry_points().keys())

    def get_command(self, ctx: click.Context | None, cmd_name: str) -> click.Command | None:
        if cmd_name in COMMANDS:
            return COMMANDS[cmd_name].load()
        entry_point = added.entry_points().get(cmd_name)
        if entry_point is None and cmd_name in installation.LEAVES:
            raise installation.not_installed(cmd_name)
        return added.command(entry_point) if entry_point else None

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        commands = added.entry_points() | COMMANDS
        with formatter.section("Commands"):
            formatter.write_dl([(name, added.help_line(commands[name])) for name in sorted(commands)])


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
        _refuse(f"unexpected {type(error).__name__}: {error}: a fault in {added.owner(error)}, please report it")


def _remedy(error: OSError) -> str:
    """Return the remedy for an error of the operating system, as part of a message."""
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


if __name__ == "__main__":
    main()
