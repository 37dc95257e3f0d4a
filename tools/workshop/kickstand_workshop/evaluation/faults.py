"""Lists the faults that a sensor may have during a ride. Each fault has a function that changes readings.

There are three kinds of faults:

SEEN: The sensor's counts and registers reveal the fault. An axis is dead, in standby or at the end of its range.
ILL: Only contradictions between readings reveal the fault.
HARMLESS: The lean stays nearly right in spite of the fault.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial

import numpy as np
from kickstand_tools.signals import rotation_matrix
from numpy.typing import NDArray

Array = NDArray[np.float64]
SEEN, ILL, HARMLESS = "seen", "ill", "harmless"
ACCEL_RANGE_G, GYRO_RANGE_DPS = 16.0, 500.0  # ranges of the sensor, the defaults of a board
RANGES = {"force": ACCEL_RANGE_G, "rate": GYRO_RANGE_DPS}


@dataclass
class Part:
    """The n readings during a fault. The fault changes force, rate and lost in place."""

    force: Array  # force in the chip's axes, shape (n, 3), in g
    rate: Array  # rate in the chip's axes, shape (n, 3), in deg/s
    lost: NDArray[np.bool_]  # True for readings that never arrive, shape (n)
    rate_hz: float  # number of readings per second
    axis: int  # index of the faulty axis, for a fault of one axis
    sign: float  # direction of the fault, 1 or -1
    chance: np.random.Generator  # source of random numbers


@dataclass(frozen=True)
class Fault:
    name: str  # description of the fault
    kind: str  # SEEN, ILL or HARMLESS
    change: Callable[[Part], None]  # function that applies the fault to a Part
    seconds: float | None = None  # duration of the fault. None if it lasts until the end of the ride.
    from_start: bool = False  # True if the fault exists from power-on. False if it begins in mid-ride.

    @property
    def title(self) -> str:
        if self.from_start:
            return f"{self.name}, from power-on"
        return self.name if self.seconds is None else f"{self.name}, {self.seconds:g} s"


def _axis_dead(part: Part, signal: str) -> None:
    values = getattr(part, signal)
    values[:, part.axis] = values[0, part.axis] if part.sign > 0 else 0.0


def _axis_at_rail(part: Part, signal: str) -> None:
    getattr(part, signal)[:, part.axis] = part.sign * 2.0 * RANGES[signal]


def _axis_scaled(part: Part, signal: str, scale: float) -> None:
    getattr(part, signal)[:, part.axis] *= scale


def _axis_steps(part: Part, signal: str, by: float) -> None:
    getattr(part, signal)[:, part.axis] += part.sign * by


def _axis_noisy(part: Part, signal: str, rms: float) -> None:
    values = getattr(part, signal)
    values[:, part.axis] += rms * part.chance.standard_normal(len(values))


def _accel_frozen(part: Part) -> None:
    part.force[:] = part.force[0]


def _gyro_scaled(part: Part, scale: float) -> None:
    part.rate *= scale


def _gyro_axes_swapped(part: Part) -> None:
    axes = [k for k in range(3) if k != part.axis]
    part.rate[:, axes] = part.rate[:, axes[::-1]].copy()


def _gyro_bias_drifts(part: Part, dps: float) -> None:
    part.rate[:, part.axis] += part.sign * dps * np.linspace(0.0, 1.0, len(part.rate))


def _mount_slips(part: Part, degrees: float) -> None:
    """Rotate the readings about one of the chip's axes."""
    turned = rotation_matrix(np.radians(part.sign * degrees) * np.eye(3)[part.axis])
    part.force[:] = part.force @ turned
    part.rate[:] = part.rate @ turned


def _accel_clipped(part: Part, g: float) -> None:
    np.clip(part.force, -g, g, out=part.force)


def _accel_clipped_now_and_then(part: Part) -> None:
    """Clip the force for 0.1 s every five seconds, like blows that exceed a small range."""
    for start in range(0, len(part.force), round(5.0 * part.rate_hz)):
        end = start + round(0.1 * part.rate_hz)
        part.force[start:end] = (part.force[start:end] + 2.0 * part.chance.standard_normal(3)).clip(-2.0, 2.0)


def _gyro_late(part: Part, seconds: float) -> None:
    n = round(seconds * part.rate_hz)
    part.rate[n:] = part.rate[:-n].copy()


def _mount_swings(part: Part, degrees: float, hz: float) -> None:
    """Let the sensor swing about one axis, as on a loose bracket."""
    phase = 2.0 * np.pi * hz * np.arange(len(part.force)) / part.rate_hz
    part.rate[:, part.axis] += degrees * 2.0 * np.pi * hz * np.cos(phase)
    angle = np.radians(degrees) * np.sin(phase)
    axis = np.eye(3)[part.axis]
    part.force[:] -= np.cross(angle[:, None] * axis, part.force)


def _readings_lost(part: Part) -> None:
    part.lost[:] = True


def _readings_lost_now_and_then(part: Part) -> None:
    """Lose the readings of 0.3 s every ten seconds."""
    period, n = round(10.0 * part.rate_hz), round(0.3 * part.rate_hz)
    part.lost[np.arange(len(part.lost)) % period < n] = True


START, END = -1.0, None  # a fault from power-on, a fault from mid-ride to the end


def _spans(name: str, kind: str, change: Callable[[Part], None], *spans: float | None) -> Iterator[Fault]:
    """Yield a fault with this change for each span: START, END, or a duration in s."""
    for seconds in spans:
        yield Fault(name, kind, change, None if seconds == START else seconds, seconds == START)


