"""The data that a report reads from a ride, the parts that it leaves out, and its messages."""

from dataclasses import replace

import numpy as np
import pytest
from kickstand_tools import api
from kickstand_tools.analysis import ride as rides
from kickstand_tools.analysis.brake_tests import car_channels
from kickstand_tools.analysis.overview import overview
from kickstand_tools.checks.mount import ForwardExchanged
from kickstand_tools.common.errors import InputError
from kickstand_tools.logs.frozen import FrozenReadings
from kickstand_tools.logs.log import Stretch
from support.small_rides import STOP

ALIGNED = api.CalibrationFile(aligned=True)
CAR = replace(ALIGNED, vehicle="car")


def standing(seconds=4.0, hz=100.0, frozen=(), name="trip/RIDE.csv") -> api.Log:
    """A log of a bike that stands upright, with the noise of a sensor. frozen: (first, last) sample that repeats."""
    n = round(seconds * hz)
    noise = np.random.default_rng(1).normal(0.0, 0.002, (n, 6))
    if frozen:
        noise[slice(*frozen)] = noise[frozen[0]]
    return api.Log(np.arange(n) / hz, noise[:, :3] + [0.0, 1.0, 0.0], noise[:, 3:], name=name)


def read(ride, notices=None):
    found = list(ride.blocks(notices=notices))
    return np.concatenate([block.t_s for block in found]), found


def test_a_ride_has_the_name_of_its_log():
    ride = api.open_ride(standing(), ALIGNED)
    assert (ride.name, ride.stem, ride.car, ride.smoothed) == ("trip/RIDE.csv", "RIDE", False, False)
    assert (
        api.open_ride(standing(), CAR, smoothed=True).car and not api.open_ride(standing(), CAR, smoothed=True).smoothed
    )
    assert api.open_ride(standing(), ALIGNED, smoothed=True).smoothed


def test_a_stretch_has_only_its_samples():
    whole, _ = read(api.open_ride(standing(), ALIGNED))
    part, _ = read(api.open_ride(Stretch(standing(), 1.0, 2.0), ALIGNED))
    assert len(whole) == 400 and 99 <= len(part) <= 101
    assert (part[0], part[-1]) == pytest.approx((1.0, 2.0), abs=0.011)


def test_frozen_readings_are_left_out():
    notices: list = []
    t_s, _ = read(api.open_ride(standing(8.0, frozen=(200, 600)), ALIGNED), notices)
    assert [notice.code for notice in notices] == ["frozen-readings"]
    assert 400 <= len(t_s) <= 402 and np.max(np.diff(t_s)) == pytest.approx(4.0, abs=0.03)


def test_a_stretch_of_frozen_readings_is_refused():
    with pytest.raises(InputError, match=r"RIDE\.csv: all readings are frozen"):
        read(api.open_ride(Stretch(standing(8.0, frozen=(200, 600)), 3.0, 5.0), ALIGNED))


@pytest.mark.parametrize(("hz", "codes"), [(12.0, []), (8.0, ["smooth-slow"])])
def test_a_slow_log_cannot_be_smoothed(hz, codes):
    notices: list = []
    read(api.open_ride(standing(40.0, hz), ALIGNED, smoothed=True), notices)
    assert [notice.code for notice in notices if notice.code == "smooth-slow"] == codes
    read(api.open_ride(standing(40.0, hz), ALIGNED), live := [])
    assert not live


@pytest.mark.parametrize(("diverges", "at_s"), [((), None), ((0,), 0.0), ((300, 301, 600), 3.0)])
def test_a_lean_that_diverges_is_reported_once(monkeypatch, diverges, at_s):
    lean_along, notices = rides._lean_along, []

    def diverging(along, block, shown):
        found, variance, odd = lean_along(along, block, shown)
        variance[list(diverges)] = -1e-9
        return found, variance, odd

    monkeypatch.setattr(rides, "_lean_along", diverging)
    log = standing(8.0)
    log.gyro_dps[250, 2], log.gyro_dps[650, 2] = 900.0, 5000.0
    read(api.open_ride(log, ALIGNED), notices)
    absurd = [notice for notice in notices if isinstance(notice, rides.AbsurdReadings)]
    assert [notice.at_s for notice in absurd] == ([] if at_s is None else [at_s])
    if at_s:
        assert absurd[0].rate_dps == pytest.approx(900.0)


