"""Two-position alignment: truth recovered from simulated poses, refusals, all mountings."""

import itertools

import engines
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from test_rotation import random_rotation


def poses(vehicle_from_sensor, tilt_deg, side="left"):
    """Specific force in the sensor's axes on the kickstand and upright, g."""
    tilt = np.radians(tilt_deg) * (-1 if side == "left" else 1)  # lean > 0 is to the right
    kickstand = np.array([np.sin(tilt), np.cos(tilt), 0.0])
    return (vehicle_from_sensor.T @ kickstand).tolist(), (vehicle_from_sensor.T @ [0, 1, 0]).tolist()


def rotation_angle_deg(a, b):
    """Angle of the rotation between two matrices."""
    r = np.asarray(a).reshape(3, 3) @ np.asarray(b).reshape(3, 3).T
    skew = np.array([r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]])
    return np.degrees(np.arctan2(np.linalg.norm(skew) / 2, (np.trace(r) - 1) / 2))


def axis_aligned():
    """All 24 rotations that take axes to axes."""
    for order in itertools.permutations(range(3)):
        for signs in itertools.product((1, -1), repeat=3):
            m = np.zeros((3, 3))
            for row, (column, sign) in enumerate(zip(order, signs)):
                m[row, column] = sign
            if np.linalg.det(m) > 0:
                yield m


@pytest.mark.parametrize("engine", engines.ENGINES)
@pytest.mark.parametrize("side", ["left", "right"])
def test_every_mounting_is_recovered(engine, side):
    rng = np.random.default_rng(3)
    truths = [random_rotation(rng) for _ in range(100)] + list(axis_aligned())
    tilts = rng.uniform(5.1, 59, len(truths))
    calls = [("two_position", (*poses(m, t, side), side)) for m, t in zip(truths, tilts)]
    for truth, tilt, (got_tilt, got) in zip(truths, tilts, engines.run(engine, calls)):
        assert rotation_angle_deg(got, truth) < 1e-3
        assert got_tilt == pytest.approx(tilt, abs=1e-3)
        m = np.array(got).reshape(3, 3)
        assert_allclose(m @ m.T, np.eye(3), atol=3e-7)


@given(seed=st.integers(0, 2**32 - 1), tilt=st.floats(9, 50))
@settings(max_examples=100)
def test_turning_the_sensor_turns_the_matrix(seed, tilt):
    """Equivariance: with all samples turned by Q, R becomes R Q^T."""
    rng = np.random.default_rng(seed)
    mounting, q = random_rotation(rng), random_rotation(rng)
    kickstand, upright = (np.array(p) + rng.normal(scale=0.01, size=3) for p in poses(mounting, tilt))
    (_, plain), (_, turned) = engines.run(
        "cpython",
        [
            ("two_position", (kickstand.tolist(), upright.tolist(), "left")),
            ("two_position", ((q @ kickstand).tolist(), (q @ upright).tolist(), "left")),
        ],
    )
    assert rotation_angle_deg(turned, np.array(plain).reshape(3, 3) @ q.T) < 0.01


def test_the_wrong_side_turns_forward_into_backward():
    m = random_rotation(np.random.default_rng(4))
    _, got = engines.run("cpython", [("two_position", (*poses(m, 12, "right"), "left"))])[0]
    assert_allclose(np.array(got).reshape(3, 3), np.diag([-1, 1, -1]) @ m, atol=1e-6)


@pytest.mark.parametrize("engine", engines.ENGINES)
@pytest.mark.parametrize(
    ("kickstand", "upright", "reason"),
    [
        ([0, 1, 0], [0, 1, 0], "same"),
        ([0, 1, 0], [0, 0.99, 0.001], "same"),
        ([-np.sin(np.radians(4.9)), np.cos(np.radians(4.9)), 0], [0, 1, 0], "only 4.9"),
        ([-np.sin(np.radians(60.5)), np.cos(np.radians(60.5)), 0], [0, 1, 0], "no kickstand"),
        ([0, -1, 0], [0, 1, 0], "same"),
        ([0, 0, 0], [0, 1, 0], "kickstand reading is 0.000 g"),
        ([-0.2, 0.98, 0], [0, 1.3, 0], "upright reading is 1.300 g"),
        ([-2.0, 0.98, 0], [0, 1, 0], "kickstand reading"),
    ],
)
def test_poses_that_fix_nothing_are_refused(engine, kickstand, upright, reason):
    answer = engines.run(engine, [("two_position", (kickstand, upright, "left"))])[0]
    if kickstand == [0, -1, 0]:  # exactly antiparallel: upside down is no second pose
        reason = "no kickstand"
    assert reason in engines.words(answer)
    assert all(len(line) <= 16 for line in answer["lcd"])


def test_not_a_number_is_refused():
    answer = engines.firmware_calls.call("two_position", ([float("nan"), 1, 0], [0, 1, 0], "left"))
    assert "kickstand reading" in engines.words(answer)
