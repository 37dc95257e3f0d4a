"""Positions in recorded rides are exact, belong to the right samples, and displace no other data."""

import struct

import numpy as np
import pytest
from kickstand.rides import block as block_format
from kickstand_tools.logs.reader import read_log
from kickstand_tools.rides import block_reader, ride_log
from support import device_plans, engines
from support.recordings import ride_writer
from test_recorder import rides

MIDNIGHT_S = 1_798_761_600.0  # 1 January 2027 in Unix time
DEGREE = 6_000_000  # one degree in units of 0.00001 minutes


def expected(k: int) -> tuple[float, float, float]:
    """Return the latitude, longitude and UTC of ride_writer.place(k)."""
    return (-203_212_345 + 7 * k) / DEGREE, (-1_079_999_999 + 11 * k) / DEGREE, MIDNIGHT_S - 17.9 + k / 10


def found(blocks) -> list[tuple[int, tuple[float, float, float | None]]]:
    """Return [(number of the loop's pass, position), ...] of all positions in the blocks."""
    turns = [turn for block in blocks for turn in block.turns]
    return [(i, (t.place.lat_deg, t.place.lon_deg, t.place.utc_s)) for i, t in enumerate(turns) if t.place]


@pytest.mark.parametrize("length", [block_format.block_length, lambda _: 512], ids=["flash", "USB"])
@pytest.mark.parametrize("every", [10, 1])
def test_no_turn_is_lost_and_positions_keep_their_turn(every, length):
    data, turns = ride_writer.blocks(12, length=length, speed=True, places_every=every)
    blocks, problems = block_reader.read(b"".join(data))
    assert problems == []
    times = [blocks[0].time_us, *(turn.time_us for block in blocks for turn in block.turns)]
    held = [(turn.sums, turn.n, turn.time_us - before)
            for turn, before in zip((turn for block in blocks for turn in block.turns), times)]  # fmt: skip
    assert held == turns
    assert [k for k, _ in found(blocks)] == list(range(0, len(turns), every))
    for k, (lat_deg, lon_deg, utc_s) in found(blocks):
        assert (lat_deg, lon_deg) == pytest.approx(expected(k // every)[:2], rel=0.0, abs=1e-9)
        assert utc_s == pytest.approx(expected(k // every)[2], rel=0.0, abs=1e-6)
    assert [turn.speed_mps for block in blocks for turn in block.turns][:101:100] == [0.0, 1.0]
    for block, content in zip(blocks, data):
        free = content[: -6 - 16 * sum(bool(turn.place) for turn in block.turns)]
        # The unused bytes have room for the samples of one pass only
        assert len(free) - len(free.rstrip(b"\0")) < 16 + 60


def said(*values: int) -> list:
    """Write one position into a block, read the block with the tools, and return the positions that they find.

    values: date, ms, latitude, longitude.
    """
    block = ride_writer.begun(1024)
    block.add_place(values)
    block.add([0, 0, 8192, 0, 0, 0, 0], 2, 10_000)
    return found([ride_writer.ended(block)])


def test_an_invalid_date_leaves_the_position():
    for date in (0, 5, 26 << 9 | 13 << 5 | 1, 26 << 9 | 2 << 5 | 30, 0xFFFF):
        ((_, (lat, lon, utc_s)),) = said(date, 1000, 6_000_000, -6_000_000)
        assert (lat, lon, utc_s) == (1.0, -1.0, None), date
    assert said(0, 0, 90 * DEGREE + 1, 0) == []
    assert said(0, 0, 0, -180 * DEGREE - 1) == []
    assert len(said(0, 0, 90 * DEGREE, -180 * DEGREE)) == 1


@pytest.mark.parametrize("engine", engines.ENGINES[1:])
def test_a_recorded_ride_has_positions(engine, tmp_path):
    """Ten positions per second get from the receiver's wire to the log, even before a motorcycle's speed is
    confirmed."""
    place = [-33.5, -70.5, -1e-4, 2e-4]
    plan = {
        "ride": [["upright", 4.0], ["accelerate", 15.0, 6.0], ["turn", -30.0, 5.0]],
        "gps": {"hz": 10, "baud": 38400, "latency_s": 0.1, "place": place},
        "config": {"RECORD": True, "SPEED": "gps", "GPS_BAUD": 38400},
        "until": 14,
    }
    device_plans.run(engine, tmp_path, plan)
    (blocks,) = rides(tmp_path)[0].values()
    ride_log.write(tmp_path / "ride.csv", blocks)
    log = read_log(tmp_path / "ride.csv")
    placed = np.isfinite(log.lat_deg)
    seconds = log.t_s[-1] - log.t_s[0]
    assert np.count_nonzero(placed) > 9.5 * seconds - 10
    noon_s = 1_795_262_400.0  # noon on 21 November 2026, 20 s after the model's clock began
    fix_s = log.utc_s[placed] - (noon_s - 20.0)
    at_s = log.t_s[placed] + blocks[0].time_us * 1e-6
    assert np.all((at_s - fix_s > 0.09) & (at_s - fix_s < 0.2))
    assert np.max(np.abs(log.lat_deg[placed] - (place[0] + place[2] * fix_s))) < 2e-6
    assert np.max(np.abs(log.lon_deg[placed] - (place[1] + place[3] * fix_s))) < 3e-6


def test_a_log_has_no_empty_columns(tmp_path):
    for name, speed, every, columns in (
        ("none", False, 0, []),
        ("places", False, 10, ["lat_deg", "lon_deg", "utc_s"]),
        ("all", True, 10, ["speed_mps", "lat_deg", "lon_deg", "utc_s"]),
    ):
        blocks, _ = block_reader.read(b"".join(ride_writer.blocks(2, speed=speed, places_every=every)[0]))
        ride_log.write(tmp_path / f"{name}.csv", blocks)
        header, first = (tmp_path / f"{name}.csv").read_text().splitlines()[:2]
        assert header.split(",")[7:] == [*columns, "temp_c"]
        if "lat_deg" in columns:
            assert first.split(",")[-4:] == ["-33.8687242", "-179.9999998", f"{MIDNIGHT_S - 17.9:.3f}", "31.25"]


def test_an_older_reader_finds_all_but_the_positions():
    """An older reader takes the number of positions for a byte of the version's name. The older reader ignores the
    positions' bytes, where it expects zeros."""
    data, _ = ride_writer.blocks(3, places_every=10)
    for content in data:
        fields = struct.unpack_from("<4sHHIIqhHHH11sB", content)
        assert fields[:3] == (b"KRID", 1, len(content))
        assert fields[10].startswith(block_format.__version__.encode() + b"\0")
        count, _ = struct.unpack_from("<HI", content, len(content) - 6)
        block = block_reader.parse(content)
        start = len(content) - 6
        old = list(block_reader._turns(block, content[block_reader._START : start], count, {}))
        assert [(t.time_us, t.sums, t.n) for t in old] == [(t.time_us, t.sums, t.n) for t in block.turns]
