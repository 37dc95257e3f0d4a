"""Tests the riding time of a ride, and the message about a log that contains too little riding."""

import numpy as np
import pytest
from kickstand_tools.analysis import report
from kickstand_tools.analysis.overview import overview
from kickstand_tools.analysis.ride import open_ride
from kickstand_tools.calibration.file import CalibrationFile
from kickstand_tools.logs.log import Log, Stretch
from kickstand_tools.logs.reader import read_log
from support import command
from support.recordings import analysis_rides


def standing(seconds, shake_g, shake_dps, speed_mps=np.nan, bias_dps=0.0):
    """Simulate a bike that stands upright with a running engine. shake_g, shake_dps: rms of the vibration."""
    count = round(100 * seconds)
    random = np.random.default_rng(2)
    force = [0.0, 1.0, 0.0] + random.normal(0.0, shake_g, (count, 3))
    rates = random.normal(bias_dps, shake_dps, (count, 3))
    return Log(np.arange(count) / 100.0, force, rates, np.full(count, speed_mps))


def words_of(log):
    return report.words(overview(open_ride(log, CalibrationFile(aligned=True))))


@pytest.mark.parametrize(
    "log",
    [
        *(standing(0.02, 0.003, 0.1), standing(12, 0.003, 0.1), standing(40, 0.05, 1.5)),
        *(standing(40, 0.1, 3.0, speed_mps=0.0), standing(40, 0.05, 1.5, bias_dps=5.0)),
    ],
    ids=["two samples", "engine off", "engine on", "engine on, with a speed", "engine on, the gyro's bias not known"],
)
def test_standing_bike_is_not_riding(log):
    said = words_of(log)
    assert said.ride[0][2] == "riding 0:00"
    assert said.too_little == f"{said.ride[0][1]} of log, all of it standing: too little for a report."


def test_knock_at_the_start_is_not_riding():
    """The hand that switches the device on knocks it with 0.4 g for 0.02 s. Averaged over a second, the knock has 0.008
    g."""
    log = standing(40, 0.05, 1.5)
    log.accel_g[:2, 2] = 0.4
    assert words_of(log).ride[0][2] == "riding 0:00"


def test_riding_time_excludes_standing(tmp_path):
    """The log is 37 s long. The bike stands for 4 s before the ride and for 4 s after it. The riding time is tested
    with a speed and without a speed."""
    for speed_hz in (0, 5):
        said = words_of(analysis_rides.short(tmp_path, speed_hz=speed_hz))
        minutes, seconds = said.ride[0][2].removeprefix("riding ").split(":")
        ridden_s = 60 * int(minutes) + int(seconds)
        whole, rest = said.ride[0][1].split(":")
        assert 60 * int(whole) + int(rest) - ridden_s == pytest.approx(8, abs=2)
        assert said.too_little == ""


def test_a_speed_that_is_always_0_hides_no_ride(tmp_path):
    """A broken contact at the wheel gives a speed that is always 0. The riding time is then computed without the
    speed."""
    log = read_log(analysis_rides.short(tmp_path))
    without = words_of(log)
    log.speed_mps[::20] = 0.0
    said = words_of(log)
    assert (said.ride[0], said.too_little) == (without.ride[0], "")
    assert said.stops or said.remark == "Stops: not known, the log has no speed."


def test_straight_stretch_without_speed_counts_as_riding():
    """The log is a stretch of a longer log. The readings of the stretch fit a standing bike, but also a ride at
    constant speed on a rough road. A stretch whose readings do not show which of the two it is counts as riding."""
    assert words_of(Stretch(standing(40, 0.05, 1.5), 5.0, 30.0)).too_little == ""


def test_report_of_a_cut_log_begins_with_that(tmp_path):
    path = analysis_rides.short(tmp_path)
    path.write_text("\n".join(path.read_text().splitlines()[:900]) + "\n")
    out = command.works("report", path).out
    assert out.splitlines()[1].startswith("0:09 of log, ")
    assert "s of it riding: too little for a report." in out.splitlines()[1]
