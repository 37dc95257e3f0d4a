"""Tests what the background alignment does with each speed, and which state it shows to the rider."""

from types import SimpleNamespace
from typing import Any

import pytest
from kickstand.drive_alignment import alignment
from kickstand.drive_alignment.events import MAX_INTERVAL_US, DrivingEvents
from kickstand.drive_alignment.history import ForceHistory
from kickstand.drive_alignment.quality import MIN_EVENTS_TO_CHECK_SPEED
from kickstand.drive_alignment.speed_check import fit_problem
from kickstand_tools.simulated_board.simulator import Board


def device(leans=True, counted=9, problem=None, speed_problem=None, state=alignment.TURNING, speed_mps=0.0):
    """Return a BackgroundAlignment whose drive has these values. The list `passed` collects the speeds that the
    alignment passes to the lean filter."""
    with Board(lambda t_s: (0, 0, 1, 0, 0, 0)):  # the import needs a board's clock
        from kickstand.drive_alignment.background import BackgroundAlignment
    made: Any = object.__new__(BackgroundAlignment)
    quality = SimpleNamespace(speed_problem=speed_problem)
    made.drive = SimpleNamespace(counted=counted, problem=problem, quality=quality, state=state)
    made._leans, made._speed_mps = leans, speed_mps
    made.passed = []
    made._meter = SimpleNamespace(measure_speed=made.passed.append)
    return made


@pytest.mark.parametrize(
    ("given", "speed", "used"),
    [
        ({}, 12.3456, 12.35),  # the speed is rounded as in a recording
        ({}, 0.0, None),
        ({"counted": MIN_EVENTS_TO_CHECK_SPEED}, 5.0, 5.0),
        ({"counted": MIN_EVENTS_TO_CHECK_SPEED - 1}, 5.0, None),
        ({"problem": "stuck"}, 5.0, None),
        ({"speed_problem": "unit"}, 5.0, None),
    ],
)
def test_a_motorcycles_speed_is_used_once_brakings_confirm_it(given, speed, used):
    one = device(**given)
    assert one._share(speed) == used
    assert one.passed == ([] if used is None else [used])


def test_a_cars_speed_is_recorded_as_it_is_and_not_used():
    one = device(leans=False, counted=0, problem="stuck")
    assert (one._share(12.3456), one._share(0.0), one.passed) == (12.3456, 0.0, [])


@pytest.mark.parametrize(
    ("state", "speed_mps", "shown"),
    [
        (alignment.TURNING, 1.9, alignment.BRAKING),
        (alignment.TURNING, 2.1, alignment.TURNING),
        (alignment.WAITING_FOR_STOP, 1.9, alignment.WAITING_FOR_STOP),
        (alignment.READY, 30.0, alignment.READY),
    ],
)
def test_a_bend_at_walking_pace_is_shown_as_braking(state, speed_mps, shown):
    assert device(state=state, speed_mps=speed_mps).state == shown


@pytest.mark.parametrize(
    ("lag_s", "ratio", "said"),
    [
        (0.0, 1.0, None),
        (1.8, 0.76, None),
        (0.0, 1.34, None),
        (1.9, 1.0, ("speed-late", 1.9)),
        (0.0, 0.74, ("speed-unit", pytest.approx(1 / 0.74))),
        (0.0, 1.36, ("speed-unit", pytest.approx(1 / 1.36))),
        (0.0, 1 / 3.6, ("speed-unit", pytest.approx(3.6))),  # a factor of 3.6 means that the unit is km/h
        (0.0, 0.0, ("speed-unit", 99.9)),
        (0.0, -1.0, ("speed-unit", 99.9)),
    ],
)
def test_a_late_speed_and_one_of_another_unit_are_named(lag_s, ratio, said):
    problem = fit_problem(lag_s, ratio)
    assert (problem and (problem.code, *problem.values)) == said


def test_missing_samples_drop_the_intervals_that_wait():
    history = ForceHistory()
    history.clear()
    events = DrivingEvents(history)
    events.measure_speed(10.0, history.now + 500_000)
    events.measure_speed(9.0, history.now + 1_000_000)
    history.add([0.0] * 3, 0.0, MAX_INTERVAL_US)
    assert events.due
    events.interrupt()
    assert not events.due
