"""Road, suspension and engine of the simulated ride."""

import numpy as np
import pytest
from kickstand.units import STANDARD_GRAVITY
from kickstand_tools.simulation.physics import road
from kickstand_tools.simulation.physics.bike import Bike
from kickstand_tools.simulation.physics.engine import crank_rpm, vibration

RATE = 1000.0


def over(speed: float, roughness: float, seconds: float = 40.0, seed: int = 0) -> road.Shaking:
    chance = np.random.default_rng(seed)
    distance = np.linspace(0.0, speed * seconds, int(seconds * RATE))
    surface = road.profile_slope(chance, float(distance[-1]) + 10.0, roughness)
    return road.shaking(chance, distance, np.full(len(distance), speed), surface, Bike(), RATE)


def test_the_profile_has_the_standards_density():
    """In ISO 8608, the power density of the height of a class B road is 64e-6 m^3 at 0.1 cycles/m. The power density
    falls with the square of the spatial frequency."""
    step = 0.02
    slope = road.profile_slope(np.random.default_rng(1), 40000.0, road.CLASS_B)
    n = 2**14
    rows = slope[: len(slope) // n * n].reshape(-1, n) * np.hanning(n)
    density = 2.0 * step * np.mean(np.abs(np.fft.rfft(rows)) ** 2, axis=0) / np.sum(np.hanning(n) ** 2)
    waves = np.fft.rfftfreq(n, step)
    for wave in (0.1, 0.5, 1.0):
        near = np.abs(waves - wave) < 0.05
        displacement = density[near] / (2.0 * np.pi * waves[near]) ** 2
        assert np.mean(displacement * (waves[near] / 0.1) ** 2) == pytest.approx(road.CLASS_B, rel=0.25)


def test_ordinary_road_at_90_has_peaks_of_0_3_to_0_5_g():
    heave = over(25.0, road.CLASS_B).heave / STANDARD_GRAVITY
    assert 0.3 < np.percentile(np.abs(heave), 99.9) < 0.6


def test_shaking_grows_with_roughness_and_speed():
    fine, rough = over(15.0, road.CLASS_A), over(15.0, road.CLASS_C)
    assert np.std(rough.heave) / np.std(fine.heave) == pytest.approx(4.0, rel=0.01)
    assert np.std(over(25.0, road.CLASS_B).heave) > 1.5 * np.std(over(6.0, road.CLASS_B).heave)


def test_bumps_have_the_requested_height():
    slope = np.zeros(2000)
    road.add_bumps(slope, [10.0], height_m=0.04, length_m=0.8)
    height = np.cumsum(slope) * 0.02
    assert height.max() == pytest.approx(0.04, rel=0.02)
    assert abs(height[-1]) < 1e-4


def test_the_front_wheel_meets_a_bump_first():
    chance = np.random.default_rng(0)
    distance = np.linspace(0.0, 40.0, 4000)
    slope = np.zeros(3000)
    road.add_bumps(slope, [20.0], 0.05, 0.6)
    shaken = road.shaking(chance, distance, np.full(4000, 10.0), slope, Bike(), RATE)
    nose_up, lifted = np.argmax(shaken.pitch > 0.003), np.argmax(shaken.heave > 1.0)
    assert 0.05 < (lifted - nose_up) / RATE < 0.25  # the wheelbase of 1.43 m takes 0.14 s at 10 m/s


def test_lowest_gear_under_the_shift_speed_is_used():
    """The six gears give 370, 260, 205, 170, 150 and 135 /min per m/s. The clutch slips at low speed. The last gear has
    no upper limit."""
    rpm = {0.0: 1250.0, 3.0: 1250.0, 10.0: 3700.0, 15.0: 3900.0, 24.0: 4920.0, 29.0: 4930.0, 33.0: 4950.0, 40.0: 5400.0}
    for mps, wanted in rpm.items():
        assert crank_rpm(np.full(2000, mps), 5000.0, RATE)[1000] == pytest.approx(wanted), mps


def test_engine_shakes_at_its_three_orders():
    """A four-stroke engine fires once in two revolutions. 3900 /min are 65 Hz."""
    n = 20000
    force, rates = vibration(np.random.default_rng(2), np.full(n, 15.0), np.ones(n), 0.1, 5000.0, RATE)
    for shaken in np.column_stack((force, rates)).T:
        power = np.abs(np.fft.rfft(shaken)) ** 2
        waves = np.fft.rfftfreq(n, 1.0 / RATE)
        shares = [np.sum(power[np.abs(waves - at) < 0.2]) / np.sum(power) for at in (32.5, 65.0, 130.0)]
        assert sum(shares) == pytest.approx(1.0, abs=0.01)
        assert min(shares) > 1e-4
    assert np.std(rates) / np.std(force) == pytest.approx(np.radians(15.0) / STANDARD_GRAVITY, rel=0.2)


def test_engine_vibration_grows_with_the_square_of_its_speed():
    def size(mps: float, rms_g: float) -> float:
        force, _ = vibration(np.random.default_rng(2), np.full(4000, mps), np.ones(4000), rms_g, 5000.0, RATE)
        return float(np.sqrt(np.mean(force**2)) / STANDARD_GRAVITY)

    force, rates = vibration(np.random.default_rng(2), np.full(200, 15.0), np.zeros(200), 0.2, 5000.0, RATE)
    assert not force.any() and not rates.any(), "it is off"
    full = 6000.0 / 135.0
    assert size(full, 0.1) == pytest.approx(0.1, rel=0.02)
    assert size(15.0, 0.1) == pytest.approx(0.1 * (0.25 + 0.75 * (3900.0 / 6000.0) ** 2), rel=0.02)
    assert size(full, 0.7) == pytest.approx(0.5, rel=0.02)
