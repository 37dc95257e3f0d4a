"""The trim of upright: what counts as balanced, how soon it is found, how sure it becomes. Runs on MicroPython too."""

from math import degrees, pi, radians, sin, sqrt

from bike_motion import near
from kickstand.lean.upright_trim import UprightTrim

WINDOW_S = 0.2


def sigma_deg(trim):
    return degrees(sqrt(trim.variance))


def disturbance_deg(lean_deg, yaw_dps, angle_deg=0.0):
    """1 sigma of one window's measurement, by what it added to the certainty, if the disturbance lasts two seconds."""
    trim = UprightTrim(radians(angle_deg))
    before = trim.variance
    trim.update(sin(radians(angle_deg)), radians(lean_deg), radians(yaw_dps), WINDOW_S)
    noise = 1.0 / (1.0 / trim.variance - 1.0 / before)
    return degrees(sqrt(noise * WINDOW_S / (2.0 * 2.0)))


def test_a_new_pose_is_less_certain_than_a_trim_that_was_kept():
    near(sigma_deg(UprightTrim(0.0)), 2.5, 1e-9)
    near(sigma_deg(UprightTrim(0.02)), 0.7, 1e-9)
    assert UprightTrim(0.02).angle == 0.02


def test_on_a_straight_the_balance_is_known_to_one_and_a_half_degrees():
    near(disturbance_deg(0.0, 0.0), 1.5, 0.01)


def test_in_turns_it_is_known_less():
    """Turns differ by 0.1 of the sine of the lean, bikes by 0.15, which lasts; and there is 0.1 s of the yaw rate."""
    for lean_deg in (30.0, -30.0):
        differ, bike = 0.1 * 0.5, 0.15 * 0.5 * sqrt(WINDOW_S / (2.0 * 2.0))
        near(disturbance_deg(lean_deg, 0.0), sqrt(1.5**2 + (differ**2 + bike**2) * (180.0 / pi) ** 2), 0.1)
    for yaw_dps in (10.0, -10.0):
        near(disturbance_deg(0.0, yaw_dps), sqrt(1.5**2 + 1.0**2), 0.02)
    near(disturbance_deg(3.0, 0.0, angle_deg=3.0), 1.5, 0.02)  # the lean that counts is that beyond the trim


def after_turns(sides, lean_share):
    """The trim after turns of a minute at 35 degrees of a bike that feels lean_share sin(lean), its pose off by 2."""
    trim = UprightTrim(0.0)
    for side in sides:
        lean = radians(35.0 * side)
        for _ in range(300):
            trim.update(radians(2.0) + lean_share * sin(lean), lean + radians(2.0), -0.35 * side, WINDOW_S)
    return trim


def test_turns_to_both_sides_find_a_pose_that_was_off_by_two_degrees():
    """Without a straight between them: what tyres and rider add is alike to both sides, and cancels."""
    for lean_share in (0.0, 0.1, -0.1):
        near(degrees(after_turns((1, -1, 1, -1), lean_share).angle), 2.0, 0.4)


def test_turns_to_one_side_do_not_tell_the_pose_from_the_tyres():
    one, both = after_turns((1, 1), 0.1), after_turns((1, -1), 0.1)
    assert sigma_deg(one) > 2.0 * sigma_deg(both)
    assert sigma_deg(one) > 1.5


def test_half_a_minute_of_straights_finds_a_pose_that_was_off_by_two_degrees():
    trim = UprightTrim(0.0)
    for _ in range(150):
        trim.update(sin(radians(2.0)), radians(2.0), 0.0, WINDOW_S)
    # 30 s of disturbances that last 2 s each: 7.5 independent measurements of 1.5 degrees, and the pose of 2.5
    share = 1.0 / (1.0 + 1.5**2 / 7.5 / 2.5**2)
    near(degrees(trim.angle), 2.0 * share, 0.02)
    near(sigma_deg(trim), 2.5 * sqrt(1.0 - share), 0.02)


def test_it_may_drift_so_it_never_becomes_surer_than_a_sixth_of_a_degree():
    """0.01 degrees per square root of a second against 1.5 degrees for two seconds: sqrt(0.01 * 1.5 * 2)."""
    trim = UprightTrim(0.0)
    for _ in range(1800):
        trim.update(0.0, 0.0, 0.0, 2.0)
    near(sigma_deg(trim), sqrt(0.01 * 1.5 * 2.0), 0.003)


def test_a_bike_that_is_pushed_to_the_side_is_not_balanced():
    for sign in (1.0, -1.0):
        trim = UprightTrim(0.0)
        trim.update(sign * 0.1001, 0.0, 0.0, WINDOW_S)
        assert trim.angle == 0.0
        near(sigma_deg(trim), 2.5, 1e-9)
        trim.update(sign * 0.0999, 0.0, 0.0, WINDOW_S)
        assert sign * trim.angle > 0.0
        assert sigma_deg(trim) < 2.5


def test_no_pose_is_off_by_more_than_three_and_a_half_degrees():
    for sign in (1.0, -1.0):
        trim = UprightTrim(0.0)
        for _ in range(3000):
            trim.update(sign * 0.09, 0.0, 0.0, WINDOW_S)
        near(degrees(trim.angle), sign * 3.5, 1e-9)
