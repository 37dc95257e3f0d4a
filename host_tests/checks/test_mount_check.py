"""A command warns if its calibration belongs to another mount. A command never warns about the calibration of the log's
own mount."""

import json
import re
from dataclasses import replace

import numpy as np
import pytest
from checked import bins_of, made_up, simulated, words
from kickstand_sim.simulation.profiles import PROFILES
from kickstand_sim.simulation.scripted import script
from kickstand_tools.calibration.file import CalibrationFile
from kickstand_tools.calibration.mount import ForwardOff, contradiction
from kickstand_tools.common.messages import sentence
from kickstand_tools.estimation.alignment import fit_ride
from kickstand_tools.logs.log import Log
from kickstand_tools.logs.reader import read_log
from kickstand_tools.signals import rotation_matrix
from kickstand_workshop.evaluation.runs import calibrated_by_poses
from support import command
from support.recordings import analysis_rides

G = 9.80665


def turned(matrix, left=0.0, up=0.0, forward=0.0):
    """Return the matrix of a mount that is rotated by these angles, in degrees, about the vehicle's axes."""
    about_left, about_up, about_forward = rotation_matrix(np.diag(np.radians([left, up, forward])))
    return about_forward @ about_up @ about_left @ matrix


def made(profile, speed=True):
    """Return a simulated log with 50 samples per second, and its calibration by six positions and two poses.

    speed: False for a log without a speed."""
    log = simulated(profile)
    return log if speed else silent(log), calibrated_by_poses(made_up(profile))


def silent(log):
    """Return the log without a speed."""
    return Log(log.t_s, log.accel_g, log.gyro_dps)


def other(calibration, vehicle="", **turns):
    matrix = turned(calibration.vehicle_from_sensor, **turns)
    return replace(calibration, vehicle_from_sensor=matrix, vehicle=vehicle, kickstand_side="")


def said(log, calibration):
    return words(contradiction(bins_of(log), calibration))


@pytest.mark.parametrize("profile", PROFILES)
def test_right_calibrations_are_never_reported(profile):
    log, calibration = made(profile)
    for variant in log, silent(log):
        assert said(variant, calibration) == ""
        assert said(variant, other(calibration, up=8.0)) == ""  # an alignment by two poses may have this error


@pytest.mark.parametrize(("profile", "speed"), [("street", True), ("city", False), ("track", False), ("hills", True)])
def test_wrong_calibrations_are_reported(profile, speed):
    log, calibration = made(profile, speed)
    by = "speed" if speed else "bends"
    for turns, line in (
        ({"up": 180.0}, "forward and backward are exchanged: calibrate two with the other --side?"),
        ({"up": 90.0}, f"by the {by} of this ride forward is "),
        ({"up": -30.0}, " so lean, braking and cornering are wrong: is it another mount's? Calibrate again: "),
        ({"left": 40.0}, "the calibration's up is "),
        ({"forward": 90.0, "up": 70.0}, "so nothing computed with it is right: is it another mount's? "),
    ):
        assert line in said(log, other(calibration, "", **turns)), turns
    for angle, side in (90.0, "left"), (-90.0, "right"):
        notice = contradiction(bins_of(log), other(calibration, up=angle))
        assert notice is not None and isinstance(notice, ForwardOff)
        assert (notice.angle_deg, notice.by, notice.car) == (pytest.approx(angle, abs=8.0), by, False)
        assert f" degrees to the {side} of the calibration's" in sentence(notice)
    upside_down = Log(log.t_s, -log.accel_g, log.gyro_dps, log.speed_mps)
    assert "do all accelerations have the opposite sign? At rest up reads +1 g" in said(upside_down, calibration)


def test_another_seeds_calibration(rides=("street", "sweeper", "city")):
    """The calibration belongs to another bike, whose sensor is mounted differently."""
    pairs = [made(profile) for profile in rides]
    for (log, _), (_, calibration) in zip(pairs, pairs[1:] + pairs[:1]):
        assert "is it another mount's?" in said(log, calibration)


def test_gaps():
    log, calibration = made("street")
    wrong = other(calibration, up=90.0)
    recorded = (log.t_s % 30.0) < 24.0
    gaps = log.part(recorded)
    assert said(gaps, calibration) == ""
    assert "by the speed of this ride forward is " in said(gaps, wrong)


def test_a_log_that_cannot_show_the_mount_gets_no_remark():
    log, calibration = made("street")
    assert said(log, CalibrationFile()) == ""  # an unaligned calibration gets another message
    assert said(log.part(log.t_s < 10.0), other(calibration, up=90.0)) == ""
    assert said(silent(log), other(calibration, "car", up=90.0)) == ""  # a car has no lean to compare


