"""Finds parts that other packages add to the tools by entry points.

This project's kickstand_fleet and kickstand_emulator add their parts in pyproject.toml. kickstand_tools works without
these packages and never imports them.
"""

from importlib.metadata import EntryPoint, distributions
from typing import Any

from .errors import DISTRIBUTION, InputError

ENGINES = "kickstand.engines"  # see replay.Engine
SIMULATIONS = "kickstand.simulations"  # functions like simulation.files.simulate that simulate several rides


def entry_points(group: str) -> dict[str, EntryPoint]:
    """Return the entry points of a group, by name.

    If several have the same name, this project's entry point is used. If none is this project's, the first is used.
    """
    named: dict[str, EntryPoint] = {}
    for distribution in distributions():
        try:
            members = [entry_point for entry_point in distribution.entry_points if entry_point.group == group]
            # The name is read last, because it takes most of the time
            ours = bool(members) and distribution.name == DISTRIBUTION
            named |= {member.name: member for member in members if ours or member.name not in named}
        except Exception:  # skip a package whose metadata cannot be read
            continue
    return named


def part(group: str, name: str) -> Any:
    """Return the object of an entry point. Raises InputError if no installed package has this entry point."""
    entry_point = entry_points(group).get(name)
    if entry_point is None:
        raise InputError(f"the part {name} of {DISTRIBUTION} is not installed: install {DISTRIBUTION} again")
    return entry_point.load()
