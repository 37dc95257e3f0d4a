"""The steps of the least squares, and the weights of the hypotheses."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from kickstand_tools.calibration.file import CalibrationFile
from kickstand_tools.estimation import (
    equations as eq,
    first_guess,
    hypotheses,
    least_squares,
    smooth,
    unknowns as of,
)
from kickstand_tools.logs.log import Log
from kickstand_tools.logs.reader import read_blocks
from made_windows import windows


def bare(**fields) -> Any:
    """Return an Estimate with only these fields."""
    made = object.__new__(least_squares.Estimate)
    vars(made).update(fields)
    return made


# The false standstills


@pytest.mark.parametrize(
    ("length", "at", "row", "size", "false"),
    [
        (14, 100, of.PITCH, 4.1, True),
        (15, 100, of.PITCH, 4.1, False),
        (14, 100, of.PITCH, 3.9, False),
        (14, 100, of.PITCH, -4.1, True),
        (14, 75, of.FORWARD, 4.1, True),
        (14, 74, of.FORWARD, 4.1, False),
        (14, 138, eq.SLIDING, 4.1, True),
        (14, 139, eq.SLIDING, 4.1, False),
        *[(14, 100, row, 4.1, True) for row in (of.LEFT, of.UP, 14, 16, 17, 19)],
        *[(14, 100, row, 4.1, False) for row in (of.LEAN, of.BIAS.start, eq.CLIMBING, eq.MEASURED_SPEED, eq.BACKWARD)],
    ],
)
def test_a_brief_standstill_is_false_if_the_motion_contradicts_it(length, at, row, size, false):
    """A standstill begins at window 100. The residual is in standard deviations of 0.5."""
    off = np.zeros((300, eq.ROWS))
    off[at, row] = 0.5 * size
    made = bare(noise=SimpleNamespace(sigma=lambda: np.full((300, eq.ROWS), 0.5)), _residuals=lambda: off)
    still = np.zeros(300, dtype=bool)
    still[100 : 100 + length] = True
    assert np.flatnonzero(made._false_standstill(still)).tolist() == (list(range(100, 100 + length)) if false else [])


def test_a_standstill_at_the_beginning_may_be_false():
    off = np.zeros((300, eq.ROWS))
    off[2, of.PITCH] = 5.0
    made = bare(noise=SimpleNamespace(sigma=lambda: np.ones((300, eq.ROWS))), _residuals=lambda: off)
    assert made._false_standstill(np.arange(300) < 5).sum() == 5


# The steps


def steps(changes, weighed=2):
    """Return the arguments (robust, weigh) of the steps, if they change the angles by these radians."""
    did, left = [], iter(changes)
    made = bare(
        change=np.inf,
        noise=SimpleNamespace(estimate_unbalance=lambda force, over_s: did.append(over_s)),
        _residuals=lambda: np.zeros((3, eq.ROWS)),
    )

    def step(robust, weigh):
        did.append((bool(robust), bool(weigh)))
        made.change = next(left)

    made._step = step
    made._converge()
    return did


def test_outliers_count_less_from_the_third_step_and_then_hypotheses_are_weighed():
    """From the fourth step on, hypotheses are weighed twice, if the last change was under 3 degrees. The steps end
    after that if a change is under 0.02 degrees."""
    large, near, tiny = np.radians([3.1, 2.9, 0.019])
    assert steps([near, near, tiny, tiny, tiny]) == [
        (False, False), (False, False), (True, False), 3.0, (True, True), 3.0, (True, True),
    ]  # fmt: skip
    assert steps([large, large, large, near, tiny, np.radians(0.021), tiny])[3:] == [
        (True, False), 3.0, (True, True), 3.0, (True, True), 3.0, (True, False),
    ]  # fmt: skip
    assert len([one for one in steps([1.0] * 20) if isinstance(one, tuple)]) == 20


def moved(size, posed=True, rotation=0.0, pitch=0.0):
    """Return the Estimate after a step that changes the lean by `size` and the parameters by 1, and `rotation`."""
    n, unknown = 4, np.arange(of.PARAMETERS)
    change, parameters = np.zeros((2, 3, of.STATES)), np.ones((2, of.PARAMETERS))
    change[:, :, of.LEAN], change[:, :, of.PITCH], parameters[:, of.ROTATION] = size, pitch, rotation
    made = bare(
        states=np.zeros((n + 1, of.STATES)), parameters=np.zeros((2, of.PARAMETERS)), turned=0,
        prior=SimpleNamespace(posed=posed, unknown=unknown), _reduced=lambda robust: robust,
        _problem=lambda blocks: (change, parameters),
    )  # fmt: skip
    made._turn_axes = lambda: vars(made).update(turned=1)
    return made


@pytest.fixture
def solved(monkeypatch):
    monkeypatch.setattr(least_squares, "solve", lambda *result: result)


def test_a_step_changes_angles_by_at_most_half_a_radian(solved):
    made = moved(0.4)
    made._step(False, False)
    assert made.change == 0.4 and made.states[:, of.LEAN].tolist() == [0.4] * 5
    assert made.parameters[:, of.HEIGHT].tolist() == [1.0, 1.0] and not made.turned
    made = moved(-2.0)
    made._step(False, False)
    assert made.change == 2.0 and made.states[:, of.LEAN].tolist() == [-0.5] * 5
    assert made.parameters[:, of.HEIGHT].tolist() == [0.25, 0.25]
    made = moved(0.1, pitch=-1.3)  # the pitch stays within 1.2 rad
    made._step(False, False)
    assert made.states[:, of.PITCH].tolist() == [-1.2] * 5 and made.change == 0.1


def test_without_a_pose_the_axes_turn_with_each_step(solved):
    made = moved(0.1, posed=False, rotation=-1.0)
    made._step(False, False)
    assert made.change == 1.0 and made.turned and made.states[0, of.LEAN] == pytest.approx(0.05)
    made = moved(0.1, posed=True, rotation=-1.0)
    made._step(False, False)
    assert made.change == 0.1


def test_a_step_without_a_number_ends_the_estimate(solved):
    with pytest.raises(np.linalg.LinAlgError):
        moved(np.nan)._step(False, False)


def test_axes_that_have_turned_need_no_rotation():
    """The first block's rotation moves into the matrix. The other block keeps the difference."""
    parameters = np.zeros((2, of.PARAMETERS))
    parameters[:, of.ROTATION] = [[0.0, 0.0, np.pi / 2.0], [0.0, 0.0, np.pi / 2.0 + 0.1]]
    mean = np.zeros(of.PARAMETERS)
    made = bare(parameters=parameters, prior=SimpleNamespace(mean=mean), matrix=np.eye(3), _windows=windows(2))
    made._turn_axes()
    assert made.parameters[:, of.ROTATION] == pytest.approx(np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 0.1]]))
    assert mean[of.ROTATION] == pytest.approx([0.0, 0.0, -np.pi / 2.0])
    quarter = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    assert made.matrix == pytest.approx(quarter) and made._windows.force[0] == pytest.approx([-1.0, 0.0, 0.0])


