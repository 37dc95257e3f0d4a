"""Notices in words, on standard error."""

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

import click

if TYPE_CHECKING:
    from kickstand.errors import Notice


def warn(log: Path | str, notices: "Iterable[Notice]") -> None:
    """A line for each notice. log: what they are about."""
    from ..refusals import sentence

    for notice in notices:
        click.echo(f"warning: {log}: {sentence(notice)}", err=True)
