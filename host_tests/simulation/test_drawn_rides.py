"""The rides that are drawn at random: gravity at rest, and the standard's road. That two devices see the same bike and
its true lean, joining/test_compare.py shows."""

import numpy as np
import pytest
from drawn_rides import DRAWN, MOUNTS, _road, drawn_ride
from other_bike import FINE_HZ


@pytest.mark.parametrize(("mount", "kind"), list(zip(MOUNTS, DRAWN, strict=True)))
def test_at_rest_there_is_gravity_and_no_rate(mount, kind):
    ride = drawn_ride(5, 40.0, [mount], kind)
    still = ride.logs[0].part(ride.logs[0].t_s < 4.0)
    assert np.linalg.norm(still.accel_g.mean(axis=0)) == pytest.approx(1.0, abs=0.03)
    assert np.all(np.abs(still.gyro_dps.mean(axis=0)) < 1.0)


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
