"""Simulates a random route of a few minutes: speed and yaw rate of the vehicle, slope and camber of the road."""

from dataclasses import dataclass

import numpy as np
from kickstand.units import STANDARD_GRAVITY
from kickstand_tools.signals import Array, moving_mean

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
    knots = np.array(legs.knots)
    time = np.arange(round(knots[-1, 0] * rate_hz)) / rate_hz
    width = max(2, round(_SMOOTH_S * rate_hz))
    speed = moving_mean(np.interp(time, knots[:, 0], knots[:, 1]), width)
    leg = np.searchsorted(knots[:, 0], time, side="right").clip(1, len(knots) - 1)
    lateral = moving_mean(knots[leg, 2], 2 * width)  # the last knot of a leg has the leg's lateral acceleration
    yaw_rate = np.where(speed > 0.3, lateral / np.maximum(speed, 1.5), 0.0)
    distance = np.cumsum(speed) / rate_hz
    return Route(
        time,
        speed,
        np.gradient(speed, 1.0 / rate_hz),
        moving_mean(yaw_rate, width),
        np.radians(_along(chance, distance, 0.0, _SLOPE_DEG, width)),
        np.radians(_along(chance, distance, chance.uniform(0.0, 1.5), _CAMBER_DEG, width)),
    )


class _Legs:
    """Collects the legs of a route. knots: time and speed at the end of each leg, and its lateral acceleration."""

    def __init__(self, chance: np.random.Generator, handling: Handling) -> None:
        self.chance, self._handling = chance, handling
        self.seconds = self.speed = 0.0
        self.knots = [(0.0, 0.0, 0.0)]

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


def balance_lean(route: Route) -> Array:
    """Compute the lean of a motorcycle in balance on this route, shape (n), in rad, positive to the right."""
    return -np.arctan(route.speed * route.yaw_rate / STANDARD_GRAVITY)
