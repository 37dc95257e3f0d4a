"""Tests the conversion of counts to g, the capture of a pose, and the fit of six positions."""

import numpy as np
import pytest
from kickstand.calibration import six_position
from kickstand.calibration.parameters import Calibration, six_position_calibration
from kickstand.errors import CalibrationError
from numpy.testing import assert_allclose
from numpy.typing import ArrayLike
from support import engines
from test_rotation import random_rotation

AXES = np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]], float)


def tipped(direction, angle_deg, rng):
    """Return the direction rotated by an angle about a random axis perpendicular to it."""
    across = np.cross(direction, rng.normal(size=3))
    across /= np.linalg.norm(across)
    return np.asarray(direction) * np.cos(np.radians(angle_deg)) + across * np.sin(np.radians(angle_deg))


def worst_lean_error_deg(offset, slope, true_offset, true_slope, rng):
    """Return the largest angle between true and calibrated gravity over random poses."""
    up = np.array([random_rotation(rng)[0] for _ in range(200)])
    got = (up - true_offset) / true_slope * slope + offset
    cosine = np.sum(got * up, axis=1) / np.linalg.norm(got, axis=1)
    return np.degrees(np.max(np.arccos(np.clip(cosine, -1, 1))))


@pytest.mark.parametrize("engine", engines.ENGINES)
def test_counts_become_g_and_degrees_per_second(engine):
    offset, slope, bias = [0.02, -0.03, 0.05], [0.98, 1.01, 1.03], [3.0, -12.0, 0.5]
    reading = [8000, -3000, 12, -521, 655, -6550, 1000]
    got = engines.run(engine, [("apply", (offset, slope, bias, 8192, 65.5, reading))])[0]
    want = [slope[i] * reading[i] / 8192 + offset[i] for i in range(3)]
    want += [reading[4 + i] / 65.5 - bias[i] for i in range(3)]
    assert_allclose(got, want, rtol=1e-6, atol=1e-5)


@pytest.mark.parametrize("engine", engines.ENGINES)
def test_closed_form_is_equations_16_and_17(engine):
    offset, slope = np.array([0.05, -0.02, 0.1]), np.array([1.02, 0.97, 1.05])
    readings = ((AXES - offset) / slope).tolist()
    got = engines.run(engine, [("closed_form", (readings,))])[0]
    assert_allclose(got, [offset, slope], atol=1e-6)


@pytest.mark.parametrize("engine", engines.ENGINES)
@pytest.mark.parametrize("tilt", [0, 10, 19])
def test_the_fit_needs_no_exact_poses(engine, tilt):
    """If the poses are tilted by 10 degrees, the closed form has a lean error of 0.6 degrees. The error of the fit
    stays near 0.1 degrees."""
    rng = np.random.default_rng(tilt)
    calls, truths = [], []
    for _ in range(15):
        offset, slope = rng.uniform(-0.08, 0.08, 3), rng.uniform(0.97, 1.03, 3)
        forces = np.array([tipped(axis, rng.uniform(0, tilt), rng) for axis in AXES])
        readings = (forces - offset) / slope + rng.normal(scale=0.0003, size=(6, 3))
        calls.append(("fit", (readings.tolist(),)))
        truths.append((offset, slope))
    errors = [
        worst_lean_error_deg(np.array(got[0]), np.array(got[1]), true_offset, true_slope, rng)
        for got, (true_offset, true_slope) in zip(engines.run(engine, calls), truths)
    ]
    assert np.median(errors) < 0.1
    assert max(errors) < 0.25


@pytest.mark.parametrize("engine", engines.ENGINES)
def test_impossible_captures_are_refused(engine):
    dead = AXES.copy()
    dead[0] = dead[1]
    far = AXES + [0.6, 0, 0]
    off = AXES.copy()
    off[2] = tipped(AXES[2], 25, np.random.default_rng(1))
    answers = engines.run(engine, [("fit", (p.tolist(),)) for p in (dead, far, off)])
    for answer, reason in zip(answers, ("axis x barely changes", "axis x: offset", "side +y was 25 degrees off")):
        assert reason in engines.words(answer)
        assert all(len(line) <= 16 for line in answer["lcd"])


@pytest.mark.parametrize("engine", engines.ENGINES)
def test_the_free_pose_proves_the_fit(engine):
    pose = (np.array([1, 1, 1]) / np.sqrt(3)).tolist()
    good, bad = engines.run(
        engine, [("free_pose", ([0, 0, 0], [1, 1, 1], pose)), ("free_pose", ([0.05, 0, 0], [1, 1, 1], pose))]
    )
    assert good == pytest.approx(0, abs=1e-6)
    assert "reads 1.03" in engines.words(bad)


@pytest.mark.parametrize("engine", engines.ENGINES)
def test_every_side_is_found(engine):
    rng = np.random.default_rng(8)
    calls = [("side_of", (tipped(axis, 25, rng).tolist(),)) for axis in AXES]
    assert engines.run(engine, calls) == [0, 1, 2, 3, 4, 5]


