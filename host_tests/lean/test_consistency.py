"""Tests how the lean filter checks itself: misfits, the end of a doubt, and the code of repeated misfits. Also runs on
MicroPython."""

from math import cos, radians, sin

from bike_motion import DT_US, force_and_rate, meter, near, ride, roll, speed_up
from kickstand.calibration.parameters import Calibration
from kickstand.lean import consistency
from kickstand.lean.consistency import HOLDS_S, Consistency

WINDOW_S = 0.2


def windows(judge, seconds, left=0.0, up=0.0, sideways=0.0, pitch=0.0, push=0.0, lean=0.0, yaw_rate=0.1, **more):
    """Judge equal windows for some seconds. Return the number of misfits.

    more: `shaken`, a force that is added to left and up, and whose sign alternates from window to window.
        `rate_left`, measured where a steady bend has 0.1 rad/s. `fast`.
    """
    shaken, fast, misfits = more.get("shaken", 0.0), more.get("fast", 0.0) > 0.0, 0
    for _ in range(int(seconds / WINDOW_S + 0.5)):
        if "rate_left" in more:
            judge.compare(0.1, more["rate_left"], 0.0, WINDOW_S)
        misfits += judge.add(left + shaken, up + shaken, sideways, pitch, push, lean, yaw_rate, WINDOW_S, fast)
        shaken = -shaken
    return misfits


def doubted(times=1):
    judge = Consistency()
    while judge.doubts < times:  # misfits within 3 s count once
        windows(judge, WINDOW_S, left=4.0)
    return judge


def test_each_kind_of_misfit_is_found_in_its_time():
    """The rows are the kind, its value, a time that is too short, and a time that is long enough. Vibration, a real
    slope, and larger means on a rough road are no misfits."""
    steep, never = radians(10.0), 0.0
    for least_s, most_s, kind in (
        (0.4, 1.0, {"left": -4.0}),
        (0.4, 1.0, {"up": -4.0}),
        (1.0, 3.2, {"left": 1.5}),
        (1.0, 3.2, {"up": 1.5}),
        (5.0, 20.0, {"left": -0.6}),
        (60.0, never, {"left": -0.6, "yaw_rate": 0.0}),  # wind leans the bike on a straight
        (5.0, 20.0, {"up": 0.6}),
        (5.0, 40.0, {"left": 0.45, "up": 0.31}),  # each alone fits
        (60.0, never, {"left": 0.45}),
        (1.0, 1.8, {"sideways": 0.3}),
        (3.0, 4.6, {"sideways": -0.18}),  # a slip by 10 degrees
        (60.0, never, {"sideways": 0.11}),
        (3.0, 4.6, {"sideways": 0.18, "yaw_rate": 0.0, "fast": 1.0}),
        (60.0, never, {"sideways": 0.11, "yaw_rate": 0.0, "fast": 1.0}),
        (3.0, 11.0, {"pitch": radians(-20.0)}),
        (3.0, 60.0, {"left": 0.6, "shaken": 0.5}),  # the limits grow with the spread
        (1.0, 4.0, {"pitch": steep, "push": -steep}),  # the force of a slope is missing
        (1.0, 4.0, {"pitch": -steep, "push": steep}),
        (30.0, never, {"pitch": steep}),
        (6.0, 11.0, {"rate_left": 0.2}),  # the lean is too small or too large for the rate about left
        (9.0, 16.0, {"rate_left": 0.05}),
        (60.0, never, {"rate_left": 0.13}),
        (60.0, never, {"shaken": 3.0}),
        (30.0, never, {"left": 0.55, "shaken": 1.5}),
        (30.0, never, {"up": 0.55, "shaken": 1.5}),
    ):
        judge = Consistency()
        assert not windows(judge, least_s, **kind) and not judge.doubt, kind
        assert bool(windows(judge, most_s - least_s, **kind)) == (most_s > 0.0), kind
    judge = Consistency()
    for _ in range(10):  # a rider who accelerates down a slope soon brakes on it
        assert not sum([windows(judge, 2.0, pitch=radians(-8.0), push=push) for push in (0.4, -0.8)])


