"""Tests with Dask's workers. A task that fails does not affect other tasks, and a stopped run is resumed."""

import os
import signal
import subprocess
import sys
import threading
import time
from collections import Counter
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pyarrow.parquet as parquet
import pytest
from fleet_tasks import task
from kickstand_fleet import run
from kickstand_fleet.cluster import CRASHED, TIMED_OUT, Cluster
from kickstand_fleet.journal import Journal
from kickstand_fleet.manifest import Period, read_manifest
from kickstand_fleet.period import failed
from kickstand_fleet.run import run_fleet
from kickstand_fleet.tables import TABLES, schema
from kickstand_tools.common.errors import InputError


@pytest.fixture(scope="module")
def cluster():
    """Return a cluster with a long time limit, so that no task is ended because the machine is busy."""
    with Cluster(None, 2, timeout_s=600.0) as running:
        yield running


class Overdue(dict):
    """Start times of tasks. Task 5 seems to have begun long ago, so it is ended at once. No other task is ended, even
    on a busy machine."""

    def __setitem__(self, key, began):
        super().__setitem__(key, (began[0] - 1000.0 * key.startswith("fleet-5-"), began[1]))


def test_bad_task_costs_no_other_task(cluster, tmp_path, monkeypatch):
    monkeypatch.setattr(cluster, "_started", Overdue())
    note = tmp_path / "began"
    behaviours = {2: "die", 4: "raise", 5: "hang"}
    items = [(k, behaviours.get(k, ""), str(note)) for k in range(14)]
    found = {index: (result, reason) for index, result, reason, _ in cluster.run(task, items)}
    assert found == {k: (None if k in behaviours else k, "") for k in range(14)} | {
        2: (None, CRASHED),
        4: (None, CRASHED),
        5: (None, TIMED_OUT),
    }
    began = Counter(int(line.split()[0]) for line in note.read_text().splitlines())
    assert began[2] == 2 and sum(began.values()) <= 14 + 6  # finished tasks are not computed again


def test_killed_worker_costs_no_result(cluster, tmp_path):
    note = tmp_path / "began"
    items = [(k, "slow", str(note)) for k in range(8)]

    def kill():
        while not note.exists() or len(note.read_text().splitlines()) < 3:
            time.sleep(0.05)
        # The process is a worker of this test's cluster
        os.kill(int(note.read_text().splitlines()[-1].split()[1]), signal.SIGKILL)

    killer = threading.Thread(target=kill, daemon=True)
    killer.start()
    found = sorted((index, result) for index, result, _, _ in cluster.run(task, items))
    killer.join()
    assert found == [(k, k) for k in range(8)]


def test_run_without_workers_ends(tmp_path, monkeypatch):
    monkeypatch.setattr("kickstand_fleet.cluster._LOST_S", 1.0)
    note = tmp_path / "began"
    with Cluster(None, 1, timeout_s=600.0) as running:
        outcomes = running.run(task, [(0, "", str(note)), (1, "hang", str(note)), (2, "", str(note))])
        assert next(outcomes) == (0, 0, "", "")
        workers = running._client.cluster
        assert workers is not None
        workers.scale(0)
        with pytest.raises(InputError, match="all workers have ended; finished work is kept"):
            list(outcomes)


def test_fleet_on_a_cluster_is_resumed(cluster, fleet, tmp_path, monkeypatch):
    periods = read_manifest(str(fleet.manifest))
    worked = []

    def only(function, items, *_):
        worked.append(len(items))
        yield from cluster.run(function, items)

    monkeypatch.setattr(run, "run_tasks", only)
    first = run_fleet(periods[:4], tmp_path)
    assert (first.vehicles, first.new) == (4, 4)
    seen = []
    whole = run_fleet(periods, tmp_path, with_signals=False, progress=lambda done, total: seen.append((done, total)))
    assert (whole.new, worked) == (len(periods) - 4, [4, len(periods) - 4])
    assert seen[0] == (4, len(periods)) and seen[-1] == (len(periods), len(periods))
    tables = {name: parquet.read_table(tmp_path / f"{name}.parquet") for name in TABLES}
    for name, table in tables.items():
        assert table.schema.names == list(TABLES[name])
        for found, written in zip(table.schema, schema(name), strict=True):
            assert found.type == written.type or str(found.type).startswith("list<")
            assert found.metadata[b"unit"] == written.metadata[b"unit"]
    rows = tables["alignments"].to_pylist()
    assert [row["vehicle"] for row in rows] == [period.vehicle for period in periods]
    assert {row["status"] for row in rows} == {"aligned", "refused"}
    assert all(len(row["vehicle_from_sensor"]) == 9 for row in rows if row["status"] == "aligned")
    assert all((tmp_path / row["plot"]).is_file() for row in rows if row["plot"])
    assert tables["moved"].num_rows == 2 and tables["brake_tests"].num_rows > 10 and tables["errors"].num_rows >= 1
    page = (tmp_path / "index.html").read_text()
    assert "://" not in page.replace("http://www.w3.org/2000/svg", "")
    assert all(row["vehicle"] in page for row in rows)

    # Only a changed log is processed again.
    path = Path(periods[0].paths[0])
    stat = path.stat()
    os.utime(path, ns=(stat.st_atime_ns, stat.st_mtime_ns + 1_000_000))
    assert run_fleet(periods, tmp_path).new == 1
    assert run_fleet(periods, tmp_path).new == 0
    # a changed option also causes a new computation
    assert run_fleet(periods[:1], tmp_path, with_signals=True).new == 1
    written = sorted((tmp_path / "signals").rglob("*.parquet"))
    assert len(written) >= len(periods[0].paths)
    values = parquet.ParquetFile(written[0]).read()
    assert abs(values["up_g"].to_numpy().mean() - 1.0) < 0.05
    parts = written[0].relative_to(tmp_path / "signals").parts
    assert [part.split("=")[0] for part in parts[:-1]] == ["vehicle", "day"]