def still(rng, count=300, accel=(0.1, 0.97, -0.2), gyro=(12.0, -3.0, 0.4)):
    """Return samples of a chip at rest as the driver gives them, with 8192 counts per g and 65.5 counts per deg/s.
    accel is in g, gyro in deg/s."""
    samples = np.zeros((count, 7))
    samples[:, 0:3] = np.array(accel) * 8192 + rng.normal(scale=27, size=(count, 3))
    samples[:, 3] = -3000 + rng.normal(scale=5, size=count)
    samples[:, 4:7] = np.array(gyro) * 65.5 + rng.normal(scale=5, size=(count, 3))
    return np.rint(samples).astype(int)


@pytest.mark.parametrize("engine", engines.ENGINES)
def test_a_still_pose_is_averaged(engine):
    samples = still(np.random.default_rng(9))
    accel, gyro = engines.run(engine, [("capture", (samples.tolist(),))])[0]
    assert_allclose(accel, samples[:, 0:3].mean(axis=0) / 8192, atol=1e-6)
    assert_allclose(gyro, samples[:, 4:7].mean(axis=0) / 65.5, atol=1e-5)


ALL = slice(None)


@pytest.mark.parametrize("engine", engines.ENGINES)
@pytest.mark.parametrize(
    ("rows", "column", "more", "reason"),
    [
        (150, 1, 900, "moved or knocked"),
        (ALL, 0, 250 * np.sin(np.arange(300)), "vibration"),
        # the pose tilts by one degree in three seconds
        (ALL, 0, np.linspace(0, 8192 * np.radians(1.0), 300), "slowly tilting"),
        (slice(100, 140), 5, 500, "moved or knocked"),
        (ALL, 2, 32767 + 1638, "saturated"),
        (ALL, 6, 50 * 65, "gyro offset"),
    ],
)
def test_a_pose_that_is_not_still_is_refused(engine, rows, column, more, reason):
    samples = still(np.random.default_rng(10))
    samples[rows, column] += np.asarray(more).astype(int)
    answer = engines.run(engine, [("capture", (np.minimum(samples, 32767).tolist(),))])[0]
    assert reason in engines.words(answer)
    assert all(len(line) <= 16 for line in answer["lcd"])


def readings(offset=(0.0,) * 3, slope=(1.0,) * 3, forces: ArrayLike = AXES):
    """Return the readings of an accelerometer with this offset and slope for these forces, in g."""
    return ((np.asarray(forces) - offset) / slope).tolist()


def test_six_poses_with_a_duplicate_give_no_parameters():
    """Two of the six poses are the same. The fit refuses the six poses, although each axis changes enough."""
    poses = AXES.copy()
    poses[0] = poses[2] = [0.9, 0.9, 0.0]
    with pytest.raises(CalibrationError) as refusal:
        six_position.fit(poses.tolist())
    assert refusal.value.code == "unclear"


def test_the_19_numbers_come_back_as_they_were():
    numbers = [0.25, -0.125, 0.5, 1.125, 0.875, 1.0, 3.5, -2.5, 1.5, *np.arange(9.0).tolist(), 2.5]
    new = Calibration()
    new.set_scale(4096, 65.5)
    new.set_parameters(numbers)
    assert new.parameters() == numbers
    assert_allclose(new.scales()[0], [1.125 / 4096, 0.875 / 4096, 1 / 4096])
    assert new.scales()[1] == 1 / 65.5
    assert_allclose(new.correct([1.0, -1.0, 0.5]), [1.375, -1.0, 1.0])


def test_the_result_of_the_six_positions():
    new = six_position_calibration([0.1, 0.2, 0.3], [1.1, 0.9, 1.0], [3.0, -2.0, 1.0])
    identity = [1, 0, 0, 0, 1, 0, 0, 0, 1]
    want = [0.1, 0.2, 0.3, 1.1, 0.9, 1.0, 3.0, -2.0, 1.0, *identity, 0.0]
    assert new.parameters() == pytest.approx(want, abs=1e-6)
    assert (new.six_done, new.aligned, new.by_drive) == (True, False, False)


def test_an_alignment_is_a_new_calibration():
    before = six_position_calibration([0.1, 0.2, 0.3], [1.1, 0.9, 1.0], [3.0, -2.0, 1.0])
    new = before.with_alignment(range(9), [7.0, 8.0, 9.0], 1.5, True)
    assert new.parameters() == pytest.approx([*before.parameters()[:6], 7, 8, 9, *range(9), 1.5])
    assert (new.six_done, new.aligned, new.by_drive) == (True, True, True)
    assert before.parameters()[6:9] == [3.0, -2.0, 1.0]
    plain = Calibration().with_alignment(range(9), [0.0] * 3)
    assert (plain.six_done, plain.by_drive, plain.trim_deg) == (False, False, 0.0)
