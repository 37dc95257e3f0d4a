"""Sensors with different sample rates are joined on one clock. Gaps and missing sensors are not filled with values."""

import numpy as np
import pytest
from kickstand_tools import api
from kickstand_tools.imports.importing import ImportDamaged
from kickstand_tools.imports.join import join, on_clock
from kickstand_tools.imports.recording import AppRecording, ReceiverTrack, RecordedSensor
from support import command
from support.recordings import app_exports
from support.recordings.app_exports import riding

MS = 10**6


def sensor(name: str, t_s: np.ndarray, column: np.ndarray | None = None) -> RecordedSensor:
    """Return a sensor with three axes, whose values are the column (default: the time) multiplied by 1, 2 and 3."""
    values = t_s if column is None else column
    return RecordedSensor(name, np.rint(t_s * 1e9).astype(np.int64), np.outer(values, [1.0, 2.0, 3.0]))


def test_slower_gyro_is_interpolated_within_its_own_time():
    accel = sensor("accelerometer", np.arange(0.0, 2.0, 0.01))
    log, _ = join(AppRecording("none", accel, sensor("gyro", np.arange(0.333, 1.5, 0.025))), "log")
    at_s = log.start_s + log.t_s
    assert at_s[[0, -1]] == pytest.approx([0.34, 1.48])
    assert np.allclose(log.gyro_dps, np.outer(at_s, [1.0, 2.0, 3.0]), atol=1e-9)
    assert np.allclose(log.accel_g, np.outer(at_s, [1.0, 2.0, 3.0]), atol=1e-9)


def test_a_faster_gyro_is_averaged_over_each_sample():
    """Without averaging, a fast vibration would look like a slow rate (aliasing)."""
    t_s = np.arange(0.0, 4.0, 0.0025)
    gyro = sensor("gyro", t_s, 10.0 * t_s + 50.0 * np.sin(2 * np.pi * 99.0 * t_s))
    clock = np.arange(100, 390) * 10 * MS
    found = on_clock(gyro, clock, 10.0 * MS)[:, 0]
    assert np.max(np.abs(found - clock * 1e-8)) < 15.0
    point = np.interp(clock * 1e-9, t_s, gyro.values[:, 0])
    assert np.std(found - clock * 1e-8) < 0.3 * np.std(point - clock * 1e-8)


def test_gap_of_either_sensor_stays_a_gap():
    t_s = np.arange(0.0, 4.0, 0.01)
    accel = sensor("accelerometer", t_s[(t_s < 1.0) | (t_s > 1.5)])
    gyro = sensor("gyro", t_s[(t_s < 2.0) | (t_s > 2.6)])
    log, _ = join(AppRecording("none", accel, gyro), "log")
    steps_s = np.diff(log.t_s)
    assert steps_s[steps_s > 0.02] == pytest.approx([0.52, 0.62], abs=0.02)


def test_two_missing_gyro_samples_are_no_gap():
    t_s = np.arange(0.0, 2.0, 0.01)
    log, _ = join(AppRecording("none", sensor("a", t_s), sensor("g", t_s[(t_s < 1.0) | (t_s > 1.1)])), "log")
    assert len(log.t_s) == len(t_s)


def test_fix_is_only_in_the_nearest_row():
    t_s = np.arange(0.0, 5.0, 0.01)
    fix_s = np.array([-3.0, 0.504, 1.5, 2.507, 9.0])
    track = ReceiverTrack(
        np.rint(fix_s * 1e9).astype(np.int64),
        fix_s + 10.0,
        np.full(5, 52.0),
        np.array([13.0, 13.1, np.nan, 13.3, 13.4]),
    )
    log, _ = join(AppRecording("none", sensor("a", t_s), sensor("g", t_s), track, utc_ns=10**18), "log")
    rows = np.flatnonzero(np.isfinite(log.speed_mps))
    assert rows.tolist() == [50, 150, 251]
    assert log.speed_mps[rows] == pytest.approx([10.504, 11.5, 12.507])
    assert np.flatnonzero(np.isfinite(log.lon_deg)).tolist() == [50, 251]
    assert log.utc_s[rows] - 1e9 == pytest.approx([0.5, 1.5, 2.51])


