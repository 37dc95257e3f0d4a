"""A config.py as a form has it: the settings in it, and the same file with others."""

import ast
import re

from ..errors import InputError


def values(text: str) -> dict[str, str]:
    """{name: its value as it is written there} of the settings that a config.py sets. Raises InputError if the file is
    more than lines NAME = VALUE, which a form cannot show.

    >>> values('SIDE = "right"  # mine\\n# RECORD = False\\n')
    {'SIDE': '"right"'}
    """
    return {name: ast.get_source_segment(text, node.value) or "" for name, node in _assigned(text).items()}


def with_values(text: str, wanted: dict[str, str | None]) -> str:
    """The file with these values, None for a default. All else in it stays. Raises InputError as values(), and for
    what is no value.

    >>> before = '# SIDE = "left"   # or "right"\\nRECORD = True\\n'
    >>> print(with_values(before, {"SIDE": '"right"', "RECORD": None}), end="")
    SIDE = "right"   # or "right"
    # RECORD = True
    """
    lines = text.splitlines()
    assigned = _assigned(text)
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
                lines[begin:end] = [f"# {line}" for line in lines[begin:end]]
            else:
                rest = lines[end - 1].encode()[node.end_col_offset or 0 :].decode()
                # one line more or less would move the settings below
                lines[begin:end] = [f"{name} = {value}{rest}", *[""] * (end - begin - 1)]
        elif value is not None:
            usual = re.compile(rf"# {name} = .*?(?=\s*#|$)")
            at = next((i for i, line in enumerate(lines) if usual.match(line)), None)
            if at is None:
                added.append(f"{name} = {value}")
            else:
                lines[at] = f"{name} = {value}" + usual.sub("", lines[at], count=1)
    return "\n".join([*lines, *added]) + "\n"


def _assigned(text: str) -> dict[str, ast.Assign]:
    """The last assignment to each name."""
    try:
        body = ast.parse(text).body
    except (SyntaxError, ValueError) as error:
        raise InputError(f"config.py cannot be read ({error}): correct it by hand") from error
    found = {}
    for i, node in enumerate(body):
        if i == 0 and isinstance(node, ast.Expr):
            continue  # what the file is for, in words
        target = node.targets[0] if isinstance(node, ast.Assign) and len(node.targets) == 1 else None
        if not (isinstance(node, ast.Assign) and isinstance(target, ast.Name)) or node.col_offset:
            raise InputError(f"config.py, line {node.lineno} is no setting NAME = VALUE: change this file by hand")
        found[target.id] = node
    return found


def _check(name: str, value: str) -> None:
    try:
        ast.literal_eval(value)
    except (SyntaxError, ValueError, RecursionError) as error:
        raise InputError(f"{name} = {value} is no value: texts stand in quotes") from error
    if "\n" in value or "\r" in value:
        raise InputError(f"{name}: a value stands in one line")
