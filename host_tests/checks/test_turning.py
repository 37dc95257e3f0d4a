"""Tests which exchange of the gyro's axes is reported for known residuals. Also tests the basis functions that describe
an unknown velocity."""

from types import SimpleNamespace

import numpy as np
import pytest
from kickstand_tools.checks import turning
from kickstand_tools.checks.handedness import EXCHANGES, better_exchange

AS_IT_IS, OPPOSITE = np.eye(3), -np.eye(3)
ONE_REVERSED, EXCHANGED = np.diag([1.0, 1.0, -1.0]), np.eye(3)[[1, 0, 2]]


def reported(*left, windows=10, unbiased=True, swing=0.0):
    """Return the exchange that is reported for these residuals, or None.

    left: pairs (exchange, mean square of the residual force in g2). All other exchanges have 9 g2.
    windows: number of windows.
    unbiased: True if the gyro's bias is about 0.
    swing: amount in g2 that is added in even windows and subtracted in odd ones, to the residual of the exchange
        AS_IT_IS.
    """

    def residual(exchange):
        found = next((g2 for one, g2 in left if np.array_equal(one, exchange)), 9.0)
        sway = swing * (-1.0) ** np.arange(windows) if np.array_equal(exchange, AS_IT_IS) else 0.0
        return np.full(windows, found) + sway

    def unexplained(exchanges):
        return np.array([residual(one) for one in exchanges])

    rough = lambda exchanges: np.mean(unexplained(exchanges), axis=1)  # noqa: E731
    fit = SimpleNamespace(unbiased=unbiased, unexplained=unexplained, rough=rough)
    place = better_exchange(fit)  # type: ignore[arg-type]
    return None if place is None else EXCHANGES[place]


@pytest.mark.parametrize(
    ("left", "best"),
    [
        # A residual is multiplied by 1.3 if some axes are reversed, and by 1.6 if axes are exchanged
        ([(AS_IT_IS, 0.1), (OPPOSITE, 0.02), (ONE_REVERSED, 0.0155), (EXCHANGED, 0.0126)], OPPOSITE),
        ([(AS_IT_IS, 0.1), (OPPOSITE, 0.02), (ONE_REVERSED, 0.0153), (EXCHANGED, 0.0126)], ONE_REVERSED),
        ([(AS_IT_IS, 0.1), (OPPOSITE, 0.02), (ONE_REVERSED, 0.0155), (EXCHANGED, 0.0124)], EXCHANGED),
        ([(AS_IT_IS, 0.0129), (ONE_REVERSED, 0.01)], None),
        ([(AS_IT_IS, 0.0131), (ONE_REVERSED, 0.01)], ONE_REVERSED),
        # the residual must be smaller by a factor of 1.25 if all windows agree
        ([(AS_IT_IS, 0.0124), (OPPOSITE, 0.01)], None),
        ([(AS_IT_IS, 0.0126), (OPPOSITE, 0.01)], OPPOSITE),
        # the residual must be smaller by at least 0.001 g2
        ([(AS_IT_IS, 0.0019), (OPPOSITE, 0.00091)], None),
        ([(AS_IT_IS, 0.0019), (OPPOSITE, 0.00089)], OPPOSITE),
    ],
)
def test_the_likelier_mistake_wins_unless_another_fits_better(left, best):
    found = reported(*left)
    assert (found is None) is (best is None)
    assert found is None or best is None or np.array_equal(found, best)


def test_windows_that_differ_require_a_factor_of_two():
    """The gain differs by +s or -s in ten windows, where s is `swing`. The standard error of the mean gain is s / root
    10. Three standard errors are 0.95 s. If the mean gain is not larger than three standard errors, the residual must
    fall to below half."""
    for g2, swing, clear in ((0.0195, 0.011, False), (0.0195, 0.0099, True), (0.0201, 0.011, True)):
        assert (reported((AS_IT_IS, g2), (OPPOSITE, 0.01), swing=swing) is not None) is clear, (g2, swing)


@pytest.mark.parametrize(
    ("g2", "windows", "unbiased", "clear"),
    [(0.049, 3, True, False), (0.051, 3, True, True), (0.051, 3, False, False), (0.021, 4, False, True)],
)
def test_three_windows_must_show_it_five_times_as_well(g2, windows, unbiased, clear):
    found = reported((AS_IT_IS, g2), (OPPOSITE, 0.01), windows=windows, unbiased=unbiased)
    assert (found is not None) is clear


def test_an_unknown_velocity_is_linear_between_its_knots():
    """The knots are 5 s apart. With the times of the knots as coefficients, the velocity equals the time, and its
    derivative is 1."""
    values, changes = turning._knots(2, 100)
    knots_s, time_s = np.array([0.0, 5.0, 10.0]), 0.1 * np.arange(100) + 0.05
    assert values.shape == changes.shape == (3, 2, 100)
    for window in range(2):
        assert knots_s @ values[:, window] == pytest.approx(time_s)
        assert knots_s @ changes[:, window] == pytest.approx(np.ones(100))
        assert values[:, window].sum(axis=0) == pytest.approx(np.ones(100))
        assert changes[:, window].sum(axis=0) == pytest.approx(np.zeros(100))
    assert values[:, 0, 62] == pytest.approx([0.0, 0.75, 0.25])  # values at 6.25 s, between the knots at 5 and 10 s
