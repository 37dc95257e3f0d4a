"""Rides whose road, bike, rider, mount and sensor are drawn at random from realistic values.

The rides come from the second simulator (other_bike.py). On request, a ride uses one part of
kickstand_sim.simulation: the sensor with the data sheet's errors and its calibration by six positions. Parameters of
the estimators are fitted with even seeds only, and figures are reported for odd seeds:

    OMP_NUM_THREADS=1 .venv/bin/python -m kickstand_workshop.evaluation.drawn_rides odd 100
"""

import sys
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from kickstand_sim.simulation import hands
from kickstand_sim.simulation.hands import Hand
from kickstand_sim.simulation.physics.chip import GYRO_DPS_PER_G, Chip
from kickstand_tools.calibration.file import CalibrationFile
from kickstand_tools.calibration.poses import fit_procedure, fit_two_positions
from kickstand_tools.logs.log import Log

from .other_bike import (
    FINE_HZ,
    KINDS,
    G,
    about,
    course_of,
    perfect_readings,
    random_mounting,
    random_tolerances,
    smooth_noise,
)
from .smoothed_rides import Known, rms

# The share of rides with each mount. A "foreign" mount shakes or bends, so the sensor measures the mount's own
# accelerations.
MOUNTS = {"firm": 0.5, "holder": 0.1, "aliasing": 0.1, "clipping": 0.1, "drifting": 0.1, "foreign": 0.1}
# The roughness of a road is its power density in m^3 at 0.1 cycles/m, as in ISO 8608. Roads other than a track range
# from a new motorway to a patched lane.
ROUGH = {"track": (4e-6, 32e-6)}
USUALLY_ROUGH = 8e-6, 512e-6
WAVES_PER_M = 0.03, 4.0
# Legs of a bike that stops, stands with the engine running and sets off again
STOP = [(8.0, 0.0, 0.0), (24.0, 0.0, 0.0), (6.0, 0.0, 12.0)]


@dataclass
class DrawnRide:
    """A ride with the logs of its devices and its true motion."""

    logs: list  # one log per device on the bike. Each has its own clock.
    calibrations: list  # one calibration per device
    time_s: np.ndarray  # time of each true value, in s
    lean_deg: np.ndarray  # true lean at time_s
    speed_mps: np.ndarray  # true speed at time_s
    kind: str  # the kind of ride, a key of DRAWN
    mounts: list  # one mount per device, a key of MOUNTS

    def true_lean(self, k):
        return np.interp(self.logs[k].t_s, self.time_s, self.lean_deg)

    def riding(self, k):
        """Return True for each sample of device k after the bike has set off."""
        return self.logs[k].t_s > self.time_s[np.argmax(self.speed_mps > 0.5)]


def street(chance):
    """Return the legs of a ride with bends to either side, straights and some traffic lights."""
    legs = [(6.0, 0.0, 0.0), (6.0, 0.0, 15.0)]
    for _ in range(60):
        speed, kind = chance.uniform(11.0, 26.0), chance.random()
        if kind < 0.08:
            legs += [(7.0, 0.0, 0.0), (chance.uniform(4.0, 12.0), 0.0, 0.0), (7.0, 0.0, 16.0)]
        elif kind < 0.5:
            legs += [(chance.uniform(2.0, 9.0), 0.0, speed)]
        else:
            legs += [(chance.uniform(2.0, 7.0), chance.choice((-1.0, 1.0)) * chance.uniform(8.0, 38.0), speed)]
    return legs


def city(chance):
    """Return the legs of a ride with junctions and roundabouts at 4 to 13 m/s, and stops."""
    legs = [(6.0, 0.0, 0.0), (5.0, 0.0, 9.0)]
    for _ in range(60):
        speed, kind = chance.uniform(4.0, 8.0), chance.random()
        if kind < 0.2:
            legs += [(4.0, 0.0, 0.0), (chance.uniform(3.0, 20.0), 0.0, 0.0), (5.0, 0.0, 9.0)]
        elif kind < 0.5:
            legs += [(chance.uniform(3.0, 8.0), 0.0, chance.uniform(7.0, 13.0))]
        else:
            legs += [(chance.uniform(1.5, 4.0), chance.choice((-1.0, 1.0)) * chance.uniform(8.0, 28.0), speed)]
    return legs


def hills(chance):
    return [(s, lean, 0.7 * v) for s, lean, v in street(chance)]


DRAWN = {**KINDS, "street": street, "city": city, "hills": hills}


