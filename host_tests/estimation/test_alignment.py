"""Test `kickstand calibrate ride`: the alignment of a motorcycle from a ride without poses, and refusals.

In the simulated rides the sensor is mounted at random. The sensor has the errors that its data sheet allows.
"""

import functools
import itertools
import json
from dataclasses import replace

import numpy as np
import pytest
from kickstand_tools import api
from kickstand_tools.estimation import first_guess
from kickstand_tools.estimation.alignment import PHONES, mounted_windows
from kickstand_tools.logs.log import Log
from kickstand_tools.signals import rotation_matrix, rotation_vector
from support import command

RATE_HZ = 200
SIGNS = list(itertools.product((1.0, -1.0), repeat=3))


@functools.cache
def simulated(profile="street", seed=21, seconds=180.0):
    return api.simulate_ride(profile, seed, seconds)


def log_of(made, speed=True):
    """Return the log of a ride as recorded, with one speed per second."""
    log = api.Log.from_readings(made.readings.copy(), RATE_HZ, "RIDE.csv")
    if speed:
        log.speed_mps[::RATE_HZ] = made.truth["speed_mps"][::RATE_HZ]
    return log


def mounted(log, rotation):
    """Return the log of the same ride by a sensor that is mounted differently. All readings are rotated."""
    return replace(log, accel_g=log.accel_g @ rotation.T, gyro_dps=log.gyro_dps @ rotation.T)


def errors_deg(found, true):
    """Return the sizes of the errors of pitch, yaw and roll, which are the rotations about left, up and forward."""
    return np.abs(np.degrees(rotation_vector(found.calibration.vehicle_from_sensor @ true.T)))


def check(found, true, yaw_deg=3.0, roll_deg=1.5):
    pitch, yaw, roll = errors_deg(found, true)
    assert yaw < yaw_deg
    assert roll < roll_deg
    assert pitch < 3.0


@pytest.mark.parametrize(
    ("profile", "seed", "speed"),
    [("street", 21, True), ("city", 21, True), ("track", 22, False), ("hills", 22, False), ("sweeper", 22, False)],
)
def test_ride_aligns_a_randomly_mounted_sensor(profile, seed, speed):
    made = simulated(profile, seed, 240.0)
    found = api.fit_ride(log_of(made, speed))
    check(found, made.vehicle_from_sensor)
    stated = np.array([found.pitch_deg, found.yaw_deg, found.roll_deg])
    assert np.all(errors_deg(found, made.vehicle_from_sensor) < 3.0 * stated)
    assert np.all(stated < 1.5)
    assert (found.lag_s is not None) == speed


def test_the_display_shows_the_lean_with_this_alignment():
    made = simulated("hills", 22, 240.0)
    log = log_of(made, speed=False)
    found = api.replay(log, api.fit_ride(log).calibration)
    shown = ~np.isnan(found.lean_sigma_deg)
    assert np.mean(shown) > 0.95
    off = (found.lean_deg - made.truth["lean_deg"])[shown]
    assert np.sqrt(np.mean(off**2)) < 1.0  # rms error in degrees; the goal was 1.5


def test_ride_alignment_is_as_good_as_two_poses():
    """The ride gives a better yaw, which a kickstand pose hardly determines. The ride also gives a better roll, which
    an offset of the accelerometer falsifies in the poses."""
    made = simulated("hills", 22, 240.0)
    kickstand, upright = (api.Log.from_readings(pose, RATE_HZ) for pose in (made.kickstand, made.upright))
    two = errors_deg(api.fit_two_positions(kickstand, upright), made.vehicle_from_sensor)
    ride = errors_deg(api.fit_ride(log_of(made, speed=False)), made.vehicle_from_sensor)
    assert ride[1] < two[1]
    assert ride[2] < two[2]


