"""The turns between the six positions calibrate the gyro. A faulty gyro axis is refused."""

import functools

import numpy as np
import pytest
from kickstand.calibration.poses import Turn
from kickstand.calibration.six_position import SensorFit
from kickstand_sim.simulation import hands
from kickstand_sim.simulation.physics.chip import Chip
from kickstand_tools.calibration.poses import fit_procedure
from kickstand_tools.common.messages import InputError, RefusedInput
from kickstand_tools.logs.log import Log
from support.mpy import run_mpy

HZ = 200.0
DIAGONAL = np.eye(3, dtype=bool)


def handled(seed, hand=None):
    """Simulate the six positions with a random sensor. Return the sensor and its readings. hand: how the sensor is
    turned between the positions."""
    chance = np.random.default_rng([seed, 38])
    chip = Chip.random(chance)
    return chip, hands.procedure(chance, chip, np.array(list(hands.ups(chance))), 22.0, hand)


def errors_left(seed, hand=None):
    """Return the remaining errors of the gyro in the axes of the calibrated accelerometer, and the standard errors that
    the calibration states, both of shape (3, 3)."""
    chip, readings = handled(seed, hand)
    fit = fit_procedure(Log.from_readings(readings, HZ)).calibration
    u, _, v = np.linalg.svd(fit.accel_matrix @ np.diag(fit.accel_slope) @ chip.accel_matrix)
    return fit.gyro_matrix @ chip.gyro_matrix - u @ v, fit.gyro_sigma


def rms(values):
    return float(np.sqrt(np.mean(np.square(values))))


def test_the_turns_calibrate_the_gyro_as_well_as_stated():
    residuals, sigma = map(np.array, zip(*(errors_left(seed) for seed in range(4))))
    assert rms(residuals[:, DIAGONAL]) < 0.004
    assert rms(residuals[:, ~DIAGONAL]) < 0.005
    assert 0.1 < rms(residuals / sigma) < 1.3


@pytest.mark.long
@pytest.mark.parametrize("hand", [hands.Hand(), hands.Hand(heading_deg=0.0, detour_deg=0.0)])
def test_the_turns_calibrate_fifty_gyros(hand):
    residuals = np.array([errors_left(seed, hand)[0] for seed in range(100, 150)])
    assert rms(residuals[:, DIAGONAL]) < 0.004
    assert rms(residuals[:, ~DIAGONAL]) < 0.005


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


@functools.cache
def measured():
    """Return the poses of an ideal sensor, and the turns of 90 degrees between them, for SensorFit."""
    axes = [(1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 0, 0)]
    force, forces, turns = np.array([0.6, 0.0, 0.8]), [], []
    for axis in axes:
        forces.append(force.tolist())
        turn = Turn(65.5, 10_000)
        turn.start([0.0] * 3)
        for _ in range(100):
            turn.add([0, 0, 0, 0, *(round(90 * 65.5) * np.array(axis)).tolist()], 1, 10_000)
        turn.end()
        turns.append((list(turn.packed([0.0] * 3)), turn.seconds))
        force = np.cross(force, axis) + np.array(axis) * force[np.argmax(axis)]
    return [*forces, force.tolist()], turns


def fitted(turns):
    fit = SensorFit(measured()[0], turns, [0.0] * 3, [1.0] * 3)
    fit.finish()
    return fit


def test_an_ideal_gyro_needs_no_correction_also_on_micropython():
    poses_g, turns = measured()
    fit = fitted(turns)
    assert fit.unproved == []
    assert np.array(fit.gyro_matrix) == pytest.approx(np.eye(3).ravel(), abs=2e-3)
    script = (
        "from array import array\nfrom kickstand.calibration.six_position import SensorFit\n"
        f"turns = [(array('f', t), s) for t, s in {turns!r}]\n"
        f"fit = SensorFit({poses_g!r}, turns, [0.0] * 3, [1.0] * 3)\n"
        "fit.finish()\nprint(list(fit.gyro_matrix) + fit.gyro_sigma)\n"
    )
    assert eval(run_mpy(script)) == pytest.approx([*fit.gyro_matrix, *fit.gyro_sigma], abs=3e-4)


@pytest.mark.parametrize("axis", [0, *(pytest.param(axis, marks=pytest.mark.long) for axis in (1, 2))])
@pytest.mark.parametrize(
    ("change", "code"),
    [
        (lambda rates: 0.5 * rates, "gyro-scale"),
        (lambda rates: 2.0 * rates, "gyro-scale"),
        (lambda rates: -rates, None),  # if nearly all turns are about one axis, the error names this axis
        (lambda rates: 0.0 * rates, "dead-gyro"),
        (lambda rates: np.where(np.abs(rates) > 5.0, 0.0, rates), "dead-gyro"),  # dead, but it still shows noise
        (lambda rates: np.concatenate((np.zeros(30), rates[:-30])), "gyro-misfit"),  # late by 150 ms
        (lambda rates: np.clip(rates, -60.0, 60.0), None),
    ],
    ids=["half", "double", "mirrored", "dead", "dead but noisy", "late", "clipped"],
)
def test_a_faulty_gyro_axis_is_refused(axis, change, code):
    readings = handled(5)[1]
    bias = np.median(readings[:, 4 + axis])
    readings[:, 4 + axis] = bias + change(readings[:, 4 + axis] - bias)
    with pytest.raises(RefusedInput) as refusal:
        fit_procedure(Log.from_readings(readings, HZ))
    assert code in (None, refusal.value.code)
    if code in ("gyro-scale", "dead-gyro"):
        assert refusal.value.message.values[0] == "xyz"[axis]


def test_turns_that_were_too_quick_are_left_out():
    try:
        fit = fit_procedure(Log.from_readings(handled(7, hands.Hand(turn_s=(0.35, 0.45)))[1], HZ))
    except RefusedInput as refusal:
        assert refusal.code == "unproved-gyro"
    else:
        assert fit.turns < fit.all_turns == 6


def test_a_log_without_one_side_is_refused():
    readings = handled(1)[1]
    with pytest.raises(InputError, match=r"none with side [+-]"):
        fit_procedure(Log.from_readings(readings[: len(readings) // 2], HZ))
