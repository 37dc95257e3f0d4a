"""A stopped run is resumed from its journal. A cut or damaged line costs only its own result."""

import json
import os
import re

import pytest
from kickstand_fleet import files
from kickstand_fleet.journal import Journal, StoreJournal
from kickstand_fleet.manifest import Period
from kickstand_fleet.period import failed
from kickstand_tools.common.errors import InputError
from support.recordings import broken_logs


def result(name="v", message="x"):
    outcome = failed(Period(name, "", "car", ()), "unreadable", message)
    outcome.picture = [[1.0, 2.0, 3.0, 4.0]]
    return outcome


@pytest.fixture(params=["file", "store"])
def journal_of(request, tmp_path):
    """Return a function that opens the same journal each time, in a file or in a store."""
    address = f"memory:///{tmp_path.name}-{os.getpid()}/journal"
    return lambda: Journal(tmp_path / "journal.jsonl") if request.param == "file" else StoreJournal(address)


def vehicles(journal, keys):
    return [outcome.alignment["vehicle"] for outcome in journal.results(keys)]


def test_results_are_read_again_in_the_order_of_their_keys(journal_of):
    """The next run recomputes a result that was saved with again=True. For each key the latest result counts."""
    with journal_of() as journal:
        for name in ("b", "a"):
            journal.add(name, result(name))
        journal.add("c", result("c", "early"), again=True)
        assert "c" not in journal and "a" in journal
        journal.sync()
    for message in ("early", "final"):
        with journal_of() as journal:
            assert ["a" in journal, "b" in journal, "c" in journal] == [True, True, message == "final"]
            outcomes = list(journal.results(["a", "none", "b", "c"]))
            assert [outcome.alignment["vehicle"] for outcome in outcomes] == ["a", "b", "c"]
            assert outcomes[2].alignment["message"] == message and outcomes[2].picture == [] and journal.damaged == 0
            journal.add("c", result("c", "final"))


def test_a_damaged_result_in_a_store_is_counted_and_computed_again(tmp_path):
    address = f"memory:///{tmp_path.name}-damaged"
    with StoreJournal(address) as journal:
        for key in ("a", "b", "c"):
            journal.add(key, result(key), again=key == "c")
    for name in ("b.json", "c.again.json"):
        files.write_bytes(f"{address}/{name}", b'{"key": "b"')
    with StoreJournal(address) as journal:
        assert journal.damaged == 2 and ["a" in journal, "b" in journal, "c" in journal] == [True, False, False]
        assert vehicles(journal, ["a", "b", "c"]) == ["a"]


def test_two_runs_do_not_share_a_journal(tmp_path):
    pytest.importorskip("fcntl", reason="files are not locked on this system")
    with Journal(tmp_path / "journal.jsonl") as first:
        with pytest.raises(InputError, match=re.escape(f"another run works in {tmp_path}: wait for it, or end it")):
            Journal(tmp_path / "journal.jsonl").__enter__()
        first.add("a", result())
    with Journal(tmp_path / "journal.jsonl") as second:
        assert "a" in second


def test_damaged_line_is_dropped_and_counted_once(tmp_path):
    path, names = tmp_path / "journal.jsonl", ["a", "b", "c"]
    with Journal(path) as journal:
        for name in names:
            journal.add(name, result(name))
    first, second, third = path.read_bytes().splitlines(keepends=True)
    entry = json.loads(second)
    wrong = [{"result": value} for value in (None, [], "x", {}, {"alignment": 1}, entry["result"] | {"more": 1})]
    lines = [json.dumps(entry | change).encode() + b"\n" for change in (*wrong, {"key": "z"}, {"again": True})]
    lines += [broken_logs.broken([second], number)[1] for number in range(100)]
    for line in (*lines, b"nonsense\n", b"[]\n", b'{"key": 1}\n', b"\0" * 400 + b"\n", 5000 * b"[" + b"\n"):
        path.write_bytes(first + line + third)
        with Journal(path) as journal:
            assert vehicles(journal, names) == [name for name in names if name in journal]
            # A line without its end spoils the next one
            assert "a" in journal and ("c" in journal or not line.endswith(b"\n"))
            assert "b" in journal or journal.damaged > 0 or not line.strip(), line
            journal.add("d", result("d"))
        with Journal(path) as journal:
            assert "d" in journal and journal.damaged == 0


def test_a_cut_end_loses_only_its_own_result(tmp_path):
    path = tmp_path / "journal.jsonl"
    with Journal(path) as journal:
        journal.add("a", result("a", 20_000 * "x"))
        journal.add("b", result("b"))
    path.write_bytes(path.read_bytes()[:-10])
    with Journal(path) as journal:
        assert ["a" in journal, "b" in journal, journal.damaged] == [True, False, 1]
        journal.add("c", result("c"))
        assert vehicles(journal, ["a", "b", "c"]) == ["a", "c"]


def test_a_line_that_does_not_fit_is_removed(tmp_path):
    """The limit of the file's size cuts the line as a full disk does."""
    resource = pytest.importorskip("resource")
    path = tmp_path / "journal.jsonl"
    with Journal(path) as journal:
        journal.add("a", result())
        length = path.stat().st_size
        limits = resource.getrlimit(resource.RLIMIT_FSIZE)
        resource.setrlimit(resource.RLIMIT_FSIZE, (length + 10, limits[1]))
        try:
            with pytest.raises(
                InputError, match="cannot be written: File too large; finished work is kept: run the same"
            ):
                journal.add("b", result())
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, limits)
        assert path.stat().st_size == length and "b" not in journal
        journal.add("c", result())
    with Journal(path) as journal:
        assert ["a" in journal, "c" in journal, journal.damaged] == [True, True, 0]
