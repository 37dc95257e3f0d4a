"""The error for input that cannot be used, and parts of its text."""

import sys

from . import firmware_path
from .messages import NOTHING_TO_DO, Message, Plain, Remedy

DISTRIBUTION = "kickstand-lean"  # as in pyproject.toml; the package "kickstand" belongs to another project


class InputError(Exception):
    """Input from the user that cannot be used. The text is one line: the fault, and what to do.

    what: a Message, or what is wrong in words. remedy: what to do about it; leave it out if `what` says it in words
    that suit a terminal and a page.
    """

    def __init__(self, what: Message | str, remedy: Remedy = NOTHING_TO_DO) -> None:
        super().__init__(what, remedy)
        self.message = Plain(what, remedy) if isinstance(what, str) else what

    def __str__(self) -> str:
        return self.line()

    def line(self, page: bool = False) -> str:
        """What is wrong and what to do, in one line. page: in the words of a page, not of a terminal."""
        return self.message.line(page)


class RefusedInput(InputError):
    """Data that a check refuses, or the firmware's own modules. message: the reason, with its code and its fields.

    where: put before the line, usually the file. advice: put after it.
    """

    def __init__(self, message: Message, where: str = "", advice: str = "") -> None:
        super().__init__(message)
        self.args = message, where, advice  # what it is pickled with: another process may raise it
        self.where, self.advice = where, advice

    @property
    def code(self) -> str:
        """The code of the reason."""
        return self.message.code

    def at(self, where: str) -> "RefusedInput":
        """The same refusal of data from `where`."""
        return RefusedInput(self.message, where, self.advice)

    def line(self, page: bool = False) -> str:
        """See InputError."""
        line = f"{self.message.line(page)}{self.advice}"
        return f"{self.where}: {line}" if self.where else line


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
