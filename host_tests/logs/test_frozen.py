"""Frozen readings are treated as a gap, not as a standstill. A quiet sensor at rest is not frozen."""

import numpy as np
import pytest
from kickstand_tools.api import Log, replay
from kickstand_tools.calibration.file import CalibrationFile
from kickstand_tools.checks.log import check_log, find_faulty, without_frozen
from kickstand_tools.common import installation
from kickstand_tools.common.messages import sentence
from kickstand_tools.logs.reader import read_log
from support import command
from support.recordings import analysis_rides

HZ = 100
REST = np.array([0.012, 0.985, 0.171, 0.4, -1.1, 0.2])  # reading at rest in g and deg/s, with a gyro's bias


def log_of(readings, hz=HZ) -> Log:
    return Log(np.arange(len(readings)) / hz, readings[:, :3], readings[:, 3:])


def frozen(log: Log):
    """Return the rows that are frozen, and the notices about them."""
    faulty, notices = find_faulty(log)
    return np.flatnonzero(faulty).tolist(), [sentence(n) for n in notices if n.code == "frozen-readings"]


def riding(seconds, seed=0, digits=5):
    """Return readings with vibration and bends. digits: number of decimals."""
    random, n = np.random.default_rng(seed), round(seconds * HZ)
    values = REST + random.normal(scale=[0.1, 0.1, 0.1, 4.0, 4.0, 4.0], size=(n, 6))
    return np.round(values + 0.2 * np.sin(np.arange(n) / HZ)[:, None], digits)


def resting(seconds, seed=0, noise=1.0, digits=5):
    """Return readings at rest. noise: factor on the noise of a phone's sensor, 1 mg and 0.03 deg/s."""
    scale = noise * np.array([0.001] * 3 + [0.03] * 3)
    return np.round(REST + np.random.default_rng(seed).normal(0.0, scale, (round(seconds * HZ), 6)), digits)


def test_a_freeze_is_marked_to_the_sample():
    readings = riding(8)
    readings[21], readings[300:500] = readings[20], readings[300]
    rows, (notice,) = frozen(log_of(readings))
    assert rows == list(range(301, 500))
    assert notice.startswith("the readings froze from 3.0 to 5.0 s: they are left out, and the lean filter restarts")


@pytest.mark.parametrize(("count", "hz", "marked"), [(50, 100, False), (51, 100, True), (9, 10, False), (10, 10, True)])
def test_half_a_second_and_ten_samples_are_frozen(count, hz, marked):
    readings = riding(2)
    readings[50 : 50 + count] = readings[50]
    assert frozen(log_of(readings, hz))[0] == (list(range(51, 50 + count)) if marked else [])


@pytest.mark.parametrize("digits", [5, 3, 1])
@pytest.mark.parametrize("noise", [1.0, 0.3])
def test_a_vehicle_at_rest_is_not_frozen(digits, noise):
    """The sensor is quiet and the engine is off. With only one decimal, most readings are the same."""
    idling = resting(1, 5, 30.0, digits)  # a running engine shakes the sensor
    readings = np.vstack((riding(5, 1, digits), idling, resting(20, 2, noise, digits), idling, riding(5, 3, digits)))
    assert frozen(log_of(readings)) == ([], [])
    assert digits != 1 or noise == 1.0 or not np.any(np.diff(readings[600:2600], axis=0))


def test_a_log_without_frozen_readings_has_gaps():
    readings = riding(8)
    complete = log_of(readings)
    assert without_frozen(complete) is complete
    readings[300:500] = readings[300]
    log = log_of(readings)
    shortened = without_frozen(log)
    assert len(shortened.t_s) == 601 and np.max(np.diff(shortened.t_s)) == pytest.approx(2.0)
    part = log.part(check_log(log).measured)
    assert part.time_us.tolist() == shortened.time_us.tolist()


def test_commands_report_frozen_readings(tmp_path):
    ride = analysis_rides.short(tmp_path, speed_hz=1)
    header, *rows = ride.read_text().splitlines()
    for k in range(1300, 1500):  # the samples of the first bend
        rows[k] = rows[k].partition(",")[0] + "," + ",".join(rows[1300].split(",")[1:7]) + ","
    ride.write_text("\n".join([header, *rows]) + "\n")
    out = tmp_path / "out.csv"
    words = f"warning: {ride}: the readings froze from 13.0 to 15.0 s: they are left out"
    assert words in command.works("replay", ride, "--out", out).err
    lean = analysis_rides.table(out)
    assert np.flatnonzero(np.isnan(lean["lean_deg"])).tolist() == list(range(1301, 1500))
    page = command.works("report", ride)
    assert words in page.err and "Readings frozen" in page.out
    command.works("export", ride, "--to", "csv", "--out", out)
    assert len(analysis_rides.table(out)) == len(rows) - 199
    command.refused(tmp_path, "report", ride, "--from", "13.5", "--to", "14.5", words="all readings are frozen")


@pytest.mark.parametrize("engine", ["cpython", "micropython"])
def test_every_engine_gets_frozen_readings_as_a_gap(engine):
    if engine == "micropython" and not installation.has_micropython():
        pytest.skip("no MicroPython for this system")
    readings = riding(6)
    readings[200:400] = readings[200]
    lean = replay(log_of(readings), CalibrationFile(aligned=True), engine).lean_deg
    assert np.flatnonzero(np.isnan(lean)).tolist() == list(range(201, 400))
    gap = replay(without_frozen(log_of(readings)), CalibrationFile(aligned=True)).lean_deg
    assert np.max(np.abs(lean[400:] - gap[201:])) < 0.02  # MicroPython computes with 32 bits, CPython with 64


def test_a_freeze_in_a_real_ride_is_found(shared_data):
    log = read_log(shared_data / "motorcycle-ride.csv.gz")
    assert not frozen(log)[0]
    log.accel_g[2000:3000], log.gyro_dps[2000:3000] = log.accel_g[2000], log.gyro_dps[2000]
    assert frozen(log)[0] == list(range(2001, 3000))
