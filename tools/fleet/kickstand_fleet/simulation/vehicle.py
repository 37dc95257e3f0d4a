"""Simulates the readings of a sensor in a car, in a bus or on a motorcycle during a route."""

from dataclasses import dataclass

import numpy as np
from kickstand.units import STANDARD_GRAVITY
from kickstand_sim.simulation.ride import random_rotation
from kickstand_tools.logs.log import Log
from kickstand_tools.signals import Array, rotation_vector

from .route import Handling, Route, balance_lean

HANDLING = {
    "car": Handling((8.0, 19.0), (1.0, 2.4), (1.3, 3.4), (1.0, 3.0)),
    "bus": Handling((7.0, 14.0), (0.7, 1.3), (1.0, 2.0), (0.7, 1.6)),
    "motorcycle": Handling((9.0, 22.0), (1.5, 3.2), (1.6, 4.5), (1.5, 4.0)),
}
# Roll of the body outwards in degrees per g of lateral acceleration, and dive in degrees per g of braking
_ROLL_DEG, _DIVE_DEG = {"car": 4.0, "bus": 5.5, "motorcycle": 0.0}, {"car": 2.5, "bus": 2.0, "motorcycle": 4.0}
_COUNT_G, _COUNT_DPS = 1.0 / 16384.0, 1.0 / 131.0


@dataclass
class VehicleSensor:
    mount: Array  # rotation from sensor to vehicle axes, shape (3, 3). Its rows are left, up, forward.
    offset_g: Array  # offset of the accelerometer, shape (3), in g
    slope: Array  # slope of the accelerometer, shape (3)
    bias_dps: Array  # bias of the gyro, shape (3), in deg/s


@dataclass
class Receiver:
    every_s: float = 1.0  # time between two values
    late_s: float = 0.3  # delay of each value
    factor: float = 1.0  # factor on each value. The factor is 3.6 for a receiver that wrongly sends km/h.
    until_s: float = float("inf")  # time of the last value


def random_sensor(chance: np.random.Generator) -> VehicleSensor:
    """Return a sensor in a random mounting, with the random errors of an ordinary, uncalibrated MPU6050."""
    errors = (chance.normal(mean, sigma, 3) for mean, sigma in ((0.0, 0.01), (1.0, 0.01), (0.0, 1.0)))
    return VehicleSensor(random_rotation(chance), *errors)


def drive_log(
    chance: np.random.Generator,
    kind: str,
    route: Route,
    sensor: VehicleSensor,
    receiver: Receiver,
    start_utc_s: float,
    moved: tuple[float, Array] | None = None,
    name: str = "the log",
) -> Log:
    """Simulate the log of a drive.

    moved: Time in s at which the mount moves, and its new rotation, shape (3, 3). The mount takes 0.3 s to rotate. None
    if the mount does not move.
    """
    force, rate = _readings(chance, kind, route)
    mount = np.broadcast_to(sensor.mount, (len(force), 3, 3))
    if moved is not None:
        at_s, moved_mount = moved
        mount = np.where((route.time >= at_s)[:, None, None], moved_mount, mount)
        rate = rate + _mount_rates(route.time, at_s, moved_mount @ sensor.mount.T)
    force = np.einsum("nij,ni->nj", mount, force)
    rate = np.einsum("nij,ni->nj", mount, rate)
    force = np.round((force / STANDARD_GRAVITY - sensor.offset_g) / sensor.slope / _COUNT_G) * _COUNT_G
    rate = np.round((np.degrees(rate) + sensor.bias_dps) / _COUNT_DPS) * _COUNT_DPS
    speed, utc_s = (np.full(len(force), np.nan) for _ in range(2))
    step_s = route.time[1]
    fixes = np.arange(0, len(force), max(1, round(receiver.every_s / step_s)))
    fixes = fixes[route.time[fixes] <= receiver.until_s]
    measured = np.interp(route.time[fixes] - receiver.late_s, route.time, route.speed)
    measured = np.where(measured > 0.2, np.maximum(0.0, measured + chance.normal(0.0, 0.05, len(measured))), 0.0)
    speed[fixes] = np.round(measured * receiver.factor, 2)
    utc_s[fixes] = np.round(start_utc_s + route.time[fixes], 1)
    return Log(route.time, force, rate, speed, utc_s=utc_s, name=name)


def _readings(chance: np.random.Generator, kind: str, route: Route) -> tuple[Array, Array]:
    """Compute the readings of a sensor without errors, along the vehicle's left, up and forward.

    Returns:
        force: specific force, shape (n, 3), in m/s2.
        rate: angular rate, shape (n, 3), in rad/s.

    Two simplifications make this function hundreds of times faster than the package simulation/physics. Pitch and slope
    are treated as small angles, because both are under 5 degrees. The sensor is on the axis about which the body rolls.
    """
    step_s = route.time[1]
    lateral = route.speed * route.yaw_rate
    if kind == "motorcycle":
        lean = balance_lean(route)
    else:
        lean = route.camber + np.radians(_ROLL_DEG[kind]) * lateral / STANDARD_GRAVITY
    pitch = route.slope + np.radians(_DIVE_DEG[kind]) * route.acceleration / STANDARD_GRAVITY
    c, s = np.cos(lean), np.sin(lean)
    up = STANDARD_GRAVITY * np.cos(pitch)
    force = np.column_stack(
        (lateral * c + up * s, up * c - lateral * s, route.acceleration + STANDARD_GRAVITY * np.sin(pitch))
    )
    w_left, w_up = -np.gradient(pitch, step_s), route.yaw_rate
    rate = np.column_stack((w_left * c + w_up * s, w_up * c - w_left * s, np.gradient(lean, step_s)))
    moving = np.minimum(1.0, route.speed / 10.0)[:, None]
    force += chance.normal(0.0, 1.0, force.shape) * (0.06 + np.array([0.25, 0.5, 0.25]) * moving)
    rate += np.radians(chance.normal(0.0, 1.0, rate.shape) * (0.1 + np.array([1.2, 0.5, 0.8]) * moving))
    return force, rate


def _mount_rates(time: Array, at_s: float, turn: Array, seconds: float = 0.3) -> Array:
    """Compute the rates about the vehicle's axes while the mount rotates by `turn` around the time at_s, shape (n, 3),
    in rad/s.
    """
    turning = (time >= at_s - seconds / 2) & (time < at_s + seconds / 2)
    return np.outer(turning, rotation_vector(turn) / seconds)