def test_the_commands_say_so_in_one_line(tmp_path):
    """The messages of report and plot are tested in analysis/test_report.py."""
    legs = [script.upright(4)]
    for side in (-1, 1, -1, 1):
        legs += [script.accelerate(15, 5), script.turn(30 * side, 5), script.straight(2), script.brake(5, 3)]
    path = analysis_rides.write(tmp_path, legs, speed_hz=1)
    cal = tmp_path / "wrong.json"
    cal.write_text(json.dumps(analysis_rides.CALIBRATION | {"vehicle_from_sensor": [[0, 0, 1], [0, 1, 0], [-1, 0, 0]]}))
    arguments = "replay", path, "--out", tmp_path / "out.csv"
    assert command.works(*arguments).err == ""
    line = command.works(*arguments, "--calibration", cal).err
    assert line.startswith(f"warning: {path}: by the speed of this ride forward is 9")
    assert line.count("\n") == 1


def test_recordings(shared_data):
    path = shared_data / "motorcycle-ride.csv.gz"
    log = read_log(path)
    calibration = fit_ride(log).calibration
    assert said(log, calibration) == ""
    found_by_bends = said(log, other(calibration, up=90.0))
    match = re.search(r"by the bends of this ride forward is (\d+) degrees to the left", found_by_bends)
    assert match and abs(int(match[1]) - 90) < 6
    assert "forward and backward are exchanged" in said(log, other(calibration, up=180.0))
    name = "car-urban-medium-turn-loop-nominal-001.csv.gz"
    rows = [[0.0473, 0.9987, 0.0204], [-0.0003, -0.0204, 0.9998], [0.9989, -0.0473, -0.0006]]
    car = CalibrationFile(vehicle_from_sensor=np.array(rows), aligned=True, vehicle="car")
    log = read_log(shared_data / name)
    assert said(log, car) == ""
    assert "so braking and cornering are wrong" in said(log, other(car, "car", up=90.0))
    assert "calibrate drive again?" in said(log, other(car, "car", up=180.0))


def jerky(late_s: int = 0, sign: float = 1.0, seconds: int = 240, mps2: float = 2.0) -> Log:
    """Return a log with 10 samples per second and a random acceleration along z in each second.

    late_s: delay of the speed, which comes at the beginning of each second.
    sign: -1 to reverse the force.
    seconds: length of the log.
    mps2: standard deviation of the accelerations.
    """
    chance = np.random.default_rng(5)
    pushes = chance.normal(scale=mps2, size=seconds)
    speed_at = 30.0 + np.concatenate(([0.0], np.cumsum(pushes)))
    time = np.arange(0.0, seconds, 0.1)
    second = np.floor(time + 1e-9).astype(int)
    force = sign * (pushes / G)[second]
    speed = np.full(len(time), np.nan)
    speed[::10] = speed_at[np.maximum(0, np.arange(seconds) - late_s)]
    readings = np.column_stack((0 * force, 0 * force + 1.0, force))
    return Log(time, readings, np.zeros(readings.shape), speed)


ALONG_Z = CalibrationFile(aligned=True, vehicle="car")


def exchanged(log: Log) -> bool:
    notice = contradiction(bins_of(log), ALONG_Z)
    assert notice is None or notice.code == "forward-exchanged"
    return notice is not None


@pytest.mark.parametrize(("late_s", "shown"), [(-1, False), (0, True), (1, True), (2, True), (3, False), (4, False)])
def test_a_speed_up_to_two_seconds_late_shows_forward(late_s, shown):
    """The acceleration changes at random every second, so force and speed are related only at the right delay. The
    check tries delays of 0 to 2 s."""
    assert exchanged(jerky(late_s, sign=-1.0)) is shown
    assert not exchanged(jerky(late_s))


def test_only_the_last_hour_counts():
    """In the first of two hours the force along forward is reversed, as if the sensor had been turned round."""
    earlier, later = jerky(sign=-1.0, seconds=3600, mps2=8.0), jerky(seconds=3600)
    later.speed_mps += earlier.speed_mps[-10] - later.speed_mps[0]
    force, speed = (np.concatenate((getattr(earlier, name), getattr(later, name))) for name in ("accel_g", "speed_mps"))
    time = np.arange(0.0, 7200.0, 0.1)
    assert not exchanged(Log(time, force, np.zeros(force.shape), speed))
    assert exchanged(earlier)


def test_of_several_speeds_in_a_second_the_first_counts():
    log = jerky(sign=-1.0)
    log.speed_mps[3::10] = 77.0
    assert exchanged(log)
