"""Machine code out of a .mpy file: MicroPython's documentation, ".mpy files", and its py/persistentcode.c."""

import ast
from dataclasses import dataclass, field
from pathlib import Path

from kickstand_tools.deploy import bytecode

_BYTECODE, _VIPER = 0, 2
_FUNCTION_TABLE, _CONSTANTS, _TUPLE = 0, (1, 2, 3, 4), 10  # kinds of objects; the rest have a length
_NAMELESS = (7, 8, 9)  # int, float, complex: without the zero that ends strings


@dataclass
class Module:
    """functions: the machine code of each viper function by name.  table_at: which of the module's objects is the table
    of MicroPython's helpers.  objects: how many it has."""

    table_at: int = -1
    objects: int = 0
    functions: dict[str, bytes] = field(default_factory=dict)


class _Reader:
    def __init__(self, data: bytes) -> None:
        self.data = data
        self.at = 0

    def bytes(self, n: int) -> bytes:
        self.at += n
        return self.data[self.at - n : self.at]

    def number(self) -> int:
        """Seven bits a byte, the highest first; the last byte has its top bit clear."""
        value = 0
        while True:
            byte = self.bytes(1)[0]
            value = value << 7 | byte & 0x7F
            if byte < 0x80:
                return value


def viper_names(source: Path) -> list[str]:
    """Of the functions that are decorated with micropython.viper, in their order."""
    functions = [node for node in ast.parse(source.read_text()).body if isinstance(node, ast.FunctionDef)]
    return [f.name for f in functions if "micropython.viper" in map(ast.unparse, f.decorator_list)]


def load(source: Path, architecture: str) -> Module:
    """A module compiled for an architecture as mpy-cross names it. Raises bytecode.CannotCompile."""
    reader, module = _Reader(bytecode.cross_compiled(source, architecture)), Module()
    assert reader.bytes(2) == b"M\6" and not reader.bytes(2)[0] & 0x40, "another format"
    strings, module.objects = reader.number(), reader.number()
    for _ in range(strings):
        length = reader.number()
        if not length & 1:  # else one that MicroPython has already
            reader.bytes((length >> 1) + 1)
    for i in range(module.objects):
        if _object(reader) == _FUNCTION_TABLE:
            module.table_at = i
    found: list[bytes] = []
    _code(reader, found)
    assert reader.at == len(reader.data)
    names = viper_names(source)
    assert len(names) == len(found), "machine code that is no function of the module itself"
    module.functions = dict(zip(names, found, strict=True))
    return module


def _object(reader: _Reader) -> int:
    kind = reader.bytes(1)[0]
    if kind == _TUPLE:
        for _ in range(reader.number()):
            _object(reader)
    elif kind != _FUNCTION_TABLE and kind not in _CONSTANTS:
        reader.bytes(reader.number() + (kind not in _NAMELESS))
    return kind


def _code(reader: _Reader, found: list[bytes]) -> None:
    """One function and those within it."""
    head = reader.number()
    code = reader.bytes(head >> 3)
    if head & 3 == _VIPER:
        flags = reader.number()
        assert not flags & 0x70, "machine code that has to be relocated"
        found.append(code)
    else:
        assert head & 3 == _BYTECODE, "machine code that is not viper's"
    if head & 4:
        for _ in range(reader.number()):
            _code(reader, found)
