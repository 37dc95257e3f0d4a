"""Faults outside the program are not reported as its bugs: circular links, deep nesting, escapes in names, signals, and
odd values."""

import os
import signal
import subprocess
import sys
import time
import zipfile

import pytest
from kickstand_tools.cli import main
from kickstand_tools.common.errors import InputError, printable
from kickstand_tools.common.output import check_output, whole_file
from support import command

needs_links = pytest.mark.skipif(os.name == "nt", reason="needs symbolic links and /dev")


@needs_links
@pytest.mark.parametrize("verb", ["smooth", "plot", "simulate", "web"])
def test_links_in_a_circle_are_named(verb, tmp_path):
    (tmp_path / "a").symlink_to("b")
    (tmp_path / "b").symlink_to("a")
    ride = command.still(tmp_path / "ride.csv", (0, 1, 0), seconds=20)
    command.write_cal(tmp_path / "ride.cal.json")
    given = {"simulate": ["--profile", "street"], "web": []}.get(verb, [ride])
    command.refused(tmp_path, verb, *given, "--out", tmp_path / "a", words="links form a circle")


@needs_links
@pytest.mark.parametrize("name", ["/dev/stdout", "/dev/fd/1", "/proc/self/fd/1", "link"])
def test_a_file_that_the_shell_has_opened_is_not_replaced(name, tmp_path):
    (tmp_path / "link").symlink_to("/dev/stdout")
    (tmp_path / "log").write_text("before\n")
    out = name if name.startswith("/") else str(tmp_path / name)
    code = (
        "from pathlib import Path; from kickstand_tools.common.output import check_output; "
        f"check_output(Path({out!r}), [])"
    )
    with open(tmp_path / "log", "a") as log:
        done = subprocess.run([sys.executable, "-c", code], stdout=log, stderr=subprocess.PIPE, text=True)
    assert "this command's own input or output" in done.stderr
    assert (tmp_path / "log").read_text() == "before\n"
    check_output(tmp_path / "new", [])


@pytest.mark.parametrize("error", [RecursionError("maximum recursion depth exceeded"), MemoryError()])
def test_deep_nesting_is_not_reported_as_a_bug(error, monkeypatch, tmp_path):
    def fails(*_args, **_more):
        raise error

    monkeypatch.setattr(main.kickstand, "main", fails)
    assert "fault in kickstand" not in command.refused(tmp_path, "report", tmp_path)


@pytest.mark.skipif(not hasattr(signal, "SIGHUP"), reason="needs kill()")
@pytest.mark.parametrize("name", ["SIGTERM", "SIGHUP", "SIGINT"])
def test_a_signal_leaves_no_temporary_file(name, tmp_path, monkeypatch):
    number = getattr(signal, name)
    (tmp_path / "old.csv").write_text("before")

    def works(*_args, **_more):
        with whole_file(tmp_path / "old.csv") as temporary:
            temporary.write_text("half")
            os.kill(os.getpid(), number)
            time.sleep(5)

    monkeypatch.setattr(main.kickstand, "invoke", works)
    # A shell starts background jobs with SIGINT ignored, and nohup ignores SIGHUP
    before = signal.signal(number, signal.default_int_handler if name == "SIGINT" else signal.SIG_DFL)
    try:
        result = command.run("report")
    finally:
        signal.signal(number, before)
    assert result.status == (130 if name == "SIGINT" else 128 + number)
    assert result.err.strip() == "kickstand: stopped"
    assert [path.read_text() for path in tmp_path.iterdir()] == ["before"]


def test_escapes_in_names_do_not_reach_the_terminal(tmp_path):
    assert printable("a\x1b]0;T\x07\nb\t\u65e5\x9b") == "a\\x1b]0;T\\x07\nb\t\u65e5\\x9b"
    with zipfile.ZipFile(tmp_path / "export.zip", "w") as file:
        for sensor, unit in (("Acceleration", "m/s^2"), ("Gyroscope", "rad/s")):
            head = ",".join(f'"{sensor} {axis} ({unit})"' for axis in "xyz")
            rows = "".join(f"{k / 100},0.1,{9.8 + k % 7 / 100},{k % 5 / 50}\n" for k in range(3000))
            file.writestr(f"a\x1b[2J/{sensor}.csv", f'"Time (s)",{head}\n{rows}')
    result = command.run("import", tmp_path / "export.zip", "--out", tmp_path / "out.csv")
    assert "\x1b" not in result.out + result.err
    assert "\\x1b[2J" in result.out + result.err


@pytest.mark.parametrize(("entry", "value"), [("vehicle", "boat"), ("vehicle", 3), ("kickstand_side", "up")])
def test_a_calibration_with_another_word_is_refused(entry, value, tmp_path):
    ride = command.still(tmp_path / "ride.csv", (0, 1, 0), seconds=20)
    command.write_cal(tmp_path / "ride.cal.json", **{entry: value})
    command.refused(tmp_path, "smooth", ride, "--out", tmp_path / "out.csv", words=f"{entry} is ")


def test_a_full_disk_at_the_last_moment_is_named(tmp_path, monkeypatch):
    def full(_number):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    (tmp_path / "old").write_text("before")
    with pytest.raises(InputError, match="No space left"), whole_file(tmp_path / "old") as temporary:
        temporary.write_text("new")
    assert [path.read_text() for path in tmp_path.iterdir()] == ["before"]
