"""The equations of the smoothed lean, against motions whose readings follow from geometry."""

import numpy as np
import pytest
from kickstand_tools.smoothing import noise
from kickstand_tools.smoothing.derivatives import by_unknowns
from kickstand_tools.smoothing.equations import ROWS, motion_and_measurements
from kickstand_tools.smoothing.parameters import (
    AHEAD,
    BESIDE,
    BIAS_PER_C,
    CAMBER,
    FORWARD,
    HEIGHT,
    LEAN,
    LEFT,
    OFFSET,
    OFFSET_PER_C,
    PARAMETERS,
    PITCH,
    ROTATION,
    STATES,
    TYRES,
    UP,
    USUAL,
    known,
    sigma,
)
from kickstand_tools.smoothing.windows import Windows, windows_of

G = 9.80665


def one(rate, force, speed=np.nan, warm=0.0):
    """A window with these readings."""
    return Windows(
        np.array([0.0, 0.2]),
        np.array([rate]),
        np.array([force]),
        np.zeros(1),
        np.array([speed]),
        np.array([warm]),
        np.zeros(1, dtype=bool),
        np.zeros(1, dtype=int),
        np.array([0.1]),
        np.array([0.1]),
    )


def state(**values):
    found = np.zeros((1, STATES))
    for name, value in values.items():
        found[0, {"lean": LEAN, "pitch": PITCH, "left": LEFT, "up": UP, "forward": FORWARD}[name]] = value
    return found


@pytest.mark.parametrize("lean", [-0.9, 0.0, 0.6])
@pytest.mark.parametrize("yaw_rate", [-0.4, 0.5])
def test_a_steady_turn_stays_as_it_is(lean, yaw_rate):
    """Nicolae's (22) and (23): the force of a turn at any lean, balanced or not."""
    speed, s, c = 17.0, np.sin(lean), np.cos(lean)
    across = speed * yaw_rate / G
    windows = one([yaw_rate * s, yaw_rate * c, 0.0], [across * c + s, c - across * s, 0.0])
    motion, measured = motion_and_measurements(windows, state(lean=lean, forward=speed), np.zeros((1, PARAMETERS)))
    assert np.allclose(motion, 0.0, atol=1e-9)
    for row in (noise.SLIDING, noise.CLIMBING, noise.SLOPING):
        assert abs(measured[0, row]) < 1e-9


@pytest.mark.parametrize("pitch", [-0.1, 0.0, 0.15])
def test_at_rest_on_a_slope_and_braking_on_it(pitch):
    lean, braking = 0.2, -0.5
    force = np.array([np.cos(pitch) * np.sin(lean), np.cos(pitch) * np.cos(lean), np.sin(pitch)])
    motion, _ = motion_and_measurements(one([0.0] * 3, force), state(lean=lean, pitch=pitch), np.zeros((1, PARAMETERS)))
    assert np.allclose(motion, 0.0, atol=1e-9)
    level = np.array([-np.sin(lean) * np.sin(pitch), -np.cos(lean) * np.sin(pitch), np.cos(pitch)])
    windows = one([0.0] * 3, force + braking * level)
    motion, _ = motion_and_measurements(windows, state(lean=lean, pitch=pitch), np.zeros((1, PARAMETERS)))
    assert motion[0, FORWARD] == pytest.approx(braking * G)
    assert np.allclose(np.delete(motion[0], FORWARD), 0.0, atol=1e-9)


@pytest.mark.parametrize("lean", [-0.5, 0.0, 0.8])
def test_a_sensor_above_the_roll_axis_moves_while_the_wheels_do_not_slide(lean):
    """It is 0.6 m above it and 0.7 m in front of the rear wheel, while the bike rolls and turns."""
    height, ahead, speed, roll, yaw = 0.6, 0.7, 15.0, 1.2, -0.3
    s, c = np.sin(lean), np.cos(lean)
    moved = state(
        lean=lean, left=-height * c * roll + ahead * yaw, up=-height * s * roll, forward=speed + height * s * yaw
    )
    p = np.zeros((1, PARAMETERS))
    p[0, HEIGHT], p[0, AHEAD] = height, ahead
    _, measured = motion_and_measurements(one([yaw * s, yaw * c, roll], [0.0, 1.0, 0.0], speed), moved, p)
    for row in (noise.SLIDING, noise.CLIMBING, noise.SLOPING, noise.GIVEN_SPEED, noise.BACKWARD):
        assert abs(measured[0, row]) < 1e-9, row
    assert measured[0, noise.ANY_SPEED] == pytest.approx(speed - noise.USUAL_MPS)


def test_wide_tyres_make_a_balanced_bike_feel_a_force_to_the_side():
    p = np.zeros((1, PARAMETERS))
    p[0, TYRES] = 0.1
    _, measured = motion_and_measurements(one([0.0] * 3, [0.1 * np.sin(0.7), 1.2, 0.0]), state(lean=0.7), p)
    assert abs(measured[0, noise.BALANCED]) < 1e-12


