"""The virtual clock, and the module `time` that uses it."""

import kickstand_tools.simulated_board.clock as clock_module
from kickstand_tools.simulated_board.clock import Clock, PowerOff
from kickstand_tools.simulated_board.fakes import fake_time
from kickstand_tools.simulated_board.simulator import Board
from support.board_access import level, raised


def test_the_deadline_stops_the_clock_and_stays():
    clock, seen = Clock(), []
    clock.set_deadline(500)
    clock.at(500, lambda: seen.append(1))  # an event at the deadline still happens
    assert isinstance(raised(clock.advance, 1000), PowerOff)
    assert clock.now_us == 500 and seen == [1]
    assert isinstance(raised(clock.advance, 1), PowerOff)
    clock.set_deadline(None)
    clock.advance(1)
    assert clock.now_us == 501
    assert not issubclass(PowerOff, Exception)  # firmware that catches every Exception cannot catch PowerOff


def test_pace_follows_the_host():
    """The host's time passes only in sleep()."""
    before, slept_s = (clock_module._host_ns, clock_module._host_sleep), []
    clock_module._host_ns = lambda: 1_000_000_000_000 + round(1e9 * sum(slept_s))
    clock_module._host_sleep = slept_s.append
    try:
        Clock(pace=4.0).advance(400_000)
        assert 0.095 <= sum(slept_s) < 0.101
        del slept_s[:]
        Clock().advance(60_000_000)
        assert not slept_s
    finally:
        clock_module._host_ns, clock_module._host_sleep = before


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
