"""Builds a ride from a rider's actions, such as set off, ride straight ahead, turn, and stop."""

from dataclasses import dataclass, field
from itertools import pairwise
from math import atan, degrees, radians, tan

import numpy as np
from kickstand.units import STANDARD_GRAVITY

from .commands import Leg
from .physics.road import CLASS_B

_SHORTEST_S = 3.0  # fit() does not make a leg shorter than this
_CLOSING_S = 45.0  # time for the straight and the stop at the end of every ride


@dataclass
class Conditions:
    """Road, engine, weather and sensor of a ride. The defaults describe an ordinary day."""

    roughness: float = CLASS_B  # roughness of the road in m3, see road.CLASS_A
    engine_rms_g: float = 0.1  # engine vibration at 6000/min, rms
    shift_rpm: float = 5000.0  # engine speed at which the rider changes up
    unrest_deg: float = 0.4  # random changes of the lean at speed, rms
    gust_mps2: float = 0.0  # changes of the crosswind, rms
    sway_m: float = 0.0  # movement of the centre of mass from side to side, rms
    slip_deg: float = 0.0  # angle between the bike's heading and its motion, rms
    start_c: float = 22.0  # temperature of the chip at power-on
    rise_c: float = 7.0  # rise of the temperature while the chip warms up, most of it within 10 to 15 minutes
    drift: float = 1.0  # factor on the temperature drift of an ordinary sensor's biases
    creep_deg: float = 0.0  # angle by which the sensor's mount has rotated at the end of the ride
    # Tuples (phase, spacing in m, height in m, length in m). During this phase of the ride, the road has bumps of this
    # size.
    bumps: list[tuple[str, float, float, float]] = field(default_factory=list)


