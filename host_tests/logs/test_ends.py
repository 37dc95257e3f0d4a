"""Tests reading the log of a recorder that lost its power. A broken end is left out. A broken middle is refused."""

import gzip

import numpy as np
import pytest
from kickstand_tools.common.errors import InputError
from kickstand_tools.common.messages import sentence
from kickstand_tools.logs import reader
from kickstand_tools.logs.reader import read_log
from support import command
from support.recordings import analysis_rides

ROWS = [f"{k / 100:.2f},0.{k % 9}1,-0.02,1.01,0.5,-0.5,0.1{k % 7}" for k in range(400)]
WHOLE = ("\n".join([command.HEADER, *ROWS]) + "\n").encode()
LINE = len(ROWS) + 1
CUT = f"line {LINE}, the last one, was cut: it is left out"

# {name: (content of the log, number of samples that are read, message)}
ENDS = {
    "fewer cells": (WHOLE[:-12], 399, CUT),
    "fewer cells, but a line": (WHOLE[:-12] + b"\n", 399, CUT),
    "half a number": (WHOLE[:-2], 399, CUT),
    "a sign alone": (WHOLE[:-5] + b"-", 399, CUT),
    "rubbish": (WHOLE[:-12] + b"\xff\xfe\x80", 399, CUT),
    "NUL bytes": (WHOLE + bytes(5000), 400, "its end is 5000 NUL bytes, as after a loss of power: they are left out"),
    "no end of line": (WHOLE[:-1], 400, ""),
    "blank lines": (WHOLE + b"\n \n", 400, ""),
}


@pytest.mark.parametrize("what", ENDS)
@pytest.mark.parametrize("ending", ["", ".gz"])
def test_a_cut_end_is_left_out(tmp_path, what, ending):
    content, samples, said = ENDS[what]
    path = tmp_path / f"log.csv{ending}"
    path.write_bytes(gzip.compress(content) if ending else content)
    log = read_log(path)
    assert len(log.t_s) == samples
    assert [sentence(notice) for notice in log.notices] == ([said] if said else [])


def test_a_cut_line_behind_nul_bytes(tmp_path):
    path = tmp_path / "log.csv"
    path.write_bytes(WHOLE[:-12] + bytes(70))
    log = read_log(path)
    assert len(log.t_s) == 399
    assert [notice.code for notice in log.notices] == ["nul-end", "cut-line"]


def test_a_last_speed_may_be_empty(tmp_path):
    """A last row without a speed is complete. The number of digits in the previous speed does not matter, and there may
    be no line feed after the row."""
    path = tmp_path / "log.csv"
    rows = [row + ("," if k % 2 else ",5.25") for k, row in enumerate(ROWS)]
    path.write_text("\n".join([f"{command.HEADER},speed_mps", *rows]))
    assert len(read_log(path).t_s) == 400
    assert read_log(path).notices == []


@pytest.mark.parametrize("kept", [0.3, 0.6, 0.99])
def test_cut_gzip_file_is_read_up_to_the_cut(tmp_path, kept):
    path = tmp_path / "log.csv.gz"
    chance = np.random.default_rng(3)
    rows = [f"{k / 100:.2f}," + ",".join(f"{x:.5f}" for x in chance.normal(1.0, 0.1, 6)) for k in range(3000)]
    packed = gzip.compress("\n".join([command.HEADER, *rows]).encode())
    path.write_bytes(packed[: int(kept * len(packed))])
    log = read_log(path)
    assert len(log.t_s) == pytest.approx(kept * 3000, rel=0.05)
    assert log.time_us.tolist() == [10_000 * k for k in range(len(log.t_s))]
    assert log.notices[0].code == "cut-gzip"
    assert all(notice.code in ("cut-gzip", "cut-line") for notice in log.notices)


@pytest.mark.parametrize("broken", [b"3.00,0,0", b"3.00,0,0,1,0,0,", b"3.00,\0\0\0", b"3.00,0,-,1,0,0,0"])
def test_broken_line_in_the_middle_is_refused_by_number(tmp_path, broken):
    lines = WHOLE.split(b"\n")
    lines[301] = broken
    path = tmp_path / "log.csv"
    path.write_bytes(b"\n".join(lines))
    with pytest.raises(InputError, match=", line 302: "):
        read_log(path)


def test_every_command_reports_a_cut_end(tmp_path):
    """The commands report and export read logs as replay does, see test_frozen.py."""
    ride = analysis_rides.short(tmp_path)
    ride.write_bytes(ride.read_bytes()[:-20])
    for arguments in (("replay", ride), ("cut", ride, "--from", "5")):
        said = command.works(*arguments, "--out", tmp_path / "OUT.csv").err
        assert said.count("\n") == 1
        assert said.startswith(f"warning: {ride}: line 3401, the last one, was cut")


@pytest.mark.parametrize("block_bytes", [300, 50_000, 1 << 22])
def test_times_are_spread_equally_for_any_block_size(tmp_path, monkeypatch, block_bytes):
    true = np.arange(12_000) / 104
    path = tmp_path / "log.csv"
    rows = [f"{t:.2f},0.{k % 9}1,-0.02,1.01,0.5,-0.5,0.1{k % 7}" for k, t in enumerate(true)]
    path.write_text("\n".join([command.HEADER, *rows]) + "\n")
    monkeypatch.setattr(reader, "BLOCK_BYTES", block_bytes)
    blocks = list(reader.read_blocks(path))
    times = np.concatenate([block.t_s for block in blocks])
    assert [line for block in blocks for line in block.lines] == rows
    assert np.max(np.abs(np.diff(times) * 104 - 1.0)[100:-100]) < 0.02
    assert np.max(np.abs(times - true)) < 0.004
    assert (len(blocks) > 2) is (block_bytes < 1 << 22)
