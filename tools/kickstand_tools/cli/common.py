"""What several commands share: times as they are given, and notices in words on standard error."""

import inspect
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    from kickstand.errors import Notice


class Time(click.ParamType):
    """Seconds (60, 12.5), minutes and seconds (1:00) or hours too (1:02:03); negative: before the end (-1:30)."""

    name = "time"

    def convert(self, value: object, param: click.Parameter | None, ctx: click.Context | None) -> float:
        """In seconds."""
        if isinstance(value, float):
            return value
        text = str(value)
        sign, cells = (-1.0, text[1:].split(":")) if text.startswith("-") else (1.0, text.split(":"))
        try:
            numbers = [*(int(cell) for cell in cells[:-1]), float(cells[-1])]
        except ValueError:
            numbers = [-1.0]
        seconds = sum(60**place * number for place, number in enumerate(reversed(numbers)))
        if len(cells) > 3 or min(numbers) < 0 or not seconds < float("inf"):
            self.fail(f"{text!r} is no time: give seconds such as 60 or 12.5, or minutes and seconds such as 1:00")
        return sign * seconds


TIME = Time()


def on_right_handed_axes(command: Callable[..., Any]) -> Callable[..., Any]:
    """A command whose help says what the axes of its logs have to be."""
    line = "The log's axes and rates have to be right-handed, and the axis that points up has to read +1 g at rest."
    command.__doc__ = f"{inspect.cleandoc(command.__doc__ or '')}\n\n{line}"
    return command


def warn(log: Path | str, notices: "Iterable[Notice]") -> None:
    """A line for each notice. log: what they are about."""
    from ..refusals import sentence

    for notice in notices:
        click.echo(f"warning: {log}: {sentence(notice)}", err=True)
