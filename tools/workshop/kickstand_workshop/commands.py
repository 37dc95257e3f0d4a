"""The commands that the workshop adds to `kickstand`: evaluate and bands."""

from pathlib import Path
from typing import Any

import click
from kickstand_sim.simulation.physics.chip import MOUNTS
from kickstand_sim.simulation.physics.road import CLASSES
from kickstand_sim.simulation.profiles import MAIN, check_profile
from kickstand_tools.cli.common import JSON, PATH, Bar, show, warn
from kickstand_tools.cli.simulated import LINES_S, PROFILE_NAMES, pose_options, seconds_option
from kickstand_tools.common.installation import extra

from .evaluation import bands, integrity, report, runs, setting_off
from .evaluation.estimators import missing

FAULTS_SECONDS = 120.0  # default riding time with each fault


@click.command()
@click.option("--profiles", default=",".join(MAIN), help=f"Separated by commas. {PROFILE_NAMES}")
@click.option("--seeds", type=click.IntRange(min=1), default=3, help="Rides of each profile, or of each fault.")
@seconds_option(60.0, "Riding time of each ride, without start and stop.")
@pose_options(1.0, "Change of pitch between the two poses, degrees.")
@click.option("--recording", type=PATH, help="Also compare the filters on this recorded ride, which needs a speed.")
@click.option("--faults", is_flag=True, help="Instead measure how long a faulty sensor's wrong lean is shown as good.")
@click.option("--first-seconds", is_flag=True, help="Instead measure the first 40 s of two rides of each bike.")
@click.option("--first-seed", type=click.IntRange(min=0), default=0, help="With either of these: the lowest seed.")
@click.option("--whole-device/--meter-alone", default=None, help="With --faults: runs the device (default) or meter.")
@JSON
def evaluate_command(
    profiles: str,
    recording: Path | None,
    faults: bool,
    first_seconds: bool,
    first_seed: int,
    whole_device: bool | None,
    as_json: bool,
    **of_the_rides: Any,
) -> None:
    """Compare the shown lean and other filters with the truth of simulated rides."""
    seeds = of_the_rides["seeds"]
    if faults:
        seconds = of_the_rides["seconds"] if _is_on_command_line("seconds") else FAULTS_SECONDS
        outcomes = _with_bar(
            "riding with faults", integrity, integrity.jobs(seeds, first_seed, seconds, whole_device is not False)
        )
        show(integrity.document(outcomes) if as_json else None, integrity.fault_table(outcomes))
        return
    if whole_device is not None:
        raise click.UsageError("--whole-device and --meter-alone belong to --faults.")
    if first_seconds:
        results = _with_bar("setting off", setting_off, setting_off.jobs(seeds, first_seed))
        show(setting_off.document(results) if as_json else None, setting_off.table(results))
        return
    if _is_on_command_line("first_seed"):
        raise click.UsageError("--first-seed belongs to --faults and --first-seconds.")
    _compare_filters([name.strip() for name in profiles.split(",")], of_the_rides, recording, as_json)


def _with_bar(title: str, module: Any, jobs: list[Any]) -> list[Any]:
    """Return the results of module.evaluate(), and show a bar during its jobs."""
    with Bar(title, len(jobs), patience_s=0.0, lines_s=LINES_S) as bar:
        return module.evaluate(jobs, lambda: bar.advance(1))


def _compare_filters(profiles: list[str], of_the_rides: dict[str, Any], recording: Path | None, as_json: bool) -> None:
    """Ride all profiles, and show the errors of all filters, also on a recorded ride."""
    rides = runs.jobs(profiles, **of_the_rides)
    absent = missing()
    if absent:
        click.echo(f"left out, not installed: {', '.join(absent)}: {extra('evaluate')}", err=True)
    with Bar("riding", len(rides), patience_s=0.0, lines_s=LINES_S) as bar:
        evaluation = runs.evaluate(rides, recording, lambda: bar.advance(1))
    for result in evaluation.results:
        if result.refusal is not None:
            click.echo(f"{result.job.profile}, seed {result.job.seed}, not calibrated: {result.refusal}", err=True)
    recorded = evaluation.recorded
    warn(str(recording), recorded.notices if recorded else ())
    tables = [report.table(evaluation.results)]
    if recorded:
        tables.append(report.real_table(recorded.scores, recorded.name))
    show(report.document(evaluation) if as_json else None, *tables)


def _is_on_command_line(option: str) -> bool:
    return click.get_current_context().get_parameter_source(option) is click.core.ParameterSource.COMMANDLINE


@click.command()
@click.argument("recordings", type=PATH, metavar="[RIDE.csv]...", nargs=-1)
@click.option("--profile", default="street", help=PROFILE_NAMES)
@click.option("--seed", type=click.IntRange(min=0), default=0, help="Each seed gives another ride.")
@seconds_option(100.0, "Riding time of each ride, without start and stop.")
@click.option("--mount", type=click.Choice(list(MOUNTS)), help="A fault of the sensor's mount or of its logger.")
@JSON
def bands_command(
    recordings: tuple[Path, ...], profile: str, seed: int, seconds: float, mount: str | None, as_json: bool
) -> None:
    """Print how rough rides are in each frequency band.

    Compares recorded rides with a simulated profile, on the profile's own road and on roads A to D.
    """
    check_profile(profile)
    with Bar("measuring", len(recordings) + 1 + len(CLASSES), patience_s=0.0, lines_s=LINES_S) as bar:
        rides = {}
        for path in recordings:
            rides[path.name] = bands.of_recording(path)
            bar.advance(1)
        for road in (None, *CLASSES):
            name = profile if road is None else f"{profile}, road {road}"
            rides[name] = bands.of_simulated(profile, seed, seconds, road, mount)
            bar.advance(1)
    data = {name: {key: rms.tolist() for key, rms in figures.items()} for name, figures in rides.items()}
    show({"bands_hz": bands.BANDS_HZ, "rides": data} if as_json else None, bands.table(rides))
