"""Finds parts that other packages add to the tools by entry points.

This project's kickstand_fleet and kickstand_emulator add their parts in their own pyproject.toml. kickstand_tools works
without these packages and never imports them.
"""

from importlib.metadata import EntryPoint, distributions
from typing import Any

from .errors import DISTRIBUTION, InputError, leaf

ENGINES = "kickstand.engines"  # see replay.Engine
SIMULATIONS = "kickstand.simulations"  # functions like simulation.files.simulate that simulate several rides
# The folder below tools/ of each part that is in another package of this project
LEAVES = {"bench": "emulator", "emulate": "emulator", "fleet": "fleet", "rp2040": "emulator"}
OURS = {DISTRIBUTION, *(f"kickstand-{folder}" for folder in LEAVES.values())}


def entry_points(group: str) -> dict[str, EntryPoint]:
    """Return the entry points of a group, by name.

    If several have the same name, this project's entry point is used. If none is this project's, the first is used.
    """
    named: dict[str, EntryPoint] = {}
    for distribution in distributions():
        try:
            members = [entry_point for entry_point in distribution.entry_points if entry_point.group == group]
            # The name is read last, because it takes most of the time
            ours = bool(members) and distribution.name in OURS
            named |= {member.name: member for member in members if ours or member.name not in named}
        except Exception:  # skip a package whose metadata cannot be read
            continue
    return named


def part(group: str, name: str) -> Any:
    """Return the object of an entry point. Raises InputError if no installed package has this entry point."""
    entry_point = entry_points(group).get(name)
    if entry_point is None:
        raise not_installed(name)
    return load(entry_point)


def load(entry_point: EntryPoint) -> Any:
    """Return the object of an entry point. Raises InputError if it is in a package of this project that is missing."""
    try:
        return entry_point.load()
    except ModuleNotFoundError as error:
        if entry_point.name in LEAVES and error.name == entry_point.module.partition(".")[0]:
            raise not_installed(entry_point.name) from error
        raise


def not_installed(name: str) -> InputError:
    """Return the error of a part of LEAVES whose package is missing."""
    folder = LEAVES[name]
    return InputError(f"{name} is in the package kickstand-{folder}, which is not installed: {leaf(folder)}")
