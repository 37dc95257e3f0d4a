"""Sensors with different sample rates are joined on one clock. Gaps and missing sensors are not filled with values.
Damaged samples are left out and counted."""

from typing import Any

import numpy as np
import pytest
from kickstand_tools import api
from kickstand_tools.common.messages import InputError
from kickstand_tools.imports import units
from kickstand_tools.imports.importing import ImportDamaged
from kickstand_tools.imports.recording import AppRecording, ReceiverTrack, RecordedSensor, in_order, join, on_clock
from support import command
from support.recordings import app_exports
from support.recordings.app_exports import riding

MS = 10**6


def sensor(times_ms, values=None, name="accelerometer"):
    """Return a sensor with three axes, whose values are the column (default: 0, 1, 0) times 1, 2 and 3."""
    time_ns = np.rint(np.array(times_ms, dtype=float) * MS).astype(np.int64)
    rows = np.tile([0.0, 1.0, 0.0], (len(time_ns), 1)) if values is None else np.outer(values, [1.0, 2.0, 3.0])
    return RecordedSensor(name, time_ns, rows)


def track_of(time_s, speed: Any = np.nan, lat: Any = np.nan, lon: Any = np.nan):
    time_s, speed, lat, lon = (np.array(column, float) for column in np.broadcast_arrays(time_s, speed, lat, lon))
    return ReceiverTrack(np.rint(time_s * 1e9).astype(np.int64), speed, lat, lon)


def test_a_slower_gyro_is_interpolated_within_its_own_time():
    t_ms, gyro_ms = np.arange(0.0, 2000.0, 10.0), np.arange(333.0, 1500.0, 25.0)
    log, _ = join(AppRecording("none", sensor(t_ms, t_ms / 1000), sensor(gyro_ms, gyro_ms / 1000)), "log")
    time_s = log.start_s + log.t_s
    assert time_s[[0, -1]] == pytest.approx([0.34, 1.48])
    assert log.gyro_dps == pytest.approx(np.outer(time_s, [1.0, 2.0, 3.0]), abs=1e-9)
    assert log.accel_g == pytest.approx(np.outer(time_s, [1.0, 2.0, 3.0]), abs=1e-9)


def test_gaps_are_not_interpolated():
    slow = sensor([0, 20, 200, 220], [0.0, 2.0, 20.0, 22.0])
    values = on_clock(slow, np.array([-1, 0, 10, 20, 100, 200, 205, 221]) * MS, 10.0 * MS)[:, 0]
    assert values == pytest.approx([np.nan, 0.0, 1.0, 2.0, np.nan, 20.0, 20.5, np.nan], nan_ok=True)
    assert on_clock(sensor([0, 170], [0.0, 17.0]), np.array([50]) * MS, 200.0 * MS)[0, 0] == pytest.approx(5.0)


def test_a_faster_gyro_is_averaged_over_each_sample():
    """Without averaging, a fast vibration would look like a slow rate (aliasing). Samples are not averaged if the step
    of the clock is at most 1.5 steps of the sensor."""
    fast = sensor(np.arange(7) * 10.0, [0.0, 1.0, 4.0, 9.0, 16.0, 25.0, 36.0])
    values = [on_clock(fast, np.array([30 * MS]), step_ms * MS)[0, 0] for step_ms in (15.0, 15.2, 20.0)]
    assert values == [9.0, 9.0, pytest.approx(12.5)]  # the mean of the samples after 20 ms and up to 40 ms
    t_s = np.arange(0.0, 4.0, 0.0025)
    gyro, clock = sensor(1e3 * t_s, 10.0 * t_s + 50.0 * np.sin(2 * np.pi * 99.0 * t_s)), np.arange(100, 390) * 10 * MS
    error = on_clock(gyro, clock, 10.0 * MS)[:, 0] - clock * 1e-8
    assert np.std(error) < 0.3 * np.std(np.interp(clock * 1e-9, t_s, gyro.values[:, 0]) - clock * 1e-8)


def test_lost_rows_are_counted():
    """The gyro's readings last from 20 to 1000 ms, so two samples have no rate. No sensor can read 401 g."""
    accel, gyro = sensor(np.arange(0.0, 1010.0, 10.0)), sensor(np.arange(20.0, 1010.0, 10.0), np.ones(99), "gyro")
    accel.values[50] = [0.0, 401.0, 0.0]
    accel.damaged, gyro.damaged = 3, 5
    log, lost = join(AppRecording("app", accel, gyro, temp_c=np.arange(101.0)), "n")
    assert (lost, len(log.t_s), log.temperature_c[:2].tolist()) == (6, 98, [2.0, 3.0])
    assert log.start_s + log.t_s[0] == pytest.approx(0.02)
    values = np.array([[1.0, 1, 1], [np.nan, 1, 1], [np.nan] * 3, [1e6, 1, 1], [1, 1, 1], [1, 1, 1], [-9e5, 1, 1]])
    damaged = RecordedSensor("x", np.array([1, 2, 3, 4, units.NO_TIME, units.REPEATED, 7]), values, damaged=10)
    assert (damaged.damaged, damaged.time_ns.tolist()) == (13, [1, 7])