def drawn_ride(seed, seconds=150.0, mounts=None, kind=None, sheet=False, six=True, stop_s=None):
    """Return a DrawnRide. The same arguments give the same ride.

    seconds: longest duration.
    mounts: one mount per device on the bike. None: one device with a random mount.
    kind: a key of DRAWN. None: a random kind.
    stop_s: time from which the bike stops and stands for a while, before it rides on. None: no such stop.
    sheet: True for a sensor with all errors of its data sheet, calibrated by one log of the six positions and by two
        poses. False for a sensor that only has the errors that remain after a calibration.
    six: False for a sensor of the data sheet without the six positions.
    """
    chance = np.random.default_rng([seed, 24])
    drawn = str(chance.choice(list(DRAWN)))
    kind = kind or drawn
    legs = _selected(DRAWN[kind](chance), seconds - 8.0, stop_s)
    time, lean, v = course_of([*legs, (8.0, 0.0, 15.0)])
    riding = np.clip((v - 1.0) / 3.0, 0.0, 1.0)
    chassis, yaw_rate = _lean_and_yaw_rate(chance, lean, v, riding)
    slope, pitch, slip, rear = _slope_pitch_slip_rear(chance, seed, kind, v, riding)
    engine = np.exp(chance.uniform(np.log(0.03), np.log(0.2))) * np.clip(v / 10.0, 0.3, 1.5)
    turns = np.cumsum(np.clip(35.0 + 6.0 * (v % 9.0), 20.0, 150.0)) / FINE_HZ
    used = mounts or [str(chance.choice(list(MOUNTS), p=list(MOUNTS.values())))]
    logs, calibrations = [], []
    for mount in used:
        ahead_m, height_m = chance.uniform(0.2, 0.8), chance.uniform(0.1, 1.0)
        force, rates = perfect_readings(v, yaw_rate, slope, chassis, pitch, ahead_m, slip, rear, height_m)
        force, rates = _shaken_by_engine(chance, force, np.degrees(rates), engine, turns)
        force, rates = _through_mount(chance, mount, force, rates, v)
        sensor = np.random.default_rng([seed, 26, len(logs)]) if sheet else None
        log, calibration = _device(chance, mount, force, rates, v, sensor, six)
        logs.append(log)
        calibrations.append(calibration)
    step = FINE_HZ // 200
    return DrawnRide(logs, calibrations, time[::step], np.degrees(chassis[::step]), v[::step], kind, used)


def _selected(legs, seconds, stop_s):
    """Return the legs that end within `seconds`, at least four. STOP comes before the leg that ends after stop_s."""
    selected, end_s = [], 0.0
    for leg_s, lean, speed in legs:
        end_s += leg_s
        if end_s > seconds and len(selected) > 3:
            break
        if stop_s and end_s > stop_s:
            selected += STOP
            stop_s = None
        selected.append((leg_s, lean, speed))
    return selected


def _lean_and_yaw_rate(chance, lean, v, riding):
    """Return the chassis's lean in rad, and the yaw rate in rad/s, of a bike that balances at `lean` degrees.

    The chassis's lean differs from the lean of balance, because the tyres are wide, the road is tilted and the rider
    moves.
    """
    n = len(lean)
    wander = chance.uniform(0.2, 0.8) * smooth_noise(chance, n, chance.uniform(0.5, 1.5)) * riding
    balance = np.radians(lean + wander)
    tilt = np.radians(chance.uniform(-2.5, 2.5) + chance.uniform(0.3, 1.0) * smooth_noise(chance, n, 8.0))
    tyre, height = chance.uniform(0.03, 0.08), chance.uniform(0.55, 0.7)
    # A leaning bike stands on the flank of its tyre, so the chassis leans more than the line of balance
    camber_lean = balance - tilt
    flank = np.arctan2(tyre * np.sin(camber_lean), height - tyre + tyre * np.cos(camber_lean))
    rider_deg = np.exp(chance.uniform(np.log(0.3), np.log(1.5))) * smooth_noise(chance, n, chance.uniform(0.7, 3.0))
    hang_share = chance.uniform(-0.02, 0.06)  # of the lean, which a rider saves who hangs to the inside
    chassis = balance + (flank + np.radians(rider_deg) - hang_share * balance) * riding
    # The yaw rate follows from the balance of roll. To lean over, a bike first steers to the other side.
    falling = chance.uniform(0.6, 0.75) * _twice(balance) / np.cos(balance)
    return chassis, np.where(v > 0.5, (falling - G * np.tan(balance)) / np.maximum(v, 3.0), 0.0)


