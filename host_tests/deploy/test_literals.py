"""Constants of the firmware are literals in compiled modules, and the modules work as before."""

import importlib
import sys

import pytest
from kickstand_tools.deploy import firmware_files

MODULES = {
    "units.py": "from math import radians\nGRAVITY = 9.5\n_TURN = radians(180.0)\nHALF = _TURN / 2\nWORDS = 'x' * 11\n",
    "lean/__init__.py": "",
    "lean/lean_filter.py": "from ..units import GRAVITY, HALF\nMOST = 2 * GRAVITY\nDELAY_S = 300\n"
    "_ROWS = ((1, 2), (3, 4))\nSTATE = 1\n"
    "def rows():\n    return _ROWS[1]\ndef change():\n    global STATE\n    STATE = 2\n",
    "app.py": "from .lean import lean_filter\nfrom .units import GRAVITY, WORDS\n"
    "def force(mass):\n    from .lean.lean_filter import HALF\n"
    "    return mass * GRAVITY, lean_filter.MOST, HALF, lean_filter.DELAY_S, -lean_filter.MOST\n"
    "def others():\n    lean_filter.change()\n    return lean_filter.STATE, WORDS, lean_filter.rows()\n",
}  # fmt: skip


@pytest.fixture
def package(tmp_path):
    """Return the directory of a small package."""
    directory = tmp_path / "kickstand"
    for name, source in MODULES.items():
        (directory / name).parent.mkdir(parents=True, exist_ok=True)
        (directory / name).write_text(source)
    return directory


def test_values_replace_the_names_of_constants(package, tmp_path, monkeypatch):
    texts = {name: firmware_files.module_text(package / name, package) for name in MODULES}
    for name in ("GRAVITY", "HALF", "MOST", "_ROWS", "_TURN"):
        assert not [module for module, text in texts.items() if name in text], name
    assert "DELAY_S = 300" in texts["lean/lean_filter.py"]  # a program outside the package reads this name
    assert texts["lean/lean_filter.py"].count("import") == 0
    assert "return mass * 9.5, 19.0, 1.5707963267948966, lean_filter.DELAY_S, -19.0" in texts["app.py"].replace(
        "(", ""
    ).replace(")", "")
    inlined = tmp_path / "inlined"
    for name, text in texts.items():
        (inlined / name).parent.mkdir(parents=True, exist_ok=True)
        (inlined / name).write_text(text)
    (inlined / "__init__.py").touch()
    monkeypatch.syspath_prepend(str(tmp_path))
    app = importlib.import_module("inlined.app")
    assert app.force(2.0) == (19.0, 19.0, 1.5707963267948966, 300, -19.0)
    assert app.others() == (2, "x" * 11, (3, 4))
    assert {name for name in sys.modules if name.startswith("inlined.")} == {
        "inlined.app", "inlined.units", "inlined.lean", "inlined.lean.lean_filter"
    }  # fmt: skip


def test_other_files_stay_as_they_are(package, tmp_path):
    (tmp_path / "user.py").write_text("LIMIT = 5  # deg\n")
    assert firmware_files.module_text(tmp_path / "user.py", package) == "LIMIT = 5  # deg\n"
    (package / "app.py").write_text("from .units import GRAVITY\nclass A:\n    GRAVITY = GRAVITY\n")
    with pytest.raises(ValueError, match="app binds names that it imports: GRAVITY"):
        firmware_files.module_text(package / "app.py", package)
