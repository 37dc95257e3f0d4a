"""Simulates a whole ride from plan, bike, road, engine and chip."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from kickstand.units import STANDARD_GRAVITY
from numpy.typing import NDArray

from . import hands
from .commands import RiderCommands, commands
from .physics.bike import Bike, Motion, body_rates, roll, specific_force, weave
from .physics.chip import DIVIDER, MOUNTS, RATE_HZ, Chip, Mount
from .physics.road import CLASSES, Shaking, add_bumps, profile_slope, shaking, vibration
from .physics.signals import band_noise, smoothed, smoothstep
from .plan import Conditions, Plan
from .profiles import PROFILES

_WARMING_S = 300.0  # time constant of the chip's temperature
# The option `road` uses these rms values of side slip, camber and the rider's sway
_SLIP_DEG, _CAMBER_DEG, _SWAY_M = 0.3, 1.5, 0.006
_IMPACT_G = 4.0  # peak of the impact at the end of a fall


@dataclass
class SimulatedRide:
    """A simulated ride: the sensor's readings and the truth.

    Arrays of readings have shape (n, 7), with rate_hz rows per second. A row has the chip's order: force in g,
    temperature in C, rate in deg/s.

    rate_hz: Number of readings per second.
    poses: Readings of each of seven poses: six sides in random order, then a slanted pose.
    kickstand: Readings of the kickstand pose.
    upright: Readings of the upright pose.
    time: Time of each reading of the ride, shape (n), in s.
    readings: Readings of the ride.
    truth: True values at each reading of the ride, by name, shape (n) each.
    phase: Name of the rider's action at each reading of the ride, shape (n).
    vehicle_from_sensor: Rotation from sensor to vehicle axes, shape (3, 3). Its rows are left, up, forward.
    chip: The sensor.
    bike: The bike.
    stand_deg: Lean in the kickstand pose. At the start of the ride the bike stands at another lean.
    seed: Seed of the property `procedure`.
    home_c: Temperature during the poses of the sensor.
    """

    rate_hz: float
    poses: list[NDArray[np.float64]]
    kickstand: NDArray[np.float64]
    upright: NDArray[np.float64]
    time: NDArray[np.float64]
    readings: NDArray[np.float64]
    truth: dict[str, NDArray[np.float64]]
    phase: NDArray[np.str_]
    vehicle_from_sensor: NDArray[np.float64]
    chip: Chip
    bike: Bike
    stand_deg: float
    seed: tuple[int, ...]
    home_c: float

    @cached_property
    def procedure(self) -> NDArray[np.float64]:
        """Readings of seven other poses in one recording, with the turns between them, shape (n, 7)."""
        chance = np.random.default_rng(self.seed)
        return hands.procedure(chance, self.chip, np.array(list(hands.ups(chance))), self.home_c)


def ride(
    profile: str,
    seed: int,
    seconds: float = 640.0,
    upright_error_deg: float = 0.0,
    pitch_change_deg: float | None = None,
    share: float = 1.0,
    road: str | None = None,
    mount: str | None = None,
    dive: tuple[float, float] | None = None,
    exact: bool = False,
    earlier: SimulatedRide | None = None,
    start_c: float | None = None,
) -> SimulatedRide:
    """Simulate a ride. The same profile and seed always give the same ride.

    profile: A key of PROFILES.
    seed: Seed of the random numbers.
    seconds: Approximate length of the ride.
    upright_error_deg: Lean of the bike to the right in the upright pose.
    pitch_change_deg: Pitch on the kickstand minus pitch in the upright pose. None for a random value within 1 degree.
    share: Factor on the sensor's tolerances.
    road: A class of ISO 8608. None uses the profile's own road. With a class, the road is also cambered, the rider
        moves around, and the tyres slip a little.
    mount: A key of MOUNTS. None for a firm mount.
    dive: Pitch on the springs in degrees per g, as (nose down in braking, nose up in acceleration). None for random
        values, about 3 and 1.4.
    exact: True to make the ride exactly this long, if there is enough time to set off and stop.
    earlier: A ride of the same bike with the same sensor and mount. None for random ones.
    start_c: Temperature of the chip at power-on. None uses the profile's own temperature.

    >>> simulated = ride("parked", seed=1, seconds=20.0)
    >>> simulated.rate_hz, len(simulated.poses), simulated.readings.shape == (len(simulated.time), 7)
    (200.0, 7, True)
    """
    chance = np.random.default_rng([seed, *profile.encode()])
    plan = Plan(chance, seconds)
    conditions = PROFILES[profile](plan)
    if exact:
        plan.fit(seconds)
    bike, chip = Bike.random(chance), Chip.random(chance, share, conditions.drift)
    mounting = random_rotation(chance)
    if dive is not None:
        bike = replace(bike, dive_deg_per_g=dive[0], squat_deg_per_g=dive[1])
    # The options have their own source of random numbers. So a seed without options gives the same ride as in versions
    # of this program without these options
    option_chance = np.random.default_rng([seed, *profile.encode(), 1])
    if road is not None:
        _rough(option_chance, plan, conditions, CLASSES[road])
    mounted = MOUNTS[mount](option_chance, chip) if mount is not None else Mount(chip)
    if mounted.rise_c is not None:
        conditions.rise_c = mounted.rise_c
    if earlier is not None:
        bike, mounting = earlier.bike, earlier.vehicle_from_sensor
        mounted = replace(mounted, chip=earlier.chip)
    chip = mounted.chip
    if start_c is not None:
        conditions.start_c = start_c
    course = _course(chance, option_chance, plan, conditions, bike)
    readings = _read(chance, course, mounted, mounting, conditions.creep_deg)
    home_c = chance.uniform(18.0, 25.0)
    nose = chance.uniform(-0.5, 0.5)  # slope of the ground in both poses, in degrees
    change = chance.uniform(-1.0, 1.0) if pitch_change_deg is None else pitch_change_deg
    lean = -chance.uniform(8.0, 15.0)
    seven = hands.seven(chance, chip, home_c)
    start_c = conditions.start_c
    return SimulatedRide(
        rate_hz=RATE_HZ / DIVIDER,
        poses=seven,
        kickstand=hands.standing(chance, chip, mounting, lean, nose + change, start_c, held=False),
        upright=hands.standing(chance, chip, mounting, upright_error_deg, nose, start_c, held=True),
        time=course.time,
        readings=readings,
        truth=course.truth,
        phase=course.phase,
        vehicle_from_sensor=mounting,
        chip=chip,
        bike=bike,
        stand_deg=lean,
        seed=(seed, *profile.encode(), 2),
        home_c=home_c,
    )


@dataclass
class _Course:
    """What the bike does on a ride, and what a sensor on a firm mount would measure.

    time, truth, phase: As in SimulatedRide.
    force, rates: Force in g and rates in deg/s in the vehicle's axes, RATE_HZ rows per second, shape (n, 3).
    temp: Temperature of the chip, shape (n), in C.
    """

    time: NDArray[np.float64]
    truth: dict[str, NDArray[np.float64]]
    phase: NDArray[np.str_]
    force: NDArray[np.float64]
    rates: NDArray[np.float64]
    temp: NDArray[np.float64]


def _course(
    chance: np.random.Generator, option_chance: np.random.Generator, plan: Plan, conditions: Conditions, bike: Bike
) -> _Course:
    command = commands(plan.legs, RATE_HZ)
    slip = _slip(option_chance, command, conditions)
    motion, extra = _motion(chance, command, bike, conditions)
    # An hour at 1 kHz needs 29 MB per column, so arrays are freed early. This requires that no array is a view of
    # another.
    temp = conditions.start_c + conditions.rise_c * (1.0 - np.exp(-command.time / _WARMING_S))
    time, phase = command.time[::DIVIDER].copy(), np.array(command.phases)[command.phase[::DIVIDER]]
    del command
    force = specific_force(motion, bike)
    force += extra.force
    force += _sideways(motion.lean, slip)
    del slip
    force /= STANDARD_GRAVITY
    rates = body_rates(motion)
    rates += extra.rates
    np.degrees(rates, out=rates)
    return _Course(time, _truth(motion), phase, force, rates, temp)


def _read(
    chance: np.random.Generator, course: _Course, mounted: Mount, mounting: NDArray[np.float64], creep_deg: float
) -> NDArray[np.float64]:
    """Read the sensor, as in SimulatedRide. The course's force and rates are turned to the sensor's axes."""
    if mounted.holder is not None:
        course.force, course.rates = mounted.holder.shaken(course.force, course.rates, RATE_HZ)
    turned = _creep(chance, len(course.force), creep_deg)
    course.force = _to_sensor(course.force, mounting, turned)
    course.rates = _to_sensor(course.rates, mounting, turned)
    del turned
    return mounted.chip.read(chance, course.force, course.rates, course.temp)


def _truth(motion: Motion) -> dict[str, NDArray[np.float64]]:
    return {
        "lean_deg": np.degrees(motion.lean[::DIVIDER]),
        "speed_mps": motion.speed[::DIVIDER].copy(),
        "yaw_rate_dps": np.degrees(motion.yaw_rate[::DIVIDER]),
        "pitch_deg": np.degrees(motion.pitch[::DIVIDER]),
        "slope_deg": np.degrees(motion.slope[::DIVIDER]),
    }


def random_rotation(chance: np.random.Generator) -> NDArray[np.float64]:
    """Return a random rotation from sensor to vehicle axes, shape (3, 3). Every rotation is equally likely."""
    q, r = np.linalg.qr(chance.standard_normal((3, 3)))
    q = q * np.sign(np.diag(r))
    return q * np.linalg.det(q)


def _motion(
    chance: np.random.Generator, command: RiderCommands, bike: Bike, conditions: Conditions
) -> tuple[Motion, Shaking]:
    n, rate = len(command.time), command.rate_hz
    command.crosswind += conditions.gust_mps2 * band_noise(chance, n, 0.05, 0.5, rate)
    # A rider who moves around makes the bike lean only while the bike moves
    command.hang += conditions.sway_m * band_noise(chance, n, 0.02, 0.3, rate) * smoothstep(command.speed / 5.0)
    rolled = roll(command, bike, weave(chance, command, conditions.unrest_deg))
    surface = profile_slope(chance, float(command.distance[-1]) + 10.0, conditions.roughness)
    for phase, spacing, height, length in conditions.bumps:
        add_bumps(surface, _distances_in_phase(command, phase, spacing), height, length)
    shaken = shaking(chance, command.distance, command.speed, surface, bike, rate)
    dive = bike.dive(np.gradient(command.speed, 1.0 / rate), rate)
    motion = Motion(
        rate_hz=rate,
        speed=command.speed,
        slope=command.slope,
        yaw_rate=rolled.yaw_rate,
        lean=rolled.lean,
        pitch=command.slope + dive + shaken.pitch + command.lift,
        heave=shaken.heave,
    )
    force, rates = vibration(chance, command.speed, command.engine, conditions.engine_rms_g, conditions.shift_rpm, rate)
    shaken.force += force + _impact(chance, command)
    shaken.rates += rates
    return motion, shaken


def _rough(chance: np.random.Generator, plan: Plan, conditions: Conditions, roughness: float) -> None:
    """Make road and rider realistic. Each leg is tilted to a random side, and the rider moves around."""
    conditions.roughness, conditions.slip_deg = roughness, _SLIP_DEG
    conditions.sway_m = max(conditions.sway_m, _SWAY_M)
    for leg in plan.legs:
        leg.bank_deg = (leg.bank_deg or 0.0) + float(chance.normal(0.0, _CAMBER_DEG))


def _slip(chance: np.random.Generator, command: RiderCommands, conditions: Conditions) -> NDArray[np.float64]:
    """Simulate the acceleration to the left that side slip causes, shape (n), in m/s2."""
    if not conditions.slip_deg:
        return np.zeros(len(command.time))
    angle = np.radians(conditions.slip_deg) * band_noise(chance, len(command.time), 0.05, 1.0, command.rate_hz)
    return np.gradient(angle * command.speed, 1.0 / command.rate_hz)


def _sideways(lean: NDArray[np.float64], left: NDArray[np.float64]) -> NDArray[np.float64]:
    """Convert a horizontal acceleration to the left to the axes left, up, forward of a leaning bike, shape (n, 3)."""
    return np.column_stack((left * np.cos(lean), -left * np.sin(lean), np.zeros_like(left)))


def _distances_in_phase(command: RiderCommands, phase: str, spacing_m: float) -> list[float]:
    """Return the distances at which the ride is in this phase. The distances are multiples of spacing_m."""
    if phase not in command.phases:
        return []
    passed = command.distance[command.phase == command.phases.index(phase)]
    return sorted({float(k) * spacing_m for k in np.floor(passed / spacing_m)})


def _impact(chance: np.random.Generator, command: RiderCommands) -> NDArray[np.float64]:
    """Simulate the additional force at the end of a fall, shape (n, 3), in m/s2."""
    force = np.zeros((len(command.time), 3))
    if "lying" in command.phases:
        since = command.time - command.time[np.argmax(command.phase == command.phases.index("lying"))]
        ringing = np.where(since >= 0.0, np.exp(-np.clip(since, 0.0, 10.0) / 0.08), 0.0)
        for axis in range(3):
            wave = np.sin(2.0 * np.pi * chance.uniform(15.0, 35.0) * since)
            force[:, axis] = _IMPACT_G * STANDARD_GRAVITY * ringing * wave
    return force


def _creep(chance: np.random.Generator, n: int, degrees: float) -> NDArray[np.float64]:
    """Simulate the rotation of a yielding mount, mostly slow, partly sudden: rotation vectors, shape (n, 3), in rad."""
    axis = chance.standard_normal(3)
    at_once = np.zeros(n)
    at_once[int(n * chance.uniform(0.3, 0.7)) :] = 1.0
    share = 0.6 * np.linspace(0.0, 1.0, n) + 0.4 * smoothed(at_once, 0.3, RATE_HZ)
    return np.radians(degrees) * share[:, None] * axis / np.linalg.norm(axis)


def _to_sensor(vectors: NDArray, mounting: NDArray, turned: NDArray) -> NDArray[np.float64]:
    """Rotate vectors from the vehicle's axes to the sensor's axes, shape (n, 3).

    turned: small rotations of the mount, shape (n, 3), in rad, applied to second order.
    """
    if turned.any():
        first = np.cross(turned, vectors)
        vectors = vectors + first + 0.5 * np.cross(turned, first)
    return vectors @ mounting