def test_the_offset_across_the_bike_is_found():
    """The accelerometer has an additional offset of 50 mg across the bike. An offset of 25 mg would be 1.4 degrees of
    roll. The fit must find the offset to within 20 mg."""
    made = simulated()
    log = log_of(made)
    across = made.vehicle_from_sensor[0]
    for extra in (-0.05, 0.05):
        found = api.fit_ride(replace(log, accel_g=log.accel_g + extra * across))
        check(found, made.vehicle_from_sensor)
        upright = made.chip.accel_matrix @ made.vehicle_from_sensor[1] + made.chip.accel_offset + extra * across
        calibrated = found.calibration.vehicle_from_sensor @ (upright + found.calibration.accel_offset_g)
        assert abs(calibrated[0]) < 0.02


def test_left_handed_axes_are_refused():
    """Axes can be exchanged and reversed in 48 ways. The 24 right-handed ways are only another mounting. The 24
    left-handed ways are refused. This test tries every fifth way; checks/test_handedness.py tries all."""
    log = log_of(simulated(), speed=False)
    want = first_guess.axes(mounted_windows(log)).matrix
    for order, signs in [*itertools.product(itertools.permutations(range(3)), SIGNS)][::5]:
        axes = np.eye(3)[list(order)] * np.array(signs)[:, None]
        if np.linalg.det(axes) > 0.0:
            matrix = first_guess.axes(mounted_windows(mounted(log, axes))).matrix
            assert np.degrees(np.linalg.norm(rotation_vector(matrix @ axes @ want.T))) < 0.1
        else:
            with pytest.raises(api.RefusedInput) as raised:
                api.fit_ride(mounted(log, axes))
            assert raised.value.code == "left-handed"


def test_phones_mounting_shows_a_reversed_accelerometer():
    made = simulated()
    log = mounted(log_of(made), PHONES["portrait"][0].T @ made.vehicle_from_sensor)
    mirrored = replace(log, accel_g=-log.accel_g)
    assert (api.fit_ride(log, phone="portrait").phone_deg or 99.0) < 3.0
    api.fit_ride(mirrored)
    with pytest.raises(api.RefusedInput, match=r"opposite sign: at rest .* \+1 g"):
        api.fit_ride(mirrored, phone="portrait")


def test_a_phones_mounting_is_a_prior():
    """The known mounting of a phone is a prior that has little weight compared with the ride."""
    made = simulated()
    tilted = rotation_matrix(np.radians([35.0, 0.0, 0.0])) @ PHONES["flat"][0]
    log = mounted(log_of(made, speed=False), tilted.T @ made.vehicle_from_sensor)
    with_it, without = (
        np.degrees(np.linalg.norm(rotation_vector(found.calibration.vehicle_from_sensor @ PHONES["flat"][0].T)))
        for found in (api.fit_ride(log, "flat"), api.fit_ride(log))
    )
    assert without - 0.3 < with_it < without - 0.005


@pytest.mark.parametrize("phone", PHONES)
def test_a_phones_mounting_is_checked(phone):
    """The phone may be tilted from the stated mounting as is usual in a holder. Another mounting is refused."""
    made = simulated()
    tilted = rotation_matrix(np.radians([35.0, 10.0, 0.0]))
    for mountings in PHONES.values():
        for mounting in mountings:
            log = mounted(log_of(made, speed=False), (tilted @ mounting).T @ made.vehicle_from_sensor)
            if any(mounting is own for own in PHONES[phone]):
                found = api.fit_ride(log, phone)
                check(found, tilted @ mounting)
                assert found.phone_deg == pytest.approx(np.hypot(35.0, 10.0), abs=3.0)
            else:
                with pytest.raises(api.RefusedInput) as raised:
                    api.fit_ride(log, phone)
                assert raised.value.code in ("phone-otherwise", "phone-upside-down")


