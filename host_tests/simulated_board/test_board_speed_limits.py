"""Where the limits of the speed sources are, met from both sides. Runs on MicroPython too."""

from board_access import level
from kickstand_tools.simulated_board.gps import sentence
from kickstand_tools.simulated_board.simulator import Board


class Wire:
    """A UART to which bytes are sent; it gives them all at once, or a piece at a time."""

    def __init__(self, piece=1000):
        self.data = b""
        self.piece = piece
        self.largest = 0  # of the reads

    def any(self):
        return min(self.piece, len(self.data))

    def read(self, nbytes):
        self.largest = max(self.largest, nbytes)
        data, self.data = self.data[:nbytes], self.data[nbytes:]
        return data or None


def rmc(time="120001.00", knots="19.438", status="A", mode=",A"):
    return sentence(
        "GPRMC," + time + "," + status + ",4807.038,N,01131.000,E," + knots + ",084.4,230394,003.1,W" + mode
    )


def vtg(mode=",A"):
    return sentence("GPVTG,84.4,T,,M,19.438,N,36.0,K" + mode)


def receiver(piece=1000):
    from kickstand.speed.gps import Gps

    wire = Wire(piece)
    return wire, Gps(wire)


def hear(wire, gps, text, at_ms):
    """The speed in mm/s that comes of this text, all at one time; None if none does."""
    wire.data += text.encode()
    found = None
    while wire.any():
        speed = gps.poll(at_ms)
        if speed is not None:
            found = round(1000 * speed)
    return found


def hear_none(wire, gps, text, at_ms):
    """No speed in this text can be used: what a Gps gives for it, Speed refuses."""
    from kickstand.speed.source import Speed

    wire.data += text.encode()
    speed = Speed(gps)
    while wire.any():
        assert speed.poll(at_ms) is None, text


def test_a_speed_that_is_estimated_or_not_valid_is_none():
    with Board(level):
        for mode, expected in ((",A", 10000), (",D", 10000), ("", 10000), (",E", None), (",N", None)):
            assert hear(*receiver(), vtg(mode), 1000) == expected, mode
            assert hear(*receiver(), rmc(mode=mode), 1000) == expected, mode


def test_vtg_has_knots_or_kilometres_an_hour():
    with Board(level):
        for fields, expected in (
            ("19.438,N,,K", 10000),
            ("19.438,N,99.9,K", 10000),
            (",N,36.0,K", 10000),
            ("99.9,X,36.0,K", 10000),
            ("99.9,X,36.0,X", None),
            (",N,36.0,X", None),
            (",N,,K", None),
        ):
            assert hear(*receiver(), sentence("GPVTG,84.4,T,,M," + fields + ",A"), 1000) == expected, fields


def test_vtg_counts_once_no_rmc_has_come_for_three_seconds():
    with Board(level):
        wire, gps = receiver()
        assert hear(wire, gps, rmc(), 1000) == 10000
        assert hear(wire, gps, vtg(), 3999) is None
        assert hear(wire, gps, vtg(), 4000) == 10000
        assert gps.age_ms == 0
        assert hear(wire, gps, rmc(status="V"), 5000) is None  # it sends RMC again, though it has no fix
        assert hear(wire, gps, vtg(), 6000) is None


def test_numbers_that_no_receiver_sends_are_no_speed_and_the_next_sentence_counts():
    """Each with a right checksum: too large for a float, which a board's is at 3e38, not a number, none at all."""
    with Board(level):
        for time in ("1200011e999", "12351e39", "1200inf", "1200nan", "12000-1e999", "1200e", "12:00:01", "-99999.0"):
            wire, gps = receiver()
            hear(wire, gps, rmc(time), 1000)
            assert hear(wire, gps, rmc("120002.00"), 2000) == 10000, time
        for knots in ("1e999", "inf", "nan", "-inf", "e", "1e"):
            wire, gps = receiver()
            hear_none(wire, gps, rmc(knots=knots), 1000)
            hear_none(wire, gps, sentence("GPVTG,84.4,T,,M," + knots + ",N,36.0,K,A"), 9000)
            assert hear(wire, gps, rmc("120010.00"), 10_000) == 10000, knots


def long_rmc(length):
    """A sentence of so many bytes up to its end of line."""
    short = len(rmc(knots="19.438").rstrip())
    return rmc(knots="19.438" + "0" * (length - short))


def test_a_sentence_may_have_100_bytes():
    """The standard says 82. What is longer has lost the end of its line."""
    with Board(level):
        for length, expected in ((90, 10000), (100, 10000), (101, None), (130, None)):
            text = long_rmc(length)
            assert len(text.rstrip()) == length
            assert hear(*receiver(piece=1), text.replace("\r", ""), 1000) == expected, length
        for piece in (1, 40, 1000):
            wire, gps = receiver(piece)
            assert hear(wire, gps, "x" * 250 + rmc(), 1000) == 10000
            assert hear(wire, gps, rmc("120002.00")[:-2] + "$" + "y" * 30, 2000) is None
            assert hear(wire, gps, "z" * 60 + rmc("120003.00"), 3000) == 10000


def test_a_turn_of_the_loop_reads_64_bytes_at_most():
    with Board(level):
        wire, gps = receiver()
        wire.data = 3 * rmc().encode()
        before = len(wire.data)
        gps.poll(1000)
        assert before - len(wire.data) == 64
        hear(wire, gps, "", 1010)
        assert wire.largest == 64
        wire.data = b"abc"
        gps.poll(1020)
        assert wire.data == b""


def fault(gps, at_ms):
    found = gps.fault(at_ms)
    return found and found.code


