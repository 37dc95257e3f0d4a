"""HTML and SVG from templates of Jinja. A template is a file beside the module that fills it."""

import base64
import hashlib
from pathlib import Path
from typing import Any

from jinja2 import Environment, StrictUndefined

_ENVIRONMENT = Environment(
    autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True, keep_trailing_newline=True
)
_ENVIRONMENT.policies["json.dumps_kwargs"] = {"allow_nan": False, "ensure_ascii": False}


def filled(template: Path, **values: Any) -> str:
    """A template with these values, each escaped but where the template says `| safe`; `| tojson` is JSON for an
    element of HTML. Raises jinja2.UndefinedError for a value that is missing."""
    return _ENVIRONMENT.from_string(template.read_text(encoding="utf-8")).render(values)


def source_hash(script: str) -> str:
    """A script as a content security policy names it: nothing else runs."""
    return f"'sha256-{base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()}'"
