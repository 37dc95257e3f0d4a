"""Tests the calibration of the gyro by the turns between still poses: the integration of the turns, the fit, and the
check of the result."""

import numpy as np
import pytest
from kickstand.calibration import six_position
from kickstand.calibration.sensor_fit import SensorFit
from kickstand.calibration.turn import Turn
from kickstand.errors import GyroError
from kickstand_tools.calibration.procedure import fit_procedure
from kickstand_tools.common.errors import InputError, RefusedInput
from kickstand_tools.logs.log import Log
from kickstand_tools.simulation import hands, poses
from kickstand_tools.simulation.physics.chip import Chip
from support.mpy import run_mpy

HZ = 200.0
DIAGONAL = np.eye(3, dtype=bool)


def handled(seed, hand=None):
    """Simulate the six positions with a random sensor. Return the sensor and its readings. hand: how the sensor is
    turned between the positions."""
    chance = np.random.default_rng([seed, 38])
    chip = Chip.random(chance)
    return chip, hands.procedure(chance, chip, np.array(list(poses.ups(chance))), 22.0, hand)


def errors_left(chip, calibration):
    """Return the remaining errors of the gyro as a matrix (3, 3), in the axes of the calibrated accelerometer."""
    a = calibration.accel_matrix @ np.diag(calibration.accel_slope) @ chip.accel_matrix
    u, _, v = np.linalg.svd(a)
    return calibration.gyro_matrix @ chip.gyro_matrix - u @ v


def rms(values):
    return float(np.sqrt(np.mean(np.square(values))))


def left_of(seeds, hand=None):
    left = []
    for seed in seeds:
        chip, readings = handled(seed, hand)
        left.append(errors_left(chip, fit_procedure(Log.from_readings(readings, HZ)).calibration))
    return np.array(left)


def test_the_turns_calibrate_the_gyro():
    left = left_of(range(12))
    assert rms(left[:, DIAGONAL]) < 0.004
    assert rms(left[:, ~DIAGONAL]) < 0.005


@pytest.mark.nightly
@pytest.mark.parametrize("hand", [hands.Hand(), hands.Hand(heading_deg=0.0, detour_deg=0.0)])
def test_the_turns_calibrate_fifty_gyros(hand):
    left = left_of(range(100, 150), hand)
    assert rms(left[:, DIAGONAL]) < 0.004
    assert rms(left[:, ~DIAGONAL]) < 0.005


def test_a_turn_is_integrated_as_by_matrices_in_double():
    rng = np.random.default_rng(1)
    bias = np.array([3.0, -2.0, 0.5])
    rates = 150.0 * np.sin(np.linspace(0, np.pi, 200))[:, None] * rng.normal(size=3) + rng.normal(size=(200, 3)) + bias
    counts = np.rint(rates * 65.5).astype(int)
    turn = Turn(65.5, 5000)
    turn.start(bias.tolist())
    exact = np.eye(3)
    for pair in counts.reshape(100, 2, 3):
        turn.add([0, 0, 0, 0, *pair.sum(axis=0).tolist()], 2, 10_000)
        for one in pair:
            x, y, z = np.radians(one / 65.5 - bias) * 0.005
            size = np.sqrt(x * x + y * y + z * z)
            k = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
            exact = exact @ (np.eye(3) + np.sin(size) / size * k + (1 - np.cos(size)) / size**2 * k @ k)
    turn.end()
    r = np.array(turn.attitude(bias.tolist(), 0.5)).reshape(3, 3)
    assert np.max(np.abs(r - exact)) < 3e-4  # 3e-4 rad are 0.02 degrees
    assert turn.seconds == pytest.approx(1.0)
    s = np.array(turn.packed(bias.tolist())[9:]).reshape(3, 9)
    # a scale error that is the same on all axes makes the turn about the mean axis longer
    nominal = s[:, [0, 4, 8]].sum(axis=1)
    assert np.linalg.norm(nominal) == pytest.approx(turn.angle(), rel=1e-5)


