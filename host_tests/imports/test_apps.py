"""The export of each app is imported, and its replay equals the original ride. The tests use no recorded export. The
writers in support/recordings/app_exports.py make the files according to these sources:

phyphox: https://github.com/phyphox/phyphox-ios, SimpleExperimentTemplete.swift and ExperimentExport.swift
Sensor Logger: https://github.com/tszheichoi/awesome-sensor-logger, UNITS.md, COORDINATES.md and CROSSPLATFORM.md
SensorLog: http://sensorlog.berndthomas.net (example logs); signs https://developer.apple.com/reference/uikit/uiacceleration
Sensor Kinetics: https://rotoview.com/multi-sensor-file-system.html; samples in
    https://github.com/Intelligent-Systems-Phystech/MobileSensorData
RaceChrono: https://github.com/jLynx/RaceChrono-to-CSV and https://github.com/ClassicMiniDIY/UltraLog/pull/85
RaceBox: https://www.racebox.pro/info/session-export; a ride in https://github.com/beadon/RacePlex
VBO: https://en.racelogic.support/VBOX_Automotive/Knowledge_Base/VBO_File_Format, and "CAN Output - IMU04" there
AiM: a session in https://github.com/m3rlin45/libxrk, tests/test_data/SFJ
"""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from kickstand_tools import api
from kickstand_tools.imports.importing import NAMES
from support.recordings import app_exports
from support.recordings.app_exports import PHONE, START_UTC_S, Riding, riding

PAGE = Path(__file__).resolve().parents[2] / "tools" / "docs" / "recordings.md"
ON_PHONE = api.CalibrationFile(vehicle_from_sensor=PHONE.T, aligned=True)
ON_BIKE = api.CalibrationFile(aligned=True)
ON_THE_BIKE = ("RaceBox", "VBO", "AiM")  # apps that record along the bike's axes, not the phone's
WITHOUT_DATE = ("AiM", "Sensor Kinetics")  # apps whose times have no date
WITHOUT_SPEED = ("Sensor Kinetics",)  # the app does not use the satellite receiver
# Largest rms difference between a replay and the true lean. The replay of the original ride has 0.28 degrees at 100
# samples per second.
WITHIN_DEG = 0.5


def one(name: str, write: Callable[..., str], encoding: str = "utf-8", **options) -> Callable[[Path, Riding], Path]:
    def file(directory: Path, ride: Riding) -> Path:
        (directory / name).write_bytes(write(ride, **options).encode(encoding))
        return directory / name

    return file


def several(name: str, write: Callable[..., dict[str, str]], **options) -> Callable[[Path, Riding], Path]:
    return lambda directory, ride: app_exports.into(directory / name, write(ride, **options))


# The name of each export begins with the name of its app. The values are the export's writer and a number n, if only
# each n-th of 200 samples per second is written.
EXPORTS = {
    "phyphox zip": (several("p.zip", app_exports.phyphox), 2),
    "phyphox folder, ; and decimal comma": (several("p", app_exports.phyphox, separator=";", comma=True), 2),
    "phyphox folder, tabs": (several("p", app_exports.phyphox, separator="\t"), 2),
    "Sensor Logger, Android": (several("s.zip", app_exports.sensor_logger), 2),
    "Sensor Logger, iPhone": (several("s", app_exports.sensor_logger, platform="ios"), 2),
    "Sensor Logger, standardised": (several("s.zip", app_exports.sensor_logger, platform="ios", standard=True), 2),
    "SensorLog": (one("s.csv", app_exports.sensorlog), 2),
    "SensorLog, motion only, ;": (one("s.csv", app_exports.sensorlog, separator=";", accelerometer=False), 2),
    "Sensor Kinetics": (several("k", app_exports.sensor_kinetics), 1),
    "Sensor Kinetics, ; and decimal comma": (several("k.zip", app_exports.sensor_kinetics, semicolon=True), 1),
    "RaceChrono 3": (one("r.csv", app_exports.racechrono, "utf-8-sig"), 2),
    "RaceChrono 2": (one("r.csv", app_exports.racechrono, version=2), 2),
    "RaceBox": (one("r.csv", app_exports.racebox), 8),
    "RaceBox, laps and mph": (one("r.csv", app_exports.racebox, per_mps=1 / 0.44704, laps=True), 8),
    "VBO": (one("v.vbo", app_exports.vbo), 2),
    "VBO, knots, Windows' letters": (one("v.VBO", app_exports.vbo, "cp1252", speed="knots"), 2),
    "AiM": (one("a.csv", app_exports.aim), 4),
    "AiM saved by a spreadsheet, vertical +1": (one("a.csv", app_exports.aim, quoted=False, up_sign=1.0), 4),
}


def test_each_app_has_a_test_and_a_description():
    untried = [name for name in NAMES if not any(key.startswith(name) for key in EXPORTS)]
    assert untried == ["Kickstand"], f"add to EXPORTS above an export of each but Kickstand: {untried}"
    table = PAGE.read_text(encoding="utf-8")
    undescribed = [name for name in NAMES if f"\n| {name}" not in table]
    assert undescribed == [], f"add a line for each to the table of apps in {PAGE}"


