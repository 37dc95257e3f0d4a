"""Makes a random trip from power-on to power-off: motion of the bike, faults and presses."""

import random
from dataclasses import dataclass, field
from typing import Any

from kickstand_sim.simulation.scripted import script

SHORT_S, LONG_S = 0.15, 1.2
KICKSTAND_S, UPRIGHT_S = 14.0, 12.0  # time in each pose, long enough for an alignment through the menu
POSES_S = KICKSTAND_S + UPRIGHT_S + 2 * script.MOVE_S  # time of both poses
QUIET_S = 12.0  # least time from the end of a fault to the next fault
SENSOR, LCD = 0x68, 0x27

# Each kind of ride, with the ranges of lean (degrees), speed (m/s) and slope (degrees) of its manoeuvres
RIDES = {
    "street": ((10, 38), (8, 20), (0, 0)),
    "track": ((30, 52), (18, 35), (0, 0)),
    "hills": ((10, 35), (8, 18), (-8, 8)),
    "walking pace": ((0, 4), (1.5, 3.5), (-2, 2)),
}

# Each fault has a method of Faults, and a function that computes the method's arguments. The function gets the start,
# the duration and a source of random numbers
FAULTS: dict[str, tuple[str, Any]] = {
    "sensor unplugged": ("unplug_sensor", lambda at, s, r: (at, s)),
    "sensor not acknowledging": ("nack_for", lambda at, s, r: (SENSOR, at, s)),
    "sensor's bus held": ("timeout_for", lambda at, s, r: (SENSOR, at, s)),
    "sensor's SDA low": ("stuck_sda", lambda at, s, r: (at, r.randint(1, 9))),
    "sensor's supply dips": ("supply_dip", lambda at, s, r: (at, r.choice(("asleep", "frozen", "default_ranges")))),
    "sensor frozen": ("freeze", lambda at, s, r: (at, s)),
    "readings of zeros": ("all_zero", lambda at, s, r: (at, s)),
    "readings of ones": ("all_ones", lambda at, s, r: (at, s)),
    "FIFO overflows": ("busy", lambda at, s, r: (at, r.uniform(0.4, 2.5))),
    "board busy, again and again": ("busy", lambda at, s, r: (at, 0.45, int(s / 0.48) + 1)),
    "display unplugged": ("unplug_lcd", lambda at, s, r: (at, s)),
    "display not acknowledging": ("nack_for", lambda at, s, r: (LCD, at, s)),
    "display's SDA low": ("stuck_sda", lambda at, s, r: (at, r.randint(1, 9), True)),
    "display breaks off in a line": ("cut", lambda at, s, r: (LCD, at, r.randint(1, 60))),
    "display out of step": ("lcd_slip", lambda at, s, r: (at,)),
    "flash full": ("disk_full", lambda at, s, r: (at, s)),
    "wheel storm": ("wheel_storm", lambda at, s, r: (at, s, r.choice((3_000, 20_000, 50_000)))),
}
GPS_FAULTS = ("unplugged", "garbled", "void", "stuck")


@dataclass
class Trip:
    kind: str  # kind of the ride, a key of RIDES
    ride: script.Ride  # motion of the bike
    until_s: float  # time of the power cut
    presses: list[tuple[float, float]]  # start and duration of each press
    faults: list[tuple[str, float, float]] = field(default_factory=list)  # name, start and end of each fault
    # Method of Faults and its arguments, for each fault
    calls: list[tuple[str, tuple[Any, ...]]] = field(default_factory=list)
    gps_faults: list[list[Any]] = field(default_factory=list)  # faults of the GPS receiver, as for Gps
    # Number of bytes of the next calibration that are written before the power is cut. None if the power is not cut in
    # a save.
    cut_save: int | None = None


