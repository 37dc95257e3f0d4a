"""Without a speed in the log, a standstill must be proven, and a stop must be plausible. The tests use a simulated
track that is fast and smooth, so that riding resembles a standstill."""

import numpy as np
import pytest
from kickstand_tools.analysis.channels import Channels, downsampled, joined
from kickstand_tools.analysis.ride import open_ride
from kickstand_tools.analysis.stops import brake_test
from kickstand_tools.analysis.stops.brake_test import RATE_S, find_stops
from kickstand_tools.analysis.stops.standstill import standing
from kickstand_tools.calibration.file import write_calibration
from kickstand_tools.calibration.poses import fit_two_positions
from kickstand_tools.simulation.files import simulate


@pytest.fixture(scope="module", params=[1, pytest.param(2, marks=pytest.mark.nightly)])
def track(tmp_path_factory, request) -> Channels:
    """Simulate a smooth, fast ride with held turns and one stop at the end, read by an MPU6050 without a speed."""
    directory = tmp_path_factory.mktemp("track")
    made = simulate("track", request.param, directory, seconds=200.0)
    pair = directory / "KICKSTAND.csv", directory / "UPRIGHT.csv"
    write_calibration(directory / "RIDE.cal.json", fit_two_positions(*pair).calibration)
    whole = joined(list(downsampled(open_ride(directory / "RIDE.csv", None).blocks(), RATE_S)))
    whole.speed_mps = np.interp(whole.t_s, made.time, made.truth["speed_mps"])
    return whole


def without_speed(whole: Channels) -> Channels:
    result = whole.part(slice(None))
    result.speed_mps = np.full(len(whole.t_s), np.nan)
    return result


def test_fast_smooth_track_is_not_a_standstill(track):
    """A calibration by six positions is not needed, because the ride shows the sensor's force at rest."""
    still = standing(without_speed(track))
    assert np.max(track.speed_mps[still]) < 0.5
    assert np.mean(still[track.speed_mps == 0.0]) > 0.9
    (stop,) = find_stops(without_speed(track))
    (true,) = find_stops(track)
    assert stop.mfdd_mps2 == pytest.approx(true.mfdd_mps2, rel=0.03)
    assert stop.initial_speed_mps == pytest.approx(true.initial_speed_mps, rel=0.03)


def test_stop_at_a_false_standstill_is_not_shown(track, monkeypatch):
    """The test marks the fast straights after hard braking as standstills. With the checks of a stop, less than half as
    many stops are found as without them."""
    braked = (track.shown_g < -0.4) & (track.speed_mps > 20.0)
    ends = np.flatnonzero(braked[:-1] & ~braked[1:])
    made_up = np.zeros(len(braked), dtype=bool)
    for end in ends:
        made_up[end + 20 : end + 80] = True
    monkeypatch.setattr(brake_test, "standing", lambda _: made_up)
    assert len(ends) >= 2
    shown = len(find_stops(without_speed(track)))
    monkeypatch.setattr(brake_test, "plausible", lambda *_: True)
    monkeypatch.setattr(brake_test, "closes", lambda *_: True)
    assert shown < 0.5 * len(find_stops(without_speed(track)))


@pytest.mark.parametrize(
    ("mps", "side_m", "heading_deg"), [(80.0, 0.0, 0.0), (20.0, -20.0, 0.0), (20.0, 20.0, 0.0), (20.0, 0.0, -40.0)]
)
def test_implausible_bend_or_speed_is_not_a_stop(mps, side_m, heading_deg):
    """Integrated readings alone do not prove a stop from 288 km/h, a stop that ends 20 m beside the straight line, or a
    stop with a change of heading by 40 degrees."""
    assert brake_test.plausible(60.0, 10.0, 20.0)
    assert not brake_test.plausible(mps, side_m, heading_deg)