def test_markers_of_unknown_speed_and_position_are_dropped():
    """A phone writes -1 for an unknown speed. A phone may write 0, 0 for an unknown position, which is in the sea."""
    t_ns = np.arange(4) * 10**9
    track = ReceiverTrack(
        t_ns, np.array([-1.0, 3.0, -1.0, 4.0]), np.array([0.0, 52.0, 91.0, 52.1]), np.array([0.0, 13.0, 13.0, 13.1])
    )
    assert track.speed_mps.tolist() == [3.0, 4.0]
    assert track.lat_deg.tolist() == [52.0, 52.1]


def test_repeated_values_at_standstill_are_kept_once_per_second():
    """A logger may write the receiver's last value in each row. At a standstill the repeated value is kept once per
    second."""
    track = ReceiverTrack(np.arange(80) * 50 * MS, np.repeat([0.0, 5.0], 40), np.full(80, 52.0), np.full(80, 13.0))
    assert (track.time_ns // MS).tolist() == [0, 1000, 2000, 3000]
    assert track.speed_mps.tolist() == [0.0, 0.0, 5.0, 5.0]


def test_rounded_and_repeated_times_are_spread(tmp_path):
    """Sensor Kinetics writes times with four decimals, and writes the same time for several samples."""
    ride = riding()
    found = api.import_recording(app_exports.into(tmp_path / "k", app_exports.sensor_kinetics(ride)))
    steps = np.diff(found.log.t_s)
    assert steps.min() > 0.002
    assert len(found.log.t_s) >= len(ride.t_s) - 3


def test_late_samples_are_sorted(tmp_path):
    ride = riding().every(4)
    lines = app_exports.any_table(ride).splitlines()
    lines[101], lines[103] = lines[103], lines[101]
    (tmp_path / "log.csv").write_text("\n".join(lines))
    units = {"a": "m/s2", "g": "rad/s", "speed": "km/h"}
    found = api.import_recording(tmp_path / "log.csv", app_exports.ANY_NAMES, units)
    assert np.allclose(found.log.accel_g, ride.phone_g, atol=1e-5)


def test_damaged_row_costs_only_itself(tmp_path):
    """Rows with an impossible time, an impossible reading or a word are left out and counted. A last line that is cut
    off is left out, too."""
    ride = riding().every(4)
    lines = app_exports.racebox(ride).splitlines()
    lines[200] = lines[200].replace("2024-05-17", "2031-05-17")
    lines[300] = ",".join([*lines[300].split(",")[:6], "99.9", *lines[300].split(",")[7:]])
    lines[400] = lines[400].replace(lines[400].split(",")[6], "oops", 1)
    lines[-1] = lines[-1][:60]
    (tmp_path / "r.csv").write_text("\n".join(lines))
    found = api.import_recording(tmp_path / "r.csv")
    assert len(found.log.t_s) == len(ride.t_s) - 4
    assert found.notices == [ImportDamaged(3)]
    assert np.max(np.abs(found.log.accel_g)) < 2.0


def test_from_and_to_count_from_the_recordings_own_start(tmp_path):
    source = app_exports.into(tmp_path / "s.zip", app_exports.sensor_logger(riding().every(2)))
    out = tmp_path / "RIDE.csv"
    command.works("import", source, "--out", out, "--from", 5, "--to", 12.5)
    table = np.genfromtxt(out, delimiter=",", names=True)
    assert table["t_s"][[0, -1]] == pytest.approx([5.0, 12.5])
    whole = api.import_recording(source)
    assert table["ax_g"][0] == pytest.approx(whole.log.accel_g[np.searchsorted(whole.log.t_s + 0.01, 5.0), 0], abs=1e-5)
    known = np.flatnonzero(np.isfinite(table["utc_s"]))
    assert table["utc_s"][known[0]] - table["t_s"][known[0]] == pytest.approx(app_exports.START_UTC_S, abs=0.02)
    late = "import", source, "--out", out, "--from", 100
    command.refused(tmp_path, *late, words="lasts 28.0 s: there is nothing from 100 s on")
