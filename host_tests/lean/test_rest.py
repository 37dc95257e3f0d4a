"""Tests the detector of standstills. Runs on MicroPython too."""

from kickstand.lean.rest import RestDetector

WINDOW_S = 0.25
NONE = (0.0, 0.0, 0.0)


def rested_after(detector, seconds, rates=NONE, force=(0.0, 1.0, 0.0), bias=NONE, **rolling):
    """Pass equal windows to the detector for some seconds. Return the time until rest, or None without a rest."""
    found = None
    for k in range(int(seconds / WINDOW_S + 0.5)):
        left_over = [rate - error for rate, error in zip(rates, bias)]
        detector.update(left_over, list(force), list(bias), WINDOW_S, **rolling)
        if detector.resting and found is None:
            found = (k + 1) * WINDOW_S
    return found


def test_rest_takes_ten_seconds_if_the_bike_seems_to_roll():
    assert rested_after(RestDetector(), 12.0, rolling=True) == 10.0
    detector = RestDetector()
    rested_after(detector, 5.0, rolling=True)
    assert rested_after(detector, 3.0) == 1.5  # the 1.5 s count from the end of the signs that the bike rolls
    # Rest needs ten seconds of stillness in all, with and without signs that the bike rolls
    assert rested_after(detector, 3.0, rolling=True) == 2.0


def test_a_movement_about_or_along_any_axis_ends_the_rest():
    for axis in range(3):
        for sign in (1.0, -1.0):
            step = [sign * 0.03 * (axis == i) for i in range(3)]
            for moved in ({"force": [a + b for a, b in zip((0.0, 1.0, 0.0), step)]}, {"rates": step}):
                detector = RestDetector()
                rested_after(detector, 2.0)
                rested_after(detector, WINDOW_S, **moved)
                assert not detector.resting


def test_after_a_movement_the_count_begins_again():
    """The detector's moving average has a time constant of half a second. So after the movement two windows still
    exceed the limit."""
    detector = RestDetector()
    rested_after(detector, 1.25)
    assert rested_after(detector, 4.0, force=(0.0, 1.0, 0.03)) == 0.5 + 1.5
    detector = RestDetector()
    rested_after(detector, 9.75, rolling=True)
    assert rested_after(detector, 14.0, force=(0.0, 1.0, 0.03), rolling=True) == 0.5 + 10.0


def test_a_steady_rate_is_bias_only_before_the_first_rest():
    for axis in range(3):
        rates = [0.05 * (axis == i) for i in range(3)]
        assert rested_after(RestDetector(), 3.0, rates) == 1.5
        assert rested_after(RestDetector(False), 12.0, rates) is None
        detector = RestDetector()
        rested_after(detector, 3.0)
        assert rested_after(detector, 60.0, rates) is None
        # The rate is too large for a bias
        assert rested_after(RestDetector(), 12.0, [3.0 * rate for rate in rates]) is None


def test_the_known_bias_is_not_a_turn():
    assert rested_after(RestDetector(False), 3.0, rates=(0.05, -0.04, 0.03), bias=(0.04, -0.03, 0.02)) == 1.5
    assert rested_after(RestDetector(False), 12.0, rates=(0.05, -0.04, 0.03), bias=(0.04, -0.03, 0.0)) is None


def test_a_wrong_estimate_of_the_bias_does_not_hide_rest():
    """Rest is also found if the rate is small before the estimated bias is subtracted. In this test the calibration's
    bias is right, and the estimated bias is wrong."""
    assert rested_after(RestDetector(False), 3.0, bias=(0.05, 0.0, 0.0)) == 1.5
    assert rested_after(RestDetector(False), 12.0, rates=(0.03, 0.0, 0.0), bias=(0.06, 0.0, 0.0)) is None


def test_rest_is_a_second_and_a_half_of_stillness():
    detector = RestDetector()
    assert not detector.resting
    assert rested_after(detector, 3.0) == 1.5
