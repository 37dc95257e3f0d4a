"""Tests the list of files for mip, the wheel with the firmware, and tools/dev.py, which sets up a checkout."""

import importlib.util
import json
import os
import re
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest
from kickstand_tools.common import firmware_path
from kickstand_tools.common.errors import extra
from kickstand_tools.deploy import firmware_files
from kickstand_tools.web.documents import documents

ROOT = Path(__file__).resolve().parents[2]


def test_mip_installs_every_module_and_nothing_else():
    listed = json.loads((ROOT / "firmware" / "package.json").read_text())
    firmware = ROOT / "firmware"
    modules = {path.relative_to(firmware).as_posix() for path in (firmware / "kickstand").rglob("*.py")}
    assert {target for target, _ in listed["urls"]} == modules
    assert all(target == source for target, source in listed["urls"])  # targets without a host need no network
    assert listed == firmware_files.mip_package(), "python -m kickstand_tools.deploy.firmware_files writes it again"


def test_one_version_everywhere():
    listed = json.loads((ROOT / "firmware" / "package.json").read_text())["version"]
    text = (ROOT / "firmware" / "kickstand" / "units.py").read_text()
    project = re.search(r'^version = "(.*)"', (ROOT / "pyproject.toml").read_text(), re.MULTILINE)
    assert project
    assert f'__version__ = "{listed}"' in text
    assert project[1] == listed