def test_time_in_the_hand_around_the_ride_is_left_out():
    made = simulated()
    log = log_of(made, speed=False)
    n = 20 * RATE_HZ
    time = np.arange(n)[:, None] / RATE_HZ
    waved = np.sin(time * [0.9, 1.1, 1.3] + [0.0, 1.0, 2.0]), 90.0 * np.cos(time * [2.0, 3.0, 4.0])
    for part in (slice(0, n), slice(len(log.t_s) - n, None)):
        log.accel_g[part], log.gyro_dps[part] = waved
    found = api.fit_ride(log)
    check(found, made.vehicle_from_sensor, roll_deg=2.0)
    assert 20.0 <= found.used_s[0] < 40.0
    assert log.t_s[-1] - 40.0 < found.used_s[1] <= log.t_s[-1] - 20.0


def test_bad_readings_are_left_out_and_a_rough_speed_suffices():
    made = simulated()
    log = log_of(made)
    log.speed_mps[RATE_HZ::RATE_HZ] = np.round(made.truth["speed_mps"][:-RATE_HZ:RATE_HZ] * 3.6) / 3.6
    log.accel_g[10000:14000], log.gyro_dps[10000:14000] = log.accel_g[10000], log.gyro_dps[10000]
    log.accel_g[77::5000] = 1000.0
    log.gyro_dps[99::5000] = 1e5
    kept = np.r_[0:20000, 26000 : len(log.t_s)]
    seen = []
    found = api.fit_ride(log.part(kept), progress=lambda done, total: seen.append((done, total)))
    assert seen == sorted(seen) and seen[-1][0] == seen[-1][1], "progress ends with all done"
    check(found, made.vehicle_from_sensor, roll_deg=2.0)
    assert found.lag_s == pytest.approx(1.0, abs=0.4)


def car(seconds=300.0):
    """Simulate a car on level ground at 12 m/s, in bends to both sides. The car's body leans outwards by 3 degrees per
    g."""
    chance = np.random.default_rng(1)
    t = np.arange(0.0, seconds, 0.01)
    yaw = 0.3 * np.sin(0.2 * t) ** 3
    left = 12.0 * yaw / 9.80665
    roll = np.radians(3.0) * left
    force = np.column_stack((left + roll, np.ones_like(t), np.zeros_like(t)))
    rate = np.degrees(np.column_stack((np.zeros_like(t), yaw, np.gradient(roll, t))))
    return Log(t, force + 0.02 * chance.normal(size=force.shape), rate + 0.2 * chance.normal(size=rate.shape))


def moved(log, degrees):
    half = len(log.t_s) // 2
    rotation = rotation_matrix(np.radians(degrees) * np.array([0.6, 0.0, 0.8]))
    log = replace(log, accel_g=log.accel_g.copy(), gyro_dps=log.gyro_dps.copy())
    log.accel_g[half:], log.gyro_dps[half:] = log.accel_g[half:] @ rotation.T, log.gyro_dps[half:] @ rotation.T
    return log


WRONG = {
    "a car": (lambda log: car(), ("not-leaning",)),
    "short": (lambda log: log.part(slice(6000)), ("ride-short",)),
    "parked": (lambda log: log_of(simulated("parked", 1, 60.0)), ("ride-short",)),
    "straight": (lambda log: log_of(simulated("city", 5, 60.0)), ("no-bends",)),
    "rad/s": (lambda log: replace(log, gyro_dps=np.radians(log.gyro_dps)), ("rates-in-radians",)),
    "speed stuck": (lambda log: replace(log, speed_mps=log.speed_mps * 0.0), ("speed-stuck",)),
    "half the speed": (lambda log: replace(log, speed_mps=log.speed_mps * 0.5), ("speed-unit",)),
    "moved a little": (lambda log: moved(log, 12.0), ("ride-contradicts", "ride-halves", "ride-uncertain")),
    "gyro of the opposite sign": (lambda log: replace(log, gyro_dps=-log.gyro_dps), ("left-handed",)),
    "nothing but absurd readings": (lambda log: replace(log, accel_g=log.accel_g * 1e4), ("ride-short",)),
    "axes exchanged": (lambda log: replace(log, gyro_dps=log.gyro_dps[:, [1, 2, 0]]), None),
    "accelerations exchanged": (lambda log: replace(log, accel_g=log.accel_g[:, [0, 2, 1]]), ("rates-misfit",)),
}


