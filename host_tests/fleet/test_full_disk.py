"""If the disk fills up during any write, no finished row is lost, and one line reports the full disk."""

import copy
import errno
import os
import subprocess
import sys

import pyarrow.parquet as parquet
import pytest
from kickstand_fleet import run
from kickstand_fleet.journal import Journal
from kickstand_fleet.manifest import read_manifest
from kickstand_fleet.period import DISK_FULL, work_on_period
from kickstand_fleet.run import run_fleet
from kickstand_tools.common.errors import InputError

FULL = OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


@pytest.fixture
def disk(tmp_path):
    """Return the directory where resize() mounts a disk."""
    if not sys.platform.startswith("linux"):
        pytest.skip("tmpfs is of Linux")
    path = tmp_path / "disk"
    path.mkdir()
    yield path
    subprocess.run(["umount", str(path)], capture_output=True, check=False)


def resize(path, kb):
    """Mount a disk in memory with this size at path, or change its size."""
    option = "remount," if os.path.ismount(path) else ""
    mount = ["mount", "-t", "tmpfs", "-o", f"{option}size={kb}k", "tmpfs", str(path)]
    if subprocess.run(mount, capture_output=True, check=False).returncode:
        pytest.skip("no right to mount a disk")


@pytest.fixture(scope="module")
def results(fleet):
    """Return the results of three vehicles, {name: result}, and their periods."""
    periods = read_manifest(str(fleet.manifest))[:3]
    return {period.vehicle: work_on_period(period) for period in periods}, periods


def finished(directory, keys):
    if not (directory / "journal.jsonl").exists():
        return 0
    with Journal(directory / "journal.jsonl") as journal:
        return sum(key in journal for key in keys)


# On the smallest disk there is no room for a picture. On the largest disk there is room for all rows, but not for the
# last table.
@pytest.mark.parametrize("kb", [8, 48, 80])
def test_disk_of_any_size_loses_no_finished_row(disk, results, alone, monkeypatch, kb):
    known, periods = results
    monkeypatch.setattr(run, "work_on_period", lambda period, _: copy.deepcopy(known[period.vehicle]))
    resize(disk, kb)
    out = disk / "results"
    with pytest.raises(InputError, match=r"^[^\n]*No space left on device[^\n]*$"):
        run_fleet(periods, out)
    keys = run._keys(periods, run._marks(periods), False)
    kept = finished(out, keys)
    resize(disk, 4096)
    whole = run_fleet(periods, out)
    assert whole.new == len(periods) - kept
    rows = parquet.read_table(out / "alignments.parquet").to_pylist()
    assert [row["status"] for row in rows] == [known[period.vehicle].alignment["status"] for period in periods]
    assert all((out / row["plot"]).is_file() for row in rows)
    assert not list(out.rglob(".*"))  # no half-written file is left
    assert run_fleet(periods, out).new == 0


def test_unwritable_picture_costs_no_row(results, alone, tmp_path, monkeypatch):
    known, periods = results
    monkeypatch.setattr(run, "work_on_period", lambda period, _: copy.deepcopy(known[period.vehicle]))

    def full(*_):
        raise InputError("plots cannot be written: No space left on device")

    with monkeypatch.context() as patched, pytest.raises(InputError, match="plots cannot be written"):
        patched.setattr("kickstand_fleet.show.plot.write_plot", full)
        run_fleet(periods, tmp_path)
    rows = parquet.read_table(tmp_path / "alignments.parquet").to_pylist()
    assert [(row["status"], row["plot"]) for row in rows] == [("aligned", "")]
    assert run_fleet(periods, tmp_path).new == len(periods)  # the first period runs again for its picture


def test_signals_that_did_not_fit_are_written_by_the_next_run(results, alone, tmp_path, monkeypatch):
    _, periods = results

    def full(path, _):
        raise InputError(f"{path} cannot be written: {FULL.strerror}") from FULL

    with monkeypatch.context() as patched:
        patched.setattr("kickstand_fleet.signals.write_bytes", full)
        with pytest.raises(InputError, match="No space left on device; finished work is kept: run the same command"):
            run_fleet(periods[:2], tmp_path, with_signals=True)
    rows = parquet.read_table(tmp_path / "alignments.parquet").to_pylist()
    assert [row["status"] for row in rows] == ["aligned"]
    errors = parquet.read_table(tmp_path / "errors.parquet")["reason"].to_pylist()
    assert set(errors) == {DISK_FULL}
    whole = run_fleet(periods[:2], tmp_path, with_signals=True)
    assert (whole.new, whole.seen.errors) == (2, 0) and list(tmp_path.glob("signals/**/*.parquet"))


def test_a_journal_that_cannot_reach_the_disk_is_reported(tmp_path, monkeypatch):
    def full(_):
        raise FULL

    monkeypatch.setattr(os, "fsync", full)
    with (
        Journal(tmp_path / "journal.jsonl") as journal,
        pytest.raises(InputError, match="No space left on device; finished work is kept: run the same command"),
    ):
        journal.sync()
