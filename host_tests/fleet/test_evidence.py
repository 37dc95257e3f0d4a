"""The intervals of a drive show the directions level, forward and left. A force of 1 g along each direction is found as
1 g."""

import numpy as np
import pytest
from kickstand_fleet import evidence
from kickstand_fleet.simulation.vehicle import VehicleSensor, random_sensor
from kickstand_tools.logs.log import Log
from made_fleet import drive


def shown(log, kind="car", lag_s=0.3):
    whole = evidence.blocks([evidence.intervals(log, kind, lag_s, np.zeros(3))])
    return evidence.fits(np.sum(whole.square, axis=0), np.sum(whole.product, axis=0))


@pytest.mark.parametrize("every_s", [0.2, 1.6])
def test_one_g_stays_one_g_at_any_rate_of_the_speed(every_s):
    log, sensor = drive(41, every_s=every_s)
    found, varied = shown(log)
    level, forward, left = found[:3] @ sensor.mount.T
    assert level == pytest.approx([0.0, 1.0, 0.0], abs=0.05)
    assert forward == pytest.approx([0.0, 0.0, 1.0], abs=0.1)
    assert left == pytest.approx([1.0, 0.0, 0.0], abs=0.12)
    assert evidence.handedness(found, varied) == pytest.approx(1.0, abs=0.12)


def test_motorcycle_force_grows_along_its_up_in_turns():
    exact = VehicleSensor(random_sensor(np.random.default_rng(1)).mount, np.zeros(3), np.ones(3), np.zeros(3))
    log, sensor = drive(42, "motorcycle", sensor=exact)
    found, varied = shown(log, "motorcycle")
    level, forward, left = found[:3] @ sensor.mount.T
    assert np.linalg.norm(level) == pytest.approx(1.0, abs=0.003)
    assert forward == pytest.approx([0.0, 0.0, 1.0], abs=0.12)
    assert left == pytest.approx([0.0, 0.0, 0.0], abs=1e-6) and varied[1] == 0.0
    assert evidence.handedness(found, varied) == 0.0


def test_an_interval_with_samples_missing_is_left_out():
    log, _ = drive(41)
    there = (log.t_s < 50.2) | (log.t_s > 50.9)
    with_gap = Log(log.t_s[there], log.accel_g[there], log.gyro_dps[there], log.speed_mps[there], name="with a gap")
    whole, left = (evidence.intervals(one, "car", 0.0, np.zeros(3)) for one in (log, with_gap))
    assert len(left.t_s) < len(whole.t_s)
    assert not np.any((left.t_s > 50.2) & (left.t_s < 50.9))
