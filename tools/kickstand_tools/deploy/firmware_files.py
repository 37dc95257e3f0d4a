"""Lists the files of the firmware, for `kickstand flash` and mip.

`python -m kickstand_tools.deploy.firmware_files` rewrites mip's list, firmware/package.json.
"""

import json
from pathlib import Path

from kickstand import __version__

from ..common import installation
from . import bytecode

PACKAGE = "/kickstand"
MAIN = "/main.py"
CONFIG = "/config.py"  # the file on the board belongs to the user
MODULE_ENDINGS = (".py", ".mpy")


def firmware_files() -> dict[str, Path]:
    """Return {path on the board: source file}, in the order of copying.

    main.py comes last, because it starts the other files.
    """
    root = installation.firmware()
    package = installation.PACKAGE
    files = {f"{PACKAGE}/{path.relative_to(package).as_posix()}": path for path in sorted(package.rglob("*.py"))}
    return files | {CONFIG: root / "config.py", MAIN: root / "main.py"}


def contents(mpy: int | None, compiler: bytecode.Compiler | None = None) -> dict[str, bytes]:
    """Return {path on the board: content}, in the order of firmware_files().

    mpy: the board's sys.implementation._mpy, for which the package is compiled. None keeps the .py files. compiler: see
        bytecode.compiled().
    main.py and config.py stay .py files, because MicroPython does not start a main.mpy, and users edit config.py.
    Raises CannotCompile if the package cannot be compiled for the board.
    """
    files = firmware_files()
    package = {path: source for path, source in files.items() if path.startswith(PACKAGE + "/")}
    plain_files = {path: source.read_bytes() for path, source in files.items() if path not in package}
    if mpy is None:
        return {path: source.read_bytes() for path, source in package.items()} | plain_files
    return bytecode.compiled(package, mpy, compiler) | plain_files


def unfinished(path: str) -> str:
    """Return the name that a file has on the board until it is verified.

    An incomplete main.py could start, and an incomplete config.py could be taken for the user's own file.
    """
    return path.removesuffix(".py") + ".new" if path in (CONFIG, MAIN) else path


def mip_package() -> dict[str, object]:
    """Return the content of package.json. Its URLs are relative, so mip loads the modules from beside the list."""
    modules = [path.lstrip("/") for path in firmware_files() if path.startswith(PACKAGE + "/")]
    return {"urls": [[module, module] for module in modules], "deps": [], "version": __version__}


if __name__ == "__main__":
    list_path = installation.firmware() / "package.json"
    list_path.write_text(json.dumps(mip_package(), indent=2) + "\n")
