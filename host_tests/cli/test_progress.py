"""The progress of slow work is shown on a terminal. The progress is shown at once if the work is known to be slow."""

import contextlib

import pytest
from kickstand_tools.common import output, progress
from kickstand_workshop import commands
from kickstand_workshop.evaluation import runs
from support import command
from support.watched_stderr import Watched, watched


@pytest.mark.parametrize(("patience_s", "seen"), [(0.0, True), (9.0, False)])
def test_bar_without_patience_begins_at_zero(patience_s, seen, monkeypatch):
    monkeypatch.setenv("TERM", "xterm")
    with contextlib.redirect_stderr(Watched()) as drawn, progress.Bar("riding", 4, patience_s):
        pass
    assert ("riding" in drawn.getvalue() and "0%" in drawn.getvalue()) is seen


def test_lines_come_only_as_often_as_asked_for(capsys):
    with progress.Bar("riding", 4, lines_s=9.0) as bar:
        bar.advance(4)
    assert capsys.readouterr().err == ""
    with progress.Bar("vehicles", lines_s=0.0) as bar:
        bar.reach(1, 4)
    assert capsys.readouterr().err == "vehicles: 25 %\n"


def test_simulating_a_ride_shows_progress(tmp_path, monkeypatch):
    arguments = ["simulate", "--profile", "parked", "--seconds", 20, "--out", tmp_path / "ride"]
    assert command.works(*arguments).err == ""
    assert "simulating a ride" in watched(monkeypatch, Watched(), *arguments)


def test_evaluation_shows_progress_from_the_start(monkeypatch):
    """On a terminal the progress is shown at 0 %, before the first ride is finished. Without a terminal a line is
    printed from time to time."""
    monkeypatch.setattr(runs.estimators, "estimate", lambda log, calibration: {})
    arguments = ["evaluate", "--profiles", "parked", "--seeds", 2, "--seconds", 60, "--json"]
    shown = watched(monkeypatch, Watched(), *arguments)
    assert "riding" in shown and " 0%" in shown
    monkeypatch.setattr(commands, "LINES_S", 0.0)
    lines = command.works(*arguments).err.splitlines()
    assert lines == ["riding: 50 %", "riding: 100 %"]


def test_existing_or_filled_directory_is_kept(tmp_path):
    (tmp_path / "old").mkdir()
    for path in (tmp_path / "old", tmp_path / "new"):
        with contextlib.suppress(KeyboardInterrupt), output.new_directory(path):
            if path.name == "new":
                (path / "file").write_text("")
            raise KeyboardInterrupt
    assert (tmp_path / "old").is_dir()
    assert (tmp_path / "new" / "file").exists()


@pytest.mark.parametrize(
    "arguments", [["simulate", "--profile", "parked"], ["evaluate", "--profiles", "parked"], ["pull"]]
)
def test_file_instead_of_a_directory_is_refused_early(arguments, tmp_path, monkeypatch):
    monkeypatch.setattr("kickstand_tools.simulation.files.ride", None)
    monkeypatch.setattr(runs, "run_all", None)
    (tmp_path / "file").write_text("")
    words = f"kickstand: {tmp_path / 'file'} is a file: give --out the name of a directory\n"
    assert command.refused(tmp_path, *arguments, "--out", tmp_path / "file") == words
