"""Makes HTML, CSS and SVG from Jinja templates.

A template is a file beside the module that fills it. A template includes another template by its path in
kickstand_tools: `{% include "common/theme.css" %}`.
"""

import base64
import functools
import hashlib
from pathlib import Path
from typing import Any


@functools.cache
def _environment() -> Any:
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

    In a template, a value is escaped unless it has the filter `| safe`. The filter `| tojson` writes JSON for an HTML
    element.
    """
    return _environment().from_string(template.read_text(encoding="utf-8")).render(values)


def source_hash(script: str) -> str:
    """Return the hash of a script, for a content security policy that allows only scripts with this hash."""
    return f"'sha256-{base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()}'"
