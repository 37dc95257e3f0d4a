"""The rides that are drawn at random are rides: one motion, gravity at rest, and every device sees the same bike."""

import numpy as np
import pytest
from drawn_rides import DRAWN, MOUNTS, _road, drawn_ride
from other_bike import FINE_HZ

SHORT_S = 60.0


@pytest.fixture(scope="module")
def pair():
    return drawn_ride(3, SHORT_S, ["firm", "firm"])


def turned_back(ride, k):
    """Force (n, 3, g) and rates (n, 3, deg/s) along the bike's axes, as far as the poses were right."""
    log, about = ride.logs[k], ride.calibrations[k].vehicle_from_sensor
    return log.accel_g @ about.T, log.gyro_dps @ about.T


def test_two_devices_on_one_bike_lean_alike_and_sit_otherwise(pair):
    rolls = [turned_back(pair, k)[1][:, 2] for k in (0, 1)]
    assert np.corrcoef(*rolls)[0, 1] > 0.97
    assert not np.allclose(pair.logs[0].accel_g, pair.logs[1].accel_g, atol=0.1)


def test_the_roll_rate_is_the_change_of_the_true_lean(pair):
    log, (_, rates) = pair.logs[0], turned_back(pair, 0)
    since = np.cumsum(rates[:, 2] - rates[:400, 2].mean()) / 200.0
    later = np.searchsorted(log.t_s, 30.0)
    assert np.corrcoef(since[:later], pair.true_lean(0)[:later])[0, 1] > 0.95


@pytest.mark.parametrize(("mount", "kind"), list(zip(MOUNTS, DRAWN, strict=True)))
def test_at_rest_there_is_gravity_and_no_rate(mount, kind):
    ride = drawn_ride(5, 40.0, [mount], kind)
    force, rates = turned_back(ride, 0)
    still = ride.logs[0].t_s < 4.0
    assert np.linalg.norm(force[still].mean(axis=0)) == pytest.approx(1.0, abs=0.03)
    assert np.all(np.abs(rates[still].mean(axis=0)) < 1.0)


def test_the_road_is_the_standards():
    """Displacement over waves longer than the wheelbase: the spectrum is Gd(n0) (n / n0)^-2."""
    v, roughness = np.full(400 * FINE_HZ, 4.0), 64e-6
    hz = np.fft.rfftfreq(len(v), 1.0 / FINE_HZ)
    slow = (hz > 0.14) & (hz < 0.3)  # 0.035 to 0.075 cycles/m, below the springs' own
    powers = []
    for seed in range(6):
        rear, front = _road(np.random.default_rng(seed), v, 1.4, roughness)
        power = np.abs(np.fft.rfft(rear * np.hanning(len(rear)))) ** 2 / len(rear) * 2.0 / 0.375 / FINE_HZ
        powers.append(power[slow].sum())
        late = round(1.4 / 4.0 * FINE_HZ)
        assert np.corrcoef(front[:-late], rear[late:])[0, 1] > 0.99
    expected = roughness * (0.1 / (hz[slow] / 4.0)) ** 2 / 4.0
    assert np.mean(powers) == pytest.approx(expected.sum(), rel=0.25)
