"""Makes single changes to a file, with some operators of cosmic-ray and two of our own.

cosmic-ray can replace an operator in the code by eleven other operators. This module uses only one or two similar
operators, because the other operators would find the same missing tests.
"""

import ast
from pathlib import Path
from typing import NamedTuple

import parso.python.tree
from cosmic_ray.ast import ast_nodes, get_ast, is_number
from cosmic_ray.mutating import mutate_code
from cosmic_ray.operators.operator import Operator
from cosmic_ray.plugins import get_operator

OPERATORS = (
    *["ReplaceBinaryOperator_" + name for name in ("Add_Sub", "Sub_Add", "Mul_Div", "Div_Mul", "FloorDiv_Mul")],
    *["ReplaceBinaryOperator_" + name for name in ("Mod_FloorDiv", "Pow_Mul", "RShift_LShift", "LShift_RShift")],
    *["ReplaceBinaryOperator_" + name for name in ("BitOr_BitAnd", "BitAnd_BitOr", "BitXor_BitOr")],
    *["ReplaceComparisonOperator_" + name for name in ("Lt_LtE", "LtE_Lt", "Gt_GtE", "GtE_Gt")],
    *["ReplaceComparisonOperator_" + name for name in ("Eq_NotEq", "NotEq_Eq", "Is_IsNot", "IsNot_Is")],
    *["ReplaceUnaryOperator_Delete_" + name for name in ("USub", "Not", "Invert")],
    *("ReplaceTrueWithFalse", "ReplaceFalseWithTrue", "ReplaceAndWithOr", "ReplaceOrWithAnd"),
    *("ReplaceBreakWithContinue", "ReplaceContinueWithBreak", "ExceptionReplacer", "ZeroIterationForLoop"),
    "AddNot",  # replaces a condition by its opposite
)
SMALL = 16  # larger integers are doubled and halved, smaller ones (counts, indices) are changed by +1 and -1


class Change(NamedTuple):
    """A change of one place in a file.

    path: Path of the file, relative to the project's root.
    line: Number of the changed line, from 1.
    operator: Kind of the change.
    occurrence: Number of the place in the file, among all places for this operator.
    """

    path: Path
    line: int
    operator: Operator
    occurrence: int

    def mutant(self, source: str) -> str | None:
        """Return the changed text of the file.

        Returns None if the text is not Python, or if only annotations and decorators differ.
        """
        try:
            text = mutate_code(source, self.operator, self.occurrence)
        except AttributeError:  # cosmic-ray cannot replace an exception with a dotted name, such as gzip.BadGzipFile
            return None
        return None if text is None or _bare(text) in (None, _bare(source)) else text


class Number(Operator):
    """Changes numbers. A changed number that no test notices is a limit that no test checks."""

    def mutation_positions(self, node):
        if is_number(node):
            for _ in self._others(node):
                yield node.start_pos, node.end_pos

    def mutate(self, node, index):
        return parso.python.tree.Number(repr(self._others(node)[index]), node.start_pos, node.prefix)

    @staticmethod
    def _others(node):
        value = ast.literal_eval(node.value)
        if value in (0, 1):
            return (type(value)(value + 1), type(value)(0))[: int(value) + 1]
        if isinstance(value, int):
            return (value + 1, value - 1) if value <= SMALL else (value * 2, value // 2)
        return (value * 2, value / 2)

    @classmethod
    def examples(cls):
        return ()


class Drop(Operator):
    """Leaves out statements: calls, raises, early returns, assignments to attributes and elements."""

    def mutation_positions(self, node):
        if node.type == "simple_stmt" and self._matters(node.children[0]):
            yield node.children[0].start_pos, node.children[0].end_pos

    def mutate(self, node, index):
        old = node.children[0]
        node.children[0] = parso.python.tree.Name("pass", old.start_pos, old.get_first_leaf().prefix)
        return node

    @staticmethod
    def _matters(statement):
        if statement.type in ("raise_stmt", "atom_expr") or statement.get_first_leaf().value == "raise":
            return True
        if statement.get_first_leaf().value == "return":
            return statement.parent.parent.parent.type != "funcdef"
        if statement.type != "expr_stmt":
            return False
        if statement.children[1].type == "operator" and statement.children[1].value != "=":
            return True
        function = statement.search_ancestor("funcdef")
        return statement.children[0].type == "atom_expr" and function and function.name.value != "__init__"

    @classmethod
    def examples(cls):
        return ()


def operators() -> list[Operator]:
    """Return one operator for each kind of change."""
    return [*[get_operator("core/" + name)() for name in OPERATORS], Number(), Drop()]


def changes(path: Path, root: Path) -> list[Change]:
    """Return all changes of a file in the order of its lines. path: path of the file, relative to root."""
    nodes = list(ast_nodes(get_ast((root / path).read_text("utf-8"))))
    found = []
    for operator in operators():
        positions = [begin for node in nodes for begin, _ in operator.mutation_positions(node)]
        found += [Change(path, line, operator, number) for number, (line, _) in enumerate(positions)]
    return sorted(found, key=lambda change: change.line)


def _bare(source: str) -> str | None:
    """Return the syntax tree of the text without annotations and decorators, or None if it is not Python."""
    try:
        tree = ast.parse(source)
    except SyntaxError:
        return None
    for node in ast.walk(tree):
        for field, nothing in (("annotation", None), ("returns", None), ("decorator_list", [])):
            if hasattr(node, field):
                setattr(node, field, nothing)
    return ast.dump(tree)
