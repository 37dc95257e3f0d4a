"""A stopped run is resumed from its journal. A cut or damaged line costs only its own result."""

import json
import os

import pytest
from kickstand_fleet import files, journal as module
from kickstand_fleet.journal import Journal, StoreJournal
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


@pytest.mark.parametrize(("system", "closed"), [("posix", False), ("nt", True)])
def test_an_empty_journal_is_removed_while_it_is_locked(tmp_path, monkeypatch, system, closed):
    """Windows cannot remove an open file. There the journal is removed after it is closed."""
    seen = []

    class Removed:
        def unlink(self):
            seen.append(journal._file.closed)

    with Journal(tmp_path / "journal.jsonl") as journal, monkeypatch.context() as patched:
        patched.setattr(os, "name", system)
        patched.setattr(journal, "_path", Removed())
        journal.__exit__()
    assert seen == [closed]
    with Journal(tmp_path / "other.jsonl") as journal, monkeypatch.context() as patched:
        journal.add("a", result())
        patched.setattr(os, "name", system)
        patched.setattr(journal, "_path", Removed())
        journal.__exit__()
    assert seen == [closed]


def test_others_may_read_and_write_the_journal(tmp_path):
    before = os.umask(0o002)
    try:
        with Journal(tmp_path / "journal.jsonl") as journal:
            journal.add("a", result(message=20_000 * "x"))
    finally:
        os.umask(before)
    if os.name != "nt":
        assert (tmp_path / "journal.jsonl").stat().st_mode & 0o777 == 0o664
    with Journal(tmp_path / "journal.jsonl") as journal:
        assert "a" in journal and journal.damaged == 0  # long lines are read, too


def test_a_line_without_end_is_damaged(tmp_path, monkeypatch):
    """It is read in parts, so that a damaged file cannot fill the memory."""
    path = tmp_path / "journal.jsonl"
    with Journal(path) as journal:
        journal.add("a", result())
    longest = len(path.read_bytes())
    path.write_bytes(path.read_bytes() + (2 * longest - 1) * b"x" + b"\n")
    monkeypatch.setattr(module, "_LONGEST", longest)
    with Journal(path) as journal:
        assert "a" in journal and journal.damaged == 2
    assert path.read_bytes()[longest:] == 2 * ((longest - 1) * b" " + b"\n")


def test_a_part_of_a_line_is_removed_if_the_disk_is_full(tmp_path, monkeypatch):
    path = tmp_path / "journal.jsonl"
    with Journal(path) as journal:
        journal.add("a", result())
        length = path.stat().st_size
        file = journal._file

        class Full:
            def __getattr__(self, name):
                return getattr(file, name)

            def write(self, line):
                file.write(line[:10])
                file.flush()
                raise OSError(28, "No space left on device")

        with monkeypatch.context() as patched, pytest.raises(InputError, match="cannot be written: No space"):
            patched.setattr(journal, "_file", Full())
            journal.add("b", result())
        assert path.stat().st_size == length and "b" not in journal
        journal.add("c", result())
    with Journal(path) as journal:
        assert ("a" in journal, "c" in journal, journal.damaged) == (True, True, 0)


def test_results_of_a_store_are_fetched_200_at_a_time(monkeypatch):
    place = "memory://fleet-many/journal"
    keys = [f"k{k}" for k in range(401)]
    sizes = []
    line = module._line("k", result(), False)

    def read_all(paths):
        sizes.append(len(paths))
        return [line] * len(paths)

    monkeypatch.setattr(files, "read_all", read_all)
    journal = StoreJournal(place)
    journal._kept |= set(keys)
    assert len(list(journal.results([*keys, "none"]))) == 401 and sizes == [200, 200, 1]


def test_a_final_result_of_a_store_replaces_an_earlier_one():
    place = "memory://fleet-again/journal"
    with StoreJournal(place) as journal:
        journal.add("a", result(message="early"), again=True)
        assert "a" not in journal
        assert [found.alignment["message"] for found in journal.results(["a"])] == ["early"]
        journal.add("a", result(message="final"))
    with StoreJournal(place) as journal:
        assert "a" in journal and journal.damaged == 0
        assert [found.alignment["message"] for found in journal.results(["a", "b"])] == ["final"]


def test_a_picture_is_not_kept_in_the_journal(tmp_path):
    with Journal(tmp_path / "journal.jsonl") as journal:
        one = result()
        one.picture = [[1.0, 2.0, 3.0, 4.0]]
        journal.add("a", one)
        assert [found.picture for found in journal.results(["a"])] == [[]]
