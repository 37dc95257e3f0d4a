"""Notices and refusals, and the errors with their text.

Each kind of message is a line of a table in the module of the check that returns it:

SpeedLate = kind("speed-late", "late_s", "the speed is {late_s:.1f} s late", Remedy("under 2 s are needed"))

raise RefusedInput(SpeedLate(2.5))
"""

import sys
from collections.abc import Callable, Iterable
from dataclasses import dataclass, fields
from math import isfinite
from typing import TYPE_CHECKING, Any, ClassVar, dataclass_transform

AT_REST = "at rest up reads +1 g"
OPPOSITE_SIGN = f"do all accelerations have the opposite sign? {AT_REST.capitalize()}"


@dataclass(frozen=True)
class Remedy:
    """What the user can do, in words for a terminal and in words for a page, which has no commands and options."""

    terminal: str = ""
    page: str | None = None  # None if both versions are the same

    def words(self, page: bool = False) -> str:
        """Return the text for a page or for a terminal; "" if the user can do nothing."""
        return self.terminal if not page or self.page is None else self.page

    def followed(self, more: str) -> "Remedy":
        """Return the remedy with these words added to both versions."""
        return Remedy(self.terminal + more, None if self.page is None else self.page + more)

    def filled(self, **values: object) -> "Remedy":
        """Return the remedy with each {name} replaced by the value of this name."""
        return Remedy(self.terminal.format(**values), None if self.page is None else self.page.format(**values))


NOTHING_TO_DO = Remedy()


@dataclass_transform(frozen_default=True)
@dataclass(frozen=True)
class Message:
    """A notice, or the reason for a refusal. Its fields are the values in its text."""

    code: ClassVar[str] = ""  # a short name of the message, for programs
    text: ClassVar[Any] = ""  # template of the sentence, in which {name} is a field, or a function of the message
    todo: ClassVar[Any] = NOTHING_TO_DO  # template of the remedy, or a function of the message

    def __init_subclass__(cls) -> None:
        dataclass(frozen=True)(cls)

    if TYPE_CHECKING:

        def __getattr__(self, name: str) -> Any:
            """A field of a kind(), which a type checker does not know."""

    def sentence(self) -> str:
        """Return one line that says what happened, without a full stop."""
        text: Any = type(self).text
        return text.format(**vars(self)) if isinstance(text, str) else text(self)

    def remedy(self) -> Remedy:
        todo: Any = type(self).todo
        return todo.filled(**vars(self)) if isinstance(todo, Remedy) else todo(self)

    def line(self, page: bool = False) -> str:
        """Return the message in one line without a full stop: what is wrong and, if there is a remedy, what to do.

        page: True for a page, which has no commands.

        >>> from kickstand_tools.calibration.refusals import SamePose
        >>> SamePose(0.4).line()
        'both poses are the same (0.4 degrees apart): take one on the kickstand and one upright'
        """
        remedy = self.remedy().words(page)
        return f"{self.sentence()}: {remedy}" if remedy else self.sentence()

    @property
    def values(self) -> tuple[Any, ...]:
        return tuple(getattr(self, field.name) for field in fields(self))


class WrongAxes(Message):
    """The log's axes, their signs or the unit of the rates are wrong. The log must be corrected before it is used."""


class WrongMount(Message):
    """The calibration belongs to another mount."""

    judged: ClassVar[bool] = False  # True if the log still shows how far the alignment is off


def kind(
    code: str,
    names: str = "",
    text: str | Callable[[Any], str] = "",
    todo: Remedy | Callable[[Any], Remedy] = NOTHING_TO_DO,
    base: type[Message] = Message,
    **settings: object,
) -> type[Any]:
    """Make a kind of message. Assign it to its code in camel case: SpeedLate = kind("speed-late", ...).

    names: names of the fields, separated by spaces. A field that may be left out has =None.
    settings: values of other class variables of `base`.
    """
    split = [name.partition("=") for name in names.split()]
    members = {"code": code, "text": text, "todo": todo, "__doc__": f"The message {code}.", **settings}
    members |= {"__module__": sys._getframe(1).f_globals["__name__"]}  # for pickle, as in namedtuple()
    members |= {"__annotations__": {name: Any for name, _, _ in split}}
    members |= {name: None for name, equals, _ in split if equals}
    return type("".join(word.capitalize() for word in code.split("-")), (base,), members)


class Plain(Message):
    """A message without a code of its own. Its text is written where it is raised."""

    words: str
    what_to_do: Remedy = NOTHING_TO_DO

    text = staticmethod(lambda message: message.words)
    todo = staticmethod(lambda message: message.what_to_do)


sentence = Message.line  # as a function, for programs that use the API


def by_code(*kinds: type[Message]) -> dict[str, type[Any]]:
    """Return a dictionary from each code to its kind."""
    return {each.code: each for each in kinds}


def is_explained(messages: Iterable[Message]) -> bool:
    """True if a message about wrong axes or another mount explains readings that do not fit."""
    return any(isinstance(message, (WrongAxes, WrongMount)) for message in messages)


def as_data(messages: Iterable[Message]) -> list[dict[str, object]]:
    """Return code, values and text of each message, for JSON. A value that is not finite becomes None."""

    def plain(value: object) -> object:
        return (round(value, 3) if isfinite(value) else None) if isinstance(value, float) else value

    return [
        {"code": message.code, "values": [plain(value) for value in message.values], "words": message.line()}
        for message in messages
    ]


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
        """Return the text, see Message.line()."""
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
        return self.message.code

    def at(self, where: str) -> "RefusedInput":
        """Return the same refusal, with `where` before its message."""
        return RefusedInput(self.message, where, self.advice)

    def line(self, page: bool = False) -> str:
        line = f"{self.message.line(page)}{self.advice}"
        return f"{self.where}: {line}" if self.where else line


def cause(error: BaseException) -> str:
    """Return the reason of an operating system's error without its number, such as "Permission denied"."""
    return getattr(error, "strerror", None) or str(error) or type(error).__name__


def printable(text: str) -> str:
    """Replace characters that control a terminal, such as ESC, by their codes."""
    return "".join(c if c in "\n\t" or c.isprintable() else ascii(c)[1:-1] for c in text)
