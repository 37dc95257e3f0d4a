"""Finds the firmware's files, in a checkout or in an installed wheel."""

import os
from pathlib import Path

import kickstand

TOOLS = Path(__file__).resolve().parents[2]  # the directory that kickstand_tools is imported from
PACKAGE = Path(kickstand.__file__).resolve().parent  # the firmware's package, which these tools also import


def directory() -> Path:
    """The directory that holds main.py and config.py."""
    return _packaged() if installed() else TOOLS.parent / "firmware"


def _packaged() -> Path:
    return TOOLS / "kickstand_tools" / "firmware"  # in a wheel


def installed() -> bool:
    """Return True if these tools were installed as a package, False in a checkout with files that the user may edit."""
    return _packaged().is_dir()


def config() -> Path:
    """Return the path of the user's config.py.

    In a checkout as the current directory, this is the checkout's file. For tools that were installed as a package, it
    is config.py in the current directory, if there is one. Without such a file, it is the config.py that belongs to
    these tools.
    """
    checkout = Path("firmware").resolve()
    if (checkout / "kickstand").is_dir() and (checkout / "config.py").is_file():
        return checkout / "config.py"
    user_config = Path("config.py").resolve()
    return user_config if installed() and user_config.is_file() else directory() / "config.py"


def documents() -> Path:
    """The directory that holds README.md and the folders of the other documents, as in a checkout."""
    return TOOLS / "kickstand_tools" / "documents" if installed() else TOOLS.parent


def search_path() -> str:
    """Return the search path with which another Python process can import the firmware and these tools."""
    return os.pathsep.join((str(TOOLS), str(PACKAGE.parent)))
