"""A GPS receiver: its sentences, positions, time of day, delays and faults. Also runs on MicroPython."""

from kickstand_sim.simulated_board.gps import sentence
from kickstand_sim.simulated_board.simulator import Board
from speed_runs import Wire, drive
from support.board_access import level

DATE = 26 << 9 | 11 << 5 | 21  # 21 November 2026, in the form of Gps.place()
NOON_MS = 12 * 3600 * 1000
VTG = sentence("GPVTG,84.4,T,,M,19.438,N,36.0,K,A")


def rmc(lat="4807.038,N", lon="01131.000,E", time="120000.00", date="211126", **other):
    """Return an RMC. other: talker, status, knots, and mode with the later fields."""
    talker, status, knots = (other.get(*pair) for pair in (("talker", "GP"), ("status", "A"), ("knots", "19.438")))
    fields = [talker + "RMC", time, status, lat, lon, knots, "084.4", date, "003.1", "W" + other.get("mode", ",A")]
    return sentence(",".join(fields))


def fixes(text, piece=1000, step_ms=10, steps=60):
    """Return (speed in mm/s, position or None) of each speed that Gps reads in these polls."""
    with Board(level):
        from kickstand.speed.gps import Gps

        gps = Gps(Wire(text if isinstance(text, bytes) else text.encode(), piece))
        result = []
        for now_ms in range(1000, 1000 + step_ms * steps, step_ms):
            speed, position = gps.poll(now_ms), gps.place(now_ms)
            assert speed is not None or position is None
            if speed is not None:
                result.append((round(1000 * speed), position and list(position)))
    return result


def speeds(text, *polls):
    return [speed for speed, _ in fixes(text, *polls)]


def test_speed_of_each_sentence_of_any_system_and_version():
    for talker in ("GP", "GN", "GL", "GA", "BD", "GB"):
        assert speeds(rmc(talker=talker)) == [10000]
    for mode in ("", ",A", ",D,V"):
        assert speeds(rmc(mode=mode)) == [10000]
    assert speeds(rmc(knots="0.000")) == [0]
    for fields, speed in (
        ("19.438,N,,K", [10000]),
        ("19.438,N,99.9,K,A", [10000]),
        (",N,36.0,K,D", [10000]),
        ("99.9,X,36.0,K", [10000]),
        ("99.9,X,36.0,X", []),
        (",N,,K", []),
        ("19.438,N,36.0,K,N", []),
        ("19.438,N,36.0,K,E", []),
    ):
        assert speeds(sentence("GPVTG,84.4,T,,M," + fields)) == speed, fields


def test_a_fix_that_is_not_valid_gives_nothing():
    void = rmc(status="V", mode=",N")
    for text in (void, rmc(mode=",N"), rmc(mode=",E"), rmc(knots=""), sentence("GPRMC,,V,,,,,,,,,,N"), void + VTG):
        assert fixes(text) == [], text
    assert speeds(5 * rmc()) == [10000]  # a repeated fix is not new
    assert speeds(rmc() + VTG) == [10000]  # the VTG repeats the speed of the RMC


def test_damaged_lines_are_refused_and_the_next_is_read():
    good, next_one = rmc(), rmc(time="120001.00", knots="9.719")
    for k in range(len(good) - 2):
        bad = good[:k] + chr(ord(good[k]) ^ 1) + good[k + 1 :]
        # A sentence whose talker is damaged is still read. Every speed that is read is true.
        assert speeds(bad + next_one, 37) in ([5000], [10000, 5000]), bad
        assert (10000 in speeds(bad)) <= (k in (1, 2)), bad
        if 0 < k < len(good) - 3:  # without its beginning, or without its end
            assert speeds(good[k:] + next_one) == speeds(good[:k] + next_one) == [5000]
    assert speeds("$" * 1000 + good) == [10000]
    assert speeds("\x00\xff".encode() * 500 + b"\n" + good.encode()) == [10000]


