"""Tests how the command is called: its help, the times in its options, and one line for every mistake."""

import re
import subprocess
import sys

import click
import pytest
from kickstand_tools.cli.common import TIME
from kickstand_tools.logs import reader
from support import command

MISTAKES = {
    "fly": "No such command 'fly'",
    "--fast": "No such option",
    "calibrate": "Missing command",
    "calibrate six a.csv": "Missing option '--out'",
    "calibrate two a b c --out d": "unexpected extra argument (c)",
    "calibrate two a.csv b.csv --side up --out CAL.json": "'up' is not one of",
    "replay": "Missing argument 'RIDE.csv|EXPORT'",
    "status --port": "requires an argument",
}


@pytest.mark.parametrize("line", MISTAKES)
def test_mistake_is_reported_in_one_line(tmp_path, monkeypatch, line):
    monkeypatch.chdir(tmp_path)
    result = command.run(*line.split())
    assert (result.status, result.out) == (2, "")
    assert result.err.count("\n") == 1
    assert MISTAKES[line] in result.err
    assert re.search(r"[^.][.?] See kickstand.* --help\.\n$", result.err)
    assert not list(tmp_path.iterdir())


def test_bug_is_reported_in_one_line(tmp_path, monkeypatch):
    def broken(*_):
        raise KeyError("oops")

    monkeypatch.setattr(reader, "_numbers", broken)
    log, cal = command.still(tmp_path / "log.csv", (0, 0, 1)), command.write_cal(tmp_path / "CAL.json")
    result = command.run("replay", log, "--calibration", cal, "--out", tmp_path / "LEAN.csv")
    assert result.status == 2
    assert "unexpected KeyError" in result.err
    assert result.err.count("\n") == 1
    assert not (tmp_path / "LEAN.csv").exists()


def test_the_convention_of_logs_is_in_the_help():
    words = " ".join(command.works("import", "--help").out.split())
    assert "At rest, the axis that points up reads +1 g. Rates are right-handed about their axes." in words


def test_shell_sees_one_line_on_standard_error_and_status_2(tmp_path):
    """A script gets an empty standard output, one line on standard error, and exit status 2."""
    arguments = "-m kickstand_tools.cli replay none.csv --calibration x --out y".split()
    done = subprocess.run([sys.executable, *arguments], cwd=tmp_path, capture_output=True, text=True)
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr == "kickstand: x: there is no such file: make it with kickstand calibrate\n"
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    "text, seconds",
    [("60", 60.0), ("12.5", 12.5), ("-30", -30.0), ("1:00", 60.0), ("-1:30.5", -90.5), ("1:02:03", 3723.0)],
)
def test_times_are_read_as_seconds_minutes_and_hours(text, seconds):
    assert TIME.convert(text, None, None) == seconds


@pytest.mark.parametrize("text", ["", "early", "1:", ":30", "1:2:3:4", "1:-5", "1.5:00", "nan", "inf", "--5"])
def test_invalid_time_is_refused_with_the_format(text):
    with pytest.raises(click.UsageError, match="is not a time: give seconds such as 60"):
        TIME.convert(text, None, None)


def test_ride_without_a_name_is_accepted(tmp_path):
    command.refused(tmp_path, "smooth", "", "--out", tmp_path / "LEAN.csv", words=": ")


def test_fleet_is_not_simulated_over_a_ride(tmp_path):
    (tmp_path / "RIDE.csv").write_text("a ride")
    (tmp_path / "fleet").mkdir()
    (tmp_path / "fleet" / "MANIFEST.csv").write_text("a fleet")
    command.refused(tmp_path, "simulate", "--fleet", 2, "--out", tmp_path, words="holds a ride")
    given = "simulate", "--profile", "street"
    command.refused(tmp_path, *given, "--out", tmp_path / "fleet", words="holds a fleet")
    out = "--fleet", 2, "--out", tmp_path / "new"
    command.refused(tmp_path, *given, *out, words="--profile is of a single ride")
    command.refused(tmp_path, "simulate", "--speed", *out, words="--speed is of a single ride")
