"""A run with its tasks, its clock and its writer replaced: when the tables are written, and which results are kept."""

from types import SimpleNamespace

import pytest
from kickstand_fleet import files, run
from kickstand_fleet.journal import Journal
from kickstand_fleet.manifest import Period
from kickstand_fleet.period import PeriodResult, failed
from kickstand_tools.common.errors import InputError


class Clock:
    def __init__(self):
        self.now_s = 1000.0

    def monotonic(self):
        return self.now_s


@pytest.fixture
def clock(monkeypatch):
    monkeypatch.setattr(run, "time", made := Clock())
    return made


def periods(count):
    return [Period(f"v{k}", "", "car", (f"none{k}.csv",)) for k in range(count)]


def tasks(monkeypatch, results, before=lambda: None):
    """Replace the workers. results: the outcome of each task after its index. before: called before each outcome."""

    def run_tasks(_function, items, *_):
        for index, outcome in zip(range(len(items)), results):
            before()
            if isinstance(outcome, Exception):
                raise outcome
            yield index, *outcome

    monkeypatch.setattr(run, "run_tasks", run_tasks)


def writes(monkeypatch, clock=None, takes_s=0.0):
    """Replace the writer of tables. Return the number of results at each time of writing."""
    counts = []

    def write_results(_directory, results, expected):
        counts.append((len(list(results)), expected))
        if clock:
            clock.now_s += takes_s

    monkeypatch.setattr(run, "write_results", write_results)
    return counts


CRASHED = (None, "crashed", "its worker died")


@pytest.mark.parametrize(
    ("takes_s", "counts"),
    [
        (0.5, [2, 4, 6, 8, 10, 12, 12]),  # each task takes 10 s, and tables are written at most every 15 s
        (2.0, [2, 7, 12, 12]),  # writing takes a twentieth of the time: after 2 s there is a pause of 40 s
    ],
)
def test_tables_are_written_seldom(monkeypatch, tmp_path, clock, takes_s, counts):
    def later():
        clock.now_s += 10.0

    tasks(monkeypatch, [CRASHED] * 12, later)
    written = writes(monkeypatch, clock, takes_s)
    synced = []
    monkeypatch.setattr(Journal, "sync", lambda journal: synced.append(journal))
    run.run_fleet(periods(12), tmp_path)
    assert written == [(count, 12) for count in counts] and len(synced) == len(counts) - 1


def test_a_second_run_computes_only_what_is_not_final(monkeypatch, tmp_path):
    final = failed(periods(3)[0], "unreadable", "x")
    tasks(monkeypatch, [(final, "", ""), CRASHED, (final, "", "")])
    writes(monkeypatch)
    seen = []
    first = run.run_fleet(periods(3), tmp_path, progress=lambda *counts: seen.append(counts))
    assert (first.vehicles, first.new, first.damaged) == (3, 3, 0) and seen == [(0, 3), (1, 3), (2, 3), (3, 3)]
    seen.clear()
    second = run.run_fleet(periods(3), tmp_path, progress=lambda *counts: seen.append(counts))
    assert (second.vehicles, second.new) == (3, 1) and seen == [(2, 3), (3, 3)]


@pytest.mark.parametrize(("before", "counts"), [([], []), ([CRASHED], [(1, 3)])])
def test_a_run_that_ends_early_writes_what_there_is(monkeypatch, tmp_path, before, counts):
    tasks(monkeypatch, [*before, InputError("lost")])
    written = writes(monkeypatch)
    with pytest.raises(InputError, match="lost"):
        run.run_fleet(periods(3), tmp_path)
    assert written == counts


def test_a_result_is_computed_again_if_anything_has_changed(monkeypatch):
    """A key identifies the logs, the options and the version."""
    (plain,) = run._keys([Period("v", "m", "car", ("a",))], {"a": "1"}, False)
    assert len(plain) == 32
    changed = [
        run._keys([period], marks, with_signals)[0]
        for period, marks, with_signals in (
            (Period("w", "m", "car", ("a",)), {"a": "1"}, False),
            (Period("v", "n", "car", ("a",)), {"a": "1"}, False),
            (Period("v", "m", "motorcycle", ("a",)), {"a": "1"}, False),
            (Period("v", "m", "car", ("b",)), {"b": "1"}, False),
            (Period("v", "m", "car", ("a",)), {"a": "2"}, False),
            (Period("v", "m", "car", ("a",)), {"a": "1"}, True),
        )
    ]
    monkeypatch.setattr(run, "RESULTS_VERSION", 99)
    changed += run._keys([Period("v", "m", "car", ("a",))], {"a": "1"}, False)
    assert len({plain, *changed}) == 8


def test_a_log_that_changes_during_the_run_is_reported(tmp_path):
    (tmp_path / "a").write_text("1")
    (tmp_path / "b").write_text("1")
    period = Period("v", "m", "car", (str(tmp_path / "a"), str(tmp_path / "b"), "memory://c"))
    marks = files.identities(period.paths)
    kept = PeriodResult({})
    assert not run._note_changed(period, marks, kept) and kept.errors == []
    (tmp_path / "b").write_text("12")
    assert run._note_changed(period, marks, kept)
    path = str(tmp_path / "b")
    message = f"{path} has changed during the run: run the command again"
    assert kept.errors == [{"vehicle": "v", "mount": "m", "log": path, "reason": "changed", "message": message}]


class Notes:
    """Replaces the journal."""

    def add(self, key, result, again):
        self.added = key, result, again


def keep(monkeypatch, reasons=(), picture=(), error=None, again=False):
    """Keep a result with errors of these reasons. Return True if the next run computes it again, and its picture."""
    result = PeriodResult({"vehicle": "v", "mount": "", "plot": ""})
    result.errors = [{"reason": reason, "message": "no space"} for reason in reasons]
    result.picture = list(picture)

    def write_plot(path, kept):
        assert kept is result and path.startswith("out/plots/v")
        if error:
            raise error

    monkeypatch.setattr(run, "plot", SimpleNamespace(file_name=lambda *_: "v.svg", write_plot=write_plot))
    journal = Notes()
    try:
        run._keep("out", journal, "key", result, again)  # type: ignore[arg-type]
    finally:
        assert journal.added[:2] == ("key", result)
    return journal.added[2], result.alignment["plot"]


def test_a_result_with_all_its_parts_is_final(monkeypatch):
    assert keep(monkeypatch) == (False, "") and keep(monkeypatch, again=True) == (True, "")
    assert keep(monkeypatch, picture=[[0.0]]) == (False, "plots/v.svg")
    assert keep(monkeypatch, ["unreadable"]) == (False, "")
    assert keep(monkeypatch, ["unreadable", "not-finished"]) == (True, "")


def test_a_full_disk_ends_the_run_after_the_result_is_kept(monkeypatch):
    full = InputError("x cannot be written: no space")
    with pytest.raises(InputError) as raised:
        keep(monkeypatch, picture=[[0.0]], error=full)
    assert raised.value is full
    with pytest.raises(InputError, match=r"^no space; finished work is kept"):
        keep(monkeypatch, ["not-finished", "disk-full"])