def test_a_single_wrong_time_is_left_out():
    """Times over half a second off, whose neighbours fit each other."""
    for row, time_ms in ((50, 9e9), (50, -9e9), (0, 511.0), (99, 479.0)):
        times = np.arange(100.0) * 10.0
        times[row] = time_ms
        assert len(in_order(sensor(times), "n").time_ns) == 99, (row, time_ms)
    shuffled = np.arange(200.0) * 10.0
    shuffled[[50, 51]] = shuffled[[51, 50]]
    ordered = in_order(sensor(shuffled, np.arange(200.0)), "n")
    assert np.diff(ordered.time_ns) == pytest.approx(10 * MS) and ordered.values[50:52, 0].tolist() == [51.0, 50.0]


def late(count):
    times = np.arange(100.0) * 10.0
    times[np.arange(count) * 20 + 20] -= 75.0
    return times


@pytest.mark.parametrize(
    ("times_ms", "words"),
    [
        ([0.0], "n: accelerometer has 1 samples: was it recorded"),
        ([0.0, 5.0], ""),
        (np.arange(30) / 9.9, ""),
        (np.arange(30) / 10.1, "has 10100 samples per second, and no sensor has over 10000"),
        (late(2), ""),
        (late(3), "goes back 3 times, first in its row 21"),
    ],
)
def test_impossible_times_are_refused(times_ms, words):
    if words:
        with pytest.raises(InputError, match=words):
            in_order(sensor(times_ms), "n")
    else:
        assert len(in_order(sensor(times_ms), "n").time_ns) == len(times_ms)


def test_a_fix_is_only_in_the_nearest_row():
    """A fix belongs to a row within 170 ms. The first row has a time without a fix."""
    t_ms = np.arange(0.0, 5000.0, 10.0)
    t_ms = t_ms[(t_ms < 3000.0) | (t_ms > 3400.0)]
    track = track_of(
        [-3.0, 0.504, 1.5, 2.507, 3.2, 9.0], [7, 10.504, 11.5, 12.507, 13, 14], 52.0, [13, 13.1, np.nan, 13, 13, 13]
    )
    log, _ = join(AppRecording("none", sensor(t_ms), sensor(t_ms), track, utc_ns=10**18), "log")
    row = np.flatnonzero(np.isfinite(log.speed_mps))
    assert row.tolist() == [50, 150, 251] and log.speed_mps[row].tolist() == [10.504, 11.5, 12.507]
    assert np.flatnonzero(np.isfinite(log.lon_deg)).tolist() == [50, 251]
    assert log.utc_s[row] - 1e9 == pytest.approx([0.5, 1.5, 2.51])
    log, _ = join(AppRecording("none", sensor(t_ms), sensor(t_ms), utc_ns=10**9), "log")
    assert np.flatnonzero(np.isfinite(log.utc_s)).tolist() == [0] and log.utc_s[0] == 1.0


def test_a_damaged_row_costs_only_itself(tmp_path):
    """Rows with an impossible time, an impossible reading or a word are left out and counted, and a cut last line."""
    ride = riding().every(4)
    lines = app_exports.racebox(ride).splitlines()
    lines[200] = lines[200].replace("2024-05-17", "2031-05-17")
    lines[300] = ",".join([*lines[300].split(",")[:6], "99.9", *lines[300].split(",")[7:]])
    lines[400] = lines[400].replace(lines[400].split(",")[6], "oops", 1)
    lines[-1] = lines[-1][:60]
    (tmp_path / "r.csv").write_text("\n".join(lines))
    imported = api.import_recording(tmp_path / "r.csv")
    assert len(imported.log.t_s) == len(ride.t_s) - 4 and imported.notices == [ImportDamaged(3)]
    assert np.max(np.abs(imported.log.accel_g)) < 2.0


@pytest.mark.parametrize(
    ("from_s", "to_s", "first", "last"), [(5.0, 12.5, 5.0, 12.5), (-1.0, None, 26.98, 27.98), (None, -27.0, 0.0, 0.98)]
)
def test_from_and_to_count_from_the_recordings_own_start(tmp_path, from_s, to_s, first, last):
    source = app_exports.into(tmp_path / "s.zip", app_exports.sensor_logger(riding().every(4)))
    log = api.import_recording(source, start_s=from_s, end_s=to_s).log
    assert log.start_s + log.t_s[[0, -1]] == pytest.approx([first, last], abs=0.021)
    valid = np.flatnonzero(np.isfinite(log.utc_s))
    assert log.utc_s[valid] - log.t_s[valid] - log.start_s == pytest.approx(app_exports.START_UTC_S, abs=0.02)
    late = "import", source, "--out", tmp_path / "RIDE.csv", "--from"
    command.refused(tmp_path, *late, 100, words="lasts 28.0 s: there is nothing from 100 s on")
    command.refused(tmp_path, *late, 3, "--to", 2, words="there is nothing from 3 to 2 s")
