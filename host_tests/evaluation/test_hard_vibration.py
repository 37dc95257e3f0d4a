"""Engine vibration can exceed the accelerometer's range without a sign in the readings, because the low-pass hides it.
The default range is therefore 16 g. The driver notices vibration that exceeds even this range."""

import dataclasses
from array import array

import numpy as np
import pytest
from kickstand.imu.fifo_frames import DUE, AxisWatch, add_up
from kickstand_tools.simulation import ride as rides
from kickstand_tools.simulation.physics import engine
from kickstand_tools.simulation.physics.chip import Chip
from kickstand_workshop.evaluation import estimators
from kickstand_workshop.evaluation.runs import as_log, calibrated_by_poses


def shaken(monkeypatch, profile, seed, factor, range_g, seconds):
    """Simulate a ride with stronger engine vibration, measured with the accelerometer range range_g.

    Returns:
        The ride, with its vibration multiplied by `factor`.
        The rms of the ride's vibration per axis, in g.
    """
    rms = []

    def harder(*arguments):
        monkeypatch.setattr(engine, "_MAX_G", 0.5 * factor)
        force, rates = vibration(*arguments)
        rms.append(float(np.sqrt((force**2).mean())) * factor / 9.80665)
        return factor * force, min(factor, 4) * rates

    vibration, random = engine.vibration, Chip.random
    with monkeypatch.context() as patch:
        patch.setattr(rides, "vibration", harder)
        patch.setattr(Chip, "random", lambda *a: dataclasses.replace(random(*a), accel_range_g=range_g), raising=False)
        return rides.ride(profile, seed, seconds), rms[0]


@pytest.mark.nightly
@pytest.mark.parametrize("seed", [1, 2])
def test_a_range_of_16_g_keeps_the_lean_where_8_g_loses_it(monkeypatch, seed):
    errors = {}
    for factor in (1.0, 80.0):
        for range_g in (8.0, 16.0):
            made, rms_g = shaken(monkeypatch, "street", seed, factor, range_g, 180.0)
            meter = estimators.replay_engine.Replay(calibrated_by_poses(made).to_firmware())
            lean = [meter.step(time_us, reading)[estimators._SHOWN] for time_us, reading, _ in as_log(made).rows()]
            errors[factor, range_g] = float(np.sqrt(((np.array(lean) - made.truth["lean_deg"]) ** 2).mean()))
            print(f"{rms_g:.1f} g rms, range {range_g:.0f} g: {errors[factor, range_g]:.2f} degrees rms")
    assert errors[1.0, 8.0] == pytest.approx(errors[1.0, 16.0], abs=0.01)
    assert errors[80.0, 8.0] > 5.0 and errors[80.0, 16.0] < 1.0


@pytest.mark.parametrize(("factor", "least", "most"), [(1.0, 0.0, 0.0), (10.0, 0.0, 0.0), (40.0, 0.5, 1.0)])
def test_vibration_beyond_16_g_hides_the_lean(monkeypatch, factor, least, most):
    made, rms_g = shaken(monkeypatch, "vibration", 1, factor, 16.0, 60.0)
    readings = made.readings
    counts = np.column_stack((readings[:, :3] * 2048, readings[:, 3], readings[:, 4:] * 65.5))
    axes, sums, hidden = AxisWatch(200, 3, 1, 3, 20), array("i", [0] * 7), 0
    for row in np.clip(np.round(counts), -32768, 32767).astype(">i2"):
        add_up(bytearray(row.tobytes()), 1, sums, axes.notes)
        if axes.notes[DUE] <= 0:
            axes.look()
        hidden += axes.fault is not None
    print(f"{rms_g:.1f} g rms: hidden for {hidden / len(counts):.0%}")
    assert least <= hidden / len(counts) <= most
