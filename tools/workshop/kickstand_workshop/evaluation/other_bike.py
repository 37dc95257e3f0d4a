"""A second simulator of rides, which shares nothing with kickstand_sim.simulation. The second simulator checks
parameters that were fitted with kickstand_sim.simulation.

The path and the attitude of the bike are random curves. Path and attitude determine the sensor's position. The force is
the second derivative of the sensor's position plus gravity, and the rates are derivatives of the attitude's matrix.
Both are computed numerically. The bike is in exact balance, except for the movements of its rider. The vibration is
white noise. In the world's axes x and y are level and z is up. The vehicle's axes are left, up and forward.
"""

import numpy as np
from kickstand_tools.calibration.file import CalibrationFile
from kickstand_tools.logs.log import Log
from kickstand_tools.signals import rotation_matrix

G = 9.80665
FINE_HZ, RATE_HZ = 800, 200
# The roll error of the upright pose, the change of pitch between the two poses, and the tilt between them
UP_ERROR_DEG, PITCH_ERROR_DEG, STAND_DEG = 1.5, 1.0, 11.0
VIBRATION_G, VIBRATION_DPS = 0.12, 1.5  # rms of white noise in each sample
RIDER_DEG = 2.0  # rms difference between the bike's lean and the lean of balance, caused by the rider's movements


def sweepers(chance):
    """Return legs with turns of 60 s at 38 degrees, to either side.

    Each leg of a ride is (duration in s, lean in degrees, speed in m/s).
    """
    legs = [(6.0, 0.0, 0.0), (8.0, 0.0, 22.0)]
    for side in (1.0, -1.0, -1.0, 1.0):
        legs += [(5.0, 0.0, 22.0), (60.0, 38.0 * side, 22.0)]
    return [*legs, (6.0, 0.0, 22.0)]


def held(chance):
    """Return legs with long turns to both sides, without straights between them."""
    legs = [(6.0, 0.0, 0.0), (8.0, 0.0, 20.0)]
    for k in range(5):
        legs += [(chance.uniform(25.0, 60.0), chance.uniform(28.0, 42.0) * (-1.0) ** k, chance.uniform(18.0, 25.0))]
    return [*legs, (6.0, 0.0, 20.0)]


def track(chance):
    """Return legs with 35 corners of 30 to 55 degrees, and a few short straights."""
    legs = [(6.0, 0.0, 0.0), (8.0, 0.0, 28.0)]
    for _ in range(35):
        lean, speed = chance.choice((-1.0, 1.0)) * chance.uniform(30.0, 55.0), chance.uniform(18.0, 33.0)
        legs += [(chance.uniform(3.0, 7.0), lean, speed)]
        if chance.random() < 0.4:
            legs += [(chance.uniform(2.0, 5.0), 0.0, speed + chance.uniform(0.0, 15.0))]
    return [*legs, (6.0, 0.0, 20.0)]


KINDS = {"sweepers": sweepers, "held": held, "track": track}


