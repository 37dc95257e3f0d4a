"""The detector of rest, the trim and the suspension's dive.

test_known_ride.py notices any change of their parameters.
"""

from math import cos, degrees, radians, sin

import pytest
from bike_motion import GRAVITY_MPS2
from kickstand.lean.bike_model import PRIOR_SHARE, Dive
from kickstand.lean.measurements import RestDetector, gyro_variances

WINDOW_S = 0.25
NONE = (0.0, 0.0, 0.0)


def test_the_six_positions_give_the_gyros_variances():
    """A quarter turn about up maps the sensor's axes z, y, x to left, up, forward. The errors change by 0.002 with the
    temperature, and are never larger than those of the data sheet."""
    assert gyro_variances([0.0] * 9, [1.0] * 9) is None
    sigma = [0.001 * k for k in range(1, 9)] + [0.5]
    by_hand = [0.02**2, 0.008**2 + 4e-6, 0.003**2 + 4e-6, 0.002**2 + 4e-6, 0.001**2 + 4e-6]
    assert gyro_variances(sigma, [0.0, 0.0, 1.0, 0.0, 1.0, 0.0, -1.0, 0.0, 0.0]) == pytest.approx(by_hand)


def rest_after(detector, seconds, rates=NONE, force=(0.0, 1.0, 0.0), bias=NONE, moving_s=0.0, **rolling):
    """Pass equal windows to the detector for some seconds. Return the time until rest, or None without a rest."""
    rest_s, detector.moving_s = None, moving_s
    for k in range(int(seconds / WINDOW_S + 0.5)):
        corrected = [rate - error for rate, error in zip(rates, bias)]
        detector.update(corrected, list(force), list(bias), WINDOW_S, **rolling)
        if detector.resting and rest_s is None:
            rest_s = (k + 1) * WINDOW_S
    return rest_s


@pytest.mark.parametrize(
    ("first", "motion", "rest_s"),
    [
        (True, {}, 1.5),
        (True, {"rolling": True}, 10.0),
        (True, {"moving_s": 20.0}, None),
        (True, {"rates": (0.05, 0.0, 0.0)}, 1.5),  # before the first rest, a steady rate may be a bias
        (True, {"rates": (0.0, -0.15, 0.0)}, None),
        (False, {"rates": (0.0, 0.05, 0.0)}, None),
        (False, {"rates": (0.05, -0.04, 0.03), "bias": (0.04, -0.03, 0.02)}, 1.5),
        (False, {"rates": (0.05, -0.04, 0.03), "bias": (0.04, -0.03, 0.0)}, None),
        (False, {"bias": (0.05, 0.0, 0.0)}, 1.5),  # the calibration is right, and the estimated bias is wrong
        (False, {"rates": (0.03, 0.0, 0.0), "bias": (0.06, 0.0, 0.0)}, None),
    ],
)
def test_rest_is_stillness_without_a_turn(first, motion, rest_s):
    assert rest_after(RestDetector(first), 12.0, **motion) == rest_s


def ridden(share, seconds, road=0.0, speed=20.0):
    """Return a Dive after alternate braking and acceleration for some seconds.

    share: true dive of the bike, in rad per g.
    road: amplitude of the pitch rate that the road causes, in rad/s.
    """
    dive = Dive()
    for k in range(int(seconds / 0.2)):
        push, jerk = 0.5 * sin(0.3 * k), 0.75 * cos(0.3 * k)
        dive.update(push, share * jerk + road * sin(0.08 * k), speed, 0.2)
    return dive


@pytest.mark.parametrize(("true", "road", "learned"), [(-1.0, 0.02, -1.0), (0.0, 0.02, 0.0), (1.5, 0.02, 1.5),
    (6.0, 0.02, 6.0), (30.0, 0.0, 8.0), (-30.0, 0.0, -2.0)])  # fmt: skip
def test_the_dive_of_any_bike_is_learned_on_a_hilly_road(true, road, learned):
    """The limits are those of any bike."""
    assert degrees(ridden(radians(true), 200.0, road).share) == pytest.approx(learned, abs=0.5)


def test_only_brakings_show_the_dive():
    assert ridden(0.1, 10.0, speed=4.0).share == PRIOR_SHARE  # the dive cannot be found below 5 m/s
    dive = ridden(radians(4.0), 100.0)
    share = dive.share
    dive.restart()
    assert dive.update(0.1, 1.0, 20.0, 0.2) == 0.0  # the first window has no earlier force to compare with
    assert dive.update(0.2, 0.0, 4.0, 0.2) == pytest.approx(4.0 * share * 0.5 / GRAVITY_MPS2)
    for jolt in (0.9, float("nan")):
        assert dive.update(jolt, 1.0, 20.0, 0.2) == 0.0
    assert dive.share == share
