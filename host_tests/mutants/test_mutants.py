"""kickstand_workshop.mutants: the table of packages, the changes it makes, and what it takes for noticed."""

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


@pytest.fixture
def changed(tmp_path):
    """Every changed text of a file, by the lines that differ."""
    pytest.importorskip("cosmic_ray", reason="needs the extra mutants")
    from kickstand_workshop.mutants.changes import changes

    def all_of(text):
        (tmp_path / "code.py").write_text(text)
        before = text.splitlines()
        lines = []
        for change in changes(Path("code.py"), tmp_path):
            mutant = change.mutant(text)
            if mutant is not None:
                after = mutant.splitlines()
                assert [k for k, line in enumerate(after, 1) if line != before[k - 1]] == [change.line]
                lines.append(after[change.line - 1].strip())
        return lines

    return all_of


@pytest.mark.parametrize(
    ("line", "others"),
    [
        ("x = a < b", ["x = a <= b"]),
        ("x = 5", ["x = 6", "x = 4"]),
        ("x = 200", ["x = 400", "x = 100"]),
        ("x = 0.25", ["x = 0.5", "x = 0.125"]),
        ("x = 1", ["x = 2", "x = 0"]),
        ("x = a and b", ["x = a or b"]),
        ("x[0] = a", ["x[1] = a", "pass"]),
        ("x += a", ["pass"]),
        ("f(a)", ["pass"]),
        ("'a docstring of 3 lines'", []),
    ],
)
def test_each_line_has_a_few_neighbours(changed, line, others):
    lines = changed(f"def f():\n    {line}\n    return x\n")
    assert sorted(lines) == sorted(others)


def test_what_does_nothing_is_left_alone(changed):
    """Annotations, decorators, imports, and the last return, without which nothing would work."""
    text = "from a import b\n@c(1)\ndef f(x: int | None = None) -> d[3]:\n    y: e[4] = x\n    return y\n"
    assert changed(text) == []


def test_conditions_and_early_returns(changed):
    text = "def f(a):\n    if a:\n        return\n    for b in a:\n        break\n    return a\n"
    assert sorted(changed(text)) == ["continue", "for b in []:", "if not a:", "pass"]


@pytest.mark.skipif(not hasattr(os, "fork"), reason="needs os.fork")
def test_noticed_unnoticed_and_for_ever(tmp_path):
    """In processes of its own, since it forks."""
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
