"""Tests the channels, the summary, the quality and the track of small rides. The results were computed by hand."""

import numpy as np
import pytest
from kickstand.lean.upright_trim import MAX_TRIM
from kickstand_tools import api
from kickstand_tools.analysis import overview as overviews, track
from kickstand_tools.analysis.alignment_quality import LeanCost, Quality, lean_cost, quality, yaw_cost_deg
from kickstand_tools.analysis.channels import downsampled, joined, rounded_to, spacing_s, thinned
from kickstand_tools.analysis.ride import AbsurdReadings, _divergence_notice
from kickstand_tools.analysis.summary import Peak, Summary, summary
from kickstand_tools.logs.reader import read_blocks
from support.small_rides import made


def test_the_lean_is_not_trusted_from_65_degrees():
    course = made(4, lean_deg=np.array([64.9, 65.0, -65.0, 10.0]), sure=np.array([1.0, 1.0, 1.0, 0.0]))
    assert course.trusted.tolist() == [True, False, False, False]


def test_forces_and_rates_are_along_left_up_forward():
    course = made(1, left_g=1.0, up_g=2.0, forward_g=3.0, pitch_rate_dps=4.0, yaw_rate_dps=5.0, roll_rate_dps=6.0)
    assert course.force_g.tolist() == [[1.0, 2.0, 3.0]] and course.rate_dps.tolist() == [[-4.0, 5.0, 6.0]]


def test_samples_are_averaged_over_each_stretch():
    """Each stretch of 0.02 s has two samples. A NaN does not count. The last position of a stretch is kept."""
    lean, lat = np.array([1.0, 3.0, np.nan, 5.0, np.nan, np.nan]), np.array([1.0, 2.0, 3.0, np.nan, np.nan, np.nan])
    course = made(6, lean_deg=lean, lat_deg=lat)
    found = joined(downsampled([course.part(slice(0, 3)), course.part(slice(3, 6))], 0.02))
    assert found.t_s == pytest.approx([0.005, 0.025, 0.045])
    assert found.lean_deg == pytest.approx([2.0, 5.0, np.nan], nan_ok=True)
    assert found.lat_deg == pytest.approx([2.0, 3.0, np.nan], nan_ok=True)
    assert thinned(course, 0.01) is course and len(thinned(course, 0.02).t_s) == 3
    assert rounded_to(np.array([0.014, 0.016]), 0.01) == pytest.approx([0.01, 0.02])
    assert spacing_s(course) == pytest.approx(0.01) and spacing_s(made(1)) == 1.0


def test_a_peak_keeps_the_first_of_the_largest_values():
    peak = Peak()
    peak.add(np.array([1.0, 2.0, 3.0]), np.array([-1.0, -2.0, np.nan]))
    assert (peak.value, peak.time_s) == (0.0, None)
    peak.add(np.array([4.0, 5.0, 6.0]), np.array([2.0, np.nan, 2.0]))
    peak.add(np.array([7.0]), np.array([2.0]))
    assert (peak.value, peak.time_s) == (2.0, 4.0)
    peak.add(np.zeros(0), np.zeros(0))
    peak.add(np.array([8.0]), np.array([np.nan]))
    assert peak.value == 2.0


def test_a_maximum_of_the_lean_must_be_held():
    """A lean of 40 degrees lasts for one sample and does not count. Leans of 35 degrees to the right and 30 degrees to
    the left last for a second and count."""
    lean = np.zeros(1000)
    lean[100], lean[200:301], lean[500:601] = 40.0, 35.0, -30.0
    total = summary(made(1000, lean_deg=lean))
    assert (total.right_deg.value, total.left_deg.value) == (35.0, 30.0)
    assert total.right_deg.time_s == pytest.approx(2.0) and total.left_deg.time_s == pytest.approx(5.0)
    parts = Summary()
    course = made(1000, lean_deg=lean)
    for begin in range(0, 1000, 50):  # a lean may continue over several blocks
        parts.add(course.part(slice(begin, begin + 50)))
    assert (parts.right_deg.value, parts.left_deg.value) == (35.0, 30.0)
    assert (parts.samples, parts.duration_s) == (1000, pytest.approx(9.99))


