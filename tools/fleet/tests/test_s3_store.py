"""A fleet whose logs and results are in S3 gives the same results as a fleet in files."""

from pathlib import Path

import pytest
from kickstand_fleet import files
from kickstand_fleet.manifest import read_manifest
from kickstand_fleet.run import run_fleet
from kickstand_fleet.tables import TABLES
from kickstand_tools.common.messages import InputError

pytestmark = pytest.mark.long


@pytest.fixture
def s3(workers, monkeypatch):
    """Return a file system on a simulated S3 with a bucket `fleet`."""
    moto = pytest.importorskip("moto.server")
    s3fs = pytest.importorskip("s3fs")
    server = moto.ThreadedMotoServer(port=0, verbose=False)
    server.start()
    host, port = server.get_host_and_port()
    monkeypatch.setenv("AWS_ENDPOINT_URL", f"http://{host}:{port}")
    monkeypatch.setenv("AWS_DEFAULT_REGION", "us-east-1")
    for name in ("AWS_ACCESS_KEY_ID", "AWS_SECRET_ACCESS_KEY"):
        monkeypatch.setenv(name, "test")
    s3fs.S3FileSystem.clear_instance_cache()
    system = s3fs.S3FileSystem()
    system.mkdir("fleet")
    yield system
    system.rm("fleet", recursive=True)
    server.stop()


def table(content, base):
    """Return the rows of a table, with paths relative to the logs."""
    from pyarrow import parquet

    rows = parquet.read_table(content).to_pylist()
    return [{k: v.replace(f"{base}/", "") if isinstance(v, str) else v for k, v in row.items()} for row in rows]


def test_logs_and_results_in_s3_give_the_same_as_files(s3, fleet, periods, workers, tmp_path):
    local = [periods[k] for k in (0, 4)]  # a car, and a bus with a log that is not text
    for path in (Path(path) for period in local for path in period.paths):
        s3.put_file(str(path), f"fleet/drives/{path.name}")
    lines = [f"{period.vehicle},drives/{Path(path).name},{period.kind}" for period in local for path in period.paths]
    s3.pipe_file("fleet/MANIFEST.csv", "\n".join(["vehicle,path,kind", *lines]).encode())
    remote = read_manifest("s3://fleet/MANIFEST.csv")
    assert files.matches("s3://fleet/drives/*") == sorted(path for period in remote for path in period.paths)

    usual = run_fleet(local, tmp_path / "results", with_signals=True)
    stored = run_fleet(remote, "s3://fleet/results/", with_signals=True)
    assert (stored.vehicles, stored.new, stored.seen.statuses) == (usual.vehicles, usual.new, usual.seen.statuses)
    for name in [f"{table}.parquet" for table in TABLES]:
        rows = table(s3.open(f"fleet/results/{name}"), "s3://fleet")
        assert rows == table(tmp_path / "results" / name, str(fleet.directory)), name
        assert rows or name == "moved.parquet"
    rows = table(tmp_path / "results" / "alignments.parquet", str(fleet.directory))
    for name in ["index.html", *(row["plot"] for row in rows)]:
        drawn = s3.cat_file(f"fleet/results/{name}").decode().replace("s3://fleet", str(fleet.directory))
        assert drawn == (tmp_path / "results" / name).read_text(), name
    signals = s3.glob("fleet/results/signals/**/*.parquet")
    assert len(signals) == len(list(tmp_path.glob("results/signals/**/*.parquet"))) > 2

    assert run_fleet(remote, "s3://fleet/results", with_signals=True).new == 0
    s3.pipe_file("fleet/drives/" + Path(local[0].paths[0]).name, b"t_s,ax_g\n")
    workers.outcomes[local[1].vehicle] = KeyboardInterrupt()
    second_run = run_fleet(remote, "s3://fleet/results", with_signals=True)
    assert (second_run.new, second_run.seen.errors) == (1, usual.seen.errors + 1)


def test_store_that_refuses_is_reported_in_one_line(s3, periods):
    with pytest.raises(InputError, match=r"^s3://nobody/results/.* cannot be written: [^\n]+$"):
        run_fleet(periods[4:5], "s3://nobody/results")
    with pytest.raises(InputError, match=r"^s3://nobody/MANIFEST.csv"):
        read_manifest("s3://nobody/MANIFEST.csv")
