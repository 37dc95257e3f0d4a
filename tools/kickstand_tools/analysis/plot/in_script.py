"""Values as the script in a page holds them."""

import base64
import hashlib
import json
from typing import Any

import numpy as np

from ...logs.table import Array


def plain(values: Array, digits: int = 3) -> list[float | None]:
    """Numbers as JSON can hold them: None for NaN, and a page need not hold sixteen digits."""
    return [None if value != value else value for value in np.round(values, digits).tolist()]


def as_script(value: Any) -> str:
    """A value as JSON, within an element of HTML."""
    return json.dumps(value, allow_nan=False, ensure_ascii=False).replace("<", "\\u003c")


def source_hash(script: str) -> str:
    """A script as a content security policy names it: nothing else runs."""
    return f"'sha256-{base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()}'"
