"""Finds the test files that a change can reach by imports.

    python -m kickstand_workshop.reach FILE...    prints the test files, one per line

A test file is reached if it imports a changed module, directly or through other modules. A changed file that is no
module (a template, a picture) changes the package that it is in. Any other file changes everything.
"""

import ast
import functools
import sys
from collections.abc import Iterable, Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parents[3]
TESTS = [ROOT / "host_tests", ROOT / "tools" / "fleet" / "tests", ROOT / "tools" / "emulator" / "tests"]
PLUGIN = "host_tests.support.plugin"  # used by all tests
PRODUCT = {
    "kickstand": ROOT / "firmware",
    "kickstand_tools": ROOT / "tools",
    "kickstand_sim": ROOT / "tools",
    "kickstand_fleet": ROOT / "tools" / "fleet",
    "kickstand_emulator": ROOT / "tools" / "emulator",
    "kickstand_workshop": ROOT / "tools" / "workshop",
}
HARDWARE = {"machine", "micropython", "esp32", "rp2", "neopixel", "network", "bluetooth"}
STARTER = "kickstand.start"  # imports its modules by names that are strings


@functools.cache
def import_graph(tests: bool = False) -> dict[str, set[str]]:
    """Return {module: the modules that it imports}, also within functions and for type checking only.

    The absolute names are of the product, of MicroPython's hardware modules, and if `tests` is True of the tests
    (`host_tests.FOLDER.NAME`, `tools.fleet.tests.NAME`).
    """
    files = {}
    for package, folder in PRODUCT.items():
        files |= {_name(path, folder): path for path in sorted((folder / package).rglob("*.py"))}
    if tests:
        files |= {_name(path, ROOT): path for folder in TESTS for path in sorted(folder.rglob("*.py"))}
    return {name: set(_imports(name, path, files.keys() | HARDWARE)) - {name} for name, path in files.items()}


def reached_tests(changed: Iterable[str]) -> list[str]:
    """Return the test files that these changed files can reach. All paths are relative to the project's root."""
    graph = dict(import_graph(tests=True))
    graph[STARTER] = {name for name in graph if name.startswith("kickstand.")} - {STARTER}
    importers = {name: {other for other, imported in graph.items() if name in imported} for name in graph}
    reached, queue = set(), [module for path in changed for module in _modules(ROOT / path, graph.keys())]
    while queue:
        module = queue.pop()
        if module not in reached:
            reached.add(module)
            queue += importers[module]
    return [f"{name.replace('.', '/')}.py" for name in sorted(reached) if name.rpartition(".")[2].startswith("test_")]


def _name(path: Path, folder: Path) -> str:
    return ".".join(path.relative_to(folder).with_suffix("").parts).removesuffix(".__init__")


def _imports(name: str, path: Path, modules: Iterable[str]) -> Iterator[str]:
    """Yield the modules that a file imports, and for a test file also those that pytest imports for it."""
    package = name.split(".") if path.name == "__init__.py" else name.split(".")[:-1]
    candidates = []
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            candidates += [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            base = package[: len(package) - node.level + 1] if node.level else []
            base = ".".join([*base, *([node.module] if node.module else [])])
            below = [f"{base}.{alias.name}" for alias in node.names]
            candidates += [option for module in below for option in ([module] if module in modules else [module, base])]
    if name.startswith(("host_tests.", "tools.")):
        folders = [".".join(package[:depth]) for depth in range(1, len(package) + 1)]
        candidates = [f"{folder}{module}" for module in candidates for folder in ("", "host_tests.", f"{folders[-1]}.")]
        candidates += [PLUGIN, *(f"{folder}.conftest" for folder in folders)]
    yield from (module for module in candidates if module in modules)


def _modules(path: Path, modules: Iterable[str]) -> set[str]:
    """Return the modules that a changed file stands for, see the docstring of this module."""
    for top, folder in [(folder / package, folder) for package, folder in PRODUCT.items()] + [(t, ROOT) for t in TESTS]:
        if path.is_relative_to(top):
            name = _name(path, folder)
            if path.suffix == ".py":
                return {name} & set(modules)
            parents = [f"{_name(parent, folder)}." for parent in path.parents if parent.is_relative_to(top)]
            inside = [{module for module in modules if f"{module}.".startswith(parent)} for parent in parents]
            return next(filter(None, inside), set(modules))
    return set(modules)


if __name__ == "__main__":
    print(*reached_tests(sys.argv[1:]), sep="\n")
