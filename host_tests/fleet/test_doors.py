"""Bad file names, other users of the computer and files that change during a run spoil at most one row of the
results."""

import http.client
import os
import subprocess
import sys
import urllib.error
import urllib.request
from pathlib import Path

import psutil
import pyarrow.parquet as parquet
import pytest
from kickstand.errors import AlignmentError
from kickstand_fleet import files, run
from kickstand_fleet.manifest import Period, by_pattern, read_manifest
from kickstand_fleet.period import failed, work_on_period
from kickstand_fleet.run import run_fleet
from kickstand_fleet.show import plot
from kickstand_tools.calibration.drive_refusals import of_firmware
from kickstand_tools.common.errors import InputError
from kickstand_tools.common.messages import sentence
from kickstand_tools.common.output import whole_file
from support import command
from support.recordings import broken_logs


@pytest.fixture
def drive(fleet):
    """Return the log of a car that can be aligned."""
    return Path(read_manifest(str(fleet.manifest))[0].paths[0])


def copied(source, *targets):
    for target in targets:
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_bytes(source.read_bytes())
    return tuple(str(target) for target in targets)


def test_signals_of_equally_named_logs_have_separate_files(drive, tmp_path, alone):
    name = drive.name
    paths = copied(drive, tmp_path / "d1" / name, tmp_path / "d2" / name)
    periods = [Period("v", "", "car", paths), Period("v", "second", "car", paths), Period("v second", "", "car", paths)]
    whole = run_fleet(periods, tmp_path / "out", with_signals=True)
    assert (whole.seen.statuses["aligned"], whole.seen.errors) == (3, 0)
    written = sorted(path.relative_to(tmp_path) for path in (tmp_path / "out" / "signals").rglob("*.parquet"))
    assert len(written) == 6
    assert sum(parquet.ParquetFile(tmp_path / path).metadata.num_rows for path in written) == 6 * len(
        files.open_log(str(drive)).t_s
    )
    # Two files have the mount's name "second" in their names
    assert sum("second" in path.name for path in written) == 2
    run_fleet(periods[:1], tmp_path / "again", with_signals=True)
    again = {path.name for path in (tmp_path / "again" / "signals").rglob("*.parquet")}
    assert len(again) == 2 and again <= {path.name for path in written}
    pictures = [row["plot"] for row in parquet.read_table(tmp_path / "out" / "alignments.parquet").to_pylist()]
    assert len(set(pictures)) == 3


NAMES = ["x" * 256, "x" * 257, 100 * "\u4e2d", "hid", ".hid", "..", "a/b", "con", "a%2Fb", "\x00", " ", "\u202e", "HID"]


def test_file_names_are_unique_and_portable():
    for made in (
        [plot.file_name(name, "") for name in NAMES] + [plot.file_name(name, "m") for name in NAMES],
        [files.folder_value(name) for name in NAMES],
    ):
        assert len(set(made)) == len(made)
        assert all(len(name.encode()) < 150 and name.isascii() and "/" not in name for name in made)
    assert len({plot.file_name(name, "").lower() for name in NAMES}) == len(NAMES)
    assert plot.file_name(".hid", "")[0] != "."


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux has names that are no UTF-8")
def test_file_name_that_is_not_utf8_is_processed(drive, tmp_path, alone):
    copied(drive, tmp_path / "good.csv")
    with open(os.fsencode(tmp_path) + b"/bad\xff.csv", "wb") as file:
        file.write(drive.read_bytes())
    with open(os.fsencode(tmp_path) + b"/none\xfe.csv", "wb") as file:
        file.write(b"no log")
    whole = run_fleet(by_pattern(f"{tmp_path}/*.csv"), tmp_path / "out", with_signals=True)
    assert (whole.seen.statuses["aligned"], whole.seen.statuses["error"]) == (2, 1)
    errors = parquet.read_table(tmp_path / "out" / "errors.parquet").to_pylist()
    assert "none\\udcfe.csv" in errors[0]["log"]
    assert "bad\\udcff" in (tmp_path / "out" / "index.html").read_text()


def test_log_replaced_during_the_run_is_processed_again(drive, tmp_path, alone, monkeypatch):
    (log,) = copied(drive, tmp_path / "drive.csv")

    def replaced(period, signals_to):
        result = work_on_period(period, signals_to)
        os.utime(log, ns=(1, 1))
        return result

    with monkeypatch.context() as patched:
        patched.setattr(run, "work_on_period", replaced)
        first = run_fleet([Period("v", "", "car", (log,))], tmp_path / "out")
    assert first.seen.errors == 1
    row = parquet.read_table(tmp_path / "out" / "errors.parquet").to_pylist()[0]
    assert row["reason"] == "changed" and "has changed during the run" in row["message"]
    second = run_fleet([Period("v", "", "car", (log,))], tmp_path / "out")
    assert (second.new, second.seen.errors) == (1, 0)


def test_full_memory_or_disk_is_not_reported_as_a_bug(monkeypatch):
    for error, reason in ((MemoryError(), "no-memory"), (OSError(5, "Input/output error"), "unreadable")):

        def broken(path, error=error):
            raise error

        monkeypatch.setattr(files, "open_log", broken)
        found = work_on_period(Period("v", "", "car", ("x.csv",)))
        assert found.errors[0]["reason"] == reason
        assert "Error" not in found.errors[0]["message"]


PROGRAM = """
import sys
from kickstand_fleet.cluster import Cluster
if __name__ == "__main__":
    with Cluster(None, 2, 60.0) as cluster:
        print(cluster._client.scheduler.address, flush=True)
        sys.stdin.read()
"""


