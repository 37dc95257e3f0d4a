"""A stopped run is resumed from its journal. A cut or damaged line costs only its own result."""

import json
import os

import pytest
from kickstand_fleet.journal import Journal
from kickstand_fleet.manifest import Period
from kickstand_fleet.period import failed
from kickstand_tools.common.errors import InputError
from support.recordings import broken_logs


def result(name="v", message="x"):
    return failed(Period(name, "", "car", ()), "unreadable", message)


def test_results_are_found_again_in_the_order_of_their_keys(tmp_path):
    """The next run recomputes a result that was saved with again=True. For each key the latest result counts."""
    path = tmp_path / "journal.jsonl"
    with Journal(path) as journal:
        for name in ("b", "a"):
            journal.add(name, result(name))
        journal.add("c", result("c", "later"), again=True)
        assert "c" not in journal
        journal.sync()
    for message in ("later", "now"):
        with Journal(path) as journal:
            assert ("a" in journal, "b" in journal, "c" in journal) == (True, True, message == "now")
            found = list(journal.results(["a", "none", "b", "c"]))
            assert [one.alignment["vehicle"] for one in found] == ["a", "b", "c"]
            assert found[2].alignment["message"] == message
            assert journal.damaged == 0
            journal.add("c", result("c", "now"))


def test_a_journal_without_results_is_removed(tmp_path):
    with Journal(tmp_path / "journal.jsonl"):
        pass
    assert list(tmp_path.iterdir()) == []
    with pytest.raises(InputError, match=r"cannot be used: .*: give --out another directory"):
        Journal(tmp_path / "none" / "journal.jsonl").__enter__()


def test_cut_end_or_full_disk_loses_no_earlier_line(tmp_path, monkeypatch):
    path = tmp_path / "journal.jsonl"
    with Journal(path) as journal:
        journal.add("a", result())
        journal.add("b", result())
    path.write_bytes(path.read_bytes()[:-10])
    with Journal(path) as journal:
        assert ("a" in journal, "b" in journal) == (True, False)
        journal.add("c", result())
        assert [found.alignment["vehicle"] for found in journal.results(["a", "b", "c"])] == ["v", "v"]
    if os.path.exists("/dev/full"):
        full = Journal(tmp_path / "full.jsonl")
        with full:
            full.add("a", result())
            with monkeypatch.context() as patched, pytest.raises(InputError, match="run the same command again"):
                patched.setattr(full, "_file", open("/dev/full", "wb"))
                full.add("b", result())
        with Journal(tmp_path / "full.jsonl") as again:
            assert "a" in again and "b" not in again


def test_two_runs_do_not_share_a_journal(tmp_path):
    pytest.importorskip("fcntl", reason="files are not locked on this system")
    with Journal(tmp_path / "journal.jsonl") as first:
        with pytest.raises(InputError, match="another run works in"):
            Journal(tmp_path / "journal.jsonl").__enter__()
        first.add("a", result())
    with Journal(tmp_path / "journal.jsonl") as second:
        assert "a" in second


def test_removed_journal_is_replaced_and_locked_again(tmp_path, monkeypatch):
    """A run locks the journal and removes it at its end. A second run may have opened the journal just before its
    removal. This second run must create and lock a new journal."""
    fcntl = pytest.importorskip("fcntl", reason="files are not locked on this system")
    path = tmp_path / "journal.jsonl"
    locks, lock = [], fcntl.flock

    def removed_before_the_first(file, how):
        if not locks:
            path.unlink()
        locks.append(how)
        lock(file, how)

    monkeypatch.setattr(fcntl, "flock", removed_before_the_first)
    with Journal(path) as journal:
        journal.add("a", result())
        assert len(locks) == 2
    with Journal(path) as again:
        assert "a" in again


def test_damaged_line_is_dropped_and_counted_once(tmp_path):
    path = tmp_path / "journal.jsonl"
    names = ["a", "b", "c"]
    with Journal(path) as journal:
        for name in names:
            journal.add(name, result(name))
    whole = path.read_bytes().splitlines(keepends=True)
    entry = json.loads(whole[1])
    wrong = [
        entry | {"result": value} for value in (None, [], "x", {}, {"alignment": 1}, entry["result"] | {"more": 1})
    ]
    lines = [broken_logs.broken([whole[1]], number)[1] for number in range(300)]
    lines += [json.dumps(one).encode() + b"\n" for one in wrong]
    for line in (*lines, b"nonsense\n", b"[]\n", b'{"key": 1}\n', b"\0" * 400 + b"\n", 5000 * b"[" + b"\n"):
        path.write_bytes(whole[0] + line + whole[2])
        with Journal(path) as journal:
            found = [one.alignment["vehicle"] for one in journal.results(names)]
            assert found == [name for name in names if name in journal]
            assert journal.damaged or found == names or not line.strip(), line
            assert "a" in found and ("c" in found or not line.endswith(b"\n")), line
            journal.add("d", result("d"))
        with Journal(path) as journal:
            assert "d" in journal and journal.damaged == 0
