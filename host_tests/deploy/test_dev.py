"""tools/dev.py, which sets up a checkout, on a copy of it in another project. A shell script replaces Python."""

import importlib.util
import os
import re
import shutil
import sys
from pathlib import Path

import pytest

DEV = Path(__file__).resolve().parents[2] / "tools" / "dev.py"
pytestmark = pytest.mark.skipif(os.name == "nt", reason="the stand-in for Python is a shell script")

# Notes its arguments in the file `ran`. `-m venv --clear DIRECTORY` copies the script, as a .venv with its own Python.
_PYTHON = """#!/bin/sh
echo "$@" >>ROOT/ran
FAULT
if [ "$2" = venv ]; then mkdir -p "$4/bin"; cp "$0" "$4/bin/python"; fi
"""


class Project:
    """A project with a copy of dev.py. fault: lines of shell in the stand-in for Python."""

    def __init__(self, root, monkeypatch):
        self.root = root
        (root / "tools").mkdir()
        shutil.copy(DEV, root / "tools" / "dev.py")
        self.require("one")
        spec = importlib.util.spec_from_file_location("dev_copy", root / "tools" / "dev.py")
        assert spec and spec.loader
        self.dev = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(self.dev)
        self.python("")
        monkeypatch.chdir(root)
        monkeypatch.setattr(sys, "executable", str(root / "python"))

    def python(self, fault):
        for path in (self.root / "python", self.root / ".venv" / "bin" / "python"):
            if path.parent.is_dir():
                path.write_text(_PYTHON.replace("ROOT", str(self.root)).replace("FAULT", fault))
                path.chmod(0o755)

    def require(self, package, folder=""):
        (self.root / folder).mkdir(exist_ok=True)
        (self.root / folder / "pyproject.toml").write_text(f'[project]\nname = "{package}"\n')

    def steps(self, *extras):
        """Prepare these extras one after another. Return what was run, without pip's options."""
        (self.root / "ran").unlink(missing_ok=True)
        for extra in extras:
            self.dev.prepare(extra)
        return self.ran()

    def ran(self):
        path = self.root / "ran"
        lines = path.read_text().splitlines() if path.exists() else []
        options = r"-m |--(no-input|disable\S+|only-binary uv|clear|editable|python \S+) |>=\S+|/\S+/"
        steps = [re.sub(options, "", line) for line in lines]
        return [step.removeprefix("uv ") for step in steps if "pip --version" not in step and "config list" not in step]


@pytest.fixture
def project(tmp_path, monkeypatch):
    return Project(tmp_path, monkeypatch)


UV = "pip install uv"
TESTED = "pip install .[test] tools/fleet[s3,test] tools/emulator"


def test_dev_installs_again_only_if_needed(project):
    assert project.steps("", "") == ["venv .venv", UV, "pip install ."]
    assert project.steps("test", "", "test", "") == [UV, TESTED]
    for changed in "", "tools/fleet":
        project.require("two", changed)
        assert project.steps("test") == [UV, TESTED]


def test_interrupted_installation_starts_again(project):
    project.steps("")
    project.python('[ "$3" != install ] || exit 1')
    with pytest.raises(project.dev.SetupStopped):
        project.steps("test")
    project.python("")
    assert project.steps("") == [UV, "pip install ."]


@pytest.mark.parametrize(
    ("fault", "words"),
    [
        ("echo 'The virtual environment was not created: ensurepip is not available.'; exit 1", "python3-venv"),
        ("echo 'Error: [Errno 13] Permission denied'; exit 1", "Permission denied"),
        ("exit 0", "no pip"),
    ],
)
def test_failed_venv_is_reported_in_one_line(project, fault, words):
    project.python(fault)
    with pytest.raises(project.dev.SetupStopped, match=words) as stopped:
        project.steps("")
    assert "\n" not in str(stopped.value)


def test_old_python_is_refused_in_one_line(project, monkeypatch):
    monkeypatch.setattr(sys, "version_info", (3, 10, 1))
    with pytest.raises(project.dev.SetupStopped, match=r"3\.11 or newer is needed, this is 3\.10: start it") as stopped:
        project.dev.main(["test"])
    assert "\n" not in str(stopped.value)


def test_changed_paths_may_have_blanks_and_accents(project):
    project.dev.output("git", "init")
    project.dev.output("git", "-c", "user.name=a", "-c", "user.email=a", "commit", "--allow-empty", "-m", "a")
    (project.root / "\xe4 b.py").touch()
    assert "\xe4 b.py" in project.dev.changed_files()


@pytest.mark.parametrize("failing", ["ruff check", "ruff format", "pyright", "pytest"])
def test_all_checks_run_and_any_failure_counts(project, capfd, failing):
    project.steps("test")
    project.python(f'echo "of $2"; case "$2 $3" in "{failing}"*) exit 1; esac')
    (project.root / "ran").unlink()
    assert project.dev.test(["--all", "-k", "lean"]) == 1
    ran = (project.root / "ran").read_text()
    for tool in ("-m ruff check", "-m ruff format", "-m pyright", "-m pytest", "-k lean"):
        assert tool in ran
    assert capfd.readouterr().out.splitlines()[-1].endswith("failed: " + failing.replace(" check", ""))
