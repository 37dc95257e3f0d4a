"""The log of a recorder that lost its power. A broken end is left out and reported, a broken middle is refused."""

import gzip

import numpy as np
import pytest
from kickstand_tools.common.messages import InputError, sentence
from kickstand_tools.logs.reader import read_log
from support import command
from support.recordings import analysis_rides

ROWS = [f"{k / 100:.2f},0.{k % 9}1,-0.02,1.01,0.5,-0.5,0.1{k % 7}" for k in range(400)]
WHOLE = ("\n".join([command.HEADER, *ROWS]) + "\n").encode()
CUT = "line 401, the last one, was cut: it is left out"
NUL_END = "its end is {} NUL bytes, as after a loss of power: they are left out"

# {name: (content of the log, number of samples that are read, messages)}
ENDS = {
    "fewer cells": (WHOLE[:-12], 399, [CUT]),
    "fewer cells, but a line": (WHOLE[:-12] + b"\n", 399, [CUT]),
    "half a number": (WHOLE[:-2], 399, [CUT]),
    "a sign alone": (WHOLE[:-5] + b"-", 399, [CUT]),
    "a word": (WHOLE[:-5] + b"x.25", 399, [CUT]),
    "rubbish": (WHOLE[:-12] + b"\xff\xfe\x80", 399, [CUT]),
    "NUL bytes": (WHOLE + bytes(5000), 400, [NUL_END.format(5000)]),
    "a cut line and NUL bytes": (WHOLE[:-12] + bytes(70), 399, [NUL_END.format(70), CUT]),
    "no end of line": (WHOLE[:-1], 400, []),
    "one more decimal": (WHOLE[:-1] + b"5", 400, []),
    "blank lines": (WHOLE + b"\n \n", 400, []),
}


@pytest.mark.parametrize("name", ENDS)
@pytest.mark.parametrize("ending", ["", ".gz"])
def test_a_cut_end_is_left_out(tmp_path, name, ending):
    content, samples, messages = ENDS[name]
    path = tmp_path / f"log.csv{ending}"
    path.write_bytes(gzip.compress(content) if ending else content)
    log = read_log(path)
    assert len(log.t_s) == samples and [sentence(notice) for notice in log.notices] == messages


@pytest.mark.parametrize("end", ["", "\n"])
def test_a_last_optional_cell_may_be_empty_or_quoted(tmp_path, end):
    """The number of decimals in the previous speed does not matter."""
    rows = [row + ("," if k % 2 else ',"5.25"' if k == 0 else ",5.25") for k, row in enumerate(ROWS)]
    (tmp_path / "log.csv").write_text("\n".join([f"{command.HEADER},speed_mps", *rows]) + end)
    log = read_log(tmp_path / "log.csv")
    assert (len(log.t_s), log.notices) == (400, [])


@pytest.mark.parametrize("share", [0.3, 0.6, 0.99])
def test_a_cut_gzip_file_is_read_up_to_the_cut(tmp_path, share):
    path, random = tmp_path / "log.csv.gz", np.random.default_rng(3)
    rows = [f"{k / 100:.2f}," + ",".join(f"{x:.5f}" for x in random.normal(1.0, 0.1, 6)) for k in range(3000)]
    packed = gzip.compress("\n".join([command.HEADER, *rows]).encode())
    path.write_bytes(packed[: int(share * len(packed))])
    log = read_log(path)
    assert len(log.t_s) == pytest.approx(share * 3000, rel=0.05)
    assert log.time_us.tolist() == [10_000 * k for k in range(len(log.t_s))]
    assert log.notices[0].code == "cut-gzip" and {notice.code for notice in log.notices} <= {"cut-gzip", "cut-line"}


@pytest.mark.parametrize("broken", [b"3.00,0,0", b"3.00,0,0,1,0,0,", b"3.00,\0\0\0", b"3.00,0,-,1,0,0,0"])
def test_a_broken_line_in_the_middle_is_refused(tmp_path, broken):
    lines = WHOLE.split(b"\n")
    lines[301] = broken
    (tmp_path / "log.csv").write_bytes(b"\n".join(lines))
    with pytest.raises(InputError, match=", line 302: "):
        read_log(tmp_path / "log.csv")


def test_commands_report_a_cut_end(tmp_path):
    ride = analysis_rides.short(tmp_path)
    ride.write_bytes(ride.read_bytes()[:-20])
    for arguments in (("replay", ride), ("cut", ride, "--from", "5")):
        warning = command.works(*arguments, "--out", tmp_path / "OUT.csv").err
        assert warning.count("\n") == 1 and warning.startswith(f"warning: {ride}: line 3401, the last one, was cut")
