"""Frozen readings are treated as a gap, not as a standstill. A quiet sensor at rest is not frozen."""

import numpy as np
import pytest
from kickstand_tools.analysis import report
from kickstand_tools.api import Log, open_ride, overview, replay
from kickstand_tools.calibration import drive
from kickstand_tools.calibration.file import CalibrationFile
from kickstand_tools.common.messages import sentence
from kickstand_tools.logs import reader
from kickstand_tools.logs.frozen import FrozenFinder, without_frozen
from kickstand_tools.logs.reader import read_blocks
from support import command
from support.recordings import analysis_rides

HZ = 100
REST = np.array([0.012, 0.985, 0.171, 0.4, -1.1, 0.2])  # reading at rest in g and deg/s, with a gyro's bias


def log_of(readings, hz=HZ) -> Log:
    return Log(np.arange(len(readings)) / hz, readings[:, :3], readings[:, 3:])


def frozen(log: Log) -> np.ndarray:
    return np.concatenate([block.frozen for block in read_blocks(log)])


def riding(seconds, seed=0, digits=5):
    """Return readings with vibration and bends. digits: number of decimals."""
    chance = np.random.default_rng(seed)
    n = round(seconds * HZ)
    values = REST + chance.normal(scale=[0.1, 0.1, 0.1, 4.0, 4.0, 4.0], size=(n, 6))
    return np.round(values + 0.2 * np.sin(np.arange(n) / HZ)[:, None], digits)


def resting(seconds, seed=0, noise=1.0, digits=5):
    """Return readings at rest.

    noise: factor on the noise of a phone's sensor, 1 mg and 0.03 deg/s.
    digits: number of decimals.
    """
    chance = np.random.default_rng(seed)
    return np.round(REST + noise * chance.normal(scale=[0.001] * 3 + [0.03] * 3, size=(round(seconds * HZ), 6)), digits)


@pytest.mark.parametrize("blocks_of", [60_000, 130, 7])
def test_a_freeze_is_marked_to_the_sample(monkeypatch, blocks_of):
    monkeypatch.setattr(reader, "BLOCK_SAMPLES", blocks_of)
    readings = riding(8)
    readings[300:500] = readings[300]
    found = np.flatnonzero(frozen(log_of(readings)))
    # At the end of a block, the first frozen samples may count as normal readings.
    first = 301 if blocks_of == 60_000 else found[0]
    assert found.tolist() == list(range(first, 500))
    assert first < 360
    notices = []
    list(read_blocks(log_of(readings), notices=notices))
    (notice,) = notices
    assert sentence(notice).startswith("the readings froze from 3.")
    assert sentence(notice).endswith("to 5.0 s: they are left out, and the lean filter restarts after each")


def test_freezes_at_each_end_and_twice_are_marked():
    readings = riding(10)
    readings[:200], readings[400:500], readings[900:] = readings[0], readings[400], readings[900]
    found = np.flatnonzero(frozen(log_of(readings)))
    assert found.tolist() == [*range(1, 200), *range(401, 500), *range(901, 1000)]
    notices = []
    list(read_blocks(log_of(readings), notices=notices))
    assert "from 0.0 to 2.0 s and 2 times more, 4.0 s in all" in sentence(notices[0])


@pytest.mark.parametrize("digits", [5, 3, 1])
@pytest.mark.parametrize("noise", [1.0, 0.3])
def test_a_vehicle_at_rest_is_not_frozen(digits, noise):
    """The sensor is quiet and the engine is off. With only one decimal, most readings are the same."""
    idling = resting(1, 5, 30.0, digits)  # a running engine shakes the sensor
    readings = np.vstack((riding(5, 1, digits), idling, resting(20, 2, noise, digits), idling, riding(5, 3, digits)))
    same = np.all(np.diff(readings[600:2600], axis=0) == 0.0, axis=1)
    assert not np.any(frozen(log_of(readings)))
    if digits == 1 and noise < 1.0:
        assert np.all(same)


def test_constant_log_is_not_marked_as_frozen():
    """A completely frozen log has no normal readings to compare with. test_still_pose.py shows that such a pose is
    refused."""
    assert not np.any(frozen(log_of(np.tile(REST, (500, 1)))))


