"""A profile and a seed give the same ride as in earlier versions, because published figures depend on it.

The figures in this file describe the plans of each profile, and one ride. If you change a profile on purpose, update
its line.
"""

import numpy as np
import pytest
from kickstand_tools.simulation.physics.bike import Bike
from kickstand_tools.simulation.plan import Plan
from kickstand_tools.simulation.profiles import PROFILES
from kickstand_tools.simulation.ride import ride

SEEDS = range(8)
OTHERS = ("slope_percent", "hang_m", "lift_deg", "engine", "crosswind_mps2", "bank_deg")


def figures(name: str) -> list[float]:
    """Return seven figures of a profile's plans, each summed over all seeds.

    The first is the number of legs. The next five are sums over the legs: duration, speed, lean, roll time, and all
    other values. In the sums over the legs each value is multiplied by the number of its leg. The last is a sum of the
    conditions.
    """
    found = np.zeros(7)
    for seed in SEEDS:
        plan = Plan(np.random.default_rng([seed, *name.encode()]), 400.0)
        made = PROFILES[name](plan)

        def weighted(field: str, legs=plan.legs) -> float:
            return sum(k * float(getattr(leg, field) or 0.0) for k, leg in enumerate(legs, 1))

        bumps = sum(sum(one[1:]) for one in made.bumps)
        weather = made.gust_mps2 + 100.0 * made.sway_m + made.start_c + made.rise_c + made.drift + made.creep_deg
        engine = made.engine_rms_g + made.shift_rpm / 1e3
        found += [
            len(plan.legs), *(weighted(field) for field in ("seconds", "speed_mps", "lean_deg", "roll_s")),
            sum(weighted(field) for field in OTHERS),
            1e6 * made.roughness + engine + made.unrest_deg + weather + bumps,
        ]  # fmt: skip
    return found.tolist()


KNOWN = {
    "street": [747, 161413.6, 525365, 8347.784, 44100.72, 200.0793, 987.0019],
    "track": [888, 192649.3, 1588929, 18676.65, 51417.88, 2758.906, 462.9391],
    "sweeper": [232, 55115.33, 49969.79, 212.109, 5058.674, 134.2809, 640.9512],
    "city": [704, 151358, 184976.4, -17950.33, 35885.82, -723.2178, 1284.851],
    "hills": [1085, 231488.1, 848618.6, 2624.768, 89707.39, 11713.46, 898.3385],
    "held": [128, 34159.76, 13072.58, 123.2281, 1688, 125.1425, 837.1124],
    "corners": [564, 119982.3, 496749.9, 6770.338, 21754.53, 2575.157, 437.5505],
    "banked": [755, 161870, 526882.9, -2870.1, 45234.56, 108845.6, 953.5322],
    "wheelie": [1066, 227808.8, 706621.7, -2956.466, 96296.2, 268068.3, 796],
    "bumps": [1198, 249588, 1200527, 59018.13, 97466.77, 4909.045, 2349.72],
    "crosswind": [748, 162144.5, 531173.9, -4961.57, 44585.41, 3259.215, 891.4846],
    "weight": [746, 163021.8, 539627.7, -6579.66, 44532.8, 3337.089, 852.2092],
    "vibration": [760, 160089.4, 572002.7, -10000.75, 45887.59, 653.1471, 812],
    "creep": [774, 167427.1, 567001.1, -6767.294, 48524.16, 2468.027, 903.4809],
    "temperature": [781, 169834.2, 595898.4, -21795.41, 48002.65, 3232.648, 975.4828],
    "fall": [880, 183353.5, 327342.6, 7854.223, 62215.4, -4869.428, 796],
    "parked": [296, 66600, 0, 16966.31, 8436, -94.50129, 796],
}

BIKES = [
    4.972957,
    2.105224,
    0.4931087,
    0.1752672,
    11.56755,
    5.752787,
    5.993878,
    -0.2550848,
    25.00029,
    11.50013,
    13.90743,
    3.908052,
    3.2,
]
PROCEDURE = [0.3769084, 0.4134439, 0.3870794, 22.32059, 11.45963, 19.6481, 15.72397]
RIDE = [
    0.5444498,
    0.5243995,
    0.4558296,
    22.7288,
    5.169281,
    5.649512,
    9.037969,
    49.38899,
    0.04209731,
    0.01002655,
    0.6424008,
    0.8010699,
    -0.2593246,
    -0.9271915,
    -0.1762091,
    -0.1135757,
    -0.930123,
    -0.2875156,
    -10.40909,
    20.80938,
]


@pytest.mark.parametrize("name", PROFILES)
def test_a_seed_gives_the_plan_of_earlier_versions(name):
    assert figures(name) == pytest.approx(KNOWN[name], rel=1e-5)


def test_a_seed_gives_the_bike_of_earlier_versions():
    """The compared numbers are sums over eight bikes."""
    bikes = [Bike.random(np.random.default_rng(seed)) for seed in SEEDS]
    found = [sum(getattr(one, field) for one in bikes) for field in vars(bikes[0])]
    assert found == pytest.approx(BIKES, rel=1e-5)


def test_a_seed_gives_the_ride_of_earlier_versions():
    """The compared numbers are the mean absolute readings and true values of a ride on a rough road with a poor mount,
    and its poses."""
    made = ride("fall", 1, 35.0, road="D", mount="holder")
    found = [*np.abs(made.readings).mean(axis=0), *np.abs(np.array(list(made.truth.values()))).mean(axis=1)]
    found += [*made.kickstand.mean(axis=0)[:3], *made.upright.mean(axis=0)[:3], made.stand_deg, made.home_c]
    assert [float(value) for value in found] == pytest.approx(RIDE, rel=1e-4)


def test_a_seed_gives_the_procedure_of_earlier_versions():
    """The compared numbers are the mean absolute readings while a hand turns the sensor between its six positions."""
    made = ride("parked", 1, 20.0)
    assert np.abs(made.procedure).mean(axis=0).tolist() == pytest.approx(PROCEDURE, rel=1e-4)
