"""The reference of the functions can be built as the site's workflow builds it."""

import re
import shlex
import subprocess
import sys
from html import unescape
from pathlib import Path

import pytest
from kickstand_fleet import api as fleet_api
from kickstand_tools import api

ROOT = Path(__file__).resolve().parents[2]
WORKFLOWS = ROOT / ".github" / "workflows"


def command(workflow):
    return shlex.split(re.findall(r"run: python -m (pdoc .*)", (WORKFLOWS / workflow).read_text(encoding="utf-8"))[0])


@pytest.mark.long
def test_the_reference_has_every_public_name(tmp_path):
    pytest.importorskip("pdoc", reason='pdoc is not installed: pip install -e ".[reference]"')
    *pdoc, out = command("site.yml")
    assert out == "_site/api"
    process = subprocess.run([sys.executable, "-m", *pdoc, str(tmp_path)], cwd=tmp_path, capture_output=True, text=True)
    assert process.returncode == 0, process.stderr
    for module, least in ((api, 40), (fleet_api, 4)):
        page = unescape((tmp_path / module.__name__.replace(".", "/")).with_suffix(".html").read_text(encoding="utf-8"))
        public = [name for name in module.__all__ if hasattr(getattr(module, name), "__qualname__")]
        assert len(public) >= least
        assert [name for name in public if f'id="{name}"' not in page] == []


def test_a_release_has_the_same_reference():
    assert command("release.yml")[:-1] == command("site.yml")[:-1]
