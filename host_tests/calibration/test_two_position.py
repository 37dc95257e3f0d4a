"""The alignment by two poses finds the true mount for any mounting. Unusable poses are refused."""

import numpy as np
import pytest
from kickstand.calibration.parameters import Calibration
from kickstand.calibration.poses import align
from kickstand.errors import Refusal
from kickstand_sim.simulation.ride import random_rotation
from motions import leaned
from numpy.testing import assert_allclose
from support import engines


class Pose:
    """A finished pose with the interface of StillPose. accel: mean force in g. gyro: mean rate in deg/s."""

    def __init__(self, accel, gyro=(0.0, 0.0, 0.0)):
        self.accel, self.gyro = list(accel), list(gyro)


def poses(mounting, tilt_deg, side="left"):
    """Return the specific force on the kickstand and upright, in g, in the sensor's axes."""
    return mounting.T @ leaned(tilt_deg if side == "right" else -tilt_deg), mounting.T @ leaned(0.0)


def aligned_by(forces, side, calibration=None):
    """Return the calibration aligned by the forces of two poses, and the tilt between them."""
    kickstand, upright = map(Pose, forces)
    return align(calibration or Calibration(), kickstand, upright, side)


@pytest.mark.parametrize("side", ["left", "right"])
def test_every_mounting_is_recovered(side):
    chance = np.random.default_rng(3)
    for _ in range(40):
        mounting, tilt_deg = random_rotation(chance), chance.uniform(5.1, 59.0)
        aligned, tilt = aligned_by(poses(mounting, tilt_deg, side), side)
        assert_allclose(np.reshape(aligned.vehicle_from_sensor, (3, 3)), mounting, atol=2e-5)
        assert tilt == pytest.approx(tilt_deg, abs=1e-3)


@pytest.mark.parametrize(
    ("kickstand", "upright", "reason"),
    [
        ([0, 1, 0], [0, 1, 0], "same"),
        ([0, 1, 0], [0, 0.99, 0.001], "same"),
        (leaned(-4.9).tolist(), [0, 1, 0], "only 4.9"),
        (leaned(-60.5).tolist(), [0, 1, 0], "no kickstand"),
        ([0, -1, 0], [0, 1, 0], "no kickstand"),
        ([0, 0, 0], [0, 1, 0], "kickstand reading is 0.000 g"),
        ([float("nan"), 1, 0], [0, 1, 0], "kickstand reading"),
        ([-0.2, 0.98, 0], [0, 1.3, 0], "upright reading is 1.300 g"),
    ],
)
def test_poses_that_fix_nothing_are_refused(kickstand, upright, reason):
    answer = engines.firmware_calls.call("two_position", (kickstand, upright, "left"))
    assert reason in engines.words(answer)
    assert all(len(line) <= 16 for line in answer["lcd"])


@pytest.mark.parametrize("spoilt", [0, 1])
@pytest.mark.parametrize("size", [0.9, 1.1])
def test_after_the_six_positions_a_pose_reads_1_g_more_closely(spoilt, size):
    """Before, the data sheet allows an offset of 80 mg and a scale error of 3 %. After, only drift is left."""
    forces = np.array([leaned(-12), leaned(0)])
    forces[spoilt] *= size
    calibration = Calibration()
    aligned_by(forces, "left", calibration)
    calibration.six_done = True
    with pytest.raises(Refusal) as refusal:
        aligned_by(forces, "left", calibration)
    assert refusal.value.values[0] == ("kickstand", "upright")[spoilt]


def test_an_alignment_keeps_offset_and_slope_and_sets_the_bias():
    """The bias is from the kickstand pose, because a bike moves less on its stand than under a rider."""
    offset, slope = [0.05, -0.02, 0.0], [1.02, 0.98, 1.0]
    earlier = Calibration()
    earlier.set_accel(offset, slope)
    earlier.six_done = True
    earlier.gyro_bias[0], earlier.trim_deg = 9.0, 1.5
    kickstand, upright = (
        Pose((force - offset) / slope, gyro)
        for force, gyro in ((leaned(-12), [1.0, -2.0, 0.5]), (leaned(0), [1.5, 0, 0]))
    )
    aligned, tilt = align(earlier, kickstand, upright, "left")
    assert tilt == pytest.approx(12.0, abs=1e-4)
    assert aligned.parameters() == pytest.approx([*offset, *slope, 1.0, -2.0, 0.5, *np.eye(3).ravel(), 0.0], abs=1e-6)
    assert (aligned.aligned, aligned.six_done, aligned.by_drive) == (True, True, False)
    assert not earlier.aligned
