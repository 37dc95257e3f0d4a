"""What all commands share: files written completely or not at all, times, drawings, templates, messages, progress."""

import contextlib
import io
import os
import pickle
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from kickstand_tools.cli import common
from kickstand_tools.common import installation, markup, messages, output
from kickstand_tools.common.messages import InputError, Message, Plain, RefusedInput, Remedy, WrongAxes
from support.watched_stderr import Watched

needs_links = pytest.mark.skipif(os.name == "nt", reason="needs symbolic links and /dev")
ROOT = Path(__file__).resolve().parents[2]


# Files


@pytest.mark.parametrize("error", [InputError("is the line cut?"), OSError(28, "no room"), KeyboardInterrupt(), None])
def test_failed_write_leaves_only_the_earlier_file(error, tmp_path, monkeypatch):
    """Without an error the write fails at the last moment, when the disk is full."""

    def full(_number):
        raise OSError(28, "No space left on device")

    path = tmp_path / "ride.vbo"
    path.write_text("old")
    with monkeypatch.context() as patch, pytest.raises((InputError, KeyboardInterrupt)):
        if not error:
            patch.setattr(os, "fsync", full)
        with output.whole_file(path) as temporary:
            assert (temporary.suffix, temporary.parent, temporary.name[0]) == (".vbo", tmp_path, ".")
            temporary.write_text("half of the n")
            if error:
                raise error
    assert [entry.read_text() for entry in tmp_path.iterdir()] == ["old"]
    with output.whole_file(path) as temporary:
        temporary.write_text("new")
        assert path.read_text() == "old"
    assert [entry.read_text() for entry in tmp_path.iterdir()] == ["new"]


@pytest.mark.skipif(not hasattr(signal, "SIGHUP"), reason="needs kill()")
@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP, signal.SIGINT])
def test_signal_leaves_no_temporary_file(number, tmp_path):
    code = (
        "import os, signal, sys, time; from pathlib import Path\n"
        "signal.signal(signal.SIGINT, signal.default_int_handler)\n"
        "signal.signal(signal.SIGHUP, signal.SIG_DFL)\n"  # nohup ignores it, and a process inherits that
        "from kickstand_tools.cli import main; from kickstand_tools.common.output import whole_file\n"
        "def cut(*_, **__):\n"
        "    with whole_file(Path('old.csv')) as temporary:\n"
        f"        temporary.write_text('half'); os.kill(os.getpid(), {int(number)}); time.sleep(9)\n"
        "main.kickstand.invoke = cut; main.main(['report'])"
    )
    (tmp_path / "old.csv").write_text("before")
    process = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True)
    assert process.returncode == (130 if number == signal.SIGINT else 128 + number)
    assert process.stderr.strip() == "kickstand: stopped"
    assert [path.read_text() for path in tmp_path.iterdir()] == ["before"]


def test_output_must_be_a_new_or_ordinary_file(tmp_path):
    log, other = tmp_path / "log.csv", tmp_path / "other.csv"
    log.write_text("a log")
    (tmp_path / "same.csv").hardlink_to(log)
    output.check_output(other, [log])
    other.write_text("an earlier result")
    output.check_output(other, [log, tmp_path / "none.csv"])
    for path, reason in (
        (tmp_path, "is a directory: give --out the name of a file"),
        (log, "is also an input: give --out another name"),
        (tmp_path / "same.csv", "is also an input"),
        (tmp_path / "none" / "a.csv", "there is no directory"),
    ):
        with pytest.raises(InputError, match=reason):
            output.check_output(path, [other, log])
    output.check_directory(tmp_path)
    output.check_directory(tmp_path / "new")
    with pytest.raises(InputError, match="is a file: give --out the name of a directory"):
        output.check_directory(log)


