"""The smoother's equations are compared with motions whose readings follow from geometry."""

import numpy as np
import pytest
from kickstand_tools.estimation import equations as eq, unknowns as of
from kickstand_tools.estimation.equations import jacobian, process_and_measurements
from kickstand_tools.estimation.unknowns import FORWARD, LEAN, LEFT, PARAMETERS, PITCH, STATES, UP, Prior
from kickstand_tools.estimation.windows import Windows, windows_of
from kickstand_tools.signals import rotation_matrix

G = 9.80665
MOTION = slice(0, STATES)
WHEELS = (eq.SLIDING, eq.CLIMBING, eq.SLOPING)


def found(rate, force, states=(), parameters=(), speed=np.nan, warm=0.0):
    """Return the residuals of one window with these readings, shape (ROWS).

    states, parameters: {index: value}. All others are 0.
    """
    x = np.zeros((STATES + PARAMETERS, 1))
    for index, value in dict(states).items():
        x[index] = value
    for index, value in dict(parameters).items():
        x[STATES + index] = value
    readings = np.array([rate]), np.array([force]), np.zeros(1), np.array([speed]), np.array([warm])
    half = np.array([0.1])
    window = Windows(np.array([0.0, 0.2]), *readings, np.zeros(1, bool), np.zeros(1, int), half, half)
    return process_and_measurements(window, x)[:, 0]


@pytest.mark.parametrize("lean", [-0.9, 0.0, 0.6])
@pytest.mark.parametrize("yaw_rate", [-0.4, 0.5])
def test_steady_turn_is_constant(lean, yaw_rate):
    """Nicolae's equations (22) and (23) give the force in a steady turn, whether the lean is balanced or not. With the
    force of (22) and (23) the states stay constant."""
    speed, s, c = 17.0, np.sin(lean), np.cos(lean)
    across = speed * yaw_rate / G
    rate, force = [yaw_rate * s, yaw_rate * c, 0.0], [across * c + s, c - across * s, 0.0]
    assert np.allclose(found(rate, force, {LEAN: lean, FORWARD: speed})[[*range(STATES), *WHEELS]], 0.0, atol=1e-9)


@pytest.mark.parametrize("braking", [0.0, -0.5])
@pytest.mark.parametrize("pitch", [-0.1, 0.0, 0.15])
def test_rest_and_braking_on_a_slope_fit_the_model(pitch, braking):
    lean = 0.2
    force = np.array([np.cos(pitch) * np.sin(lean), np.cos(pitch) * np.cos(lean), np.sin(pitch)])
    level = np.array([-np.sin(lean) * np.sin(pitch), -np.cos(lean) * np.sin(pitch), np.cos(pitch)])
    motion = found([0.0] * 3, force + braking * level, {LEAN: lean, PITCH: pitch})[MOTION]
    assert motion[FORWARD] == pytest.approx(braking * G, abs=1e-9)
    assert np.allclose(np.delete(motion, FORWARD), 0.0, atol=1e-9)


@pytest.mark.parametrize("lean", [-0.5, 0.0, 0.8])
def test_sensor_above_the_roll_axis_moves_with_the_roll(lean):
    """The sensor is 0.6 m above the roll axis and 0.7 m in front of the rear wheel, while the bike rolls and turns."""
    height, ahead, speed, roll, yaw = 0.6, 0.7, 15.0, 1.2, -0.3
    s, c = np.sin(lean), np.cos(lean)
    left, up, forward = -height * c * roll + ahead * yaw, -height * s * roll, speed + height * s * yaw
    states = {LEAN: lean, LEFT: left, UP: up, FORWARD: forward}
    place = {of.HEIGHT: height, of.AHEAD: ahead}
    measured = found([yaw * s, yaw * c, roll], [0.0, 1.0, 0.0], states, place, speed)
    assert np.allclose(measured[[*WHEELS, eq.MEASURED_SPEED, eq.BACKWARD]], 0.0, atol=1e-9)
    assert measured[eq.ANY_SPEED] == pytest.approx(speed - eq.USUAL_MPS)


@pytest.mark.parametrize(
    ("force", "lean", "parameters"),
    [
        (0.1 * np.sin(0.7) * 1.2, 0.7, {of.TYRES: 0.1}),  # a leaned tyre touches the road beside its middle
        (0.03 * np.cos(0.5), 0.5, {of.BESIDE: 0.03}),  # the force of a side wind is level
        (0.01, 0.0, {of.CAMBER: 0.01}),  # the camber of the road matters only on straights
        (0.01, 0.02, {of.CAMBER: 0.01}),
        (0.0, 0.5, {of.CAMBER: 0.01}),
    ],
)
def test_balanced_bike_has_the_modelled_side_force(force, lean, parameters):
    assert abs(found([0.0] * 3, [force, 1.2, 0.0], {LEAN: lean}, parameters)[eq.BALANCED]) < 5e-5


