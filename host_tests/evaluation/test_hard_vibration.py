"""Engine vibration can exceed the accelerometer's range without a sign in the readings, because the low-pass hides it.
The default range is therefore 16 g. The driver notices vibration that exceeds even this range.

The tests print the figures of how-it-works.md.
"""

import dataclasses

import numpy as np
import pytest
from kickstand_sim.simulation import ride as rides
from kickstand_sim.simulation.physics import road
from kickstand_sim.simulation.physics.chip import Chip
from kickstand_tools.replay.replay_engine import COLUMNS, Replay
from kickstand_workshop.evaluation.runs import as_log, calibrated_by_poses

pytestmark = pytest.mark.long
LEAN = COLUMNS.index("lean_deg")


def shaken(monkeypatch, profile, seed, factor, range_g, seconds):
    """Simulate a ride with `factor` times its engine vibration, measured with the accelerometer range range_g.

    Returns the ride, and the rms of the vibration per axis in g.
    """
    rms = []

    def harder(*arguments):
        monkeypatch.setattr(road, "_MAX_G", 0.5 * factor)
        force, rates = vibration(*arguments)
        rms.append(float(np.sqrt((force**2).mean())) * factor / 9.80665)
        return factor * force, min(factor, 4) * rates

    vibration, random = road.vibration, Chip.random
    with monkeypatch.context() as patch:
        patch.setattr(rides, "vibration", harder)
        patch.setattr(Chip, "random", lambda *a: dataclasses.replace(random(*a), accel_range_g=range_g), raising=False)
        return rides.ride(profile, seed, seconds), rms[0]


@pytest.mark.parametrize("seed", [1, 2])
def test_a_range_of_16_g_keeps_the_lean_where_8_g_loses_it(monkeypatch, seed):
    errors, shares = {}, {}
    for factor in (1.0, 80.0):
        for range_g in (8.0, 16.0):
            ride, rms_g = shaken(monkeypatch, "street", seed, factor, range_g, 180.0)
            replay = Replay(calibrated_by_poses(ride).to_firmware())
            steps = [(replay.step(*row[:2])[LEAN], replay.meter.trusted) for row in as_log(ride).rows()]
            lean_deg, shown = (np.array(column) for column in zip(*steps, strict=True))
            error = (lean_deg - ride.truth["lean_deg"])[shown]
            errors[factor, range_g], shares[factor, range_g] = float(np.sqrt((error**2).mean())), float(shown.mean())
            print(f"{rms_g:.1f} g rms, range {range_g:.0f} g: {errors[factor, range_g]:.2f} degrees rms,", end=" ")
            print(f"shown {shares[factor, range_g]:.0%}")
    assert errors[1.0, 8.0] == pytest.approx(errors[1.0, 16.0], abs=0.01)
    assert max(errors.values()) < 2.0 and shares[80.0, 8.0] < 0.5
    assert min(shares[1.0, 8.0], shares[1.0, 16.0], shares[80.0, 16.0]) > 0.9