def test_after_three_seconds_it_is_said_what_is_missing():
    with Board(level):
        wire, gps = receiver()
        assert fault(gps, 99_000) is None  # it has not been asked yet
        gps.poll(1000)
        assert fault(gps, 4000) is None
        assert fault(gps, 4001) == "gps-silent"
        hear(wire, gps, "\x00\r\n", 2000)
        assert fault(gps, 4000) is None
        assert fault(gps, 4001) == "gps-garbled"
        hear(wire, gps, rmc(status="V"), 3000)
        assert fault(gps, 4000) is None
        assert fault(gps, 4001) == "gps-no-fix"
        hear(wire, gps, rmc("120002.00"), 3500)
        assert fault(gps, 6500) is None
        assert fault(gps, 6501) == "gps-silent"  # the first reason in the way from wire to fix
        hear(wire, gps, "\n", 6400)
        assert fault(gps, 6501) == "gps-garbled"
        hear(wire, gps, vtg(), 6600)
        assert fault(gps, 9600) is None


def test_a_fix_may_be_two_seconds_late():
    with Board(level):
        for late_ms, speed in ((0, 10000), (1, 10000), (2000, 10000), (2001, None), (4999, None)):
            wire, gps = receiver()
            assert hear(wire, gps, rmc("120001.00"), 1000) == 10000
            assert gps.age_ms == 0
            assert hear(wire, gps, rmc("120002.00"), 2000 + late_ms) == speed, late_ms
            assert gps.age_ms == late_ms


def test_a_fix_that_is_early_or_over_five_seconds_late_sets_the_clock():
    with Board(level):
        for late_ms in (-1, -500, 5000, 100_000):
            wire, gps = receiver()
            assert hear(wire, gps, rmc("120101.00"), 100_000) == 10000
            assert hear(wire, gps, rmc("120111.00"), 110_000 + late_ms) == 10000, late_ms
            assert gps.age_ms == 0
            assert hear(wire, gps, rmc("120112.25"), 111_250 + late_ms + 30) == 10000
            assert gps.age_ms == 30


def test_minutes_hours_and_parts_of_a_second_count():
    with Board(level):
        for later, step_ms in (("120101.00", 60_000), ("130001.00", 3_600_000), ("120001.70", 700), ("120001.079", 79)):
            wire, gps = receiver()
            assert hear(wire, gps, rmc("120001.00"), 1000) == 10000
            assert hear(wire, gps, rmc(later), 1000 + step_ms + 40) == 10000
            assert gps.age_ms == 40, later


def ages(delays, step_s=2):
    """age_ms of fixes that are late by so much, one each two seconds."""
    wire, gps = receiver()
    found = []
    for i, late_ms in enumerate(delays):
        second = step_s * i
        hear(wire, gps, rmc("1200" + str(10 + second) + ".00"), 100_000 + 1000 * second + late_ms)
        found.append(gps.age_ms)
    return found


def test_when_four_fixes_in_over_five_seconds_all_came_late_the_receiver_has_set_its_clock_back():
    """The smallest delay of them is the new zero."""
    with Board(level):
        assert ages([0, 900, 800, 850, 870, 900, 800]) == [0, 900, 800, 850, 870, 100, 0]
        assert ages([0, 900, 800, 850, 870, 900, 800], step_s=1) == [0, 900, 800, 850, 870, 900, 0]
        assert ages([0, 900, 0, 850, 870, 900, 800, 850]) == [0, 900, 0, 850, 870, 900, 800, 50]


class Source:
    age_ms = 40
    stalled_ms = None

    def __init__(self, speeds):
        self.speeds = speeds

    def poll(self, now_ms):
        return self.speeds.get(now_ms)

    def after_stall(self, now_ms):
        self.stalled_ms = now_ms

    def fault(self, now_ms):
        return "fault at " + str(now_ms)


def test_the_source_is_told_of_a_stall_and_asked_for_its_fault():
    with Board(level):
        from kickstand.speed.source import Speed

        source = Source({})
        speed = Speed(source)
        assert speed.age_us == 0
        speed.after_stall(1234)
        assert source.stalled_ms == 1234
        assert speed.fault(2345) == "fault at 2345"


def accepted(*speeds):
    """Of (ms, m/s), ...: which of them are taken."""
    from kickstand.speed.source import Speed

    speed = Speed(Source(dict(speeds)))
    found = [speed.poll(at_ms) is not None for at_ms, _ in speeds]
    assert not any(found) or speed.age_us == 40_000
    return found


def test_no_speed_is_below_zero_or_over_100_mps():
    with Board(level):
        for value, taken in ((0.0, True), (-0.001, False), (100.0, True), (100.01, False), (float("nan"), False)):
            assert accepted((1000, value)) == [taken], value
        assert accepted((1000, None)) == [False]


def test_no_vehicle_changes_its_speed_by_more_than_15_mps2():
    """And 2 m/s of noise."""
    with Board(level):
        for value, taken in ((47.0, True), (47.1, False), (13.0, True), (12.9, False)):
            assert accepted((1000, 30.0), (2000, value)) == [True, taken], value
        assert accepted((1000, 30.0), (1500, 39.4), (2000, 48.0)) == [True, True, True]
        assert accepted((1000, 30.0), (1100, 33.6), (1200, 33.0)) == [True, False, True]


def test_after_three_seconds_of_refused_speeds_the_last_accepted_one_was_wrong():
    with Board(level):
        assert accepted((1000, 0.0), (2000, 90.0), (3999, 90.0), (4000, 90.0)) == [True, False, False, True]