def test_a_lean_is_believed_again_when_it_has_fitted_for_a_while():
    judge = doubted()
    windows(judge, HOLDS_S[0] - WINDOW_S)
    assert judge.doubt
    windows(judge, 1.0)
    assert not judge.doubt and judge.doubts == 1
    windows(judge, consistency.FORGET_S + 1.0)
    assert judge.doubts == 0
    judge = doubted()
    assert not windows(judge, 2.0) + windows(judge, 0.8, left=2.0)  # a doubtful fit is no fit
    windows(judge, HOLDS_S[0] - 0.4)
    assert judge.doubt


def test_after_a_lean_that_fitted_only_briefly_the_doubt_is_longer():
    for fitted_s, doubt_s in (6.0, HOLDS_S[1] + 5.0), (12.0, HOLDS_S[1] + 11.0), (30.0, HOLDS_S[1] - WINDOW_S):
        judge = doubted()
        windows(judge, HOLDS_S[0] + 1.0 + fitted_s)
        while judge.doubts < 2:
            windows(judge, WINDOW_S, left=4.0)
        windows(judge, doubt_s)
        assert judge.doubt, fitted_s
        windows(judge, 3.0)
        assert not judge.doubt, fitted_s


def test_after_a_doubt_a_smaller_error_is_a_misfit_if_the_six_positions_were_done():
    for six_done in True, False:
        judge = Consistency(six_done)
        assert not windows(judge, 60.0, left=0.44)
        while not judge.doubt:
            windows(judge, WINDOW_S, left=4.0)
        windows(judge, HOLDS_S[0] + 1.0)
        assert bool(windows(judge, 60.0, left=0.44)) == six_done


def test_a_lean_that_the_rate_about_left_does_not_confirm_is_hidden():
    """The rows are the number of doubts, the lean, the rate about left of a steady bend and the measured rate in deg/s,
    a time, and whether the lean is unsure after it."""

    def compared(judge, lean_deg, expected_dps, measured_dps, seconds):
        for _ in range(int(seconds / WINDOW_S)):
            windows(judge, WINDOW_S, lean=radians(lean_deg))
            judge.compare(radians(expected_dps), radians(measured_dps), 0.0, WINDOW_S)
        return judge.unsure

    for doubts, lean_deg, expected_dps, measured_dps, seconds, unsure in (
        (0, 9.0, 0.8, 0.2, 60.0, False),
        (1, 9.0, 0.8, 0.2, 6.0, True),  # a straight that seems a bend
        (1, 9.0, 0.8, 0.6, 60.0, False),
        (1, 3.0, 0.0, 0.6, 60.0, False),  # slopes
        (1, 35.0, 8.0, 7.0, 60.0, False),
        (3, 35.0, 8.0, 8.0, 4.0, True),
    ):
        judge = doubted(doubts)
        assert compared(judge, lean_deg, expected_dps, measured_dps, seconds) == unsure, (doubts, lean_deg, seconds)
        assert not compared(judge, 0.0, 0.0, 0.0, 15.0)
    judge = Consistency()
    windows(judge, 3.0, left=4.0, lean=radians(30.0))
    assert compared(judge, -30.0, 6.0, 6.0, 4.0)  # a mirrored rate makes a bend seem a bend to the other side
    assert not compared(judge, 0.0, 0.0, 0.0, 4.0) and not compared(judge, -30.0, 6.0, 6.0, 8.0)


def test_repeated_misfits_are_reported():
    assert doubted(2).odd is None and doubted(3).odd == consistency.last_odd == "odd-left"
    for kind, code in ({"up": 4.0}, "odd-up"), ({"pitch": 0.6}, "odd-pitch"):
        judge = Consistency()
        while judge.odd is None:
            windows(judge, 1.0, **kind)
        assert judge.odd == code
    judge = doubted()
    assert windows(judge, 2.8, left=4.0) > 1 and judge.doubts == 1  # these misfits have the same cause
    for left, rate_up in (1.0, 0.1), (1.0, 0.5), (-9.0, 0.5):  # exchanged sides, and a moment that seems right
        judge.add_rates(left, rate_up, 1.0, WINDOW_S)
        windows(judge, 4.0, left=4.0)
    assert judge.odd == "turned"
    judge = doubted(4)
    windows(judge, 100.0, yaw_rate=0.0)
    assert judge.doubt  # in the end only turns show that it fits again
    windows(judge, HOLDS_S[3] + 1.0, yaw_rate=0.1)
    assert not judge.doubt and judge.odd is None
    judge = doubted(3)
    windows(judge, HOLDS_S[2] + 1.0, yaw_rate=0.0, rate_left=0.0)  # or the biases are those before the misfits
    assert not judge.doubt and judge.odd is None


