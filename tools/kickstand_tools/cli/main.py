"""The `kickstand` command. What it refuses: one line on standard error, status 2, nothing written."""

import json
import sys
from pathlib import Path

import click

from ..errors import InputError
from . import calibrate, ride, simulated

_PATH = click.Path(path_type=Path)
_OUT = click.option("--out", required=True, type=_PATH, help="The file to write.")
_PORT = click.option(
    "--port", help="Serial port of the board, as COM3 or /dev/ttyACM0; found by itself if only one is there."
)


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


for _command in (calibrate.calibrate, ride.replay, ride.report, ride.plot, ride.export):
    kickstand.add_command(_command)
kickstand.add_command(simulated.simulate)
kickstand.add_command(simulated.evaluate)


@kickstand.command()
@_PORT
@click.option("--config", is_flag=True, help="Replace the board's config.py too, which is otherwise kept.")
def flash(port: str | None, config: bool) -> None:
    """Copy the firmware to a board that runs MicroPython, check it, and start it."""
    from ..deploy import flash

    flash.flash(port, config, click.echo)


@kickstand.command()
@_PORT
def status(port: str | None) -> None:
    """Ask a board how it is: versions, settings, sensor, display, calibration."""
    from ..deploy import flash

    flash.status(port, click.echo)


@kickstand.command()
@_PORT
@click.option("--out", type=_PATH, default=Path(), help="The directory to write to; this one if not given.")
@click.option("--delete", is_flag=True, help="Remove from the board what came over whole.")
def pull(port: str | None, out: Path, delete: bool) -> None:
    """Fetch the rides that a board has recorded, as logs with their calibration."""
    from ..rides import pull

    pull.pull(port, out, delete, click.echo, lambda line: click.echo(f"warning: {line}", err=True))


@kickstand.command()
@_PORT
@_OUT
def record(port: str | None, out: Path) -> None:
    """Write a log live over USB until Ctrl-C; the board's display goes on."""
    from ..rides import record

    record.record(port, out, click.echo, lambda line: click.echo(f"warning: {line}", err=True))


@kickstand.command()
@click.option("--hand", is_flag=True, help="Lean the bike and press the button yourself, with keys.")
@click.option("--cpython", is_flag=True, help="Run the firmware on CPython, not on MicroPython.")
def demo(hand: bool, cpython: bool) -> None:
    """Watch the firmware on a simulated board: kickstand press, upright press, a ride."""
    from ..demo import demo

    demo.demo(hand, cpython)


@kickstand.command()
@click.option("--port", type=click.IntRange(1024, 65535), default=2040, help="On which mpremote finds it.")
def emulate(port: int) -> None:
    """An emulated Pico on socket://127.0.0.1:PORT, with sensor, display and button on a simulated bike."""
    from ..emulator import image

    image.find()
    from ..emulator.emulate import emulate

    emulate(port, click.echo)


@kickstand.command()
@click.option("--seconds", type=click.IntRange(1, 600), default=10, help="Emulated, of each of four runs.")
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
def bench(seconds: int, as_json: bool) -> None:
    """What the firmware costs on an emulated Pico: time, memory, flash."""
    from ..emulator import image

    image.find()
    from rich.console import Console

    from ..bench.bench import bench, tables

    result = bench(seconds)
    if as_json:
        click.echo(json.dumps(result))
    else:
        Console().print(tables(result))


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