class Plan:
    """Collects the legs of a ride. chance: source of the random numbers that make rides different."""

    def __init__(self, chance: np.random.Generator, seconds: float) -> None:
        self.chance = chance
        self.legs: list[Leg] = []
        self.speed = 0.0
        self.seconds = 0.0
        self._until = max(seconds - _CLOSING_S, 20.0)
        self.slope_percent = 3.0  # largest slope of random_slope()
        self.roll_dps = 60.0  # mean roll rate of the fastest change of lean; the peak is nearly twice the mean

    @property
    def going_on(self) -> bool:
        return self.seconds < self._until

    def fit(self, seconds: float) -> None:
        """Adjust the duration of the ride by its longest legs at constant speed, if they are long enough."""
        steady = [leg for previous, leg in pairwise(self.legs) if leg.speed_mps in (None, previous.speed_mps)]
        while steady and (over := sum(leg.seconds for leg in self.legs) - seconds):
            longest = max(steady, key=lambda leg: leg.seconds)
            cut = min(over, longest.seconds - _SHORTEST_S)
            longest.seconds -= cut
            if abs(over - cut) < 1e-6 or longest.seconds <= _SHORTEST_S:
                break

    def uniform(self, low: float, high: float) -> float:
        return float(self.chance.uniform(low, high))

    def side(self) -> float:
        return float(self.chance.choice((-1.0, 1.0)))

    def likely(self, share: float) -> bool:
        return bool(self.chance.random() < share)

    def random_slope(self) -> float:
        return self.uniform(-self.slope_percent, self.slope_percent)

    def add(self, phase: str, seconds: float, speed_mps: float | None = None, **more: float | None) -> None:
        """Add a leg with `more` fields. Without slope_percent, the slope at its end is random."""
        if "slope_percent" not in more:
            more["slope_percent"] = self.random_slope()
        self.legs.append(Leg(phase, seconds, speed_mps, **more))  # type: ignore[arg-type]
        self.seconds += seconds
        self.speed = self.speed if speed_mps is None else speed_mps

    def _lean_now(self) -> float:
        return next((leg.lean_deg for leg in reversed(self.legs) if leg.lean_deg is not None), 0.0)

    def begin(self) -> None:
        """Stand on the kickstand, lift the bike upright, then start the engine."""
        self.legs.append(Leg("kickstand", self.uniform(4.0, 12.0), 0.0, self.uniform(-13.0, -8.0), engine=0.0))
        self.legs.append(Leg("lifting", 2.0, 0.0, 0.0, roll_s=2.0))
        self.legs.append(Leg("standing", self.uniform(3.0, 8.0), 0.0))
        self.legs.append(Leg("standing", self.uniform(3.0, 8.0), 0.0, engine=1.0))
        self.seconds = sum(leg.seconds for leg in self.legs)

    def to_speed(self, speed_mps: float, mps2: float) -> None:
        """Speed up or brake to this speed, upright. mps2: size of the acceleration."""
        name = "braking" if speed_mps < self.speed else "speeding up"
        self.add(name, max(1.0, abs(speed_mps - self.speed) / mps2), speed_mps, lean_deg=0.0, roll_s=1.0)

    def straight(self, seconds: float, speed_mps: float | None = None) -> None:
        self.add("straight", seconds, speed_mps, lean_deg=0.0, roll_s=1.2)

    def turn(
        self,
        lean_deg: float,
        speed_mps: float,
        heading_deg: float | None = None,
        seconds: float | None = None,
        roll_s: float = 1.5,
        phase: str = "turn",
        **more: float | None,
    ) -> None:
        """Roll to lean_deg within roll_s, and hold this lean for `seconds` or a change of heading_deg.

        The roll takes longer if its rate would exceed roll_dps.
        """
        roll_s = max(roll_s, abs(lean_deg - self._lean_now()) / self.roll_dps)
        if seconds is None:
            rate = degrees(STANDARD_GRAVITY * tan(radians(abs(lean_deg))) / max(speed_mps, 1.0))
            seconds = min(max((heading_deg or 45.0) / rate - roll_s / 2.0, 0.5), 12.0)
        self.add(phase, roll_s + seconds, speed_mps, lean_deg=lean_deg, roll_s=roll_s, **more)

    def out_of_turn(self, speed_mps: float, mps2: float, roll_s: float = 1.4) -> None:
        """Speed up or brake to this speed while the bike comes upright. mps2: size of the acceleration."""
        roll_s = max(roll_s, abs(self._lean_now()) / self.roll_dps)
        seconds = max(roll_s, abs(speed_mps - self.speed) / mps2)
        self.add("out of turn", seconds, speed_mps, lean_deg=0.0, roll_s=roll_s)

    def into_turn(self, lean_deg: float, speed_mps: float, mps2: float) -> None:
        """Brake to this speed, and lean in during the last third. mps2: size of the deceleration."""
        seconds = max(1.2, abs(speed_mps - self.speed) / mps2)
        between = speed_mps + 0.35 * (self.speed - speed_mps)
        self.add("braking", 0.65 * seconds, between, lean_deg=0.0, roll_s=0.8)
        rolled = max(0.35 * seconds, 0.9)
        self.add("trail braking", rolled, speed_mps, lean_deg=0.5 * lean_deg, roll_s=rolled)

    def stop(self, seconds: float, mps2: float) -> None:
        """Brake to a stop, then stand on one foot, usually the left one. seconds: time on this foot."""
        self.to_speed(0.0, mps2)
        foot = self.uniform(-4.0, -0.5) if self.likely(0.8) else self.uniform(0.5, 3.0)
        self.add("stopped", seconds, 0.0, lean_deg=foot, roll_s=min(1.5, seconds / 2))
        self.add("stopped", 1.5, 0.0, lean_deg=0.0, roll_s=1.2)

    def walk(self, seconds: float, speed_mps: float) -> None:
        self.add("walking pace", seconds, speed_mps, lean_deg=0.0, roll_s=1.0)

    def finish(self, speed_mps: float, mps2: float) -> None:
        """Ride straight ahead at this speed to the end of the ride, and stop."""
        self.to_speed(speed_mps, mps2)
        self.straight(_CLOSING_S - 15.0)
        self.to_speed(0.0, mps2)
        self.add("standing", 4.0, 0.0)


def lean_for(speed_mps: float, radius_m: float) -> float:
    """Return the lean in degrees that balances a turn of this radius at this speed."""
    return degrees(atan(speed_mps * speed_mps / (STANDARD_GRAVITY * radius_m)))