def weave(shown, seconds, bias_dps=0.0, gain=1.0, turn=lambda values: values, measured_mps=-1.0):
    """Ride bends of 25 degrees to alternate sides at 15 m/s, 5 s each. The bike is upright in the last 5 s. A generator
    of the true lean after each sample, and whether a lean is shown that is wrong by over 8 degrees.

    bias_dps, gain: error of the measured roll rate.
    turn: function that turns the sensor, from the vehicle's axes.
    measured_mps: the speed that is measured once per second. A negative value means no speed.
    """
    lean_deg = 0.0
    for k in range(int(seconds / 0.01)):
        target = 0.0 if k >= (seconds - 5.0) / 0.01 else 25.0 if k // 500 % 2 else -25.0
        rate_dps = max(-40.0, min(40.0, (target - lean_deg) / 0.01))
        force, rate = force_and_rate(lean_deg, 15.0, rate_dps)
        if k % 100 == 0:
            shown.measure_speed(measured_mps)
        rate[2] = gain * rate[2] + radians(bias_dps)
        shown.update_in_vehicle(turn(force), turn(rate), DT_US)
        lean_deg += rate_dps * 0.01
        yield lean_deg, shown.trusted and abs(shown.lean_deg - lean_deg) > 8.0


def riding():
    lean_meter = speed_up(ride(meter(), 3.0), 0.0, 15.0, 5.0)
    list(weave(lean_meter, 40.0))
    assert lean_meter.trusted
    return lean_meter


def test_a_fault_of_the_gyro_is_hidden_soon():
    """After the fault come 40 s of bends. A lean that is wrong by over 8 degrees is shown only briefly. A stepped bias
    is learned. A mirrored rate is named."""
    for error, most_wrong_s in ({"bias_dps": 6.0}, 3.0), ({"gain": -1.0}, 1.5):
        lean_meter = riding()
        results = [(wrong, lean_meter.trusted) for _, wrong in weave(lean_meter, 40.0, **error)]
        assert sum([wrong for wrong, _ in results]) < 100 * most_wrong_s, error
        assert (sum([trusted for _, trusted in results]) < 800) == ("gain" in error)
        if "gain" in error:
            assert lean_meter.odd in ("odd-left", "odd-up", "odd-pitch")
        else:
            for lean_deg, _ in weave(lean_meter, 20.0, **error):
                near(lean_meter.lean_deg, lean_deg, 6.0)
            assert lean_meter.trusted


def test_with_a_measured_speed_a_wrong_lean_is_hidden_sooner():
    for bias_dps in -6.0, 4.0:
        without, measured = [
            sum([wrong for _, wrong in weave(riding(), 40.0, bias_dps, measured_mps=speed_mps)])
            for speed_mps in (-1.0, 15.0)
        ]
        assert measured < 0.8 * without


def test_a_wrong_measured_speed_does_not_hide_a_correct_lean_for_long():
    """A fault of the gyro has ended. Then the measured speed is too small, or the receiver falls silent."""
    for bias_dps in -5.0, 8.0:
        for measured_mps in 9.0, -1.0:
            lean_meter = riding()
            list(weave(lean_meter, 10.0, bias_dps, measured_mps=15.0))
            hidden = sum([not lean_meter.trusted for _ in weave(lean_meter, 45.0, measured_mps=measured_mps)])
            assert lean_meter.trusted and hidden < 100 * 8.0


