"""A stopped run is resumed from its journal. A damaged result costs only itself."""

import json
import os

import pytest
from kickstand_fleet import files
from kickstand_fleet.journal import Journal
from kickstand_fleet.manifest import Period
from kickstand_fleet.period import failed
from kickstand_tools.common.messages import InputError
from support.recordings import broken_logs


def result(name="v", message="x"):
    outcome = failed(Period(name, "", "car", ()), "unreadable", message)
    outcome.picture = [[1.0, 2.0, 3.0, 4.0]]
    return outcome


@pytest.fixture(params=["disk", "store"])
def directory(request, tmp_path):
    return f"{tmp_path}/journal" if request.param == "disk" else f"memory:///{tmp_path.name}-{os.getpid()}/journal"


def vehicles(journal, keys):
    return [outcome.alignment["vehicle"] for outcome in journal.results(keys)]


def test_results_are_read_again_in_the_order_of_their_keys(directory):
    """The next run recomputes a result that was saved with again=True. For each key the latest result counts."""
    journal = Journal(directory)
    for name in ("b", "a"):
        journal.add(name, result(name))
    journal.add("c", result("c", "early"), again=True)
    assert "c" not in journal and "a" in journal
    for message in ("early", "final"):
        journal = Journal(directory)
        assert ["a" in journal, "b" in journal, "c" in journal] == [True, True, message == "final"]
        outcomes = list(journal.results(["a", "none", "b", "c"]))
        assert [outcome.alignment["vehicle"] for outcome in outcomes] == ["a", "b", "c"]
        assert outcomes[2].alignment["message"] == message and outcomes[2].picture == [] and journal.damaged == 0
        journal.add("c", result("c", "final"))


def test_a_damaged_result_is_counted_and_computed_again(directory):
    journal = Journal(directory)
    for key in ("a", "b", "c"):
        journal.add(key, result(key), again=key == "c")
    content = files.read_bytes(f"{directory}/b.json")
    entry = json.loads(content)
    wrong = [{"result": value} for value in (None, [], "x", {}, {"alignment": 1}, entry["result"] | {"more": 1})]
    contents = [json.dumps(entry | change).encode() for change in (*wrong, {"key": "z"})]
    contents += [broken_logs.broken([content], number)[1] for number in range(50)]
    for damaged in (*contents, content[:-10], b"", b"nonsense", b"[]", b'{"key": 1}', b"\0" * 400, 5000 * b"["):
        files.write_bytes(f"{directory}/b.json", damaged)
        journal = Journal(directory)
        assert ["a" in journal, "c" in journal] == [True, False] and vehicles(journal, ["a", "c"]) == ["a", "c"]
        assert vehicles(journal, ["b"]) == ([] if journal.damaged else ["b"])
    files.write_bytes(f"{directory}/c.json", b'{"key": "c"')
    assert Journal(directory).damaged == 2
    journal.add("b", result("b"))
    assert vehicles(Journal(directory), ["a", "b", "c"]) == ["a", "b"]


def test_a_result_that_does_not_fit_leaves_the_earlier_ones(tmp_path):
    """The limit of the file's size cuts the file as a full disk does."""
    resource = pytest.importorskip("resource")
    journal = Journal(f"{tmp_path}/journal")
    journal.add("a", result())
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (10, limits[1]))
    try:
        with pytest.raises(InputError, match="cannot be written: File too large"):
            journal.add("b", result())
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert "b" not in journal and [path.name for path in (tmp_path / "journal").iterdir()] == ["a.json"]
    journal.add("c", result())
    assert vehicles(Journal(f"{tmp_path}/journal"), ["a", "b", "c"]) == ["v", "v"]
