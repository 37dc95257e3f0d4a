"""Simulates drives of a car, a bus or a motorcycle: a random route of a few minutes, and a sensor's readings on it."""

from dataclasses import dataclass

import numpy as np
from kickstand.units import STANDARD_GRAVITY
from kickstand_sim.simulation.ride import random_rotation
from kickstand_tools.logs.log import Log
from kickstand_tools.signals import Array, moving_mean, rotation_vector

_SMOOTH_S = 0.6  # approximate time in which a driver moves the pedal or the steering wheel
# Slope and camber get a new random value every _SLOPE_M metres, with these standard deviations in degrees
_SLOPE_M, _SLOPE_DEG, _CAMBER_DEG = 120.0, 1.2, 0.7
_FASTEST_LATERAL_MPS2 = 3.0


@dataclass
class Handling:
    """The way a kind of vehicle is driven. Each field is a range (smallest, largest)."""

    cruise_mps: tuple[float, float]  # cruising speed
    speed_up_mps2: tuple[float, float]  # acceleration when speeding up
    brake_mps2: tuple[float, float]  # deceleration when braking
    lateral_mps2: tuple[float, float]  # lateral acceleration in bends


HANDLING = {
    "car": Handling((8.0, 19.0), (1.0, 2.4), (1.3, 3.4), (1.0, 3.0)),
    "bus": Handling((7.0, 14.0), (0.7, 1.3), (1.0, 2.0), (0.7, 1.6)),
    "motorcycle": Handling((9.0, 22.0), (1.5, 3.2), (1.6, 4.5), (1.5, 4.0)),
}
# Roll of the body outwards in degrees per g of lateral acceleration, and dive in degrees per g of braking
_ROLL_DEG, _DIVE_DEG = {"car": 4.0, "bus": 5.5, "motorcycle": 0.0}, {"car": 2.5, "bus": 2.0, "motorcycle": 4.0}
_COUNT_G, _COUNT_DPS = 1.0 / 16384.0, 1.0 / 131.0


@dataclass
class Route:
    """A route of n samples. Each field has shape (n)."""

    time: Array  # time in s
    speed: Array  # speed in m/s
    acceleration: Array  # acceleration forward, in m/s2
    yaw_rate: Array  # yaw rate in rad/s, positive to the left
    slope: Array  # slope of the road, in rad, positive uphill
    camber: Array  # sideways slope of the road, in rad, positive if the road falls to the right


def random_route(
    chance: np.random.Generator, handling: Handling, seconds: float, rate_hz: float, straight: bool = True
) -> Route:
    """Simulate a route with stops, bends and braking in straight lines.

    straight: False for a drive in circles only, as in a car park. A drive in circles never brakes in a straight line.
    """
    legs = _Legs(chance, handling)
    legs.stand(chance.uniform(7.0, 14.0))
    while legs.seconds < seconds - 12.0:
        if straight:
            legs.in_traffic()
        else:
            legs.in_circles()
    legs.stop()
    knot_s, knot_mps, knot_lateral = np.array(legs.knots).T
    time = np.arange(round(knot_s[-1] * rate_hz)) / rate_hz
    width = max(2, round(_SMOOTH_S * rate_hz))
    speed = moving_mean(np.interp(time, knot_s, knot_mps), width)
    leg = np.searchsorted(knot_s, time, side="right").clip(1, len(knot_s) - 1)
    lateral = moving_mean(knot_lateral[leg], 2 * width)  # the last knot of a leg has the leg's lateral acceleration
    yaw_rate = np.where(speed > 0.3, lateral / np.maximum(speed, 1.5), 0.0)
    distance = np.cumsum(speed) / rate_hz
    return Route(
        time=time,
        speed=speed,
        acceleration=np.gradient(speed, 1.0 / rate_hz),
        yaw_rate=moving_mean(yaw_rate, width),
        slope=np.radians(_along(chance, distance, 0.0, _SLOPE_DEG, width)),
        camber=np.radians(_along(chance, distance, chance.uniform(0.0, 1.5), _CAMBER_DEG, width)),
    )


class _Legs:
    def __init__(self, chance: np.random.Generator, handling: Handling) -> None:
        self.chance, self._handling = chance, handling
        self.seconds = self.speed = 0.0
        self.knots = [(0.0, 0.0, 0.0)]  # time and speed at the end of each leg, and its lateral acceleration

    def leg(self, seconds: float, speed: float | None = None, lateral_mps2: float = 0.0) -> None:
        self.seconds += seconds
        self.speed = self.speed if speed is None else speed
        self.knots.append((self.seconds, self.speed, lateral_mps2))

    def stand(self, seconds: float) -> None:
        self.leg(seconds)

    def to(self, speed: float) -> None:
        limits = self._handling.speed_up_mps2 if speed > self.speed else self._handling.brake_mps2
        self.leg(abs(speed - self.speed) / self.chance.uniform(*limits), speed)

    def stop(self) -> None:
        self.to(0.0)
        self.stand(self.chance.uniform(4.5, 11.0))

    def cruise(self) -> None:
        self.to(self.chance.uniform(*self._handling.cruise_mps))

    def turn(self, heading_deg: float) -> None:
        lateral = self.chance.uniform(*self._handling.lateral_mps2)
        seconds = np.radians(heading_deg) * self.speed / lateral
        self.leg(seconds, None, lateral if self.chance.random() < 0.5 else -lateral)

    def in_traffic(self) -> None:
        """Add a stop, a junction or a bend, by chance."""
        draw = self.chance.random()
        if self.speed < 1.0:
            self.cruise()
        elif draw < 0.5:
            self.leg(self.chance.uniform(1.5, 6.0))
            self.stop()
        elif draw < 0.75:  # a junction
            self.to(self.chance.uniform(4.0, 7.0))
            self.leg(1.0)
            self.turn(self.chance.uniform(60.0, 100.0))
            self.leg(1.0)
            self.cruise()
        else:  # a bend of the road
            self.turn(self.chance.uniform(10.0, 40.0))
            self.leg(self.chance.uniform(1.0, 5.0))

    def in_circles(self) -> None:
        entry_mps = self.speed
        exit_mps = self.chance.uniform(2.0, 6.0) if entry_mps > 4.0 else self.chance.uniform(5.0, 8.0)
        side = 1.0 if self.chance.random() < 0.5 else -1.0
        for speed in (exit_mps, exit_mps):
            self.leg(self.chance.uniform(2.5, 6.0), speed, side * min(_FASTEST_LATERAL_MPS2, 0.35 * max(speed, 3.0)))


def _along(chance: np.random.Generator, distance: Array, mean: float, sigma: float, width: int) -> Array:
    knots = np.arange(0.0, distance[-1] + 2.0 * _SLOPE_M, _SLOPE_M)
    return moving_mean(np.interp(distance, knots, chance.normal(mean, sigma, len(knots))), width)


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
    """Compute a perfect sensor's forces in m/s2 and rates in rad/s along left, up and forward, shape (n, 3) each.

    Two simplifications make this function hundreds of times faster than kickstand_sim.simulation.physics. Pitch and
    slope are treated as small angles, because both are under 5 degrees. The sensor is on the axis about which the body
    rolls.
    """
    step_s = route.time[1]
    lateral = route.speed * route.yaw_rate
    if kind == "motorcycle":
        lean = -np.arctan(lateral / STANDARD_GRAVITY)  # in balance
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
    """Compute the rates of a mount that rotates by `turn` around the time at_s, shape (n, 3), in rad/s."""
    turning = (time >= at_s - seconds / 2) & (time < at_s + seconds / 2)
    return np.outer(turning, rotation_vector(turn) / seconds)
