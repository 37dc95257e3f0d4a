"""The vertical and the gyro's bias from stops, and the faults of a speed source, on both sides of each limit."""

import numpy as np
import pytest
from kickstand.drive_alignment.alignment import StandingVertical


def pitched(deg):
    return [0.0, float(np.cos(np.radians(deg))), float(np.sin(np.radians(deg)))]


def pitch_deg(up):
    return float(np.degrees(np.arctan2(up[2], up[1])))


def stand(standing, deg, seconds, speed=0.0, rate=(0.0, 0.0, 0.0)):
    """Pass means of 0.1 s of a vehicle that is pitched by this angle."""
    for _ in range(round(seconds * 10)):
        standing.update(pitched(deg), rate, speed, 0.1)


def test_each_stop_counts_once_in_the_vertical():
    standing = StandingVertical()
    for k, (deg, seconds) in enumerate([(3.0, 300.0), (-3.0, 5.0), (2.0, 5.0), (-2.0, 5.0)]):
        stand(standing, deg, seconds, rate=(0.1 * k, -0.2, 0.3))
        assert standing.standing
        stand(standing, 10.0, 3.0, speed=10.0)
    assert standing.stops == 4 and not standing.moved
    assert pitch_deg(standing.up) == pytest.approx(0.0, abs=0.01)
    assert standing.bias == pytest.approx((0.3, -0.2, 0.3), abs=1e-5)


@pytest.mark.parametrize(
    ("seconds", "speed", "shake_g", "standing", "stops"),
    [
        (0.9, 0.0, 0.0, False, 0),
        (1.1, 0.0, 0.0, True, 0),
        (2.8, 0.0, 0.0, True, 0),
        (3.1, 0.0, 0.0, True, 1),
        (9.0, 0.5, 0.0, True, 1),
        (9.0, 0.51, 0.0, False, 0),
        (4.0, 0.0, 0.02, True, 1),  # an idling engine
        (9.0, 0.0, 0.2, False, 0),
    ],
)
def test_a_stop_requires_stillness_and_three_seconds(seconds, speed, shake_g, standing, stops):
    vertical = StandingVertical()
    for k in range(round(seconds * 10)):
        vertical.update([0.0, 1.0, shake_g * (-1) ** k], (0.0, 0.0, 0.0), speed, 0.1)
    assert (vertical.standing, vertical.stops) == (standing, stops)


@pytest.mark.parametrize(
    ("speed", "second_deg", "stops", "moved"), [(2.0, 7.0, 1, False), (2.1, 7.9, 2, False), (2.1, 8.1, 2, True)]
)
def test_stops_far_apart_are_a_moved_mount(speed, second_deg, stops, moved):
    """A new stop needs a speed of over 2 m/s before it. Slopes of two stops differ by up to 8 degrees."""
    standing = StandingVertical()
    stand(standing, 0.0, 4.0)
    stand(standing, 0.0, 1.0, speed)
    stand(standing, second_deg, 4.0)
    assert (standing.stops, standing.moved) == (stops, moved)
    assert stops == 1 or pitch_deg(standing.up) == pytest.approx(second_deg / 2.0, abs=0.01)


@pytest.mark.parametrize(
    ("deg", "seconds", "standing_still", "moved"),
    [(1.3, 4.0, True, False), (2.9, 4.0, False, False), (15.0, 2.5, False, False), (15.0, 12.5, False, True)],
)
def test_only_a_lasting_tilt_shows_a_rotated_sensor(deg, seconds, standing_still, moved):
    """A late speed is still zero while the vehicle already accelerates evenly for some seconds."""
    standing = StandingVertical()
    stand(standing, 0.0, 5.0)
    stand(standing, deg, seconds)
    assert (standing.standing, standing.moved) == (standing_still, moved)
    assert pitch_deg(standing.up) < 1.0
