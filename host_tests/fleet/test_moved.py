"""Small rotations of a mount are found. The swaying of the car's body also shows small rotations. The tests use
simulated and recorded drives."""

import copy

import numpy as np
import pytest
from kickstand_fleet import evidence
from kickstand_fleet.moved import compare, find_moves
from kickstand_tools.calibration.drive import fit_logs, usable
from kickstand_tools.logs.reader import read_log
from made_fleet import drive, turn_of

UP = (0.0, 1.0, 0.0)


def driven(log, lag_s=0.3, bias_dps=(0.0, 0.0, 0.0)):
    return evidence.intervals(log, "car", lag_s, np.array(bias_dps))


def swaying(log, sensor, size_g=0.03, other_deg=0.0, seed=1):
    """Return the log of a car whose body sways sideways 5 times per second.

    size_g: usual size of the swaying force.
    other_deg: angle by which the direction of the swaying changes in the middle of the log.
    """
    chance = np.random.default_rng(seed)
    size = size_g * np.interp(log.t_s, np.arange(0.0, log.t_s[-1] + 1.0), chance.normal(size=int(log.t_s[-1]) + 2))
    sway = np.outer(size * np.sin(2.0 * np.pi * 5.0 * log.t_s), (1.0, 0.0, 0.0))
    later = log.t_s > log.t_s[-1] / 2.0
    sway[later] = sway[later] @ turn_of(other_deg, UP).T
    found = copy.copy(log)
    found.accel_g = log.accel_g + sway @ sensor.mount
    return found


def halves(log):
    """Return the rotation of the mount between the two halves of a log, and its standard deviation."""
    whole = evidence.blocks([driven(log)])
    middle = len(whole.log) // 2
    found = compare(whole.part(slice(0, middle)), whole.part(slice(middle, None)))
    assert found
    return found


@pytest.fixture(scope="module")
def bus():
    return drive(7, "bus", 200.0)


def test_the_sway_shows_yaw_where_there_is_little_braking(bus):
    log, sensor = bus
    _, without = halves(log)
    turn, sigma = halves(swaying(log, sensor))
    assert sigma[1] < 0.95 * without[1] and abs(turn[1]) < 1.0
    assert (sigma[0], sigma[2]) == pytest.approx((without[0], without[2]), rel=0.1)


def test_sway_that_contradicts_the_braking_is_ignored(bus):
    log, sensor = bus
    turn, sigma = halves(swaying(log, sensor, other_deg=25.0))
    assert abs(turn[1]) < 1.5 and sigma[1] == pytest.approx(halves(log)[1][1], rel=0.1)


def test_a_sensor_ahead_of_the_rear_axle_is_swung_and_not_turned(bus):
    log, sensor = bus
    yaw = np.radians(log.gyro_dps) @ sensor.mount[1]
    swung = copy.copy(log)
    arm_g = 4.0 / 9.81 * np.gradient(np.convolve(yaw, np.ones(15) / 15.0, "same"), log.t_s)
    swung.accel_g = log.accel_g + np.outer(arm_g, sensor.mount[0])
    whole = evidence.blocks([driven(swung)])
    found, _ = evidence.fits(np.sum(whole.square, axis=0), np.sum(whole.product, axis=0))
    assert found[3] @ sensor.mount[0] == pytest.approx(4.0 / 9.81, abs=0.06)
    assert halves(swung)[0] == pytest.approx(halves(log)[0], abs=0.5)


def test_move_between_logs_is_not_found_during_them():
    first, sensor = drive(31)
    sensor.mount = turn_of(25.0, (1.0, 0.3, 0.2)) @ sensor.mount
    second, _ = drive(32, sensor=sensor)
    (move,) = find_moves([driven(first), driven(second)])
    assert (move.log, move.at_s) == (1, None) and move.angle_deg == pytest.approx(25.0, abs=2.0)


def test_one_road_counts_once_for_all_its_intervals():
    """The slope of the road gives all intervals of one standstill the same error. All intervals of a standstill
    together therefore count about as much as one interval. Intervals on different roads count separately."""
    count = 50
    standing = evidence.Intervals(
        np.arange(count, dtype=float),
        np.tile([0.0, 1.0, 0.1], (count, 1)),
        np.tile([1.0, 0.0, 0.0, 0.0], (count, 1)),
        np.ones(count),
        np.zeros(count),
        np.zeros((count, 3, 3)),
    )
    weight = float(np.sum(evidence.blocks([standing]).square[:, 0, 0]))
    assert weight == pytest.approx(1.0 / (evidence.ROAD_SHARE + 1.0 / count), rel=1e-6)
    standing.speed += 1000.0  # another place each second, so each interval counts as on another road
    weight = float(np.sum(evidence.blocks([standing]).square[:, 0, 0]))
    assert weight == pytest.approx(count / (evidence.ROAD_SHARE + 1.0), rel=0.01)


def pitched(log, sensor, degrees):
    """Return the log of a sensor that is rotated about left. degrees: the angle at each sample, shape (n)."""
    vehicle = log.accel_g @ sensor.mount.T
    angle = np.radians(degrees)
    cosine, sine = np.cos(angle), np.sin(angle)
    found = copy.copy(log)
    up, forward = vehicle[:, 1], vehicle[:, 2]
    turned = np.column_stack((vehicle[:, 0], cosine * up + sine * forward, cosine * forward - sine * up))
    found.accel_g = turned @ sensor.mount
    return found


def test_turn_is_sudden_and_a_hill_is_not():
    log, sensor = drive(33, "car", 240.0)
    middle = log.t_s[-1] / 2.0
    (move,) = find_moves([driven(pitched(log, sensor, np.where(log.t_s > middle, 6.5, 0.0)))])
    assert move.at_s == pytest.approx(middle, abs=8.0) and abs(move.turn_deg[0]) == pytest.approx(6.5, abs=1.5)
    hill = np.clip((log.t_s - middle) / 50.0 + 0.5, 0.0, 1.0) * 6.5
    assert find_moves([driven(pitched(log, sensor, hill))]) == []


def test_turns_of_five_degrees_in_a_recorded_drive(shared_data):
    log = usable(read_log(shared_data / "car-urban-medium-turn-loop-nominal-001.csv.gz", axes=False), False)
    fit = fit_logs([log], None, "car")
    frame, lag_s = fit.calibration.vehicle_from_sensor, fit.lag_s or 0.0
    assert find_moves([driven(log, lag_s, fit.bias_dps)]) == []
    found, chance = [], np.random.default_rng(8)
    for k in range(8):
        axis = UP if k % 2 else (np.cos(k), 0.0, np.sin(k))
        turn = frame.T @ turn_of(5.0, axis).T @ frame  # the rotation of the sensor, in the sensor's own axes
        at_s = log.t_s[-1] * chance.uniform(0.4, 0.6)
        later = (log.t_s >= at_s)[:, None]
        turned = copy.copy(log)
        turned.accel_g = np.where(later, log.accel_g @ turn.T, log.accel_g)
        turned.gyro_dps = np.where(later, (log.gyro_dps - fit.bias_dps) @ turn.T + fit.bias_dps, log.gyro_dps)
        found.append(bool(find_moves([driven(turned, lag_s, fit.bias_dps)])))
    assert sum(found) >= 7
