"""Tests `kickstand compare`. The command puts the logs of two devices on one clock and compares their leans."""

import json

import numpy as np
import pytest
from kickstand_tools import api
from kickstand_tools.calibration.file import write_calibration
from kickstand_tools.joining import agreement
from support import command
from support.recordings.drawn_rides import drawn_ride

LATER_S, SLOW = 7.3, 80e-6


def shifted(log, later_s, drift):
    """Return the log of a second device. The device starts later_s after the first, and its clock is slow by the share
    `drift`."""
    kept = log.t_s >= later_s
    t_s = (log.t_s[kept] - later_s) * (1.0 - drift)
    return api.Log(t_s, log.accel_g[kept], log.gyro_dps[kept])


@pytest.fixture(scope="module")
def ride():
    return drawn_ride(1, 130.0, ["firm", "firm"], "street")


@pytest.fixture(scope="module")
def found(ride):
    return api.compare_rides(ride.logs[0], shifted(ride.logs[1], LATER_S, SLOW), *ride.calibrations)


@pytest.fixture(scope="module")
def files(ride, tmp_path_factory):
    directory = tmp_path_factory.mktemp("pair")
    for name, log, calibration in zip("AB", ride.logs, ride.calibrations):
        api.write_log(directory / f"{name}.csv", log)
        write_calibration(directory / f"{name}.cal.json", calibration)
    return directory


def test_the_clocks_are_found(found, ride):
    assert found.clocks.later_s == pytest.approx(LATER_S + 0.5 / 200.0, abs=0.01)
    assert found.clocks.drift == pytest.approx(SLOW, abs=60e-6)
    at_s = np.array([100.0])
    assert found.clocks.of_b(at_s) == pytest.approx((at_s - LATER_S) * (1.0 - SLOW), abs=0.015)
    assert found.clocks.correlation > 0.9


def test_the_difference_is_that_of_both_errors(found, ride):
    """The difference between the leans of the two devices equals the difference between their errors."""
    for kind, seen in (("live", found.live), ("smoothed", found.smoothed)):
        leans = [found.leans[f"{kind} {name}"] for name in "AB"]
        riding = ~np.isnan(leans[0] + leans[1])
        off = [lean[riding] for lean in leans]
        true = np.interp(found.t_s[riding] + ride.logs[0].t_s[0], ride.time_s, ride.lean_deg)
        errors = [np.sqrt(np.mean((lean - true) ** 2)) for lean in off]
        assert seen.rms_deg <= sum(errors) + 0.01
        assert seen.rms_deg == pytest.approx(np.hypot(seen.constant_deg, seen.moving_deg), abs=1e-6)
        assert abs(seen.delay_s) < 0.02
        assert seen.slope == pytest.approx(1.0, abs=0.05)
    assert found.smoothed.moving_deg < found.live.moving_deg


def test_constant_slope_and_delay_are_separated():
    """The lean of device B differs in three ways: it is 1.5 degrees further left, 3 % larger and 0.1 s late."""
    t_s = np.arange(0.0, 60.0, agreement.STEP_S)
    sigma = np.ones(len(t_s))
    one, late = 20.0 * np.sin(t_s), 20.0 * np.sin(t_s - 0.1)
    seen = agreement._difference((one, sigma), (1.03 * late - 1.5, sigma))
    assert seen is not None and seen.constant_deg == pytest.approx(-1.5, abs=0.1)
    assert seen.slope == pytest.approx(1.03, abs=0.005)
    assert seen.delay_s == pytest.approx(0.1, abs=0.01)
    assert seen.expected_deg == pytest.approx(np.sqrt(2.0))
    same = agreement._difference((one, sigma), (one, sigma))
    assert same is not None and (same.rms_deg, same.within_1) == (0.0, 1.0)
    assert agreement._difference((one[:500], sigma[:500]), (one[:500], sigma[:500])) is None


def test_late_lean_is_reported(ride):
    log, (first, _) = ride.logs[0], ride.calibrations
    late = api.CalibrationFile(
        vehicle_from_sensor=first.vehicle_from_sensor, aligned=True, six_done=True, gyro_delay_s=-0.04
    )
    seen = api.compare_rides(log, log, first, late)
    assert seen.smoothed.delay_s == pytest.approx(0.04, abs=0.01)


def test_words_json_and_a_picture(files, found, monkeypatch):
    said = command.works("compare", files / "A.csv", files / "B.csv", "--plot", files / "C.png").out
    assert "B begins 0.0" in said and "smoothed: they differ by" in said and "live: they differ by" in said
    assert (files / "C.png").read_bytes().startswith(b"\x89PNG")
    monkeypatch.setattr(agreement, "compare_rides", lambda *_: found)
    data = json.loads(command.works("compare", files / "A.csv", files / "B.csv", "--json").out)
    assert set(data) == {"clocks", "live", "smoothed", "remarks"}
    assert 0.0 < data["smoothed"]["moving_deg"] < 2.0


def test_remark_appears_once(ride):
    log, calibration = ride.logs[0], ride.calibrations[0]
    stuck = np.where(np.abs(log.t_s - 80.0) < 3.0, np.argmax(log.t_s > 80.0), np.arange(len(log.t_s)))
    frozen = api.Log(log.t_s, log.accel_g[stuck], log.gyro_dps[stuck])
    for said in api.compare_rides(frozen, frozen, calibration, calibration).notices.values():
        (line,) = [one.line() for one in said]  # the log is read in two ways, and each way finds the frozen readings
        assert line.startswith("the readings froze from 77.0 to 83.0 s")


def test_another_ride_is_refused_in_one_line(files, ride):
    other = drawn_ride(7, 120.0, ["firm"], "city")
    api.write_log(files / "O.csv", other.logs[0])
    write_calibration(files / "O.cal.json", other.calibrations[0])
    command.refused(files, "compare", files / "A.csv", files / "O.csv", words="at no time do they turn alike")


def test_calibration_of_this_mount_is_required(files, ride, tmp_path):
    api.write_log(tmp_path / "B.csv", ride.logs[1])
    command.refused(tmp_path, "compare", files / "A.csv", tmp_path / "B.csv", words="no calibration")
    command.refused(
        files,
        *("compare", files / "A.csv", files / "B.csv", "--calibration-b", files / "A.cal.json"),
        words="degrees apart",
    )
