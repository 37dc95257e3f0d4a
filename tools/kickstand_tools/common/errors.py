"""The error for input that cannot be used, and parts of its text."""

import sys

from ..remedies import COMMANDS, Remedies
from . import firmware_path

DISTRIBUTION = "kickstand-lean"  # as in pyproject.toml; the package "kickstand" belongs to another project


class InputError(Exception):
    """Something that the user has given cannot be used. Its text is one line: what is wrong, and what to do.

    what: what is wrong, and what to do about it if the command line and the pages say that in the same words. If not,
    remedy: the name in remedies.py of what to do, and values: what is put into its words for {0}, {1} ...
    """

    def __init__(self, what: str, remedy: str = "", *values: str) -> None:
        super().__init__(what, remedy, *values)

    def __str__(self) -> str:
        return self.said(COMMANDS)

    def said(self, remedies: Remedies) -> str:
        """The line with these words for what to do."""
        what, remedy, *values = self.args
        return f"{what}: {remedies[remedy].format(*values)}" if remedy else what


def cause(error: BaseException) -> str:
    """A short reason for an error of the operating system, without its number: "Permission denied"."""
    return getattr(error, "strerror", None) or str(error) or type(error).__name__


def printable(text: str) -> str:
    """The text with characters that control a terminal, such as ESC, replaced by their codes."""
    return "".join(c if c in "\n\t" or c.isprintable() else ascii(c)[1:-1] for c in text)


def extra(name: str) -> str:
    """How to install an optional part of the project.

    For a checkout it uses -e and the path. Otherwise a copy would replace the checkout, and `kickstand flash` would use
    the copy's firmware.
    """
    if firmware_path.installed():
        return f'{sys.executable} -m pip install "{DISTRIBUTION}[{name}]"'
    return f'{sys.executable} -m pip install -e "{firmware_path.TOOLS.parent}[{name}]"'
