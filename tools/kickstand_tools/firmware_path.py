"""Where the firmware's files are, in a checkout and in an installed wheel, and how the host runs them."""

import gc
import sys
import traceback
import types
from pathlib import Path
from typing import TextIO

TOOLS = Path(__file__).resolve().parent.parent  # the directory kickstand_tools is imported from


def directory() -> Path:
    """The directory that holds main.py, config.py and kickstand/."""
    packaged = Path(__file__).resolve().parent / "firmware"  # in a wheel
    return packaged if packaged.is_dir() else TOOLS.parent / "firmware"  # in a checkout


def config() -> Path:
    """The rider's config.py: in a checkout that one stands in, whatever of it is installed."""
    here = Path("firmware").resolve()
    return (here if (here / "kickstand").is_dir() and (here / "config.py").is_file() else directory()) / "config.py"


def add_to_path() -> None:
    """Let CPython import the firmware: put it on sys.path, with a do-nothing module `micropython`."""
    path = str(directory())
    if path not in sys.path:
        sys.path.insert(0, path)
    sys.modules.setdefault("micropython", _shim())
    if not hasattr(sys, "print_exception"):
        setattr(sys, "print_exception", _print_exception)  # noqa: B010 as MicroPython has it
    if not hasattr(gc, "threshold"):
        setattr(gc, "threshold", lambda amount: None)  # noqa: B010 likewise


def _print_exception(error: BaseException, file: TextIO | None = None) -> None:
    traceback.print_exception(error, file=file)


def _shim() -> types.ModuleType:
    module = types.ModuleType("micropython")
    for name in ("const", "native", "viper"):
        setattr(module, name, lambda x: x)
    return module
