"""Writes SVG drawings for the pages and the READMEs.

The elements are written as text, which takes a millisecond per picture. A fleet has thousands of pictures.
"""

from markupsafe import Markup, escape


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
