"""Commands that other packages add to `kickstand`, by entry points of the group "kickstand.commands".

The name of an entry point is the command's name. The entry point's object is a click.Command. For example, in the other
package's pyproject.toml:

    [project.entry-points."kickstand.commands"]
    laps = "my_package.laps:laps_command"

If Kickstand has a command of the same name, that command is used. kickstand_fleet and kickstand_emulator add `fleet`
and `emulate` in this way. A package is only imported if its command runs. The list of commands reads the help line in
the text of the module, because importing a package takes long.
"""

import ast
import functools
import traceback
from importlib.machinery import PathFinder
from importlib.metadata import EntryPoint
from pathlib import Path

import click

from ..common import installation
from ..common.installation import DISTRIBUTION
from ..common.messages import InputError, cause

GROUP = "kickstand.commands"


def entry_points() -> dict[str, EntryPoint]:
    """Return the entry points of all installed commands, by the command's name."""
    return installation.entry_points(GROUP)


def command(entry_point: EntryPoint) -> click.Command:
    """Load the command of an entry point. Raises InputError, which names the package, if loading fails."""
    try:
        loaded = installation.load(entry_point)
    except InputError:
        raise
    except (Exception, SystemExit) as error:
        raise _refusal(entry_point, f"{type(error).__name__}: {cause(error)}") from error
    if not isinstance(loaded, click.Command):
        raise _refusal(entry_point, f"{entry_point.value} is not a click command")
    return loaded


def help_line(entry_point: EntryPoint) -> str:
    """Return the help line of a command: its short_help, or the first sentence of its docstring.

    The module is loaded only if its text does not define the command as a function. If loading fails, return the
    reason.
    """
    try:
        written = _written_help(entry_point)
    except (AttributeError, OSError, SyntaxError, ValueError):  # the error of loading the module says more
        written = None
    try:
        loaded = written or command(entry_point)
        return loaded.get_short_help_str(limit=80)
    except InputError as error:
        return str(error)


def _written_help(entry_point: EntryPoint) -> click.Command | None:
    """Find the help of a command in the text of its module. Returns a command without options, or None."""
    package, *names = entry_point.module.split(".")
    spec = PathFinder.find_spec(package)
    folders = spec and spec.submodule_search_locations
    file = Path(folders[0], *names).with_suffix(".py") if folders and names else Path((spec and spec.origin) or "")
    if not file.is_file():
        return None
    node = _functions(file.read_bytes()).get(entry_point.attr)
    if node is None:
        return None
    calls = [call for call in node.decorator_list if ast.unparse(call).startswith(("click.command(", "click.group("))]
    if not calls:
        return None
    keywords = [word for call in calls if isinstance(call, ast.Call) for word in call.keywords]
    texts = {word.arg: ast.literal_eval(word.value) for word in keywords if word.arg in ("help", "short_help")}
    return click.Command(node.name, help=texts.get("help", ast.get_docstring(node)), short_help=texts.get("short_help"))


@functools.cache  # most modules define several commands
def _functions(text: bytes) -> dict[str, ast.FunctionDef]:
    return {node.name: node for node in ast.parse(text).body if isinstance(node, ast.FunctionDef)}


def owner(error: Exception) -> str:
    """Find the package that is responsible for an unexpected error.

    Returns the name of the package that added the running command, or "kickstand".
    """
    # The attribute `module` of an entry point raises an error if its value is invalid
    tops = {
        entry_point: entry_point.value.partition(":")[0].partition(".")[0] for entry_point in entry_points().values()
    }
    packages = {top: _package(entry_point) for entry_point, top in tops.items()}
    for frame, _ in traceback.walk_tb(error.__traceback__):
        package = packages.get(frame.f_globals.get("__name__", "").partition(".")[0], DISTRIBUTION)
        if package not in installation.OURS:
            return package
    return "kickstand"


def _package(entry_point: EntryPoint) -> str:
    """Return the name of the distribution that contains an entry point."""
    return entry_point.dist.name if entry_point.dist else entry_point.value


def _refusal(entry_point: EntryPoint, reason: str) -> InputError:
    name, package = entry_point.name, _package(entry_point)
    command_text = f"the command {name} of the package {package}"
    return InputError(f"{command_text} cannot be loaded ({reason}): update or uninstall it")
