"""The noise of the estimation, computed by hand from the standard deviations and durations of noise.py."""

import numpy as np
import pytest
from kickstand_tools.estimation import equations as eq, unknowns as of
from kickstand_tools.estimation.noise import Noise
from window_input import windows

MOTION = [of.LEFT, of.UP, of.FORWARD]
ROOT = np.sqrt(0.2)  # the square root of a window's duration
DEG = np.radians(1.0)


def noise_of(cut, still=False, speed=20.0, lean=0.0, pitch=0.0) -> Noise:
    n = len(cut)
    noise = Noise(cut, np.full(n, still))
    noise.speed, noise.lean, noise.pitch = np.full(n, speed), np.full(n, lean), np.full(n, pitch)
    return noise


def climb(speed):
    return np.hypot(0.1, 2.5 * DEG * speed) * np.sqrt(5.0)


# An error that lasts for t seconds is the same in many windows, so its standard deviation grows by sqrt(2 t / 0.2).
RIDING = [
    (of.LEAN, {}, 0.2 * DEG * ROOT),
    (of.PITCH, {}, 0.2 * DEG * ROOT),
    (MOTION, {}, np.array([0.05, 0.05, 0.1]) * ROOT),
    (of.BIAS, {}, np.full(3, 0.01 * DEG) * ROOT),
    (eq.SLIDING, {}, 0.15 * np.sqrt(5.0)),
    (eq.SLIDING, {"lean": 0.5}, np.hypot(0.15, 0.01 * 20.0 * np.tan(0.5)) * np.sqrt(5.0)),
    (eq.CLIMBING, {}, climb(20.0)),
    (eq.CLIMBING, {"pitch": 10.0 * DEG}, 2.0 * climb(20.0)),  # in a wheelie
    (eq.SLOPING, {}, np.hypot(0.1, 40.0 * DEG) * np.sqrt(40.0)),
    (eq.BALANCED, {}, 0.011 * np.sqrt(30.0)),
    (eq.BALANCED, {"lean": 0.5}, np.hypot(0.011, 0.045 * np.sin(0.5)) * np.sqrt(30.0)),
    (eq.BALANCED, {"speed": 4.0}, np.inf),
    (eq.BALANCED, {"speed": 4.1}, 0.011 * np.sqrt(30.0)),
    (eq.ANY_SPEED, {}, 20.0 * np.sqrt(600.0)),
    (eq.MEASURED_SPEED, {}, np.inf),
    (eq.BACKWARD, {}, 0.3),
    (eq.RESTING, {}, [np.inf] * 3),
    (eq.RESTING, {"still": True}, [0.05] * 3),
    (eq.RESTING_RATE, {"still": True}, [0.15 * DEG] * 3),
    ([eq.SLIDING, eq.CLIMBING, eq.SLOPING, eq.BALANCED, eq.ANY_SPEED, eq.BACKWARD], {"still": True}, [np.inf] * 6),
]


@pytest.mark.parametrize(("row", "state", "sigma"), RIDING)
def test_noise_of_riding_and_of_rest(row, state, sigma):
    assert noise_of(windows(), **state).sigma()[5, row] == pytest.approx(sigma)


EDGES = np.arange(21) * 0.2 + 1000.0 * (np.arange(21) > 5)
WINDOWS = [
    (eq.MEASURED_SPEED, {"speed": 20.0}, 1.0),
    (of.BIAS, {"warm": np.ones(20)}, np.full(3, 0.005 * DEG) * ROOT),
    ([of.LEAN, of.PITCH, *MOTION], {"gap": np.arange(20) == 5}, np.array([30 * DEG, 5 * DEG, 3.0, 1.0, 4.0]) * ROOT),
    ([of.LEAN, of.PITCH, *MOTION], {"gap": np.arange(20) == 5, "edges": EDGES}, [60 * DEG, 8 * DEG, 20.0, 2.0, 20.0]),
    (eq.SLIDING, {"gap": np.arange(20) == 5}, np.inf),
    (of.LEAN, {"jolt": np.full(20, 250 * DEG)}, np.hypot(0.2 * DEG * ROOT, 0.06 * 100 * DEG)),
    # The rate about forward grows by 0.1 rad/s in each window
    (eq.BALANCED, {"rate": np.outer(np.arange(20), [0.0, 0.0, 0.1])}, np.hypot(0.011 * np.sqrt(30.0), 0.05 * 0.5)),
]


@pytest.mark.parametrize(("row", "fields", "sigma"), WINDOWS)
def test_noise_of_special_windows(row, fields, sigma):
    assert noise_of(windows(**fields)).sigma()[5, row] == pytest.approx(sigma)


