"""Tests how the lean filter checks itself, with misfits, the end of a doubt, and the code of repeated misfits."""

from math import radians

from bike_motion import DT_US, force_and_rate, meter, near, ride, roll, speed_up
from kickstand.calibration.parameters import Calibration
from kickstand.lean import consistency
from kickstand.lean.consistency import Consistency
from kickstand.lean.lean_filter import LeanFilter

WINDOW_S = 0.2


def windows(judge, seconds, left=0.0, up=0.0, sideways=0.0, pitch=0.0, push=0.0, lean=0.0, yaw_rate=0.0, shaken=0.0):
    """Judge equal windows for some seconds. Return the number of misfits.

    shaken: force that is added to left and up. The sign of this force alternates from window to window.
    """
    failed = 0
    for _ in range(int(seconds / WINDOW_S + 0.5)):
        failed += judge.add(left + shaken, up + shaken, sideways, pitch, push, lean, yaw_rate, WINDOW_S)
        shaken = -shaken
    return failed


def doubted(times=1):
    judge = Consistency()
    while times:
        times -= windows(judge, WINDOW_S, left=4.0)
    return judge


def test_vibration_is_no_reason_to_doubt():
    judge = Consistency()
    assert windows(judge, 60.0, shaken=3.0) == 0
    assert not judge.doubt


def test_on_a_rougher_road_larger_means_are_sound():
    for name in ("left", "up"):
        judge = Consistency()
        assert windows(judge, 30.0, **{name: 0.55})
        judge = Consistency()
        assert not windows(judge, 30.0, **{name: 0.55}, shaken=1.5)


def test_large_misfits_are_doubted_sooner_than_small_ones():
    for name in ("left", "up"):
        for size, least_s, most_s in ((4.0, 0.4, 1.0), (1.5, 1.0, 3.2), (0.6, 5.0, 20.0)):
            judge = Consistency()
            assert not windows(judge, least_s, **{name: -size}), (name, size)
            assert windows(judge, most_s - least_s, **{name: -size}), (name, size)


def test_a_force_to_the_side_and_a_steep_pitch_do_not_last():
    for name, value in (("sideways", 0.3), ("pitch", radians(-20.0))):
        judge = Consistency()
        assert not windows(judge, 3.0, **{name: value})
        assert windows(judge, 8.0, **{name: value})


def test_a_pitch_without_its_force_does_not_last():
    """On a real slope gravity is in the forward force. A rider who accelerates down a slope soon brakes on it."""
    judge = Consistency()
    assert not windows(judge, 30.0, pitch=radians(10.0))
    pitch = radians(10.0)
    for sign in (1.0, -1.0):
        judge = Consistency()
        assert not windows(judge, 1.0, pitch=sign * pitch, push=-sign * pitch)
        assert windows(judge, 3.0, pitch=sign * pitch, push=-sign * pitch)
    judge = Consistency()
    for _ in range(10):
        assert not windows(judge, 2.0, pitch=radians(-8.0), push=0.4)
        assert not windows(judge, 2.0, pitch=radians(-8.0), push=-0.8)


def test_it_is_believed_again_when_it_has_fitted_for_a_while():
    judge = doubted()
    windows(judge, consistency.HOLDS_S[0] - WINDOW_S)
    assert judge.doubt
    windows(judge, 2 * WINDOW_S)
    assert not judge.doubt


def test_a_doubtful_fit_is_no_fit():
    judge = doubted()
    windows(judge, 2.0)
    assert not windows(judge, 0.8, left=2.0)
    windows(judge, consistency.HOLDS_S[0] - 0.4)
    assert judge.doubt


def test_after_a_doubt_a_straight_that_seems_a_bend_is_hidden():
    judge = doubted()
    windows(judge, 20.0, lean=radians(9.0))
    assert judge.doubt and judge.one_sided
    windows(judge, 20.0)
    assert not judge.doubt and not judge.one_sided
    windows(judge, 20.0, lean=radians(9.0))
    assert judge.one_sided
    judge = Consistency()
    windows(judge, 60.0, lean=radians(9.0))
    assert not judge.one_sided


def test_bends_to_either_side_and_deep_ones_are_believed():
    judge = doubted()
    for lean_deg in (30.0, -20.0, 30.0, -20.0):
        windows(judge, 3.0, lean=radians(lean_deg))
        assert not judge.one_sided
    judge = doubted()
    windows(judge, 8.0, lean=radians(35.0))
    assert not judge.one_sided
    windows(judge, 4.0, lean=radians(35.0))
    assert judge.one_sided


def test_repeated_misfits_are_reported():
    assert doubted(2).odd is None
    judge = doubted(3)
    assert judge.odd == consistency.last_odd == "odd-left"
    judge = Consistency()
    while judge.odd is None:
        windows(judge, 1.0, up=4.0)
    assert judge.odd == "odd-up"


def test_in_the_end_only_turns_show_that_it_fits_again():
    judge = doubted(4)
    windows(judge, 100.0)
    assert judge.doubt
    windows(judge, consistency.HOLDS_S[3] + 1.0, yaw_rate=0.1)
    assert not judge.doubt
    assert judge.odd is None


