"""The commands that simulate rides: simulate, which writes one, and evaluate, which judges the lean on many."""

import contextlib
import json
from pathlib import Path
from typing import Any

import click
from rich.console import Console

from ..errors import InputError, extra
from ..evaluation import picture, report, runs
from ..evaluation.estimators import missing
from ..evaluation.evaluate import evaluate
from ..output import check_directory, new_directory
from ..progress import Bar, spinner
from ..simulation.files import simulate
from ..simulation.fleet.fleet import make_fleet
from ..simulation.profiles import MAIN, PROFILES
from .common import JSON, OUT_DIRECTORY, PATH, Command, warn

_LINES_S = 10.0  # between two lines of progress where there is no terminal for a bar
_WIDTH = 110  # columns of a table that is not printed to a terminal
_PROFILES = f"{', '.join(MAIN)}; hard ones: {', '.join(name for name in PROFILES if name not in MAIN)}."


def _seconds(least: float, words: str) -> Command:
    return click.option("--seconds", type=click.FloatRange(least, 7200.0), default=640.0, help=words)


def _poses(pitch_change_deg: float | None, words: str) -> Command:
    """What is not as it should be in the two poses."""

    def add(command: Command) -> Command:
        upright, pitch = click.FloatRange(-30.0, 30.0), click.FloatRange(-10.0, 10.0)
        return click.option(
            "--upright-error", "upright_error_deg", type=upright, default=0.0, help="Of the upright pose, degrees."
        )(click.option("--pitch-change", "pitch_change_deg", type=pitch, default=pitch_change_deg, help=words)(command))

    return add


@click.command()
@click.option("--profile", help=_PROFILES)
@click.option("--seed", type=click.IntRange(min=0), default=0, help="Another seed, another ride.")
@_seconds(20.0, "Of riding; start and stop come on top.")
@_poses(None, "Between the poses, degrees; at random if not given.")
@click.option("--speed", is_flag=True, help="Write what a GPS receiver gives into the log: speed, position, time.")
@click.option(
    "--fleet",
    "vehicles",
    type=click.IntRange(min=1),
    metavar="N",
    help="Instead: N cars, buses and motorcycles with a few drives each, a manifest, and what is wrong with some.",
)
@OUT_DIRECTORY
def simulate_command(profile: str | None, seed: int, vehicles: int | None, out: Path, **of_a_ride: Any) -> None:
    """Make up a ride: six poses and a free one, kickstand, upright, the ride, its truth. Or a fleet (see fleet)."""
    if vehicles is not None:
        _check_fleet(out)
        with Bar("making up vehicles", lines_s=_LINES_S) as bar:
            fleet = make_fleet(out, vehicles, seed, progress=bar.reach)
        logs = sum(len(vehicle.paths) for vehicle in fleet)
        click.echo(f"written: {out}/MANIFEST.csv and TRUTH.csv, {vehicles} vehicles, {logs} logs")
        return
    if profile is None:
        raise click.UsageError("Missing option '--profile', or '--fleet' for a fleet.")
    if (out / "MANIFEST.csv").exists():
        raise InputError(f"{out} holds a fleet, whose truth would be lost: give --out another directory")
    with spinner("making up a ride"):
        made = simulate(profile, seed, out, **of_a_ride)
    click.echo(f"written: {out / 'RIDE.csv'}, {len(made.time)} samples, with its poses and TRUTH.csv")


def _check_fleet(out: Path) -> None:
    """Refuse what a fleet has no use for, and the directory of a ride."""
    context = click.get_current_context()
    given = click.core.ParameterSource.COMMANDLINE
    for option in context.command.params:
        if option.name not in ("seed", "vehicles", "out") and context.get_parameter_source(option.name or "") is given:
            raise click.UsageError(f"{option.opts[0]} is of a single ride: leave it or --fleet out.")
    if (out / "RIDE.csv").exists():
        raise InputError(f"{out} holds a ride, whose truth would be lost: give --out another directory")


@click.command()
@click.option("--profiles", default=",".join(MAIN), help=f"With commas between: {_PROFILES}")
@click.option("--seeds", type=click.IntRange(min=1), default=3, help="Rides of each profile.")
@_seconds(60.0, "Of riding, each; start and stop come on top.")
@_poses(1.0, "Between the two poses, degrees.")
@click.option("--recording", type=PATH, help="A recorded ride with speed to compare on too.")
@click.option("--out", type=PATH, help="Write evaluation.json and lean.png to this directory.")
@JSON
def evaluate_command(
    profiles: str, recording: Path | None, out: Path | None, as_json: bool, **of_the_rides: Any
) -> None:
    """Compare the shown lean and other filters with the truth of simulated rides."""
    names = [name.strip() for name in profiles.split(",")]
    jobs = runs.jobs(names, traces=out is not None, **of_the_rides)
    if out is not None:
        picture.check()
        check_directory(out)
    absent = missing()
    if absent:
        click.echo(f"left out, not installed: {', '.join(absent)}: {extra('evaluate')}", err=True)
    with new_directory(out) if out is not None else contextlib.nullcontext():
        with Bar("riding", len(jobs) * runs.steps(), patience_s=0.0, lines_s=_LINES_S) as bar:
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
