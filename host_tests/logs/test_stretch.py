"""The samples and times of a stretch of a log, which `kickstand cut` or the options --from and --to select."""

import gzip
import io
import json
import os

import pytest
from kickstand_tools import api
from kickstand_tools.common.errors import InputError
from kickstand_tools.logs import reader
from kickstand_tools.logs.log import Stretch
from kickstand_tools.logs.reader import read_blocks, read_log, read_twice
from support import command
from support.recordings import analysis_rides

ROWS = [f"{7 + k / 100:.2f}, 0.{k % 9}1,-0.02,1.01,0.5,-0.5,0.1{k % 7},note {k}" for k in range(1000)]
HEADER = command.HEADER + ",note"


@pytest.fixture
def log(tmp_path):
    path = tmp_path / "log.csv"
    path.write_text("\n".join([HEADER, *ROWS]) + "\n")
    return path


@pytest.mark.parametrize(
    ("from_s", "to_s", "first", "last"),
    [
        (2.0, 3.0, 200, 300),
        (None, 1.0, 0, 100),
        (9.0, None, 900, 999),
        (None, -9.0, 0, 99),
        (-5.0, -4.0, 499, 599),
        (0.0, 100.0, 0, 999),
    ],
)
@pytest.mark.parametrize("block_bytes", [500, 1 << 22])
def test_stretch_selects_the_right_samples(log, monkeypatch, from_s, to_s, first, last, block_bytes):
    monkeypatch.setattr(reader, "BLOCK_BYTES", block_bytes)
    for source in log, read_log(log):
        found = read_log(Stretch(source, from_s, to_s))
        assert found.start_s == pytest.approx(7.0 + first / 100)
        assert found.time_us.tolist() == [10_000 * k for k in range(last - first + 1)]
        assert found.accel_g[0, 0] == float(f"0.{first % 9}1")
    blocks = list(read_blocks(Stretch(log, from_s, to_s)))
    assert [line for block in blocks for line in block.lines] == ROWS[first : last + 1]
    assert blocks[0].time_text[0] == ROWS[first].partition(",")[0]


def test_invalid_stretch_is_refused(log):
    for from_s, to_s, words in (
        (3.0, 2.0, "the stretch ends before it begins"),
        (2.0, 2.0, "the stretch ends before it begins"),
        (20.0, None, "no samples in this stretch: the log is 10.0 s long"),
        (None, -20.0, "the stretch ends before it begins"),
    ):
        with pytest.raises(InputError, match=words):
            read_log(Stretch(log, from_s, to_s))
    with pytest.raises(InputError, match="too short: 1 samples"):
        read_log(Stretch(log, 2.0, 2.005))


def test_an_open_file_can_be_read_twice():
    kept = read_twice(Stretch(io.StringIO("\n".join([HEADER, *ROWS])), 1.0, 2.0))
    for _ in range(2):
        assert len(read_log(kept).t_s) == 101


def test_cut_copies_the_lines_unchanged(log, tmp_path):
    out = tmp_path / "cut.csv"
    said = command.works("cut", log, "--from", "2", "--to", "3", "--out", out)
    assert said.out == f"written: {out}, 101 samples, 1.0 s\n"
    assert out.read_text().splitlines() == [HEADER, *ROWS[200:301]]
    packed = tmp_path / "cut.csv.gz"
    command.works("cut", log, "--to", "-9", "--out", packed)
    assert gzip.decompress(packed.read_bytes()).decode().splitlines() == [HEADER, *ROWS[:100]]


def test_cut_refuses_unsafe_outputs_and_bad_stretches(log, tmp_path):
    out = tmp_path / "cut.csv"
    command.refused(tmp_path, "cut", log, "--out", out, words="Give --from, --to or both")
    command.refused(tmp_path, "cut", log, "--from", "1", "--out", log, words="is also an input")
    command.refused(tmp_path, "cut", log, "--from", "early", "--out", out, words="'early' is not a time: give seconds")


def test_replay_and_report_accept_a_stretch(tmp_path):
    ride = analysis_rides.short(tmp_path, speed_hz=1)
    out = tmp_path / "LEAN.csv"
    command.works("replay", ride, "--from", "18", "--to", "26", "--out", out)
    lean = analysis_rides.table(out)
    assert (lean["t_s"][0], lean["t_s"][-1]) == (18.0, 26.0)
    data = json.loads(command.works("report", ride, "--from", "18", "--to", "26", "--json").out)
    assert data["duration_s"] == 8.0
    assert data["stops"] == []
    assert 18.0 <= data["max_right_deg"]["time_s"] <= 26.0  # times count from the start of the whole ride


@pytest.mark.parametrize("name", ["replay", "smooth", "export"])
def test_lean_of_a_stretch_equals_that_of_the_whole_ride(tmp_path, name):
    """The firmware also uses the readings before and after the stretch. Without the other readings the lean would be
    wrong or unknown."""
    ride = analysis_rides.short(tmp_path, rate_hz=50)
    whole, part = tmp_path / "whole.csv", tmp_path / "part.csv"
    form = ("--to", "csv") if name == "export" else ()
    command.works(name, ride, *form, "--out", whole)
    if name == "export":
        api.export(api.open_ride(Stretch(ride, 16.0, -4.0), smoothed=True), "csv", part)
    else:
        command.works(name, ride, "--from", "16", "--to", "-4", "--out", part)
    lines = whole.read_text().splitlines()
    times = [float(line.partition(",")[0]) for line in lines[1:]]
    expected = [line for line, t_s in zip(lines[1:], times) if 16.0 <= t_s <= times[-1] - 4.0 + 1e-9]
    assert part.read_text().splitlines()[1:] == expected


def test_stretch_warns_of_another_mounts_calibration(tmp_path):
    ride = analysis_rides.short(tmp_path, speed_hz=1)
    turned = [[-1, 0, 0], [0, 1, 0], [0, 0, -1]]
    backward = analysis_rides.calibration(tmp_path / "backward.json", vehicle_from_sensor=turned)
    for given in (("replay", "--out", tmp_path / "lean.csv"), ("report",)):
        said = command.works(given[0], ride, "--calibration", backward, "--from", "30", *given[1:])
        assert "forward" in said.err, given


def test_exported_stretch_keeps_its_time_of_day(tmp_path):
    """A log without a time of day is assumed to end when its file was written. A stretch that ends before the log does
    must get an earlier end."""
    ride = analysis_rides.short(tmp_path)  # a ride of 34 s
    os.utime(ride, (1_700_000_100, 1_700_000_100))
    out = tmp_path / "out.csv"
    api.export(api.open_ride(Stretch(ride, 10.0, 20.0)), "racechrono", out)
    first = out.read_text().splitlines()[12]
    assert float(first.split(",")[0]) == pytest.approx(1_700_000_100 - 34 + 10, abs=1.5)