def test_a_doubt_is_forgotten_after_a_minute_that_fits():
    judge = doubted()
    windows(judge, consistency.HOLDS_S[0] + 1.0)
    assert judge.doubts == 1
    windows(judge, consistency.FORGET_S + 1.0)
    assert judge.doubts == 0


def test_after_a_gap_it_must_fit_or_rest_first():
    judge = Consistency()
    judge.gap()
    windows(judge, 3.0)
    assert judge.doubt
    judge.rest(WINDOW_S)
    assert not judge.doubt
    judge.gap(False)
    judge.rest(60.0)
    assert judge.doubt


def weave(shown, seconds, bias_dps=0.0, gain=1.0, then=lambda lean_deg: None):
    """Ride bends of 25 degrees to alternate sides at 15 m/s, 5 s each. The bike is upright in the last 5 s.

    bias_dps, gain: error of the measured roll rate.
    then: function that is called with the true lean after each sample.
    """
    lean_deg, target = 0.0, 25.0
    for k in range(int(seconds / 0.01)):
        if k % 500 == 0:
            target = -target
        if k >= (seconds - 5.0) / 0.01:
            target = 0.0
        rate_dps = max(-40.0, min(40.0, (target - lean_deg) / 0.01))
        force, rate = force_and_rate(lean_deg, 15.0, rate_dps)
        rate[2] = gain * rate[2] + radians(bias_dps)
        shown.update_in_vehicle(force, rate, DT_US)
        lean_deg += rate_dps * 0.01
        then(lean_deg)


def riding():
    shown = ride(meter(), 3.0)
    speed_up(shown, 0.0, 15.0, 5.0)
    weave(shown, 40.0)
    assert shown.trusted
    return shown


def longest_wrong_s(shown, **error):
    """Ride 40 s of bends.

    Returns:
        wrong_s: longest time during which the shown lean has an error of over 8 degrees.
        share: share of the time in which a lean is shown.
    """
    seen = [0.0, 0.0, 0]

    def look(lean_deg):
        wrong = shown.trusted and abs(shown.lean_deg - lean_deg) > 8.0
        seen[0] = seen[0] + 0.01 if wrong else 0.0
        seen[1] = max(seen[1], seen[0])
        seen[2] += shown.trusted

    weave(shown, 40.0, then=look, **error)
    return seen[1], seen[2] / 4000.0


def test_a_bias_that_has_stepped_is_found_again():
    shown = riding()
    wrong_s, share = longest_wrong_s(shown, bias_dps=6.0)
    assert wrong_s < 2.5
    assert share > 0.3
    weave(shown, 20.0, bias_dps=6.0, then=lambda lean_deg: near(shown.lean_deg, lean_deg, 6.0))
    assert shown.trusted


def test_a_mirrored_roll_rate_is_hidden_and_named():
    shown = riding()
    wrong_s, share = longest_wrong_s(shown, gain=-1.0)
    assert wrong_s < 1.5
    assert share < 0.3
    assert shown.odd in ("odd-left", "odd-up", "odd-pitch")


def test_an_impossible_lean_does_not_last():
    """The filter's lean jumps by 150 degrees, as after a blow that the gyro could not measure."""
    shown = riding()
    shown.filter._x[0] += radians(150.0)
    weave(shown, 3.0)
    assert not shown.trusted
    weave(shown, 15.0)
    assert abs(shown.lean_deg) < 40.0


def test_a_bike_that_has_fallen_stays_so():
    shown = roll(ride(meter(), 5.0), 0.0, 85.0)
    ride(shown, 10.0, lean_deg=85.0)
    assert shown.fallen
    assert shown.odd is None


def test_a_measured_speed_vetoes_rest():
    """The readings are as calm as at rest, with a measured speed of 20 m/s or of 0."""
    for speed_mps, rests in ((20.0, False), (0.0, True)):
        estimator = LeanFilter()
        for k in range(1500):
            if k % 100 == 0:
                estimator.measure_speed(speed_mps)
            estimator.update([0.0, 1.0, 0.0], [0.0, 0.0, 0.0], DT_US if k else 0)
        assert estimator.at_rest == rests


def test_a_speed_from_before_a_gap_vetoes_no_rest():
    estimator = LeanFilter()
    for k in range(100):
        estimator.measure_speed(20.0)
        estimator.update([0.0, 1.0, 0.0], [0.0, 0.0, 0.0], DT_US if k else 0)
    estimator.restart()
    for _ in range(200):
        estimator.update([0.0, 1.0, 0.0], [0.0, 0.0, 0.0], DT_US)
    assert estimator.at_rest


def test_an_accelerometer_of_six_positions_has_the_narrow_limits():
    """The narrow limits also apply if the six positions have not measured the gyro, as in version 0.4.0."""
    for six_done in (True, False):
        calibration = Calibration()
        calibration.six_done = six_done
        judge = meter(calibration).filter.consistency
        assert bool(windows(judge, 30.0, up=0.55)) == six_done


def test_a_long_smooth_bend_at_power_on_shows_no_lean_of_a_stand():
    shown = meter()
    force, rate = force_and_rate(12.0, 25.0)
    for _ in range(3000):
        shown.update_in_vehicle(force, rate, DT_US)
        assert not shown.trusted or abs(shown.lean_deg - 12.0) < 5.0