def test_a_side_wind_is_level_and_a_cambered_road_counts_on_straights():
    p = np.zeros((1, PARAMETERS))
    p[0, BESIDE] = 0.03
    _, measured = motion_and_measurements(one([0.0] * 3, [0.03 * np.cos(0.5), 1.0, 0.0]), state(lean=0.5), p)
    assert abs(measured[0, noise.BALANCED]) < 1e-12
    p = np.zeros((1, PARAMETERS))
    p[0, CAMBER] = 0.01
    off = [
        motion_and_measurements(one([0.0] * 3, [0.01, 1.0, 0.0]), state(lean=lean), p)[1][0, noise.BALANCED]
        for lean in (0.0, 0.02, 0.5)
    ]
    assert np.allclose(off, [0.0, 0.0, 0.01], atol=5e-5)


def test_a_warmer_sensor_has_other_offsets():
    p = np.zeros((1, PARAMETERS))
    p[0, OFFSET_PER_C], p[0, BIAS_PER_C] = (0.001, 0.0, 0.002), (0.0, 0.0, 0.01)
    readings = [0.0, 0.0, 0.1], [-0.01, 1.0, -0.02]
    motion, _ = motion_and_measurements(one(*readings, warm=10.0), state(), p)
    assert np.allclose(motion, 0.0, atol=1e-12)
    motion, _ = motion_and_measurements(one(*readings), state(), p)
    assert motion[0, LEAN] == pytest.approx(0.1)


def test_the_derivatives_are_those_of_the_equations():
    """By the states and by every parameter, against differences; the speed backwards and forwards."""
    rng, n = np.random.default_rng(3), 30
    force, rate = rng.normal(size=(2, n, 3))
    windows = windows_of(np.linspace(0.0, 6.0, n), force, rate, rng.normal(size=n), rng.normal(size=n))
    middle, p = 0.3 * rng.normal(size=(n, STATES)), 0.3 * rng.normal(size=(n, PARAMETERS))
    factor = rng.uniform(0.5, 2.0, size=(ROWS, n))
    found = by_unknowns(windows, middle, p, factor)
    for k in range(STATES + PARAMETERS):
        step = 1e-5 * (np.arange(STATES + PARAMETERS) == k)
        after, before = (
            np.concatenate(motion_and_measurements(windows, middle + sign * step[:STATES], p + sign * step[STATES:]), 1)
            for sign in (1.0, -1.0)
        )
        assert np.allclose(found[:, :, k], factor.T * (after - before) / 2e-5, rtol=1e-6, atol=1e-6), k


def test_the_upright_pose_tells_rotation_and_offset_together():
    """A sensor whose offset the pose has taken for a tilt is right at rest, whatever the offset."""
    before = sigma(six_done=False)
    p = np.zeros(PARAMETERS)
    p[ROTATION.stop - 1] = p[OFFSET.start] = 0.03  # to the side
    p[ROTATION.start], p[OFFSET.stop - 1] = 0.02, -0.02  # forward
    rest = one([0.0] * 3, [0.0, 1.0, 0.0])
    motion, _ = motion_and_measurements(rest, state(), p[None])
    assert np.allclose(motion[0, [LEFT, FORWARD]], 0.0, atol=1e-9)
    apart = p.copy()
    apart[OFFSET] *= -1.0
    assert p @ known(before) @ p < 0.5 * (apart @ known(before) @ apart)
    assert np.all(np.linalg.eigvalsh(known(before)) > 0.0)
    assert len(USUAL) == PARAMETERS


def test_windows_hold_the_integrals_and_gaps_are_windows_of_their_own():
    rng = np.random.default_rng(2)
    t = np.cumsum(rng.uniform(0.005, 0.015, 300))
    t[150:] += 5.0
    rate = rng.normal(size=(300, 3))
    speed = np.full(300, np.nan)
    speed[[10, 200]] = 7.0, 9.0
    windows = windows_of(t, np.tile([0.0, 1.0, 0.0], (300, 1)), rate, speed, np.zeros(300))
    assert np.array_equal(np.flatnonzero(windows.gap), [windows.number[149] + 1])
    assert windows.seconds[windows.gap][0] == pytest.approx(5.0, abs=0.03)
    share = (windows.before + windows.after)[:, None]
    assert np.allclose(np.sum(windows.rate * windows.seconds[:, None], axis=0), np.sum(rate * share, axis=0))
    assert np.all(np.diff(windows.edges) > 0.0)
    assert np.all((windows.edges[windows.number] <= t) & (t <= windows.edges[windows.number + 1]))
    assert [float(windows.speed[windows.number[k]]) for k in (10, 200)] == [7.0, 9.0]
