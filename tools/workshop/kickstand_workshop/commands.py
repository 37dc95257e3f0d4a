"""The commands that the workshop adds to `kickstand`: evaluate and bench."""

import contextlib
import json
from pathlib import Path

import click
from kickstand_tools.cli.common import warn
from kickstand_tools.cli.simulated import LINES_S, PROFILES, UPRIGHT_ERROR

_PATH = click.Path(path_type=Path)
_WIDTH = 110  # columns of a table that is not printed to a terminal


@click.command(short_help="Compare the shown lean with the truth of simulated rides.")
@click.option("--profiles", default="street,track,sweeper,city,hills", help=f"With commas between: {PROFILES}.")
@click.option("--seeds", type=click.IntRange(min=1), default=3, help="Rides of each profile.")
@click.option(
    "--seconds",
    type=click.FloatRange(min=60.0, max=7200.0),
    default=640.0,
    help="Of riding, each; start and stop come on top.",
)
@UPRIGHT_ERROR
@click.option("--pitch-change", type=click.FloatRange(-10.0, 10.0), default=1.0, help="Between the two poses, degrees.")
@click.option("--recording", type=_PATH, help="A recorded ride with speed to compare on too.")
@click.option("--out", type=_PATH, help="Write evaluation.json and lean.png to this directory.")
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
def evaluate(
    profiles: str,
    seeds: int,
    seconds: float,
    upright_error: float,
    pitch_change: float,
    recording: Path | None,
    out: Path | None,
    as_json: bool,
) -> None:
    """Compare the shown lean and other filters with the truth of simulated rides."""
    from kickstand_tools.errors import extra
    from kickstand_tools.output import check_directory, new_directory
    from kickstand_tools.progress import Bar
    from rich.console import Console

    from .evaluation import picture, report, runs
    from .evaluation.estimators import missing
    from .evaluation.evaluate import evaluate

    names = [name.strip() for name in profiles.split(",")]
    jobs = runs.jobs(names, seeds, seconds, upright_error, pitch_change, traces=out is not None)
    if out is not None:
        picture.check()
        check_directory(out)
    absent = missing()
    if absent:
        click.echo(f"left out, not installed: {', '.join(absent)}: {extra('evaluate')}", err=True)
    with new_directory(out) if out is not None else contextlib.nullcontext():
        with Bar("riding", len(jobs) * runs.steps(), patience_s=0.0, lines_s=LINES_S) as bar:
            found = evaluate(jobs, recording, lambda: bar.advance(1))
        for result in found.results:
            if result.refusal is not None:
                where = f"{result.job.profile}, seed {result.job.seed}"
                click.echo(f"{where}, not calibrated: {result.refusal}", err=True)
        warn(str(recording), found.recorded.notices if found.recorded else ())
        if as_json:
            click.echo(json.dumps(report.document(found), indent=2))
        else:
            console = Console()
            console = console if console.is_terminal else Console(width=_WIDTH)
            console.print(report.table(found.results))
            if found.recorded:
                console.print(report.real_table(found.recorded.scores, found.recorded.name))
        if out is not None:
            figures, drawing = report.write(found, out)
            click.echo(f"written: {figures} and {drawing}", err=True)


@click.command(short_help="Time, memory and flash of the firmware on an emulated Pico.")
@click.option("--seconds", type=click.IntRange(1, 600), default=10, help="Emulated, of each of four runs.")
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
def bench(seconds: int, as_json: bool) -> None:
    """What the firmware costs on an emulated Pico: time, memory, flash."""
    from kickstand_tools.emulator import image, native
    from kickstand_tools.progress import spinner

    image.find()  # before anything else of the emulator is imported
    with spinner("compiling the emulator, once"):
        native.build()
    from rich.console import Console

    from .bench.bench import bench, tables

    result = bench(seconds)
    if as_json:
        click.echo(json.dumps(result))
    else:
        Console().print(tables(result))


COMMANDS = (evaluate, bench)
