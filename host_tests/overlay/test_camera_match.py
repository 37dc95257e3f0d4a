"""The time of a video in a ride, found by the rates of the camera and the bike."""

import numpy as np
import pytest
from kickstand_tools.common.messages import InputError
from kickstand_tools.joining.motion import STEP_S, BinMotion
from kickstand_tools.overlay.overlay import camera_offset_s
from kickstand_tools.overlay.video import Telemetry

RIDE_S = 60.0
NOWHERE = "at no time does the camera turn like the bike"


def rates(t_s, seed=4):
    """Return random rates about three axes at these times, in deg/s."""
    knots_s = np.arange(-20.0, 100.0, 0.7)
    knots = np.random.default_rng(seed).normal(scale=30.0, size=(len(knots_s), 3))
    return np.column_stack([np.interp(t_s, knots_s, axis) for axis in knots.T])


def bike(rate_dps) -> BinMotion:
    count = len(rate_dps)
    return BinMotion(np.zeros((count, 3)), rate_dps, np.ones(count, dtype=bool), False, False)


CELLS_S = STEP_S * (np.arange(round(RIDE_S / STEP_S)) + 0.5)


def outcome(ride, camera) -> float | str:
    try:
        offset_s, correlation = camera_offset_s(ride, camera)
    except InputError as error:
        return str(error)
    assert 0.7 < correlation <= 1.0
    return offset_s


@pytest.mark.parametrize(
    ("begin_s", "seconds", "noise_dps", "found"),
    [
        (12.0, 30.0, 0.0, 12.0),
        (12.03, 30.0, 2.0, 12.03),
        (0.0, 60.0, 0.0, 0.0),
        (-10.0, 30.0, 0.0, -10.0),
        (45.0, 30.0, 0.0, 45.0),
        (20.0, 12.0, 0.0, 20.0),
        (20.0, 7.5, 0.0, NOWHERE),
        (-21.5, 30.0, 0.0, -21.5),
        (-22.5, 30.0, 0.0, NOWHERE),
        (12.0, 30.0, 300.0, NOWHERE),
    ],
)
def test_a_camera_is_found_in_the_ride(begin_s, seconds, noise_dps, found):
    """The camera points elsewhere and has a bias. At least 8 s must be common."""
    t_s = (np.arange(40.0 * seconds) + 0.5) / 40.0
    noise = np.random.default_rng(4).normal(size=(len(t_s), 3))
    camera = Telemetry(t_s, rates(t_s + begin_s)[:, [2, 0, 1]] + [1.0, -2.0, 0.5] + noise_dps * noise)
    result = outcome(bike(rates(CELLS_S)), camera)
    assert result == (found if isinstance(found, str) else pytest.approx(found, abs=0.03))


@pytest.mark.parametrize(("period_s", "end_s"), [(60.0, 120.0), (3.0, 15.0)])
def test_a_motion_that_occurs_twice_is_refused(period_s, end_s):
    """Until the time `end_s` the ride repeats itself: a loop that is ridden twice, or a slalom."""
    t_s = np.arange(40.0 * (end_s - period_s)) / 40.0
    ride_s = np.append(CELLS_S, RIDE_S + CELLS_S)
    ride = bike(rates(np.where(ride_s < end_s, ride_s % period_s, ride_s)))
    assert outcome(ride, Telemetry(t_s, rates(t_s % period_s))) == "the camera turns like the bike at several times"
