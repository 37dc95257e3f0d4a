"""The firmware detects wrong machine code when it imports the module. The firmware then uses the plain function, and
the console says so."""

import re
import shutil
import subprocess

import pytest
from kickstand_tools.common import installation

# This code defines for each function: (the function in use, name of its plain version).
_CHOSEN = """
from kickstand import quick
from kickstand.calibration.parameters import products
from kickstand.imu.axes import decode, add_up
from kickstand.lean import kalman
from kickstand.rides.block import encode
for name in ("decode", "add_up", "products", "encode", "add_products"):
    print(name, "plain" if name in quick.plain else "quick")
assert ("add_products" in quick.plain) == (kalman.KIND == "d")
"""
# One mistake in each viper function, as a compiler might make it: {(module, function): (text, its replacement)}.
MISTAKES = {
    ("quick_viper.py", "decode"): ("frames[at] << 8 |", "frames[at] << 8 &"),
    ("quick_viper.py", "add_up"): ("value > 32767", "value > 32768"),
    ("quick_viper.py", "products"): ("matrices[index + 2] * z", "matrices[index + 2] * (z & 0x1FFFF)"),
    ("rides/block_viper.py", "encode"): ("guess * n // previous", "guess // previous * n"),
    ("quick_viper.py", "add_products"): ("value += 0 - low", "value -= 0 - low"),
}
NAMES = [name for _, name in MISTAKES]


def write_broken(path, name, target):
    """Write the module to `target`, with the mistake in this function."""
    source = (installation.PACKAGE / path).read_text(encoding="utf-8")
    right, wrong = MISTAKES[path, name]
    start = source.index(f"def {name}(")
    assert right in source[start:]
    target.write_text(source[:start] + source[start:].replace(right, wrong, 1), encoding="utf-8")


def imported(tmp_path, path="", name="", error=""):
    """Import the firmware on MicroPython and return the output, which names the functions in use.

    path, name: the module and the function with a mistake.
    error: the error that an import of the module raises.
    """
    if not installation.has_micropython():
        pytest.skip("no MicroPython unix port for this system")
    shutil.copytree(installation.PACKAGE, tmp_path / "kickstand")
    if path:
        plain = (tmp_path / "kickstand" / path).with_name(path.rpartition("/")[2].replace(".py", "_plain.py"))
        shutil.copy(installation.PACKAGE / path, plain)
    if error:
        (tmp_path / "kickstand" / path).write_text(f"raise {error}\n", encoding="utf-8")
    elif name:
        write_broken(path, name, tmp_path / "kickstand" / path)
    command, environment = installation.micropython("-c", _CHOSEN)
    environment["MICROPYPATH"] = str(tmp_path)
    process = subprocess.run(command, capture_output=True, text=True, env=environment, cwd=tmp_path, timeout=120)
    assert process.returncode == 0, process.stderr
    return process.stdout.splitlines()


def test_correct_machine_code_is_used(tmp_path):
    functions = [
        (path.relative_to(installation.PACKAGE).as_posix(), name)
        for path in installation.PACKAGE.rglob("*_viper.py")
        for name in re.findall(r"@micropython\.viper\ndef (\w+)", path.read_text(encoding="utf-8"))
    ]
    assert sorted(functions) == sorted(MISTAKES)
    assert imported(tmp_path) == [f"{name} quick" for name in NAMES]


@pytest.mark.parametrize(("path", "name"), MISTAKES)
def test_wrong_machine_code_is_not_used(tmp_path, path, name):
    warning, *chosen = imported(tmp_path, path, name)
    assert warning.startswith(f"the machine code for {name}() gives wrong results on this board")
    assert chosen == [f"{other} {'plain' if other == name else 'quick'}" for other in NAMES]


@pytest.mark.parametrize("path", sorted({path for path, _ in MISTAKES}))
def test_machine_code_that_cannot_be_loaded_is_not_used(tmp_path, path):
    """An ESP32 runs machine code from a separate memory, which may be too small. The lean meter works without machine
    code."""
    without = [name for other, name in MISTAKES if other == path]
    chosen = imported(tmp_path, path, error='MemoryError("no memory to run it from")')
    assert chosen == [f"{name} {'plain' if name in without else 'quick'}" for name in NAMES]
