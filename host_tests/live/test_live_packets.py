"""Each field of each packet is as in the tables of firmware/docs/live.md, also at its limits."""

import types

import pytest
from kickstand.live import packets
from support.radio_decoder import channels, own


@pytest.fixture
def buffer():
    return bytearray(20)


def test_racechrono_gets_each_number_back(buffer):
    size = packets.lean(buffer, -31.24, 1.16)
    assert channels(buffer[:size]) == pytest.approx({"lean angle": -31.2, "its standard deviation": 1.2})
    size = packets.motion(buffer, [0.0125, 1.25, -0.5], [1.0, -19.97, 30.0], True)
    found = channels(buffer[:size])
    assert found["longitudinal acceleration"] == pytest.approx(-0.5)
    assert found["lateral acceleration (specific force)"] == pytest.approx(0.013)
    assert found["vertical acceleration (specific force)"] == pytest.approx(1.25)
    assert found["yaw rate"] == pytest.approx(-20.0) and found["roll rate"] == pytest.approx(30.0)
    assert found["1 while the lean is trusted"] == 1
    size = packets.speed(buffer, 33.333)
    assert channels(buffer[:size]) == pytest.approx({"speed": 33.33})


def test_our_page_gets_each_number_back(buffer):
    state = packets.ALIGNED + packets.TRUSTED + packets.NO_READINGS
    size = packets.now(buffer, 70_000, 12.345, 0.44, [0.5, 1.0, -0.25], [-1.0, 2.0, 3.0], None, state)
    found = own("now", buffer[:size])
    assert (found["time of the board"], found["lean"], found["its standard deviation"]) == (4464, 1235, 4)
    assert (found["specific force to the left"], found["up"], found["forward"]) == (1024, 2048, -512)
    rates = [found[name] for name in found if "about" in name]
    assert rates == [-16, 32, 48] and found["speed"] is None and found["state"] == 67
    meter = types.SimpleNamespace(
        max_left_deg=41.26, max_right_deg=0.0, max_accel_g=0.4567, max_brake_g=0.9, trim_deg=-1.5
    )
    ride = own("ride", buffer[: packets.ride(buffer, 3, meter, 70_000)])
    assert list(ride.values()) == [1, 3, 413, 0, 457, 900, -150, 65535]


def test_too_large_values_are_limited_and_never_unknown(buffer):
    size = packets.now(buffer, 0, 9999.0, 9999.0, [99.0, -99.0, 0.0], [9999.0, -9999.0, 0.0], 9999.0, 0)
    found = own("now", buffer[:size])
    assert None not in found.values()
    assert (found["lean"], found["its standard deviation"], found["speed"]) == (32767, 254, 65534)
    assert (found["specific force to the left"], found["up"]) == (32767, -32767)


@pytest.mark.parametrize(
    ("data", "asked"),
    [
        ([1, 0, 100], [100, 100, 100]),
        ([1, 0, 0], [40, 40, 40]),  # an interval of 0 means as fast as possible
        ([2, 3, 232, 0, 0, 0, 2], [0, 1000, 0]),
        ([2, 0, 50, 0, 0, 0, 0], [0, 0, 0]),  # the request names a packet that does not exist
        ([2, 0, 50, 1, 0, 0, 1], [0, 0, 0]),
    ],
)
def test_commands_set_the_intervals(data, asked):
    intervals = [0, 0, 0, 77]
    assert packets.take_filter(bytes(data), intervals)
    assert intervals == [*asked, 77]


@pytest.mark.parametrize("data", [[], [0, 0], [1], [1, 0], [1, 0, 1, 0], [2, 0, 50, 0, 0, 1], [3], [255] * 20])
def test_invalid_commands_change_nothing(data):
    intervals = [40, 50, 60, 70]
    assert not packets.take_filter(bytes(data), intervals)
    assert intervals == [40, 50, 60, 70]
    assert packets.take_rate(bytes(data), intervals) == (len(data) == 2)
