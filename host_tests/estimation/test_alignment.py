"""The alignment of a motorcycle from a ride without poses: accuracy, standard errors, phones, and refusals."""

import json
from dataclasses import replace

import numpy as np
import pytest
from kickstand_tools import api
from kickstand_tools.estimation.alignment import PHONES
from kickstand_tools.logs.log import Log
from kickstand_tools.signals import rotation_matrix, rotation_vector
from support import command
from window_input import RATE_HZ, log_of, ride_of, still_log


def mounted(log, rotation):
    """Return the log of the same ride by a sensor that is mounted differently. All readings are rotated."""
    return replace(log, accel_g=log.accel_g @ rotation.T, gyro_dps=log.gyro_dps @ rotation.T)


def moved(log, rotation):
    """Return the log of a sensor that is rotated in the middle of the ride."""
    late, rotated = (log.t_s > 0.5 * log.t_s[-1])[:, None], mounted(log, rotation)
    accel, gyro = np.where(late, rotated.accel_g, log.accel_g), np.where(late, rotated.gyro_dps, log.gyro_dps)
    return replace(log, accel_g=accel, gyro_dps=gyro)


def errors_deg(calibration, true):
    """Return the sizes of the errors of pitch, yaw and roll, which are the rotations about left, up and forward."""
    return np.abs(np.degrees(rotation_vector(calibration.vehicle_from_sensor @ true.T)))


def stated_deg(fit):
    return np.array([fit.pitch_deg, fit.yaw_deg, fit.roll_deg])


def refusal(log, phone=None):
    with pytest.raises(api.RefusedInput) as raised:
        api.fit_ride(log, phone)
    return raised.value


@pytest.mark.parametrize(
    ("profile", "seed", "seconds", "speed"),
    [
        ("hills", 22, 120.0, True),
        ("city", 21, 120.0, False),
        *[
            pytest.param(*ride, marks=pytest.mark.long)
            for ride in (("street", 21, 240.0, True), ("track", 22, 240.0, False), ("sweeper", 22, 240.0, False))
        ],
    ],
)
def test_ride_aligns_a_randomly_mounted_sensor(profile, seed, seconds, speed):
    ride = ride_of(profile, seed, seconds)
    log = log_of(ride, speed)
    fit = api.fit_ride(log)
    error, stated = errors_deg(fit.calibration, ride.vehicle_from_sensor), stated_deg(fit)
    assert np.all(error < [1.0, 1.5, 1.5]) and np.all(error < 3.0 * stated)
    assert np.all((0.2 < stated) & (stated < 1.5))
    assert fit.lag_s == (pytest.approx(0.1, abs=0.1) if speed else None) and fit.phone_deg is None
    assert np.max(np.abs(fit.halves_deg)) < 1.5
    assert fit.used_s == pytest.approx((0.0, log.t_s[-1]), abs=0.3)
    riding_s = np.sum(ride.truth["speed_mps"][::4] > 0.3) / RATE_HZ
    assert fit.riding_s == pytest.approx(riding_s, rel=0.2)
    assert fit.riding_s + fit.standing_s == pytest.approx(log.t_s[-1], abs=0.3)
    riding = ride.truth["speed_mps"] > 1.0
    assert fit.lean_deg == pytest.approx(np.sqrt(np.mean(ride.truth["lean_deg"][riding] ** 2)), rel=0.1)
    calibration = fit.calibration
    assert (calibration.aligned, calibration.six_done, calibration.vehicle) == (True, False, "motorcycle")
    at_rest = np.mean(ride.readings[:400], axis=0)
    assert calibration.gyro_bias_dps == pytest.approx(at_rest[4:], abs=0.3)
    # On an upright bike at rest, the calibrated force is up
    force = calibration.vehicle_from_sensor @ (np.mean(ride.upright, axis=0)[:3] + calibration.accel_offset_g)
    assert force == pytest.approx([0.0, 1.0, 0.0], abs=0.045)
    assert fit.offset_g @ calibration.vehicle_from_sensor == pytest.approx(calibration.accel_offset_g)
    assert np.all((0.005 < fit.offset_sigma_g) & (fit.offset_sigma_g < 0.03))


def test_a_ride_is_as_good_as_two_poses_and_serves_the_display():
    """A kickstand pose hardly determines yaw, and an offset of the accelerometer falsifies the roll of the poses."""
    ride = ride_of("hills", 22)
    log = log_of(ride, speed=False)
    calibration = api.fit_ride(log).calibration
    kickstand, upright = (api.Log.from_readings(pose, ride.rate_hz) for pose in (ride.kickstand, ride.upright))
    poses = errors_deg(api.fit_two_positions(kickstand, upright).calibration, ride.vehicle_from_sensor)
    assert np.all(errors_deg(calibration, ride.vehicle_from_sensor)[1:] < poses[1:])
    live = api.replay(log, calibration)
    displayed = ~np.isnan(live.lean_sigma_deg)
    assert np.mean(displayed) > 0.9
    assert np.sqrt(np.mean((live.lean_deg - ride.truth["lean_deg"][::4])[displayed] ** 2)) < 1.5