def test_log_without_frozen_readings_has_gaps():
    readings = riding(8)
    whole = log_of(readings)
    assert without_frozen(whole) is whole
    readings[300:500] = readings[300]
    left = without_frozen(log_of(readings))
    assert len(left.t_s) == 601
    assert np.max(np.diff(left.t_s)) == pytest.approx(2.0)


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
    said = command.works("report", ride)
    assert words in said.err and "Readings frozen" in said.out
    data = report.as_data(overview(open_ride(ride)))
    assert (data["frozen_s"], data["missing_s"]) == (pytest.approx(2.0, abs=0.05), pytest.approx(0.0, abs=0.05))
    assert words in command.works("export", ride, "--to", "csv", "--out", out).err
    assert len(analysis_rides.table(out)) == len(rows) - 199
    command.refused(tmp_path, "report", ride, "--from", "13.5", "--to", "14.5", words="all readings are frozen")


@pytest.mark.parametrize("engine", ["cpython", "micropython"])
def test_every_engine_gets_frozen_readings_as_a_gap(engine):
    from kickstand_tools.common import unix_port

    if engine == "micropython" and not unix_port.available():
        pytest.skip("no MicroPython for this system")
    readings = riding(6)
    readings[200:400] = readings[200]
    found = replay(log_of(readings), CalibrationFile(aligned=True), engine)
    assert np.flatnonzero(np.isnan(found.lean_deg)).tolist() == list(range(201, 400))
    gap = replay(without_frozen(log_of(readings)), CalibrationFile(aligned=True))
    # MicroPython computes the covariance with 32 bits, CPython with 64.
    assert np.max(np.abs(found.lean_deg[400:] - gap.lean_deg[201:])) < 0.02


def test_calibrate_drive_does_not_use_a_freeze_as_a_stop():
    readings = riding(60)
    readings[2000:4000] = readings[2000]
    log = log_of(readings)
    log.speed_mps[::100] = 12.0
    assert len(drive.usable(log, False).t_s) == 4001


def test_no_real_log_is_frozen_and_a_freeze_in_one_is_found(shared_data):
    for path in sorted(shared_data.glob("*.csv.gz")):
        log = reader.read_log(path)
        assert log.notices == []
        assert without_frozen(log) is log
    log = reader.read_log(shared_data / "motorcycle-ride.csv.gz")
    begin, end = np.searchsorted(log.t_s, [40.0, 60.0])
    log.accel_g[begin:end], log.gyro_dps[begin:end] = log.accel_g[begin], log.gyro_dps[begin]
    assert np.flatnonzero(frozen(log)).tolist() == list(range(begin + 1, end))


@pytest.mark.parametrize("digits", [5, 1])
def test_quiet_phone_in_a_ride_is_not_frozen(digits):
    readings = riding(30, 4, digits)
    readings[1000:2000] = readings[1000]
    assert np.count_nonzero(frozen(log_of(readings))) == 999


@pytest.mark.parametrize(("count", "marked"), [(9, 0), (10, 9), (11, 10)])
@pytest.mark.parametrize("block", [6, 24])
def test_ten_equal_readings_are_frozen_across_blocks(count, marked, block):
    """At two readings per second, ten equal readings count as frozen. If a freeze begins in an earlier block, only its
    readings in later blocks are marked."""
    readings = np.insert(riding(24 / HZ), 3, 20.0, axis=1)
    readings[4 : 4 + count] = readings[4]
    finder, found = FrozenFinder(), []
    for begin in range(0, 24, block):
        time_us = 500_000 * np.arange(begin, begin + block)
        found.append(finder.mark(time_us, readings[begin : begin + block]))
    where = np.flatnonzero(np.concatenate(found)).tolist()
    if block == 24:
        assert where == list(range(5, 5 + marked))
    else:
        assert where == (list(range(12, 4 + count)) if marked else [])


@pytest.mark.parametrize(("near_s", "marked"), [(0.2, True), (0.4, False)])
def test_the_adjacent_half_second_shows_if_rounding_hid_noise(near_s, marked):
    """Readings are rounded to 0.01 g. A mean within 0.025 g of the equal readings counts as near. In the half second
    before the equal readings, some readings are 0.1 g off, so the mean of this half second is 0.06 g or 0.02 g off."""
    readings = np.round(np.tile(REST, (400, 1)), 2)
    readings[:, 3:] = 0.0
    readings[:100, 0] += 0.1
    readings[100 - round(near_s * HZ) : 100, 0] -= 0.1
    readings[:100:2, 3] = 0.1
    readings[200:, 0] += 0.1
    readings[200::2, 0] += 0.01
    assert np.any(frozen(log_of(readings))) == marked
