"""How the command is called: help, and one line for every mistake."""

import re
import subprocess
import sys

import command
import pytest
from kickstand_tools.logs import reader
from kickstand_tools.simulation.profiles import PROFILES

MISTAKES = {
    "no such command": (["fly"], "No such command 'fly'"),
    "no such option": (["--fast"], "No such option"),
    "calibrate what": (["calibrate"], "Missing command"),
    "six without poses": (["calibrate", "six", "--out", "CAL.json"], "Missing argument"),
    "six without out": (["calibrate", "six", "a.csv"], "Missing option '--out'"),
    "two with one pose": (["calibrate", "two", "a.csv", "--out", "CAL.json"], "UPRIGHT.csv"),
    "two with three": (["calibrate", "two", "a", "b", "c", "--out", "d"], "unexpected extra argument (c)"),
    "side": (
        ["calibrate", "two", "a.csv", "b.csv", "--side", "up", "--out", "CAL.json"],
        "'up' is not one of",
    ),
    "replay nothing": (["replay"], "Missing argument 'LOG.csv'"),
    "engine": (["replay", "a", "--calibration", "b", "--out", "c", "--engine", "x"], "'x' is not one of"),
    "flash what": (["flash", "now"], "unexpected extra argument (now)"),
    "port without a name": (["status", "--port"], "requires an argument"),
}


@pytest.mark.parametrize("name", MISTAKES)
def test_a_mistake_is_told_in_one_line(tmp_path, monkeypatch, name):
    monkeypatch.chdir(tmp_path)
    arguments, words = MISTAKES[name]
    result = command.run(*arguments)
    assert (result.status, result.out) == (2, "")
    assert result.err.count("\n") == 1
    assert words in result.err
    assert re.search(r"[^.][.?] See kickstand.* --help\.\n$", result.err)
    assert not list(tmp_path.iterdir())


def test_alone_it_shows_its_commands():
    result = command.works()
    for name in "flash", "status", "calibrate", "replay", "demo":
        assert f"\n  {name} " in result.out


@pytest.mark.parametrize("name", ["simulate", "evaluate"])
def test_the_profiles_are_in_the_help(name):
    words = " ".join(command.works(name, "--help").out.split())
    assert ", ".join(PROFILES) in words.replace("; hard ones:", ",")


def test_a_fault_of_its_own_is_one_line_too(tmp_path, monkeypatch):
    def broken(*_):
        raise KeyError("oops")

    monkeypatch.setattr(reader, "_block", broken)
    log, cal = command.still(tmp_path / "log.csv", (0, 0, 1)), command.write_cal(tmp_path / "CAL.json")
    result = command.run("replay", log, "--calibration", cal, "--out", tmp_path / "LEAN.csv")
    assert result.status == 2
    assert "unexpected KeyError" in result.err
    assert result.err.count("\n") == 1
    assert not (tmp_path / "LEAN.csv").exists()


def test_from_a_shell(tmp_path):
    """Standard output empty, one line on standard error, status 2: as a script sees it."""
    done = subprocess.run(
        [
            sys.executable,
            "-m",
            "kickstand_tools.cli",
            "replay",
            "none.csv",
            "--calibration",
            "x",
            "--out",
            "y",
        ],
        cwd=tmp_path,
        capture_output=True,
        text=True,
    )
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr == "kickstand: x: there is no such file: make it with kickstand calibrate\n"
    assert not list(tmp_path.iterdir())
