"""Vectorised values equal the firmware's at every step, and thinning keeps the means."""

from dataclasses import fields

import numpy as np
import pytest
from kickstand_tools.analysis.channels import Channels, downsampled, joined
from kickstand_tools.analysis.ride import open_ride
from kickstand_tools.analysis.summary import Summary
from kickstand_tools.logs import reader
from kickstand_tools.replay import replay_engine
from support.recordings import analysis_rides


@pytest.fixture(scope="module")
def ride(tmp_path_factory):
    return open_ride(analysis_rides.short(tmp_path_factory.mktemp("ride"), rate_hz=200, speed_hz=1), None)


@pytest.fixture(scope="module")
def course(ride) -> Channels:
    return joined(list(ride.blocks()))


def test_smoothed_ride_differs_only_in_its_lean(ride, course):
    smoothed = joined(open_ride(ride.log, ride.calibration, smoothed=True).blocks())
    other = {"lean_deg", "lean_sigma_deg", "lateral_g", "sure"}
    for name in (field.name for field in fields(Channels)):
        same = np.array_equal(getattr(smoothed, name), getattr(course, name), equal_nan=True)
        assert same == (name not in other), name
    assert np.any(smoothed.trusted)


def test_maxima_are_those_of_the_display(ride):
    """The maxima are the same for any division into blocks."""
    log = reader.read_log(ride.log)
    engine = replay_engine.Replay(ride.calibration.to_firmware())
    for row in log.rows():
        engine.take(*row)
    meter, summary = engine.meter, Summary()
    whole = joined(list(ride.blocks()))
    for start in range(0, len(whole.t_s), 777):
        summary.add(whole.part(slice(start, start + 777)))
    # the display finds maxima in windows of 150 ms that begin every 75 ms, the summary in windows from every sample
    assert meter.max_left_deg - 0.01 < summary.left_deg.value < meter.max_left_deg + 0.5
    assert meter.max_right_deg - 0.01 < summary.right_deg.value < meter.max_right_deg + 0.5
    assert summary.left_deg.value > 25
    assert summary.right_deg.value > 38
    assert summary.brake_g.value == meter.max_brake_g > 0.5
    assert summary.accel_g.value == meter.max_accel_g > 0.3
    assert summary.right_deg.time_s is not None
    assert whole.lean_deg[np.searchsorted(whole.t_s, summary.right_deg.time_s)] == summary.right_deg.value
    assert 3.0 < summary.beyond_s[40.0] < summary.beyond_s[30.0] < 9.0
    assert np.sum(summary.histogram_s) <= summary.riding_s + 1e-6


def test_time_without_readings_does_not_count(course):
    part = course.part(slice(0, 400))
    summary, gone = Summary(), Summary()
    for total, pause_s in (summary, 0.0), (gone, 60.0):
        total.add(part)
        later = part.part(slice(None))
        later.t_s = part.t_s + part.t_s[-1] + 0.005 + pause_s
        total.add(later)
    assert gone.duration_s == pytest.approx(summary.duration_s + 60.0)
    assert gone.riding_s <= summary.riding_s


@pytest.mark.parametrize("block", [100, 100_000])
def test_thinned_ride_is_the_mean_of_each_stretch(course, block):
    parts = [course.part(slice(start, start + block)) for start in range(0, len(course.t_s), block)]
    thin = joined(list(downsampled(parts, 0.02)))
    n = len(course.t_s) // 4
    assert len(thin.t_s) in (n, n + 1)
    for name in "t_s", "lean_deg", "forward_g":
        want = getattr(course, name)[: 4 * n].reshape(n, 4).mean(axis=1)
        assert np.allclose(getattr(thin, name)[:n], want)
    assert np.count_nonzero(~np.isnan(thin.speed_mps)) == np.count_nonzero(~np.isnan(course.speed_mps))
    slow = course.part(slice(0, None, 10))  # a log with few samples per second is not thinned
    assert np.array_equal(joined(list(downsampled([slow], 0.02))).lean_deg, slow.lean_deg, equal_nan=True)


