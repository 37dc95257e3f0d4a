"""`kickstand compare`: the leans of two devices on one clock. Differences that were put in are found, with their
signs."""

import json
from dataclasses import replace

import numpy as np
import pytest
from joining.known_roads import another_device, turned
from kickstand_tools import api
from kickstand_tools.calibration.file import write_calibration
from kickstand_tools.joining import agreement
from kickstand_workshop.evaluation.drawn_rides import drawn_ride
from support import command

LATER_S, SLOW, DELAY_S = 7.3, 80e-6, 0.04


@pytest.fixture(scope="module")
def pair():
    """Device B starts later, its clock is slow, it shows the lean late, and its mount is turned by 2 degrees."""
    ride = drawn_ride(1, 100.0, ["firm"], "street")
    log, a = ride.logs[0], ride.calibrations[0]
    log = api.Log(log.t_s[::2], log.accel_g[::2], log.gyro_dps[::2])
    axes = turned(2.0, (0.0, 0.0, 1.0)) @ a.vehicle_from_sensor
    b = replace(a, vehicle_from_sensor=axes, gyro_delay_s=-DELAY_S)
    return (log, another_device(log, LATER_S, drift=SLOW)), (a, b)


@pytest.fixture(scope="module")
def comparison(pair):
    return api.compare_rides(*pair[0], *pair[1])


def test_shift_drift_and_delay_are_found(comparison):
    """A slow clock has a positive drift, and a late lean a positive delay."""
    clocks = comparison.clocks
    assert clocks.later_s == pytest.approx(LATER_S, abs=0.01)
    assert clocks.drift == pytest.approx(SLOW, abs=60e-6)
    assert clocks.correlation > 0.99 and clocks.apart_deg == pytest.approx(2.0, abs=0.2)
    assert comparison.smoothed.delay_s == pytest.approx(DELAY_S, abs=0.015)
    assert comparison.smoothed.slope == pytest.approx(1.0, abs=0.03)
    first, *_ = agreement.words(comparison)
    assert f"B begins {LATER_S:.1f}" in first and "s after A" in first and "ppm slow" in first


def test_a_difference_is_that_of_the_leans(comparison):
    """The figures are computed again by numpy, from B's lean minus A's lean while both are known."""
    for kind, difference in (("live", comparison.live), ("smoothed", comparison.smoothed)):
        change = comparison.leans[f"{kind} B"] - comparison.leans[f"{kind} A"]
        change = change[np.isfinite(change)]
        off = np.abs(change - change.mean())
        assert difference is not None
        assert difference.seconds == pytest.approx(0.02 * len(change)) and difference.seconds > 40.0
        assert difference.constant_deg == pytest.approx(change.mean())
        assert difference.rms_deg == pytest.approx(np.hypot(change.mean(), change.std()))
        assert difference.moving_deg == pytest.approx(change.std())
        assert (difference.p95_deg, difference.worst_deg) == pytest.approx((np.percentile(off, 95.0), off.max()))
        assert 0.1 < difference.expected_deg < 3.0 and 0.0 <= difference.within_1 <= difference.within_2 <= 1.0


def test_output_in_words_json_and_a_picture(tmp_path, pair, comparison, monkeypatch):
    """The command prints words, or JSON, and draws a PNG."""
    pytest.importorskip("matplotlib")
    monkeypatch.setattr(agreement, "compare_rides", lambda *_, **__: comparison)
    for name, log, calibration in zip("AB", *pair):
        api.write_log(tmp_path / f"{name}.csv", log)
        write_calibration(tmp_path / f"{name}.cal.json", calibration)
    files = tmp_path / "A.csv", tmp_path / "B.csv"
    words = command.works("compare", *files, "--plot", tmp_path / "C.png").out
    assert "B begins 7.3" in words and "smoothed: they differ by" in words and "live: they differ by" in words
    assert (tmp_path / "C.png").read_bytes().startswith(b"\x89PNG")
    data = json.loads(command.works("compare", *files, "--json").out)
    assert set(data) == {"clocks", "live", "smoothed", "remarks"}
    assert data["smoothed"]["delay_s"] == comparison.smoothed.delay_s
    command.refused(tmp_path, "compare", *files, "--plot", tmp_path / "C.jpg", words="must end in .png")


def test_another_ride_or_a_missing_calibration_is_refused(tmp_path, pair):
    other = api.simulate_ride("city", seed=7, seconds=70.0)
    logs = pair[0][0], api.Log.from_readings(other.readings[::4], other.rate_hz / 4)
    for name, log in zip("AO", logs):
        api.write_log(tmp_path / f"{name}.csv", log)
    write_calibration(tmp_path / "A.cal.json", pair[1][0])
    files = tmp_path / "A.csv", tmp_path / "O.csv"
    command.refused(tmp_path, "compare", *files, words="no calibration")
    calibration_b = "--calibration-b", tmp_path / "A.cal.json"
    command.refused(tmp_path, "compare", *files, *calibration_b, words="at no time do they turn alike")
