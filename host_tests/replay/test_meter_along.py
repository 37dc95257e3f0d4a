"""The commands replay, report and plot use a fast loop. For each sample the loop gives the result of the firmware's
meter. LEAN.csv contains exactly these results."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from kickstand_tools.checks.log import check_log
from kickstand_tools.logs.reader import read_log, write_log
from kickstand_tools.replay import replay, replay_engine
from kickstand_tools.replay.replay import MeterAlong
from kickstand_workshop.evaluation import smoothed_rides

# Two columns that numpy computes. The arc functions of numpy may differ in the last digit of a double.
BY_NUMPY = ("lean_formula_deg", "static_lean_deg")


@pytest.fixture(scope="module")
def ride_and_calibration():
    """Return a ride with a speed in some samples, a short gap, a long gap, and frozen readings."""
    ride = smoothed_rides.simulated("street", 3, 40.0)
    log, n = ride.log, len(ride.log.t_s)
    t_s, accel_g, gyro_dps = log.t_s.copy(), log.accel_g.copy(), log.gyro_dps.copy()
    t_s[n // 3 :] += 0.3
    t_s[n // 2 :] += 2.0
    accel_g[2 * n // 3 :][:600], gyro_dps[2 * n // 3 :][:600] = accel_g[2 * n // 3], gyro_dps[2 * n // 3]
    speed = np.where(np.arange(n) % 200 == 7, 14.0, np.nan)
    speed[7::800] = 0.0
    calibration = replace(ride.calibration, trim_deg=0.5, gyro_delay_s=0.002)
    return replace(log, t_s=t_s, accel_g=accel_g, gyro_dps=gyro_dps, speed_mps=speed), calibration


def by_steps(log, calibration):
    """Return the results of the loop that MicroPython runs, shape (n, number of COLUMNS).

    Rows with frozen readings are NaN.
    """
    engine = replay_engine.Replay(calibration.to_firmware(), calibration.delay_s())
    measured = check_log(log).measured
    rows = np.full((len(log.t_s), len(replay_engine.COLUMNS)), np.nan)
    rows[measured] = [engine.step(*row) for row in log.part(measured).rows()]
    return rows


def test_fast_loop_equals_the_meter_for_each_sample(ride_and_calibration):
    log, calibration = ride_and_calibration
    selected = check_log(log).measured
    measured, along = log.part(selected), MeterAlong(calibration)
    assert 0 < len(measured.t_s) < len(log.t_s)
    cuts = [0, 1, 1, 700, 5000, len(measured.t_s)]  # limits of the parts, one of which is empty
    parts = [along.columns(measured.part(slice(a, b))) for a, b in pairwise(cuts)]
    fast, slow = np.concatenate(parts), by_steps(log, calibration)[selected]
    is_shown = fast[:, -1] != replay_engine.NOT_SHOWN
    assert 0.2 < np.mean(is_shown) < 0.999
    for name, mine, meters in zip(replay_engine.COLUMNS, fast.T, slow.T, strict=True):
        if name in BY_NUMPY:
            assert np.max(np.abs(mine - meters)) < 1e-9, name
        else:
            assert np.array_equal(mine, meters), name


def test_lean_file_has_values_as_python_writes_them(ride_and_calibration, tmp_path):
    log, calibration = ride_and_calibration
    write_log(tmp_path / "log.csv", log)
    count, _ = replay.replay_to_csv(tmp_path / "log.csv", calibration, "cpython", tmp_path / "LEAN.csv")
    rows = by_steps(read_log(tmp_path / "log.csv"), calibration)
    rows[rows[:, -1] < 0.0, -1] = np.nan
    header, *lines = (tmp_path / "LEAN.csv").read_text().splitlines()
    assert header == ",".join(("t_s", *replay_engine.COLUMNS))
    times = [line.partition(",")[0] for line in (tmp_path / "log.csv").read_text().splitlines()[1:]]
    timed = zip(times, rows.tolist(), strict=True)
    assert lines == [",".join((time, *(f"{value:.5f}" for value in row))) for time, row in timed]
    assert count == len(lines)
