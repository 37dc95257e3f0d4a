"""Rates in rad/s are remarked on, those in deg/s never are."""

import analysis_rides
import command
import numpy as np
import pytest
from kickstand_tools.logs.axes.bends import Bends
from kickstand_tools.logs.reader import read_log
from kickstand_tools.refusals import sentence
from kickstand_tools.simulation.files import simulate
from kickstand_tools.simulation.profiles import PROFILES
from kickstand_tools.simulation.scripted import script
from kickstand_tools.simulation.scripted.sensor_errors import random_mounting


def said(unit):
    notice = unit.notice()
    return sentence(notice) if notice else ""


def judged(log, scale=1.0, block=5000):
    """What is said of a whole log, its rates made smaller."""
    time, force, rate = log.t_s, log.accel_g, scale * log.gyro_dps
    unit = Bends()
    for k in range(0, len(time), block):
        unit.add(time[k : k + block], force[k : k + block], rate[k : k + block], log.speed_mps[k : k + block])
    return said(unit)


@pytest.mark.parametrize("profile", PROFILES)
def test_simulated_rides(tmp_path, profile):
    simulate(profile, 5, tmp_path, 300.0)
    log = read_log(tmp_path / "RIDE.csv")
    assert judged(log) == ""
    assert ("are they in rad/s?" in judged(log, np.radians(1.0))) is (profile != "parked")


def test_a_short_ride_tells_it_too(tmp_path):
    simulate("city", 9, tmp_path, 120.0)
    log = read_log(tmp_path / "RIDE.csv")
    assert "are they in rad/s?" in judged(log, np.radians(1.0))
    assert "the gyro of the opposite sign" in judged(log, -1.0)


TURN = np.reshape(random_mounting(3), (3, 3))


def straight_on(time, forward, up):
    """What is said of a vehicle that hardly turns at all."""
    force = np.column_stack((0.05 * np.sin(0.3 * time), up * np.ones(len(time)), forward)) @ TURN
    unit = Bends()
    rate = 0.01 * np.column_stack((np.cos(time), np.sin(time), time % 1.0)) @ TURN
    unit.add(time, force, rate, np.full(len(time), np.nan))
    return said(unit)


@pytest.mark.parametrize("slope", [0.2, 0.0, -0.2])
def test_braking_and_dips_are_no_bends(slope):
    """However hard, uphill and downhill, where the force is usually a little forward or back."""
    time = np.arange(0.0, 300.0, 0.02)
    brake = np.where(time % 20.0 < 5.0, -0.9, 0.0)
    assert straight_on(time, slope + brake, 1.0 + 0.1 * np.sin(time)) == ""


@pytest.mark.parametrize("name", ["replay", "report", "plot", "export"])
def test_the_commands_say_so_in_one_line(tmp_path, name):
    """The work is done all the same."""
    bends = [bend for side in (-1, 1, -1) for bend in (script.turn(35 * side, 5), script.straight(2))]
    ride = analysis_rides.write(tmp_path, [script.upright(4), script.accelerate(15, 5), *bends, script.straight(20)])
    table = np.loadtxt(ride, delimiter=",", skiprows=1)
    more = {"replay": ("--calibration", tmp_path / "RIDE.cal.json", "--out", tmp_path / "LEAN.csv")}
    more |= {"plot": ("--out", tmp_path), "export": ("--to", "csv", "--out", tmp_path / "ride.csv")}
    assert command.works(name, ride, *more.get(name, ())).err == ""
    table[:, 4:] = np.radians(table[:, 4:])
    command.write(ride, table)
    said = command.works(name, ride, *more.get(name, ())).err
    assert said.startswith(f"warning: {ride}: in bends the rates are those of ")
    assert said.count("\n") == 1
    assert said.endswith(" m/s: are they in rad/s? deg/s are needed\n")


def test_recordings(shared_data):
    """Those of cars do not tell it, the motorcycle's does."""
    for path in shared_data.glob("*.csv.gz"):
        log = read_log(path)
        assert judged(log) == "", path
        assert bool(judged(log, np.radians(1.0))) is path.name.startswith("motorcycle"), path