def phone_log(mounting, tilt_deg=(0.0, 0.0, 0.0)):
    """Return the street ride of a phone, and its true matrix. tilt_deg: rotation about left, up, forward."""
    ride = ride_of("street")
    matrix = rotation_matrix(np.radians(tilt_deg)) @ mounting
    return mounted(log_of(ride, speed=False), matrix.T @ ride.vehicle_from_sensor), matrix


FIRST = "portrait", 0
MOUNTINGS = [
    pytest.param(phone, k, marks=() if (phone, k) == FIRST else pytest.mark.long)
    for phone, mountings in PHONES.items()
    for k in range(len(mountings))
]


@pytest.mark.parametrize(("phone", "k"), MOUNTINGS)
def test_a_phone_may_be_tilted_in_its_holder(phone, k):
    log, matrix = phone_log(PHONES[phone][k], (35.0, 10.0, 0.0))
    fit = api.fit_ride(log, phone)
    assert np.all(errors_deg(fit.calibration, matrix) < [1.0, 1.5, 1.5])
    assert fit.phone_deg == pytest.approx(np.hypot(35.0, 10.0), abs=2.0)


@pytest.mark.parametrize("phone", PHONES)
def test_a_phone_mounted_otherwise_is_refused(phone):
    for different in PHONES.keys() - {phone}:
        for mounting in PHONES[different]:
            assert refusal(phone_log(mounting, (20.0, 10.0, 0.0))[0], phone).code in (
                "phone-otherwise",
                "phone-upside-down",
            )


def test_a_phones_mounting_shows_a_reversed_accelerometer():
    log, _ = phone_log(PHONES["portrait"][0])
    mirrored = replace(log, accel_g=-log.accel_g)
    assert str(refusal(mirrored, "portrait")).startswith(
        "RIDE.csv: for a phone mounted portrait all accelerations have the opposite sign: at rest"
    )


def test_bad_readings_and_time_in_the_hand_are_left_out():
    """The readings freeze for 10 s, are absurd at times, and are missing for 15 s. A hand holds the sensor for 15 s at
    the end. The speed is in whole km/h and 1 s late."""
    ride = ride_of("hills", 22)
    log = log_of(ride)
    speed = ride.truth["speed_mps"][::4]
    log.speed_mps[RATE_HZ::RATE_HZ] = np.round(speed[:-RATE_HZ:RATE_HZ] * 3.6) / 3.6
    log.accel_g[2500:3000], log.gyro_dps[2500:3000] = log.accel_g[2500], log.gyro_dps[2500]
    log.accel_g[77::1250], log.gyro_dps[99::1250] = 1000.0, 1e5
    time = np.arange(15 * RATE_HZ)[:, None] / RATE_HZ
    log.accel_g[-len(time) :] = np.sin(time * [0.9, 1.1, 1.3] + [0.0, 1.0, 2.0])
    log.gyro_dps[-len(time) :] = 90.0 * np.cos(time * [2.0, 3.0, 4.0])
    steps = []
    usable = np.r_[0:3500, 4250 : len(log.t_s)]
    fit = api.fit_ride(log.part(usable), progress=lambda done, total: steps.append((done, total)))
    assert steps == [(1, 2), (2, 2)]
    assert np.all(errors_deg(fit.calibration, ride.vehicle_from_sensor) < [1.0, 1.5, 1.5])
    assert fit.lag_s == pytest.approx(1.0, abs=0.3)
    assert log.t_s[-1] - 35.0 < fit.used_s[1] <= log.t_s[-1] - 15.0
    assert "frozen-readings" in [notice.code for notice in fit.notices]


def car(seconds=120.0):
    """Simulate a car in bends at 12 m/s. Its body leans outwards by 3 degrees per g."""
    chance = np.random.default_rng(1)
    t = np.arange(0.0, seconds, 0.02)
    yaw = 0.3 * np.sin(0.2 * t) ** 3
    left = 12.0 * yaw / 9.80665
    roll = np.radians(3.0) * left
    force = np.column_stack((left + roll, np.ones_like(t), np.zeros_like(t)))
    rate = np.degrees(np.column_stack((np.zeros_like(t), yaw, np.gradient(roll, t))))
    return Log(t, force + 0.02 * chance.normal(size=force.shape), rate + 0.2 * chance.normal(size=rate.shape))


