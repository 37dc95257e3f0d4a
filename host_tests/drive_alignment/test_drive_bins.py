"""A log that numpy sums in bins gives the same alignment as its single samples on the board."""

from array import array

import numpy as np
import pytest
from kickstand.drive_alignment.alignment import DriveAlignment
from kickstand.drive_alignment.history import BIN_US
from kickstand_tools.calibration.drive import fit_logs
from kickstand_tools.calibration.drive_feed import Steps, drive_bins
from kickstand_tools.calibration.file import CalibrationFile
from kickstand_tools.logs.log import Log
from kickstand_tools.simulation.scripted.sensor_errors import random_mounting
from support import driving_runs

CALIBRATION = CalibrationFile(accel_offset_g=np.array([0.02, -0.01, 0.03]), accel_slope=np.array([1.01, 0.99, 1.0]))


def drive(rate_hz=100, every_s=0.5, events=7, seed=5, before=()):
    """Simulate a drive as a Log with uneven sample times.

    rate_hz: number of samples per second.
    every_s: approximate time between two speeds. The speeds come at different places within the bins.
    events: number of braking events.
    before: legs that are driven before these events.
    """
    mount = np.reshape(random_mounting(seed), (3, 3))
    made = list(driving_runs.samples([*before, *driving_runs.around(events)], tilt_deg=1.0))[:: 100 // rate_hz]
    n = len(made)
    t_s = np.arange(n) / rate_hz + np.random.default_rng(seed).uniform(0.0, 0.3 / rate_hz, n)
    speed = np.full(n, np.nan)
    shown = np.arange(3, n, round(every_s * rate_hz) + 1)
    speed[shown] = [made[k][2] for k in shown]
    force, rate = (np.array([row[k] for row in made]) @ mount for k in (0, 1))
    return Log(t_s, force, rate + [0.5, -1.0, 0.3], speed)


def as_on_the_board(log, bias):
    """Pass each sample to a DriveAlignment as on the board. Return its matrix and the DriveAlignment."""
    alignment, firmware = DriveAlignment("car", None, bias), CALIBRATION.to_firmware()
    force, rate, previous = [0.0] * 3, [0.0] * 3, 0
    for now, reading, speed in log.rows():
        firmware.apply(reading, force, rate)
        alignment.update(force, rate, now - previous)
        previous = now
        if speed == speed:
            alignment.measure_speed(speed)
    alignment.finish()
    matrix = array("f", [0.0] * 9)
    alignment.matrix(matrix)
    return np.reshape(matrix, (3, 3)), alignment


def apart_deg(one, other):
    return np.degrees(np.linalg.norm(one - other) / np.sqrt(2.0))


@pytest.mark.parametrize(("rate_hz", "every_s", "gap"), [(100, 0.5, False), (50, 0.2, False), (100, 1.0, True)])
def test_bins_give_the_board_s_matrix(rate_hz, every_s, gap):
    log = drive(rate_hz, every_s, events=7 + 2 * gap)
    if gap:
        kept = (log.t_s < 70.0) | (log.t_s > 71.3)
        log = log.part(kept)
    found = fit_logs([log], CALIBRATION, "car")
    bias = (found.calibration.gyro_bias_dps - CALIBRATION.gyro_bias_dps).tolist()
    matrix, board = as_on_the_board(log, bias)
    assert apart_deg(found.calibration.vehicle_from_sensor, matrix) < 0.05
    assert (found.used, found.turned, found.stops) == (board.counted, board.turned, board.standing.stops)
    assert found.quality_deg == pytest.approx(board.quality_deg, abs=0.02)
    assert found.used >= 5


def test_bins_hold_every_sample_and_every_speed_once():
    log = drive(events=2)
    log = log.part((log.t_s < 9.02) | (log.t_s > 10.0))
    parts = list(drive_bins(log, CalibrationFile(), BIN_US))
    assert sum(part.samples for part in parts) == len(log.t_s)
    speeds = [
        mps
        for part in parts
        for mps in [part.start_mps, *(mps for _, mps in part.speeds), part.end_mps]
        if mps is not None
    ]
    assert speeds == log.speed_mps[~np.isnan(log.speed_mps)].tolist()
    assert [part.begins for part in parts].count(True) == 2
    whole = [part for part in parts if part.last_us]
    assert all(BIN_US <= part.first_us + part.last_us < BIN_US + 20_000 for part in whole)
    force = sum(np.array(part.force) * (part.first_us + part.last_us) for part in parts)
    step_us = np.diff(log.time_us, prepend=0)
    expected = np.sum((log.accel_g * np.where(step_us > 500_000, 0, step_us)[:, None]), axis=0)
    assert force == pytest.approx(expected, rel=1e-9)


def test_a_refusal_is_in_the_result_with_its_counts():
    log = drive(events=3)
    found = fit_logs([log], CALIBRATION, "car")
    assert (found.status, found.reason) == ("refused", "few-events")
    assert found.stops == 1 and 0 < found.used < 5
    assert found.calibration is CALIBRATION


def test_another_slope_in_the_next_log_is_no_moved_mount():
    """The vehicle is parked at the end of the first log on one slope, and at the beginning of the second log on the
    opposite slope. Each slope is 4.5 degrees."""
    mount = np.reshape(random_mounting(5), (3, 3))
    logs = []
    for slope_deg, first in ((-4.5, False), (4.5, True)):
        log = drive(events=6, before=[driving_runs.STAND])
        at = log.t_s < 12.0 if first else log.t_s > log.t_s[-1] - 12.0
        standing_g = np.array([0.0, np.cos(np.radians(slope_deg)), np.sin(np.radians(slope_deg))]) @ mount
        noise_g = np.random.default_rng(1).normal(0.0, 0.002, log.accel_g.shape)
        log.accel_g = np.where(at[:, None], standing_g + noise_g, log.accel_g)
        if not first:  # in the second log the simulated drive ends before the vehicle stands
            log.gyro_dps = np.where(at[:, None], [0.5, -1.0, 0.3], log.gyro_dps)
            log.speed_mps = np.where(at & ~np.isnan(log.speed_mps), 0.0, log.speed_mps)
        logs.append(log)
    assert fit_logs(logs, None, "car").reason != "mount-moved"


def test_bins_have_their_speeds_where_they_came():
    """The log has 100 samples per second, and a bin is 50 ms long. Speeds come at a bin's first sample, in its middle
    and at its end, and after a gap of 2 s. The age of a speed in the middle is counted from the second-to-last sample
    of the bin."""
    t_s = np.append(np.arange(11), np.arange(210, 216)) / 100.0
    speed = np.full(17, np.nan)
    speed[[0, 2, 5, 7, 11]] = [10.0, 10.2, 10.5, 10.7, 11.0]
    force = np.tile([0.0, 1.0, 0.0], (17, 1))
    force[6:11, 2] = 0.5
    bins = list(drive_bins(Log(t_s, force, np.zeros((17, 3)), speed), CalibrationFile(), 50_000))
    assert [(one.begins, one.samples, one.first_us, one.last_us, one.end_us) for one in bins] == [
        (True, 6, 40_000, 10_000, 50_000),
        (False, 5, 40_000, 10_000, 100_000),
        (True, 6, 40_000, 10_000, 2_150_000),
    ]
    assert [(one.start_mps, one.speeds, one.end_mps) for one in bins] == [
        (10.0, [(20_000, 10.2)], 10.5),
        (None, [(20_000, 10.7)], None),
        (11.0, [], None),
    ]
    assert bins[0].force == pytest.approx([0.0, 1.0, 0.0])
    assert bins[1].force == pytest.approx([0.0, 1.0, 0.5])


def test_progress_is_told_every_thousand_samples_and_at_the_end():
    said = []
    steps = Steps(lambda done, total: said.append((done, total)), 2300)
    for samples in (999, 1, 999, 2, 299):
        steps.more(samples)
    assert said == [(1000, 2300), (2001, 2300), (2300, 2300)]
    Steps(None, 5).more(5)