def test_samples_of_a_pose_that_is_spoilt_count_after_all():
    def turned(spoilt):
        turn = Turn(65.5, 5000)
        turn.start([0.0] * 3)
        for k in range(50):
            turn.add([0, 0, 0, 0, 131 * 20, 0, 0], 2, 10_000, hold=k >= 40)
        if spoilt:
            turn.add([0] * 7, 2, 10_000)
        turn.end()
        return np.degrees(turn.angle())

    assert turned(spoilt=True) == pytest.approx(10.0, abs=0.01)  # the spoilt turn has 20 deg/s for half a second
    assert turned(spoilt=False) == pytest.approx(8.0, abs=0.01)


@pytest.mark.parametrize(
    ("sums", "dt_us", "quick", "lost"), [(61_000, 10_000, 0, 0), (-62_400, 10_000, 1, 0), (0, 30_000, 0, 1)]
)
def test_rates_near_the_range_and_gaps_are_noticed(sums, dt_us, quick, lost):
    turn = Turn(65.5, 5000)
    turn.start([0.0] * 3)
    turn.add([0, 0, 0, 0, 0, sums, 0], 2, dt_us)
    assert (turn.quick, turn.lost) == (bool(quick), bool(lost))
    turn.start([0.0] * 3)
    assert (turn.quick, turn.lost) == (False, False)


def made(seed):
    """Return the poses, turns and true errors of a sensor without noise, computed from rotations alone."""
    rng = np.random.default_rng(seed)
    gyro = np.eye(3) + 0.01 * rng.normal(size=(3, 3))
    skew = 0.006 * rng.normal(size=3)
    accel = np.array([[1, skew[2], skew[1]], [skew[2], 1, skew[0]], [skew[1], skew[0], 1]])
    offset, slope = 0.03 * rng.normal(size=3), 1 + 0.01 * rng.normal(size=3)
    ups = np.array(list(poses.ups(rng)))
    chip = Chip(np.eye(3), np.zeros(3), np.eye(3), np.zeros(3), np.zeros(3), np.zeros(3), 0.0)
    readings = hands.procedure(rng, chip, ups, 25.0)
    rates = np.linalg.solve(gyro, readings[:, 4:].T).T
    forces = (np.linalg.solve(accel, readings[:, :3].T).T - offset) / slope
    return np.column_stack((forces, readings[:, 3], rates)), gyro


@pytest.mark.parametrize("seed", [1, 2])
def test_known_errors_are_found(seed):
    readings, gyro = made(seed)
    found = fit_procedure(Log.from_readings(readings, HZ)).calibration
    assert np.all(np.abs(found.gyro_matrix - gyro) < 4 * found.gyro_sigma + 0.002)
    assert rms(found.gyro_matrix - gyro) < 0.003


def fitted(seed=3):
    _, readings = handled(seed)
    found = {}
    original = SensorFit.__init__

    def kept(self, *arguments):
        original(self, *arguments)
        found["fit"] = self

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(SensorFit, "__init__", kept)
        fit_procedure(Log.from_readings(readings, HZ))
    return found["fit"]


def test_the_fit_is_numpys_and_so_is_its_covariance():
    """numpy minimizes the same residuals in double precision, with numeric derivatives, and finds the same result."""
    fit = fitted()
    start, sigma = np.array(fit._start), np.array(fit._sigma)

    def residuals(p):
        fit._p = p.tolist()
        out = list((p - start) / sigma)
        for k in range(len(fit._poses)):
            out.append((np.dot(fit.force(k), fit.force(k)) - 1) / 2 / 0.0015)
        for k, (_, seconds) in enumerate(fit._turns):
            weight = (0.0015**2 + np.radians(0.008) ** 2 * seconds**3 / 12) ** -0.5
            out += [weight * value for value in fit._misfit(k, fit._p[9:])[0]]
        return np.array(out)

    found, p, j = np.array(fit._p), start.copy(), np.eye(18)
    for _ in range(8):
        r = residuals(p)
        j = np.array([(residuals(p + 1e-6 * e) - r) / 1e-6 for e in np.eye(18)]).T
        p = p - np.linalg.lstsq(j, r, rcond=None)[0]
    assert np.abs(found - p).max() < 2e-4
    assert fit.gyro_sigma == pytest.approx(np.sqrt(np.diag(np.linalg.inv(j.T @ j)))[9:], rel=0.03)


