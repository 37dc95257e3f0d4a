"""The command `kickstand fleet`, which processes many vehicles at once."""

from typing import Any

import click
from kickstand_tools.cli.common import VEHICLES, Bar, echo

from . import KEPT


@click.command()
@click.argument("manifests", nargs=-1, required=True, metavar="MANIFEST.csv|GLOB")
@click.option("--out", required=True, metavar="DIR", help="The directory to write to, or an address such as s3://...")
@click.option("--scheduler", metavar="ADDRESS", help="A Dask cluster at tcp://... Default: this computer.")
@click.option("--workers", type=click.IntRange(min=1), help="Workers on this computer. Default: one per processor.")
@click.option(
    "--signals", "with_signals", is_flag=True, help="Also write each log's accelerations along the vehicle's axes."
)
@click.option(
    "--timeout",
    "timeout_s",
    type=click.FloatRange(min=1.0),
    default=600.0,
    help="Longest time for one vehicle, in seconds.",
)
@click.option(
    "--vehicle", type=VEHICLES, default="car", help="The kind of vehicle, for a GLOB. A manifest has its own column."
)
def fleet_command(manifests: tuple[str, ...], out: str, vehicle: str, **options: Any) -> None:
    """Align many vehicles, find moved mounts, test their brakes.

    The manifest is CSV with the columns vehicle,path,kind and optionally mount: one line per log, in chronological
    order. With a GLOB each matching file is one vehicle. Paths may start with s3://. To resume a run, repeat the
    command: only new and changed logs are computed.
    """
    from .manifest import by_pattern, is_pattern, read_manifest  # imported here, because numpy is slow to import
    from .run import run_fleet

    manifest = manifests[0]
    if len(manifests) > 1:  # more than one argument: the shell has expanded a pattern to file names
        raise click.UsageError("One manifest, or one pattern in quotation marks.")
    periods = by_pattern(manifest, vehicle) if is_pattern(manifest) else read_manifest(manifest)
    try:
        with Bar("vehicles", lines_s=10.0, patience_s=0.0) as bar:
            run = run_fleet(periods, out, progress=bar.reach, **options)
    except KeyboardInterrupt:
        echo(KEPT, err=True)
        raise
    earlier = run.vehicles - run.new
    reused = f", {earlier} of them finished earlier" if earlier else ""
    echo(f"mounted sensors: {run.vehicles}{reused}")
    if run.damaged:
        echo(f"{run.damaged} earlier results were damaged and are recomputed", err=True)
    summary = run.seen
    counts = summary.statuses
    echo(f"aligned: {counts['aligned']}, refused: {counts['refused']}, errors: {counts['error']}")
    for (status, reason), count in summary.reasons.most_common():
        echo(f"{count:7}  {status}: {reason}")
    tests = len(summary.decelerations)
    moved, errors = summary.moved_vehicles, summary.errors
    echo(f"mounts that seem to have moved: {moved}; brake tests: {tests}; rows of errors: {errors}")
    for path, message in summary.first_errors:
        echo(f"error: {message if path in message else f'{path}: {message}'}")
    if summary.errors > len(summary.first_errors):
        echo("more errors are in errors.parquet")
    echo(f"written: {out}/index.html, alignments.parquet, moved.parquet, brake_tests.parquet, errors.parquet")
