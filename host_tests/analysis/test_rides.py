"""The channels of a ride: parts that are left out, warnings, the riding time, and refusals of unusable files."""

from typing import Any

import numpy as np
import pytest
from kickstand_tools import api
from kickstand_tools.analysis.overview import overview
from kickstand_tools.analysis.ride import joined
from kickstand_tools.common.messages import InputError
from kickstand_tools.logs.log import Stretch
from small_rides import ALIGNED, standing_log
from support.recordings import analysis_rides

CAR = api.CalibrationFile(aligned=True, vehicle="car")


def read(log, calibration=ALIGNED, smoothed=False):
    """Return the channels of a ride and the codes of its notices."""
    reading = api.open_ride(log, calibration, smoothed).read()
    return joined(reading.parts()), reading.notices()


def frozen_log():
    """A log of 8 s whose readings repeat from 2 to 6 s."""
    log = standing_log(8.0)
    log.accel_g[200:600], log.gyro_dps[200:600] = log.accel_g[200], log.gyro_dps[200]
    return log


def test_a_ride_has_the_name_of_its_log():
    ride = api.open_ride(standing_log(), ALIGNED)
    assert (ride.name, ride.stem, ride.car, ride.smoothed) == ("trip/RIDE.csv", "RIDE", False, False)
    assert api.open_ride(standing_log(), ALIGNED, smoothed=True).smoothed
    car = api.open_ride(standing_log(), CAR, smoothed=True)
    assert car.car and not car.smoothed


def test_only_the_frozen_time_within_the_stretch_counts():
    total = overview(api.open_ride(frozen_log(), ALIGNED)).summary
    assert (total.frozen_s, total.missing_s) == pytest.approx((4.0, 4.0), abs=0.03)
    part = overview(api.open_ride(Stretch(frozen_log(), 0.0, 1.5), ALIGNED)).summary
    assert part.frozen_s == part.missing_s == 0.0


@pytest.mark.parametrize(("calibration", "codes"), [(ALIGNED, ["readings-misfit"]), (CAR, [])])
def test_readings_that_contradict_each_other_are_noticed(tmp_path, calibration, codes):
    """From 14 s on, the gyro about forward measures 30 % of the rate."""
    log = api.read_log(analysis_rides.short(tmp_path, rate_hz=50))
    log.gyro_dps[log.t_s > 14.0, 2] *= 0.3
    assert [notice.code for notice in read(log, calibration)[1]] == codes


def test_a_car_has_no_lean():
    course, _ = read(standing_log(), CAR)
    assert np.all(np.isnan(course.lean_formula_deg)) and course.lateral_g == pytest.approx(course.left_g)
    assert np.all(np.isnan(course.lean_deg)) and np.all(course.lean_sigma_deg == 0.0)


LOG = "t_s,ax_g,ay_g,az_g,gx_dps,gy_dps,gz_dps\n0,0,1,0,0,0,0\n"


@pytest.mark.parametrize(
    ("content", "calibration", "words"),
    [
        (None, None, r"RIDE\.csv: there is no such file"),
        ("no log\n", None, r"^(?!.*no calibration).*RIDE\.csv"),
        (LOG, None, r"no calibration RIDE\.cal\.json beside it: .*--out .*RIDE\.cal\.json"),
        (LOG, api.CalibrationFile(), r"RIDE\.cal\.json is not aligned"),
    ],
)
def test_a_ride_needs_its_calibration_beside_it(tmp_path, content, calibration, words):
    if content:
        (tmp_path / "RIDE.csv").write_text(content)
    if calibration:
        api.write_calibration(tmp_path / "RIDE.cal.json", calibration)
    with pytest.raises(InputError, match=words):
        api.open_ride(tmp_path / "RIDE.csv")


def test_a_calibration_is_given_or_refused(tmp_path):
    refused: Any = (
        ((standing_log(),), "an open file has no calibration beside it: give one"),
        ((standing_log(), api.CalibrationFile()), "^the calibration is not aligned"),
        ((tmp_path,), "is a directory: give the name of a ride in it"),
    )
    for arguments, words in refused:
        with pytest.raises(InputError, match=words):
            api.open_ride(*arguments)
    (tmp_path / "RIDE.csv").write_text(LOG + "1,0,1,0,0,0,0\n")
    api.write_calibration(tmp_path / "RIDE.cal.json", ALIGNED)
    assert api.open_ride(tmp_path / "RIDE.csv").calibration == ALIGNED


def knocked():
    """The hand that switches the device on knocks it with 0.4 g for 0.02 s."""
    log = standing_log(40.0, 0.05, 1.5)
    log.accel_g[:2, 2] = 0.4
    return log


def changed(seconds=40.0, **columns):
    """A standing bike with a running engine, whose readings change from 20 to 25 s."""
    log = standing_log(seconds, 0.05, 1.5)
    later = (log.t_s > 20.0) & (log.t_s < 25.0)
    log.gyro_dps[later, 1] += columns.get("yaw_dps", 0.0)
    log.accel_g[later, 2] += columns.get("push_g", 0.0)
    log.gyro_dps[:, 1] += columns.get("bias_dps", 0.0)
    return log


@pytest.mark.parametrize(
    ("log", "rides"),
    [
        (standing_log(0.02, 0.003, 0.1), False),
        (standing_log(12.0, 0.003, 0.1), False),
        (standing_log(40.0, 0.05, 1.5), False),  # with a running engine
        (standing_log(40.0, 0.1, 3.0, speed_mps=0.0), False),
        (standing_log(40.0, 0.05, 1.5, bias_dps=5.0), False),
        (standing_log(40.0, 0.05, 1.5, speed_mps=0.9), False),
        (standing_log(40.0, 0.05, 1.5, speed_mps=1.1), True),
        (Stretch(standing_log(40.0, 0.05, 1.5), 5.0, 30.0), True),  # it may be a straight at constant speed
        (knocked(), False),
        (changed(yaw_dps=2.4), False),
        (changed(yaw_dps=3.6), True),
        (changed(push_g=-0.035), False),
        (changed(push_g=-0.065), True),
        (changed(bias_dps=9.0), False),
    ],
)
def test_a_standing_bike_is_not_riding(log, rides):
    assert (overview(api.open_ride(log, ALIGNED)).riding_s > 0.0) is rides


@pytest.mark.parametrize("speed_hz", [0, 5])
def test_riding_time_excludes_standing(tmp_path, speed_hz):
    """The bike stands for 4 s before the ride and for 4 s after it."""
    ride_overview = overview(api.open_ride(analysis_rides.short(tmp_path, speed_hz=speed_hz, rate_hz=50)))
    assert ride_overview.summary.duration_s - ride_overview.riding_s == pytest.approx(8.0, abs=2.0)