def test_a_long_bend_shows_whether_the_yaw_rate_is_wrong():
    """In a steady bend only the rate about left contradicts a wrong rate about up. The rate about left also confirms
    the lean after a fault that ends."""
    rows = (25.0, -1.0, 0.0, 40, False), (-15.0, 1.0, -10.0, 40, False), (20.0, 1.0, 10.0, 4, True)
    for lean_deg, gain, bias_dps, seconds, shown in rows:
        lean_meter, wrong = roll(riding(), 0.0, lean_deg, 15.0), 0
        force, rate = force_and_rate(lean_deg, 15.0)
        spoilt = [rate[0], gain * rate[1] + radians(bias_dps), rate[2]]
        for k in range(4000):
            lean_meter.update_in_vehicle(force, rate if k < 200 or k > 200 + 100 * seconds else spoilt, DT_US)
            wrong += lean_meter.trusted and abs(lean_meter.lean_deg - lean_deg) > 8.0
            assert not shown or k < 200 + 100 * (seconds + 8) or lean_meter.trusted
        assert wrong < 300


def test_a_turned_sensor_is_named_and_hidden():
    """SIDE is wrong, or the mount slips by 90 degrees in pitch or by 10 degrees in roll. A mount that slips back is
    forgotten."""
    s, c = sin(radians(10.0)), cos(radians(10.0))
    for turn, code, most_wrong_s in (
        (lambda values: [-values[0], values[1], -values[2]], "turned", 1.0),
        (lambda values: [values[0], -values[2], values[1]], None, 2.0),
        (lambda values: [c * values[0] + s * values[1], c * values[1] - s * values[0], values[2]], "mount-moved", 0.3),
    ):
        shown = riding()
        assert sum([wrong for _, wrong in weave(shown, 30.0, turn=turn)]) < 100 * most_wrong_s
        assert not shown.trusted and shown.odd == code
    list(weave(shown, 15.0))
    assert shown.trusted and shown.odd is None


def test_a_shaking_bike_on_its_kickstand_has_not_slipped():
    """Its engine hides that it stands. Only bends prove that a bike is in balance."""
    for yaw_rate, odd in (0.0, None), (0.1, "mount-moved"):
        judge = Consistency()
        windows(judge, 20.0, sideways=-0.21, lean=-0.21, yaw_rate=yaw_rate)
        assert (judge.odd, judge.doubt) == (odd, odd is not None)
    windows(judge, 4.0, sideways=-0.21, yaw_rate=0.0)
    assert judge.doubt
    windows(judge, 20.0, yaw_rate=0.0)  # a long straight in balance
    assert (judge.odd, judge.doubt) == (None, False)


def test_an_impossible_lean_does_not_last():
    """After a blow the gyro shows a roll of 150 degrees within 0.1 s, but the bike has not rolled."""
    lean_meter = riding()
    for _ in range(10):
        lean_meter.update_in_vehicle(force_and_rate(0.0, 15.0)[0], [0.0, 0.0, radians(1500.0)], DT_US)
    assert abs(lean_meter.lean_deg) > 80.0
    list(weave(lean_meter, 3.0))
    assert not lean_meter.trusted
    list(weave(lean_meter, 15.0))
    assert abs(lean_meter.lean_deg) < 40.0


def test_a_wrong_gyro_on_a_bike_that_rides_is_no_fall():
    shown = riding()
    samples = [(abs(shown.lean_deg), shown.fallen) for _ in weave(shown, 20.0, bias_dps=25.0)]
    assert max(samples)[0] > 65.0 and not sum([fallen for _, fallen in samples])


def test_a_long_smooth_bend_at_power_on_shows_no_lean_of_a_stand():
    lean_meter = meter()
    for _ in range(3000):
        lean_meter.update_in_vehicle(*force_and_rate(12.0, 25.0), DT_US)
        assert not lean_meter.trusted or abs(lean_meter.lean_deg - 12.0) < 5.0


def test_a_stop_of_a_cold_sensor_hides_no_lean():
    """Its bias has changed by 1.5 deg/s since the calibration, but has fitted the ride before the stop."""
    cold = Calibration()
    cold.gyro_bias[2] = -1.5
    lean_meter = speed_up(ride(meter(cold), 5.0), 0.0, 15.0, 5.0)
    list(weave(lean_meter, 30.0, bias_dps=1.5))
    ride(speed_up(lean_meter, 15.0, 0.0, 4.0), 5.0)
    assert lean_meter.at_rest and lean_meter.trusted