def make_trip(chance: random.Random, speed: str | None, aligned: bool) -> Trip:
    """Make a trip of some minutes.

    speed: The speed source, "gps", "wheel" or None.
    aligned: True if the bike is aligned. Then only some trips have an alignment, otherwise each begins with one.
    """
    kind = chance.choice(list(RIDES))
    ride = script.Ride(_manoeuvres(chance, kind), vibration_g=chance.uniform(0.01, 0.08))
    realigns = aligned and chance.random() < 0.3
    trip = Trip(kind, ride, ride.seconds, _presses(chance, ride, aligned, realigns))
    # Faults begin after the poses of an alignment
    _add_faults(trip, chance, chance.uniform(3, 20) if aligned and not realigns else POSES_S, speed == "wheel")
    if speed == "gps":
        start_s, name = chance.uniform(0, ride.seconds), chance.choice(GPS_FAULTS)
        trip.gps_faults.append([name, start_s, start_s + 20.0])
        trip.faults.append((f"GPS {name}", start_s, start_s + 20.0))
    if chance.random() >= 0.6:
        trip.until_s = chance.uniform(1.0, ride.seconds)  # the trip ends while the bike rides
    if aligned and chance.random() < 0.5:
        trip.cut_save = chance.randint(0, 150)
    return trip


def _presses(chance: random.Random, ride: script.Ride, aligned: bool, realigns: bool) -> list[tuple[float, float]]:
    """Return the presses that align the bike, and those during the ride."""
    presses: list[tuple[float, float]] = []
    if not aligned:
        presses += [(3.0, SHORT_S), (POSES_S - 6.0, SHORT_S)]
    elif realigns:  # the alignment is the first entry of the menu
        presses += [(2.0, LONG_S), (4.5, LONG_S), (7.0, SHORT_S), (POSES_S - 6.0, SHORT_S)]
    # Most trips have no presses during the ride, because a press leaves the page with the lean
    t_s = POSES_S + chance.uniform(5, 40) if chance.random() < 0.4 else ride.seconds
    while t_s < ride.seconds - 5.0:
        presses.append((t_s, chance.choice((SHORT_S, SHORT_S, SHORT_S, LONG_S))))
        t_s += chance.choice((1.0, 3.0, 20.0, 60.0))
    return presses


def _add_faults(trip: Trip, chance: random.Random, t_s: float, has_wheel: bool) -> None:
    """Add faults after t_s, with pauses of at least QUIET_S."""
    names = [name for name in FAULTS if name != "wheel storm" or has_wheel]
    while (t_s := t_s + QUIET_S + chance.expovariate(1 / 20)) < trip.ride.seconds - 10.0:
        name, for_s = chance.choice(names), chance.choice((0.05, 0.3, 1.0, 4.0))
        method, arguments = FAULTS[name]
        trip.calls.append((method, arguments(t_s, for_s, chance)))
        end_s = t_s + max(for_s, 2.5)
        trip.faults.append((name, t_s, end_s))
        t_s = end_s


def _manoeuvres(chance: random.Random, kind: str) -> list[tuple[script.Segment, ...]]:
    """Return the parts of a ride of this kind, for script.Ride. It begins with both poses."""
    leans, speeds, slopes = RIDES[kind]
    parts: list[tuple[script.Segment, ...]] = [script.kickstand(KICKSTAND_S)]
    parts.append(script.upright(UPRIGHT_S, chance.uniform(-1.0, 1.0)))
    for _ in range(chance.randint(1, 4)):
        parts.append(script.accelerate(chance.uniform(*speeds), chance.uniform(4, 8)))
        for _ in range(chance.randint(3, 8)):
            side = chance.choice((-1, 1))
            parts.append(script.straight(chance.uniform(1, 6), chance.uniform(*slopes)))
            parts.append(script.turn(side * chance.uniform(*leans), chance.uniform(2, 12), chance.uniform(1.2, 2.5)))
            if chance.random() < 0.3:
                parts.append(script.accelerate(chance.uniform(*speeds), chance.uniform(3, 6)))
        parts.append(script.straight(3.0, 0.0))
        parts.append(script.brake(0.0, chance.uniform(4, 8)))
        parts.append(script.wait(chance.choice((4.0, 15.0, 60.0))))
    return parts
