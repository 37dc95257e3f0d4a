"""Input that is too large, endless or has invalid times is refused in one line. Rows that are left out are counted."""

import gzip
import os
import random
import resource
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest
from kickstand_tools.common.errors import InputError
from kickstand_tools.imports import files
from kickstand_tools.joining.track_files import read_track
from kickstand_tools.logs import csv_reader, reader
from support import command

NAMES = "t=t,ax=ax,ay=ay,az=az,gx=gx,gy=gy,gz=gz"
UNITS = "t=ms,a=m/s2,g=rad/s"
MB = 1_000_000


def table(times):
    chance = random.Random(1)
    rows = [f"{t},0.1,9.8,{chance.gauss(0, 0.02):.4f},0.01,{chance.gauss(0, 0.02):.4f},0.02" for t in times]
    return "t,ax,ay,az,gx,gy,gz\n" + "\n".join(rows) + "\n"


def imported(directory, content, *more, columns=NAMES, units=UNITS):
    (directory / "log.csv").write_text(content)
    arguments = ("import", directory / "log.csv", "--columns", columns, "--units", units, *more)
    return (*arguments, "--out", directory / "RIDE.csv")


def bomb(path: Path, kind: str) -> None:
    """Write a small compressed file whose content exceeds the limit. kind: its format."""
    part, parts = b"1,2,3\n" * 1_000_000, 48
    if kind == "gz":
        packed = gzip.compress(part, 9)
        path.write_bytes(packed * parts)
        return
    method, parts = (zipfile.ZIP_DEFLATED, parts) if kind == "deflate" else (zipfile.ZIP_BZIP2, 1)
    with zipfile.ZipFile(path, "w", method) as archive, archive.open("a.csv", "w") as file:
        for _ in range(parts):
            file.write(part)


@pytest.mark.skipif(sys.platform != "linux", reason="memory is limited as on Linux")
@pytest.mark.parametrize("kind", ["gz", "deflate", "bz2"])
def test_zip_bomb_is_refused_within_1_gb_of_memory(tmp_path, kind):
    path = tmp_path / ("b.csv.gz" if kind == "gz" else "b.zip")
    bomb(path, kind)
    code = "from kickstand_tools.cli.main import main; main()"
    found = subprocess.run(
        [sys.executable, "-c", code, "import", str(path), "--out", str(tmp_path / "x.csv")],
        capture_output=True,
        text=True,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_DATA, (1000 * MB, 1000 * MB)),
        check=False,
    )
    assert found.returncode == 2
    assert "too large: over 250 MB" in found.stderr or "packed with a password, or in another way" in found.stderr


def test_zip_with_a_false_size_or_many_files_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(files, "MOST_FILES", 20)
    with zipfile.ZipFile(tmp_path / "many.zip", "w") as archive:
        for k in range(400):
            archive.writestr(f"{k}.csv", "a")
    command.refused(tmp_path, "import", tmp_path / "many.zip", "--out", tmp_path / "x.csv", words="over 20 files")
    for k in range(21):
        (tmp_path / f"{k}.csv").touch()
    command.refused(tmp_path, "import", tmp_path, "--out", tmp_path / "x.csv", words="over 20 files")


def test_endless_line_and_huge_table_are_refused(tmp_path, monkeypatch):
    names = ",".join(f"c{k}" for k in range(300_000))
    (tmp_path / "wide.csv").write_text(f"{names}\n{names}\n")
    out = ("--out", tmp_path / "x.csv")
    command.refused(tmp_path, "import", tmp_path / "wide.csv", *out, words="a line of over 1,000,000 characters")
    monkeypatch.setattr(csv_reader, "MOST_CELLS", 5_000)
    command.refused(tmp_path, *imported(tmp_path, table(range(0, 90_000, 10))), words="the table is too large")


def test_log_without_line_ends_or_too_long_is_refused(tmp_path, monkeypatch):
    log = tmp_path / "log.csv"
    log.write_bytes(command.HEADER.encode() + b"\n" + b"1," * 9 * MB)
    with pytest.raises(InputError, match="16 MB without the end of a line"):
        reader.read_log(log)
    monkeypatch.setattr(reader, "MOST_SAMPLES", 100)
    with pytest.raises(InputError, match="million samples: kickstand cut writes a part"):
        reader.read_log(command.still(log, (0, 1, 0)))


