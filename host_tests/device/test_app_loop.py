"""How the app's loop waits, collects garbage and ends."""

from types import SimpleNamespace

import pytest
from support.replaced_parts import ms_after, run_app


@pytest.fixture
def looped(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return run_app


def test_a_loop_has_100_turns_a_second_and_never_catches_up(looped):
    def use(app, calls, board):
        app.begin()
        begun = board.clock.now_us
        for _ in range(50):
            app.step()
        lasted = board.clock.now_us - begun
        app.button.poll = lambda now_ms: ms_after(board, 35)
        app.step()
        app.button.poll = lambda now_ms: None
        late = board.clock.now_us
        app.step()
        return lasted, board.clock.now_us - late

    lasted, after = looped(use)
    assert lasted == pytest.approx(500_000, abs=1000) and after == pytest.approx(10_000, abs=1000)


@pytest.mark.parametrize(
    ("part", "turns"), [(None, [40] * 3), ("draws", [23] * 3), ("drive", [23] * 3), ("user", [23] * 3)]
)
def test_garbage_is_collected_after_so_many_turns(looped, part, turns, monkeypatch):
    def use(app, calls, board):
        from kickstand import app as module

        if part == "draws":
            app.lcd.draws = True
        elif part:
            speed = SimpleNamespace(source=None, take_problem=lambda: None)
            setattr(app, part, calls.part(part, speed=speed, take_problem=lambda: None))
        counted = [0]
        monkeypatch.setattr(module.gc, "collect", lambda: counted.append(0))
        app.begin()
        for _ in range(sum(turns)):
            counted[-1] += 1
            app.step()
        return counted, len(calls.of("user.check_memory"))

    counted, checked = looped(use)
    assert counted == [*turns, 0] and checked == (3 if part == "user" else 0)


@pytest.mark.parametrize(("config", "fed"), [({}, 1), ({"WATCHDOG": False}, 0)])
def test_the_watchdog_is_fed_in_each_turn(looped, config, fed, monkeypatch):
    def use(app, calls, board):
        from kickstand import app as module

        monkeypatch.setattr(module.port, "start_watchdog", lambda: calls.part("watchdog"))
        app.begin()
        app.step()
        return len(calls.of("watchdog.feed"))

    assert looped(use, **config) == fed


@pytest.mark.parametrize("on_card", [False, True])
def test_a_card_is_tested_before_the_loop(looped, on_card):
    def use(app, calls, board):
        app.rides.on_card = on_card
        app.begin()
        return [call[0] for call in calls if call[0] in ("lcd.show", "lcd.flush", "rides.try_out_card")]

    assert looped(use) == (["lcd.show", "lcd.flush", "rides.try_out_card"] if on_card else [])


@pytest.mark.parametrize(("error", "stopped"), [(KeyboardInterrupt, 1), (SystemExit, 1), (OSError, 0)])
def test_the_end_of_the_loop(looped, error, stopped, monkeypatch):
    """After Ctrl-C the watchdog is disarmed, and the ride and the connection to the phone end. After an error the board
    restarts instead."""

    def use(app, calls, board):
        from kickstand import app as module

        rested = []
        monkeypatch.setattr(module.port, "rest_watchdog", lambda: rested.append(len(calls)))
        monkeypatch.setattr(module, "worst", None)
        turns = []

        def poll(now_ms):
            turns.append(0)
            if len(turns) == 2:
                ms_after(board, 35)
            if len(turns) == 4:
                raise error

        app.button.poll, app.live = poll, calls.part("live", period_ms=0)
        with pytest.raises(error):
            app.run()
        order = [call[0] for call in calls if call[0] in ("lcd.end", "rides.stop", "live.stop")]
        return order, len(rested), module.worst, calls.of("lcd.end")

    order, rested, worst, ends = looped(use)
    assert order == ["lcd.end"] + ["rides.stop", "live.stop"] * stopped
    assert ends == [("Kickstand", "stopped")] and rested == stopped + (error is KeyboardInterrupt)
    longest_us, free, shaken = worst
    assert longest_us == pytest.approx(35_000, abs=1000) and (free, shaken) == (33, ([1, 2, 3], 0.25))
