"""The prior of the parameters, and the hypotheses about mount and wind."""

import numpy as np
import pytest
from kickstand_tools.estimation import model as of
from kickstand_tools.estimation.model import Prior

PRIOR = Prior.of_pose(six_done=True)
PLACE = {int(index): k for k, index in enumerate(PRIOR.unknown)}  # the place of each estimated parameter


def test_six_positions_make_the_accelerometer_certain():
    """Without them, the data sheet's limits hold. Bikes differ in geometry, tyres and fork."""
    for six_done, sensor in ((True, [0.001, 0.003, 0.003, 0.004]), (False, [0.04, 0.04, 0.04, 0.015])):
        assert Prior.of_pose(six_done).sigma[[21, 22, 23, of.UP_SCALE]].tolist() == sensor
    assert np.degrees(PRIOR.sigma[of.ROTATION]) == pytest.approx([1.5, 5.0, 2.0])
    bike = [of.HEIGHT, of.AHEAD, of.TYRES, of.DELAY, of.DIVE]
    assert PRIOR.mean[bike].tolist() == [0.5, 0.6, 0.07, 0.4, 0.026]
    assert PRIOR.sigma[bike].tolist() == [0.3, 0.5, 0.06, 0.4, 0.035]


def test_a_measured_gyro_is_not_estimated_again():
    sigma = np.full((3, 3), 0.003)
    sigma[0, 0] = 0.05
    measured, unmeasured = Prior.of_pose(True, sigma).sigma[of.GYRO], Prior.of_pose(True, np.zeros((3, 3)))
    assert np.allclose(measured[1:], np.hypot(0.003, 0.002))
    assert measured[0] == unmeasured.sigma[of.GYRO][0] == 0.012


def test_a_pose_measures_the_sum_of_rotation_and_offset():
    """A pose cannot distinguish an offset of the accelerometer from a tilt. Without a pose, they are independent."""
    information = PRIOR.information(PRIOR.sigma)
    roll, left, pitch, forward = (PLACE[k] for k in (2, of.OFFSET.start, 0, of.OFFSET.stop - 1))
    tight = 1.0 / np.radians(2.0) ** 2
    assert information[roll, [roll, left]] == pytest.approx([tight, -tight])
    assert information[left, left] == pytest.approx(1e6 + tight)
    assert information[pitch, forward] == pytest.approx(1.0 / np.radians(1.5) ** 2)
    assert np.all(np.linalg.eigvalsh(information) > 0.0)
    free = Prior(PRIOR.mean, PRIOR.sigma, posed=False).information(PRIOR.sigma)
    assert free[roll, left] == 0.0 and free[left, left] == pytest.approx(1e6)
