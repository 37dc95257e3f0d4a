"""Draws a ride: DIR/RIDE.png with matplotlib, DIR/RIDE.html with plotly."""

from importlib.util import find_spec
from pathlib import Path

from ...common.errors import InputError, extra
from ...common.output import check_directory, new_directory, whole_file
from ..overview import Overview
from . import page, picture


def check(directory: Path) -> None:
    """Raise InputError if drawing or writing to the directory is impossible."""
    missing = [name for name in ("matplotlib", "plotly") if not find_spec(name)]
    if missing:
        raise InputError(f"pictures need {' and '.join(missing)}: {extra('rides')}")
    if directory.suffix in (".png", ".html"):
        raise InputError(f"{directory}: a picture and a page are written: give the directory for them")
    check_directory(directory)


def draw(overview: Overview, directory: Path, tiles: bool = False) -> list[Path]:
    """Write both files and return their paths. tiles: see page.draw(). Raises InputError."""
    paths = [directory / f"{overview.ride.stem}.png", directory / f"{overview.ride.stem}.html"]
    with new_directory(directory):
        with whole_file(paths[0]) as path:
            picture.draw(path, overview)
        with whole_file(paths[1]) as path:
            page.draw(path, overview, tiles)
    return paths
