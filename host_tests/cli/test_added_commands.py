"""Commands of other packages are found by their entry points. A broken command does not affect the others."""

import subprocess
import sys

import pytest
from kickstand_tools.cli import main
from support import command

LAPS = '''
import click


@click.command()
def laps_command():
    """Split a ride into laps."""
    click.echo("three laps")


@click.command()
def crash_command():
    """Divide by zero."""
    1 / 0
'''


@pytest.fixture
def installed(tmp_path, monkeypatch):
    """Return a function that installs a package as pip does.

    distribution: name of the package.
    entry_points: content of its entry_points.txt.
    modules: {name: content} of its modules.
    """

    def install(distribution: str, entry_points: str, **modules: str) -> None:
        info = tmp_path / f"{distribution}-1.0.dist-info"
        info.mkdir()
        (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {distribution}\nVersion: 1.0\n")
        (info / "entry_points.txt").write_text(entry_points)
        for name, text in modules.items():
            monkeypatch.delitem(sys.modules, name, raising=False)
            (tmp_path / f"{name}.py").write_text(text)

    # Write no .pyc files, because command.refused() allows no new files in the folder
    monkeypatch.setattr(sys, "dont_write_bytecode", True)
    monkeypatch.syspath_prepend(tmp_path)
    return install


def test_command_of_another_package_runs(installed):
    installed("lap-timer", "[kickstand.commands]\nlaps = lap_timer:laps_command\n", lap_timer=LAPS)
    assert command.works("laps").out == "three laps\n"
    assert "laps       Split a ride into laps." in command.works("--help").out


@pytest.mark.parametrize(
    ("value", "module", "why"),
    [
        ("lap_timer:laps_command", "import no_such_module", "ModuleNotFoundError: No module named 'no_such_module'"),
        ("lap_timer:laps_command", "def", "SyntaxError"),
        ("lap_timer:laps_command", "raise SystemExit(3)", "SystemExit: 3"),
        ("lap_timer:laps_command", "", "AttributeError"),
        ("lap_timer:laps_command", "laps_command = 3", "is not a click command"),
        ("no_such_module", "", "ModuleNotFoundError"),
        # Python's own words are not compared, because they depend on its version
        ("not an object!", "", "cannot be loaded"),
    ],
)
def test_a_broken_command_is_one_line_with_its_package(installed, tmp_path, value, module, why):
    """Other commands and the help still work."""
    installed("lap-timer", f"[kickstand.commands]\nlaps = {value}\n", lap_timer=module)
    said = command.refused(tmp_path, "laps", words="the command laps of the package lap-timer cannot be loaded (")
    assert why in said
    assert "lap-timer" in command.works("--help").out
    command.works("report", "--help")
    command.works("bench", "--help")


def test_crash_is_reported_with_its_package(installed, tmp_path):
    installed("lap-timer", "[kickstand.commands]\ncrash = lap_timer:crash_command\n", lap_timer=LAPS)
    said = command.run("crash").err
    assert said == "kickstand: unexpected ZeroDivisionError: division by zero: a fault in lap-timer, please report it\n"


def test_crash_of_kickstand_is_reported_as_a_bug(monkeypatch):
    monkeypatch.setitem(main.COMMANDS, "report", (".no_such_module", ""))
    assert ": a fault in kickstand, please report it" in command.run("report").err


def test_own_command_cannot_be_replaced(installed):
    installed("lap-timer", "[kickstand.commands]\nreport = lap_timer:laps_command\n", lap_timer=LAPS)
    assert "Split a ride into laps" not in command.works("report", "--help").out
    assert "Split a ride into laps" not in command.works("--help").out


def test_unreadable_metadata_adds_no_command(installed):
    installed("lap-timer", "[kickstand.commands]\nlaps\n")
    assert "laps " not in command.works("--help").out
    assert "No such command 'laps'" in command.run("laps").err


def test_users_own_script_is_not_run(tmp_path):
    """A user's script in the current folder is not run, even if its name begins with kickstand."""
    (tmp_path / "kickstand_my_rides.py").write_text("raise RuntimeError('it was run')\n")
    started = [sys.executable, "-m", "kickstand_tools.cli", "--help"]
    done = subprocess.run(started, cwd=tmp_path, capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")


def test_a_checkout_has_the_workshops_commands():
    """Only a checkout has the workshop's commands. host_tests/deploy/test_cli_package.py tests that the wheel does not
    have them."""
    assert {"bands", "bench", "evaluate"} <= set(main.kickstand.list_commands(None))