@needs_links
def test_pipe_is_refused_and_a_link_is_followed(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(InputError, match="is not an ordinary file"):
        output.check_output(tmp_path / "pipe", [])
    (tmp_path / "real").write_text("old")
    (tmp_path / "link").symlink_to("real")
    with output.whole_file(tmp_path / "link") as temporary:
        temporary.write_text("new")
    assert (tmp_path / "link").is_symlink() and (tmp_path / "real").read_text() == "new"


@needs_links
@pytest.mark.parametrize("name", ["/dev/stdout", "/dev/fd/1", "/proc/self/fd/1", "link"])
def test_file_that_the_shell_has_opened_is_not_replaced(name, tmp_path):
    (tmp_path / "link").symlink_to("/dev/stdout")
    (tmp_path / "log").write_text("before\n")
    code = (
        "from pathlib import Path; from kickstand_tools.common.output import check_output; "
        f"check_output(Path({name!r}), [])"
    )
    with open(tmp_path / "log", "a") as log:
        process = subprocess.run(
            [sys.executable, "-c", code], cwd=tmp_path, stdout=log, stderr=subprocess.PIPE, text=True
        )
    assert "this command's own input or output" in process.stderr and (tmp_path / "log").read_text() == "before\n"


# Texts


@pytest.mark.parametrize(("seconds", "text"), [(59.6, "1:00"), (3599, "59:59"), (3723, "1:02:03")])
def test_time_is_written_as_on_a_clock(seconds, text):
    assert markup.clock(seconds) == text


class Late(Message):
    late_s: float
    name: str

    code = "late"
    text = "{name} is {late_s:.1f} s late"
    todo = Remedy("run it with --shift {late_s:.0f}", "shift it by {late_s:.0f} s")


class Turned(WrongAxes):
    code = "turned"
    text = "the axes are turned"


def test_message_has_words_for_a_terminal_and_for_a_page():
    late = Late(2.04, "a.csv")
    assert late.line() == messages.sentence(late) == "a.csv is 2.0 s late: run it with --shift 2"
    assert late.line(page=True) == messages.sentence(late, True) == "a.csv is 2.0 s late: shift it by 2 s"
    assert late.values == (2.04, "a.csv") and Turned().line() == "the axes are turned"
    longer = Remedy("run x", "press x").followed("; wait")
    assert (longer.words(), longer.words(True)) == ("run x; wait", "press x; wait")
    filled = Remedy("wait {n} s").followed(" or stop").filled(n=3)
    assert filled.words() == filled.words(True) == "wait 3 s or stop"
    assert Plain("it is {broken}", Remedy("stop")).line() == "it is {broken}: stop"
    assert messages.by_code(Late, Turned) == {"late": Late, "turned": Turned}
    assert messages.is_explained([late, Turned()]) and not messages.is_explained([late])


def test_refusal_keeps_its_reason_in_another_process():
    refusal = pickle.loads(pickle.dumps(RefusedInput(Turned(), "a.csv", ", as it seems")))
    assert str(refusal) == refusal.line(True) == "a.csv: the axes are turned, as it seems"
    assert (refusal.code, refusal.message) == ("turned", Turned())
    assert str(refusal.at("b.csv")) == "b.csv: the axes are turned, as it seems"
    assert str(RefusedInput(Turned())) == "the axes are turned"
    error = pickle.loads(pickle.dumps(InputError("{x} is no file", Remedy("run x", "press x"))))
    assert (str(error), error.line(True)) == ("{x} is no file: run x", "{x} is no file: press x")
    assert str(InputError(Late(1.0, "b"))) == "b is 1.0 s late: run it with --shift 1"
    causes = [PermissionError(13, "Permission denied", "a.csv"), ValueError("odd"), TimeoutError()]
    assert [messages.cause(cause) for cause in causes] == ["Permission denied", "odd", "TimeoutError"]


# The firmware


def test_firmware_and_config_are_those_of_the_checkout(tmp_path, monkeypatch):
    assert not installation.installed() and installation.firmware() == ROOT / "firmware"
    assert installation.documents() == ROOT
    monkeypatch.chdir(tmp_path)
    (tmp_path / "config.py").write_text("")
    assert installation.config() == ROOT / "firmware" / "config.py"  # only an installed package uses its own config.py
    (tmp_path / "firmware" / "kickstand").mkdir(parents=True)
    assert installation.config() == ROOT / "firmware" / "config.py"  # the folder is not a checkout yet
    (tmp_path / "firmware" / "config.py").write_text("")
    assert installation.config() == tmp_path / "firmware" / "config.py"
    assert installation.extra("web") == f'{sys.executable} -m pip install -e "{ROOT}[web]"'


def test_installed_package_has_its_documents_and_firmware(tmp_path, monkeypatch):
    monkeypatch.setattr(installation, "TOOLS", tmp_path)
    package = tmp_path / "kickstand_tools"
    (package / "firmware").mkdir(parents=True)
    assert installation.installed() and installation.firmware() == package / "firmware"
    assert installation.documents() == package / "documents"
    assert installation.extra("web") == f'{sys.executable} -m pip install "kickstand-lean[web]"'


def test_another_process_finds_the_firmware_and_the_tools():
    tools, firmware = map(Path, installation.search_path().split(os.pathsep))
    assert (tools / "kickstand_tools").is_dir() and (firmware / "kickstand" / "lean").is_dir()
    arguments, environment = installation.micropython("a.py", "b", "c")
    assert environment["MICROPYPATH"].split(":")[-1] == ".frozen"
    assert arguments[0] == sys.executable and arguments[-3:] == ["a.py", "b", "c"]


# Progress


@pytest.mark.parametrize(
    ("patience_s", "wait_s", "shown"), [(1.0, 0.9, False), (1.0, 1.1, True), (0.0, 0.0, True), (9.0, 1.1, False)]
)
def test_bar_appears_after_its_patience(patience_s, wait_s, shown, monkeypatch):
    now_s = [10.0]
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setattr(time, "monotonic", lambda: now_s[0])
    with contextlib.redirect_stderr(Watched()) as terminal, common.Bar("riding", 4, patience_s) as bar:
        assert ("riding" in terminal.getvalue() and "0%" in terminal.getvalue()) is (patience_s == 0.0)
        now_s[0] += wait_s
        bar.reach_in("walking", 1, 4)
    assert ("walking" in terminal.getvalue()) is shown


def test_lines_of_progress_come_after_their_interval(monkeypatch):
    now_s = [10.0]
    monkeypatch.setattr(time, "monotonic", lambda: now_s[0])
    with contextlib.redirect_stderr(io.StringIO()) as lines, common.Bar("riding", 4, lines_s=10.0) as bar:
        for wait_s in (9.0, 2.0, 9.0, 1.0):
            now_s[0] += wait_s
            bar.advance(1)
    assert lines.getvalue().splitlines() == ["riding: 50 %", "riding: 100 %"]
