"""A fleet whose logs and results are in S3 gives the same results as a fleet in files."""

from pathlib import Path

import pyarrow.parquet as parquet
import pytest
from kickstand_fleet import files, run
from kickstand_fleet.manifest import read_manifest
from kickstand_fleet.period import failed
from kickstand_fleet.run import run_fleet
from kickstand_fleet.tables import TABLES
from kickstand_tools.common.errors import InputError

WANTED = (0, 4)  # indices of two vehicles: a car, and a bus with a log that is not text
TABLE_FILES = [f"{name}.parquet" for name in TABLES]


@pytest.fixture
def s3(alone, monkeypatch):
    """Return a file system on a simulated S3 with a bucket `fleet`."""
    moto = pytest.importorskip("moto.server")
    s3fs = pytest.importorskip("s3fs")
    server = moto.ThreadedMotoServer(port=0, verbose=False)
    server.start()
    host, port = server.get_host_and_port()
    for name, value in {
        "AWS_ENDPOINT_URL": f"http://{host}:{port}",
        "AWS_ACCESS_KEY_ID": "test",
        "AWS_SECRET_ACCESS_KEY": "test",
        "AWS_DEFAULT_REGION": "us-east-1",
    }.items():
        monkeypatch.setenv(name, value)
    s3fs.S3FileSystem.clear_instance_cache()
    system = s3fs.S3FileSystem()
    system.mkdir("fleet")
    yield system
    system.rm("fleet", recursive=True)
    server.stop()


def table(content, base):
    """Return the rows of a table, with paths relative to the logs."""
    rows = parquet.read_table(content).to_pylist()
    return [
        {name: value.replace(f"{base}/", "") if isinstance(value, str) else value for name, value in row.items()}
        for row in rows
    ]


def test_logs_and_results_in_s3_give_the_same_as_files(s3, fleet, tmp_path):
    periods = [read_manifest(str(fleet.manifest))[k] for k in WANTED]
    for path in (Path(path) for period in periods for path in period.paths):
        s3.put_file(str(path), f"fleet/drives/{path.name}")
    lines = [f"{one.vehicle},drives/{Path(path).name},{one.kind}" for one in periods for path in one.paths]
    s3.pipe_file("fleet/MANIFEST.csv", "\n".join(["vehicle,path,kind", *lines]).encode())
    remote = read_manifest("s3://fleet/MANIFEST.csv")
    assert files.matches("s3://fleet/drives/*") == sorted(path for period in remote for path in period.paths)

    here = run_fleet(periods, tmp_path / "results", with_signals=True)
    there = run_fleet(remote, "s3://fleet/results/", with_signals=True)
    assert (there.vehicles, there.new, there.seen.statuses) == (here.vehicles, here.new, here.seen.statuses)
    for name in TABLE_FILES:
        rows = table(s3.open(f"fleet/results/{name}"), "s3://fleet")
        assert rows == table(tmp_path / "results" / name, str(fleet.directory)), name
        assert rows or name == "moved.parquet"
    rows = parquet.read_table(tmp_path / "results" / "alignments.parquet").to_pylist()
    for name in ["index.html", *(row["plot"] for row in rows)]:
        drawn = s3.cat_file(f"fleet/results/{name}").decode().replace("s3://fleet", str(fleet.directory))
        assert drawn == (tmp_path / "results" / name).read_text(), name
    signals = {path.removeprefix("fleet/results/") for path in s3.glob("fleet/results/signals/**/*.parquet")}
    written = {str(path.relative_to(tmp_path / "results")) for path in tmp_path.glob("results/signals/**/*.parquet")}
    # The last part of a name is a hash of the log's path.
    assert {path.rpartition("-")[0] for path in signals} == {path.rpartition("-")[0] for path in written} != set()
    assert len(signals) == len(written)

    assert run_fleet(remote, "s3://fleet/results", with_signals=True).new == 0
    s3.pipe_file("fleet/drives/" + Path(periods[0].paths[0]).name, b"t_s,ax_g\n")
    again = run_fleet(remote, "s3://fleet/results", with_signals=True)
    assert (again.new, again.seen.errors) == (1, here.seen.errors + 1)


def test_stopped_run_into_s3_is_resumed(s3, monkeypatch):
    periods = [run.Period(f"v{k}", "", "car", ("none.csv",)) for k in range(5)]

    def stopped(_, items, *__):
        yield 0, None, "crashed", "its worker died"
        yield 1, failed(items[1][0], "unreadable", "no file"), "", ""
        raise KeyboardInterrupt

    with monkeypatch.context() as patched, pytest.raises(KeyboardInterrupt):
        patched.setattr(run, "run_tasks", stopped)
        run_fleet(periods, "s3://fleet/results")
    rows = parquet.read_table(s3.open("fleet/results/alignments.parquet"))
    assert rows["reason"].to_pylist() == ["crashed", "unreadable"]
    whole = run_fleet(periods, "s3://fleet/results")
    assert (whole.new, whole.seen.reasons[("error", "unreadable")]) == (4, 5)


def test_store_that_refuses_is_reported_in_one_line(s3):
    with pytest.raises(InputError, match=r"^s3://nobody/results/.* cannot be written: [^\n]+$"):
        run_fleet([run.Period("v", "", "car", ("none.csv",))], "s3://nobody/results")
    with pytest.raises(InputError, match=r"^s3://nobody/MANIFEST.csv"):
        read_manifest("s3://nobody/MANIFEST.csv")
