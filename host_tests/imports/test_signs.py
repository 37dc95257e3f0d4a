"""In a log from any app, the axis that points up reads +1 g at rest, and gravity is never missing."""

import numpy as np
import pytest
from kickstand_tools import api
from kickstand_tools.checks.course import log_agrees
from support import command
from support.recordings import app_exports
from support.recordings.app_exports import PHONE, riding


def up_at_rest(found: api.Imported) -> np.ndarray:
    """Return the mean force in the first second, while the motorcycle stands upright."""
    return found.log.accel_g[found.log.t_s < 1.0].mean(axis=0)


UP = PHONE @ [0.0, 1.0, 0.0]


def test_sensor_loggers_raw_accelerometer_is_in_g_on_an_iphone(tmp_path):
    ride = riding().every(4)
    files = app_exports.sensor_logger(ride, "ios")
    rows = [
        (f"{1715938200250 + 20 * k}000000", t, *row[::-1]) for k, (t, row) in enumerate(zip(ride.t_s, -ride.phone_g))
    ]
    files["AccelerometerUncalibrated.csv"] = app_exports.lines(["time", "seconds_elapsed", "z", "y", "x"], rows)
    del files["Gravity.csv"]
    found = api.import_recording(app_exports.into(tmp_path / "s", files))
    assert up_at_rest(found) == pytest.approx(UP, abs=0.02)


def test_without_the_platform_sensor_logger_is_refused(tmp_path):
    files = app_exports.sensor_logger(riding().every(4), "ios")
    del files["Metadata.csv"]
    with pytest.raises(api.InputError, match=r"Metadata\.csv is missing.*opposite signs"):
        api.import_recording(app_exports.into(tmp_path / "s", files))


@pytest.mark.parametrize("app", ["phyphox", "sensor_logger", "sensor_kinetics", "sensorlog"])
def test_acceleration_without_gravity_is_completed_or_refused(tmp_path, app):
    ride = riding().every(4)
    if app == "sensorlog":
        whole = app_exports.sensorlog(ride, accelerometer=False)
        files = [{"s.csv": whole}, {"s.csv": whole.replace("motionGravity", "motionHeading")}]
    else:
        exported = getattr(app_exports, app)(ride, **({"platform": "ios"} if app == "sensor_logger" else {}))
        exported.pop("Accelerometer.csv" if app == "phyphox" else "Ride_accm.csv", None)
        if app == "phyphox":
            exported["Gravity.csv"] = app_exports.lines(
                ["Time (s)", *[f"Gravity {axis} (m/s^2)" for axis in "XYZ"]],
                np.column_stack((ride.t_s, 9.81 * ride.gravity_g)).tolist(),
            )
        gone = [name for name in exported if name in ("Gravity.csv", "Ride_grvm.csv")]
        files = [exported, {name: text for name, text in exported.items() if name not in gone}]
    found = api.import_recording(app_exports.into(tmp_path / "both", files[0]))
    assert up_at_rest(found) == pytest.approx(UP, abs=0.02)
    assert "gravity added" in found.taken[0].sign
    out = tmp_path / "RIDE.csv"
    linear = app_exports.into(tmp_path / "linear", files[1])
    words = "gravity has been taken off its"
    assert "without it there is no lean: " in command.refused(tmp_path, "import", linear, "--out", out, words=words)


def test_a_table_without_gravity_is_refused(tmp_path):
    """The column names do not say whether gravity is included. The size of the accelerations shows that gravity is
    missing."""
    ride = riding().every(4)
    rows = np.column_stack((ride.t_s, ride.phone_g - ride.gravity_g, ride.phone_rad)).tolist()
    (tmp_path / "log.csv").write_text(app_exports.lines(list("tabcpqr"), rows))
    columns = {"t": "t", "ax": "a", "ay": "b", "az": "c", "gx": "p", "gy": "q", "gz": "r"}
    with pytest.raises(api.InputError, match="gravity has been taken off, and without it there is no lean"):
        api.import_recording(tmp_path / "log.csv", columns, {"a": "g", "g": "rad/s"})


