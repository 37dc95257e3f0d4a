"""What the pages get of the tools, and ZIP files that are the same whenever the files in them are."""

import ast
import io
import zipfile
from collections.abc import Iterator, Mapping
from pathlib import Path

from .. import firmware_path

_DATE = (1980, 1, 1, 0, 0, 0)
_PACKAGE = firmware_path.TOOLS / "kickstand_tools"


def tools(*modules: str) -> dict[str, Path]:
    """{path below the tools: file} of these modules of kickstand_tools, as "web/device.py", and of all that they
    import of it, also within functions; with the templates and scripts beside them."""
    found: set[Path] = set()
    todo = {_PACKAGE / name for name in modules}
    while todo:
        path = todo.pop()
        found.add(path)
        todo |= set(_imported(path)) - found
    beside = {file for path in found for file in path.parent.iterdir() if file.suffix in (".html", ".js")}
    return {path.relative_to(firmware_path.TOOLS).as_posix(): path for path in sorted(found | beside)}


def _imported(path: Path) -> Iterator[Path]:
    """The modules of the tools that one imports, and the __init__.py of its packages."""
    yield from (folder / "__init__.py" for folder in path.parents if folder.is_relative_to(_PACKAGE))
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and node.level:
            base = path.parents[node.level - 1] / (node.module or "").replace(".", "/")
            for place in (base, *(base / alias.name for alias in node.names)):
                yield from (file for file in (place.with_suffix(".py"), place / "__init__.py") if file.is_file())


def zipped(contents: Mapping[str, bytes]) -> bytes:
    """A ZIP file of {name: content}."""
    made = io.BytesIO()
    with zipfile.ZipFile(made, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in sorted(contents.items()):
            entry = zipfile.ZipInfo(name, _DATE)
            entry.compress_type = zipfile.ZIP_DEFLATED
            archive.writestr(entry, data)
    return made.getvalue()
