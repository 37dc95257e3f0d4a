"""The virtual clock and the `time` built on it. Also run under MicroPython."""

import kickstand_tools.simulated_board.clock as clock_module
from board_access import level, raised
from kickstand_tools.simulated_board.clock import Clock, PowerOff
from kickstand_tools.simulated_board.fakes import fake_time
from kickstand_tools.simulated_board.simulator import Board


def test_events_run_in_order_at_their_time():
    clock, seen = Clock(), []
    clock.at(300, lambda: seen.append(("late", clock.now_us)))
    clock.at(100, lambda: seen.append(("first", clock.now_us)))
    clock.at(100, lambda: seen.append(("second", clock.now_us)))
    clock.advance(99)
    assert seen == []
    clock.advance(1)
    assert seen == [("first", 100), ("second", 100)]
    clock.advance(1000)
    assert seen[2] == ("late", 300) and clock.now_us == 1100


def test_an_event_may_let_time_pass_and_schedule_more():
    clock, seen = Clock(), []

    def slow():
        clock.advance(50)
        clock.at(clock.now_us + 10, lambda: seen.append(clock.now_us))

    clock.at(100, slow)
    clock.advance(120)
    assert clock.now_us == 150 and seen == []
    clock.advance(20)
    assert seen == [160]


def test_every_repeats():
    clock, seen = Clock(), []
    clock.every(1000, lambda: seen.append(clock.now_us))
    clock.advance(3500)
    assert seen == [1000, 2000, 3000]


def test_the_deadline_stops_the_clock_and_stays():
    clock, seen = Clock(), []
    clock.set_deadline(500)
    clock.at(500, lambda: seen.append(1))  # what is due at the deadline still happens
    assert isinstance(raised(clock.advance, 1000), PowerOff)
    assert clock.now_us == 500 and seen == [1]
    assert isinstance(raised(clock.advance, 1), PowerOff)
    clock.set_deadline(None)
    clock.advance(1)
    assert clock.now_us == 501


class Host:
    """A host whose time passes only while it sleeps."""

    def __init__(self):
        self.now_us = 1_000_000_000

    def __enter__(self):
        self._before = clock_module._host_ns, clock_module._host_sleep
        clock_module._host_ns, clock_module._host_sleep = lambda: self.now_us * 1000, self.sleep
        return self

    def __exit__(self, *_):
        clock_module._host_ns, clock_module._host_sleep = self._before

    def sleep(self, seconds):
        self.now_us += round(seconds * 1e6)


def test_pace_follows_the_host():
    with Host() as host:
        begin_us = host.now_us
        Clock(pace=4.0).advance(400_000)
        assert 95_000 <= host.now_us - begin_us <= 100_000
        begin_us = host.now_us
        Clock().advance(60_000_000)
        assert host.now_us == begin_us


def test_ticks_wrap_as_on_the_boards():
    def firmware(board):
        before = fake_time.ticks_us()
        fake_time.sleep_ms(2)
        after = fake_time.ticks_us()
        assert before > after, "no wrap within the 2 ms"
        assert fake_time.ticks_diff(after, before) == 2000 + fake_time.CALL_US
        assert fake_time.ticks_diff(before, after) == -2000 - fake_time.CALL_US
        assert fake_time.ticks_add(before, 2000 + fake_time.CALL_US) == after
        assert fake_time.ticks_add(after, -2005) == before

    board = Board(level)
    board.ticks_at_boot_us = (1 << 30) - 1000
    with board:
        assert board.run(lambda: firmware(board), 1.0) == "returned"
