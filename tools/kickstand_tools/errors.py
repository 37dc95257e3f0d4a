"""What the command line refuses."""

import sys


class InputError(Exception):
    """Something the user gave cannot be used. The text is one line: what is wrong, and what to do."""


def cause(error: BaseException) -> str:
    """A short reason for an error of the operating system, without its number: "Permission denied"."""
    return getattr(error, "strerror", None) or str(error) or type(error).__name__


def extra(name: str) -> str:
    """How to install an optional part of the project. Without -e a copy would take the place of the checkout, and
    flash would copy that one's firmware."""
    return f"in the project's directory, {sys.executable} -m pip install -e \".[{name}]\""
