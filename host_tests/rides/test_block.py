"""The format of a recorded ride: what the firmware writes comes back exactly, and everything fits in the worst case."""

import pytest
from hypothesis import given, settings, strategies
from kickstand import __version__
from kickstand.rides import block as block_format
from kickstand.rides.block import RideBlock, block_length
from kickstand_tools.rides import ride_log
from support.recordings import ride_writer
from support.recordings.ride_writer import CHIP

MIDNIGHT_S = 1_798_761_600.0  # 1 January 2027 in Unix time
DEGREE = 6_000_000  # one degree in units of 0.00001 minutes


def passes(blocks):
    """Return (six sums, number of samples, duration) of each pass of the loop in these blocks."""
    times = [blocks[0].time_us, *(turn.time_us for block in blocks for turn in block.turns)]
    turns = [turn for block in blocks for turn in block.turns]
    return [(turn.sums, turn.n, turn.time_us - previous) for turn, previous in zip(turns, times)]


def places(blocks):
    turns = [turn for block in blocks for turn in block.turns]
    return [(i, (turn.place.lat_deg, turn.place.lon_deg, turn.place.utc_s))
            for i, turn in enumerate(turns) if turn.place]  # fmt: skip


COUNT = strategies.integers(-32768, 32767)
PASS = strategies.integers(1, 8).flatmap(
    lambda n: strategies.tuples(
        strategies.lists(COUNT.map(lambda count: n * count), min_size=7, max_size=7),
        strategies.just(n),
        strategies.integers(0, 100_000) | strategies.just(block_format.MAX_DT_US),
    )
)


@given(strategies.lists(PASS, min_size=1, max_size=40))
@settings(max_examples=50)
def test_every_pass_comes_back_exactly(written):
    block = RideBlock(5000)
    block.begin(4092, 7, 3, 123456789012, CHIP, 200, bytes(80))
    for entry in written:
        block.add(*entry)
    stored = ride_writer.ended(block)
    assert passes([stored]) == [((*sums[:3], *sums[4:]), n, dt_us) for sums, n, dt_us in written]
    assert (stored.ride, stored.sequence, stored.time_us) == (7, 3, 123456789012)
    assert (stored.accel_lsb_per_g, stored.gyro_lsb_tenths, stored.sample_hz) == (4096, 655, 200)
    assert (stored.centidegrees, stored.firmware, stored.delay_tenths_ms) == (3125, __version__, 134)


@pytest.mark.parametrize(
    ("length", "every"), [(block_length, 10), (block_length, 1), (lambda _: 512, 10), (lambda _: 512, 1)]
)
def test_full_blocks_keep_speeds_places_and_calibration(length, every):
    data, written = ride_writer.blocks(8, length=length, speed=True, places_every=every, trim_deg=1.25)
    if length is block_length:
        assert [len(block) for block in data] == [4096, 4092, 4088, 4092, 4084, 4092, 4088, 4092]
    blocks, problems = ride_log.read(b"".join(data))
    assert problems == [] and passes(blocks) == written
    expected = [(k * every, ((-203_212_345 + 7 * k) / DEGREE, (-1_079_999_999 + 11 * k) / DEGREE,
                             MIDNIGHT_S - 17.9 + k / 10)) for k in range(-(-len(written) // every))]  # fmt: skip
    assert [k for k, _ in places(blocks)] == [k for k, _ in expected]
    for (_, position), (_, given_place) in zip(places(blocks), expected):
        assert position == pytest.approx(given_place, rel=0.0, abs=1e-6)
    turns = [turn for block in blocks for turn in block.turns]
    speeds = [(i, turn.speed_mps) for i, turn in enumerate(turns) if turn.speed_mps is not None]
    assert speeds == [(i, i / 100) for i in range(0, len(turns), 100)]
    calibration, original = blocks[0].calibration(), ride_writer.calibration(1.25)
    for name in ("accel_offset", "accel_slope", "gyro_bias", "vehicle_from_sensor"):
        assert list(getattr(calibration, name)) == list(getattr(original, name))
    assert (calibration.trim_deg, calibration.aligned, calibration.six_done) == (1.25, True, True)
    for block, content in zip(blocks, data):  # the unused bytes have room for the samples of one pass only
        used = content[: -6 - 16 * sum(bool(turn.place) for turn in block.turns)]
        assert len(used) - len(used.rstrip(b"\0")) < 16 + 60


@pytest.mark.parametrize(
    ("date", "lat", "lon", "place"),
    [
        (26 << 9 | 5 << 5 | 17, 48 * DEGREE, -11 * DEGREE // 2, (48.0, -5.5, 1_778_976_001.5)),
        (26 << 9 | 5 << 5 | 17, 90 * DEGREE, -180 * DEGREE, (90.0, -180.0, 1_778_976_001.5)),
        *((date, DEGREE, -DEGREE, (1.0, -1.0, None))
          for date in (0, 5, 26 << 9 | 13 << 5 | 1, 26 << 9 | 2 << 5 | 30, 0xFFFF)),
        (0, 90 * DEGREE + 1, 0, None),
        (0, 0, -180 * DEGREE - 1, None),
    ],
)  # fmt: skip
def test_position_in_hundred_thousandths_of_a_minute(date, lat, lon, place):
    """The date has 7 bits for the years since 2000, 4 bits for the month and 5 bits for the day."""
    block = ride_writer.begun(1024)
    block.add_place((date, 1500, lat, lon))
    block.add([0, 0, 8192, 0, 0, 0, 0], 2, 10_000)
    assert places([ride_writer.ended(block)]) == ([(0, place)] if place else [])
