"""The prior of the parameters, and the hypotheses about mount and wind."""

import numpy as np
import pytest
from kickstand_tools.estimation import unknowns as of
from kickstand_tools.estimation.hypotheses import ALL
from kickstand_tools.estimation.unknowns import Prior

PRIOR = Prior.of_pose(six_done=True)
PLACE = {int(index): k for k, index in enumerate(PRIOR.unknown)}  # the place of each estimated parameter


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


def test_hypotheses_are_three_mounts_times_three_winds():
    assert ALL.minus_two_log_prior.tolist() == [0.0, 8.0, 5.0, 1.0, 9.0, 6.0, 1.0, 9.0, 6.0]
    assert np.degrees(ALL.turning) == pytest.approx([0.05] * 6 + [0.11] * 3)
    assert np.degrees(ALL.rolling) == pytest.approx([0.05] * 3 + [0.11] * 6)
    assert ALL.pushed == pytest.approx([0.00052, 0.01047, 0.03142] * 3)
    first = ALL.first()
    assert first.weight.tolist() == [1.0] and first.pushed == pytest.approx([0.00052])