def test_wrong_unit_is_noticed(tmp_path):
    (tmp_path / "log.csv").write_text(app_exports.any_table(riding().every(4)))
    with pytest.raises(api.InputError, match=r"usually 1\d\.\d\d g, where gravity makes it 1: they look like m/s2"):
        api.import_recording(tmp_path / "log.csv", app_exports.ANY_NAMES, {"a": "g", "g": "rad/s", "speed": "km/h"})


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_turns_of_the_track_show_an_unknown_sign(tmp_path, sign):
    (tmp_path / "r.csv").write_text(app_exports.racechrono(riding().every(2), sign))
    found = api.import_recording(tmp_path / "r.csv")
    assert up_at_rest(found) == pytest.approx(UP, abs=0.02)
    assert found.taken[0].sign.startswith(f"{sign:+.0f} g up, by the turns of the track")
    assert not found.notices


def test_mirrored_export_of_a_known_app_gives_a_remark(tmp_path):
    """The sign of this app is known, so something else reversed the accelerations. The import changes no sign and makes
    a remark."""
    ride = riding().every(2)
    ride.force_g = -ride.force_g
    found = api.import_recording(app_exports.into(tmp_path / "p.zip", app_exports.phyphox(ride)))
    assert [notice.code for notice in found.notices] == ["mirrored"]
    assert "left and right are exchanged" in api.sentence(found.notices[0])
    assert up_at_rest(found) == pytest.approx(-UP, abs=0.02)


def test_uncertain_sign_is_reported_and_can_be_turned(tmp_path):
    ride = riding().every(2)
    ride.force_g = -ride.force_g  # an iPhone might give this sign
    folder = app_exports.into(tmp_path / "k", app_exports.sensor_kinetics(ride))
    result = command.works("import", folder, "--out", tmp_path / "RIDE.csv")
    assert "warning: " in result.err
    assert "--units a=-g or a=-m/s2 puts it right" in result.err
    found = api.import_recording(folder, units={"a": "-m/s2"})
    assert up_at_rest(found) == pytest.approx(UP, abs=0.02)
    assert not found.notices


def test_no_turns_show_no_sign(tmp_path):
    """A ride without turns gives the same warning as a ride without a track."""
    ride = riding().every(2)
    ride.lat_deg, ride.lon_deg = 52.5 + 1e-5 * ride.t_s, np.full(len(ride.t_s), 13.4)
    (tmp_path / "r.csv").write_text(app_exports.racechrono(ride))
    assert [notice.code for notice in api.import_recording(tmp_path / "r.csv").notices] == ["import-sign"]


@pytest.mark.parametrize("late_s", [0.0, 1.0, 1.5, 2.0])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_late_swerves_are_not_mistaken_for_opposite_ones(sign, late_s):
    """The bike swerves to the left and to the right with a period of four seconds. In a track that is 2 s late, the
    turns therefore seem to be in the opposite direction."""
    t_s = np.arange(0.0, 60.0, 0.02)
    yaw_dps = 20.0 * np.sin(2 * np.pi * t_s / 4.0 + np.sin(t_s / 7.0))
    course = np.cumsum(np.radians(yaw_dps)) * 0.02
    east, north = (np.cumsum(10.0 * wave(course)) * 0.02 for wave in (np.cos, np.sin))
    places = 1e-5 * north, 1e-5 * east
    lat, lon = (np.where(np.arange(3000) % 50 == 0, np.interp(t_s - late_s, t_s, place), np.nan) for place in places)
    rates = np.column_stack((0 * t_s, yaw_dps, 0 * t_s))
    assert log_agrees(t_s, np.tile([0.0, sign, 0.0], (3000, 1)), rates, lat, lon) is (sign > 0)