def test_sentences_may_arrive_in_any_pieces():
    text = "".join([rmc(time="12000%d.00" % k, knots="%.3f" % (k * 1.9438)) for k in range(1, 6)])  # noqa: UP031
    for piece in (1, 7, 64, 500):
        assert speeds(text, piece, 1, 500) == [1000, 2000, 3000, 4000, 5000]


def test_all_four_quarters_of_the_earth_to_two_centimetres():
    for north, lat in (("N", 1), ("S", -1)):
        for east, lon in (("E", 1), ("W", -1)):
            ((_, position),) = fixes(rmc("4807.03801," + north, "01131.00009," + east))
            assert position == [DATE, NOON_MS, lat * 288703801, lon * 69100009]
    for lat, lon, units in (
        ("0000.00000,S", "00000.00001,W", [0, -1]),
        ("8959.99999,S", "17959.99999,W", [-539999999, -1079999999]),
    ):
        assert fixes(rmc(lat, lon))[0][1][2:] == units
    for digits, part in (("0", 0), ("03", 3000), ("0381", 3810), ("03812", 3812), ("0381299", 3812), ("", 0)):
        assert fixes(rmc("4807." + digits + ",N"))[0][1][2] == 288700000 + part


def test_the_time_of_day_in_ms():
    """The last of these times is a leap second."""
    times = "000000.00 000009.90 000050.00 000700.00 004000.00 090000.00 200000.00 123456.78 123456 235959.99 235960.00"
    for time in times.split():
        seconds = 3600 * int(time[:2]) + 60 * int(time[2:4]) + float(time[4:])
        assert fixes(rmc(time=time))[0][1][1] == round(1000 * seconds), time
    for time in ("", "12", "1200xx.00", "-12000.00", "250000.00", "120000.0.0"):
        assert fixes(rmc(time=time)) == [], time


def test_dates_of_the_calendar_and_0_for_others():
    for date in "311226 310726 310826 300426 290228 010125 311279".split():
        day, month, year = int(date[:2]), int(date[2:4]), int(date[4:])
        assert fixes(rmc(date=date))[0][1][:2] == [year << 9 | month << 5 | day, NOON_MS], date
    for date in "230394 060180 311224 310226 290227 310426 000026 321226 311326 010026 -10126 xx1126 0x1126".split():
        assert fixes(rmc(date=date))[0][1][:2] == [0, NOON_MS], date
    no_date = fixes(sentence("GPRMC,120000.00,A,4807.038,N,01131.000,E,19.438"))[0]
    assert fixes(rmc(date=""))[0] == no_date == (10000, [0, NOON_MS, 288703800, 69100000])


def hear(gps, wire, text, at_ms):
    """Poll twice, because one poll reads a part of the sentence. Return the speed or None."""
    wire.data = text.encode()
    first, second = gps.poll(at_ms), gps.poll(at_ms)
    return second if first is None else first


def test_a_delayed_fix_is_rejected_or_has_its_age():
    with Board(level):
        from kickstand.speed.gps import Gps

        wire = Wire()
        gps = Gps(wire)
        for second, at_ms, age_ms in (
            (1, 1300, 0),
            (2, 2200, 0),
            (3, 3700, 500),
            (4, 6700, None),  # the fix is 2.5 s late
            (7, 7210, 10),
            (30, 8210, 0),  # the receiver has corrected its clock
            (31, 9210, 0),
        ):
            speed = hear(gps, wire, rmc(time=f"1200{second:02}.00"), at_ms)
            assert (None if speed is None else gps.age_ms) == age_ms, second


