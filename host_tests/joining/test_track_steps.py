"""The steps, speeds and segments of a track, and the weights of its errors, are compared with numbers computed by
hand."""

import numpy as np
import pytest
from kickstand_tools.joining import fit
from kickstand_tools.joining.track import Course, Track, course, segments, without_trend

METRE = 1.0 / 111_194.9  # one metre in degrees of latitude, and at the equator also of longitude


def track(utc_s, east_m, north_m, speed_mps=None):
    n = len(utc_s)
    speed = np.full(n, np.nan) if speed_mps is None else np.array(speed_mps)
    return Track(np.array(utc_s, float), np.array(north_m) * METRE, np.array(east_m) * METRE, speed, "t")


def test_a_track_of_ten_points_a_second_is_thinned_to_one():
    quick = track(np.arange(35) / 10.0 + 100.0, np.arange(35.0), np.zeros(35))
    assert quick.once_a_second().utc_s.tolist() == [100.0, 101.0, 102.0, 103.0]
    assert quick.once_a_second().lon_deg == pytest.approx(np.array([0.0, 10.0, 20.0, 30.0]) * METRE)
    for step_s, same in ((0.69, False), (0.71, True)):
        one = track(np.arange(20) * step_s, np.zeros(20), np.zeros(20))
        assert (one.once_a_second() is one) is same
    single = track([5.0], [0.0], [0.0])
    assert single.once_a_second() is single


def test_a_course_turns_to_the_left_by_hand():
    """The track goes 20 m east, 20 m north, 20 m west, 3 m west and 400 m west. The last two steps are not good: one is
    too slow, and one is too fast."""
    found = course(track([0, 1, 2, 3, 5, 6], [0, 20, 20, 0, -3, -403], [0, 0, 20, 20, 20, 20]))
    assert found.begin_s.tolist() == [0, 1, 2, 3, 5] and found.end_s.tolist() == [1, 2, 3, 5, 6]
    assert found.speed_mps == pytest.approx([20.0, 20.0, 20.0, 1.5, 400.0], rel=1e-3)
    assert found.good.tolist() == [True, True, True, False, False]
    assert found.turn_deg == pytest.approx([0.0, 90.0, 90.0, 0.0, 0.0], abs=0.01)
    # An error of 1 m to the side over 20 m is 2.865 degrees. Combined with the other errors of 4 degrees, the standard
    # deviation is 4.920 degrees.
    assert found.sigma_deg[:3] == pytest.approx(4.920, abs=0.005)


@pytest.mark.parametrize(
    ("step_s", "step_m", "good"), [(1.0, 2.4, False), (1.0, 2.6, True), (1.0, 99.0, True), (1.0, 101.0, False),
     (5.9, 60.0, True), (6.1, 60.0, False)],
)  # fmt: skip
def test_a_step_is_good_between_a_walk_and_a_jump(step_s, step_m, good):
    assert course(track([0.0, step_s], [0.0, step_m], [0.0, 0.0])).good.tolist() == [good]


def test_speeds_without_their_own_are_means_over_four_steps():
    east = np.cumsum([0.0, 10.0, 10.0, 20.0, 20.0, 20.0, 20.0, 1.0, 1.0, 1.0, 1.0])
    found = track(np.arange(11.0), east, np.zeros(11)).speeds_mps()
    assert np.isnan(found[[0, 1, 8, 9, 10]]).all()  # speeds are unknown at both ends and below 2.5 m/s
    assert found[2:8] == pytest.approx([15.0, 17.5, 20.0, 15.25, 10.5, 5.75], rel=1e-3)
    assert track([0, 1], [0, 9], [0, 0], [3.0, np.nan]).speeds_mps()[0] == 3.0
    assert np.isnan(track(np.arange(4.0), np.arange(4.0) * 9, np.zeros(4)).speeds_mps()).all()


def test_segments_have_thirty_steps_and_at_least_eight():
    """The 47 good steps before a bad step give segments of 30 and 17 steps. The 7 good steps after the bad step are too
    few for a segment. Mean and trend are subtracted from each segment, so a constant bend gives zeros."""
    n = 55
    good = np.ones(n, dtype=bool)
    good[47] = False
    t_s = np.arange(n + 1.0)
    found = segments(Course(t_s[:-1], t_s[1:], np.full(n, 2.0), np.full(n, 9.0) + t_s[:-1], good, np.full(n, 3.0)))
    assert found.begin_s.shape == (2, 30)
    assert found.begin_s[1, :17].tolist() == list(range(30, 47))
    assert found.course_weight[0] == pytest.approx(np.full(30, 0.25))
    assert found.course_weight[1].tolist() == [0.25] * 17 + [0.0] * 13
    assert found.turned_deg[0] == pytest.approx(np.zeros(30), abs=1e-9)
    assert found.speed_mps[0] == pytest.approx(np.zeros(30), abs=1e-9)
    assert found.middle_s[0, :2].tolist() == [0.5, 1.5]


def test_a_trend_is_subtracted_by_weight():
    """The points are (0, 0), (1, 0) and (2, 3). If the last point has the weight 0, the trend is the line 0."""
    weight = np.array([[1.0, 1.0, 0.0]])
    found = without_trend(np.array([[0.0, 0.0, 3.0]]), weight, np.array([[0.0, 1.0, 2.0]]))
    assert found == pytest.approx(np.array([[0.0, 0.0, 3.0]]))
    even = without_trend(np.array([[0.0, 0.0, 3.0]]), np.ones((1, 3)), np.array([[0.0, 1.0, 2.0]]))
    assert even == pytest.approx(np.array([[0.5, -1.0, 0.5]]))  # the trend is the line -0.5 + 1.5 t


def test_an_outlier_weighs_less_by_students_distribution():
    """Four errors have a weight of 1. The sizes of the errors are 1, 1, 1 and 4, with the median 1. The standard
    deviation s is the median divided by 0.6745, so s is 1.4826. With f degrees of freedom, the new weight of an error e
    is (1 + 1 / f) / (1 + (e / s)^2 / f) / s^2."""
    f, usual = fit._FREEDOM, 1.0 / 0.6745
    error = np.array([[1.0, -1.0, 1.0, 4.0, 9.0]])
    weight = np.array([[1.0, 1.0, 1.0, 1.0, 0.0]])
    by_hand = [(1.0 + 1.0 / f) / (1.0 + (e / usual) ** 2 / f) / usual**2 for e in (1.0, 1.0, 1.0, 4.0)]
    assert fit._robust_weights(error, weight) == pytest.approx(np.array([[*by_hand, 0.0]]))