def _slope_pitch_slip_rear(chance, seed, kind, v, riding):
    """Return the road's slope, the chassis's pitch and its slip, all in rad, and the height of its rear in m."""
    n = len(v)
    steep = chance.uniform(1.5, 4.0) if kind == "hills" else chance.uniform(0.3, 1.5)
    slope = np.radians(steep) * smooth_noise(chance, n, chance.uniform(4.0, 10.0)) * riding
    chance.uniform(0.15, 0.4)  # unused: keeps the random sequence of each seed
    dive = _dive(np.random.default_rng([seed, 25]), np.gradient(v) * FINE_HZ / G)
    dive = _through(dive, *_spring(chance.uniform(1.4, 2.2), chance.uniform(0.35, 0.6)))
    low, high = ROUGH.get(kind, USUALLY_ROUGH)
    wheelbase = chance.uniform(1.3, 1.55)
    rear, front = _road(chance, v, wheelbase, np.exp(chance.uniform(np.log(low), np.log(high))))
    slip = np.radians(chance.uniform(0.1, 0.5)) * smooth_noise(chance, n, chance.uniform(0.5, 3.0))
    return slope, slope + dive + (front - rear) / wheelbase, slip, rear


def _dive(chance, push):
    """Return the pitch that the springs cause, in rad, positive with the nose up.

    A fork dives by up to 6 degrees per g of braking. The rear sinks by up to 3 degrees per g of acceleration. One bike
    of eight has an anti-dive fork, which dives by at most 0.5 degrees per g and may rise by up to 1 degree per g.

    push: forward acceleration in g.
    """
    braking = chance.uniform(-1.0, 0.5) if chance.random() < 0.125 else chance.uniform(0.0, 6.0)
    return np.radians(np.where(push < 0.0, braking, chance.uniform(0.0, 3.0))) * push


def _shaken_by_engine(chance, force, rates, engine, turns):
    """Add the engine's vibration, of the size `engine` in g, to force and rates. turns: of the engine so far."""
    for order in (1.0, 2.0):
        phases, weights = chance.uniform(0.0, 2.0 * np.pi, 6), chance.uniform(0.2, 1.0, 6)
        shaken = engine[:, None] * weights * np.sin(2.0 * np.pi * order * turns[:, None] + phases)
        force, rates = force + shaken[:, :3], rates + 10.0 * shaken[:, 3:]
    return force, rates


def _through_mount(chance, mount, force, rates, v):
    """Return the force in g and the rates in deg/s at a sensor on this mount."""
    if mount == "holder":
        hz, damping = (np.exp(chance.uniform(*np.log(limits), 3)) for limits in ((5.0, 40.0), (0.02, 0.1)))
        springs = [_spring(f, z, True) for f, z in zip(hz, damping)]
        force, rates = (
            np.column_stack([_through(column, *spring) for column, spring in zip(values.T, springs)])
            for values in (force, rates)
        )
        # The forces bend the mount, and the gyro measures this rotation.
        sagged = np.radians(chance.uniform(0.1, 0.3)) * (10.0 / hz[0]) ** 2 * np.clip(force[:, 0], -2.0, 2.0)
        rates[:, 2] -= np.degrees(np.gradient(sagged) * FINE_HZ)
        force[:, 0] -= sagged * force[:, 1]
    if mount == "foreign":
        for axis, most_g, over_s in ((0, 0.06, 0.2), (1, 0.05, 1.5), (1, 0.2, 0.05), (2, 0.06, 0.2)):
            size, over_s = most_g * chance.uniform(0.3, 1.0), over_s * np.exp(chance.uniform(-0.7, 0.7))
            force[:, axis] += size * smooth_noise(chance, len(v), over_s) * np.clip(v / 5.0, 0.0, 1.0)
    if mount == "clipping":
        force, rates = np.clip(force, -1.6, 1.6), np.clip(rates, -125.0, 125.0)
    return force, rates