def test_oversized_calibration_or_track_is_refused(tmp_path, monkeypatch):
    (tmp_path / "CAL.json").write_bytes(b"[" + b"1," * MB + b"1]")
    log = command.still(tmp_path / "log.csv", (0, 1, 0))
    words = "too large for a calibration"
    command.refused(
        tmp_path, "replay", log, "--calibration", tmp_path / "CAL.json", "--out", tmp_path / "x", words=words
    )
    monkeypatch.setattr("kickstand_tools.joining.track_files._MOST_BYTES", 10)
    (tmp_path / "t.gpx").write_text("<gpx></gpx>")
    with pytest.raises(InputError, match="too large for a track"):
        read_track(tmp_path / "t.gpx")


@pytest.mark.parametrize("name", ["log.csv", "log.csv.gz", "CAL.json", "t.gpx", "t.fit", "x.zip", "v.mp4"])
def test_a_pipe_is_not_waited_for(tmp_path, name):
    pipe, out = tmp_path / name, tmp_path / "x.csv"
    os.mkfifo(pipe)
    log = command.still(tmp_path / "good.csv", (0, 1, 0))
    uses = {
        ".csv": ("calibrate", "ride", pipe, "--out", out),
        ".gz": ("cut", pipe, "--from", 1, "--out", out),
        ".json": ("replay", log, "--calibration", pipe, "--out", out),
        ".gpx": ("join", log, pipe, "--out", out),
        ".fit": ("join", log, pipe, "--out", out),
        ".zip": ("import", pipe, "--out", out),
        ".mp4": ("overlay", log, "--video", pipe, "--offset", 0, "--out", tmp_path / "o.mp4"),
    }
    found = command.run(*uses[pipe.suffix])
    assert found.status == 2
    assert found.err.count("\n") == 1
    assert "unexpected" not in found.err


def test_links_out_of_a_folder_are_not_followed(tmp_path):
    (tmp_path / "secret.csv").write_text("the secret\n")
    inside = tmp_path / "export"
    inside.mkdir()
    (inside / "a.csv").symlink_to(tmp_path / "secret.csv")
    line = command.refused(tmp_path, "import", inside, "--out", tmp_path / "x.csv", words="contains no recording")
    assert "the secret" not in line


@pytest.mark.parametrize("times", [[*range(0, 500, 10)] * 40, [*range(0, 500, 10)] * 2])
def test_times_that_often_run_back_are_refused(tmp_path, times):
    command.refused(tmp_path, *imported(tmp_path, table(times)), words="goes back")


def test_column_with_an_impossible_rate_is_not_a_time(tmp_path):
    words = "no sensor has over 10000"
    command.refused(tmp_path, *imported(tmp_path, table(range(3000)), units="t=us,a=m/s2,g=rad/s"), words=words)


def test_rows_with_bad_times_or_extra_cells_are_counted(tmp_path):
    times = [10 * k if k % 2 else ("nan", "inf", "1e300", "-inf")[k // 2 % 4] for k in range(2000)]
    result = command.works(*imported(tmp_path, table(times).replace("\n10,", "\n10,1,2,3,4,5,6,7,8,", 1)))
    assert "damaged rows that are left out: 1001" in result.err


@pytest.mark.parametrize("time", ["2026-05-17T09:30:00+99:99", "2026-05-17T09:30:00-24:00", "0000-00-00", "9999-12-31"])
def test_impossible_gpx_time_is_refused_in_one_line(tmp_path, time):
    point = f'<trkpt lat="48.1" lon="11.0"><time>{time}</time></trkpt>'
    (tmp_path / "t.gpx").write_text(f'<gpx version="1.1" creator="x"><trk><trkseg>{point * 40}</trkseg></trk></gpx>')
    with pytest.raises(InputError, match=r"^[^\n]*$"):
        read_track(tmp_path / "t.gpx")
