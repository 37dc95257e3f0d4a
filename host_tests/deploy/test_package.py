"""The list of files for mip, the wheel with the firmware, and the advice to install."""

import json
import os
import re
import subprocess
import sys
import venv
import zipfile
from pathlib import Path

import pytest
from kickstand_tools.common import installation
from kickstand_tools.deploy import firmware_files
from kickstand_tools.web import documents
from support import command

ROOT = Path(__file__).resolve().parents[2]
VERSION = json.loads((ROOT / "firmware" / "package.json").read_text())["version"]


def test_mip_installs_every_module_and_nothing_else():
    listed = json.loads((ROOT / "firmware" / "package.json").read_text())
    firmware = ROOT / "firmware"
    modules = {path.relative_to(firmware).as_posix() for path in (firmware / "kickstand").rglob("*.py")}
    assert {target for target, _ in listed["urls"]} == modules
    assert all(target == source for target, source in listed["urls"])  # targets without a host need no network
    assert listed == firmware_files.mip_package(), "python -m kickstand_tools.deploy.firmware_files writes it again"


def test_firmware_has_its_main_last():
    files = firmware_files.firmware_files()
    assert list(files)[-2:] == ["/config.py", "/main.py"] and files["/kickstand/lean/meter.py"].name == "meter.py"
    compiled = firmware_files.contents(0x1306, lambda source, kind: bytes([77, 6, 0x13, 31]) + kind.encode())
    modules = [path for path in compiled if not path.endswith("_plain.py")]
    assert modules == [path.replace(".py", ".mpy") for path in list(files)[:-2]] + ["/config.py", "/main.py"]
    assert compiled["/kickstand/app.mpy"] == b"M\6\x13\x1farmv6m"


def test_one_version_everywhere():
    text = (ROOT / "firmware" / "kickstand" / "units.py").read_text()
    projects = [ROOT / "pyproject.toml", *(ROOT / "tools").glob("*/pyproject.toml")]
    versions = [re.findall(r'^version = "(.*)"', path.read_text(), re.MULTILINE) for path in projects]
    assert f'__version__ = "{VERSION}"' in text and versions == [[VERSION]] * 3


def built(project, folder):
    build = [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(folder)]
    process = subprocess.run(build, cwd=project, capture_output=True, text=True)
    assert process.returncode == 0, process.stdout + process.stderr
    (path,) = folder.glob("*.whl")
    return path


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    return built(ROOT, tmp_path_factory.mktemp("dist"))


@pytest.mark.parametrize(
    ("name", "parts"),
    [("fleet", ["fleet = kickstand_fleet.", "page.html"]), ("emulator", ["bench = ", "emulate = ", "rp2040 = "])],
)
def test_a_package_beside_the_core_has_its_entry_points_and_files(tmp_path, name, parts):
    with zipfile.ZipFile(built(ROOT / "tools" / name, tmp_path)) as archive:
        names = archive.namelist()
        commands = archive.read(f"kickstand_{name}-{VERSION}.dist-info/entry_points.txt").decode()
    assert {path.split("/")[0] for path in names} == {f"kickstand_{name}", f"kickstand_{name}-{VERSION}.dist-info"}
    assert all(part in commands + " ".join(names) for part in parts)


def test_wheel_carries_firmware_pages_and_documents(wheel):
    with zipfile.ZipFile(wheel) as archive:
        names = set(archive.namelist())
        for target, source in firmware_files.firmware_files().items():
            inside = target[1:] if target.startswith("/kickstand/") else "kickstand_tools/firmware" + target
            assert archive.read(inside) == source.read_bytes()
        commands = archive.read(f"kickstand_lean-{VERSION}.dist-info/entry_points.txt").decode()
    assert {"kickstand_tools/cli/main.py", "kickstand_tools/py.typed"} <= names
    web = installation.TOOLS / "kickstand_tools" / "web"
    pages = [path for name in ("npm", "page") for path in (web / name).rglob("*") if path.is_file()]
    assert {f"kickstand_tools/web/{path.relative_to(web).as_posix()}" for path in pages} <= names
    texts = [*documents.PATHS, *(f"tools/pictures/{path.name}" for path in (ROOT / "tools" / "pictures").iterdir())]
    assert {f"kickstand_tools/documents/{path}" for path in texts} <= names
    packages = {"kickstand", "kickstand_tools", "kickstand_sim"}
    assert {name.split("/")[0] for name in names} == packages | {f"kickstand_lean-{VERSION}.dist-info"}
    assert "kickstand = " in commands and "workshop" not in commands  # the wheel has no modules of the workshop
    assert not [name for name in names if "__pycache__" in name or name.endswith(".cal")]


@pytest.mark.long
@pytest.mark.skipif(os.name == "nt", reason="needs the folders of Unix")
def test_wheel_installed_in_a_fresh_venv_works(wheel, tmp_path):
    """The packages that the wheel requires are those of this Python, because a test has no network. The release
    installs them too."""
    venv.create(tmp_path / "venv", with_pip=True)
    python = tmp_path / "venv" / "bin" / "python"
    install = [python, "-m", "pip", "install", "--no-deps", "--no-index", "--disable-pip-version-check", wheel]
    subprocess.run(install, check=True, capture_output=True)
    (packages,) = (tmp_path / "venv" / "lib").glob("python*/site-packages")
    (packages / "required.pth").write_text(str(Path(pytest.__file__).parents[1]) + "\n")

    def run(*arguments):
        kickstand = tmp_path / "venv" / "bin" / "kickstand"
        environment = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
        return subprocess.run(
            [kickstand, *arguments], cwd=tmp_path, env=environment, capture_output=True, text=True, check=True
        ).stdout

    assert run("--version") == f"kickstand, version {VERSION}\n"
    paths = "import kickstand, kickstand_tools as tools; print(kickstand.__file__, tools.__file__)"
    origins = subprocess.run([python, "-c", paths], cwd=tmp_path, capture_output=True, text=True, check=True).stdout
    assert origins.count(str(packages)) == 2
    ride = tmp_path / "ride"
    command.works("simulate", "--profile", "street", "--seconds", 60, "--out", ride)
    command.works("calibrate", "two", ride / "KICKSTAND.csv", ride / "UPRIGHT.csv", "--out", ride / "RIDE.cal.json")
    assert run("report", "ride/RIDE.csv") == command.works("report", ride / "RIDE.csv").out
