"""Finds QEMU's library for the ESP32, the chip's ROM and MicroPython's image.

Library, ROM and image are not part of Kickstand.
"""

import ctypes
import hashlib
import os
import sys
from pathlib import Path

from kickstand_tools.common import installation
from kickstand_tools.common.messages import InputError

from .image import need_compiler

VARIABLE = "KICKSTAND_QEMU_ESP32"
IMAGE = "ESP32_GENERIC-20250911-v1.26.1.bin"
SHA256 = "6b5272b6edd15fc4d1627ec559a27a5d5a7b86e5ea7f8013941eb10c877edd4e"
FILES = ("libqemu-xtensa.so", "esp32-v3-rom.bin", "esp32-v3-rom-app.bin", IMAGE)
_PACKAGES = "libpixman-1-0 libglib2.0-0 libgcrypt20 libslirp0"


def find() -> Path:
    """Return the folder with all FILES. Raises InputError, which names the missing file and where to get it."""
    need_compiler()
    named = os.environ.get(VARIABLE)
    folder = Path(named) if named else installation.firmware().parent.parent / "shared" / "esp32"
    missing = [name for name in FILES if not (folder / name).is_file()]
    if missing or sys.platform != "linux":
        raise InputError(
            f"no emulated ESP32: {missing[0] if missing else 'Linux'} is missing in {folder}; "
            f"{VARIABLE} names a folder with {', '.join(FILES)} (the library and the ROM from PICSimLab's QEMU, "
            "github.com/lcgamboa/qemu, the image from micropython.org)"
        )
    if hashlib.sha256((folder / IMAGE).read_bytes()).hexdigest() != SHA256:
        raise InputError(f"{folder / IMAGE} is not the official image: get it from micropython.org again")
    try:
        ctypes.CDLL(str(folder / FILES[0]), mode=os.RTLD_LAZY)
    except OSError as error:
        raise InputError(f"no emulated ESP32: {error}; on Debian the packages {_PACKAGES}") from None
    return folder
