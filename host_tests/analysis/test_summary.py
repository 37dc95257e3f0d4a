"""Channels, maxima, times and alignment quality of small rides, computed by hand."""

from dataclasses import fields

import numpy as np
import pytest
from kickstand.lean.kalman import MAX_TRIM
from kickstand_tools.analysis.overview import LeanCost, Peak, Summary, lean_cost, quality, summary, yaw_cost_deg
from kickstand_tools.analysis.ride import (
    Channels,
    LogTrack,
    downsampled,
    joined,
    open_ride,
    rounded_to,
    spacing_s,
    thinned,
    track,
)
from kickstand_tools.logs import reader
from kickstand_tools.replay import replay_engine
from small_rides import quality_of, samples
from support.recordings import analysis_rides

NAN = np.nan


def test_the_lean_is_not_trusted_from_65_degrees():
    course = samples(4, lean_deg=np.array([64.9, 65.0, -65.0, 10.0]), sure=np.array([1.0, 1.0, 1.0, 0.0]))
    assert course.trusted.tolist() == [True, False, False, False]


def test_forces_and_rates_are_along_left_up_forward():
    course = samples(1, left_g=1.0, up_g=2.0, forward_g=3.0, pitch_rate_dps=4.0, yaw_rate_dps=5.0, roll_rate_dps=6.0)
    assert course.force_g.tolist() == [[1.0, 2.0, 3.0]] and course.rate_dps.tolist() == [[-4.0, 5.0, 6.0]]


def test_samples_are_averaged_over_each_stretch():
    """Each stretch of 0.02 s has two samples. A NaN does not count. The last position of a stretch is kept."""
    lean, lat = np.array([1.0, 3.0, NAN, 5.0, NAN, NAN]), np.array([1.0, 2.0, 3.0, NAN, NAN, NAN])
    course = samples(6, lean_deg=lean, lat_deg=lat)
    thin = joined(downsampled([course.part(slice(0, 3)), course.part(slice(3, 6))], 0.02))
    assert thin.t_s == pytest.approx([0.005, 0.025, 0.045])
    assert thin.lean_deg == pytest.approx([2.0, 5.0, NAN], nan_ok=True)
    assert thin.lat_deg == pytest.approx([2.0, 3.0, NAN], nan_ok=True)
    assert thinned(course, 0.01) is course and len(thinned(course, 0.02).t_s) == 3
    assert len(thinned(samples(2, t_s=np.array([0.004, 0.016])), 0.02).t_s) == 1
    assert rounded_to(np.array([0.014, 0.016]), 0.01) == pytest.approx([0.01, 0.02])
    assert spacing_s(course) == pytest.approx(0.01) and spacing_s(samples(1)) == 1.0


def test_a_peak_keeps_the_first_of_the_largest_values():
    peak = Peak()
    for t_s, values, expected in (
        ([1.0, 2.0, 3.0], [-1.0, -2.0, NAN], (0.0, None)),
        ([4.0, 5.0, 6.0], [2.0, NAN, 2.0], (2.0, 4.0)),
        ([7.0], [2.0], (2.0, 4.0)),
        ([], [], (2.0, 4.0)),
        ([8.0], [NAN], (2.0, 4.0)),
    ):
        peak.add(np.array(t_s), np.array(values))
        assert (peak.value, peak.time_s) == expected


@pytest.mark.parametrize("size", [50, 1000])
def test_a_maximum_of_the_lean_must_be_held(size):
    """A lean of 40 degrees lasts for one sample. Leans to each side last for a second, over several blocks."""
    lean = np.zeros(1000)
    lean[100], lean[200:301], lean[500:601] = 40.0, 35.0, -30.0
    course, total = samples(1000, lean_deg=lean), Summary()
    for begin in range(0, 1000, size):
        total.add(course.part(slice(begin, begin + size)))
    assert (total.right_deg.value, total.left_deg.value) == (35.0, 30.0)
    assert total.right_deg.time_s == pytest.approx(2.0) and total.left_deg.time_s == pytest.approx(5.0)
    assert (total.samples, total.duration_s) == (1000, pytest.approx(9.99))


