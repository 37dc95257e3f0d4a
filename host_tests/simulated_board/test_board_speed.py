"""Speed from GPS and wheel: the firmware's drivers on the simulated board. Runs on MicroPython too."""

from kickstand_tools.simulated_board.gps import sentence
from kickstand_tools.simulated_board.simulator import Board
from support.board_access import level

STEP_US = 10_000


class Listing:
    """A UART that delivers these bytes, at most `piece` bytes per read."""

    def __init__(self, data, piece=1000):
        self._data = data
        self._piece = piece

    def any(self):
        return min(self._piece, len(self._data))

    def read(self, nbytes):
        data, self._data = self._data[:nbytes], self._data[nbytes:]
        return data or None


def speeds_of(text, piece=1000, step_ms=10, steps=60):
    """Return every speed that Gps reads from this text, in mm/s."""
    with Board(level):
        from kickstand.speed.gps import Gps

        gps = Gps(Listing(text if isinstance(text, bytes) else text.encode(), piece))
        found = [gps.poll(1000 + step_ms * i) for i in range(steps)]
    return [round(1000 * speed) for speed in found if speed is not None]


def busy_with_transfers():
    """Return turn(number), which simulates an ESP32's SoftI2C transfers. Call turn(number) in each pass of the loop.

    The sensor's transfer takes 1.3 ms in each pass. The display's transfers take 12 ms every 100 ms.
    """
    from machine import Pin, SoftI2C  # type: ignore[import-not-found]

    sensor = SoftI2C(Pin(22), Pin(21), freq=250_000)
    lcd = SoftI2C(Pin(19), Pin(18), freq=100_000)
    frames, line = bytearray(30), bytes(68)

    def turn(number):
        sensor.readfrom_mem_into(0x68, 0x74, frames)
        if number % 10 < 2:
            lcd.writeto(0x27, line)

    return turn


