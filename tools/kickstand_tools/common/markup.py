"""Makes HTML, CSS and SVG: files from Jinja templates, SVG drawings from elements, and the times in them.

A template is a file beside the module that fills it. It includes another template by its path in kickstand_tools:
`{% include "common/theme.css" %}`. SVG elements are written as text, which takes a millisecond per drawing. A fleet
has thousands of drawings.
"""

import base64
import functools
import hashlib
from pathlib import Path
from typing import Any

from markupsafe import Markup, escape


@functools.cache
def _environment() -> Any:
    """Return the settings of all templates."""
    from jinja2 import Environment, FileSystemLoader, StrictUndefined  # here, because it takes 50 ms

    environment = Environment(
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
        loader=FileSystemLoader(Path(__file__).parents[1]),
    )
    environment.policies["json.dumps_kwargs"] = {"allow_nan": False, "ensure_ascii": False}
    return environment


def filled(template: Path, **values: Any) -> str:
    """Fill a template with values. Raises jinja2.UndefinedError for a missing value.

    In a template, a value is escaped unless it has the filter `| safe`, or `| tojson` for JSON in an HTML element.
    """
    return _environment().from_string(template.read_text(encoding="utf-8")).render(values)


def source_hash(script: str) -> str:
    """Return the hash of a script, for a content security policy that allows only scripts with this hash."""
    return f"'sha256-{base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()}'"


def element(name: str, *inside: str, **attributes: object) -> Markup:
    """Return an SVG element.

    inside: other elements, and text, which is escaped.
    attributes: write _ for -, and add _ to a word that Python reserves. Numbers are rounded to hundredths. An attribute
        that is None is left out.

    >>> print(element("text", "1 < 2", x=1.25, text_anchor="end", class_="small"))
    <text x="1.25" text-anchor="end" class="small">1 &lt; 2</text>
    """
    properties = "".join(
        f' {key.rstrip("_").replace("_", "-")}="{_written(value)}"'
        for key, value in attributes.items()
        if value is not None
    )
    body = "".join(map(escape, inside))
    return Markup(f"<{name}{properties}>{body}</{name}>" if inside else f"<{name}{properties}/>")


def drawing(size: tuple[float, float], *inside: str, **attributes: object) -> Markup:
    """Return a whole SVG file. size: width and height, in pixels or other units."""
    box = f"0 0 {_written(size[0])} {_written(size[1])}"
    lines = (Markup("\n") + part for part in inside)
    return element("svg", *lines, Markup("\n"), xmlns="http://www.w3.org/2000/svg", viewBox=box, **attributes) + "\n"


def path(points: list[tuple[float, float]]) -> str:
    """Return the attribute d of a path from point to point.

    >>> path([(0, 0), (1.5, 2)])
    'M0 0L1.5 2'
    """
    return "M" + "L".join(f"{_written(x)} {_written(y)}" for x, y in points)


def _written(value: object) -> str:
    return f"{round(value, 2):.10g}" if isinstance(value, (int, float)) else str(escape(value))


def clock(seconds: float) -> str:
    """Format a time as h:mm:ss or m:ss, such as 1:02:03 or 2:03."""
    rounded = round(seconds)
    hours, minutes = rounded // 3600, rounded // 60 % 60
    return f"{hours}:{minutes:02d}:{rounded % 60:02d}" if hours else f"{minutes}:{rounded % 60:02d}"


def tick_s(seconds: float) -> float:
    """Return a round interval in s between the ticks of a time axis. The axis then has 6 to 12 ticks."""
    return next((tick for tick in (1, 2, 5, 10, 20, 30, 60, 120, 300, 600, 1800) if seconds < 12 * tick), 3600)
