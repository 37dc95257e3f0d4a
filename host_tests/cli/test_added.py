"""Commands of other packages are found by their entry points. Any error of a command is one line with its status."""

import signal
import subprocess
import sys
from importlib.metadata import EntryPoint

import pytest
from kickstand_tools.cli import main
from support import command

LAPS = '''
import errno, os, signal
import click


@click.command(short_help="Split a ride into laps.")
def laps_command():
    """Not this."""
    ACTION
'''
THREE_LAPS = LAPS.replace("ACTION", 'click.echo("three laps")')
ENTRY = "[kickstand.commands]\nlaps = lap_timer:laps_command\n"


@pytest.fixture
def install(tmp_path, monkeypatch):
    """Return a function that installs a package as pip does.

    entry_points: content of its entry_points.txt. module: content of its module lap_timer.
    """

    def add(entry_points=ENTRY, module=THREE_LAPS):
        info = tmp_path / "lap-timer-1.0.dist-info"
        info.mkdir()
        (info / "METADATA").write_text("Metadata-Version: 2.1\nName: lap-timer\nVersion: 1.0\n")
        (info / "entry_points.txt").write_text(entry_points)
        monkeypatch.delitem(sys.modules, "lap_timer", raising=False)
        (tmp_path / "lap_timer.py").write_text(module)

    # Write no .pyc files, because command.refused() allows no new files in the folder
    monkeypatch.setattr(sys, "dont_write_bytecode", True)
    monkeypatch.syspath_prepend(tmp_path)
    return add


def test_command_of_another_package_runs(install):
    install()
    assert command.works("laps").out == "three laps\n"
    assert "laps       Split a ride into laps." in command.works("--help").out


@pytest.mark.parametrize(
    ("value", "module", "reason"),
    [
        ("lap_timer:laps_command", "import no_such_module", "ModuleNotFoundError: No module named 'no_such_module'"),
        ("lap_timer:laps_command", "def", "SyntaxError"),
        ("lap_timer:laps_command", "raise SystemExit(3)", "SystemExit: 3"),
        ("lap_timer:laps_command", "", "AttributeError"),
        ("lap_timer:laps_command", "laps_command = 3", "is not a click command"),
        ("no_such_module", "", "ModuleNotFoundError"),
        ("not an object!", "", ""),  # Python's words depend on its version
    ],
)
def test_broken_command_is_one_line_with_its_package(install, tmp_path, value, module, reason):
    """Other commands and the help still work."""
    install(f"[kickstand.commands]\nlaps = {value}\n", module)
    words = "the command laps of the package lap-timer cannot be loaded ("
    assert reason in command.refused(tmp_path, "laps", words=words)
    assert "lap-timer" in command.works("--help").out
    command.works("report", "--help")


ERRORS = {
    "raise ZeroDivisionError('oh')": (2, "unexpected ZeroDivisionError: oh: a fault in lap-timer, please report it"),
    "raise __import__('kickstand_tools.api').api.InputError('no\\nsuch   thing')": (2, "no such thing"),
    "raise MemoryError": (2, "not enough memory: use a shorter part of the log, or close other programs"),
    "raise RecursionError": (2, "the data in a file is nested too deeply: the file is damaged, or not meant for this"),
    "raise UnicodeError('bad')": (2, "a file name or a text has characters that cannot be used here (bad): rename"),
    "open('none/x')": (2, "none/x: No such file or directory: check the name and its directory"),
    "open(__file__ + '/x')": (2, "lap_timer.py/x: Not a directory: check the name and its directory"),
    "open('.')": (2, ".: Is a directory: give the name of a file"),
    "raise OSError(5, 'odd')": (2, "odd: check the disk, the file or the connection, then repeat this"),
    "raise KeyboardInterrupt": (130, "stopped"),
    "raise click.ClickException('no')": (2, "no"),
    "os.kill(os.getpid(), signal.SIGTERM)": (143, "stopped"),
    "os.kill(os.getpid(), signal.SIGHUP)": (129, "stopped"),
}


@pytest.mark.parametrize("action", ERRORS)
@pytest.mark.skipif(not hasattr(signal, "SIGHUP"), reason="needs the signals of Unix")
def test_each_error_is_one_line_with_its_status(action, install):
    status, words = ERRORS[action]
    install(module=LAPS.replace("ACTION", action))
    handlers = {number: signal.signal(number, signal.SIG_DFL) for number in (signal.SIGTERM, signal.SIGHUP)}
    try:
        result = command.run("laps")
        assert all(signal.getsignal(number) == signal.SIG_DFL for number in handlers)
    finally:
        for number, handler in handlers.items():
            signal.signal(number, handler)
    assert (result.status, result.out, result.err.strip().count("\n")) == (status, "", 0)
    assert result.err.strip().startswith("kickstand: ") and words in result.err


def test_an_invalid_entry_point_does_not_hide_a_crash(install, monkeypatch):
    install("[kickstand.commands]\nlaps = not an object!\n")
    monkeypatch.setitem(main.COMMANDS, "report", EntryPoint("report", "no_such_module", main.GROUP))
    assert ": a fault in kickstand, please report it" in command.run("report").err


def test_own_command_cannot_be_replaced(install):
    install("[kickstand.commands]\nreport = lap_timer:laps_command\n")
    for arguments in (["report", "--help"], ["--help"]):
        assert "Split a ride into laps" not in command.works(*arguments).out


def test_users_own_script_is_not_run(tmp_path):
    """A user's script in the current folder is not run, even if its name begins with kickstand."""
    (tmp_path / "kickstand_my_rides.py").write_text("raise RuntimeError('it was run')\n")
    arguments = [sys.executable, "-m", "kickstand_tools.cli", "--help"]
    process = subprocess.run(arguments, cwd=tmp_path, capture_output=True, text=True)
    assert (process.returncode, process.stderr) == (0, "")


def test_checkout_has_the_workshops_commands():
    """The wheel does not have them (host_tests/deploy/test_package.py)."""
    assert {"bands", "bench", "evaluate"} <= set(main.kickstand.list_commands(None))
