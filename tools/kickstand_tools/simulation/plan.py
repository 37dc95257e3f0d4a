"""A ride put together from what riders do: set off, cruise, corner, stop."""

from dataclasses import dataclass, field
from math import atan, degrees, radians, tan

import numpy as np
from kickstand.units import STANDARD_GRAVITY

from .commands import Leg
from .physics.road import CLASS_B

_CLOSING_S = 45.0  # a straight and a stop at the end of every ride


@dataclass
class Conditions:
    """Road, engine, weather and set-up of a ride; figures of an ordinary day.

    bumps: (phase, spacing m, height m, length m), humps wherever the ride is in that phase.
    """

    roughness: float = CLASS_B  # ISO 8608, m3
    engine_rms_g: float = 0.1  # at 6000/min
    shift_rpm: float = 5000.0
    unrest_deg: float = 0.4  # rms of the rider's balance at speed
    gust_mps2: float = 0.0  # rms of the wind's push
    sway_m: float = 0.0  # rms of the rider's weight from side to side
    start_c: float = 22.0  # of the chip at power-on
    rise_c: float = 7.0  # warming of the box, most of it within 10 to 15 minutes
    drift: float = 1.0  # change of the biases with temperature, of a usual part's
    creep_deg: float = 0.0  # how far the mount has turned by the end
    bumps: list[tuple[str, float, float, float]] = field(default_factory=list)


class Plan:
    """Legs being put together. The sampled figures come from `chance`, so that no two rides are alike."""

    def __init__(self, chance: np.random.Generator, seconds: float) -> None:
        self.chance = chance
        self.legs: list[Leg] = []
        self.speed = 0.0
        self._seconds = 0.0
        self._until = max(seconds - _CLOSING_S, 20.0)
        self.slope_percent = 3.0  # most that `any_slope` gives
        self.roll_dps = (
            60.0  # mean rate of the quickest change from side to side; the peak is nearly twice that
        )

    @property
    def going_on(self) -> bool:
        return self._seconds < self._until

    @property
    def seconds(self) -> float:
        """So far."""
        return self._seconds

    def uniform(self, low: float, high: float) -> float:
        return float(self.chance.uniform(low, high))

    def side(self) -> float:
        return float(self.chance.choice((-1.0, 1.0)))

    def likely(self, share: float) -> bool:
        return bool(self.chance.random() < share)

    def any_slope(self) -> float:
        return self.uniform(-self.slope_percent, self.slope_percent)

    def add(self, phase: str, seconds: float, speed_mps: float | None = None, **more: float | None) -> None:
        """A leg; its road ends in any slope unless slope_percent is given."""
        if "slope_percent" not in more:
            more["slope_percent"] = self.any_slope()
        self.legs.append(Leg(phase, seconds, speed_mps, **more))  # type: ignore[arg-type]
        self._seconds += seconds
        self.speed = self.speed if speed_mps is None else speed_mps

    def _lean_now(self) -> float:
        return next((leg.lean_deg for leg in reversed(self.legs) if leg.lean_deg is not None), 0.0)

    def begin(self) -> None:
        """On the kickstand, lifted, upright, engine on."""
        self.legs.append(
            Leg("kickstand", self.uniform(4.0, 12.0), 0.0, self.uniform(-13.0, -8.0), engine=0.0)
        )
        self.legs.append(Leg("lifting", 2.0, 0.0, 0.0, roll_s=2.0))
        self.legs.append(Leg("standing", self.uniform(3.0, 8.0), 0.0))
        self.legs.append(Leg("standing", self.uniform(3.0, 8.0), 0.0, engine=1.0))
        self._seconds = sum(leg.seconds for leg in self.legs)

    def to_speed(self, speed_mps: float, mps2: float, phase: str = "") -> None:
        """Speed up or brake, upright."""
        name = phase or ("braking" if speed_mps < self.speed else "speeding up")
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
        """Roll to lean_deg within roll_s, or as fast as can be; hold it for seconds or about heading_deg."""
        roll_s = max(roll_s, abs(lean_deg - self._lean_now()) / self.roll_dps)
        if seconds is None:
            rate = degrees(STANDARD_GRAVITY * tan(radians(abs(lean_deg))) / max(speed_mps, 1.0))
            seconds = min(max((heading_deg or 45.0) / rate - roll_s / 2.0, 0.5), 12.0)
        self.add(phase, roll_s + seconds, speed_mps, lean_deg=lean_deg, roll_s=roll_s, **more)

    def out_of_turn(self, speed_mps: float, mps2: float, roll_s: float = 1.4) -> None:
        """Upright again, on the throttle."""
        roll_s = max(roll_s, abs(self._lean_now()) / self.roll_dps)
        seconds = max(roll_s, abs(speed_mps - self.speed) / mps2)
        self.add("out of turn", seconds, speed_mps, lean_deg=0.0, roll_s=roll_s)

    def into_turn(self, lean_deg: float, speed_mps: float, mps2: float) -> None:
        """Brake, the last third of it leaning in already."""
        seconds = max(1.2, abs(speed_mps - self.speed) / mps2)
        between = speed_mps + 0.35 * (self.speed - speed_mps)
        self.add("braking", 0.65 * seconds, between, lean_deg=0.0, roll_s=0.8)
        rolled = max(0.35 * seconds, 0.9)
        self.add("trail braking", rolled, speed_mps, lean_deg=0.5 * lean_deg, roll_s=rolled)

    def stop(self, seconds: float, mps2: float) -> None:
        """Brake to a stop and stand on one foot, mostly the left."""
        self.to_speed(0.0, mps2)
        foot = self.uniform(-4.0, -0.5) if self.likely(0.8) else self.uniform(0.5, 3.0)
        self.add("stopped", seconds, 0.0, lean_deg=foot, roll_s=min(1.5, seconds / 2))
        self.add("stopped", 1.5, 0.0, lean_deg=0.0, roll_s=1.2)

    def walk(self, seconds: float, speed_mps: float) -> None:
        """Creep along at walking pace."""
        self.add("walking pace", seconds, speed_mps, lean_deg=0.0, roll_s=1.0)

    def finish(self, speed_mps: float, mps2: float) -> None:
        """A straight to the end of the ride, then a stop."""
        self.to_speed(speed_mps, mps2)
        self.straight(_CLOSING_S - 15.0)
        self.to_speed(0.0, mps2)
        self.add("standing", 4.0, 0.0)


def lean_for(speed_mps: float, radius_m: float) -> float:
    """Lean in degrees that balances a turn of this radius."""
    return degrees(atan(speed_mps * speed_mps / (STANDARD_GRAVITY * radius_m)))
