"""What each part of the app gets in one pass of the loop, and when."""

from types import SimpleNamespace

import pytest
from kickstand.errors import Notice
from support.replaced_parts import ms_after, run_app


@pytest.fixture
def looped(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return run_app


def test_new_samples_reach_the_meter(looped):
    def use(app, calls, board):
        app.samples = 3
        app.turn()
        return calls.of("meter.update_sum"), calls.of("recorder.add"), calls.of("recorder.tick")

    assert looped(use) == ([([7] * 7, 3, 15_000)], [], [])


def test_without_samples_nothing_is_passed_on(looped):
    def use(app, calls, board):
        app.turn()
        return calls.of("meter.update_sum"), len(calls.of("clock.emptied"))

    assert looped(use) == ([], 1)


def test_a_recording_gets_each_sum(looped):
    def use(app, calls, board):
        app.samples, app.rides.recorder.active = 2, True
        app.turn()
        return calls.of("recorder.add"), len(calls.of("recorder.tick")), app.recording

    assert looped(use) == ([([7] * 7, 2, 10_000)], 1, True)


@pytest.mark.parametrize(("period_ms", "fed"), [(0, []), (100, [([7] * 7, 2)])])
def test_a_phone_gets_samples_only_while_it_listens(looped, period_ms, fed):
    def use(app, calls, board):
        app.samples, app.live = 2, calls.part("live", period_ms=period_ms)
        app.turn()
        return calls.of("live.feed"), len(calls.of("live.poll"))

    assert looped(use) == (fed, 1)


def test_a_wizard_gets_each_sample_and_then_the_sum(looped):
    def use(app, calls, board):
        app.samples, app.screen.wizard = 2, calls.part("wizard")
        app.turn()
        return [call[:2] for call in calls if call[0].startswith(("wizard", "chip"))]

    assert looped(use) == [
        ("chip.take", 0), ("wizard.sample", [8] * 7), ("chip.take", 1), ("wizard.sample", [8] * 7),
        ("wizard.follow", [7] * 7),
    ]  # fmt: skip


def test_skipped_samples_are_told_to_the_clock_once(looped):
    def use(app, calls, board):
        app.sensor.clipped = 4
        app.turn()
        app.turn()
        return calls.of("clock.skip")

    assert looped(use) == [(4,)]


@pytest.mark.parametrize(("recording", "gaps"), [(False, 0), (True, 1)])
def test_a_restarted_sensor_restarts_clock_and_meter(looped, recording, gaps):
    def use(app, calls, board):
        app.samples, app.sensor.restarts, app.rides.recorder.active = 1, 1, recording
        app.calibration.chip_started = lambda chip: False
        app.turn()
        app.turn()
        return [len(calls.of(name)) for name in ("clock.restart", "meter.restart", "recorder.mark_gap")]

    assert looped(use) == [1, 1, gaps]


def test_a_ride_that_cannot_begin_is_reported_with_the_first_calibration(looped):
    def use(app, calls, board):
        app.samples, app.sensor.restarts = 1, 1
        app.calibration.chip_started = lambda chip: True
        app.rides.start_due = lambda: "full"
        app.turn()
        return [call[0] for call in calls.of("screen.notify")]

    assert looped(use) == ["full"]


def test_the_first_page_waits_for_the_filter(looped):
    """The page is shown 60 ms after the start of the sensor, and then every 100 ms."""

    def use(app, calls, board):
        app.turn()
        before = len(calls.of("lcd.show"))
        app.samples, app.sensor.restarts = 1, 1
        app.calibration.chip_started = lambda chip: False
        shown = []
        for _ in range(40):
            app.turn()
            shown.append(len(calls.of("lcd.show")) - before)
            ms_after(board, 10)
        return [shown.index(number) for number in (1, 2, 3, 4)]

    first, *later = looped(use)
    assert first == pytest.approx(6, abs=1)
    assert [b - a for a, b in zip([first, *later], later)] == pytest.approx([10, 10, 10], abs=1)


@pytest.mark.parametrize(
    ("frames_left", "draws", "late"),
    [(0, False, False), (80, False, False), (81, False, True), (40, True, False), (41, True, True)],
)
def test_readings_that_wait_too_long_make_a_page_late(looped, frames_left, draws, late):
    """A page is late if readings wait for over 400 ms, which are 80 readings at 200 Hz. On a display that draws, a page
    is late if readings wait for over 200 ms."""

    def use(app, calls, board):
        app._page_ms = 10**6  # show no page yet
        app.turn()
        app.sensor.chip.frames_left, app.lcd.draws = frames_left, draws
        from time import ticks_ms  # pyright: ignore[reportAttributeAccessIssue]

        app._page_ms = ticks_ms()
        app.turn()
        return app.screen.pages.late, app.screen.pages.draws, calls.of("lcd.show")

    assert looped(use) == (late, draws, [("one", "two")])


def test_the_fault_of_the_sensor_interrupts_the_screen(looped):
    def use(app, calls, board):
        app.turn()
        before = len(calls.of("screen.interrupt"))
        app.sensor.fault = Notice("no-sensor")
        app.turn()
        return before, len(calls.of("screen.interrupt")), len(calls.of("clock.emptied"))

    assert looped(use) == (0, 1, 1)


def test_the_clock_is_emptied_only_when_no_frame_is_left(looped):
    def use(app, calls, board):
        app.sensor.chip.frames_left = 1
        app.turn()
        return len(calls.of("clock.emptied"))

    assert looped(use) == 0


def test_a_press_reaches_the_screen_and_user_py(looped):
    def use(app, calls, board):
        app.user = calls.part("user", take_problem=lambda: None)
        app.button.poll = lambda now_ms: 2
        app.turn()
        return [call[0] for call in calls.of("screen.press")], calls.of("user.press"), calls.of("user.lean")

    assert looped(use) == ([2], [(2,)], [(True,)])


@pytest.mark.parametrize(
    ("fault", "trusted", "config", "expected"),
    [
        (None, True, {}, True),
        (Notice("no-sensor"), True, {}, False),
        (None, False, {}, False),
        (None, True, {"VEHICLE": "car", "SPEED": "wheel"}, False),
    ],
)
def test_a_lean_is_trusted_only_without_a_doubt(looped, fault, trusted, config, expected):
    def use(app, calls, board):
        app.sensor.fault, app.screen.pages.trusted = fault, trusted
        return app.trusted

    assert looped(use, **config) is expected


def test_the_first_problem_is_shown(looped):
    """Problems are shown in this order: the recording, the speed source, the sensor's axes, user.py."""

    def use(app, calls, board):
        app.user = calls.part("user", take_problem=lambda: "user")
        app.drive = calls.part("drive", speed=calls.part("speed", take_problem=lambda: "speed"))
        app.sensor.chip.axes.notice = Notice("clips", "x")
        app.rides.recorder.take_problem = lambda: "recording"
        seen = []
        for change in (None, "recording", "speed", "axes", "user"):
            if change == "recording":
                app.rides.recorder.take_problem = lambda: None
            elif change == "speed":
                app.drive.speed.take_problem, app.sensor.chip.axes.notice = (lambda: None), Notice("clips", "y")
            elif change == "user":
                app.user.take_problem = lambda: None
            ms_after(board, 200)
            del calls[:]
            app.turn()
            seen.append([getattr(call[0], "code", call[0]) for call in calls.of("screen.notify")])
        return seen, app.sensor.chip.axes.notice

    assert looped(use) == ([["recording"], ["speed"], ["clips"], ["user"], []], None)


@pytest.mark.parametrize(("menu", "wizard", "prepared", "kept"), [(None, None, 0, 1), (5, None, 1, 1), (None, 5, 0, 0)])
def test_a_page_prepares_recordings_and_keeps_the_trim(looped, menu, wizard, prepared, kept):
    def use(app, calls, board):
        app.screen.menu, app.screen.wizard = menu, wizard
        app.turn()
        return len(calls.of("rides.prepare")), len(calls.of("calibration.keep_trim"))

    assert looped(use) == (prepared, kept)


@pytest.mark.parametrize("active", [False, True])
def test_a_stall_is_told_to_the_speed_source_once(looped, active):
    def use(app, calls, board):
        source = calls.part("source", place=lambda now_ms: "place")
        app.drive = calls.part(
            "drive", poll=lambda now_ms: 9.5, speed=SimpleNamespace(source=source, take_problem=lambda: None)
        )
        app.rides.recorder.stalled, app.rides.recorder.active = True, active
        app.samples = 1
        app.turn()
        app.turn()
        return len(calls.of("source.after_stall")), calls.of("recorder.add_fix"), len(calls.of("drive.feed"))

    assert looped(use) == (1, [(9.5, "place")] * 2 if active else [], 2)


@pytest.mark.parametrize(("replaced", "reset"), [(False, 0), (True, 1)])
def test_a_new_calibration_clears_the_maxima(looped, replaced, reset):
    def use(app, calls, board):
        app.drive = calls.part("drive")
        app._calibration_changed(replaced)
        names = ("rides.calibration_changed", "meter.reset_maxima", "drive.begin")
        return [len(calls.of(name)) for name in names]

    assert looped(use) == [1, reset, reset]
