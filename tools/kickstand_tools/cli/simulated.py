"""The command that simulates rides."""

from pathlib import Path

import click

from ..errors import InputError

_PATH = click.Path(path_type=Path)
LINES_S = 10.0  # between two lines of progress where there is no terminal for a bar
UPRIGHT_ERROR = click.option(
    "--upright-error", type=click.FloatRange(-30.0, 30.0), default=0.0, help="Of the upright pose, degrees."
)

# The names in simulation.profiles. Importing that needs numpy, which would slow every command down.
PROFILES = (
    "street, track, sweeper, city, hills; hard ones: held, corners, banked, wheelie, bumps, crosswind, weight, "
    "vibration, creep, temperature, fall, parked"
)


@click.command(short_help="Make up a ride with its true lean, or drives of a fleet.")
@click.option("--profile", help=f"{PROFILES}.")
@click.option("--seed", type=click.IntRange(min=0), default=0, help="Another seed, another ride.")
@click.option(
    "--seconds",
    type=click.FloatRange(min=20.0, max=7200.0),
    default=640.0,
    help="Of riding; start and stop come on top.",
)
@UPRIGHT_ERROR
@click.option(
    "--pitch-change",
    type=click.FloatRange(-10.0, 10.0),
    help="Between the poses, degrees; at random if not given.",
)
@click.option("--speed", is_flag=True, help="Write what a GPS receiver gives into the log: speed, position, time.")
@click.option(
    "--fleet",
    "vehicles",
    type=click.IntRange(min=1),
    metavar="N",
    help="Instead: N cars, buses and motorcycles with a few drives each, a manifest, and what is wrong with some.",
)
@click.option("--out", required=True, type=_PATH, help="The directory to write to.")
def simulate(
    profile: str | None,
    seed: int,
    seconds: float,
    upright_error: float,
    pitch_change: float | None,
    speed: bool,
    vehicles: int | None,
    out: Path,
) -> None:
    """Make up a ride: six poses and a free one, kickstand, upright, the ride, its truth. Or a fleet (see fleet)."""
    if vehicles is not None:
        _check_fleet(out)
        _simulate_fleet(vehicles, seed, out)
        return
    if profile is None:
        raise click.UsageError("Missing option '--profile', or '--fleet' for a fleet.")
    if (out / "MANIFEST.csv").exists():
        raise InputError(f"{out} holds a fleet, whose truth would be lost: give --out another directory")
    from ..progress import spinner
    from ..simulation.files import simulate

    with spinner("making up a ride"):
        made = simulate(profile, seed, out, seconds, upright_error, pitch_change, speed=speed)
    click.echo(f"written: {out / 'RIDE.csv'}, {len(made.time)} samples, with its poses and TRUTH.csv")


def _check_fleet(out: Path) -> None:
    """Refuse what a fleet has no use for, and the directory of a ride."""
    context = click.get_current_context()
    for name in ("profile", "seconds", "upright_error", "pitch_change", "speed"):
        if context.get_parameter_source(name) is not click.core.ParameterSource.DEFAULT:
            raise click.UsageError(f"--{name.replace('_', '-')} is of a single ride: leave it or --fleet out.")
    if (out / "RIDE.csv").exists():
        raise InputError(f"{out} holds a ride, whose truth would be lost: give --out another directory")


def _simulate_fleet(vehicles: int, seed: int, out: Path) -> None:
    from ..progress import Bar
    from ..simulation.fleet.fleet import make_fleet

    with Bar("making up vehicles", lines_s=LINES_S) as bar:
        made = make_fleet(out, vehicles, seed, progress=bar.reach)
    logs = sum(len(vehicle.paths) for vehicle in made)
    click.echo(f"written: {out}/MANIFEST.csv and TRUTH.csv, {vehicles} vehicles, {logs} logs")
