"""Each field of each packet is as in the tables of firmware/docs/live.md, also at its limits."""

import pytest
from hypothesis import given, strategies as st
from kickstand.live import radio
from support.radio_decoder import channels, own

NUMBERS = st.floats(-1e5, 1e5)
VECTORS = st.lists(NUMBERS, min_size=3, max_size=3)


@pytest.fixture
def buffer():
    return bytearray(20)


def test_racechrono_gets_each_number_back(buffer):
    size = radio.pack_lean(buffer, -31.24, 1.16)
    assert channels(buffer[:size]) == pytest.approx({"lean angle": -31.2, "its standard deviation": 1.2})
    size = radio.pack_motion(buffer, [0.0125, 1.25, -0.5], [1.0, -19.97, 30.0], True)
    assert channels(buffer[:size]) == pytest.approx(
        {
            "longitudinal acceleration": -0.5,
            "lateral acceleration (specific force)": 0.013,
            "vertical acceleration (specific force)": 1.25,
            "yaw rate": -20.0,
            "roll rate": 30.0,
            "1 while the lean is trusted": 1,
        }
    )
    size = radio.pack_speed(buffer, 33.333)
    assert channels(buffer[:size]) == pytest.approx({"speed": 33.33})


def test_unknown_values_are_unknown(buffer):
    packet = own("now", buffer[: radio.pack_now(buffer, 0, None, None, None, [1.0] * 3, None, 3)])
    assert list(packet.values()) == [0, *[None] * 9, 3]


def limited(value, scale, low, high):
    return pytest.approx(min(max(scale * value, low), high), abs=0.51)


@given(st.integers(0, 1 << 30), NUMBERS, NUMBERS, VECTORS, VECTORS, NUMBERS)
def test_number_is_limited_and_never_unknown(ms, lean, sigma, force, rate, speed):
    buffer = bytearray(20)
    packet = own("now", buffer[: radio.pack_now(buffer, ms, lean, sigma, force, rate, speed, 0)])
    scales = [2048] * 3 + [16] * 3
    assert list(packet.values()) == [
        ms % 65536,
        limited(lean, 100, -32767, 32767),
        limited(sigma, 10, 0, 254),
        *(limited(value, scale, -32767, 32767) for value, scale in zip([*force, *rate], scales, strict=True)),
        limited(speed, 100, 0, 65534),
        0,
    ]


@pytest.mark.parametrize(
    ("data", "intervals"),
    [
        ([0], [0, 0, 0]),
        ([1, 0, 100], [100, 100, 100]),
        ([1, 0, 0], [40, 40, 40]),  # an interval of 0 means as fast as possible
        ([2, 3, 232, 0, 0, 0, 2], [50, 1000, 70]),
        ([2, 0, 50, 0, 0, 0, 0], [50, 60, 70]),  # the request names a packet that does not exist
        ([2, 0, 50, 1, 0, 0, 1], [50, 60, 70]),
    ],
)
def test_filter_sets_the_intervals(data, intervals):
    interval = [50, 60, 70, 77]
    assert radio.take_filter(bytes(data), interval)
    assert interval == [*intervals, 77]


@pytest.mark.parametrize("data", [[], [0, 0], [1], [1, 0], [1, 0, 1, 0], [2, 0, 50, 0, 0, 1], [3], [255] * 20])
def test_invalid_commands_change_nothing(data):
    interval = [40, 50, 60, 70]
    assert not radio.take_filter(bytes(data), interval)
    assert radio.take_rate(bytes(data), interval) == (len(data) == 2)
    assert interval[:3] == [40, 50, 60] and interval[3] in (70, 256 * (data == [1, 0]), 40)