WRONG = {
    "a car": (lambda log: car(), "not-leaning"),
    "short": (lambda log: log.part(slice(1500)), "ride-short"),
    "parked": (lambda log: log_of(ride_of("parked", 1, 60.0)), "ride-short"),
    "straight": (lambda log: log_of(ride_of("city", 5, 60.0)), "no-bends"),
    "rad/s": (lambda log: replace(log, gyro_dps=np.radians(log.gyro_dps)), "rates-in-radians"),
    "speed stuck": (lambda log: replace(log, speed_mps=log.speed_mps * 0.0 + 9.0), "speed-stuck"),
    "half the speed": (lambda log: replace(log, speed_mps=log.speed_mps * 0.5), "speed-unit"),
    "twice the speed": (lambda log: replace(log, speed_mps=log.speed_mps * 2.0), "speed-unit"),
    "moved by 25 degrees": (
        lambda log: moved(log, rotation_matrix(np.radians([15.0, 0.0, 20.0]))),
        "ride-halves ride-uncertain ride-contradicts",
    ),
    "gyro of the opposite sign": (lambda log: replace(log, gyro_dps=-log.gyro_dps), "left-handed"),
    "absurd readings": (lambda log: replace(log, accel_g=log.accel_g * 1e4), "ride-short"),
    "rates exchanged": (lambda log: replace(log, gyro_dps=log.gyro_dps[:, [0, 2, 1]]), "rates-misfit"),
}


@pytest.mark.parametrize("name", WRONG)
def test_log_without_a_mounted_sensors_ride_is_refused(name):
    change, codes = WRONG[name]
    log = replace(change(log_of(ride_of("street"))), name="n")
    raised = refusal(log)
    assert raised.code in codes.split() and str(raised).startswith("n: ")


@pytest.mark.parametrize(
    ("log", "phone", "words"),
    [
        (still_log(5.0, 19.9), None, r"^n: a sample every 0\.05 s: at least 20 per second"),
        (still_log(5.0, 10.0), None, r"^n: a sample every 0\.10 s: at least 20 per second"),
        (still_log(5.0, 20.0), None, r"^n: only 0 s of riding: at least 30 s with bends are needed"),
        (still_log(5.0), "sideways", "^no phone is mounted sideways: there are portrait, landscape, flat"),
    ],
)
def test_slow_log_or_unknown_phone_mounting_is_refused(log, phone, words):
    with pytest.raises(api.InputError, match=words):
        api.fit_ride(log, phone)


@pytest.mark.long
def test_recorded_cars_are_refused(shared_data):
    """The log of a car is refused in any mounting, with a speed and without one."""
    rotation = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0]
    rotation *= np.linalg.det(rotation)
    drives = sorted(shared_data.glob("car-*.csv.gz"))
    assert len(drives) == 4
    for path in drives:
        log = mounted(api.read_log(path), rotation)
        for speed in (log.speed_mps, np.full(len(log.t_s), np.nan)):
            assert refusal(replace(log, speed_mps=speed)).code == "not-leaning"


@pytest.mark.long
def test_recorded_motorcycle_is_aligned(shared_data):
    """The reference matrix has an error of a few degrees. Forward is from braking between the same two traffic lights,
    and up is from the first second."""
    log = api.read_log(shared_data / "motorcycle-ride.csv.gz")
    rough = np.array([[0.9869, 0.1612, 0.0060], [-0.0137, 0.0466, 0.9988], [0.1608, -0.9858, 0.0482]])
    fits = [api.fit_ride(replace(log, speed_mps=speed)) for speed in (log.speed_mps, np.full(len(log.t_s), np.nan))]
    for fit in fits:
        assert np.all(errors_deg(fit.calibration, rough) < [3.0, 6.0, 3.0])
        assert np.all(stated_deg(fit)[1:] < [3.0, 2.0])
    assert max(errors_deg(fits[1].calibration, fits[0].calibration.vehicle_from_sensor)) < 4.0


def test_calibrate_ride_writes_the_alignment_and_its_quality(tmp_path):
    ride, log, out = ride_of("hills", 22), tmp_path / "RIDE.csv", tmp_path / "RIDE.cal.json"
    rows = np.column_stack((ride.time, ride.readings[:, :3], ride.readings[:, 4:]))[::4]
    np.savetxt(log, rows, "%.6f", ",", header=command.HEADER, comments="")
    printed = command.works("calibrate", "ride", log, "--out", out).out
    data = json.loads(out.read_text())
    assert (data["aligned"], data["six_positions"], data["vehicle"]) == (True, False, "motorcycle")
    quality = data["ride_quality_deg"]
    assert all(f"{name} {quality[name]:.1f}" in printed for name in ("roll", "pitch", "yaw"))
    assert np.all(errors_deg(api.read_calibration(out), ride.vehicle_from_sensor) < [1.0, 1.5, 1.5])
    short = command.write(tmp_path / "SHORT.csv", rows[:500])
    words = "s of riding: at least 30 s with bends are needed"
    command.refused(tmp_path, "calibrate", "ride", short, "--out", tmp_path / "NEW.json", words=words)