def test_a_summary_by_hand():
    """The ride takes 10 s. The bike leans by 30 degrees from 2 to 4 s, and by 40 degrees from 4 to 5 s. From 6 to 7 s
    the lean is uncertain. From 8 s on the bike is at rest."""
    t_s, lean, sure, rest = np.arange(1000) / 100.0, np.zeros(1000), np.ones(1000), np.zeros(1000)
    lean[200:400], lean[400:500], lean[600:700], sure[600:700], rest[800:] = 30.0, 40.0, 60.0, 0.0, 1.0
    shown = np.where(t_s < 1.0, 0.3, np.where(t_s < 2.0, -0.6, np.where(sure > 0.0, 0.0, 2.0)))
    total = summary(made(1000, lean_deg=lean, sure=sure, resting=rest, shown_g=shown, speed_mps=t_s))
    assert (total.accel_g.value, total.brake_g.value, total.brake_g.time_s) == (0.3, 0.6, 1.0)
    assert total.beyond_s == pytest.approx({30.0: 3.0, 40.0: 1.0})
    assert total.not_sure_s == pytest.approx(1.0)
    assert total.riding_s == pytest.approx(8.0, abs=0.011)
    assert float(np.sum(total.histogram_s)) == pytest.approx(7.0, abs=0.011)
    # the bins are one degree wide and begin at -70 degrees
    assert total.histogram_s[[100, 110]] == pytest.approx([2.0, 1.0])
    assert (total.speed_mps.value, total.speed_mps.time_s) == (9.99, 9.99)
    assert (total.missing_s, total.frozen_s) == (0.0, 0.0)


def test_time_without_readings_is_missing():
    t_s = np.arange(500) / 100.0
    t_s[250:] += 3.0
    total = summary(made(500, t_s=t_s + 7.0))
    assert total.missing_s == pytest.approx(3.01) and total.duration_s == pytest.approx(7.99)
    assert total.riding_s == pytest.approx(4.98)
    assert summary(made(100, step_s=0.5)).missing_s == 0.0  # two samples per second are no gaps


