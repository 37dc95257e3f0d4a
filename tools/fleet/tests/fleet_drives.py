"""Simulated fleets and single drives."""

import csv
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from kickstand_fleet.manifest import Period
from kickstand_fleet.period import work_on_period
from kickstand_fleet.simulation import fleet as simulated
from kickstand_fleet.simulation.drive import HANDLING, Receiver, drive_log, random_route, random_sensor
from kickstand_tools.logs.reader import write_log
from kickstand_tools.signals import rotation_matrix

# The fault of each vehicle, or "" for none. The vehicles are a car, a bus, a motorcycle, a car, and so on.
TROUBLES = ["", "", "", "moved-between", "garbage", "moved-within", "km/h", "dead", "late"]


@dataclass
class SimulatedFleet:
    directory: Path
    vehicles: list[simulated.MadeVehicle]
    truth: dict[str, dict[str, str]]

    @property
    def manifest(self):
        return self.directory / "MANIFEST.csv"

    def mount(self, vehicle):
        """Return the matrix (3, 3) from the sensor's axes to the vehicle's."""
        return np.reshape([float(self.truth[vehicle][name]) for name in simulated.MATRIX], (3, 3))


def simulate(directory, troubles=TROUBLES, seed=3, seconds=170.0):
    vehicles = simulated.make_fleet(directory, len(troubles), seed, seconds, 50.0, troubles)
    with (directory / "TRUTH.csv").open(newline="") as file:
        truth = {row["vehicle"]: row for row in csv.DictReader(file)}
    return SimulatedFleet(directory, vehicles, truth)


def drive(seed, kind="car", seconds=200.0, sensor=None, straight=True, **receiver):
    """Simulate one drive. Return its Log and its VehicleSensor. sensor: None for a random one."""
    chance = np.random.default_rng([seed, 5])
    sensor = sensor or random_sensor(chance)
    route = random_route(chance, HANDLING[kind], seconds, 50.0, straight)
    return drive_log(chance, kind, route, sensor, Receiver(**receiver), 1.79e9, None, f"drive {seed}"), sensor


def turn_of(degrees, axis):
    """Return the matrix of a rotation by this angle about an axis of any length."""
    return rotation_matrix(np.radians(degrees) * np.asarray(axis) / np.linalg.norm(axis))


def yaw_deg(computed, true):
    between = np.asarray(computed).reshape(3, 3) @ np.asarray(true).reshape(3, 3).T
    return float(np.degrees(np.arctan2(between[2, 0] - between[0, 2], between[0, 0] + between[2, 2])))


def result_of(directory, *logs, kind="car"):
    """Return the fleet's result for a vehicle with these logs."""
    paths = tuple(str(directory / f"{k}.csv") for k in range(1, 1 + len(logs)))
    for path, log in zip(paths, logs):
        write_log(path, log)
    return work_on_period(Period("v", "", kind, paths))