def test_a_warmer_sensor_has_other_offsets():
    left, forward = of.OFFSET_PER_C.start, of.OFFSET_PER_C.stop - 1
    errors = {left: 0.001, forward: 0.002, of.BIAS_PER_C.stop - 1: 0.01}
    readings = [0.0, 0.0, 0.1], [-0.01, 1.0, -0.02]
    assert np.allclose(found(*readings, parameters=errors, warm=10.0)[MOTION], 0.0, atol=1e-12)
    assert found(*readings, parameters=errors)[LEAN] == pytest.approx(0.1)


def test_the_jacobian_is_that_of_the_equations():
    """The derivatives with respect to each state and parameter equal central differences. Forward and backward speeds
    are tested."""
    rng, n = np.random.default_rng(3), 30
    force, rate = rng.normal(size=(2, n, 3))
    windows = windows_of(np.linspace(0.0, 6.0, n), force, rate, rng.normal(size=n), rng.normal(size=n))
    x = 0.3 * rng.normal(size=(STATES + PARAMETERS, n))
    x[FORWARD] *= 10.0
    unknown = np.arange(len(x))
    for row, derivative in zip(unknown, jacobian(windows, x, unknown), strict=True):
        step = 1e-5 * (unknown == row)[:, None]
        after, before = (process_and_measurements(windows, x + sign * step) for sign in (1.0, -1.0))
        assert np.allclose(derivative, (after - before) / 2e-5, rtol=1e-4, atol=1e-4), row


def test_a_yaw_of_eight_degrees_is_no_error_of_scale():
    """The sensor is rotated by 8 degrees about the bike's up, while the bike leans, rolls and turns. If the parameters
    contain the sensor's rotation, the residuals do not change."""
    lean, speed, yaw_rate, roll = 0.7, 25.0, -0.3, 1.5
    s, c = np.sin(lean), np.cos(lean)
    across = speed * yaw_rate / G
    rate, force = [yaw_rate * s, yaw_rate * c, roll], [across * c + s, c - across * s, 0.0]
    turn = rotation_matrix(np.radians([0.0, 8.0, 0.0]))
    states = {LEAN: lean, FORWARD: speed}
    right, turned = (
        found(a, b, states, p)
        for a, b, p in ((rate, force, {}), (turn.T @ rate, turn.T @ force, {of.ROTATION.start + 1: np.radians(8.0)}))
    )
    # With equations of first order the residuals would differ by 15e-3
    assert np.allclose(turned[:LEFT], right[:LEFT], atol=1e-3)


def test_a_measured_gyro_is_not_estimated_again():
    sigma = np.full((3, 3), 0.003)
    sigma[0, 0] = 0.05
    prior, unmeasured = Prior.of_pose(True, sigma), Prior.of_pose(True, np.zeros((3, 3)))
    measured = prior.sigma[of.GYRO]
    assert np.allclose(measured[1:], np.hypot(0.003, of.GYRO_DRIFT))
    assert measured[0] == unmeasured.sigma[of.GYRO][0] == of.SIGMA[of.GYRO][0]


def test_the_upright_pose_gives_the_sum_of_rotation_and_offset():
    """The upright pose cannot distinguish an offset of the accelerometer from a tilt. If the sum of offset and tilt is
    right, the force at rest is right too."""
    prior, p = Prior.of_pose(six_done=False), np.zeros(PARAMETERS)
    p[of.ROTATION.stop - 1] = p[of.OFFSET.start] = 0.03  # rotation and offset to the side
    p[of.ROTATION.start], p[of.OFFSET.stop - 1] = 0.02, -0.02  # rotation and offset along forward
    motion = found([0.0] * 3, [0.0, 1.0, 0.0], parameters=enumerate(p))[MOTION]
    assert np.allclose(motion[[LEFT, FORWARD]], 0.0, atol=1e-9)
    apart = p.copy()
    apart[of.OFFSET] *= -1.0
    information, p, apart = prior.information(prior.sigma), p[prior.unknown], apart[prior.unknown]
    assert p @ information @ p < 0.5 * (apart @ information @ apart)
    assert np.all(np.linalg.eigvalsh(information) > 0.0)


def test_windows_hold_the_integrals_and_gaps_are_separate():
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


def test_gravity_stays_whole_in_a_window_while_the_bike_rolls():
    """The bike rolls by 30 degrees in a window. A mean force along the rolling axes would be 1 % too small."""
    t = np.arange(400) / 200.0
    lean = np.radians(150.0) * (t - 1.0)
    force = np.column_stack((np.sin(lean), np.cos(lean), np.zeros(400)))
    rate = np.tile([0.0, 0.0, np.radians(150.0)], (400, 1))
    nothing = np.full(400, np.nan), np.zeros(400)
    rolled, aligned = (windows_of(t, force, rate, *nothing, aligned=known) for known in (False, True))
    middle = np.radians(150.0) * (0.5 * (aligned.edges[1:] + aligned.edges[:-1]) - 1.0)
    assert np.all(np.linalg.norm(rolled.force, axis=1) < 0.99)
    assert np.allclose(aligned.force, np.column_stack((np.sin(middle), np.cos(middle), 0 * middle)), atol=1e-4)
    assert np.allclose(aligned.rate, rolled.rate)
