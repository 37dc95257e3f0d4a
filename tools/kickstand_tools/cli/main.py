"""The `kickstand` command. What it refuses: one line on standard error, status 2, nothing written."""

import json
import sys
from pathlib import Path

import click

from ..errors import InputError
from . import board, simulated, without_a_board

_PATH = click.Path(path_type=Path)
_OUT = click.option("--out", required=True, type=_PATH, help="The file to write.")


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


for _command in board.flash, board.status, board.pull, board.record:
    kickstand.add_command(_command)
kickstand.add_command(simulated.simulate)
kickstand.add_command(simulated.evaluate)
kickstand.add_command(without_a_board.demo)
kickstand.add_command(without_a_board.emulate)
kickstand.add_command(without_a_board.bench)


@kickstand.group(no_args_is_help=False)
def calibrate() -> None:
    """Compute a calibration from recorded poses or drives."""


@calibrate.command()
@click.argument("poses", nargs=-1, required=True, type=_PATH, metavar="POSE.csv...")
@_OUT
def six(poses: tuple[Path, ...], out: Path) -> None:
    """Accelerometer offset and slope from six still poses, each side up once, in any order.

    A seventh, slanted pose checks the result.
    """
    from ..calibration import poses as captured
    from ..calibration.file import write_calibration
    from ..output import check_output

    check_output(out, list(poses))
    write_calibration(out, captured.six(list(poses), click.echo))
    click.echo(f"written: {out}")


@calibrate.command()
@click.argument("kickstand", type=_PATH, metavar="KICKSTAND.csv")
@click.argument("upright", type=_PATH, metavar="UPRIGHT.csv")
@click.option("--calibration", type=_PATH, help="The result of `kickstand calibrate six`, to build on.")
@click.option(
    "--side", type=click.Choice(["left", "right"]), default="left", help="Where the kickstand leans to."
)
@_OUT
def two(kickstand: Path, upright: Path, calibration: Path | None, side: str, out: Path) -> None:
    """How the sensor sits on the bike, from a pose on the kickstand and one upright."""
    from ..calibration import poses as captured
    from ..calibration.file import read_calibration, write_calibration
    from ..output import check_output

    check_output(out, [kickstand, upright])
    before = read_calibration(calibration) if calibration else None
    write_calibration(out, captured.two(kickstand, upright, before, side, click.echo))
    click.echo(f"written: {out}")


@calibrate.command()
@click.argument("logs", nargs=-1, required=True, type=_PATH, metavar="LOG.csv...")
@click.option(
    "--calibration", type=_PATH, help="What is known already: six positions, and a motorcycle's two poses."
)
@click.option(
    "--vehicle",
    type=click.Choice(["motorcycle", "car"]),
    help="motorcycle if the calibration has two poses, else car, if not given.",
)
@click.option("--method", type=click.Choice(["improved", "published"]), default="improved")
@_OUT
def drive(
    logs: tuple[Path, ...], calibration: Path | None, vehicle: str | None, method: str, out: Path
) -> None:
    """How the sensor sits on the vehicle, from logs of driving with speed: stops and straight brakings."""
    from ..calibration import drive, poses
    from ..calibration.file import read_calibration, write_calibration
    from ..output import check_output

    check_output(out, list(logs))
    poses.refuse_same_file(list(logs))
    before = read_calibration(calibration) if calibration else None
    write_calibration(out, drive.drive(list(logs), before, vehicle, method, click.echo))
    click.echo(f"written: {out}")


@kickstand.command()
@click.argument("log", type=_PATH, metavar="LOG.csv")
@click.option("--calibration", required=True, type=_PATH, help="A CAL.json of `kickstand calibrate`.")
@click.option("--engine", type=click.Choice(["cpython", "micropython", "rp2040"]), default="cpython")
@_OUT
def replay(log: Path, calibration: Path, engine: str, out: Path) -> None:
    """Run the firmware's own lean meter over a recorded log."""
    from ..calibration.file import read_calibration
    from ..output import check_output
    from ..replay import replay

    check_output(out, [log, calibration])
    parameters = read_calibration(calibration)
    count = replay.replay(log, parameters, engine, out)
    if not parameters.aligned:
        click.echo(
            f"warning: {calibration} is not aligned: this is the lean of the sensor, not of the bike",
            err=True,
        )
    click.echo(f"written: {out}, {count} samples")


_CALIBRATION = click.option(
    "--calibration", type=_PATH, help="A CAL.json; if not given, the one beside the ride."
)


@kickstand.command()
@click.argument("ride", type=_PATH, metavar="RIDE.csv")
@click.option("--to", "form", required=True, type=click.Choice(["csv", "vbo", "racechrono", "parquet"]))
@_CALIBRATION
@_OUT
def export(ride: Path, form: str, calibration: Path | None, out: Path) -> None:
    """Write a ride as Circuit Tools (vbo), RaceChrono or data frames (parquet, csv) open it."""
    from ..analysis.channels import open_ride
    from ..analysis.export.export import export
    from ..output import check_output

    check_output(out, [ride, *([calibration] if calibration else [])])
    count = export(open_ride(ride, calibration), form, out)
    click.echo(f"written: {out}, {count} rows")


@kickstand.command()
@click.argument("ride", type=_PATH, metavar="RIDE.csv")
@_CALIBRATION
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
def report(ride: Path, calibration: Path | None, as_json: bool) -> None:
    """A ride in a page: maxima, time at large leans, and each stop as a brake test has it."""
    from rich.console import Console

    from ..analysis.channels import open_ride
    from ..analysis.look import look
    from ..analysis.report import as_data, page

    seen = look(open_ride(ride, calibration))
    if as_json:
        click.echo(json.dumps(as_data(seen)))
    else:
        Console().print(page(seen))


@kickstand.command()
@click.argument("ride", type=_PATH, metavar="RIDE.csv")
@_CALIBRATION
@click.option("--out", required=True, type=_PATH, help="The directory to write to.")
def plot(ride: Path, calibration: Path | None, out: Path) -> None:
    """Draw a ride: a picture (PNG) and a page to zoom into (HTML)."""
    from ..analysis.channels import open_ride
    from ..analysis.look import look
    from ..analysis.plot import plot

    plot.check(out)
    seen = look(open_ride(ride, calibration))
    for path in plot.draw(seen, out):
        click.echo(f"written: {path}")
    if seen.exchanged:
        click.echo(f"warning: {ride}: {seen.exchanged}", err=True)


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
