"""A dead axis and a gyro at the end of its range are reported. The smoothed lean never hides these two faults."""

from dataclasses import replace

import numpy as np
import pytest
from kickstand_tools.analysis.overview import overview
from kickstand_tools.analysis.ride import open_ride
from kickstand_tools.api import Log, replay, smooth
from kickstand_tools.checks.log import NAMES, AxisDead, GyroSaturated, find_faulty
from kickstand_tools.common.messages import sentence
from kickstand_tools.signals import rotation_matrix
from kickstand_workshop.evaluation.smoothed_rides import rms, simulated


@pytest.fixture(scope="module")
def street():
    return simulated("street", 5, 100.0)


def ill(known, change):
    """Return a copy of the ride's log. The function change(time, force, rate) changes its forces and rates in place."""
    force, rate = known.log.accel_g.copy(), known.log.gyro_dps.copy()
    change(known.log.t_s, force, rate)
    return Log(known.log.t_s, force, rate, temperature_c=known.log.temperature_c)


@pytest.mark.parametrize("axis", range(6))
def test_a_dead_axis_is_named_and_has_no_lean(street, axis):
    def die(time, force, rate):
        (force if axis < 3 else rate)[time > 50.0, axis % 3] = 0.25

    log = ill(street, die)
    for lean in (smooth(log, street.calibration), replay(log, street.calibration)):
        (notice,) = (n for n in lean.notices if isinstance(n, AxisDead))
        assert notice.name == NAMES[axis]
        assert notice.begin_s == pytest.approx(50.0, abs=2.0)
        assert f"{NAMES[axis]} is dead" in sentence(notice)
        dead = (log.t_s > 52.0) & (log.t_s < 95.0)
        assert np.mean(np.isnan(lean.lean_deg[dead])) > 0.9


@pytest.mark.parametrize(("sensor", "begin_s"), [("gyro", -1.0), ("gyro", 50.0), ("accelerometer", 50.0)])
def test_a_sensor_dead_in_all_axes_is_named_and_left_out(street, sensor, begin_s):
    def die(time, force, rate):
        (force if sensor == "accelerometer" else rate)[time > begin_s] = (0.25, -0.5, 0.75)

    lean = replay(ill(street, die), street.calibration)
    names = [notice.values[0] for notice in lean.notices if notice.code == "axis-dead"]
    assert names == [name for name in NAMES if name.startswith(sensor)]
    assert np.mean(np.isnan(lean.lean_deg[(lean.t_s > max(2.0, begin_s + 2.0)) & (lean.t_s < 95.0)])) > 0.8


def test_an_accelerometer_that_clips_is_said(street):
    def clip(_, force, _rate):
        force[:, 1] = (force[:, 1] + np.random.default_rng(3).normal(size=len(force))).clip(-2.0, 2.0)

    (notice,) = (n for n in replay(ill(street, clip), street.calibration).notices if n.code == "accel-clipped")
    assert notice.values[:2] == ("y", 2.0)
    assert notice.values[2] >= 10
    assert "accelerometer y is at the end of its range (2.0 g)" in sentence(notice)


def test_a_bias_that_steps_is_said_by_replay_and_report(street):
    def drift(time, _force, rate):
        rate += 0.4 * np.maximum(0.0, time - 30.0)[:, None] * street.calibration.vehicle_from_sensor[2]

    log = ill(street, drift)
    ride_overview = overview(open_ride(log, street.calibration))
    for notices in (replay(log, street.calibration).notices, ride_overview.notices):
        (notice,) = (n for n in notices if n.code == "readings-misfit")
        assert notice.values[0] > 2.0
        assert notice.values[1] > 30.0
        assert "the readings repeatedly contradict each other" in sentence(notice)


def test_a_saturated_gyro_is_reported_and_the_rest_is_good(street):
    def saturate(time, force, rate):
        rate[(time > 60.0) & (time < 60.5), 1] = 500.0

    log = ill(street, saturate)
    lean = smooth(log, street.calibration)
    (notice,) = (n for n in lean.notices if isinstance(n, GyroSaturated))
    assert (notice.axis, notice.times) == ("y", 1)
    assert notice.seconds == pytest.approx(0.5, abs=0.02)
    is_judged = street.riding & (np.abs(log.t_s - 60.0) > 2.0)
    assert rms((lean.lean_deg - street.lean_deg)[is_judged]) < 0.4
    assert np.all(np.isnan(lean.lean_deg[(log.t_s > 60.01) & (log.t_s < 60.49)]))


@pytest.mark.parametrize("scale", [(1.0, 1.0, 0.5), (1.0, 0.5, 1.0)])
def test_a_gyro_of_half_the_scale_is_doubted(street, scale):
    about = street.calibration.vehicle_from_sensor
    log = replace(street.log, gyro_dps=street.log.gyro_dps @ about.T @ np.diag(scale) @ about)
    lean = smooth(log, street.calibration)
    assert "sensor-odd" in [notice.code for notice in lean.notices]
    off = np.abs(lean.lean_deg - street.lean_deg)[street.riding]
    assert np.mean(off < 3.0 * lean.lean_sigma_deg[street.riding]) > 0.8


def test_sound_sensors_are_not_called_ill(street):
    codes = {notice.code for notice in smooth(street.log, street.calibration).notices}
    assert not codes & {"axis-dead", "gyro-saturated", "accel-clipped", "sensor-odd"}
    assert not replay(street.log, street.calibration).notices


def test_rounding_and_a_standstill_are_no_dead_axis():
    """A log whose readings have few digits gets no remark. An ideal log without noise gets no remark either."""
    time = np.arange(4000) / 100.0
    turn = rotation_matrix(np.array([0.3, 0.1, 0.2]))
    force = np.round(np.tile(turn[1], (4000, 1)) + 0.002 * np.random.default_rng(1).normal(size=(4000, 3)), 2)
    rate = np.round(0.05 * np.random.default_rng(2).normal(size=(4000, 3)), 1)
    ideal = np.column_stack((np.sin(time), np.zeros_like(time), np.zeros_like(time)))
    for log in (Log(time, force, rate), Log(time, np.tile(turn[1], (4000, 1)), 10.0 * ideal)):
        faulty, notices = find_faulty(log)
        assert not np.any(faulty) and not notices
