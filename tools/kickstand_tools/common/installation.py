"""Finds what is installed: the firmware's files, the packages that add parts to the tools, and MicroPython.

Packages add parts by entry points. kickstand_tools also works without this project's other packages.
"""

import importlib.util
import os
import sys
from importlib.metadata import EntryPoint, distributions
from pathlib import Path
from typing import Any

import kickstand

from .messages import InputError

DISTRIBUTION = "kickstand-lean"  # as in pyproject.toml; the package "kickstand" belongs to another project
TOOLS = Path(__file__).resolve().parents[2]  # the directory that kickstand_tools is imported from
PACKAGE = Path(kickstand.__file__).resolve().parent  # the firmware's package, which these tools also import
ENGINES = "kickstand.engines"  # see replay.Engine
SIMULATIONS = "kickstand.simulations"  # functions like simulation.files.simulate that simulate several rides
# The folder below tools/ of each part that is in another package of this project
LEAVES = {"bench": "emulator", "emulate": "emulator", "fleet": "fleet", "rp2040": "emulator"}
OURS = {DISTRIBUTION, *(f"kickstand-{folder}" for folder in LEAVES.values())}


def installed() -> bool:
    """Return True if these tools were installed as a package, False in a checkout with files that the user may edit."""
    return (TOOLS / "kickstand_tools" / "firmware").is_dir()


def firmware() -> Path:
    """The directory that holds main.py and config.py."""
    return TOOLS / "kickstand_tools" / "firmware" if installed() else TOOLS.parent / "firmware"


def config() -> Path:
    """Return the path of the user's config.py.

    This is the file of the checkout that is the current directory. For tools that were installed as a package, it is
    config.py in the current directory. If there is none, it is the config.py that belongs to these tools.
    """
    checkout = Path("firmware").resolve()
    if (checkout / "kickstand").is_dir() and (checkout / "config.py").is_file():
        return checkout / "config.py"
    user_config = Path("config.py").resolve()
    return user_config if installed() and user_config.is_file() else firmware() / "config.py"


def documents() -> Path:
    """The directory that holds README.md and the folders of the other documents, as in a checkout."""
    return TOOLS / "kickstand_tools" / "documents" if installed() else TOOLS.parent


def search_path() -> str:
    """Return the search path with which another Python process can import the firmware and these tools."""
    return os.pathsep.join((str(TOOLS), str(PACKAGE.parent)))


def extra(name: str) -> str:
    """Return the command that installs an optional part of the project."""
    return _pip_install(f"{DISTRIBUTION}[{name}]", f"{TOOLS.parent}[{name}]")


def leaf(folder: str) -> str:
    """Return the command that installs a package beside the core, such as "fleet", or with an extra "fleet[s3]"."""
    return _pip_install(f"kickstand-{folder}", f"{TOOLS}/{folder}")


def _pip_install(package: str, source: str) -> str:
    # Without -e in a checkout, pip would install a copy, and `kickstand flash` would use the firmware in this copy
    return f"{sys.executable} -m pip install " + (f'"{package}"' if installed() else f'-e "{source}"')


# Parts from other packages


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


# MicroPython's unix port, in a package from PyPI for Linux on x86-64 and for macOS on Apple silicon


def has_micropython() -> bool:
    return importlib.util.find_spec("micropython_unix") is not None


def micropython(script: str, *arguments: str) -> tuple[list[str], dict[str, str]]:
    """Return the command line that runs a script under MicroPython, and an environment with firmware and tools."""
    # `python -m micropython_unix` does not return the exit status, so its function is called.
    start = "import sys, micropython_unix; sys.exit(micropython_unix.main())"
    environment = os.environ | {"MICROPYPATH": f"{search_path()}:.frozen"}
    return [sys.executable, "-c", start, script, *arguments], environment
