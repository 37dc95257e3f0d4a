"""How the commands are called: one line for every mistake, the limits of options, and files that must not be lost."""

import os
import re
import subprocess
import sys
import zipfile

import click
import pytest
from kickstand_tools.cli import main
from kickstand_tools.cli.common import TIME
from kickstand_tools.common.messages import printable
from support import command
from support.watched_stderr import Watched, watched

needs_links = pytest.mark.skipif(os.name == "nt", reason="needs symbolic links and /dev")
SIMULATE = "simulate --profile parked --seconds 20 --out"
MISTAKES = {
    "fly": "No such command 'fly'",
    "--fast": "No such option",
    "calibrate six a.csv": "Missing option '--out'",
    "calibrate two a.csv b.csv --side up --out CAL.json": "'up' is not one of",
    "replay": "Missing argument 'RIDE.csv|EXPORT'",
    "status --port": "requires an argument",
    "simulate --out new": "Missing option '--profile', or '--fleet'",
    "simulate --fleet 0 --out new": "is not in the range x>=1",
    "simulate --profile street --fleet 2 --out new": "--profile is of a single ride",
    "simulate --speed --fleet 2 --out new": "--speed is of a single ride",
    **{f"{SIMULATE} new {option}": "is not in the range" for option in (
        "--seconds 19", "--seconds 7201", "--upright-error -31", "--upright-error 31", "--pitch-change -11",
        "--pitch-change 11", "--seed -1", "--dive -2.1 0", "--dive 0 8.1",
    )},
    "overlay ride.csv --height 239 --out o.mov": "is not in the range",
    "overlay ride.csv --height 4321 --out o.mov": "is not in the range",
    "overlay ride.csv --fps 29 --out o.mov": "is not one of '30', '60'",
    "try my.py --display tft": "is not one of 'lcd', 'ssd1306', 'sh1106'",
}  # fmt: skip


@pytest.mark.parametrize("line", MISTAKES)
def test_mistake_is_reported_in_one_line(tmp_path, monkeypatch, line):
    monkeypatch.chdir(tmp_path)
    refusal = command.refused(tmp_path, *line.split(), words=MISTAKES[line])
    assert re.search(r"[^.][.?] See kickstand.* --help\.\n$", refusal)


REFUSALS = {
    "smooth  --out LEAN.csv": ": ",  # a ride without a name
    "import export --out export/b.csv": "b.csv is also an input",
    "import table.csv --out table.csv": "is also an input: give --out another name",
    **{f"{line} --out {out}": "is also an input" for line, out in (
        ("overlay ride.csv --video v.mp4", "v.mp4"), ("overlay ride.csv --video v.mp4", "ride.csv"),
        ("smooth table.csv", "table.csv"), ("replay ride.csv", "ride.cal.json"),
        ("export ride.csv --to csv", "ride.cal.json"), ("cut ride.csv --from 0", "ride.csv"),
        ("calibrate ride ride.csv", "ride.csv"), ("join ride.csv v.gpx", "ride.csv"), ("join ride.csv v.gpx", "v.gpx"),
    )},
    "simulate --fleet 2 --out .": "holds a ride, whose truth would be lost",
    "simulate --profile street --out fleet": "holds a fleet, whose truth would be lost",
    **{f"{line} --out ride.csv": "ride.csv is a file: give --out the name of a directory"
       for line in ("simulate --profile parked", "pull", "web", "plot ride.csv")},
    "plot ride.csv --out ride.html": "give the directory",
    "import ride.csv --columns t --out o.csv": "--columns: 't' is not NAME=VALUE; separate the pairs with commas",
    "import ride.csv --units a=g,a=g --out o.csv": "--units: 'a' is given twice",
}  # fmt: skip