def other_ride(kind, seed, seconds, height_m=0.0, speed=False):
    """Simulate a ride.

    kind: a key of KINDS.
    seconds: longest duration. Legs that end later are left out.
    height_m: height of the sensor above the roll axis.
    speed: True to record the speed in the log once per second, 0.4 s late.

    Returns:
        log: n samples.
        calibration: by two inexact poses.
        lean: true lean in degrees, shape (n).
        speed: true speed in m/s, shape (n).
    """
    chance = np.random.default_rng([seed, *kind.encode()])
    legs = np.array(KINDS[kind](chance))
    time, lean, v = course_of(legs[np.cumsum(legs[:, 0]) <= seconds])
    n = len(time)
    riding = np.clip((v - 1.0) / 3.0, 0.0, 1.0)
    chassis = np.radians(lean + RIDER_DEG * riding * smooth_noise(chance, n, 0.7))
    yaw_rate = np.where(v > 0.5, -G * np.tan(np.radians(lean)) / np.maximum(v, 3.0), 0.0)
    slope = np.radians(0.8) * smooth_noise(chance, n, 4.0) * riding
    dive = np.radians(0.25) * smoothed(np.gradient(v) * FINE_HZ, 0.2)
    force, rates = perfect_readings(v, yaw_rate, slope, chassis, slope + dive, height_m)
    step = FINE_HZ // RATE_HZ
    force, rates = (values[: n // step * step].reshape(-1, step, 3).mean(axis=1) for values in (force, rates))
    count = len(force)
    shaken = np.clip(v[: n // step * step : step] / 5.0, 0.1, 1.0)[:, None]
    force = force + VIBRATION_G * shaken * chance.standard_normal((count, 3))
    rates = np.degrees(rates) + VIBRATION_DPS * shaken * chance.standard_normal((count, 3))
    gyro, accel = random_tolerances(chance)
    drift = np.cumsum(chance.standard_normal((count, 3)), axis=0) * 0.004 / np.sqrt(RATE_HZ)
    rates = rates @ gyro.T + chance.uniform(-0.3, 0.3, 3) + drift
    force = force @ accel.T + chance.uniform(-0.005, 0.005, 3)
    # The upright pose has an error in roll. A change of pitch between the poses causes an error in yaw.
    roll, yaw = np.radians(UP_ERROR_DEG), np.radians(PITCH_ERROR_DEG) / np.tan(np.radians(STAND_DEG))
    roll, yaw = roll * chance.choice((-1.0, 1.0)), yaw * chance.choice((-1.0, 1.0))
    misalignment = about(2, roll) @ about(1, yaw)
    mounting = random_mounting(chance)
    middle = (np.arange(count) + 0.5) / RATE_HZ
    logged = np.full(count, np.nan)
    if speed:
        logged[::RATE_HZ] = np.interp(middle[::RATE_HZ] - 0.4, time, v)
    log = Log(middle, force @ mounting, rates @ mounting, logged)
    calibration = CalibrationFile(
        vehicle_from_sensor=misalignment @ mounting, aligned=True, six_done=True, gyro_delay_s=0.0
    )
    return log, calibration, np.degrees(np.interp(middle, time, chassis)), np.interp(middle, time, v)


def random_tolerances(chance):
    """Return the matrices (3, 3) of gyro and accelerometer, with the errors of scale and cross-axes that remain after
    the six positions."""
    return [
        np.eye(3) + chance.uniform(-1.0, 1.0, (3, 3)) * np.where(np.eye(3) > 0, scale, cross)
        for scale, cross in ((0.03, 0.02), (0.004, 0.01))
    ]


def random_mounting(chance):
    mounting, _ = np.linalg.qr(chance.standard_normal((3, 3)))
    return mounting * np.linalg.det(mounting)


def course_of(legs):
    """Return the smooth course of the legs at FINE_HZ: time in s, lean in degrees, speed in m/s."""
    leg_s, leans, speeds = np.array(legs).T
    ends = np.cumsum(leg_s)
    time = np.arange(int(ends[-1] * FINE_HZ)) / FINE_HZ
    leg_index = np.searchsorted(ends, time, side="right").clip(0, len(leans) - 1)
    v = np.interp(time, np.concatenate(([0.0], ends)), np.concatenate((speeds[:1], speeds)))
    return time, smoothed(leans[leg_index], 0.5), smoothed(v, 0.4)


def perfect_readings(v, yaw_rate, slope, lean, pitch, height_m, slip=0.0, heave_m=0.0, ahead_m=0.0):
    """Compute what a perfect sensor reads, by numerical derivatives of its position and its attitude.

    slip: angle from the bike's heading to its direction of travel, in rad, positive to the left.
    heave_m: vertical movement of the roll axis at the rear wheel.
    height_m: height of the sensor above the roll axis.
    ahead_m: distance of the sensor in front of the rear wheel.

    Returns:
        force: specific force along left, up, forward, shape (n, 3), in g.
        rates: about the same axes, shape (n, 3), in rad/s.
    """
    heading = np.cumsum(yaw_rate) / FINE_HZ
    course = heading + slip
    direction = np.cos(slope) * np.cos(course), np.cos(slope) * np.sin(course), np.sin(slope)
    position = np.cumsum(np.column_stack(direction) * v[:, None] / FINE_HZ, axis=0)
    c, s = np.cos(heading), np.sin(heading)
    zero = np.zeros_like(c)
    ahead = np.stack((c * np.cos(pitch), s * np.cos(pitch), np.sin(pitch)), axis=1)
    level_left = np.stack((-s, c, zero), axis=1)
    above = np.cross(ahead, level_left)
    ct, st = np.cos(lean)[:, None], np.sin(lean)[:, None]
    left, up = ct * level_left + st * above, ct * above - st * level_left
    position = position + height_m * up + ahead_m * ahead
    position[:, 2] += heave_m
    acceleration = np.gradient(np.gradient(position, axis=0), axis=0) * FINE_HZ**2 + [0.0, 0.0, G]
    body = np.stack((left, up, ahead), axis=1)  # each row is an axis of the vehicle, in the world's axes
    change = np.gradient(body, axis=0) * FINE_HZ
    force = np.einsum("nij,nj->ni", body, acceleration) / G
    turning = (change[:, 1] * ahead, change[:, 2] * left, change[:, 0] * up)
    rates = np.column_stack([product.sum(axis=1) for product in turning])
    return force, rates


def about(axis, angle):
    return rotation_matrix(-angle * np.eye(3)[axis])


def smoothed(values, seconds):
    """Apply a moving mean three times, so that the result moves as smoothly as a rider."""
    width = max(1, round(seconds * FINE_HZ))
    window = np.full(width, 1.0 / width)
    for _ in range(3):
        padded = np.pad(values, (width // 2, width - 1 - width // 2), mode="edge")
        values = np.convolve(padded, window, mode="valid")
    return values


def smooth_noise(chance, n, seconds):
    """Return n samples of smooth noise with rms 1 that changes within about `seconds`."""
    knots = chance.standard_normal(int(n / FINE_HZ / seconds) + 3)
    values = smoothed(np.interp(np.arange(n) / FINE_HZ / seconds, np.arange(len(knots)), knots), 0.5 * seconds)
    return values / np.std(values)