@pytest.mark.parametrize("name", EXPORTS)
def test_an_export_replays_as_the_ride_it_was_made_from(tmp_path, name):
    write, period = EXPORTS[name]
    calibration = ON_BIKE if name.startswith(ON_THE_BIKE) else ON_PHONE
    ride = riding().every(period)
    imported = api.import_recording(write(tmp_path, ride))
    assert name.startswith(imported.app) and imported.vehicle_axes is name.startswith(ON_THE_BIKE)
    assert [notice.code for notice in imported.notices if notice.code != "import-sign"] == []
    api.write_imported(tmp_path / "RIDE.csv", imported)
    log = api.read_log(tmp_path / "RIDE.csv")
    t_s = log.t_s + log.start_s
    lean = api.replay(log, calibration).lean_deg
    assert np.sqrt(np.mean((lean - np.interp(t_s, ride.t_s, ride.lean_deg)) ** 2)) < WITHIN_DEG
    force = log.accel_g @ calibration.vehicle_from_sensor.T
    rates = log.gyro_dps @ calibration.vehicle_from_sensor.T
    for axis in range(3):
        assert np.median(np.abs(force[:, axis] - np.interp(t_s, ride.t_s, ride.force_g[:, axis]))) < 0.01
        assert np.median(np.abs(rates[:, axis] - np.interp(t_s, ride.t_s, ride.rates_dps[:, axis]))) < 0.3
    if imported.app not in WITHOUT_SPEED:
        valid, fix = np.isfinite(log.speed_mps), np.isfinite(log.lat_deg)
        assert np.count_nonzero(valid) >= 27
        assert log.speed_mps[valid] == pytest.approx(np.interp(t_s[valid], ride.t_s, ride.speed_mps), abs=0.05)
        north_m = (log.lat_deg[fix] - np.interp(t_s[fix], ride.t_s, ride.lat_deg)) * 111_195.0
        east_m = (log.lon_deg[fix] - np.interp(t_s[fix], ride.t_s, ride.lon_deg)) * 67_700.0
        assert np.max(np.hypot(north_m, east_m)) < 1.0
    if imported.app not in WITHOUT_DATE:
        valid = np.isfinite(log.utc_s)
        assert log.utc_s[valid] - START_UTC_S == pytest.approx(t_s[valid], abs=0.02)


def test_a_pause_of_phyphox_is_a_gap(tmp_path):
    """The time of an experiment stops during a pause. The file meta/time.csv shows how long the pause was."""
    files = app_exports.phyphox(riding().every(2))
    rows = [("START", 0.0, 0.0), ("PAUSE", 12.0, 12.0), ("START", 12.0, 72.0), ("PAUSE", 28.0, 88.0)]
    files["meta/time.csv"] = '"event","experiment time","system time","system time text"\n' + "\n".join(
        f'"{event}",{clock:.9E},{START_UTC_S + utc:.15E},""' for event, clock, utc in rows
    )
    imported = api.import_recording(app_exports.into(tmp_path / "p.zip", files))
    assert imported.gaps_s == pytest.approx([60.0], abs=0.05)
    assert imported.log.t_s[-1] == pytest.approx(87.9, abs=0.1)


@pytest.mark.parametrize("form", ["csv", "parquet", "racechrono"])
def test_kickstands_own_exports_are_read_back(tmp_path, form):
    if form == "parquet":
        pytest.importorskip("pyarrow")
    ride = riding().every(2)
    each_s = np.where(np.arange(len(ride.t_s)) % 100 == 0, 1.0, np.nan)
    track = {
        "lat_deg": each_s * ride.lat_deg,
        "lon_deg": each_s * ride.lon_deg,
        "utc_s": each_s * ride.t_s + START_UTC_S,
    }
    log = api.Log(ride.t_s, ride.phone_g, ride.rates_dps @ PHONE.T, each_s * ride.speed_mps, **track)
    out = tmp_path / f"out.{'parquet' if form == 'parquet' else 'csv'}"
    api.export(api.open_ride(log, ON_PHONE), form, out)
    imported = api.import_recording(out)
    n = len(imported.log.t_s)
    assert imported.vehicle_axes and n > len(ride.t_s) - 3
    assert imported.log.accel_g == pytest.approx(ride.force_g[:n], abs=1e-3)
    assert imported.log.gyro_dps == pytest.approx(ride.rates_dps[:n], abs=2e-3)
    row = np.isfinite(imported.log.speed_mps)
    for name, error in (("speed_mps", 2e-3), ("lat_deg", 1e-7), ("lon_deg", 1e-7)):
        assert getattr(imported.log, name)[row] == pytest.approx(getattr(ride, name)[:n][row], rel=0, abs=error)
    valid = np.isfinite(imported.log.utc_s)
    assert imported.log.utc_s[valid] - START_UTC_S == pytest.approx(ride.t_s[:n][valid], rel=0, abs=2e-3)


def test_a_log_saved_by_a_spreadsheet_is_read_back(tmp_path):
    """The file has semicolons, decimal commas, and the columns temp_c, lat_deg and lon_deg."""
    ride = riding().every(8)
    names = "t_s,ax_g,ay_g,az_g,gx_dps,gy_dps,gz_dps,speed_mps,temp_c,lat_deg,lon_deg".split(",")
    rows = np.column_stack((ride.t_s, ride.force_g, ride.rates_dps, ride.speed_mps, np.full(len(ride.t_s), 21.5)))
    rows = np.column_stack((rows, ride.lat_deg, ride.lon_deg)).tolist()
    (tmp_path / "log.csv").write_text(app_exports.lines(names, rows, ";", comma=True), encoding="utf-16")
    imported = api.import_recording(tmp_path / "log.csv")
    assert imported.app == "Kickstand" and imported.log.accel_g == pytest.approx(ride.force_g, abs=1e-6)
    assert imported.log.temperature_c == pytest.approx(21.5) and np.isfinite(imported.log.lat_deg).sum() > 500
