"""The command `kickstand import`: a recording of another app or logger becomes a log."""

from pathlib import Path
from typing import TYPE_CHECKING

import click

from ..errors import InputError
from .common import TIME, warn

if TYPE_CHECKING:
    from ..imports.importing import Imported

_PATH = click.Path(path_type=Path)
_COLUMNS = "Of another table: t, ax, ay, az, gx, gy, gz; also speed, lat, lon, temp. #3 is the third column."
_UNITS = "Of t, a (or ax, ay, az), g (or gx, gy, gz), speed; -UNIT turns the sign."


@click.command("import")
@click.argument("source", type=_PATH, metavar="FILE|DIR|ZIP")
@click.option("--out", required=True, type=_PATH, help="The log to write, packed if it ends in .gz.")
@click.option("--columns", metavar="t=NAME,ax=NAME,...", help=_COLUMNS)
@click.option("--units", metavar="a=UNIT,g=UNIT,...", help=_UNITS)
@click.option("--from", "start_s", type=TIME, metavar="TIME", help="Seconds from the start; negative: from the end.")
@click.option("--to", "end_s", type=TIME, metavar="TIME", help="The same, for the end.")
def import_(
    source: Path, out: Path, columns: str | None, units: str | None, start_s: float | None, end_s: float | None
) -> None:
    """Make a log of a recording of another app or logger.

    Known: phyphox, Sensor Logger, SensorLog, Sensor Kinetics, RaceChrono (CSV), RaceBox, VBO, AiM, and Kickstand's own
    exports. Any other table of accelerations (with gravity) and rates of rotation needs --columns and --units.

    The axes of the log have to be right-handed. At rest the axis that points up reads +1 g, and a rate is positive
    right-handed about its axis.
    """
    from rich.console import Console

    from ..calibration.file import calibration_path
    from ..imports.importing import import_recording, write_imported
    from ..output import check_output
    from ..progress import spinner

    check_output(out, [source] if source.is_file() else sorted(source.rglob("*")) if source.is_dir() else [])
    named = _pairs(columns, "--columns") if columns is not None else None
    with spinner("importing"):
        found = import_recording(source, named, _pairs(units or "", "--units"), start_s, end_s)
        write_imported(out, found)
    Console().print(_table(found))
    warn(source, found.notices)
    t_s, gaps_s = found.log.t_s, found.gaps_s
    count = "1 gap" if len(gaps_s) == 1 else f"{len(gaps_s)} gaps"
    gaps = f", {count} of {gaps_s.sum():.1f} s in all" if len(gaps_s) else ""
    click.echo(f"written: {out}, {len(t_s)} samples in {t_s[-1]:.1f} s, {found.rate_hz:.0f} a second{gaps}")
    if found.vehicle_axes:
        click.echo("x is left, y up, z forward, as far as the logger was mounted so")
    beside = calibration_path(out)
    if beside.exists():
        click.echo(f"{beside} is of an earlier ride: after the mount has moved, kickstand calibrate ride makes it anew")
    elif not any(notice.code in _WRONG for notice in found.notices):
        click.echo(f"next: kickstand calibrate ride {out} --out {beside}")
        click.echo(f"      kickstand report {out}")


_WRONG = ("mirrored", "left-handed", "rates-misfit", "rates-in-radians")  # the axes are to be put right first


def _pairs(text: str, option: str) -> dict[str, str]:
    """KEY=VALUE,KEY=VALUE,..."""
    pairs = {}
    for part in text.split(",") if text.strip() else []:
        key, equals, value = (word.strip() for word in part.partition("="))
        if not key or not equals or not value:
            raise InputError(f"{option}: {part!a} is not NAME=VALUE; commas part the pairs")
        if key in pairs:
            raise InputError(f"{option}: {key!a} is there twice")
        pairs[key] = value
    return pairs


def _table(found: "Imported"):
    from rich.table import Table

    table = Table(title=found.app, title_justify="left", box=None, pad_edge=False)
    for column in ("quantity", "from", "unit", "rate", "axes and sign"):
        table.add_column(column, overflow="fold")
    for taken in found.taken:
        rate = f"{taken.rate_hz:{'.0f' if taken.rate_hz >= 10.0 else '.2g'}} Hz" if taken.rate_hz else ""
        table.add_row(taken.quantity, taken.source, taken.unit, rate, taken.sign)
    return table
