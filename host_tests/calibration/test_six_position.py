"""The six positions give offset and slope of the accelerometer. Impossible captures are refused."""

import numpy as np
import pytest
from kickstand.calibration import six_position
from kickstand.calibration.parameters import Calibration
from motions import SIDES, random_rotation, tipped
from numpy.testing import assert_allclose
from support import engines

IDENTITY = [1, 0, 0, 0, 1, 0, 0, 0, 1]
OFFSET, SLOPE, BIAS = [0.1, 0.2, 0.3], [1.1, 0.9, 1.0], [3.0, -2.0, 1.0]


def test_the_closed_form_is_equations_16_and_17():
    offset, slope = np.array([0.05, -0.02, 0.1]), np.array([1.02, 0.97, 1.05])
    assert_allclose(six_position.closed_form(((SIDES - offset) / slope).tolist()), [offset, slope], atol=1e-6)


@pytest.mark.parametrize("tilt_deg", [0, 10, 19])
def test_the_fit_needs_no_exact_poses(tilt_deg):
    """In poses tilted by 10 degrees the closed form has a lean error of 0.6 degrees, and the fit of about 0.1."""
    chance, errors_deg = np.random.default_rng(tilt_deg), []
    for _ in range(15):
        offset, slope = chance.uniform(-0.08, 0.08, 3), chance.uniform(0.97, 1.03, 3)
        forces = np.array([tipped(side, chance.uniform(0, tilt_deg), chance) for side in SIDES])
        readings = (forces - offset) / slope + chance.normal(scale=0.0003, size=(6, 3))
        found_offset, found_slope = map(np.array, six_position.fit(readings.tolist()))
        up = np.array([random_rotation(chance)[0] for _ in range(200)])
        calibrated = (up - offset) / slope * found_slope + found_offset
        cosine = np.sum(calibrated * up, axis=1) / np.linalg.norm(calibrated, axis=1)
        errors_deg.append(np.degrees(np.max(np.arccos(np.clip(cosine, -1, 1)))))
    assert np.median(errors_deg) < 0.1
    assert max(errors_deg) < 0.25


def changed(row, reading):
    readings = SIDES.copy()
    readings[row] = reading
    return readings


@pytest.mark.parametrize(
    ("readings", "reason"),
    [
        (changed(0, SIDES[1]), "axis x barely changes"),
        (SIDES + [0.6, 0, 0], "axis x: offset"),
        (changed(2, tipped(SIDES[2], 25, np.random.default_rng(1))), "side +y was 25 degrees off"),
    ],
)
def test_impossible_captures_are_refused(readings, reason):
    answer = engines.firmware_calls.call("fit", (readings.tolist(),))
    assert reason in engines.words(answer)
    assert all(len(line) <= 16 for line in answer["lcd"])


def test_the_result_of_the_six_positions_and_of_an_alignment():
    six = six_position.six_position_calibration(OFFSET, SLOPE, BIAS)
    assert six.parameters() == pytest.approx([*OFFSET, *SLOPE, *BIAS, *IDENTITY, 0.0], abs=1e-6)
    assert (six.six_done, six.aligned, six.by_drive) == (True, False, False)
    aligned = six.with_alignment(range(9), [7.0, 8.0, 9.0], 1.5, True)
    assert aligned.parameters() == pytest.approx([*OFFSET, *SLOPE, 7, 8, 9, *range(9), 1.5])
    assert (aligned.six_done, aligned.aligned, aligned.by_drive) == (True, True, True)
    assert six.parameters()[6:9] == BIAS
    plain = Calibration().with_alignment(range(9), [0.0] * 3)
    assert (plain.six_done, plain.by_drive, plain.trim_deg) == (False, False, 0.0)


def test_counts_become_g_and_degrees_per_second():
    """A sensor with 4096 counts per g and 65.5 counts per deg/s."""
    numbers = [0.25, -0.125, 0.5, 1.125, 0.875, 1.0, 3.5, -2.5, 1.5, *IDENTITY, 2.5]
    calibration = Calibration()
    calibration.set_scale(4096, 65.5)
    calibration.set_parameters(numbers)
    assert calibration.parameters() == numbers
    force, rate = [0.0] * 3, [0.0] * 3
    calibration.apply([4096, -4096, 2048, -521, 655, -6550, 1310], force, rate)
    assert force == pytest.approx([1.375, -1.0, 1.0])
    assert rate == pytest.approx([6.5, -97.5, 18.5])
