"""A wheel's pulses, and the limits of any speed: periods, bounces, stops, storms. Also runs on MicroPython."""

from kickstand_sim.simulated_board.simulator import Board
from speed_runs import Contact
from support.board_access import level

notices = []  # of the last wheel


def on_wheel(test, pulses_per_metre=0.5, **irq):
    """Run test(wheel, contact, wait) with a wheel from time 0. wait(ms) lets time pass and returns ticks_ms()."""
    with Board(level) as board:
        from kickstand.speed.wheel import Wheel

        start_us = board.clock.now_us

        def wait(ms=0.0):
            board.clock.advance(round(1000 * ms))
            return (board.clock.now_us - start_us) // 1000

        contact = Contact()
        notices.clear()
        test(Wheel(contact, pulses_per_metre, irq or {"hard": True}, notices), contact, wait)


def pulse(contact, wait, every_ms=0.0, closed_ms=5.0):
    """Wait, so that pulses come every every_ms, and close the contact."""
    wait(max(0.0, every_ms - closed_ms))
    contact.set(0)
    wait(closed_ms)
    contact.set(1)


def test_speed_is_pulses_over_their_time():
    """At 0.5 pulses per metre, pulses every 200 ms are 10 m/s, and pulses every 250 ms are 8 m/s."""

    def test(wheel, contact, wait):
        assert wheel.poll(wait(100)) is None and wheel.fault(wait()).code == "no-pulse"
        pulse(contact, wait, 100)
        assert wheel.poll(wait()) is None and wheel.fault(wait()) is None  # no period yet
        for every_ms, count, mps in ((200, 1, 10.0), (250, 1, 8.0), (200, 3, 10.0)):
            for _ in range(count):
                pulse(contact, wait, every_ms)
            assert abs(wheel.poll(wait()) - mps) < 0.01
            # The mean of a period is half of the period old, and the last pulse is 5 ms old
            assert abs(wheel.age_ms - count * every_ms / 2 - 5) <= 1, wheel.age_ms
        assert wheel.poll(wait(99)) is None and wheel.place(wait()) is None

    on_wheel(test)


def test_reports_come_at_most_every_100_ms():
    def test(wheel, contact, wait):
        reports = []
        wheel.poll(wait())
        for _ in range(100):
            pulse(contact, wait, 30)
            if wheel.poll(wait()) is not None:
                reports.append(wait())
        gaps = {reports[k] - reports[k - 1] for k in range(1, len(reports))}
        assert gaps <= {120, 121}, gaps  # the first pulse after 100 ms

    on_wheel(test)


def test_a_wheel_stands_after_a_time_that_depends_on_its_pulses():
    """A wheel below 0.5 m/s counts as standing: after 2000 ms / pulses per metre, but 500 to 1800 ms."""
    for pulses_per_metre, stop_ms in ((0.5, 1800), (2.0, 1000), (50.0, 500)):

        def test(wheel, contact, wait, stop_ms=stop_ms):
            wheel.poll(wait())
            pulse(contact, wait, 150)
            wheel.poll(wait())
            pulse(contact, wait, 150)
            begin_ms = wait()
            assert wheel.poll(begin_ms) > 0.0
            zeros = []
            for _ in range(400):
                if wheel.poll(wait(10)) is not None:
                    zeros.append(wait() - begin_ms)
                    assert wheel.age_ms == stop_ms // 2
            assert zeros[:3] == [stop_ms, stop_ms + 200, stop_ms + 400]
            pulse(contact, wait, 20)
            assert wheel.poll(wait(100)) is None  # the pause is no period
            pulse(contact, wait, 150)
            assert wheel.poll(wait()) > 0.0

        on_wheel(test, pulses_per_metre)


def test_only_a_pulse_that_a_wheel_can_make_counts():
    """At 0.5 pulses per metre, 100 m/s are a pulse every 20 ms. An opening under 3 ms is a bounce."""
    for every_ms, open_ms, count in ((19, 10, 1), (21, 10, 2), (40, 2.9, 1), (40, 3.1, 2)):

        def test(wheel, contact, wait, every_ms=every_ms, open_ms=open_ms, count=count):
            wait(50)
            contact.set(0)
            wait(every_ms - open_ms)
            contact.set(1)
            wait(open_ms)
            contact.set(0)
            assert wheel.count == count, (every_ms, open_ms)

        on_wheel(test)


def test_a_storm_turns_the_interrupt_off_for_5_s():
    """64 edges in less than 8 ms are a storm. The notice comes once, the fault until the next speed."""

    def test(wheel, contact, wait):
        def edges(count, every_us):
            for k in range(count):
                contact.set(k % 2)
                wait(every_us / 1000.0)

        pulse(contact, wait, 100)
        edges(192, 130)  # 8.3 ms
        assert contact.handler and notices == []
        edges(128, 110)  # 7 ms
        assert contact.handler is None and wheel.poll(wait()) is None
        assert [notice.code for notice in notices + [wheel.fault(wait())]] == ["wheel-storm"] * 2
        assert wheel.poll(wait(4999)) is None and contact.handler is None
        wheel.poll(wait(1))
        assert contact.handler and len(notices) == 1 and wheel.fault(wait()).code == "wheel-storm"
        edges(128, 100)
        assert wheel.poll(wait(10)) is None and len(notices) == 1  # the same storm
        wheel.poll(wait(5000))
        contact.set(1)
        speeds = []
        for _ in range(3):
            pulse(contact, wait, 200)
            speeds.append(wheel.poll(wait()))
        assert abs(speeds[-1] - 10.0) < 0.01 and wheel.fault(wait()) is None

    on_wheel(test)


class Source:
    """A speed source that returns each value once."""

    age_ms = 7

    value: float | None = None

    def poll(self, now_ms):
        value, self.value = self.value, None
        return value


def test_jumps_that_no_vehicle_makes_are_refused_until_they_last():
    """A change may be 2 m/s and 15 m/s per second. After 3 s of refusals any speed is accepted."""
    with Board(level):
        from kickstand.speed.source import Speed

        source = Source()
        speed = Speed(source)
        for at_ms, value, accepted in (
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
            (9100, 73.4, True),
            (9200, 77.0, False),
            (9300, 67.0, False),
            (9400, 68.0, True),
            (12400, 100.0, True),
            (15400, 100.1, False),
        ):
            source.value = value
            assert speed.poll(at_ms) == (value if accepted else None), (at_ms, value)
        assert speed.age_us == 7000
