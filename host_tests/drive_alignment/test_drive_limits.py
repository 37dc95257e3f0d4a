"""Tests the states of an alignment by driving, the list of what it still needs, and the sums of its bins."""

from typing import Any

import pytest
from kickstand.drive_alignment import alignment
from kickstand.drive_alignment.alignment import CAR, MOTORCYCLE, DriveAlignment


def said(problem):
    return problem and (problem.code, *problem.values)


def drive(vehicle: Any = CAR, **given: Any) -> Any:
    made: Any = DriveAlignment(vehicle)
    for name, value in given.items():
        target, _, attribute = name.rpartition("__")
        setattr(getattr(made, target) if target else made, attribute, value)
    return made


DRIVEN = {"_speed_mps": 9.0, "_top_mps": 9.0, "standing__stops": 1}


@pytest.mark.parametrize(
    ("given", "state"),
    [
        ({"_speed_mps": -1.0}, 0),
        ({"_silent_us": 5_000_001}, 0),
        ({"_silent_us": 5_000_000}, 2),
        ({"standing__stops": 0}, 1),
        ({}, 2),
        ({"quality__good": True}, 5),
        ({"standing__moved": True}, 6),
        ({"quality__good": True, "_speed_mps": -1.0}, 5),
        ({"_speed_mps": 0.0}, 2),
    ],
)
def test_the_state_of_a_drive(given, state):
    assert drive(**DRIVEN | given).state == state


def test_braking_is_shown_as_straight_or_in_a_bend():
    made = drive(**DRIVEN)
    made.events._finder.going_on, made.events._finder.change = True, -1.0
    assert made.state == alignment.TURNING
    made.events._straight[0] = True
    assert made.state == alignment.BRAKING
    made.events._finder.change = 1.0
    assert made.state == alignment.WAITING_FOR_BRAKING
    assert drive(MOTORCYCLE, **DRIVEN | {"standing__stops": 0}).state == alignment.WAITING_FOR_BRAKING


@pytest.mark.parametrize(
    ("given", "counted", "reason"),
    [
        ({"_speed_mps": -1.0}, 5, ("no-speed",)),
        ({"_top_mps": 1.9}, 5, ("not-driven", 5)),
        ({"_top_mps": 2.0, "standing__stops": 0}, 5, ("not-stopped", 3.0)),
        ({}, 4, ("few-events", 4, 5, 2)),
        ({}, 5, ("uncertain", 180.0, 0)),
        ({"quality__quality_deg": 3.0, "quality__agree": True}, 5, ("uncertain", 3.0, 0)),
        ({"quality__quality_deg": 3.0, "quality__halves_deg": 12.0}, 5, ("parts-differ", 12.0)),
    ],
)
def test_what_a_drive_still_misses(given, counted, reason):
    assert said(drive(**DRIVEN | given).missing(counted, 5, 2)) == reason


def test_the_problem_of_the_mount_is_known_from_five_events():
    for braked, problem in ((4, None), (5, "mount")):
        assert drive(events__braking_count=braked, quality__mount_problem="mount").problem == problem
    assert drive(events__braking_count=5, quality__speed_problem="speed").problem == "speed"
    assert said(drive(standing__moved=True).problem) == ("mount-moved", "between-stops", 8.0)
    assert drive(MOTORCYCLE, standing__moved=True).problem is None
    assert drive(standing__moved=True, _speed_check__problem="stuck").problem == "stuck"


def test_samples_are_summed_to_a_bin_of_a_tenth_of_a_second():
    made = drive(MOTORCYCLE, **DRIVEN)
    seen = []
    made._history.add = lambda sums, yaw, us: seen.append((list(sums[:3]), yaw, us))
    made._speed_check.update = lambda force, yaw_dps, us: seen.append((force, yaw_dps, us))
    for k in range(10):
        made.update([0.1, 1.0, 0.2 * k], [0.0, 3.0, 0.0], 10_000)
    (sums, yaw, us), (force, yaw_dps, check_us) = seen
    assert sums == pytest.approx([1e4, 1e5, 9e4]) and us == check_us == 100_000
    assert force == pytest.approx([0.1, 1.0, 0.9])
    assert yaw_dps == pytest.approx(3.0) and yaw == pytest.approx(3e4)  # 0.3 degrees
    assert made._sums_us == 0 and made._sums == [0.0] * 6 and made._silent_us == 100_000
    made.update([0.0] * 3, [0.0] * 3, 10_000)
    made.update([0.0] * 3, [0.0] * 3, 500_001)
    assert made._sums_us == 0 and made._history._count == 1


def test_a_speed_has_the_time_of_the_newest_sample():
    made = drive()
    seen = []
    made.events.measure_speed = lambda mps, at: seen.append((mps, at))
    made._history.now, made._sums_us, made._silent_us = 1_000_000, 30_000, 9
    made.measure_speed(7.0, 200_000)
    made.measure_speed(-0.3)
    assert seen == [(7.0, 830_000), (0.0, 1_030_000)]
    assert (made._speed_mps, made._top_mps, made._silent_us) == (0.0, 7.0, 0)


def test_bins_of_a_silent_source_are_not_checked():
    for silent_us, checked in ((4_999_999, 1), (5_000_000, 0)):
        made = drive(_silent_us=silent_us)
        seen = []
        made._speed_check.update = lambda *given, seen=seen: seen.append(given)
        made.update([0.0, 1.0, 0.0], [0.0] * 3, 100_000)
        assert len(seen) == checked and made._silent_us == 5_000_001


def test_only_a_fresh_speed_proves_a_standstill():
    for given, updates in (
        ({}, 1),
        ({"_silent_us": 5_000_000}, 1),
        ({"_speed_mps": 0.0}, 1),
        ({"_speed_mps": -1.0}, 0),
        ({"_silent_us": 5_000_001}, 0),
    ):
        made, seen = drive(**DRIVEN | given), []
        made.standing.update = lambda *values, seen=seen: seen.append(values)
        made._means = ([0.0, 1.0, 0.0], [0.0] * 3, 0.1)
        made._do_step()
        assert len(seen) == updates and made._means is None