def part(n=100, **changed) -> Channels:
    """Return one second of riding straight ahead at 100 samples per second. All values are certain."""
    zero = np.zeros(n)
    columns = {field.name: zero for field in fields(Channels)}
    columns |= {"t_s": np.arange(n) / 100.0, "sure": np.ones(n)}
    columns |= dict.fromkeys(("speed_mps", "lat_deg", "lon_deg", "utc_s"), np.full(n, np.nan))
    return Channels(**columns | {name: np.asarray(values, dtype=float) for name, values in changed.items()})


def test_uncertain_lean_counts_only_as_uncertain():
    """30 of the 100 samples are uncertain and have the largest values of the ride. Samples of a fallen bike also count
    as uncertain."""
    sure = np.ones(100)
    sure[20:50] = 0.0
    lean = np.where(sure > 0.0, 32.0, 50.0)
    lean[75:] = -64.9
    lean[95:] = -65.1
    total = Summary()
    total.add(part(sure=sure, lean_deg=lean, shown_g=np.where(sure > 0.0, -0.3, 0.9)))
    assert total.not_sure_s == pytest.approx(0.30 + 0.05)
    assert (total.right_deg.value, total.left_deg.value) == (32.0, 64.9)
    assert (total.right_deg.time_s, total.left_deg.time_s) == (0.0, 0.75)
    assert (total.brake_g.value, total.accel_g.value) == (0.3, 0.0)
    assert total.accel_g.time_s is None
    assert total.beyond_s == {30.0: pytest.approx(0.64), 40.0: pytest.approx(0.20)}
    assert np.sum(total.histogram_s) == pytest.approx(0.64)
    assert total.histogram_s[70 + 32] == pytest.approx(0.44)
    assert total.histogram_s[70 - 65] == pytest.approx(0.20)
    assert total.riding_s == pytest.approx(0.99)


def test_time_at_rest_is_not_riding_time():
    resting = np.zeros(100)
    resting[60:] = 1.0
    total = Summary()
    total.add(part(resting=resting, lean_deg=np.full(100, 12.0)))
    assert total.riding_s == pytest.approx(0.59)
    assert np.sum(total.histogram_s) == pytest.approx(0.59)
    assert total.duration_s == pytest.approx(0.99)


def test_empty_column_of_joined_parts_takes_no_memory(course):
    first, second, third = (course.part(slice(a, a + 1000)) for a in (0, 1000, 2000))
    first.temp_c = second.temp_c = third.temp_c = first.speed_mps = np.full(1000, np.nan)
    whole = joined(iter([first, second, third]))
    assert whole.temp_c.strides == (0,) and len(whole.temp_c) == 3000
    assert np.all(np.isnan(whole.speed_mps[:1000])) and not np.all(np.isnan(whole.speed_mps[1000:]))
    for field in fields(Channels):
        parts = np.concatenate([getattr(part, field.name) for part in (first, second, third)])
        assert np.array_equal(getattr(whole, field.name), parts, equal_nan=True), field.name


def test_channels_are_those_of_the_meter(ride, course):
    log = reader.read_log(ride.log)
    engine = replay_engine.Replay(ride.calibration.to_firmware())
    rows, shown, rolling, trusted = [], [], [], []
    for row in log.rows():
        rows.append(engine.step(*row))
        shown.append(engine.meter.smooth_force[2])
        rolling.append(engine.meter.filter.rolling)
        trusted.append(engine.meter.trusted)
    for name, column in zip(replay_engine.COLUMNS, np.transpose(rows)):
        # test_meter_along.py tests the other columns
        if name not in ("static_lean_deg", "lean_formula_deg", "lean_sigma_deg"):
            assert np.max(np.abs(getattr(course, name) - column)) < 1e-5, name
    assert np.array_equal(course.shown_g, shown)
    assert np.array_equal(course.rolling, rolling)
    assert 0.2 < np.mean(rolling) < 0.9  # the ride has bends and straights
    assert np.array_equal(course.trusted, trusted)
