"""Finds the test files that a change can reach by imports.

    python -m kickstand_workshop.reach FILE...    prints the test files, one per line

A test file is reached if it imports a changed module, directly or through other modules. A changed file that is no
module (a template, a picture) changes the package that it is in. Any other file changes everything.
"""

import ast
import sys
from collections.abc import Iterable, Iterator
from pathlib import Path

import grimp

ROOT = Path(__file__).resolve().parents[3]
TESTS = ROOT / "host_tests"
PACKAGES = {
    "kickstand": "firmware",
    "kickstand_tools": "tools",
    "kickstand_fleet": "tools",
    "kickstand_emulator": "tools",
    "kickstand_workshop": "tools/workshop",
}
STARTER = "kickstand.start"  # imports its modules by names that are strings


def reached_tests(changed: Iterable[str]) -> list[str]:
    """Return the test files that these changed files can reach. All paths are relative to the project's root."""
    graph = grimp.build_graph(*PACKAGES, cache_dir=None)
    for module in graph.modules - {STARTER}:
        if module.startswith("kickstand."):
            graph.add_import(importer=STARTER, imported=module)
    tests = {path: _test_module(path) for path in sorted(TESTS.rglob("*.py"))}
    for module in tests.values():
        graph.add_module(module)
    for path, module in tests.items():
        for imported in _imports(path, graph.modules):
            graph.add_import(importer=module, imported=imported)
    affected = set()
    for name in changed:
        modules = _modules(ROOT / name, graph.modules)
        affected |= modules.union(*(graph.find_downstream_modules(module) for module in modules))
    return [
        str(path.relative_to(ROOT)) for path, module in tests.items() if path.match("test_*.py") and module in affected
    ]


def _test_module(path: Path) -> str:
    """Return the name of a test's module, with its folders: files of two folders may have the same name."""
    return ".".join(("host_tests", *path.relative_to(TESTS).with_suffix("").parts))


def _imports(path: Path, modules: set[str]) -> Iterator[str]:
    """Yield the modules that a file of the tests imports: of the product, of support, of its folder, and conftest."""
    for folder in (path.parent, *path.parent.parents):
        conftest = _test_module(folder / "conftest.py") if folder.is_relative_to(TESTS) else ""
        if conftest in modules and conftest != _test_module(path):
            yield conftest
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom) and node.module:
            names = [node.module, *(f"{node.module}.{alias.name}" for alias in node.names)]
        else:
            continue
        for name in names:
            local = _test_module(path.parent / name.replace(".", "/"))
            yield from modules & {name, f"host_tests.{name}", local} - {_test_module(path)}


def _modules(path: Path, modules: set[str]) -> set[str]:
    """Return the modules that change with a file."""
    if path.is_relative_to(TESTS) and path.suffix == ".py":
        return modules & {_test_module(path)}
    for package, folder in PACKAGES.items():
        home = ROOT / folder / package
        if path.is_relative_to(home):
            name = ".".join((package, *path.relative_to(home).with_suffix("").parts))
            if name in modules:
                return {name}
            parent = name.rpartition(".")[0].removesuffix(".__init__")
            while parent not in modules:
                parent = parent.rpartition(".")[0]
            return {module for module in modules if f"{module}.".startswith(f"{parent}.")}
    return set(modules)


if __name__ == "__main__":
    print(*reached_tests(sys.argv[1:]), sep="\n")
