"""The app's loop: its rate and its garbage collections."""

import pytest


def test_loop_has_100_turns_a_second_and_never_catches_up(with_app):
    def use(board, app):
        app.begin()
        for _ in range(100):  # until display and sensor are set up
            app.step()
        begin_us = board.clock.now_us
        for _ in range(50):
            app.step()
        lasted_us = board.clock.now_us - begin_us
        board.clock.at(board.clock.now_us, lambda: board.clock.advance(35_000))
        app.step()
        late_us = board.clock.now_us
        app.step()
        return lasted_us, board.clock.now_us - late_us

    lasted_us, after_us = with_app(use)
    assert lasted_us == pytest.approx(500_000, abs=1000) and after_us == pytest.approx(10_000, abs=1000)
