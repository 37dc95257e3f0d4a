"""The positions and the Universal Time in a log are read, cut, repaired and written like the other columns."""

import io
from collections.abc import Iterable

import numpy as np
import pytest
from kickstand_tools.logs import reader
from kickstand_tools.logs.csv_lines import cut_log, write_log
from kickstand_tools.logs.frozen import without_frozen
from kickstand_tools.logs.log import Log, Stretch
from kickstand_tools.logs.reader import read_blocks, read_log

TRACK = ("lat_deg", "lon_deg", "utc_s")
HEADER = "t_s,ax_g,ay_g,az_g,gx_dps,gy_dps,gz_dps,lat_deg,lon_deg,utc_s\n"
PLACED = range(3, 400, 20)  # rows that have a position


def place(k: int) -> tuple[float, float, float]:
    return -33.8688197 + 1e-7 * k, 151.2092955 - 1e-7 * k, 1_700_000_000.25 + k / 100


def text(n: int = 400, t: str = "{:.2f}") -> str:
    rows = []
    for k in range(n):
        cells = "{:.7f},{:.7f},{:.3f}".format(*place(k)) if k in PLACED else ",,"
        rows.append(f"{t.format(k / 100)},0.0{k % 7},1.0,0.0{k % 3},0.{k % 9},0.5,0.1,{cells}\n")
    return HEADER + "".join(rows)


def placed(log: Log) -> list[tuple[int, tuple[float, ...]]]:
    """Return [(hundredths of a second by the recorder's clock, (position and time)), ...] of the rows with a
    position."""
    assert np.array_equal(np.isfinite(log.lat_deg), np.isfinite(log.utc_s))
    rows = np.flatnonzero(np.isfinite(log.lat_deg) & np.isfinite(log.lon_deg))
    return [
        (round(100 * (log.start_s + log.t_s[row])), tuple(float(getattr(log, name)[row]) for name in TRACK))
        for row in rows
    ]


def expected(rows: Iterable[int] = PLACED) -> list:
    return [(k, pytest.approx(place(k), rel=0, abs=1e-8)) for k in rows]


@pytest.mark.parametrize("block_bytes", [700, 1 << 22])
def test_positions_are_read_in_any_block_and_cut(monkeypatch, block_bytes):
    monkeypatch.setattr(reader, "BLOCK_BYTES", block_bytes)
    monkeypatch.setattr(reader, "BLOCK_SAMPLES", 55)
    log = read_log(io.StringIO(text()))
    assert placed(log) == expected()
    assert placed(read_log(log)) == expected()
    assert placed(read_log(Stretch(log, 1.0, 2.0))) == expected(range(103, 200, 20))
    assert placed(read_log(Stretch(io.StringIO(text()), 1.0, 2.0))) == expected(range(103, 200, 20))


def test_spread_times_keep_positions_in_their_rows():
    """The times are rounded to tenths of a second, so ten rows have the same time."""
    log = read_log(io.StringIO(text(t="{:.1f}")))
    assert np.flatnonzero(np.isfinite(log.lat_deg)).tolist() == list(PLACED)
    assert log.lon_deg[23] == pytest.approx(place(23)[1], abs=1e-8)


def test_positions_of_frozen_readings_are_removed():
    whole = read_log(io.StringIO(text()))
    whole.accel_g += np.random.default_rng(1).normal(0.0, 1e-3, whole.accel_g.shape)
    whole.accel_g[100:200] = whole.accel_g[100]
    whole.gyro_dps[100:200] = whole.gyro_dps[100]
    kept = without_frozen(whole)
    assert len(kept.t_s) < 310
    assert placed(kept) == expected([k for k in PLACED if not 100 < k < 200])
    (block,) = read_blocks(whole)
    assert np.count_nonzero(np.isfinite(block.measured.lat_deg)) == len(placed(kept))


def test_written_log_has_position_columns_only_if_needed(tmp_path):
    path = tmp_path / "log.csv"
    path.write_text(text())
    cut_log(path, tmp_path / "cut.csv.gz", 1.0, 2.0)
    assert placed(read_log(tmp_path / "cut.csv.gz")) == expected(range(103, 200, 20))
    write_log(tmp_path / "again.csv", read_log(path))
    assert (tmp_path / "again.csv").read_text().splitlines()[0] == HEADER.strip()
    assert placed(read_log(tmp_path / "again.csv")) == expected()
    bare = Log(np.array([0.0, 0.01]), np.tile([0.0, 1.0, 0.0], (2, 1)), np.zeros((2, 3)))
    write_log(tmp_path / "bare.csv", bare)
    assert (tmp_path / "bare.csv").read_text().splitlines()[0] == "t_s,ax_g,ay_g,az_g,gx_dps,gy_dps,gz_dps"
    assert np.all(np.isnan(read_log(tmp_path / "bare.csv").utc_s))
