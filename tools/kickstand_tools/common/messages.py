"""The base classes of notices and refusals. Each kind of notice is a class with named fields, a text and a remedy.

Define a class in the module of the check that returns it:

    class SpeedLate(Message):
        late_s: float

        code = "speed-late"
        text = "the speed is {late_s:.1f} s late"
        todo = Remedy("under 2 s are needed")

Each subclass of Message is a frozen dataclass, so it needs no decorator. Override sentence() or remedy() if a template
is not enough.
"""

from collections.abc import Iterable
from dataclasses import dataclass, fields
from math import isfinite
from typing import Any, ClassVar, dataclass_transform

AT_REST = "at rest up reads +1 g"
OPPOSITE_SIGN = f"do all accelerations have the opposite sign? {AT_REST.capitalize()}"


@dataclass(frozen=True)
class Remedy:
    """What the user can do, in words for a terminal and in words for a page.

    terminal: may name commands and options.
    page: must not name them, because a page has no commands. None if both versions are the same.
    """

    terminal: str = ""
    page: str | None = None

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
    """A notice, or the reason for a refusal.

    code: a short name of the message, for programs.
    text: template of the sentence, in which {name} is a field.
    todo: template of the remedy, in which {name} is a field.
    """

    code: ClassVar[str] = ""
    text: ClassVar[str] = ""
    todo: ClassVar[Remedy] = NOTHING_TO_DO

    def __init_subclass__(cls) -> None:
        dataclass(frozen=True)(cls)

    def sentence(self) -> str:
        """Return one line that says what happened, without a full stop."""
        return self.text.format(**vars(self))

    def remedy(self) -> Remedy:
        """The remedy for the user."""
        return self.todo.filled(**vars(self))

    def line(self, page: bool = False) -> str:
        """Return sentence and remedy in one line, without a full stop.

        page: True for a page, which has no commands.
        """
        remedy = self.remedy().words(page)
        return f"{self.sentence()}: {remedy}" if remedy else self.sentence()

    @property
    def values(self) -> tuple[Any, ...]:
        """The values of the fields, in the order of the fields."""
        return tuple(getattr(self, field.name) for field in fields(self))


class Plain(Message):
    """A message without a code of its own. Its text is written where it is raised."""

    said: str
    what_to_do: Remedy = NOTHING_TO_DO

    def sentence(self) -> str:
        """See Message."""
        return self.said

    def remedy(self) -> Remedy:
        """See Message."""
        return self.what_to_do


class WrongAxes(Message):
    """The log's axes, their signs or the unit of the rates are wrong. The log must be corrected before it is used."""


class WrongMount(Message):
    """The calibration belongs to another mount.

    judged: True if the log still shows how far the alignment is off.
    """

    judged: ClassVar[bool] = False


def sentence(message: Message, page: bool = False) -> str:
    """Return the message in one line without a full stop: what is wrong and, if there is a remedy, what to do.

    page: True for a page, which has no commands.

    >>> from kickstand_tools.calibration.pose_refusals import SamePose
    >>> sentence(SamePose(0.4))
    'both poses are the same (0.4 degrees apart): take one on the kickstand and one upright'
    """
    return message.line(page)


def by_code(*classes: type[Message]) -> dict[str, type[Message]]:
    """Return a dictionary from each code to its class."""
    return {one.code: one for one in classes}


def defined_in(module: str) -> list[type[Message]]:
    """Return the messages that a module defines. module: its __name__."""
    return [one for one in Message.__subclasses__() if one.__module__ == module]


def is_explained(messages: Iterable[Message]) -> bool:
    """True if a message about wrong axes or another mount explains readings that do not fit."""
    return any(isinstance(message, (WrongAxes, WrongMount)) for message in messages)


def distinct(messages: Iterable[Message]) -> list[Message]:
    """Return the messages in their order, without repetitions. A log that is read twice is also checked twice."""
    found: dict[str, Message] = {}
    for message in messages:
        found.setdefault(message.line(), message)
    return list(found.values())


def as_data(messages: Iterable[Message]) -> list[dict[str, object]]:
    """Return code, values and text of each message, for JSON. A value that is not finite becomes None."""

    def plain(value: object) -> object:
        return (round(value, 3) if isfinite(value) else None) if isinstance(value, float) else value

    return [
        {"code": message.code, "values": [plain(value) for value in message.values], "words": message.line()}
        for message in messages
    ]
