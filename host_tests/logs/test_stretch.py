"""`kickstand cut` and the options --from and --to: the samples, the lines and the times of a stretch."""

import gzip
import json

import pytest
from kickstand_tools import api
from kickstand_tools.logs.log import Stretch
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
    [(2.0, 3.0, 200, 300), (9.0, None, 900, 999), (None, -9.0, 0, 99), (-5.0, -4.0, 499, 599), (0.0, 99.0, 0, 999)],
)
@pytest.mark.parametrize("size", [500, 1 << 22])
def test_a_stretch_keeps_the_lines_of_its_samples(log, tmp_path, small_chunks, from_s, to_s, first, last, size):
    small_chunks(size)
    count = last - first + 1
    assert api.cut_log(log, tmp_path / "cut.csv", from_s, to_s) == (count, pytest.approx((count - 1) / 100))
    assert (tmp_path / "cut.csv").read_text().splitlines() == [HEADER, *ROWS[first : last + 1]]
    part = api.read_log(Stretch(log, from_s, to_s))
    assert part.start_s == pytest.approx(7.0 + first / 100) and part.time_us[0] == 0


def test_cut_copies_the_lines_unchanged(log, tmp_path):
    out = tmp_path / "cut.csv"
    result = command.works("cut", log, "--from", "2", "--to", "3", "--out", out)
    assert result.out == f"written: {out}, 101 samples, 1.0 s\n"
    assert out.read_text().splitlines() == [HEADER, *ROWS[200:301]]
    packed = tmp_path / "cut.csv.gz"
    command.works("cut", log, "--to", "-9", "--out", packed)
    assert gzip.decompress(packed.read_bytes()).decode().splitlines() == [HEADER, *ROWS[:100]]


def test_bad_stretches_are_refused(log, tmp_path):
    for arguments, words in (
        (("--out", tmp_path / "cut.csv"), "Give --from, --to or both"),
        (("--from", "early", "--out", tmp_path / "cut.csv"), "'early' is not a time: give seconds"),
    ):
        command.refused(tmp_path, "cut", log, *arguments, words=words)


def test_a_report_of_a_stretch_has_the_times_of_the_ride(tmp_path):
    ride = analysis_rides.short(tmp_path, speed_hz=1)
    data = json.loads(command.works("report", ride, "--from", "18", "--to", "26", "--json").out)
    assert (data["duration_s"], data["stops"]) == (8.0, []) and 18.0 <= data["max_right_deg"]["time_s"] <= 26.0


@pytest.mark.parametrize("name", ["replay", "smooth", "export"])
def test_the_lean_of_a_stretch_is_that_of_the_whole_ride(tmp_path, name):
    """Readings before and after the stretch are used, too. Without them the lean would be wrong or unknown."""
    ride = analysis_rides.short(tmp_path, rate_hz=50)
    complete, part = tmp_path / "whole.csv", tmp_path / "part.csv"
    if name == "export":
        command.works("export", ride, "--to", "csv", "--out", complete)
        api.export(api.open_ride(Stretch(ride, 16.0, -4.0), smoothed=True), "csv", part)
    else:
        command.works(name, ride, "--out", complete)
        command.works(name, ride, "--from", "16", "--to", "-4", "--out", part)
    _, *lines = complete.read_text().splitlines()
    times = [float(line.partition(",")[0]) for line in lines]
    inside = [line for line, t_s in zip(lines, times) if 16.0 <= t_s <= times[-1] - 4.0 + 1e-9]
    assert part.read_text().splitlines()[1:] == inside
