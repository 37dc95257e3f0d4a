"""Defines the error for unusable input, and functions for its text."""

import sys

from . import firmware_path
from .messages import NOTHING_TO_DO, Message, Plain, Remedy

DISTRIBUTION = "kickstand-lean"  # as in pyproject.toml; the package "kickstand" belongs to another project


class InputError(Exception):
    """Input from the user that cannot be used. The text is one line: what is wrong, and what to do.

    what: a Message, or a text that says what is wrong.
    remedy: what to do. Leave it out if `what` already says what to do, in words for both a terminal and a page.
    """

    def __init__(self, what: Message | str, remedy: Remedy = NOTHING_TO_DO) -> None:
        super().__init__(what, remedy)
        self.message = Plain(what, remedy) if isinstance(what, str) else what

    def __str__(self) -> str:
        return self.line()

    def line(self, page: bool = False) -> str:
        """The error in one line: what is wrong, and what to do. page: True for a page, which has no commands."""
        return self.message.line(page)


class RefusedInput(InputError):
    """Data that a check or the firmware's own modules refuse.

    message: the reason, with its code and its fields.
    where: text before the message, usually the file.
    advice: text after the message.
    """

    def __init__(self, message: Message, where: str = "", advice: str = "") -> None:
        super().__init__(message)
        self.args = message, where, advice  # needed for pickling, because another process may raise the error
        self.where, self.advice = where, advice

    @property
    def code(self) -> str:
        """The code of the reason."""
        return self.message.code

    def at(self, where: str) -> "RefusedInput":
        """Return the same refusal, with `where` before its message."""
        return RefusedInput(self.message, where, self.advice)

    def line(self, page: bool = False) -> str:
        """See InputError."""
        line = f"{self.message.line(page)}{self.advice}"
        return f"{self.where}: {line}" if self.where else line


def cause(error: BaseException) -> str:
    """Return the reason of an operating system's error without its number, such as "Permission denied"."""
    return getattr(error, "strerror", None) or str(error) or type(error).__name__


def printable(text: str) -> str:
    """Replace characters that control a terminal, such as ESC, by their codes."""
    return "".join(c if c in "\n\t" or c.isprintable() else ascii(c)[1:-1] for c in text)


def extra(name: str) -> str:
    """Return the command that installs an optional part of the project.

    In a checkout, the command has the option -e and the path. Without -e, pip would install a copy, and `kickstand
    flash` would use the firmware in this copy.
    """
    if firmware_path.installed():
        return f'{sys.executable} -m pip install "{DISTRIBUTION}[{name}]"'
    return f'{sys.executable} -m pip install -e "{firmware_path.TOOLS.parent}[{name}]"'


def leaf(folder: str) -> str:
    """Return the command that installs a package beside the core.

    folder: its name below tools/, such as "fleet", or with an extra "fleet[s3]".
    """
    if firmware_path.installed():
        return f'{sys.executable} -m pip install "kickstand-{folder}"'
    return f'{sys.executable} -m pip install -e "{firmware_path.TOOLS}/{folder}"'
