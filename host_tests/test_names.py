"""Locals are nouns of the field: few bind an everyday word. The budgets may only fall; the aim is 2 % each."""

import ast
from collections import Counter
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
EVERYDAY = frozenset(
    "after again any asked at back before beside both done each every found given gone got heard held here how kept "
    "known made met more most none nothing now one others own place put rest said same seen several shown some taken "
    "there told wanted what when where which who whole why".split()
)


@pytest.mark.parametrize(("folder", "percent"), [("host_tests", 2.0), ("firmware", 2.0), ("tools", 2.0)])
def test_few_locals_are_everyday_words(folder, percent):
    trees = [ast.parse(path.read_text(encoding="utf-8")) for path in (ROOT / folder).rglob("*.py")]
    functions = [node for tree in trees for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)]
    stored = {node for function in functions for node in ast.walk(function) if isinstance(node, ast.Name)}
    names = Counter(node.id for node in stored if isinstance(node.ctx, ast.Store))
    everyday = Counter({name: count for name, count in names.items() if name in EVERYDAY})
    assert everyday.total() <= percent / 100 * names.total(), everyday.most_common(9)