def test_a_summary_by_hand():
    """The bike leans by 30 degrees from 2 to 4 s, and by 40 degrees from 4 to 5 s. From 6 to 7 s the lean is uncertain.
    From 8 s on the bike is at rest."""
    t_s, lean, sure, resting = np.arange(1000) / 100.0, np.zeros(1000), np.ones(1000), np.zeros(1000)
    lean[200:400], lean[400:500], lean[600:700], sure[600:700], resting[800:] = 30.0, 40.0, 60.0, 0.0, 1.0
    displayed_g = np.where(t_s < 1.0, 0.3, np.where(t_s < 2.0, -0.6, np.where(sure > 0.0, 0.0, 2.0)))
    total = summary(samples(1000, lean_deg=lean, sure=sure, resting=resting, shown_g=displayed_g, speed_mps=t_s))
    assert (total.accel_g.value, total.brake_g.value, total.brake_g.time_s) == (0.3, 0.6, 1.0)
    assert total.beyond_s == pytest.approx({30.0: 3.0, 40.0: 1.0}) and total.not_sure_s == pytest.approx(1.0)
    assert total.riding_s == pytest.approx(8.0, abs=0.011)
    assert float(np.sum(total.histogram_s)) == pytest.approx(7.0, abs=0.011)
    assert total.histogram_s[[100, 110]] == pytest.approx([2.0, 1.0])  # bins of one degree from -70 degrees on
    assert (total.speed_mps.value, total.speed_mps.time_s) == (9.99, 9.99)
    assert (total.missing_s, total.frozen_s) == (0.0, 0.0)


def test_time_without_readings_is_missing():
    t_s = np.arange(500) / 100.0
    t_s[250:] += 3.0
    total = summary(samples(500, t_s=t_s + 7.0))
    assert (total.missing_s, total.duration_s, total.riding_s) == pytest.approx((3.01, 7.99, 4.98))
    assert summary(samples(100, step_s=0.5)).missing_s == 0.0  # two samples per second are no gaps
    assert (summary(samples(1)).samples, summary(samples(1)).duration_s) == (1, 0.0)


