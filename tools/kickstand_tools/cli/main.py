"""The `kickstand` command. What it refuses: one line on standard error, status 2, nothing written."""

import importlib
import importlib.util
import pkgutil
import sys
from collections.abc import Iterator

import click

from ..errors import InputError, cause
from . import board, calibrate, calibrate_ride, fleet, import_, join, overlay, ride, simulated, without_a_board


@click.group(
    invoke_without_command=True,
    context_settings={"help_option_names": ["-h", "--help"], "show_default": True},
)
@click.version_option(package_name="kickstand")
@click.pass_context
def kickstand(context: click.Context) -> None:
    """Lean meter for any motorcycle: put it on a board, calibrate it, replay rides."""
    if context.invoked_subcommand is None:
        click.echo(context.get_help())


def _added() -> Iterator[click.Command]:
    """What other packages add: the COMMANDS of the module `commands` of each that is named kickstand_..."""
    for package in pkgutil.iter_modules():
        if package.name.startswith("kickstand_") and package.name != __name__.partition(".")[0]:
            if importlib.util.find_spec(package.name + ".commands"):
                yield from importlib.import_module(package.name + ".commands").COMMANDS


for _command in (
    *(board.flash, board.status, board.pull, board.record),
    *(import_.import_, join.join, calibrate.calibrate, ride.replay, ride.smooth, ride.report, ride.plot, ride.export),
    *(ride.cut, overlay.overlay),
    *(fleet.fleet, simulated.simulate),
    *(without_a_board.demo, without_a_board.web, without_a_board.emulate),
    *_added(),
):
    kickstand.add_command(_command)
calibrate.calibrate.add_command(calibrate_ride.ride)


def main(arguments: list[str] | None = None) -> None:
    """The console script: runs a command and leaves with its exit status."""
    try:
        sys.exit(kickstand.main(arguments, prog_name="kickstand", standalone_mode=False))
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
        _refuse(f"{about}{cause(error)}: check the disk, the file or the connection, then repeat this")
    except MemoryError:
        _refuse("this takes more memory than there is: give a part of it, or close other programs")
    except UnicodeError as error:
        _refuse(f"a name or a text is not in the letters that it should be in ({error}): rename the file")
    except Exception as error:
        if sys.flags.dev_mode:  # python -X dev: for whoever looks for the fault
            raise
        _refuse(f"unexpected {type(error).__name__}: {error}: a fault in kickstand, please report it")


def _refuse(text: str, status: int = 2) -> None:
    """Leave with one printable line on standard error."""
    line = " ".join(text.split())
    print("kickstand: " + "".join(c if c.isprintable() else ascii(c)[1:-1] for c in line), file=sys.stderr)
    sys.exit(status)


if __name__ == "__main__":
    main()
