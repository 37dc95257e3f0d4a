"""Commands that other packages add to `kickstand`, by entry points of the group "kickstand.commands".

The name of an entry point is the command's name; its object is a click.Command. In the other package's pyproject.toml:

    [project.entry-points."kickstand.commands"]
    laps = "my_package.laps:laps_command"

If names are equal, Kickstand's own command is used. kickstand_fleet and kickstand_emulator add `fleet` and `emulate` in
this way. A package is imported only when its command runs, or for its line in the help.
"""

import traceback
from importlib.metadata import EntryPoint

import click

from ..common import plugins
from ..common.errors import DISTRIBUTION, InputError, cause

GROUP = "kickstand.commands"


def entry_points() -> dict[str, EntryPoint]:
    """The entry points of all installed commands, by the command's name."""
    return plugins.entry_points(GROUP)


def command(entry_point: EntryPoint) -> click.Command:
    """The command of an entry point. Raises InputError, which names the package, if it cannot be loaded."""
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
    """The line for a command in the list of commands. It reports a command that cannot be loaded."""
    try:
        return command(entry_point).get_short_help_str(limit=80)
    except InputError as error:
        return str(error)


def owner(error: Exception) -> str:
    """The package responsible for an unexpected error: the package of the running command, or kickstand."""
    packages = {entry_point.module.partition(".")[0]: _package(entry_point) for entry_point in entry_points().values()}
    for frame, _ in traceback.walk_tb(error.__traceback__):
        package = packages.get(frame.f_globals.get("__name__", "").partition(".")[0], DISTRIBUTION)
        if package != DISTRIBUTION:
            return package
    return "kickstand"


def _package(entry_point: EntryPoint) -> str:
    """The name of the distribution that an entry point belongs to."""
    return entry_point.dist.name if entry_point.dist else entry_point.module


def _refusal(entry_point: EntryPoint, why: str) -> InputError:
    name, package = entry_point.name, _package(entry_point)
    return InputError(f"the command {name} of the package {package} cannot be loaded ({why}): update or uninstall it")