def test_the_alignment_of_a_straight_ride_by_hand():
    """The bike leans by 2 degrees to the right. A tenth of its braking and acceleration is along left."""
    n, push = 10_000, 0.2 * np.where(np.arange(10_000) // 100 % 2, 1.0, -1.0)
    still = (np.arange(n) < 500) | (np.arange(n) >= n - 500)
    push, tilt = np.where(still, 0.0, push), np.tan(np.radians(2.0))
    course = samples(n, left_g=tilt + 0.1 * push, up_g=1.0, forward_g=push + np.where(still, 0.0, 0.05))
    angles = quality(course, still)
    assert (angles.roll_deg, angles.yaw_deg) == pytest.approx((2.0, np.degrees(np.arctan(0.1))), abs=0.01)
    assert angles.pitch_deg == pytest.approx(np.degrees(np.arcsin(0.05)), abs=0.01)
    assert angles.gravity_g == pytest.approx(np.hypot(1.0, tilt)) and angles.straight_s == pytest.approx(90.0)
    assert len(angles.forward_g) == 180


def test_an_error_of_the_alignment_costs_lean():
    """Yaw costs 3 degrees times its sine, pitch 5 degrees times its sine, and roll the part that no trim corrects."""
    assert yaw_cost_deg(-30.0) == pytest.approx(1.5)
    cost = lean_cost(quality_of(-9.0, -30.0, 30.0))
    trim = float(np.degrees(MAX_TRIM))
    assert (cost.roll_deg, cost.pitch_deg, cost.yaw_deg) == pytest.approx((9.0 - trim, 2.5, 1.5))
    assert lean_cost(quality_of()) == LeanCost(None, None, None)


def test_positions_are_interpolated_except_in_gaps():
    """From -179 to 179 degrees the short way crosses the meridian of 180 degrees."""
    positions = LogTrack(np.array([0.0, 4.0, 10.0]), np.array([1.0, 3.0, 4.0]), np.array([179.0, -179.0, -178.0]))
    lat, lon = positions.at(np.array([-1.0, 0.0, 1.0, 4.0, 7.0, 10.0, 11.0]))
    assert lat == pytest.approx([NAN, 1.0, 1.5, 3.0, NAN, 4.0, NAN], nan_ok=True)
    assert lon == pytest.approx([NAN, 179.0, 179.5, -179.0, NAN, -178.0, NAN], nan_ok=True)
    assert not np.isnan(LogTrack(np.array([0.0, 5.0]), np.zeros(2), np.zeros(2)).at(np.array([2.0]))[0][0])
    part = track(samples(3, lat_deg=np.array([1.0, NAN, 2.0]), lon_deg=np.array([3.0, 4.0, NAN])))
    assert part.lat_deg.tolist() == [1.0] and part.lon_deg.tolist() == [3.0]
    single = LogTrack(np.array([5.0]), np.array([1.0]), np.array([2.0])).at(np.array([4.9, 5.0, 5.1]))
    assert np.array(single) == pytest.approx(np.array([[NAN, 1.0, NAN], [NAN, 2.0, NAN]]), nan_ok=True)
    assert np.isnan(LogTrack(*[np.zeros(0)] * 3).at(np.array([1.0]))).all()


def test_channels_and_maxima_are_those_of_the_display(tmp_path):
    """The channels equal the firmware's meter at each step."""
    ride = open_ride(analysis_rides.short(tmp_path, rate_hz=50))
    log, engine = reader.read_log(ride.log), replay_engine.Replay(ride.calibration.to_firmware())
    rows, displayed_g, rolling, trusted = [], [], [], []
    for row in log.rows():
        rows.append(engine.step(*row))
        displayed_g.append(engine.meter.smooth_force[2])
        rolling.append(engine.meter.filter.rolling)
        trusted.append(engine.meter.trusted)
    course, meter = joined(list(ride.read().parts())), engine.meter
    for name, column in zip(replay_engine.COLUMNS, np.transpose(rows)):
        if name not in ("static_lean_deg", "lean_formula_deg", "lean_sigma_deg"):
            assert np.max(np.abs(getattr(course, name) - column)) < 1e-5, name
    assert np.array_equal(course.shown_g, displayed_g) and np.array_equal(course.trusted, trusted)
    assert np.array_equal(course.rolling, rolling) and 0.2 < np.mean(rolling) < 0.9  # bends and straights
    total = summary(course)
    # the display finds maxima in windows of 150 ms that begin every 75 ms, the summary in windows from every sample
    assert meter.max_left_deg - 0.01 < total.left_deg.value < meter.max_left_deg + 0.5 and total.left_deg.value > 25
    assert meter.max_right_deg - 0.01 < total.right_deg.value < meter.max_right_deg + 0.5
    assert (total.brake_g.value, total.accel_g.value) == (meter.max_brake_g, meter.max_accel_g)


def test_a_smoothed_ride_differs_in_lean_and_standstills(short_ride):
    live, smoothed = (joined(open_ride(short_ride, None, smoothed=smooth).read().parts()) for smooth in (False, True))
    names = {field.name for field in fields(Channels)}
    equal = {name for name in names if np.allclose(getattr(smoothed, name), getattr(live, name), 0, 1e-12, True)}
    assert names - equal == {"lean_deg", "lean_sigma_deg", "lateral_g", "sure", "resting", "rolling"}
    assert np.array_equal(smoothed.sure > 0.0, smoothed.lean_sigma_deg <= 3.0) and np.any(smoothed.trusted)
