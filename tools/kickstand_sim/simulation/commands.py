"""Converts the legs of a ride to signals over time. A leg is a part of the ride with one action of the rider."""

from dataclasses import dataclass

import numpy as np

from .physics.signals import Signal, integral, smoothed, smoothstep

_SPEED_SMOOTHING_S = 0.15  # time that a hand needs to change throttle or brake


@dataclass
class Leg:
    """A part of a ride. None keeps the value of the previous leg."""

    phase: str  # name of the rider's action
    seconds: float  # duration of the leg
    speed_mps: float | None = None  # speed at the end of the leg. The acceleration is constant.
    # Lean of the centre of mass, positive to the right. This lean is reached within roll_s of the start, then held.
    lean_deg: float | None = None
    roll_s: float = 1.5  # time for the change of lean
    slope_percent: float | None = None  # slope of the road at the end of the leg
    hang_m: float | None = None  # offset of the centre of mass to the right of the bike's plane
    lift_deg: float | None = None  # pitch caused by a wheelie
    engine: float | None = None  # 0 off, 1 running
    crosswind_mps2: float | None = None  # acceleration to the right caused by wind
    bank_deg: float | None = None  # tilt of the road to the right


@dataclass
class RiderCommands:
    """The commands of a ride as signals of n samples. The units are s, m, m/s, m/s2 and rad. See Leg for the fields."""

    rate_hz: float
    time: Signal
    speed: Signal
    distance: Signal
    lean: Signal
    slope: Signal
    hang: Signal
    lift: Signal
    engine: Signal
    crosswind: Signal
    bank: Signal
    phase: np.ndarray  # index of each sample's phase in the list `phases`
    phases: list[str]


def commands(legs: list[Leg], rate_hz: float) -> RiderCommands:
    """Compute the signals of successive legs from t = 0. The ride starts with the values of the first leg."""
    ends = np.cumsum([leg.seconds for leg in legs])
    starts = ends - [leg.seconds for leg in legs]
    time = np.arange(int(ends[-1] * rate_hz)) / rate_hz
    speeds = _fill_in(legs, "speed_mps")
    speed = np.interp(time, np.concatenate(([0.0], ends)), [speeds[0], *speeds])
    speed = np.maximum(smoothed(speed, _SPEED_SMOOTHING_S, rate_hz), 0.0)
    speed[speed < 1e-4] = 0.0
    distance = integral(speed, rate_hz)

    def stepped(name: str, settle_s: float | None = 1.0) -> Signal:
        """Return a value that changes within settle_s of the start of each leg. None uses the leg's roll_s."""
        values = _fill_in(legs, name)
        result = np.full_like(time, values[0])
        for leg, start, initial, final in zip(legs[1:], starts[1:], values, values[1:]):
            if final != initial:
                settle = min(leg.roll_s if settle_s is None else settle_s, leg.seconds)
                first = np.searchsorted(time, start)
                result[first:] = initial + (final - initial) * smoothstep((time[first:] - start) / max(settle, 1e-3))
        return result

    phases = list(dict.fromkeys(leg.phase for leg in legs))
    leg_index = np.searchsorted(ends, time, side="right").clip(0, len(legs) - 1)
    return RiderCommands(
        rate_hz=rate_hz,
        time=time,
        speed=speed,
        distance=distance,
        lean=np.radians(stepped("lean_deg", None)),
        slope=_slope(distance, np.interp(ends, time, distance), _fill_in(legs, "slope_percent")),
        hang=stepped("hang_m"),
        lift=np.radians(stepped("lift_deg")),
        engine=stepped("engine"),
        crosswind=stepped("crosswind_mps2"),
        bank=np.radians(stepped("bank_deg", 3.0)),
        phase=np.array([phases.index(leg.phase) for leg in legs])[leg_index],
        phases=phases,
    )


def _fill_in(legs: list[Leg], name: str) -> list[float]:
    """Return one value per leg. None is replaced by the previous leg's value, in the first leg by 0."""
    filled, current = [], 0.0
    for leg in legs:
        value = getattr(leg, name)
        current = current if value is None else value
        filled.append(current)
    return filled


def _slope(distance: Signal, ends: Signal, percent: list[float]) -> Signal:
    """Compute the road's slope at each sample, in rad. It changes smoothly between the ends of legs."""
    knots, values = [0.0], [percent[0]]
    for end, value in zip(ends, percent):
        if end > knots[-1] + 1.0:
            knots.append(float(end))
            values.append(value)
    if len(knots) == 1:
        return np.full_like(distance, np.arctan(percent[0] / 100.0))
    knot, value = np.array(knots), np.array(values)
    segment = np.searchsorted(knot, distance, side="right").clip(1, len(knots) - 1)
    u = (distance - knot[segment - 1]) / (knot[segment] - knot[segment - 1])
    return np.arctan((value[segment - 1] + (value[segment] - value[segment - 1]) * smoothstep(u)) / 100.0)
