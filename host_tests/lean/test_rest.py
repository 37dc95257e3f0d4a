"""What counts as standing still, met from both sides of each limit. Runs on MicroPython too."""

from kickstand.lean.rest import RestDetector

WINDOW_S = 0.25
NO_BIAS = [0.0, 0.0, 0.0]
LEVEL = [0.0, 1.0, 0.0]


def feel(detector, seconds, rates=(0.0, 0.0, 0.0), force=(0.0, 1.0, 0.0), bias=(0.0, 0.0, 0.0), **rolling):
    """Windows of the same means; returns after how many seconds it first was at rest, None if never."""
    found = None
    for k in range(int(seconds / WINDOW_S + 0.5)):
        left_over = [rate - error for rate, error in zip(rates, bias)]
        detector.update(left_over, list(force), list(bias), WINDOW_S, **rolling)
        if detector.resting and found is None:
            found = (k + 1) * WINDOW_S
    return found


def unit(axis, value, base=(0.0, 0.0, 0.0)):
    return [base[i] + (value if i == axis else 0.0) for i in range(3)]


def test_rest_is_a_second_and_a_half_of_stillness():
    detector = RestDetector()
    assert not detector.resting
    assert feel(detector, 3.0) == 1.5


def test_where_it_seems_to_roll_rest_takes_ten_seconds():
    assert feel(RestDetector(), 12.0, rolling=True) == 10.0
    detector = RestDetector()
    feel(detector, 5.0, rolling=True)
    assert feel(detector, 3.0) == 1.5  # from where nothing speaks for rolling any more
    assert feel(detector, 3.0, rolling=True) == 2.0  # ten seconds are enough either way


def test_a_step_of_10_mg_or_half_a_degree_a_second_is_a_movement():
    for axis in range(3):
        for step, moved in ((0.0098, False), (0.0102, True), (-0.0098, False), (-0.0102, True)):
            detector = RestDetector()
            feel(detector, 2.0)
            feel(detector, 0.25, force=unit(axis, step, LEVEL))
            assert detector.resting is not moved, (axis, step)
        for step, moved in ((0.0088, False), (0.0092, True), (-0.0088, False), (-0.0092, True)):
            detector = RestDetector()
            feel(detector, 2.0)
            feel(detector, 0.25, rates=unit(axis, step))
            assert detector.resting is not moved, (axis, step)


def test_after_a_movement_the_count_begins_again():
    """The recent average follows with a time constant of half a second: two windows of four are over the limit."""
    detector = RestDetector()
    feel(detector, 1.25)
    assert feel(detector, 4.0, force=unit(2, 0.03, LEVEL)) == 0.5 + 1.5
    detector = RestDetector()
    feel(detector, 9.75, rolling=True)
    assert feel(detector, 14.0, force=unit(2, 0.03, LEVEL), rolling=True) == 0.5 + 10.0


def test_a_window_longer_than_the_average_replaces_it():
    detector = RestDetector()
    for _ in range(2):
        detector.update(NO_BIAS, list(LEVEL), NO_BIAS, 1.0)
    assert detector.resting
    moved = unit(0, 0.05, LEVEL)
    rested = []
    for _ in range(3):
        detector.update(NO_BIAS, list(moved), NO_BIAS, 1.0)
        rested.append(detector.resting)
    assert rested == [False, False, True]


def test_before_the_first_rest_a_bias_may_be_five_degrees_a_second():
    for axis in range(3):
        for sign in (1.0, -1.0):
            assert feel(RestDetector(), 3.0, rates=unit(axis, sign * 0.099)) == 1.5
            assert feel(RestDetector(), 12.0, rates=unit(axis, sign * 0.101)) is None


def test_after_it_one_degree_a_second():
    """More than that is a smooth turn, whose bias is known well by then."""
    for axis in range(3):
        for sign in (1.0, -1.0):
            assert feel(RestDetector(False), 3.0, rates=unit(axis, sign * 0.0198)) == 1.5
            assert feel(RestDetector(False), 12.0, rates=unit(axis, sign * 0.0202)) is None
            detector = RestDetector()
            feel(detector, 3.0)
            assert feel(detector, 60.0, rates=unit(axis, sign * 0.0202)) is None


def test_the_bias_that_is_known_is_no_turn():
    assert feel(RestDetector(False), 3.0, rates=(0.05, -0.04, 0.03), bias=(0.04, -0.03, 0.02)) == 1.5
    assert feel(RestDetector(False), 12.0, rates=(0.05, -0.04, 0.03), bias=(0.04, -0.03, 0.0)) is None


def test_an_estimate_of_the_bias_that_went_astray_does_not_hide_a_rest():
    """The rate is small without it: so the calibration's bias was right."""
    assert feel(RestDetector(False), 3.0, bias=(0.05, 0.0, 0.0)) == 1.5
    assert feel(RestDetector(False), 12.0, rates=(0.03, 0.0, 0.0), bias=(0.06, 0.0, 0.0)) is None
