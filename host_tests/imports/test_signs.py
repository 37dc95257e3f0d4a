"""In a log from any app, the axis that points up reads +1 g at rest, and gravity is never missing. Rows written by hand
show the axes of apps that record along the bike."""

import numpy as np
import pytest
from kickstand_tools import api
from support import command
from support.recordings import app_exports
from support.recordings.app_exports import PHONE, riding

UP = PHONE @ [0.0, 1.0, 0.0]


def up_at_rest(imported: api.Imported) -> np.ndarray:
    """Return the mean force in the first second, while the motorcycle stands upright."""
    return imported.log.accel_g[imported.log.t_s < 1.0].mean(axis=0)


AIM = "AiM CSV File\nTime,LateralAcc,VerticalAcc,InlineAcc,PitchRate,YawRate,RollRate,GPS Speed\n"
AIM += "s,g,g,g,deg/s,deg/s,deg/s,mph\n"
VBO = "File created on 02/01/1970 @ 00:00\n[header]\n[column names]\n"
VBO += "time lat long velocity Y_Accel Z_Accel X_Accel PitchRate YawRate RollRate\n[data]\n"
OWN = "t_s,left_g,up_g,forward_g,pitch_rate_dps,yaw_rate_dps,roll_rate_dps,speed_mps\n"
BOX = "Lap,1\n\nTime,GForceX,GForceY,GForceZ,GyroX,GyroY,GyroZ,KPH\n"


@pytest.mark.parametrize(
    ("name", "head", "row", "force", "rates", "speed"),
    [
        ("aim.csv", AIM, "{0:.2f},0.1,-1,0.2,1,2,3,10", (-0.1, 1.0, 0.2), (-1, -2, 3), 4.4704),
        ("aim.csv", AIM, "{0:.2f},0.1,1,0.2,1,2,3,10", (-0.1, 1.0, 0.2), (-1, -2, 3), 4.4704),
        ("own.csv", OWN, "{0:.2f},0.1,1,0.2,1,2,3,10", (0.1, 1.0, 0.2), (-1, 2, 3), 10.0),
        ("a.vbo", VBO, "0000{0:05.2f} +60 -120 36 0.1 1 0.2 1 2 3", (0.1, 1.0, 0.2), (-1, -2, 3), 10.0),
        ("box.csv", BOX, "{0:.2f},0.2,0.1,1,3,1,2,36", (0.1, 1.0, 0.2), (1, 2, 3), 10.0),
    ],
)
def test_axes_of_the_bike_are_left_up_and_forward(tmp_path, name, head, row, force, rates, speed):
    """AiM has the axes forward, right and down; its vertical may also point up. VBO's yaw is clockwise, and its pitch
    nose up, as in Kickstand's own exports. RaceBox has x forward, y left, z up."""
    (tmp_path / name).write_text(head + "\n".join(row.format(k / 20.0) for k in range(60)) + "\n")
    imported = api.import_recording(tmp_path / name)
    assert imported.vehicle_axes
    assert imported.log.accel_g[5] == pytest.approx(force) and imported.log.gyro_dps[5] == pytest.approx(rates)
    assert np.nanmax(imported.log.speed_mps) == pytest.approx(speed)
    if name == "a.vbo":  # minutes, west positive, on the day of the file
        assert (np.nanmax(imported.log.lat_deg), np.nanmax(imported.log.lon_deg)) == pytest.approx((1.0, 2.0))
        assert np.nanmin(imported.log.utc_s) == pytest.approx(86_400.0)


def test_without_the_platform_sensor_logger_is_refused(tmp_path):
    files = app_exports.sensor_logger(riding().every(4), "ios")
    del files["Metadata.csv"]
    with pytest.raises(api.InputError, match=r"Metadata\.csv is missing.*opposite signs"):
        api.import_recording(app_exports.into(tmp_path / "s", files))


@pytest.mark.parametrize("app", ["phyphox", "sensor_logger", "sensor_kinetics", "sensorlog"])
def test_acceleration_without_gravity_is_completed_or_refused(tmp_path, app):
    ride = riding().every(4)
    if app == "sensorlog":
        text = app_exports.sensorlog(ride, accelerometer=False)
        complete, linear = {"s.csv": text}, {"s.csv": text.replace("motionGravity", "motionHeading")}
    else:
        complete = getattr(app_exports, app)(ride, **({"platform": "ios"} if app == "sensor_logger" else {}))
        complete.pop("Accelerometer.csv" if app == "phyphox" else "Ride_accm.csv", None)
        if app == "phyphox":
            names = ["Time (s)", *[f"Gravity {axis} (m/s^2)" for axis in "XYZ"]]
            rows = np.column_stack((ride.t_s, 9.81 * ride.gravity_g)).tolist()
            complete["Gravity.csv"] = app_exports.lines(names, rows)
        linear = {name: text for name, text in complete.items() if name not in ("Gravity.csv", "Ride_grvm.csv")}
    imported = api.import_recording(app_exports.into(tmp_path / "both", complete))
    assert up_at_rest(imported) == pytest.approx(UP, abs=0.02) and "gravity added" in imported.taken[0].sign
    words = "gravity has been taken off its .*, and without it there is no lean: "
    with pytest.raises(api.InputError, match=words):
        api.import_recording(app_exports.into(tmp_path / "linear", linear))


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_turns_of_the_track_show_an_unknown_sign(tmp_path, sign):
    (tmp_path / "r.csv").write_text(app_exports.racechrono(riding().every(2), sign))
    imported = api.import_recording(tmp_path / "r.csv")
    assert up_at_rest(imported) == pytest.approx(UP, abs=0.02) and not imported.notices
    assert imported.taken[0].sign.startswith(f"{sign:+.0f} g up, by the turns of the track")


def test_uncertain_sign_is_reported_and_can_be_turned(tmp_path):
    ride = riding().every(2)
    ride.force_g = -ride.force_g  # an iPhone might give this sign
    folder = app_exports.into(tmp_path / "k", app_exports.sensor_kinetics(ride))
    warning = command.works("import", folder, "--out", tmp_path / "RIDE.csv").err
    assert warning.startswith("warning: ") and "--units a=-g or a=-m/s2 puts it right" in warning
    imported = api.import_recording(folder, units={"a": "-m/s2"})
    assert up_at_rest(imported) == pytest.approx(UP, abs=0.02) and not imported.notices