def test_the_wheel_carries_the_firmware(tmp_path):
    done = subprocess.run(
        [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(tmp_path)],
        cwd=ROOT,
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    (wheel,) = tmp_path.glob("*.whl")
    with zipfile.ZipFile(wheel) as archive:
        names = set(archive.namelist())
        for target, source in firmware_files.firmware_files().items():
            inside = target[1:] if target.startswith("/kickstand/") else "kickstand_tools/firmware" + target
            assert archive.read(inside) == source.read_bytes()
        commands = archive.read("kickstand_lean-0.4.0.dist-info/entry_points.txt").decode()
    assert {"kickstand_tools/cli/main.py", "kickstand_tools/py.typed"} <= names
    web = firmware_path.TOOLS / "kickstand_tools" / "web"
    pages = [path for name in ("npm", "page") for path in (web / name).rglob("*") if path.is_file()]
    assert {f"kickstand_tools/web/{path.relative_to(web).as_posix()}" for path in pages} <= names
    texts = [*documents.PATHS, *(f"tools/pictures/{path.name}" for path in (ROOT / "tools" / "pictures").iterdir())]
    assert {f"kickstand_tools/documents/{path}" for path in texts} <= names
    packages = {"kickstand", "kickstand_tools", "kickstand_fleet", "kickstand_emulator"}
    assert {name.split("/")[0] for name in names} == packages | {"kickstand_lean-0.4.0.dist-info"}
    assert "fleet = kickstand_fleet." in commands and "emulate = kickstand_emulator." in commands
    assert (
        "kickstand = " in commands and "workshop" not in commands
    )  # the wheel does not contain the workshop's modules
    assert not [name for name in names if "__pycache__" in name or name.endswith(".cal")]


def test_advice_to_install_keeps_the_checkout_editable():
    """The documents say `pip install -e`. Without -e, `flash --config` would copy the config.py in site-packages, which
    the rider has never edited."""
    pages = [path for found in ("*.md", "*/README.md", "*/docs/*.md", ".github/*.md") for path in ROOT.glob(found)]
    text = "\n".join(path.read_text(encoding="utf-8") for path in pages)
    lines = re.findall(r"pip install\b(?! esptool).*", text) + [extra("rides")]
    assert len(lines) >= 4
    assert all("pip install -e " in line for line in lines)


@pytest.fixture
def dev(monkeypatch, tmp_path):
    """Return tools/dev.py as a module, for a temporary project."""
    spec = importlib.util.spec_from_file_location("dev", ROOT / "tools" / "dev.py")
    assert spec and spec.loader
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    (tmp_path / "pyproject.toml").write_text('[project]\nname = "one"\n')
    monkeypatch.setattr(module, "ROOT", str(tmp_path))
    for name in "VENV", "PYTHON", "STAMP", "LOG":
        monkeypatch.setattr(module, name, str(tmp_path / Path(getattr(module, name)).relative_to(ROOT)))
    return module


@pytest.fixture
def steps(dev, monkeypatch):
    """Return dev.prepare() with its slow parts recorded instead of run."""
    done: list[str] = []
    monkeypatch.setattr(dev, "has_pip", lambda: os.path.isdir(dev.VENV))

    def make_venv():
        done.append("venv")
        os.makedirs(dev.VENV, exist_ok=True)

    monkeypatch.setattr(dev, "make_venv", make_venv)
    monkeypatch.setattr(dev, "install", lambda extra: done.append("install " + extra))
    return done


def test_dev_installs_again_only_if_needed(dev, steps, tmp_path):
    for extra_name in ("", "", "test", "", "test", ""):
        dev.prepare(extra_name)
    assert steps == ["venv", "install ", "install test"]
    (tmp_path / "pyproject.toml").write_text('[project]\nname = "two"\n')
    dev.prepare("test")
    assert steps[3:] == ["install test"]


def test_interrupted_installation_starts_again(dev, steps, monkeypatch):
    dev.prepare("")

    def broken_off(extra):
        raise KeyboardInterrupt

    with monkeypatch.context() as patch, pytest.raises(KeyboardInterrupt):
        patch.setattr(dev, "install", broken_off)
        dev.prepare("test")
    dev.prepare("")
    assert steps == ["venv", "install ", "install "]


def test_a_moved_checkout_gets_a_new_venv(dev, steps):
    dev.prepare("")
    stamp = Path(dev.STAMP)
    stamp.write_text(stamp.read_text().replace(dev.ROOT, "/elsewhere", 1))
    dev.prepare("")
    assert steps == ["venv", "install ", "venv", "install "]


def test_working_venv_of_another_python_is_kept(dev, steps, monkeypatch, capsys):
    """The user may have made the .venv on purpose, and installed other packages in it."""
    dev.prepare("")
    stamp = Path(dev.STAMP)
    stamp.write_text(stamp.read_text().replace("Python ", "Python 0.", 1))
    dev.prepare("")
    assert steps == ["venv", "install "]
    assert capsys.readouterr().out.startswith(".venv has Python 0.3")
    dev.prepare("test")
    assert steps == ["venv", "install ", "install test"]
    monkeypatch.setattr(dev, "has_pip", lambda: False)
    dev.prepare("test")
    assert steps[3:] == ["venv", "install test"]


def test_old_python_is_refused_in_one_line(dev, monkeypatch):
    monkeypatch.setattr(dev, "OLDEST", (sys.version_info[0], sys.version_info[1] + 1))
    with pytest.raises(dev.SetupStopped, match="newer is needed, this is") as stopped:
        dev.main(["test"])
    assert "\n" not in str(stopped.value)


def test_dev_lists_its_commands():
    done = subprocess.run([sys.executable, str(ROOT / "tools" / "dev.py"), "fly"], capture_output=True, text=True)
    assert done.returncode != 0
    assert done.stderr.startswith("dev.py: no task is named")
    assert done.stderr.count("\n") == 1


def fake_python(directory, script):
    """Write a command that replaces python3."""
    path = directory / "python"
    path.write_text("#!/bin/sh\n" + script)
    path.chmod(0o755)
    return str(path)


needs_sh = pytest.mark.skipif(os.name == "nt", reason="the stand-in for Python is a shell script")


@needs_sh
@pytest.mark.parametrize(
    ("script", "words"),
    [
        ("echo 'The virtual environment was not created: ensurepip is not available.'; exit 1", "python3-venv"),
        ("echo 'Error: [Errno 13] Permission denied'; exit 1", "Permission denied"),
        ("exit 0", "no pip"),
    ],
)
def test_failed_venv_is_reported_in_one_line(dev, monkeypatch, tmp_path, script, words):
    monkeypatch.setattr(sys, "executable", fake_python(tmp_path, script))
    with pytest.raises(dev.SetupStopped, match=words) as stopped:
        dev.make_venv()
    assert "\n" not in str(stopped.value)


@needs_sh
def test_a_failed_installation_gives_the_reason_and_the_log(dev, monkeypatch, tmp_path):
    script = "echo 'Collecting x'; echo 'ERROR: No matching distribution found for x'; exit 1"
    os.mkdir(dev.VENV)
    monkeypatch.setattr(dev, "PYTHON", fake_python(tmp_path, script))
    with pytest.raises(dev.SetupStopped, match="No matching distribution found for x") as stopped:
        dev.install("test")
    assert "\n" not in str(stopped.value)
    assert dev.LOG in str(stopped.value)


@needs_sh
@pytest.mark.parametrize(
    ("script", "how"),
    [
        ("exit 0", ["pip install uv", "uv pip install --editable .[test]"]),
        ('[ "$2" != uv ]', ["pip install uv", "uv pip install --editable .[test]", "pip install --editable .[test]"]),
        ('[ "$6" != --only-binary ]', ["pip install uv", "pip install --editable .[test]"]),
        ("""[ "$3" != config ] || echo "global.index-url='x'\"""", ["pip install --editable .[test]"]),
    ],
)
def test_uv_installs_or_else_pip(dev, monkeypatch, tmp_path, script, how):
    os.mkdir(dev.VENV)
    monkeypatch.setattr(dev, "PYTHON", fake_python(tmp_path, f'echo "$@" >>{tmp_path}/ran\n{script}'))
    dev.install("test")
    ran = [line for line in (tmp_path / "ran").read_text().splitlines() if "config list" not in line]
    assert [re.sub(r"-m |--(no-input|disable\S+|only-binary uv|python \S+) |>=.*", "", line) for line in ran] == how


@needs_sh
@pytest.mark.parametrize("failing", ["ruff check", "ruff format", "pyright", "pytest"])
def test_all_checks_run_and_any_failure_counts(dev, monkeypatch, tmp_path, capfd, failing):
    script = f'echo "$2 $3" >>{tmp_path}/ran; echo "of $2"; case "$2 $3" in "{failing}"*) exit 1; esac'
    monkeypatch.setattr(dev, "PYTHON", fake_python(tmp_path, script))
    assert dev.test(["-k", "lean"]) == 1
    ran = {line.strip() for line in (tmp_path / "ran").read_text().splitlines()}
    assert ran == {dev.COMPILE, "ruff check", "ruff format", "pyright", "pytest -n"}
    lines = capfd.readouterr().out.splitlines()
    assert lines[-1] == "failed: " + failing.replace(" check", "")
    assert lines[-3:-1] == ["pyright", "of pyright"]