def test_stopped_run_keeps_its_results(tmp_path, monkeypatch):
    periods = [Period(f"v{k}", "", "car", ("none.csv",)) for k in range(5)]

    def stopped(_, items, *__):
        for index in range(3):
            yield index, failed(items[index][0], "unreadable", "no file"), "", ""
        raise KeyboardInterrupt

    monkeypatch.setattr(run, "run_tasks", stopped)
    with pytest.raises(KeyboardInterrupt):
        run_fleet(periods, tmp_path)
    assert parquet.read_table(tmp_path / "alignments.parquet")["vehicle"].to_pylist() == ["v0", "v1", "v2"]
    assert "3 of 5 mounted sensors so far" in (tmp_path / "index.html").read_text()
    with Journal(tmp_path / "journal.jsonl") as journal:
        keys = run._keys(periods, run._marks(periods), False)
        assert [key in journal for key in keys] == [True, True, True, False, False]


PROGRAM = """
import signal, time
from kickstand_fleet.cluster import Cluster
if __name__ == "__main__":
    signal.signal(signal.SIGINT, signal.default_int_handler)  # programs in the background of a shell ignore Ctrl-C
    print("starting", flush=True)
    with Cluster(None, 2, 60.0):
        time.sleep(60.0)
"""


@pytest.mark.nightly  # the next test is similar, but does not depend on how busy the machine is
@pytest.mark.skipif(not hasattr(signal, "pthread_sigmask"), reason="Ctrl-C comes at once on this system")
@pytest.mark.parametrize("after_s", [0.6, 1.6])
def test_ctrl_c_while_workers_start_is_deferred(tmp_path, after_s):
    """Ctrl-C takes effect only after the workers have started, because starting workers would print pages of errors."""
    program = tmp_path / "program.py"
    program.write_text(PROGRAM)
    command, pipe = [sys.executable, str(program)], subprocess.PIPE
    with subprocess.Popen(command, stdout=pipe, stderr=pipe, text=True, start_new_session=True) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "starting\n"
        time.sleep(after_s)
        os.killpg(process.pid, signal.SIGINT)  # a terminal also sends Ctrl-C to the workers
        _, trouble = process.communicate(timeout=120)
    assert trouble.count("Traceback") == 1
    assert trouble.endswith("KeyboardInterrupt\n")


CONNECTING = """
import os, signal, threading
from distributed import Client
register = Client.register_plugin
def interrupted(client, plugin):
    threading.Timer(0.02, os.kill, (os.getpid(), signal.SIGINT)).start()
    return register(client, plugin)
Client.register_plugin = interrupted
"""


@pytest.mark.skipif(not hasattr(signal, "pthread_sigmask"), reason="Ctrl-C comes at once on this system")
def test_ctrl_c_while_connecting_is_deferred(tmp_path):
    program = tmp_path / "program.py"
    program.write_text(CONNECTING + PROGRAM)
    trouble = subprocess.run([sys.executable, str(program)], capture_output=True, text=True, timeout=120).stderr
    assert trouble.count("Traceback") == 1
    assert trouble.endswith("KeyboardInterrupt\n")


def test_next_run_retries_a_crashed_vehicle(tmp_path, monkeypatch):
    periods = [Period("v", "", "car", ("none.csv",))]
    monkeypatch.setattr(run, "run_tasks", lambda *_: iter([(0, None, CRASHED, "its worker died")]))
    first = run_fleet(periods, tmp_path)
    assert first.seen.reasons[("error", CRASHED)] == 1
    assert run_fleet(periods, tmp_path).new == 1


def test_a_result_that_is_lost_with_its_worker_is_computed_again():
    """The first worker ends the task, but dies before its result is fetched. The cluster has no real workers."""
    submitted = []

    class Ended:
        status = "finished"

        def __init__(self, key):
            self.key = key
            submitted.append(key)

        def add_done_callback(self, callback):
            callback(self)

        def result(self):
            if len(submitted) == 1:
                raise OSError("the worker is gone")
            return "found"

        def release(self):
            pass

    alone: Any = Cluster(None, 1, timeout_s=600.0)
    alone._client, alone._started = SimpleNamespace(submit=lambda *_, key, pure: Ended(key)), {}
    assert list(alone.run(task, [(0,)])) == [(0, "found", "", "")]
    assert len(submitted) == 2