@pytest.mark.parametrize(("unbalance", "factor"), [(0.25, 0.5), (0.5, 1.0), (3.0, 1.0)])
def test_a_ride_with_little_unbalance_was_on_roads_without_camber(unbalance, factor):
    did: list = []
    ones = np.ones((2, eq.ROWS))
    noise = SimpleNamespace(
        count_own_misfit=lambda: did.append("own"), sigma=lambda: ones, robust=lambda sigma, off: 2.0 * sigma,
        estimate_roughness=lambda residual: did.append(residual[0, 0]),
        estimate_unbalance=lambda force, over_s: did.append((force[0], over_s)), unbalance=unbalance,
    )  # fmt: skip
    prior = of.Prior(of.MEAN, of.SIGMA.copy(), True)
    bare(noise=noise, prior=prior, _residuals=lambda: 6.0 * ones)._use_own_noise()
    assert did == ["own", 3.0, (6.0, 10.0)]
    assert prior.sigma[of.CAMBER] == pytest.approx(factor * 0.0035)


# hypotheses.py


def test_hypotheses_are_weighted_by_a_quarter_of_the_log_likelihood(monkeypatch):
    """Minus two log-likelihoods of 0 and 8 count as 0 and 2. With an unbalance of 2 they count as 0 and 0.5. Below a
    share of 2 %, a hypothesis is dropped."""
    three = hypotheses.ALL.select(np.arange(3), np.ones(3) / 3.0)
    three.minus_two_log_prior[:] = [0.0, 1.0, 0.0]
    monkeypatch.setattr(hypotheses.Hypotheses, "random_walks", lambda *_: None)

    def weights(likelihoods, unbalance=1.0):
        monkeypatch.setattr(hypotheses, "minus_two_log_likelihood", lambda *_: np.array(likelihoods))
        nothing: Any = None
        found = three.weighted(nothing, nothing, nothing, unbalance)
        return found.weight.tolist(), found.pushed.tolist()

    by_hand = np.exp([0.0, -1.5, 0.0])
    assert weights([0.0, 8.0, 0.0])[0] == pytest.approx(by_hand / by_hand.sum())
    assert weights([0.0, 8.0, 0.0], 0.5)[0] == pytest.approx(by_hand / by_hand.sum())
    by_hand = np.exp([0.0, -0.75, 0.0])
    assert weights([90.0, 98.0, 90.0], 2.0)[0] == pytest.approx(by_hand / by_hand.sum())
    least = -8.0 * np.log(0.02 / 0.98)
    assert len(weights([0.0, 999.0, 0.98 * least])[0]) == 2
    assert weights([0.0, 999.0, 1.02 * least]) == ([1.0], [hypotheses.CALM_G])


# smooth.py


def test_a_faulty_gyro_enlarges_the_standard_deviation(monkeypatch):
    noise = np.random.default_rng(1).normal(0.0, 0.002, (60, 6))
    (block,) = read_blocks(Log(np.arange(60) / 50.0, noise[:, :3] + [0.0, 1.0, 0.0], noise[:, 3:]))
    found = {}
    for odd, codes in ((3.9, []), (4.1, ["sensor-odd"])):
        monkeypatch.setattr(smooth, "oddness", lambda estimate, odd=odd: odd)
        made = smooth.Smoother(CalibrationFile(aligned=True))
        found[odd] = made.estimated([block], slice(0, 60))
        made._riding_s = 1.0
        assert [remark.code for remark in made.remarks([])] == codes
    assert found[4.1][:, 1] == pytest.approx(4.1 * found[3.9][:, 1])
    assert found[4.1][:, [0, 2, 3]] == pytest.approx(found[3.9][:, [0, 2, 3]])


def test_constants_of_the_model_that_no_ride_shows():
    assert (eq.USUAL_MPS, of.GYRO_DRIFT, first_guess.USUAL_MPS) == (15.0, 0.002, 10.0)