@pytest.mark.parametrize("line", REFUSALS)
def test_existing_files_are_not_overwritten(tmp_path, monkeypatch, line):
    monkeypatch.chdir(tmp_path)
    for name in ("export/b.csv", "v.mp4", "v.gpx", "table.csv", "RIDE.csv", "fleet/MANIFEST.csv"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text("a file")
    command.still(tmp_path / "ride.csv", (0, 1, 0), seconds=1.0)
    command.write_cal(tmp_path / "ride.cal.json")
    command.refused(tmp_path, *line.split(" "), words=REFUSALS[line])


@needs_links
@pytest.mark.parametrize("line", ["smooth ride.csv", "plot ride.csv", SIMULATE.removesuffix(" --out"), "web"])
def test_links_in_a_circle_are_named(line, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "a").symlink_to("b")
    (tmp_path / "b").symlink_to("a")
    command.still(tmp_path / "ride.csv", (0, 1, 0), seconds=20)
    command.write_cal(tmp_path / "ride.cal.json")
    command.refused(tmp_path, *line.split(), "--out", tmp_path / "a", words="links form a circle")


@pytest.mark.parametrize(("entry", "value"), [("vehicle", "boat"), ("vehicle", 3), ("kickstand_side", "up")])
def test_calibration_with_another_word_is_refused(entry, value, tmp_path):
    ride = command.still(tmp_path / "ride.csv", (0, 1, 0), seconds=20)
    command.write_cal(tmp_path / "ride.cal.json", **{entry: value})
    command.refused(tmp_path, "smooth", ride, "--out", tmp_path / "out.csv", words=f"{entry} is ")


def test_escapes_in_names_do_not_reach_the_terminal(tmp_path):
    assert printable("a\x1b]0;T\x07\nb\t\u65e5\x9b") == "a\\x1b]0;T\\x07\nb\t\u65e5\\x9b"
    with zipfile.ZipFile(tmp_path / "export.zip", "w") as file:
        for sensor, unit in (("Acceleration", "m/s^2"), ("Gyroscope", "rad/s")):
            header = ",".join(f'"{sensor} {axis} ({unit})"' for axis in "xyz")
            rows = "".join(f"{k / 100},0.1,{9.8 + k % 7 / 100},{k % 5 / 50}\n" for k in range(3000))
            file.writestr(f"a\x1b[2J/{sensor}.csv", f'"Time (s)",{header}\n{rows}')
    result = command.run("import", tmp_path / "export.zip", "--out", tmp_path / "out.csv")
    assert "\x1b" not in result.out + result.err and "\\x1b[2J" in result.out + result.err


@pytest.mark.parametrize(
    ("text", "seconds"),
    [("60", 60.0), ("12.5", 12.5), ("-30", -30.0), ("1:00", 60.0), ("-1:30.5", -90.5), ("1:02:03", 3723.0)]
    + [(text, None) for text in ("", "early", "1:", ":30", "1:2:3:4", "1:-5", "1.5:00", "nan", "inf", "--5")],
)
def test_times_are_read_as_seconds_minutes_and_hours(text, seconds):
    if seconds is None:
        with pytest.raises(click.UsageError, match="is not a time: give seconds such as 60"):
            TIME.convert(text, None, None)
    else:
        assert TIME.convert(text, None, None) == seconds


def test_every_command_has_help_and_the_convention_of_logs():
    for name in main.COMMANDS:
        text = " ".join(command.works(name, "--help").out.split())
        assert text.startswith(f"Usage: kickstand {name} ")
        if name in ("import", "smooth", "report", "compare"):
            convention = "At rest, the axis that points up reads +1 g. Rates are right-handed about their axes."
            assert convention in text
    assert "[default: 640.0; 20.0<=x<=7200.0]" in " ".join(command.works("simulate", "--help").out.split())
    assert command.works().out == command.works("--help").out == command.works("-h").out


def test_shell_sees_one_line_on_standard_error_and_status_2(tmp_path):
    arguments = "-m kickstand_tools.cli replay none.csv --calibration x --out y".split()
    process = subprocess.run([sys.executable, *arguments], cwd=tmp_path, capture_output=True, text=True)
    assert (process.returncode, process.stdout) == (2, "") and not list(tmp_path.iterdir())
    assert process.stderr == "kickstand: x: there is no such file: make it with kickstand calibrate\n"


def test_slow_commands_show_progress_on_a_terminal(tmp_path, monkeypatch):
    arguments = [*SIMULATE.split(), tmp_path / "ride"]
    assert command.works(*arguments).err == ""
    assert "simulating a ride" in watched(monkeypatch, Watched(), *arguments)