def _device(chance, mount, force, rates, v, sensor, six):
    """Return the log of a sensor on the bike and its calibration by six positions and two inexact poses.

    sensor: random generator of a sensor with all errors of its data sheet. None: the sensor only has the errors that
        remain after a calibration.
    """
    step = FINE_HZ // (100 if mount == "aliasing" else 200)
    count = len(v) // step
    force, rates = (values[: count * step].reshape(-1, step, 3) for values in (force, rates))
    # A logger that only takes every step-th reading aliases; the others average
    force, rates = (values[:, 0] if mount == "aliasing" else values.mean(axis=1) for values in (force, rates))
    rough = np.clip(v / 5.0, 0.1, 1.0)[: count * step : step, None]
    force = force + chance.uniform(0.02, 0.08) * rough * chance.standard_normal((count, 3))
    rates = rates + chance.uniform(0.3, 1.5) * rough * chance.standard_normal((count, 3))
    gyro, accel = random_tolerances(chance)
    rate_hz = FINE_HZ / step
    middle = np.asarray((np.arange(count) + 0.5) / rate_hz, dtype=np.float64)
    drift = np.cumsum(chance.standard_normal((count, 3)), axis=0) * 0.004 / np.sqrt(rate_hz)
    bias, offset = chance.uniform(-0.3, 0.3, 3), chance.normal(0.0, 0.002, 3)
    if sensor is None:
        rates, force = rates @ gyro.T + bias, force @ accel.T + offset
    rates = rates + drift
    if mount == "drifting":
        force = force + chance.uniform(-0.03, 0.03, 3) * (1.0 - np.exp(-middle / 120.0))[:, None]
    roll = np.radians(chance.uniform(-1.5, 1.5))
    yaw = np.radians(chance.uniform(-1.0, 1.0)) / np.tan(np.radians(chance.uniform(8.0, 14.0)))
    mounting = random_mounting(chance)
    if sensor is not None:
        return _of_the_sheet(sensor, middle, force @ mounting, rates @ mounting + bias, mounting, six)
    calibration = CalibrationFile(
        vehicle_from_sensor=about(2, roll) @ about(1, yaw) @ mounting, aligned=True, six_done=True, gyro_delay_s=0.0
    )
    return Log(middle, force @ mounting, rates @ mounting), calibration


def _of_the_sheet(chance, time, force, rates, mounting, with_six):
    """Return the log and the calibration of a sensor with all errors of the data sheet.

    The upright pose is 1.5 degrees off. The pitch changes by up to 1 degree between the two poses.

    force, rates: true values in the sensor's axes.
    """
    chip, home_c = Chip.random(chance), chance.uniform(18.0, 25.0)
    hand = Hand(detour_deg=chance.uniform(5.0, 30.0), push_g=chance.uniform(0.03, 0.2))
    six = hands.procedure(chance, chip, np.array(list(hands.ups(chance))), home_c, hand)
    upright, stand = 1.5 * chance.choice((-1.0, 1.0)), -chance.uniform(8.0, 15.0)
    slope, change = chance.uniform(-0.5, 0.5), chance.uniform(-1.0, 1.0)
    on_stand = hands.standing(chance, chip, mounting, stand, slope + change, home_c, False)
    held_upright = hands.standing(chance, chip, mounting, upright, slope, home_c, True)
    calibration = fit_two_positions(
        Log.from_readings(on_stand, 200.0, "KICKSTAND.csv"),
        Log.from_readings(held_upright, 200.0, "UPRIGHT.csv"),
        fit_procedure(Log.from_readings(six, 200.0, "SIX.csv")).calibration if with_six else None,
    ).calibration
    calibration.gyro_delay_s = 0.0
    rates = rates @ chip.gyro_matrix.T + chip.gyro_bias + GYRO_DPS_PER_G * force
    return Log(time, force @ chip.accel_matrix.T + chip.accel_offset, rates), calibration


def _road(chance, v, wheelbase, roughness):
    """Return the height of the chassis over the rear and over the front wheel, in m.

    The bike rides at the speed v over a road with waves as in ISO 8608. Springs and tyres filter the waves.
    """
    distance = np.cumsum(v) / FINE_HZ
    edges = np.geomspace(WAVES_PER_M[0], WAVES_PER_M[1], 241)
    waves = np.sqrt(edges[1:] * edges[:-1]) * np.exp(chance.normal(0.0, 0.003, 240))
    sizes = np.sqrt(2.0 * roughness * (0.1 / waves) ** 2 * np.diff(edges))
    phases = chance.uniform(0.0, 2.0 * np.pi, len(waves))
    grid = np.arange(0.0, distance[-1] + wheelbase + 1.0, 0.04)
    height = np.zeros_like(grid)
    for wave, size, phase in zip(waves, sizes, phases):
        height += size * np.sin(2.0 * np.pi * wave * grid + phase)
    body, wheel = (chance.uniform(1.5, 2.5), chance.uniform(0.3, 0.5)), (chance.uniform(12.0, 15.0), 0.3)
    heights = []
    for begin in (0.0, wheelbase):
        profile = np.interp(distance + begin, grid, height)
        profile -= profile[0]
        heights.append(_through(_through(profile, *_spring(*body, True)), *_spring(*wheel)))
    return heights


def _spring(hz, damping, by_its_foot=False):
    """Return (hz, a, b): the spring's natural frequency in Hz and the coefficients of its transfer function.

    The function is (1 + b s) / (1 + a s + s^2). The variable s is the complex frequency divided by the natural
    frequency.
    by_its_foot: True if the foot of the spring moves. The damper then passes on the movement of the foot, so b equals
        a.
    """
    return hz, 2.0 * damping, 2.0 * damping if by_its_foot else 0.0


