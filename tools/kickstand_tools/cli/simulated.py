"""The commands that need no board: demo, try and web run the firmware, simulate makes rides."""

import contextlib
import sys
import webbrowser
from pathlib import Path
from typing import Any

import click
from kickstand_sim.demo.demo import DeviceStopped, demo
from kickstand_sim.simulation.files import simulate
from kickstand_sim.simulation.physics.chip import MOUNTS
from kickstand_sim.simulation.physics.road import CLASSES
from kickstand_sim.simulation.profiles import MAIN, PROFILES

from ..common import installation
from ..common.messages import InputError
from ..common.output import check_directory
from .common import DISPLAY, OUT_DIRECTORY, PATH, Bar, Command, echo, file_argument, spinner

LINES_S = 10.0  # time between two lines of progress if there is no terminal for a progress bar
PROFILE_NAMES = f"{', '.join(MAIN)}; hard ones: {', '.join(name for name in PROFILES if name not in MAIN)}."
_HAND = click.option("--hand", is_flag=True, help="Lean the bike and press the button yourself, on the keyboard.")
_CPYTHON = click.option("--cpython", is_flag=True, help="Run the firmware on CPython, not on MicroPython.")


def seconds_option(least: float, words: str) -> Command:
    return click.option("--seconds", type=click.FloatRange(least, 7200.0), default=640.0, help=words)


def pose_options(pitch_change_deg: float | None, words: str) -> Command:
    """Return a decorator that adds the options for the errors of the two poses. words: help text of --pitch-change."""
    error, change = click.FloatRange(-30.0, 30.0), click.FloatRange(-10.0, 10.0)
    about = "Error of the upright pose, degrees."
    upright = click.option("--upright-error", "upright_error_deg", type=error, default=0.0, help=about)
    pitch = click.option("--pitch-change", "pitch_change_deg", type=change, default=pitch_change_deg, help=words)
    return lambda command: upright(pitch(command))


@click.command()
@click.option("--profile", help=PROFILE_NAMES)
@click.option("--seed", type=click.IntRange(min=0), default=0, help="Each seed gives another ride.")
@seconds_option(20.0, "Length of the log, which begins on the kickstand.")
@pose_options(None, "Change of pitch between the poses, degrees. Default: random.")
@click.option(
    "--road", type=click.Choice(list(CLASSES)), help="Roughness by ISO 8608, with camber. Default: the profile's."
)
@click.option("--mount", type=click.Choice(list(MOUNTS)), help="A fault of the sensor's mount or of its logger.")
@click.option(
    "--dive",
    type=(click.FloatRange(-2.0, 8.0), click.FloatRange(-2.0, 8.0)),
    metavar="BRAKING ACCELERATING",
    help="How far the springs pitch the bike, degrees per g. Default: random, about 3 and 1.4.",
)
@click.option("--speed", is_flag=True, help="Write speed, position and time to the log, as from a GPS receiver.")
@click.option(
    "--fleet",
    "vehicles",
    type=click.IntRange(min=1),
    metavar="N",
    help="Simulate N cars, buses and motorcycles instead: a few drives each, some with faults, and a manifest.",
)
@OUT_DIRECTORY
def simulate_command(profile: str | None, seed: int, vehicles: int | None, out: Path, **of_a_ride: Any) -> None:
    """Simulate a ride with its true lean, and the poses that calibrate its sensor. With --fleet, simulate a fleet."""
    if vehicles is not None:
        _check_fleet(out)
        with Bar("simulating vehicles", lines_s=LINES_S) as bar:
            fleet = installation.part(installation.SIMULATIONS, "fleet")(out, vehicles, seed, progress=bar.reach)
        logs = sum(len(vehicle.paths) for vehicle in fleet)
        echo(f"written: {out}/MANIFEST.csv and TRUTH.csv, {vehicles} vehicles, {logs} logs")
        return
    if profile is None:
        raise click.UsageError("Missing option '--profile', or '--fleet' for a fleet.")
    if (out / "MANIFEST.csv").exists():
        raise InputError(f"{out} holds a fleet, whose truth would be lost: give --out another directory")
    with spinner("simulating a ride"):
        ride = simulate(profile, seed, out, **of_a_ride)
    echo(f"written: {out / 'RIDE.csv'}, {len(ride.time)} samples, with its poses and TRUTH.csv")
    begin = ride.truth["lean_deg"][0]
    echo(f"lean, > 0 to the right: {ride.stand_deg:.1f} degrees in KICKSTAND.csv; RIDE.csv begins at {begin:.1f}")


def _check_fleet(out: Path) -> None:
    """Raise an error if the options or the directory belong to a single ride."""
    context = click.get_current_context()
    typed = click.core.ParameterSource.COMMANDLINE
    for option in context.command.params:
        if option.name not in ("seed", "vehicles", "out") and context.get_parameter_source(option.name or "") is typed:
            raise click.UsageError(f"{option.opts[0]} is of a single ride: leave it or --fleet out.")
    if (out / "RIDE.csv").exists():
        raise InputError(f"{out} holds a ride, whose truth would be lost: give --out another directory")


@click.command()
@_HAND
@_CPYTHON
@DISPLAY
def demo_command(**chosen: Any) -> None:
    """Run the firmware on a simulated board, in the terminal.

    You see a press on the kickstand, a press upright, and a ride.
    """
    _demo(**chosen)


@click.command()
@file_argument("user", "FILE")
@_HAND
@_CPYTHON
@DISPLAY
def try_command(**chosen: Any) -> None:
    """Run your own code as user.py on the simulated board, during the demo's ride."""
    _demo(**chosen)


def _demo(**chosen: Any) -> None:
    try:
        demo(**chosen)
    except DeviceStopped as error:
        echo(str(error), err=True)
        sys.exit(1)


@click.command()
@click.option("--out", type=PATH, help="Write the site to this directory instead of opening it.")
def web_command(out: Path | None) -> None:
    """Open the simulated board and the other pages in the browser. With --out, write the site for any web server."""
    from ..web import serve, site  # imported here, because it takes longer than the other commands need

    if out is not None:
        check_directory(out)
    with spinner("putting the site together"):
        files = site.site_files()
    if out is not None:
        site.write_site(files, out)
        echo(f"written: {out}, {len(files)} files for a web server; they do not work if opened directly")
        return
    with serve.server(files) as server:
        address = f"http://{serve.HOST}:{server.server_address[1]}/"
        echo(f"Kickstand in the browser: {address} (press Ctrl-C to stop)")
        webbrowser.open(address)
        with contextlib.suppress(KeyboardInterrupt):
            server.serve_forever()
