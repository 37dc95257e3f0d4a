"""Where the firmware's files are: in a checkout or in an installed wheel."""

import os
from pathlib import Path

import kickstand

TOOLS = Path(__file__).resolve().parent.parent  # the directory kickstand_tools is imported from
PACKAGE = Path(kickstand.__file__).resolve().parent  # the firmware's package, which the host imports too


def directory() -> Path:
    """The directory that holds main.py and config.py."""
    packaged = Path(__file__).resolve().parent / "firmware"  # in a wheel
    return packaged if packaged.is_dir() else TOOLS.parent / "firmware"  # in a checkout


def config() -> Path:
    """The rider's config.py: that of the checkout in the current directory, else the one beside these tools."""
    here = Path("firmware").resolve()
    return (here if (here / "kickstand").is_dir() and (here / "config.py").is_file() else directory()) / "config.py"


def search_path() -> str:
    """The search path with which another Python process can import the firmware and these tools."""
    return os.pathsep.join((str(TOOLS), str(PACKAGE.parent)))
