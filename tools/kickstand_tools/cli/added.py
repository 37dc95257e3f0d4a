"""Commands that other packages add to `kickstand`, by entry points of the group "kickstand.commands".

The name of an entry point is the command's name. The entry point's object is a click.Command. For example, in the other
package's pyproject.toml:

    [project.entry-points."kickstand.commands"]
    laps = "my_package.laps:laps_command"

If Kickstand has a command of the same name, that command is used. kickstand_fleet and kickstand_emulator add `fleet`
and `emulate` in this way. A package is only imported if its command runs, or if the list of commands is printed.
"""

import traceback
from importlib.metadata import EntryPoint

import click

from ..common import plugins
from ..common.errors import DISTRIBUTION, InputError, cause

GROUP = "kickstand.commands"


def entry_points() -> dict[str, EntryPoint]:
    """Return the entry points of all installed commands, by the command's name."""
    return plugins.entry_points(GROUP)


def command(entry_point: EntryPoint) -> click.Command:
    """Load the command of an entry point. Raises InputError, which names the package, if loading fails."""
    try:
        loaded = entry_point.load()
    except InputError:
        raise
    except (Exception, SystemExit) as error:
        raise _refusal(entry_point, f"{type(error).__name__}: {cause(error)}") from error
    if not isinstance(loaded, click.Command):
        raise _refusal(entry_point, f"{entry_point.value} is not a click command")
    return loaded


def help_line(entry_point: EntryPoint) -> str:
    """Return the help line of a command. If the command cannot be loaded, return the reason."""
    try:
        return command(entry_point).get_short_help_str(limit=80)
    except InputError as error:
        return str(error)


def owner(error: Exception) -> str:
    """Find the package that is responsible for an unexpected error.

    Returns the name of the package that added the running command, or "kickstand".
    """
    packages = {entry_point.module.partition(".")[0]: _package(entry_point) for entry_point in entry_points().values()}
    for frame, _ in traceback.walk_tb(error.__traceback__):
        package = packages.get(frame.f_globals.get("__name__", "").partition(".")[0], DISTRIBUTION)
        if package != DISTRIBUTION:
            return package
    return "kickstand"


def _package(entry_point: EntryPoint) -> str:
    """Return the name of the distribution that contains an entry point."""
    return entry_point.dist.name if entry_point.dist else entry_point.module


def _refusal(entry_point: EntryPoint, why: str) -> InputError:
    name, package = entry_point.name, _package(entry_point)
    return InputError(f"the command {name} of the package {package} cannot be loaded ({why}): update or uninstall it")