def test_faults_of_the_receiver_are_reported_and_end():
    for kind, line in (
        ("unplugged", "GPS silent"),
        ("void", "GPS: no fix"),
        ("stuck", "GPS: no fix"),
        ("garbled", "GPS garbled"),
    ):
        faults = [[kind, 10.0, 20.0]]
        speeds, lines = drive({"SPEED": "gps"}, lambda board, f=faults: board.fit_gps(lambda t_s: 15.0, faults=f), 30.0)
        assert lines[9] is lines[12] is lines[25] is None and lines[14][0] == lines[18][0] == line, kind
        assert not [t_s for t_s, _, _ in speeds if 11.5 < t_s < 20.0] and speeds[-1][0] > 29.0
        assert all(abs(speed - 15.0) < 0.01 for _, speed, _ in speeds)
    _, lines = drive({"SPEED": "gps"}, lambda board: None, 6.0)
    assert lines[1] is None and lines[5] == ("GPS silent", "check wiring")
    speeds, lines = drive({"SPEED": "gps", "GPS_BAUD": 38400}, lambda board: board.fit_gps(lambda t_s: 15.0), 6.0)
    assert speeds == [] and lines[5] == ("GPS garbled", "check GPS_BAUD")


def fault_of(data, seconds=8):
    """Return the code and the values of the fault of a receiver that sends these bytes once per second."""
    with Board(level):
        from kickstand.speed.gps import Gps

        wire = Wire()
        gps = Gps(wire)
        for tenth in range(10 * seconds):
            wire.data = data if tenth % 10 == 0 else wire.data
            gps.poll(1000 + 100 * tenth)
        fault = gps.fault(1000 + 100 * 10 * seconds - 100)
    return fault and (fault.code,) + tuple(fault.values)


def test_a_receiver_that_sends_something_else_is_named():
    gga, gll, gsv = [
        sentence(body).encode()
        for body in (
            "GPGGA,120001.00,4807.038,N,01131.000,E,1,08,0.9,545.4,M,46.9,M,,",
            "GNGLL,4807.038,N,01131.000,E,120001.00,A,A",
            "GPGSV,1,1,01,21,00,000,33",
        )
    ]
    for data, name in (
        (gga, "GGA"),
        (gll + gsv, "GLL"),
        (gsv + gga + gsv, "GGA"),
        (gsv, "GSV"),
        (sentence("PUBX,00,1,2").encode(), "PUBX"),
        # A NAV-PVT of 92 bytes, which may contain line ends and the beginnings of sentences
        (b"\xb5b\x01\x07\x5c\x00" + b"\x00" * 92 + b"\x12\x34", "UBX"),
        (b"\xb5b\x01\x07\x5c\x00" + b"\x0a" * 92 + b"\x12\x34", "UBX"),
        (b"\xb5b\x01\x07\x5c\x00" + b"\x24" * 92 + b"\x12\x34", "UBX"),
    ):
        assert fault_of(data) == ("gps-other", name), data
    assert fault_of(gga.replace(b"545", b"546")) == fault_of(bytes(range(256))) == ("gps-garbled",)
    assert fault_of(gga + rmc(status="V").encode()) == ("gps-no-fix",)


def test_a_fast_receiver_with_many_satellites_loses_no_speed():
    """At 115,200 baud 115 bytes arrive per pass, and the buffer has 2304 bytes. A pass may take 0.15 s."""
    gsv = [sentence("GPGSV,10,%d,40,01,40,083,46,02,17,308,41,12,07,344,39,14,22,228,45,1" % k) for k in range(1, 11)]  # noqa: UP031
    for hz, count in ((1, 14), (10, 8)):
        for first in (0, count):  # RMC before and after the satellites
            with Board(level):
                from kickstand.speed.gps import Gps

                wire, pending, fixes_read = Wire(), [], 0
                gps = Gps(wire)
                for turn in range(1000):
                    if turn % (100 // hz) == 0:
                        second, part = divmod(turn, 100)
                        bodies = (gsv + gsv)[:count]
                        bodies.insert(first, rmc(time=f"1200{second:02}.{part:02}"))
                        pending.append("".join(bodies).encode())
                    line = b"".join(pending)
                    wire.data, pending = (wire.data + line[:115])[:2304], [line[115:]]
                    if turn % 200 > 15:  # a stall of 0.15 s every 2 s
                        fixes_read += gps.poll(1000 + 10 * turn) is not None
                assert fixes_read >= 0.9 * 10 * hz, (hz, first, fixes_read)
