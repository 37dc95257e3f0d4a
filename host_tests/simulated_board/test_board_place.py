"""Positions of a GPS receiver: the firmware's driver on the simulated board. Runs on MicroPython too."""

from kickstand_tools.simulated_board.gps import sentence
from kickstand_tools.simulated_board.simulator import Board
from support.board_access import level
from test_board_speed import Listing

DAY = 26 << 9 | 11 << 5 | 21  # 21 November 2026, in the form of Gps.place()
NOON = 12 * 3600 * 1000


def places_of(text, piece=1000, step_ms=10, steps=60):
    """Return every position that Gps reads from this text, each as a list."""
    with Board(level):
        from kickstand.speed.gps import Gps

        gps = Gps(Listing(text.encode(), piece))
        found = []
        for i in range(steps):
            gps.poll(1000 + step_ms * i)
            place = gps.place(1000 + step_ms * i)
            if place is not None:
                found.append(list(place))
    return found


def rmc(lat="4807.038,N", lon="01131.000,E", time="120000.00", date="211126", status="A", knots="19.438", mode=",A"):
    return sentence(",".join(["GPRMC", time, status, lat, lon, knots, "084.4", date, "003.1", "W" + mode]))


def test_all_four_quarters_of_the_earth_to_two_centimetres():
    for north, lat in (("N", 1), ("S", -1)):
        for east, lon in (("E", 1), ("W", -1)):
            (place,) = places_of(rmc("4807.03801," + north, "01131.00009," + east))
            assert place == [DAY, NOON, lat * 288703801, lon * 69100009]
    assert places_of(rmc("0000.00000,S", "00000.00001,W"))[0][2:] == [0, -1]
    assert places_of(rmc("9000.00000,S", "18000.0000,W")) == []  # 180 degrees is reported as 179°59.99999'
    assert places_of(rmc("8959.99999,S", "17959.99999,W"))[0][2:] == [-539999999, -1079999999]


def test_as_many_digits_as_a_receiver_sends():
    for digits, part in (("0", 0), ("03", 3000), ("0381", 3810), ("03812", 3812), ("0381299", 3812), ("", 0)):
        assert places_of(rmc("4807." + digits + ",N"))[0][2] == 288700000 + part


def test_an_invalid_position_is_none_and_does_no_harm():
    for lat in (",", ",N", "4807038,N", "48:07.038,N", "-4807.03,N", "4807.0.38,N", "9" * 30 + ".0,N", "nan,N"):
        assert places_of(rmc(lat)) == [], lat
    assert places_of(rmc(lon=",")) == []
    assert places_of(rmc(status="V")) == []
    assert places_of(rmc(mode=",N")) == []
    assert places_of(rmc(mode=",E")) == []
    assert places_of(sentence("GPRMC,,V,,,,,,,,,,N")) == []
    assert places_of(sentence("GPRMC,120000.00,A,4807.038,N,01131.000,E,19.4"))[0][0] == 0  # the sentence has no date
    assert places_of(sentence("GPVTG,84.4,T,,M,19.438,N,36.0,K,A")) == []
    assert places_of(rmc() + rmc(), step_ms=10) == places_of(rmc())  # a repeated fix gives no second position


def test_a_date_that_is_not_known_yet_is_0():
    for date in ("", "xx1126", "0x1126", "311299"):  # a date in 1999 is too old to be right
        assert places_of(rmc(date=date))[0][:2] == [0, NOON]
    assert places_of(rmc(date="311226"))[0][0] == 26 << 9 | 12 << 5 | 31


def test_midnight_and_ten_a_second():
    times = ["235959.%d0" % k for k in range(5, 10)] + ["000000.%d0" % k for k in range(5)]  # noqa: UP031 MicroPython
    dates = ["311226"] * 5 + ["010127"] * 5
    text = "".join([rmc("4807.0000%d,N" % k, time=times[k], date=dates[k]) for k in range(10)])  # noqa: UP031
    found = places_of(text, 40, 50, 60)
    assert [place[2] - 288700000 for place in found] == list(range(10))
    assert [place[1] for place in found] == [86399500 + 100 * k for k in range(5)] + [100 * k for k in range(5)]
    last, first = 26 << 9 | 12 << 5 | 31, 27 << 9 | 1 << 5 | 1
    assert [place[0] for place in found] == [last] * 5 + [first] * 5


def test_an_old_position_is_not_returned_as_new():
    """No position is returned while only VTG arrives, nor after a silence that ends without a fix."""
    with Board(level):
        from kickstand.speed.gps import Gps

        gps = Gps(Listing(rmc().encode()))
        assert [gps.poll(ms) is None for ms in (990, 1000)] == [True, False]  # each poll reads 64 bytes
        assert gps.place(1000) is not None
        assert gps.place(1010) is None
        gps._uart = Listing(sentence("GPVTG,84.4,T,,M,19.438,N,36.0,K,A").encode())
        assert gps.poll(5000) is not None  # there was no RMC for 4 s
        assert gps.place(5000) is None
        gps._uart = Listing(rmc(time="120005.00").encode())
        assert [gps.poll(ms) is None for ms in (5990, 6000)] == [True, False]
        for ms in (7000, 8000, 9000, 10000):  # only VTG arrives, whose speed is used if the last RMC is 3 s old
            gps._uart = Listing(sentence("GPVTG,84.4,T,,M,19.438,N,36.0,K,A").encode())
            assert (gps.poll(ms) is None) == (ms < 9000), ms
            assert gps.place(ms) is None, ms
        gps._uart = Listing(rmc(time="120011.00").encode())
        assert [gps.poll(ms) is None for ms in (11990, 12000)] == [True, False]
        gps._uart = Listing(b"$GP")
        assert gps.poll(20000) is None
        assert gps.place(20000) is None


def test_a_wheel_has_no_place():
    with Board(level):
        from kickstand.speed.wheel import Wheel
        from machine import Pin  # type: ignore[import-not-found]

        assert Wheel(Pin(14, Pin.IN, Pin.PULL_UP), 0.5, {"hard": True}).place(1000) is None