def drive(config, fit, until_s, port="rp2"):
    """Run the firmware's Speed. On an ESP32, transfers to sensor and display run at the same time.

    Returns:
        speeds: [(t_s, speed in m/s, age_us), ...].
        faults: {t_s: the fault's lines on the display, or None}, one per second.
    """
    board = Board(level, port=port)
    fit(board)
    got, faults = [], {}

    def firmware():
        from time import sleep_us, ticks_ms  # type: ignore[attr-defined]

        from kickstand.board import port as of_board
        from kickstand.settings import Settings
        from kickstand.speed import source
        from kickstand.ui.messages import lines

        class Config:
            pass

        for name, value in [("WHEEL_PIN", board.wheel_pin)] + list(config.items()):
            setattr(Config, name, value)
        hard, of_board.PIN_IRQ = of_board.PIN_IRQ, {"hard": True} if port == "rp2" else {}
        speed = source.open_speed(Settings(Config))
        of_board.PIN_IRQ = hard
        transfer = busy_with_transfers() if port == "esp32" else lambda number: None
        turn = 0
        while True:
            transfer(turn)
            new = speed.poll(ticks_ms())
            if new is not None:
                got.append((board.clock.now_us / 1e6, new, speed.age_us))
            if turn % 100 == 0:
                fault = speed.source.fault(ticks_ms())
                faults[turn // 100] = None if fault is None else lines(fault)
            turn += 1
            sleep_us(STEP_US - board.clock.now_us % STEP_US)

    with board:
        board.run(firmware, until_s)
    return got, faults


def constant(t_s):
    return 15.0


RMC = "%sRMC,1200%02d.00,%s,4807.038,N,01131.000,E,%s,084.4,230394,003.1,W%s"


def test_speed_of_a_sentence_in_any_system_and_any_version():
    for talker in ("GP", "GN", "GL", "GA", "BD", "GB"):
        assert speeds_of(sentence(RMC % (talker, 1, "A", "19.438", ",A"))) == [10000]
    assert speeds_of(sentence(RMC % ("GP", 1, "A", "0.000", ""))) == [0]
    assert speeds_of(sentence(RMC % ("GN", 1, "A", "19.438", ",D,V"))) == [10000]
    assert speeds_of(sentence("GPVTG,84.4,T,,M,,N,36.0,K")) == [10000]


def test_vtg_has_knots_or_kilometres_an_hour():
    for fields, expected in (
        ("19.438,N,,K", [10000]),
        ("19.438,N,99.9,K", [10000]),
        (",N,36.0,K", [10000]),
        ("99.9,X,36.0,K", [10000]),
        ("99.9,X,36.0,X", []),
        (",N,,K", []),
    ):
        assert speeds_of(sentence("GPVTG,84.4,T,,M," + fields + ",A")) == expected, fields


def test_a_turn_of_the_loop_reads_64_bytes_at_most():
    with Board(level):
        from kickstand.speed.gps import Gps

        wire = Listing(200 * b"x")
        Gps(wire).poll(1000)
        assert wire.any() == 136


def test_an_invalid_fix_gives_no_speed():
    assert speeds_of(sentence(RMC % ("GP", 1, "V", "19.438", ",N"))) == []
    assert (
        speeds_of(sentence(RMC % ("GP", 1, "A", "19.438", ",E"))) == []
    )  # mode E: the receiver extrapolates its last fix
    assert speeds_of(sentence("GPRMC,,V,,,,,,,,,,N")) == []
    assert speeds_of(sentence(RMC % ("GP", 1, "A", "", ",A"))) == []
    assert speeds_of(sentence("GPVTG,,,,,,,,,N")) == []
    void = sentence(RMC % ("GP", 1, "V", "", ",N"))
    assert speeds_of(void + sentence("GPVTG,84.4,T,,M,19.438,N,36.0,K,A")) == []  # VTG does not replace a void RMC


def test_damaged_lines_are_refused_and_the_next_is_read():
    good = sentence(RMC % ("GP", 1, "A", "19.438", ",A"))
    later = sentence(RMC % ("GP", 2, "A", "9.719", ",A"))
    for at in range(len(good) - 2):
        bad = good[:at] + chr(ord(good[at]) ^ 1) + good[at + 1 :]
        assert speeds_of(bad + later, piece=37) in ([5000], [10000, 5000]), bad
        # A sentence whose first two letters are damaged is still read. Every speed that is read is true.
        assert (10000 in speeds_of(bad)) <= (at in (1, 2)), bad
    for at in range(1, len(good) - 3):
        assert speeds_of(good[at:] + later) == [5000]  # the beginning of the first sentence is missing
        assert speeds_of(good[:at] + later) == [5000]  # the end of the first sentence is missing
    assert speeds_of("$" * 1000 + good) == [10000]
    assert speeds_of("\x00\xff".encode() * 500 + b"\n" + good.encode()) == [10000]


def test_sentences_may_arrive_in_any_pieces():
    text = "".join(sentence(RMC % ("GP", i, "A", "%.3f" % (i * 1.9438), ",A")) for i in range(1, 6))
    for piece in (1, 7, 64, 500):
        assert speeds_of(text, piece, 1, 500) == [1000, 2000, 3000, 4000, 5000]


def test_the_same_fix_again_is_not_new():
    assert speeds_of(sentence(RMC % ("GP", 1, "A", "19.438", ",A")) * 5) == [10000]


def test_a_delayed_fix_is_rejected_or_has_its_age():
    with Board(level):
        from kickstand.speed.gps import Gps

        def hear(gps, second, at_ms):
            gps._uart = Listing(sentence(RMC % ("GP", second, "A", "19.438", ",A")).encode(), 64)
            heard = [gps.poll(at_ms), gps.poll(at_ms)]
            return [x is not None for x in heard if x is not None], gps.age_ms

        gps = Gps(Listing(b""))
        assert hear(gps, 1, 1300) == ([True], 0)
        assert hear(gps, 2, 2200) == ([True], 0)
        assert hear(gps, 3, 3700) == ([True], 500)
        assert hear(gps, 4, 6700)[0] == []  # the fix is 2.5 s late
        assert hear(gps, 7, 7210) == ([True], 10)
        assert hear(gps, 30, 8210) == ([True], 0)  # the receiver has corrected its clock
        assert hear(gps, 31, 9210) == ([True], 0)


def test_a_receiver_whose_clock_jumps_is_late_for_seconds_only():
    with Board(level):
        from kickstand.speed.gps import Gps

        for jump in (-6, -5, -4, -3, -2, -1, 1, 2, 3, 4, 5, 6):
            gps = Gps(Listing(b""))
            for i in range(30):
                second = 10 + i + (jump if i >= 10 else 0)
                gps._uart = Listing(sentence(RMC % ("GP", second, "A", "19.438", ",A")).encode())
                at_ms = 1000 * i + 20 * (i % 3)
                heard = [gps.poll(at_ms), gps.poll(at_ms)]  # each poll reads a part of the sentence
                if i < 10 or i >= 22 or jump > 0:
                    assert heard[1] is not None, (jump, i)
                    assert 0 <= gps.age_ms <= 40, (jump, i, gps.age_ms)


def gps_faults(kind, from_s, until_s):
    faults = [[kind, from_s, until_s]]
    return drive({"SPEED": "gps"}, lambda b: b.fit_gps(constant, faults=faults), 30.0)


def test_gps_faults_are_reported_and_end():
    for kind, text in (
        ("unplugged", "GPS silent"),
        ("void", "GPS: no fix"),
        ("stuck", "GPS: no fix"),
        ("garbled", "GPS garbled"),
    ):
        got, faults = gps_faults(kind, 10.0, 20.0)
        assert faults[9] is None and faults[25] is None, kind
        assert faults[18][0] == text, (kind, faults[18])
        assert not [t for t, _, _ in got if 11.5 < t < 20.0], kind
        assert all(abs(speed - 15.0) < 0.01 for _, speed, _ in got)


def test_no_receiver_and_a_wrong_baud_rate():
    _, faults = drive({"SPEED": "gps"}, lambda b: None, 6.0)
    assert faults[1] is None and faults[5] == ("GPS silent", "check wiring")
    got, faults = drive({"SPEED": "gps", "GPS_BAUD": 38400}, lambda b: b.fit_gps(constant), 6.0)
    assert got == [] and faults[5] == ("GPS garbled", "check GPS_BAUD")


def ride(t_s):
    """Return the speed of a ride: standstill, 20 m/s, standstill."""
    return 0.0 if t_s < 5.0 or t_s > 45.0 else min(20.0, 2.0 * (t_s - 5.0), 4.0 * (45.0 - t_s))


def check_wheel(got, tolerance):
    # Before the first pulse there is no speed, because the wheel may be unplugged
    assert not [1 for t_s, _, _ in got if t_s < 5.0]
    for t_s, speed, age_us in got:
        true = ride(t_s - age_us / 1e6)
        assert abs(speed - true) < tolerance or true < 1.5 or t_s > 45.0, (t_s, speed, true)
    assert [speed for t_s, speed, _ in got if t_s > 49.0] and not any(s for t, s, _ in got if t > 49.0)


def test_wheel_pulses_slow_and_quick():
    for pulses in (0.5, 3.0, 24.0):
        config = {"SPEED": "wheel", "PULSES_PER_METRE": pulses}
        got, faults = drive(config, lambda b, p=pulses: b.fit_wheel(ride, pulses_per_metre=p), 55.0)
        check_wheel(got, 0.5)
        assert len([1 for t_s, _, _ in got if 15.0 < t_s < 40.0]) > 2.0 * 25.0
        assert faults[4] == ("Wheel: no pulse", "ride, or wiring?") and faults[20] is None


def test_a_contact_that_bounces_is_counted_once():
    got, _ = drive({"SPEED": "wheel"}, lambda b: b.fit_wheel(ride, bounce_us=2000), 55.0)
    check_wheel(got, 0.5)


def test_a_storm_of_pulses_is_reported_and_the_speed_returns():
    """The firmware disables the interrupt of the wheel for some time. The pulses of this test last twice as long, so
    they still come when the interrupt is enabled again."""
    for port, pulses_per_s in (("rp2", 50_000), ("esp32", 6_000)):

        def fit(board, pulses_per_s=pulses_per_s):
            board.fit_wheel(constant)
            board.faults.wheel_storm(10.0, 8.0, pulses_per_s)

        got, faults = drive({"SPEED": "wheel"}, fit, 25.0, port)
        assert faults[9] is None and faults[23] is None
        for second in range(11, 20):
            assert faults[second] == ("Wheel: noise", "check wiring"), second
        assert not [t for t, _, _ in got if 10.2 < t < 20.0]
        assert len([t for t, _, _ in got if t > 20.5]) > 20
        assert all(abs(speed - 15.0) < 0.5 for _, speed, _ in got)


def test_the_wheel_of_a_quick_vehicle_is_no_storm():
    config = {"SPEED": "wheel", "PULSES_PER_METRE": 50}
    got, faults = drive(config, lambda b: b.fit_wheel(lambda t_s: 70.0, pulses_per_metre=50), 3.0)
    assert faults[2] is None and len(got) > 20
    assert all(abs(speed - 70.0) < 1.0 for _, speed, _ in got)


def wheel_on_an_esp32(pulses_per_metre, speed_mps, seconds=21.0, **kind):
    """Return the mean of the speeds in 20 s, their standard deviation, and the faults."""
    config = {"SPEED": "wheel", "PULSES_PER_METRE": pulses_per_metre}

    def fit(board):
        board.fit_wheel(lambda t_s: speed_mps, pulses_per_metre=pulses_per_metre, **kind)

    got, faults = drive(config, fit, seconds, "esp32")
    found = [speed for t_s, speed, _ in got if t_s > 1.0]
    mean = sum(found) / max(1, len(found))
    return mean, (sum((speed - mean) ** 2 for speed in found) / max(1, len(found))) ** 0.5, faults


def test_an_esp32_counts_pulses_that_fall_into_a_transfer():
    """Interrupts wait during a transfer. If a contact closes and opens during a transfer, two interrupts see only the
    open contact."""
    for pulses, hz in ((0.5, 13.3), (3.0, 149.3), (50.0, 290.0)):
        mean, deviation, faults = wheel_on_an_esp32(pulses, hz / pulses)
        assert abs(mean * pulses - hz) < 0.025 * hz, (pulses, hz, mean)
        assert deviation < 0.1 * mean
        assert faults[20] is None


def test_a_contact_that_bounces_is_counted_once_on_an_esp32_too():
    """The contact may bounce during a transfer, at any speed and at any time in a pass of the loop."""
    for speed in (1.3, 7.77, 33.3):
        mean, _, _ = wheel_on_an_esp32(0.5, speed, bounce_us=2000)
        assert abs(mean - speed) < 0.01 * speed, (speed, mean)


def test_a_wheel_too_fast_for_an_esp32_is_reported():
    """The board loses some of the wheel's pulses. Without the report, the speed would be too low."""

    def speed_of(t_s):
        return 20.0 if 4.0 < t_s < 7.0 else 5.0

    for pulses in (20, 100):
        config = {"SPEED": "wheel", "PULSES_PER_METRE": pulses}
        got, faults = drive(config, lambda b, p=pulses: b.fit_wheel(speed_of, pulses_per_metre=p), 12.0, "esp32")
        assert faults[6] == ("Wheel: too quick", "fewer pulses/m"), pulses
        assert not [1 for t_s, _, _ in got if 4.4 < t_s < 7.0]
        slow = [speed for t_s, speed, _ in got if 1.0 < t_s < 4.0 or t_s > 8.0]
        assert (len(slow) > 50 and faults[3] is faults[10] is None) == (pulses < 60)
        assert all(abs(speed - 5.0) < 0.7 for speed in slow)


def test_jumps_that_no_vehicle_makes_are_refused_until_they_last():
    class Source:
        age_ms = 0
        speed = 0.0

        def poll(self, now_ms):
            return self.speed

    with Board(level):
        from kickstand.speed.source import Speed

        source = Source()
        speed = Speed(source)
        for at_ms, value, expected in (
            (0, 10.0, True),
            (1000, 18.0, True),
            (2000, 60.0, False),
            (3000, 19.0, True),
            (4000, -5.0, False),
            (4500, float("nan"), False),
            (5000, 200.0, False),
            (5500, 18.0, True),
            (6000, 70.0, False),
            (9000, 70.0, True),
        ):
            source.speed = value
            assert (speed.poll(at_ms) is not None) == expected, (at_ms, value)


def fault_of(data, seconds=8):
    """Return the code and the values of a Gps's fault if it gets these bytes once per second."""
    with Board(level):
        from kickstand.speed.gps import Gps

        wire = Listing(b"")
        gps = Gps(wire)
        for tenth in range(10 * seconds):
            if tenth % 10 == 0:
                wire._data = data
            gps.poll(1000 + 100 * tenth)
        fault = gps.fault(1000 + 100 * 10 * seconds - 100)
    return fault and (fault.code,) + tuple(fault.values)


GGA = "GPGGA,120001.00,4807.038,N,01131.000,E,1,08,0.9,545.4,M,46.9,M,,"
GLL = "GNGLL,4807.038,N,01131.000,E,120001.00,A,A"
GSV = "GPGSV,1,1,01,21,00,000,33"


def test_sentences_without_a_speed_are_named():
    for bodies, name in (((GGA,), "GGA"), ((GLL, GSV), "GLL"), ((GSV, GGA, GSV), "GGA"), ((GSV,), "GSV")):
        assert fault_of("".join([sentence(body) for body in bodies]).encode()) == ("gps-other", name), bodies
    assert fault_of(sentence("PUBX,00,1,2").encode()) == ("gps-other", "PUBX")
    damaged = sentence(GGA).replace("545", "546").encode()
    assert fault_of(damaged) == ("gps-garbled",)
    assert fault_of((sentence(GGA) + sentence(RMC % ("GP", 1, "V", "", ""))).encode()) == ("gps-no-fix",)


def test_u_blox_s_binary_protocol_is_named():
    """The message is a NAV-PVT of 92 bytes. The message's bytes may contain line ends anywhere."""
    for filler in (b"\x00", b"\x0a", b"\x24"):
        assert fault_of(b"\xb5b\x01\x07\x5c\x00" + filler * 92 + b"\x12\x34") == ("gps-other", "UBX")
    assert fault_of(bytes(range(256))) == ("gps-garbled",)


def test_an_impossible_date_is_0():
    dates = (
        ("230394", 0),
        ("211126", 26 << 9 | 11 << 5 | 21),
        ("060180", 0),
        ("220806", 0),
        ("310226", 0),
        ("000026", 0),
    )
    dates += (
        ("310426", 0),
        ("290228", 28 << 9 | 2 << 5 | 29),
        ("290227", 0),
        ("321226", 0),
        ("311226", 26 << 9 | 12 << 5 | 31),
    )
    dates += (
        ("311326", 0),
        ("", 0),
        ("-10126", 0),
        ("310726", 26 << 9 | 7 << 5 | 31),
        ("310826", 26 << 9 | 8 << 5 | 31),
    )
    with Board(level):
        from kickstand.speed.gps import Gps

        for text, value in dates:
            gps = Gps(Listing(sentence((RMC % ("GP", 1, "A", "19.438", "")).replace("230394", text)).encode()))
            assert [gps.poll(1000), gps.poll(1000)][1] is not None
            place = gps.place(1000)
            assert place is not None and place[0] == value, text


DAYS = 6.3, 9.0, 12.4, 12.5, 19.0


def later(days, seconds=0):
    """Return the value of ticks_ms() this time after it was 1000."""
    return (1000 + round(86_400_000 * days) + 1000 * seconds) & 0x3FFFFFFF


class Once:
    """A speed source that returns each value once."""

    age_ms, problem = 0, None

    def __init__(self, value):
        self.value = value

    def poll(self, now_ms):
        value, self.value = self.value, None
        return value


def test_a_speed_is_taken_after_days_without_one():
    """After 6.2 days ticks_diff() is negative."""
    with Board(level):
        from kickstand.speed.source import Speed

        for days in DAYS:
            source = Once(0.0)
            speed = Speed(source)
            assert speed.poll(1000) == 0.0
            for k in range(1, int(24 * days)):
                assert speed.poll(later(k / 24)) is None
            source.value = 20.0
            assert speed.poll(later(days)) == 20.0


def test_a_receiver_stays_silent_for_days():
    fix = sentence("GPRMC,120000.00,A,4807.038,N,01131.000,E,022.4,084.4,230394,003.1,W").encode()
    with Board(level):
        from kickstand.speed.gps import Gps

        for days in DAYS:
            uart = Listing(fix)
            gps = Gps(uart)
            while uart.any():
                gps.poll(1000)
            for k in range(1, int(24 * days)):
                gps.poll(later(k / 24))
                fault = gps.fault(later(k / 24))
                assert fault and fault.code == "gps-silent", (days, k)


def test_a_wheel_that_stood_for_days_turns_again():
    """The test also tries a wheel that has never turned before."""

    class Line:
        IRQ_FALLING = IRQ_RISING = 0

        def irq(self, *handler, **kind):
            pass

    with Board(level):
        from kickstand.speed.wheel import Wheel

        for before in (True, False):
            for days in DAYS:
                wheel = Wheel(Line(), 1.0, {"hard": True})
                wheel.poll(1000)
                if before:
                    wheel.count += 1
                    wheel.poll(1200)
                for k in range(1, int(24 * days)):
                    assert wheel.poll(later(k / 24)) == (0.0 if before else None)
                wheel.count += 1
                wheel.poll(later(days))
                assert wheel._moved_ms == later(days)