@pytest.mark.parametrize("name", WRONG)
def test_log_without_a_mounted_sensors_ride_is_refused(name):
    change, code = WRONG[name]
    with pytest.raises(api.RefusedInput) as raised:
        api.fit_ride(change(log_of(simulated())))
    assert code is None or raised.value.code in code


def test_slow_log_or_unknown_phone_mounting_is_refused():
    log = log_of(simulated())
    with pytest.raises(api.InputError, match=r"a sample every 0\.10 s: at least 20 per second"):
        api.fit_ride(log.part(slice(None, None, 20)))
    with pytest.raises(api.InputError, match="portrait, landscape, flat"):
        api.fit_ride(log, phone="upside down")


def test_a_recorded_car_is_refused(shared_data):
    """The log of a car is refused in any mounting, with a speed and without one."""
    rotation = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0]
    rotation *= np.linalg.det(rotation)
    drives = sorted(shared_data.glob("car-*.csv.gz"))
    assert len(drives) == 4
    for path in drives:
        log = mounted(api.read_log(path), rotation)
        for each in (log, replace(log, speed_mps=np.full(len(log.t_s), np.nan))):
            with pytest.raises(api.RefusedInput) as raised:
                api.fit_ride(each)
            assert raised.value.code == "not-leaning"


def test_recorded_motorcycle_is_aligned(shared_data):
    """The reference matrix has an error of a few degrees. Forward is from braking between the same two traffic lights,
    and up is from the first second."""
    log = api.read_log(shared_data / "motorcycle-ride.csv.gz")
    rough = np.array([[0.9869, 0.1612, 0.0060], [-0.0137, 0.0466, 0.9988], [0.1608, -0.9858, 0.0482]])
    found, without = api.fit_ride(log), api.fit_ride(replace(log, speed_mps=np.full(len(log.t_s), np.nan)))
    for each in (found, without):
        pitch, yaw, roll = errors_deg(each, rough)
        assert max(pitch, roll) < 3.0
        assert yaw < 6.0
        assert each.roll_deg < 2.0
        assert each.yaw_deg < 3.0
    assert max(errors_deg(without, found.calibration.vehicle_from_sensor)) < 4.0


def test_the_command(tmp_path):
    made = simulated()
    log, short = tmp_path / "RIDE.csv", tmp_path / "SHORT.csv"
    rows = np.column_stack((made.time, made.readings[:, :3], made.readings[:, 4:]))[::2]
    for path, part in ((log, rows), (short, rows[:2000])):
        np.savetxt(path, part, "%.6f", ",", header=command.HEADER, comments="")
    out = tmp_path / "RIDE.cal.json"
    said = command.works("calibrate", "ride", log, "--out", out).out
    found = api.fit_ride(log)
    assert f"roll {found.roll_deg:.1f}, pitch {found.pitch_deg:.1f}, yaw {found.yaw_deg:.1f} degrees" in said
    written = api.read_calibration(out).vehicle_from_sensor
    assert written == pytest.approx(found.calibration.vehicle_from_sensor, abs=1e-6)
    data = json.loads(out.read_text())
    assert (data["aligned"], data["six_positions"], data["vehicle"]) == (True, False, "motorcycle")
    assert data["ride_quality_deg"]["yaw"] == pytest.approx(found.yaw_deg, abs=0.01)
    command.refused(tmp_path, "calibrate", "ride", log, "--out", log, words="is also an input")
    words = "s of riding: at least 30 s with bends are needed"
    command.refused(tmp_path, "calibrate", "ride", short, "--out", tmp_path / "NEW.json", words=words)