def _through(x, hz, a, b):
    """Filter x as a mass on a spring does, with the exact gain at each frequency.

    Before its beginning and after its end x is assumed to be constant.
    """
    pad = 4 * FINE_HZ
    size = 1 << int(np.ceil(np.log2(len(x) + 2 * pad)))
    padded = np.pad(x, (pad, size - len(x) - pad), mode="edge")
    end = np.linspace(0.0, 1.0, size) * (padded[-1] - padded[0])
    s = 1j * np.fft.rfftfreq(size, 1.0 / FINE_HZ) / hz
    passed = np.fft.irfft(np.fft.rfft(padded - end) * (1.0 + b * s) / (1.0 + a * s + s * s), size) + end
    return passed[pad : pad + len(x)]


def _twice(x):
    return np.gradient(np.gradient(x)) * FINE_HZ**2


def judged(ride, k=0):
    return Known(ride.logs[k], ride.calibrations[k], ride.true_lean(k), ride.riding(k)).judged()


class Figures(NamedTuple):
    """The errors of the live and of the smoothed lean on one ride. Errors and sigma are in degrees."""

    seed: int
    kind: str  # the kind of ride, a key of DRAWN
    mount: str  # a key of MOUNTS
    live_rms: float
    live_worst: float
    shown: float  # share of the samples with a shown live lean
    smoothed_rms: float
    smoothed_worst: float
    within_1_sigma: float  # share of the samples whose smoothed lean has an error within 1 sigma
    within_2_sigma: float
    sigma: float  # mean sigma of the smoothed lean

    @property
    def is_worse(self):
        """True if smoothing made the error larger."""
        return self.smoothed_rms > self.live_rms


def figures(seed):
    """Judge the ride of a seed. Returns Figures."""
    ride = drawn_ride(seed)
    live, off, sigma = judged(ride)
    shown = live[~np.isnan(live)]
    ratio = np.abs(off) / sigma
    return Figures(
        seed,
        ride.kind,
        ride.mounts[0],
        live_rms=rms(shown),
        live_worst=float(np.max(np.abs(shown))),
        shown=len(shown) / len(live),
        smoothed_rms=rms(off),
        smoothed_worst=float(np.max(np.abs(off))),
        within_1_sigma=float(np.mean(ratio < 1.0)),
        within_2_sigma=float(np.mean(ratio < 2.0)),
        sigma=float(np.mean(sigma)),
    )


HEAD = " seed kind      mount      live worst shown  smooth worst  1 s  2 s sigma"
ROW = (
    "{seed:5} {kind:9} {mount:9} {live_rms:5.2f} {live_worst:5.1f} {shown:5.0%}  {smoothed_rms:5.2f}"
    " {smoothed_worst:5.1f} {within_1_sigma:5.0%} {within_2_sigma:5.0%} {sigma:5.2f}"
)


def _of_mount(mount, rides):
    """Return a line about all rides with a mount. rides: their Figures, at least one."""
    live, smoothed = map(rms, np.array([(ride.live_rms, ride.smoothed_rms) for ride in rides]).T)
    live_worst = max(ride.live_worst for ride in rides)
    smoothed_worst = max(ride.smoothed_worst for ride in rides)
    within_1, within_2 = np.mean([(ride.within_1_sigma, ride.within_2_sigma) for ride in rides], axis=0)
    return (
        f"{mount:9} {len(rides):3} rides: live {live:.2f}, worst {live_worst:.1f};"
        f" smoothed {smoothed:.2f}, worst {smoothed_worst:.1f}, within 1 and 2 sigma {within_1:.0%} {within_2:.0%};"
        f" worse than live {sum(ride.is_worse for ride in rides)}"
    )


def main(parity, count):
    """Print one line of figures per seed, then one line per mount.

    parity: "odd" or "even" seeds. count: number of seeds.
    """
    if parity not in ("odd", "even"):
        sys.exit(f"the seeds are odd or even, not {parity}")
    rides = []
    print(HEAD)
    for seed in range(parity == "odd", 2 * int(count), 2):
        ride = figures(seed)
        rides.append(ride)
        print(ROW.format(**ride._asdict()), "worse than live" if ride.is_worse else "", flush=True)
    for mount in MOUNTS:
        if chosen := [ride for ride in rides if ride.mount == mount]:
            print(_of_mount(mount, chosen))


if __name__ == "__main__":
    main(*sys.argv[1:])