_EACH = (START, END, 5.0)
FAULTS: tuple[Fault, ...] = (
    *_spans("gyro axis dead", SEEN, partial(_axis_dead, signal="rate"), *_EACH),
    *_spans("gyro dead", SEEN, partial(_gyro_scaled, scale=0.0), *_EACH),
    *_spans("gyro axis at the end of its range", SEEN, partial(_axis_at_rail, signal="rate"), 0.3, 1.0, END),
    *_spans("accelerometer axis dead", SEEN, partial(_axis_dead, signal="force"), *_EACH),
    *_spans("accelerometer axis at the end of its range", SEEN, partial(_axis_at_rail, signal="force"), 1.0, END),
    Fault("accelerometer frozen", SEEN, _accel_frozen),
    *_spans("gyro at half scale", ILL, partial(_gyro_scaled, scale=0.5), *_EACH),
    *_spans("gyro axis at half scale", ILL, partial(_axis_scaled, signal="rate", scale=0.5), *_EACH),
    Fault("gyro axis at twice the scale", ILL, partial(_axis_scaled, signal="rate", scale=2.0)),
    *_spans("gyro axis mirrored", ILL, partial(_axis_scaled, signal="rate", scale=-1.0), *_EACH),
    Fault("two gyro axes swapped", ILL, _gyro_axes_swapped, from_start=True),
    Fault("gyro bias steps by 2 deg/s", ILL, partial(_axis_steps, signal="rate", by=2.0)),
    Fault("gyro bias steps by 5 deg/s", ILL, partial(_axis_steps, signal="rate", by=5.0)),
    *_spans("gyro bias steps by 10 deg/s", ILL, partial(_axis_steps, signal="rate", by=10.0), END, 5.0),
    Fault("gyro bias drifts by 10 deg/s", ILL, partial(_gyro_bias_drifts, dps=10.0)),
    Fault("mount slips by 10 degrees", ILL, partial(_mount_slips, degrees=10.0)),
    *_spans("mount slips by 20 degrees", ILL, partial(_mount_slips, degrees=20.0), END, 5.0),
    *_spans("accelerometer axis off by 0.3 g", ILL, partial(_axis_steps, signal="force", by=0.3), END, 5.0),
    Fault("accelerometer axis at half scale", ILL, partial(_axis_scaled, signal="force", scale=0.5)),
    Fault("accelerometer clipped at 1.2 g", ILL, partial(_accel_clipped, g=1.2)),
    Fault("accelerometer axis noisy, 1 g", ILL, partial(_axis_noisy, signal="force", rms=1.0)),
    *_spans("readings lost", ILL, _readings_lost, 1.0, 5.0),
    Fault("gyro 150 ms late", HARMLESS, partial(_gyro_late, seconds=0.15)),
    Fault("gyro axis noisy, 20 deg/s", HARMLESS, partial(_axis_noisy, signal="rate", rms=20.0)),
    Fault("mount swings by 1 degree at 8 Hz", HARMLESS, partial(_mount_swings, degrees=1.0, hz=8.0)),
    Fault("accelerometer clipped now and then", HARMLESS, _accel_clipped_now_and_then),
    Fault("readings lost for 0.3 s every 10 s", HARMLESS, _readings_lost_now_and_then),
)


@dataclass
class Ill:
    readings: Array  # readings in the chip's order, shape (n, 7)
    lost: NDArray[np.bool_]  # True for readings that never arrive, shape (n)
    first: int  # index of the first reading with the fault
    end: int  # index after the last reading with the fault

    @property
    def saturated(self) -> NDArray[np.bool_]:
        """True for each reading with an axis at the end of its range, which the driver treats as lost."""
        force, rate = np.abs(self.readings[:, :3]), np.abs(self.readings[:, 4:])
        return np.any(np.hstack((force >= ACCEL_RANGE_G, rate >= GYRO_RANGE_DPS)), axis=1)


def apply(fault: Fault, readings: Array, rate_hz: float, begin_s: float, seed: int, vehicle_from_sensor: Array) -> Ill:
    """Return a copy of the readings with the fault.

    The seed chooses the faulty axis, the sign, and whether the chip is mounted square. A square chip has the same axes
    as the bike.

    readings: Readings in the chip's order, shape (n, 7).
    begin_s: Start of a fault that begins in mid-ride.
    vehicle_from_sensor: Rotation from sensor to bike axes, shape (3, 3).
    """
    chance = np.random.default_rng([seed, *fault.title.encode()])
    faulty = readings.copy()
    lost = np.zeros(len(faulty), dtype=bool)
    first = 0 if fault.from_start else round(begin_s * rate_hz)
    end = len(faulty) if fault.seconds is None else min(len(faulty), first + round(fault.seconds * rate_hz))
    span = slice(first, end)
    # Apply a fault of the kind SEEN along the chip's own axes. A rotated fault would not show in the counts
    square = seed // 3 % 2 == 0 and fault.kind != SEEN
    turned = vehicle_from_sensor if square else np.eye(3)
    part = Part(
        force=faulty[span, :3] @ turned.T,
        rate=faulty[span, 4:] @ turned.T,
        lost=lost[span],
        rate_hz=rate_hz,
        axis=seed % 3,
        sign=(1.0, -1.0)[seed // 6 % 2],
        chance=chance,
    )
    fault.change(part)
    faulty[span, :3] = (part.force @ turned).clip(-ACCEL_RANGE_G, ACCEL_RANGE_G)
    faulty[span, 4:] = (part.rate @ turned).clip(-GYRO_RANGE_DPS, GYRO_RANGE_DPS)
    return Ill(faulty, lost, first, end)
