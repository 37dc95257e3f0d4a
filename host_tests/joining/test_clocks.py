"""Two devices on one bike have one clock: its shift, its drift, the angle between the calibrations, the refusals."""

import numpy as np
import pytest
from joining.known_roads import another_device, road, turned
from kickstand_tools import api
from kickstand_tools.checks.log import check_log
from kickstand_tools.joining.agreement import clocks
from kickstand_tools.joining.motion import motion

MOUNT = turned(90.0)  # B's sensor on the bike


@pytest.mark.parametrize(
    ("seconds", "device", "apart_deg", "words"),
    [
        (300.0, {}, 0.0, None),
        (900.0, {"from_s": 7.5, "drift": 200e-6}, 0.0, None),
        (900.0, {"to_s": 700.0, "drift": -300e-6}, 0.0, None),
        (300.0, {}, 14.5, None),
        (300.0, {}, 15.5, "degrees apart"),
        (900.0, {"drift": 500e-6}, 0.0, "drift apart by more than clocks do"),
        (62.0, {}, 0.0, None),
        (59.0, {}, 0.0, "at no time do they turn alike"),
        (65.0, {"from_s": 7.5}, 0.0, "at no time do they turn alike"),
        (300.0, {"seed": 2}, 0.0, "at no time do they turn alike"),
        (300.0, {"twice": True}, 0.0, "they fit at two times"),
    ],
)
def test_two_devices_on_one_bike_have_one_clock(seconds, device, apart_deg, words):
    log, _ = road(seconds, hz=50)
    other, _ = road(seconds, device.get("seed", 1), hz=50)
    if device.get("twice"):
        t_s = np.asarray(np.append(log.t_s, log.t_s + 300.0), dtype=np.float64)
        log = api.Log(t_s, np.tile(log.accel_g, (2, 1)), np.tile(log.gyro_dps, (2, 1)))
    changes = {name: device[name] for name in ("from_s", "to_s", "drift") if name in device}
    a, b = motion(check_log(log)), motion(check_log(another_device(other, **changes, mount=MOUNT)))
    of_a = api.CalibrationFile(vehicle_from_sensor=np.eye(3), aligned=True)
    tilt = turned(apart_deg, (1.0, 0.0, 0.0))
    of_b = api.CalibrationFile(vehicle_from_sensor=tilt @ MOUNT.T, aligned=True)
    if words:
        with pytest.raises(api.InputError, match=words):
            clocks(a, b, of_a, of_b)
        return
    relation = clocks(a, b, of_a, of_b)
    from_s, drift = device.get("from_s", 0.0), device.get("drift", 0.0)
    assert relation.later_s == pytest.approx(from_s, abs=0.02)
    assert relation.drift == pytest.approx(drift, abs=20e-6 if seconds > 100.0 else 100e-6)
    assert relation.of_b(np.array([150.0]))[0] == pytest.approx((150.0 - from_s) * (1.0 - drift), abs=0.02)
    assert relation.correlation > 0.99
    assert relation.apart_deg == pytest.approx(apart_deg, abs=2.0 if device else 0.3)
    assert relation.common_s == pytest.approx(min(device.get("to_s", seconds), seconds) - from_s, abs=0.3)
