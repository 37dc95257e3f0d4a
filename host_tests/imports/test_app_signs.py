"""The axes, signs and units of the files of known apps, with rows written by hand."""

from types import SimpleNamespace

import numpy as np
import pytest
from kickstand_tools.common.errors import InputError
from kickstand_tools.imports import importing, units
from kickstand_tools.imports.apps import aim, own, phyphox, racebox, racechrono, sensor_logger, sensorlog, vbo
from kickstand_tools.imports.files import RecordingFile
from kickstand_tools.imports.recording import Sheet

MS = 1_000_000


def file(text: str, name: str = "a.csv") -> RecordingFile:
    return RecordingFile(name, text.encode(), text)


def test_aim_turns_right_and_down():
    text = "AiM CSV File\nTime,LateralAcc,VerticalAcc,InlineAcc,PitchRate,YawRate,RollRate,GPS Speed\n"
    text += "s,g,g,g,deg/s,deg/s,deg/s,mph\n" + "0.00,0.1,-1,0.2,1,2,3,10\n0.01,0.1,-1,0.2,1,2,3,10\n"
    made = aim.read([file(text)], "n")
    assert made.accel.values[0] == pytest.approx([-0.1, 1.0, 0.2])
    assert made.gyro.values[0] == pytest.approx([-1.0, -2.0, 3.0]) and made.vehicle_axes
    assert made.track is not None and made.track.speed_mps[0] == pytest.approx(4.4704)
    up = aim.read([file(text.replace(",-1,", ",1,"))], "n")
    assert up.accel.values[0] == pytest.approx([-0.1, 1.0, 0.2]) and "up" in up.accel.taken[0].sign
    assert aim.find_recordings([file("x" * 200 + text), file(text)]) == [[file(text)]]


def test_own_exports_have_pitch_nose_up():
    names = "t_s,left_g,up_g,forward_g,pitch_rate_dps,yaw_rate_dps,roll_rate_dps,utc_s"
    made = own.read([file(f"{names}\n1,0,1,0,5,6,7,101\n2,0,1,0,5,6,7,102\n")], "n")
    assert made.gyro.values[0].tolist() == [-5.0, 6.0, 7.0] and made.vehicle_axes and made.utc_ns == 100 * 10**9
    with pytest.raises(InputError, match="n contains a lean but no readings"):
        own.read([file("t_s,up_g\n1,2\n2,3\n")], "n")


def test_vbo_has_minutes_and_west_positive():
    head = "File created on 02/01/1970 @ 00:00\n[header]\nvelocity kmh\n[column names]\n"
    names = "time lat long velocity Y_Accel Z_Accel X_Accel PitchRate YawRate RollRate"
    row = "000001.00 +60 -120 36 0.1 1 0.2 1 2 3\n"
    made = vbo.read(
        [file(f"{head}{names}\n[data]\n{row}{row.replace('1.00', '2.00')}".replace("velocity kmh\n", ""))], "n"
    )
    assert made.utc_ns == 86400 * 10**9 and made.vehicle_axes and made.sign_known
    assert made.accel.values[0] == pytest.approx([0.1, 1.0, 0.2]) and made.gyro.values[0] == pytest.approx([-1, -2, 3])
    assert made.track is not None and made.track.speed_mps[0] == pytest.approx(10.0)
    assert (made.track.lat_deg[0], made.track.lon_deg[0]) == pytest.approx((1.0, 2.0))
    assert made.accel.time_ns.tolist() == [10**9, 2 * 10**9]
    assert vbo._speed_unit({"header": ["velocity mph"]}) == "mph" and vbo._speed_unit({}) == "km/h"
    assert vbo._midnight_ns({"": ["31/02/2024"]}) is None


def test_units_of_vbo_belong_to_the_last_columns():
    sheet = Sheet("f", list("abcd"), [np.arange(1.0)] * 4)
    found = vbo._units({"header": ["a", "b", "c", "d", ""], "channel units": ["g", "furlong", ""]}, sheet)
    assert found == {2: "g"}
    assert vbo._units({"channel units": ["m/s^2"]}, sheet) == {3: "m/s2"}


def test_racechrono_has_its_units_below_or_in_brackets():
    lines = ["x", "timestamp,a,b,c,d", "unix time,g,,deg/s,m", "s1,,,,"]
    assert racechrono._units(lines, 1) == ({0: "unix time", 1: "g", 3: "deg/s", 4: "m"}, 2)
    assert racechrono._units(["time,a (G),b", "1,2,3", "4,5,6"], 0) == ({1: "G"}, 0)
    assert racechrono._is_speed("speed (m/s)") and racechrono._is_speed("speed")
    assert not racechrono._is_speed("speed (km/h)") and not racechrono._is_speed("speeds")
    assert not racechrono._is_header("a,b,c,d,e") and not racechrono._is_header("timestamp,a,b,c")


def test_racebox_finds_its_line_of_names():
    text = "Lap,1\n\nTime,GForceX,GForceY,GForceZ,GyroX,GyroY,GyroZ,KPH\n"
    assert racebox._header(file(text)) == 2 and racebox._header(file("a\n")) is None
    made = racebox.read([file(text + "0,1,2,3,4,5,6,36\n" + "10,1,2,3,4,5,6,36\n")], "n")
    assert made.accel.values[0].tolist() == [2.0, 3.0, 1.0] and made.gyro.values[0].tolist() == [5.0, 6.0, 4.0]
    assert made.track is not None and made.track.speed_mps[0] == pytest.approx(10.0)


def test_sensor_logger_knows_its_platform():
    def platform(text, **more):
        return sensor_logger._platform({"metadata": file(text), **more} if text else more)

    assert platform("platform,standardisation\niOS,false\n") == (True, False)
    assert platform("platform,standardisation\nios,true\n") == (True, True)
    assert platform("platform\nandroid\n") == (False, False)
    assert platform("") == (None, False) and platform("", totalacceleration=1) in ((False, False), (None, False))


def test_sensorlogs_repeated_samples_have_no_time():
    names = ["loggingTime", "accelerometerTimestamp_sinceReboot"]
    sheet = Sheet("f", names, [np.array([100.0, 100.1, 100.2]), np.array([5.0, 5.0, 5.1])])
    assert sensorlog._clock(sheet, "accelerometer").tolist() == [5000 * MS, units.REPEATED, 5100 * MS]


def test_phyphox_adds_its_pauses():
    text = '"event","experiment time","system time"\nSTART,0.0,1700000000.0\nPAUSE,5.0,1700000005.0\n'
    text += "START,5.0,1700000008.0\n"
    pauses = phyphox._Pauses([file(text, "meta/time.csv")])
    assert pauses.utc_ns == 1_700_000_000 * 10**9
    assert pauses.after(np.array([0, 4999, 5000, 6000]) * MS).tolist() == [0, 4999 * MS, 8000 * MS, 9000 * MS]
    assert phyphox._Pauses([]).utc_ns is None
    assert [phyphox._kind(what) for what in ("gravity", "linear a", "a (without g)", "a")] == [
        "gravity", "user", "user", "total",
    ]  # fmt: skip


def test_a_module_of_apps_claims_its_files_once():
    log = file("t_s,ax_g,ay_g,az_g,gx_dps,gy_dps,gz_dps\n0,0,1,0,0,0,0\n")
    assert [app.NAME for app, _ in importing.recordings([log, file("a,b\n1,2\n")])] == ["Kickstand"]
    assert SimpleNamespace(names=importing.NAMES).names[0] == "phyphox"