def test_the_alignment_of_a_straight_ride_by_hand():
    """The bike always leans by 2 degrees to the right. The bike brakes and accelerates by 0.2 g. A tenth of this force
    is along left."""
    n, push = 10_000, 0.2 * np.where(np.arange(10_000) // 100 % 2, 1.0, -1.0)
    tilt = np.tan(np.radians(2.0))
    standing = (np.arange(n) < 500) | (np.arange(n) >= n - 500)
    push = np.where(standing, 0.0, push)
    course = made(n, left_g=tilt + 0.1 * push, up_g=1.0, forward_g=push + np.where(standing, 0.0, 0.05))
    found = quality(course, standing)
    assert found.roll_deg == pytest.approx(2.0, abs=0.01)
    assert found.yaw_deg == pytest.approx(np.degrees(np.arctan(0.1)), abs=0.01)
    assert found.pitch_deg == pytest.approx(np.degrees(np.arcsin(0.05)), abs=0.01)
    assert found.gravity_g == pytest.approx(np.hypot(1.0, tilt))
    assert found.straight_s == pytest.approx(90.0) and len(found.forward_g) == 180


def test_what_a_ride_must_have_to_show_its_alignment():
    def of(seconds=100.0, yaw_dps=0.0, push_g=0.2, stands=True):
        n = round(seconds * 100)
        standing = np.zeros(n, dtype=bool)
        if stands:
            standing[[*range(100), *range(n - 100, n)]] = True
        push = np.where(np.arange(n) // 100 % 2, push_g, -push_g)
        return quality(made(n, forward_g=push, yaw_rate_dps=yaw_dps), standing)

    assert of(yaw_dps=1.9).roll_deg is not None and of(yaw_dps=2.1).roll_deg is None
    # `seconds` includes 2 s of standstill
    assert of(seconds=12.6).roll_deg is not None and of(seconds=11.4).roll_deg is None
    assert of(push_g=0.06).yaw_deg is not None and of(push_g=0.04).yaw_deg is None
    assert of(seconds=63.0).pitch_deg is not None and of(seconds=61.0).pitch_deg is None
    assert of(stands=False).pitch_deg is None and of(stands=False).gravity_g is None


def test_the_cost_of_an_angle_in_degrees_of_lean():
    """A yaw error costs 3 degrees times its sine, and a pitch error 5 degrees times its sine. A roll error costs the
    part that the trim does not correct."""
    assert yaw_cost_deg(-30.0) == pytest.approx(1.5)
    none = np.zeros(1)
    cost = lean_cost(Quality(-9.0, -30.0, 30.0, 1.0, 30.0, none, none))
    trim = float(np.degrees(MAX_TRIM))
    assert (cost.roll_deg, cost.pitch_deg, cost.yaw_deg) == pytest.approx((9.0 - trim, 2.5, 1.5))
    assert lean_cost(Quality(None, None, None, 1.0, 0.0, none, none)) == LeanCost(None, None, None)


def test_a_vehicle_has_moved_if_it_turned_pushed_or_had_a_speed():
    n = 4000

    def moved(**columns) -> bool:
        return overviews._has_moved(made(n, **columns))

    bump = (np.arange(n) > 2000) & (np.arange(n) < 2500)
    assert moved(yaw_rate_dps=3.1 * bump) and not moved(yaw_rate_dps=2.9 * bump)
    assert moved(forward_g=-0.052 * bump) and not moved(forward_g=0.048 * bump)
    # constant values come from the slope of the ground and the gyro's bias
    assert not moved(forward_g=0.3, yaw_rate_dps=9.0)
    assert moved(speed_mps=1.1) and not moved(speed_mps=0.9, yaw_rate_dps=50.0 * bump)
    assert not overviews._has_moved(made(100, yaw_rate_dps=np.arange(100.0)))
    assert overviews._changes(np.array([1.0, 2.0, 8.0])) == 6.0
    still = np.arange(n) < 1000
    assert overviews._riding_s(made(n), still) == 0.0
    assert overviews._riding_s(made(n), still, whole=False) == pytest.approx(30.0)


def test_positions_are_interpolated_except_in_gaps():
    found = track.LogTrack(np.array([0.0, 4.0, 10.0]), np.array([1.0, 3.0, 4.0]), np.array([179.0, -179.0, -178.0]))
    lat, lon = found.at(np.array([-1.0, 0.0, 1.0, 4.0, 7.0, 10.0, 11.0]))
    assert lat == pytest.approx([np.nan, 1.0, 1.5, 3.0, np.nan, 4.0, np.nan], nan_ok=True)
    assert lon == pytest.approx([np.nan, 179.0, 179.5, -179.0, np.nan, -178.0, np.nan], nan_ok=True)
    five = track.LogTrack(np.array([0.0, 5.0]), np.zeros(2), np.zeros(2))
    assert not np.isnan(five.at(np.array([2.0]))[0][0])
    part = track.track(made(3, lat_deg=np.array([1.0, np.nan, 2.0]), lon_deg=np.array([3.0, 4.0, np.nan])))
    assert part.lat_deg.tolist() == [1.0] and part.lon_deg.tolist() == [3.0]


def test_absurd_readings_are_those_of_the_second_before():
    t_s = np.arange(300) / 100.0
    force, rates = np.tile([0.0, 1.0, 0.0], (300, 1)), np.zeros((300, 3))
    force[50, 0], rates[60, 0] = 99.0, 9999.0  # at 0.5 and 0.6 s, too early for the notice about 2.5 s
    force[160, 2], rates[250, 1] = -30.0, -5000.0
    (block,) = read_blocks(api.Log(t_s, force, rates))
    notice = _divergence_notice(block, 250)
    assert isinstance(notice, AbsurdReadings)
    assert (notice.at_s, notice.rate_dps, notice.force_g) == pytest.approx((2.5, 5000.0, 30.0))