def test_only_the_run_itself_can_run_code_on_its_workers(tmp_path):
    from distributed import Client
    from distributed.security import Security

    program = tmp_path / "program.py"
    program.write_text(PROGRAM)
    piped = dict.fromkeys(("stdin", "stdout", "stderr"), subprocess.PIPE)
    with subprocess.Popen([sys.executable, str(program)], **piped) as process:
        assert process.stdout is not None and process.stdin is not None and process.stderr is not None
        address = process.stdout.readline().decode().strip()
        assert address.startswith("tls://127.0.0.1:")
        family = [psutil.Process(process.pid), *psutil.Process(process.pid).children(recursive=True)]
        sockets = [one for member in family for one in member.net_connections("inet") if one.status == "LISTEN"]
        assert len(sockets) >= 3
        assert {one.laddr.ip for one in sockets} == {"127.0.0.1"}
        for url, keys in ((address.replace("tls", "tcp"), None), (address, Security.temporary())):
            with pytest.raises(OSError):
                Client(url, security=keys, timeout=5)
        for one in sockets:
            try:
                with urllib.request.urlopen(f"http://127.0.0.1:{one.laddr.port}/json/identity.json", timeout=5):
                    pytest.fail("somebody else may look at the scheduler")
            except OSError as refused:
                assert "404" in str(refused) or not isinstance(refused, urllib.error.HTTPError)
            except http.client.HTTPException:
                pass  # the cluster has no web server
        process.stdin.close()
        assert process.stderr.read() == b""  # Dask would print each connection that it refuses


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"vehicle,path,kind\n" + b"x" * 200_000 + b",a,car\n", "is no table"),
        (b"vehicle,path,kind\nv,a\x00b.csv,car\n", ""),
        (b"\xff\xfe", "is no table"),
    ],
)
def test_hostile_manifest_gives_one_line_or_a_row(tmp_path, alone, content, words):
    path = tmp_path / "MANIFEST.csv"
    path.write_bytes(content)
    if words:
        command.refused(tmp_path, "fleet", path, "--out", tmp_path / "out", words=words)
    else:
        assert run_fleet(read_manifest(str(path)), tmp_path / "out").seen.statuses["error"] == 1


def test_move_at_an_unknown_time_is_counted(tmp_path, monkeypatch):
    """A move of the mount is counted even if its time is unknown. An example is a motorcycle that is treated as a car,
    because it leans on its stand."""

    def moved(_, items, *__):
        for index, (period, _) in enumerate(items):
            found = failed(
                period, "mount-moved", sentence(of_firmware(AlignmentError("mount-moved", "between-stops", 8.0)))
            )
            found.alignment["status"] = "refused"
            yield index, found, "", ""

    monkeypatch.setattr(run, "run_tasks", moved)
    for name in "a.csv", "b.csv":
        (tmp_path / name).touch()
    result = command.works("fleet", tmp_path / "*.csv", "--vehicle", "motorcycle", "--out", tmp_path / "out")
    assert "mounted sensors: 2\n" in result.out and "mounts that seem to have moved: 2;" in result.out
    assert "of a motorcycle on its kickstand do: is it one?" in result.out
    page = (tmp_path / "out" / "index.html").read_text()
    assert "No mount is known to have moved" not in page and "<b>2</b><span>whose mount seems to have moved" in page
    assert "<td>a.csv</td><td>motorcycle</td>" in page and f"Names are those below {tmp_path}/" in page


def test_log_with_parts_left_out_is_reported_and_counts(fleet, tmp_path):
    paths = list(read_manifest(str(fleet.manifest))[0].paths)
    cut = tmp_path / "cut.csv"
    cut.write_bytes(Path(paths[0]).read_bytes()[:-9] + bytes(50))
    found = work_on_period(Period("v", "", "car", (str(cut), *paths[1:])))
    assert (found.alignment["status"], found.alignment["logs_left_out"]) == ("aligned", 0)
    assert {row["reason"] for row in found.errors} == {"nul-end", "cut-line"}
    assert all(row["log"] == str(cut) for row in found.errors)


def test_mutated_manifest_is_read_or_refused_in_one_line(tmp_path):
    path = tmp_path / "MANIFEST.csv"
    content = b"vehicle,path,kind,mount\n" + b"".join(b"v%d,logs/%d.csv,car,m\n" % (k, k) for k in range(20))
    seen = set()
    for number in range(100):
        path.write_bytes(broken_logs.broken([content], number)[1])
        try:
            seen.add(bool(read_manifest(str(path))))
        except InputError as error:
            assert "\n" not in str(error)
            seen.add(False)
    assert seen == {True, False}


def test_pipe_is_refused_as_manifest_and_log(tmp_path, alone):
    os.mkfifo(tmp_path / "pipe.csv")
    command.refused(tmp_path, "fleet", tmp_path / "pipe.csv", "--out", tmp_path / "out", words="not an ordinary file")
    found = work_on_period(Period("v", "", "car", (str(tmp_path / "pipe.csv"),)))
    assert "not an ordinary file" in found.errors[0]["message"]


def test_unwritable_file_is_reported_with_its_reason(tmp_path, monkeypatch):
    """The file system is read-only. The temporary file cannot be removed either."""

    def read_only(*_, **__):
        raise OSError(30, "Read-only file system")

    monkeypatch.setattr(Path, "unlink", read_only)
    with pytest.raises(InputError, match="Read-only file system"), whole_file(tmp_path / "x"):
        read_only()
