"""A run resumes from its finished results, writes them while it continues, and loses none if it ends early."""

import errno
import os
from pathlib import Path

import pytest
from kickstand_fleet.manifest import Period
from kickstand_fleet.run import run_fleet
from kickstand_fleet.tables import TABLES, schema
from kickstand_tools.common.messages import InputError
from support import command

CRASHED = ("crashed", "its worker died")
FULL = OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
OUT = "failing:///out"


def absent(count):
    """Return periods whose logs do not exist."""
    return [Period(f"v{k}", "", "car", (f"none{k}.csv",)) for k in range(count)]


def table(directory, name="alignments"):
    from pyarrow import parquet

    return parquet.read_table(Path(directory) / f"{name}.parquet").to_pylist()


def test_the_tables_have_all_results_with_types_and_units(periods, results, workers, tmp_path):
    from pyarrow import parquet

    workers.outcomes = results
    counts = []
    outcome = run_fleet(periods, tmp_path, progress=lambda *done: counts.append(done))
    assert (outcome.vehicles, outcome.new, outcome.damaged) == (9, 9, 0) and counts == [(k, 9) for k in range(10)]
    for name in TABLES:
        columns = parquet.read_schema(tmp_path / f"{name}.parquet")
        assert columns.names == list(TABLES[name])
        for column, defined in zip(columns, schema(name), strict=True):
            assert column.type == defined.type or str(column.type).startswith("list<")
            assert column.metadata[b"unit"] == defined.metadata[b"unit"]
    rows = table(tmp_path)
    assert [row["vehicle"] for row in rows] == [period.vehicle for period in periods]
    for row, period in zip(rows, periods):
        assert row == results[period.vehicle].alignment | {"plot": row["plot"]}
        assert bool(row["plot"]) == bool(results[period.vehicle].picture)
        assert not row["plot"] or (tmp_path / row["plot"]).read_text().startswith("<svg")
    assert len({row["plot"] for row in rows if row["plot"]}) >= 5
    for name in ("moved", "brake_tests", "errors"):
        assert table(tmp_path, name) == [row for period in periods for row in getattr(results[period.vehicle], name)]
    assert run_fleet(periods, tmp_path).new == 0 and table(tmp_path) == rows


def test_only_changed_vehicles_are_computed_again(workers, tmp_path):
    log = tmp_path / "a.csv"
    log.write_text("1")
    usual = Period("v", "m", "car", (str(log),))
    assert run_fleet([usual], tmp_path / "out").new == 1 and run_fleet([usual], tmp_path / "out").new == 0
    for changed in (
        Period("w", "m", "car", usual.paths),
        Period("v", "n", "car", usual.paths),
        Period("v", "m", "motorcycle", usual.paths),
        Period("v", "m", "car", (*usual.paths, "none.csv")),
    ):
        assert run_fleet([usual, changed], tmp_path / "out").new == 1
    assert run_fleet([usual], tmp_path / "out", with_signals=True).new == 1
    log.write_text("12")
    assert run_fleet([usual], tmp_path / "out").new == 1


def test_a_crashed_vehicle_is_retried_and_a_bad_log_is_not(workers, tmp_path):
    workers.outcomes = {"v1": CRASHED}
    first = run_fleet(absent(3), tmp_path)
    assert first.seen.reasons == {("error", "crashed"): 1, ("error", "unreadable"): 2}
    assert table(tmp_path)[1]["message"] == "its worker died"
    assert run_fleet(absent(3), tmp_path).new == 1


@pytest.mark.parametrize("error", [KeyboardInterrupt(), InputError("the cluster was lost")])
def test_a_run_that_ends_early_keeps_its_results(workers, tmp_path, error):
    workers.outcomes = {"v3": error}
    with pytest.raises(type(error)):
        run_fleet(absent(5), tmp_path)
    assert [row["vehicle"] for row in table(tmp_path)] == ["v0", "v1", "v2"]
    assert "3 of 5 mounted sensors so far" in (tmp_path / "index.html").read_text()
    workers.outcomes = {}
    assert run_fleet(absent(5), tmp_path).new == 2


@pytest.mark.parametrize("size", [300, 1500, 5000, 9000, 15_000])
def test_a_disk_of_any_size_loses_no_finished_row(periods, results, workers, tmp_path, size):
    """The size of each file is limited, so that the journal, a picture, a table or the page does not fit."""
    resource = pytest.importorskip("resource")
    workers.outcomes = results
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, limits[1]))
    try:
        with pytest.raises(InputError, match=r"^[^\n]*File too large[^\n]*$"):
            run_fleet(periods[:4], tmp_path)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    names = {period.vehicle for period in periods[:4]}
    finished = len(names) - run_fleet(periods[:4], tmp_path).new
    assert finished >= (size > 9000) and {row["vehicle"] for row in table(tmp_path)} == names
    assert all((tmp_path / row["plot"]).is_file() for row in table(tmp_path))
    assert not list(tmp_path.rglob(".*")) and run_fleet(periods[:4], tmp_path).damaged == 0


@pytest.mark.parametrize("refused", ["plots", "signals"])
def test_a_full_store_keeps_the_row_and_ends_the_run(periods, workers, results, store, refused):
    """The next run writes the missing file."""
    if refused == "plots":
        workers.outcomes = results
    store.fail(refused, FULL)
    signals = refused == "signals"
    words = "No space left on device; finished work is kept: run the same" if signals else "No space left on device"
    with pytest.raises(InputError, match=words):
        run_fleet(periods[:1], OUT, with_signals=signals)
    store.fail()
    second = run_fleet(periods[:1], OUT, with_signals=signals)
    assert (second.new, second.seen.errors, second.seen.statuses["aligned"]) == (1, 0, 1)
    assert run_fleet(periods[:1], OUT, with_signals=signals).new == 0


def test_the_command_says_what_it_found(periods, results, workers, fleet, tmp_path):
    workers.outcomes = results | {periods[1].vehicle: CRASHED}
    first = command.works("fleet", fleet.manifest, "--out", tmp_path, "--workers", 3)
    lines = first.out.splitlines()
    assert lines[:2] == ["mounted sensors: 9", "aligned: 3, refused: 5, errors: 1"]
    assert lines[2] == "      2  refused: mount-moved" and "      1  error: crashed" in lines[3:6]
    (tests,) = [line for line in lines if line.startswith("mounts that seem to have moved: 2; brake tests: ")]
    assert tests.endswith("; rows of errors: 4")
    assert f"error: {periods[1].vehicle}: its worker died" in lines
    tables = "alignments.parquet, moved.parquet, brake_tests.parquet, errors.parquet"
    assert lines[-2:] == ["more errors are in errors.parquet", f"written: {tmp_path}/index.html, {tables}"]
    entry = next(path for path in (tmp_path / "journal").iterdir() if b'"again": false' in path.read_bytes())
    entry.write_bytes(entry.read_bytes().replace(b"alignment", b"alinement", 1))
    second_run = command.works("fleet", fleet.manifest, "--out", tmp_path)
    assert "mounted sensors: 9, 7 of them finished earlier\n" in second_run.out
    assert "1 earlier results were damaged and are recomputed\n" in second_run.err
