"""Windows: means over a fifth of a second, gaps, and what other parts of the estimation read from them."""

import numpy as np
import pytest
from kickstand_tools.estimation.windows import windows_of


def cut(t_s, force=(0.0, 1.0, 0.0), rate=(0.0, 0.0, 0.0), speed=None, warm=None, **more):
    n = len(t_s)
    force, rate = (np.array(np.broadcast_to(np.asarray(of, dtype=float), (n, 3))) for of in (force, rate))
    return windows_of(
        np.asarray(t_s, dtype=float),
        force,
        rate,
        np.full(n, np.nan) if speed is None else speed,
        np.zeros(n) if warm is None else warm,
        **more,
    )


def test_windows_hold_the_integrals_of_uneven_samples():
    rng = np.random.default_rng(2)
    t = np.cumsum(rng.uniform(0.005, 0.015, 300))
    t[150:] += 5.0
    rate = rng.normal(size=(300, 3))
    speed = np.full(300, np.nan)
    speed[[10, 200]] = 7.0, 9.0
    result = cut(t, rate=rate, speed=speed)
    assert np.array_equal(np.flatnonzero(result.gap), [result.number[149] + 1])
    assert result.seconds[result.gap][0] == pytest.approx(5.0, abs=0.03)
    assert np.sum(result.covered) == pytest.approx(np.sum(result.seconds[~result.gap]))
    share = (result.before + result.after)[:, None]
    assert np.allclose(np.sum(result.rate * result.seconds[:, None], axis=0), np.sum(rate * share, axis=0))
    assert np.all(np.diff(result.edges) > 0.0)
    assert np.all((result.edges[result.number] <= t) & (t <= result.edges[result.number + 1]))
    assert [float(result.speed[result.number[k]]) for k in (10, 200)] == [7.0, 9.0]


def test_gravity_keeps_its_length_while_the_bike_rolls():
    """The bike rolls by 30 degrees in a window. A mean force along the rolling axes would be 1 % too small."""
    t = np.arange(400) / 200.0
    lean = np.radians(150.0) * (t - 1.0)
    force = np.column_stack((np.sin(lean), np.cos(lean), np.zeros(400)))
    rolling, aligned = (
        cut(t, force, (0.0, 0.0, np.radians(150.0)), aligned=is_aligned) for is_aligned in (False, True)
    )
    middle = np.radians(150.0) * (0.5 * (aligned.edges[1:] + aligned.edges[:-1]) - 1.0)
    assert np.all(np.linalg.norm(rolling.force, axis=1) < 0.99)
    assert np.allclose(aligned.force, np.column_stack((np.sin(middle), np.cos(middle), 0 * middle)), atol=1e-4)
    assert np.allclose(aligned.rate, rolling.rate)


@pytest.mark.parametrize(
    ("hz", "step_s", "gaps"), [(100, 0.16, 0), (100, 0.18, 1), (5, 0.29, 0), (5, 0.31, 1)]
)  # over 0.17 s, and over one and a half usual steps
def test_a_long_step_between_samples_is_a_gap(hz, step_s, gaps):
    result = cut(np.append(np.arange(50) / hz, 49 / hz + step_s + np.arange(50) / hz))
    assert np.count_nonzero(result.gap) == gaps
    # A gap begins and ends half a step from a reading
    assert np.sum(result.seconds[result.gap]) == pytest.approx(gaps * (step_s - 1.0 / hz))
    assert (result.edges[0], result.before[0]) == pytest.approx((-0.5 / hz, 0.5 / hz))
