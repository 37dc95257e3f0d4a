"""Tests hold promises, not code: how many private names they use and how many parts they replace may only fall."""

import ast
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
TESTS = [*ROOT.glob("host_tests/**/*.py"), *ROOT.glob("tools/*/tests/**/*.py")]
PRIVATE_USES, REPLACED_PARTS = 14, 89
REPLACE = ("setattr", "setitem", "delattr", "delitem", "patch")


def is_private(name):
    return name.startswith("_") and not name.startswith("__")


def private_uses(node):
    """Count attributes `_x` of anything but self and cls, and imports of `_x`."""
    if isinstance(node, ast.Attribute):
        is_own = isinstance(node.value, ast.Name) and node.value.id in ("self", "cls")
        return int(is_private(node.attr) and not is_own)
    return sum(is_private(alias.name) for alias in node.names) if isinstance(node, ast.ImportFrom) else 0


def replaces_a_part(node):
    return isinstance(node, ast.Call) and ast.unparse(node.func).rpartition(".")[2] in REPLACE


def test_tests_use_few_private_names_and_replace_few_parts():
    nodes = [node for path in TESTS for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))]
    assert sum(map(private_uses, nodes)) <= PRIVATE_USES
    assert sum(map(replaces_a_part, nodes)) <= REPLACED_PARTS
