"""Roads of ISO 8608, and imperfect mounts and loggers."""

import numpy as np
import pytest
from kickstand.units import STANDARD_GRAVITY
from kickstand_tools.simulation.physics.mount import MOUNTS, Holder
from kickstand_tools.simulation.physics.road import CLASSES
from kickstand_tools.simulation.ride import ride
from kickstand_workshop.evaluation.bands import BANDS_HZ, QUANTITIES, bands_of, of_simulated


@pytest.fixture(scope="module")
def rides():
    made = {}

    def get(road=None, mount=None):
        if (road, mount) not in made:
            made[road, mount] = ride("street", 3, 40.0, road=road, mount=mount)
        return made[road, mount]

    return get


def in_vehicle(made):
    """Return the force in g and the rates in deg/s along the vehicle's axes, while the bike rides."""
    riding = made.truth["speed_mps"] > 5.0
    turned = made.vehicle_from_sensor.T
    return (made.readings[:, :3] @ turned)[riding], (made.readings[:, 4:7] @ turned)[riding]


def test_each_road_class_is_twice_as_rough(rides):
    """Each road class has four times the power of the class before it. On the quietest road the engine adds to the
    vibration. Apart from the road class, the rides differ only in rider and camber."""
    assert np.array_equal(rides("A").truth["speed_mps"], rides("D").truth["speed_mps"])
    off = rides("C").truth["lean_deg"] - rides().truth["lean_deg"]
    assert 0.1 < np.sqrt(np.mean(off**2)) < 2.0
    forces = [bands_of(*in_vehicle(rides(road)), 200.0)[QUANTITIES[0]] for road in CLASSES]
    bands = np.array([force[3] for force in forces])  # the band of 1 to 3 Hz, in which the springs resonate
    assert np.all((bands[1:] / bands[:-1] > 1.7) & (bands[1:] / bands[:-1] < 2.2))


def test_holder_resonates_at_its_frequency():
    """The gain is 1 / (2 damping) at the natural frequency, and 1 far below it."""
    rate_hz, time = 1000.0, np.arange(20_000) / 1000.0
    holder = Holder(np.full(3, 10.0), np.full(3, 0.05), np.zeros(3))
    for hz, least, most in ((1.0, 0.99, 1.03), (10.0, 9.5, 10.5), (50.0, 0.0, 0.12)):
        shaken = np.tile(np.sin(2.0 * np.pi * hz * time)[:, None], (1, 3))
        force, rates = holder.shaken(shaken, shaken, rate_hz)
        for found in (force, rates):
            assert np.all(np.abs(found[5000:15000]).max(axis=0) > least)
            assert np.all(np.abs(found[5000:15000]).max(axis=0) < most)


def test_gyro_measures_the_sagging_of_a_holder():
    holder = Holder(np.full(3, 20.0), np.full(3, 0.5), np.radians([1.0, 0.0, 1.0]))
    pushed = np.zeros((8000, 3))
    pushed[:, 1] = 1.0
    pushed[3000:5000, 2] = 0.5  # two seconds of a force of 0.5 g forward
    force, rates = holder.shaken(pushed, np.zeros((8000, 3)), 1000.0)
    assert np.sum(rates[2000:4000, 0]) / 1000.0 == pytest.approx(0.5, abs=0.02)
    lean_of_force = np.degrees(np.arctan2(force[4000, 2] - 0.5, force[4000, 1]))
    assert abs(lean_of_force) == pytest.approx(0.5, abs=0.02)


@pytest.mark.parametrize("mount", MOUNTS)
def test_bad_mount_changes_readings_but_not_the_ride(rides, mount):
    firm, bad = rides("D"), rides("D", mount)
    assert np.array_equal(firm.truth["lean_deg"], bad.truth["lean_deg"])
    assert not np.allclose(firm.readings, bad.readings, atol=0.01)


def test_aliased_engine_vibration_appears_at_low_frequencies(rides):
    """The road shakes the bike below 25 Hz. The additional vibration below 25 Hz is engine vibration above 100 Hz,
    aliased."""
    plain, aliased = (bands_of(*in_vehicle(rides("A", mount)), 200.0)[QUANTITIES[1]] for mount in (None, "aliasing"))
    assert aliased[4] > 1.05 * plain[4]


def test_bands_are_those_of_a_sine():
    time = np.arange(20_000) / 100.0
    force, rates = np.zeros((20_000, 3)), np.zeros((20_000, 3))
    force[:, 1] = 1.0 + 0.2 * np.sin(2.0 * np.pi * 2.0 * time)
    rates[:, 2] = 3.0 * np.sin(2.0 * np.pi * 0.2 * time)
    found = bands_of(force, rates, 100.0)
    assert found[QUANTITIES[0]] == pytest.approx([0.0, 0.0, 0.0, 0.2 / np.sqrt(2.0), 0.0], abs=0.003)
    assert found[QUANTITIES[4]] == pytest.approx([0.0, 3.0 / np.sqrt(2.0), 0.0, 0.0, 0.0], abs=0.05)


def test_simulated_roads_are_as_rough_as_real_ones():
    """A recorded ride through town has a vertical vibration of 0.078 g from 1 to 3 Hz and 0.151 g from 3 to 10 Hz, see
    tools/docs/simulation.md. The recorded values are between those of the simulated road classes C and D."""
    calm, rough = (of_simulated("street", 0, 100.0, road, None)[QUANTITIES[0]] for road in "CD")
    assert len(calm) == len(BANDS_HZ)
    assert calm[3] < 0.151 and rough[3] > 0.078


def test_given_dive_is_used():
    """The rest of the ride is the same. The springs turn the sensor, but the road is unchanged."""
    soft, stiff = (ride("track", 3, 60.0, dive=dive) for dive in ((6.0, 3.0), (0.0, 0.0)))
    assert np.array_equal(soft.truth["slope_deg"], stiff.truth["slope_deg"])
    push = np.gradient(soft.truth["speed_mps"]) * soft.rate_hz / STANDARD_GRAVITY
    nose = soft.truth["pitch_deg"] - stiff.truth["pitch_deg"]
    for part, per_g in ((push < -0.25, 6.0), (push > 0.25, 3.0)):
        assert nose[part] @ push[part] / (push[part] @ push[part]) == pytest.approx(per_g, rel=0.15)
