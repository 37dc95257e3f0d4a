"""Tests the trim, with the motion that counts as balanced, the time to find it, and its uncertainty. Also runs on
MicroPython."""

from math import degrees, radians, sin, sqrt

from bike_motion import near
from kickstand.lean.upright_trim import UprightTrim

WINDOW_S = 0.2


def sigma_deg(trim):
    return degrees(sqrt(trim.variance))


def after_turns(sides, lean_share):
    """Return the trim after turns of a minute each at 35 degrees. The upright pose has an error of 2 degrees.

    sides: 1 for a turn to the right, -1 for a turn to the left.
    lean_share: in turns, a force of lean_share * sin(lean) acts to the side.
    """
    trim = UprightTrim(0.0)
    for side in sides:
        lean = radians(35.0 * side)
        for _ in range(300):
            trim.update(radians(2.0) + lean_share * sin(lean), lean + radians(2.0), -0.35 * side, WINDOW_S)
    return trim


def test_turns_to_both_sides_find_a_pose_error_of_2_degrees():
    """No straight is between the turns. Tyres and rider have the same effect on both sides, so the effect cancels."""
    for lean_share in (0.0, 0.1, -0.1):
        near(degrees(after_turns((1, -1, 1, -1), lean_share).angle), 2.0, 0.4)


def test_turns_to_one_side_do_not_separate_pose_and_tyres():
    one, both = after_turns((1, 1), 0.1), after_turns((1, -1), 0.1)
    assert sigma_deg(one) > 2.0 * sigma_deg(both)
    assert sigma_deg(one) > 1.5


def test_straights_find_a_pose_error_of_2_degrees():
    trim = UprightTrim(0.0)
    for _ in range(150):
        trim.update(sin(radians(2.0)), radians(2.0), 0.0, WINDOW_S)
    # The expected trim is a weighted mean of two estimates. Disturbances of 1.5 degrees last 2 s each, so 30 s contain
    # 7.5 independent measurements. The pose has a standard deviation of 2.5 degrees.
    share = 1.0 / (1.0 + 1.5**2 / 7.5 / 2.5**2)
    near(degrees(trim.angle), 2.0 * share, 0.02)
    near(sigma_deg(trim), 2.5 * sqrt(1.0 - share), 0.02)


def test_a_bike_pushed_to_the_side_is_not_balanced():
    for sign in (1.0, -1.0):
        trim = UprightTrim(0.0)
        trim.update(sign * 0.15, 0.0, 0.0, WINDOW_S)
        assert trim.angle == 0.0
        near(sigma_deg(trim), 2.5, 1e-9)
        trim.update(sign * 0.05, 0.0, 0.0, WINDOW_S)
        assert sign * trim.angle > 0.0
        assert sigma_deg(trim) < 2.5
