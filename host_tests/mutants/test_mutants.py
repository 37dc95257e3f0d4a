"""The command `mutants`: its table of packages, its changes of the code, and which changes count as noticed."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from kickstand_workshop.mutants import packages

ROOT = Path(__file__).resolve().parent.parent.parent


@pytest.mark.parametrize("name", packages.PACKAGES)
def test_every_pattern_of_the_table_has_files(name):
    package = packages.PACKAGES[name]
    for pattern in (*package.sources, *package.tests):
        assert list(ROOT.glob(pattern)), pattern
    assert packages.sources(package, ROOT)
    assert packages.tests(package, ROOT)


@pytest.mark.skipif(not hasattr(os, "fork"), reason="needs os.fork")
def test_noticed_unnoticed_and_for_ever(tmp_path):
    """The tests of changed code run in forked processes. A separate process therefore runs this script."""
    (tmp_path / "tools").mkdir()
    (tmp_path / "tools" / "code_under.py").write_text("def twice(x):\n    return 2 * x\n")
    (tmp_path / "test_code.py").write_text(
        "import code_under\n\ndef test_twice():\n    assert code_under.twice(2) == 4\n"
    )
    script = f"""
from pathlib import Path
from kickstand_workshop.mutants import fork
fork.WARM, fork.EXTRA_S, fork.WALL_TIMES = (), 1, 1000  # a busy machine takes long for a second of its processor
tests = fork.Tests(Path({str(tmp_path)!r}), ["test_code.py"])
assert tests.pass_unchanged(), tests.output()
code = Path("tools/code_under.py")
for body in ("return 3 * x", "return x + x", "while True: pass"):
    print(tests.judge(code, "def twice(x):\\n    " + body + "\\n"))
assert "2 * x" in (tests.root / code).read_text()
"""
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, cwd=tmp_path, timeout=3000)
    assert done.returncode == 0, done.stderr
    assert done.stdout.splitlines() == ["killed", "survived", "timed out"]
