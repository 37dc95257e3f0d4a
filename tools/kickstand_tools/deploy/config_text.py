"""Reads the settings of a config.py for a form, and writes the form's settings to the text of the file."""

import ast
import codecs
import re

from ..common.messages import InputError, Remedy


def cleaned(data: bytes) -> bytes:
    """Convert a config.py to UTF-8 without a byte order mark, because MicroPython reads nothing else. Notepad and
    PowerShell write byte order marks and UTF-16.

    Raises InputError for other encodings.

    >>> cleaned("\ufeffSIDE = 1".encode("utf-16")), cleaned(b"\xef\xbb\xbfSIDE = 1")
    (b'SIDE = 1', b'SIDE = 1')
    """
    try:
        encoding = "utf-16" if data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)) else "utf-8"
        text = data.decode(encoding).replace("\ufeff", "")
    except UnicodeDecodeError as error:
        raise InputError("config.py is not text in UTF-8", Remedy("save it in that encoding")) from error
    if "\0" in text:
        raise InputError("config.py is not text in UTF-8", Remedy("save it in that encoding"))
    return text.encode()


def lines(text: str) -> list[str]:
    """Split the text into the lines that Python counts. str.splitlines() would also split at a form feed or U+2028."""
    parts = re.split(r"\r\n|\r|\n", text)
    return parts if parts[-1] else parts[:-1]


def values(text: str) -> dict[str, str]:
    """Return the settings of a config.py, as {name: value as written}.

    Raises InputError if a form cannot show the file. A form can only show lines NAME = VALUE with literal values and
    different names.

    >>> values('SIDE = "right"  # mine\\n# RECORD = False\\n')
    {'SIDE': '"right"'}
    """
    return {name: ast.get_source_segment(text, node.value) or "" for name, node in _assignments(text).items()}


def with_values(text: str, wanted: dict[str, str | None]) -> str:
    """Write values into the text of a config.py, and return the new text. The rest of the text is kept.

    wanted: New value of each setting, as written. None restores the default.

    Raises InputError if a form cannot show the file (see values()), and if a value is invalid.

    >>> before = '# SIDE = "left"   # or "right"\\nRECORD = True\\n'
    >>> print(with_values(before, {"SIDE": '"right"', "RECORD": None}), end="")
    SIDE = "right"   # or "right"
    # RECORD = True
    """
    written = lines(text)
    assigned = _assignments(text)
    added = []
    for name, value in wanted.items():
        if value is not None:
            _check(name, value)
        node = assigned.get(name)
        if node and value == ast.get_source_segment(text, node.value):
            continue
        if node:
            begin, end = node.lineno - 1, node.end_lineno or node.lineno
            if value is None:
                written[begin:end] = [f"# {line}" for line in written[begin:end]]
            else:
                tail = written[end - 1].encode()[node.end_col_offset or 0 :].decode()
                # Keep the number of lines, because the positions of the settings below must stay the same
                written[begin:end] = [f"{name} = {value}{tail}", *[""] * (end - begin - 1)]
        elif value is not None:
            usual = re.compile(rf"# {name} = .*?(?=\s*#|$)")
            index = next((i for i, line in enumerate(written) if usual.match(line)), None)
            if index is None:
                added.append(f"{name} = {value}")
            else:
                written[index] = f"{name} = {value}" + usual.sub("", written[index], count=1)
    return "\n".join([*written, *added]) + "\n"


def _assignments(text: str) -> dict[str, ast.Assign]:
    """Return the assignment to each name. The file is not executed, because it may come from any board."""
    try:
        body = ast.parse(text).body
    except (SyntaxError, ValueError) as error:
        raise InputError(f"config.py cannot be read ({error}): correct it by hand") from error
    assignments = {}
    for i, node in enumerate(body):
        if i == 0 and isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
            continue  # the file's docstring
        target = node.targets[0] if isinstance(node, ast.Assign) and len(node.targets) == 1 else None
        if not (isinstance(node, ast.Assign) and isinstance(target, ast.Name)) or node.col_offset:
            raise InputError(f"config.py, line {node.lineno} is not a setting NAME = VALUE: change this file by hand")
        if target.id in assignments:
            raise InputError(f"config.py, line {node.lineno} sets {target.id} again: change this file by hand")
        try:
            ast.literal_eval(node.value)
        except (ValueError, TypeError, RecursionError) as error:
            raise InputError(
                f"config.py, line {node.lineno} computes {target.id}, it is not a literal: change this file by hand"
            ) from error
        assignments[target.id] = node
    return assignments


def _check(name: str, value: str) -> None:
    try:
        ast.literal_eval(value)
    except (SyntaxError, ValueError, RecursionError) as error:
        raise InputError(f"{name} = {value} is not a value: put text in quotes") from error
    if "\n" in value or "\r" in value:
        raise InputError(f"{name}: a value must be on one line")