def test_micropython_finds_the_same():
    """MicroPython gets the same poses and turns, and computes the fit step by step. All results of MicroPython are
    compared with CPython's."""
    fit = fitted()
    script = (
        "from array import array\nfrom kickstand.calibration.sensor_fit import SensorFit\n"
        f"turns = [(array('f', t), s) for t, s in {[(list(t), s) for t, s in fit._turns]!r}]\n"
        f"fit = SensorFit({fit._poses!r}, turns, [0.0] * 3, [1.0] * 3)\n"
        "fit.finish()\nprint(list(fit.gyro_matrix) + fit.gyro_sigma)\n"
    )
    got = eval(run_mpy(script))
    assert got == pytest.approx([*fit.gyro_matrix, *fit.gyro_sigma], abs=3e-4)


def with_axis(axis, change):
    """Return the log of a calibration with a faulty gyro axis."""
    _, readings = handled(5)
    bias = np.median(readings[:, 4 + axis])
    readings[:, 4 + axis] = bias + change(readings[:, 4 + axis] - bias)
    return Log.from_readings(readings, HZ)


def late(rates):
    return np.concatenate((np.zeros(30), rates[:-30]))  # delay the rates by 150 ms


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize(
    ("change", "code"),
    [
        (lambda rates: 0.5 * rates, "gyro-scale"),
        (lambda rates: 2.0 * rates, "gyro-scale"),
        (lambda rates: -rates, None),  # if nearly all turns are about one axis, the error names this axis
        (lambda rates: 0.0 * rates, "dead-gyro"),
        # The axis is dead but still shows noise
        (lambda rates: np.where(np.abs(rates) > 5.0, 0.0, rates), "dead-gyro"),
        (late, "gyro-misfit"),
        (lambda rates: np.clip(rates, -60.0, 60.0), None),
    ],
    ids=["half", "double", "mirrored", "dead", "dead but noisy", "late", "clipped"],
)
def test_a_faulty_gyro_axis_is_refused(axis, change, code):
    with pytest.raises(RefusedInput) as refusal:
        fit_procedure(with_axis(axis, change))
    if code:
        assert refusal.value.code == code
    if code in ("gyro-scale", "gyro-reversed", "dead-gyro"):
        assert refusal.value.message.values[0] == "xyz"[axis]


def test_an_axis_that_no_turn_has_measured_is_unproved():
    fit = fitted()
    fit.__init__(fit._poses, [None] * 6, [0.0] * 3, [1.0] * 3)
    fit.finish()
    assert fit.unproved == ["x", "y", "z"]


def test_turns_that_were_too_quick_are_left_out():
    _, readings = handled(7, hands.Hand(turn_s=(0.35, 0.45)))
    try:
        found = fit_procedure(Log.from_readings(readings, HZ))
    except RefusedInput as refused:
        assert refused.code == "unproved-gyro"
    else:
        assert found.turns < found.all_turns == 6


def test_a_log_without_one_side_is_refused():
    _, readings = handled(1)
    with pytest.raises(InputError, match=r"none with side [+-]"):
        fit_procedure(Log.from_readings(readings[: len(readings) // 2], HZ))


def test_a_gross_misfit_is_no_plausible_fit():
    fit = fitted()
    fit.__init__(fit._poses, [(turn, s) for turn, s in fit._turns[::-1]], *six_position.closed_form(sides(fit)))
    with pytest.raises(GyroError):
        fit.finish()


def sides(fit):
    """Return the readings of the six sides in the order of SIDES."""
    return [min((p for p in fit._poses if six_position.side_of(p) == k), key=six_position.tilt_deg) for k in range(6)]