def test_a_hand_makes_its_own_time_uncertain():
    """The sensor is on its side in 300 of 1500 windows, surely in a hand in the middle, perhaps around them."""
    force = np.tile([0.0, 1.0, 0.0], (1500, 1))
    force[600:900] = [1.0, 0.0, 0.0]
    noise = noise_of(windows(1500, force=force))
    sigma = noise.sigma()
    assert noise.riding[[500, 1000]].all() and not noise.riding[[580, 750, 920]].any()
    assert sigma[[580, 750], of.LEAN] == pytest.approx(np.array([0.2, 30.0]) * DEG * ROOT)
    assert sigma[580, MOTION] == pytest.approx(np.array([3.0, 1.0, 4.0]) * ROOT)
    assert sigma[580, eq.RESTING] == pytest.approx([0.5] * 3) and np.isinf(sigma[500, eq.RESTING]).all()


def test_outliers_weigh_less():
    """A residual of the process is an outlier over 4 sigmas. A residual of a measurement is an outlier over 2 sigmas,
    without the factor for the duration of a disturbance. The bias has no outliers."""
    robust = noise_of(windows()).robust(np.ones((20, eq.ROWS)), np.full((20, eq.ROWS), 4.0))[5]
    assert robust[: of.BIAS.start] == pytest.approx(np.full(5, np.sqrt(2.0)))
    assert robust[of.BIAS] == pytest.approx(np.ones(3))
    assert robust[eq.MEASURED_SPEED] == pytest.approx(np.hypot(1.0, 2.0))
    assert robust[eq.SLIDING] == pytest.approx(np.hypot(1.0, 4.0 * np.sqrt(5.0) / 2.0))


def test_roughness_follows_the_residuals():
    """In a rough ride, the residuals have the rms 0.38 (process) and 0.5 (measurements)."""
    residual = np.zeros((400, eq.ROWS))
    residual[:, [of.LEAN, of.PITCH, *MOTION]], residual[:, [eq.SLIDING, eq.CLIMBING]] = 0.38, 0.5
    for factor, misfit, roughness in (
        (1.0, 1.0, 1.0),
        (0.5, 1.0, 0.5),
        (0.01, 1.0, 0.1),
        (9.0, 1.0, 4.0),
        (0.01, 3.0, 0.42),
    ):
        noise = noise_of(windows(400))
        noise.misfit = np.full(400, misfit)
        noise.estimate_roughness(factor * residual)
        assert noise.roughness[200] == pytest.approx(roughness)


def test_unbalance_follows_the_force_to_the_side():
    """A force of 0.011 g changes its sign every 10 s, so means over 3 s keep its size, except at a change of sign. Of
    an error that lasts for 3 s, the variance of a mean over 3 s keeps 2 / e."""
    force = 0.011 * np.where(np.arange(2000) // 50 % 2, 1.0, -1.0)
    noise = noise_of(windows(2000))
    noise.estimate_unbalance(force, 3.0)
    assert noise.unbalance == pytest.approx(np.sqrt(0.8 / (2.0 * np.exp(-1.0))), abs=0.05)
    for lateral, over_s, limit in ((np.full(2000, 0.1), 3.0, 0.12), (1000.0 * force, 10.0, 6.0)):
        noise.estimate_unbalance(lateral, over_s)
        assert noise.unbalance == pytest.approx(limit)
    short = noise_of(windows(49))
    short.estimate_unbalance(force[:49], 3.0)
    assert short.unbalance == 1.0


def misfit_of(climbing, pitch=0.0, still=False, n=600):
    """Return the Noise after a residual CLIMBING, in standard deviations of a bike at 20 m/s."""
    noise = noise_of(windows(n), still=still, pitch=pitch)
    residual = np.zeros((n, eq.ROWS))
    residual[:, eq.CLIMBING] = climbing * climb(20.0)
    noise.estimate_misfit(residual)
    return noise


def lasting(size):
    """Return the misfit of a lasting residual, by hand: ten windows in a mean, and a usual value of a quarter."""
    return 10.0 * (size / np.hypot(1.0, size * np.sqrt(5.0) / 2.0)) ** 2 / 0.0625


def test_misfit_is_the_square_of_a_lasting_climb():
    swinging = 0.25 * np.where(np.arange(600) % 2, 1.0, -1.0)
    for climbing, still, misfit in ((0.1, False, lasting(0.1)), (0.05, False, 1.0), (0.25, False, 6.0)):
        noise = misfit_of(climbing, still=still)
        assert noise.misfit[300] == pytest.approx(misfit) and noise.doubtful.all() == (misfit == 6.0)
    assert misfit_of(swinging).misfit[300] == 1.0
    rest = misfit_of(0.25, still=True)
    assert rest.misfit[300] == 1.0 and not rest.doubtful.any()