@pytest.mark.parametrize(("sigma_deg", "trusted"), [(2.9, 1.0), (3.0, 1.0), (3.1, 0.0), (np.nan, 0.0)])
def test_a_smoothed_lean_is_trusted_up_to_3_degrees(monkeypatch, sigma_deg, trusted):
    def smooth_blocks(log, calibration, progress, notices, lines):
        for block in api_blocks(log):
            n = len(block.time_us)
            yield block, np.tile([25.0, sigma_deg, 0.0, 0.0, 1.0], (n, 1))

    from kickstand_tools.logs.reader import read_blocks as api_blocks

    monkeypatch.setattr(rides, "smooth_blocks", smooth_blocks)
    _, blocks = read(api.open_ride(standing(), ALIGNED, smoothed=True))
    assert set(blocks[0].sure) == {trusted} and set(blocks[0].lean_deg) == {25.0} and set(blocks[0].doubtful) == {1.0}
    assert blocks[0].lean_sigma_deg[0] == pytest.approx(sigma_deg, nan_ok=True)


def test_a_car_has_no_lean():
    (block,) = car_channels(standing(), CAR)
    assert np.all(np.isnan(block.lean_deg)) and np.all(np.isnan(block.lean_formula_deg)) and len(block.t_s) == 400
    assert block.lateral_g == pytest.approx(block.left_g)
    (seen,) = api.open_ride(standing(), CAR).blocks()
    assert np.all(np.isnan(seen.lean_deg)) and np.all(seen.lean_sigma_deg == 0.0)


def test_what_a_ride_without_calibration_needs(tmp_path):
    with pytest.raises(InputError, match="an open file has no calibration beside it: give one"):
        api.open_ride(standing())
    with pytest.raises(InputError, match=r"^the calibration is not aligned"):
        api.open_ride(standing(), api.CalibrationFile())
    path = tmp_path / "RIDE.csv"
    with pytest.raises(InputError, match=r"RIDE\.csv: there is no such file"):
        api.open_ride(path)
    with pytest.raises(InputError, match="is a directory: give the name of a ride in it"):
        api.open_ride(tmp_path)
    path.write_text("no log\n")
    with pytest.raises(InputError) as refused:
        api.open_ride(path)
    assert "no calibration" not in str(refused.value)
    path.write_text("t_s,ax_g,ay_g,az_g,gx_dps,gy_dps,gz_dps\n0,0,1,0,0,0,0\n")
    with pytest.raises(InputError, match=r"no calibration RIDE\.cal\.json beside it: .*--out .*RIDE\.cal\.json"):
        api.open_ride(path)
    api.write_calibration(tmp_path / "RIDE.cal.json", api.CalibrationFile())
    with pytest.raises(InputError, match=r"RIDE\.cal\.json is not aligned"):
        api.open_ride(path)
    api.write_calibration(tmp_path / "RIDE.cal.json", ALIGNED)
    assert api.open_ride(path).calibration == ALIGNED


class Fixed(rides.Ride):
    """A ride whose blocks add these notices."""

    said: tuple = ()

    def blocks(self, progress=None, notices=None):
        yield from super().blocks(progress)
        if notices is not None:
            notices += self.said


@pytest.mark.parametrize(("stretch", "frozen_s"), [(False, 7.0), (True, 0.0)])
def test_frozen_time_of_a_stretch_is_no_more_than_its_missing_time(stretch, frozen_s):
    log = Stretch(standing(20.0), 2.0, 12.0) if stretch else standing(20.0)
    ride = Fixed(log, ALIGNED)
    ride.said = (FrozenReadings(2, 7.0, 1.0, 3.0),)
    assert overview(ride).summary.frozen_s == pytest.approx(frozen_s)


def test_no_stops_are_shown_if_forward_is_exchanged(monkeypatch):
    from kickstand_tools.analysis import overview as overviews

    monkeypatch.setattr(overviews, "stops_of", lambda course, still: [STOP])
    ride = Fixed(standing(20.0), ALIGNED)
    assert overview(ride).stops == [STOP] and overview(ride).exchanged is None
    ride.said = (ForwardExchanged(False, "left", None),)
    found = overview(ride)
    assert found.stops == [] and found.exchanged is not None and found.exchanged.roll_deg == found.quality.roll_deg


def test_a_speed_that_is_always_0_is_no_speed():
    log = standing(20.0)
    log.speed_mps = np.zeros(2000)
    found = overview(api.open_ride(log, ALIGNED))
    assert not found.has_speed and np.all(np.isnan(found.course.speed_mps)) and found.riding_s == 0.0
    log.speed_mps = np.where(np.arange(2000) < 1000, 5.0, 0.0)
    found = overview(api.open_ride(log, ALIGNED))
    assert found.has_speed and np.nanmax(found.course.speed_mps) == 5.0
    assert np.all(np.isnan(found.course.temp_c)) and np.all(np.isnan(found.course.utc_s))
