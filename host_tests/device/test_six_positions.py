"""A rider calibrates the sensor by the six positions: the display leads through them, and refuses what is wrong."""

import re

import pytest
from kickstand.calibration.store import Store
from kickstand_sim.simulation.scripted import sensor_errors
from support import engines
from support.device_plans import ALIGNED, LEFT_S, RIGHT_S, STRAIGHT_S, spoilt

UPS = [[1, 0, 0], [0, 0, -1], [0, 1, 0], [-1, 0, 0], [0, 0, 1], [0, -1, 0]]
CHOOSE = [[2, 1.2], [4, 0.15], [5, 1.2]]  # the presses that choose the six positions in the menu
SLANTED = [0.5, 0.6, -0.7]
BIAS_X = sensor_errors.Sensor(seed=3).gyro_bias_dps[0]


def six_positions(free=SLANTED, turn_s=1.0, again=()):
    """Return a plan: the rider holds the six sides, and a free pose, for 5 s each.

    free: direction up in the free pose, in the sensor's axes. turn_s: time of the turn between two poses.
    again: sides that are held twice.
    """
    steps, t_s = [[0, None]], 6.0
    for up in [*UPS[:3], *again, *UPS[3:], free]:
        steps += [[t_s, up], [t_s + 6 - turn_s, None]]
        t_s += 6.0
    return {"poses": steps, "presses": CHOOSE, "until": t_s + 1, "seed": 3}


@pytest.mark.parametrize(
    "engine", [*engines.ENGINES[1:], pytest.param("cpython", marks=pytest.mark.long)], ids=["micropython", "cpython"]
)
def test_six_positions_then_alignment_of_a_part_with_errors(engine, run, tmp_path):
    """Afterwards the lean is right despite the sensor's errors, and the gyro's scale is known."""
    record = run(six_positions(), engine)
    assert record.first("any of the six") < record.first(r"Side \+x done") < 12
    assert record.first("Saved, err") < record.frames[-1][0] + 1
    stored = Store(0x68, 8, str(tmp_path)).load()
    scales = sensor_errors.Sensor(seed=3).gyro_scale
    assert [stored.gyro_matrix[i] for i in (0, 4, 8)] == pytest.approx([1 / scale for scale in scales], abs=0.004)
    assert all(0.0 < sigma < 0.02 for sigma in stored.gyro_sigma)
    ride = run({**ALIGNED, "seed": 3}, engine)
    assert ride.first("Aligned! +12.0°") < 18
    for t_s, lean in ((LEFT_S, -30), (RIGHT_S, 40), (STRAIGHT_S, 0)):
        assert ride.lean_at(t_s) == pytest.approx(lean, abs=2.5)


def gyro_x(change):
    """Return fit(board), which changes the gyro's rate about x by change(rate), but not its bias."""
    return spoilt(3, lambda rate: BIAS_X + change(rate - BIAS_X))


@pytest.mark.parametrize(
    ("plan", "fit", "words"),
    [
        (six_positions(), gyro_x(lambda rate: 0.5 * rate), ["Gyro x: -5[01] %"]),
        (six_positions(), gyro_x(lambda rate: -rate), ["Gyro x reversed"]),
        (six_positions(), gyro_x(lambda rate: 0.0), ["Gyro x dead"]),
        (six_positions(turn_s=0.15), None, ["Turned too fast", "turn it slower", "Slant it again"]),
        (six_positions([0.1, 0.1, 1.0], again=UPS[:1]), None, [r"Side \+x is done", "Slant it more"]),
    ],
    ids=["half", "reversed", "dead", "too fast", "not slanted"],
)
def test_unusable_positions_are_refused_by_name(plan, fit, words, run, tmp_path):
    record = run(plan, fit=fit)
    assert [word for word in words if record.first(word) == float("inf")] == []
    assert (re.search("another sensor|replace it", record.console) is not None) is (fit is not None)
    assert list(tmp_path.iterdir()) == []
