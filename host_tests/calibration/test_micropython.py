"""MicroPython computes the mathematics of the calibrations as CPython does, within the precision of 32-bit floats."""

import numpy as np
import pytest
from motions import SIDES, leaned, random_rotation, still, tipped
from support import engines

CHANCE = np.random.default_rng(3)
MOUNTING = random_rotation(CHANCE)
TIPPED = np.array([tipped(side, 10.0, CHANCE) for side in SIDES]).tolist()
COUNTS = [8192.0] * 3 + [-150.0] + [65.5] * 3
POSE = np.rint(still((0.1, 0.97, -0.2), 300, (12.0, -3.0, 0.4)) * COUNTS + CHANCE.normal(0, 5, (300, 7))).astype(int)
SHAKEN = POSE + np.outer(250 * np.sin(np.arange(300)), [1, 0, 0, 0, 0, 0, 0]).astype(int)
CALLS = {
    "cross": ([1.0, 2.0, -3.0], [0.5, -1.0, 2.0]),
    "rotate": (MOUNTING.ravel().tolist(), [1.0, 2.0, 3.0]),
    "angle": ([1, 0, 0], [np.cos(3.1), np.sin(3.1), 0]),
    "is_rotation": (MOUNTING.ravel().tolist(),),
    "apply": (
        [0.02, -0.03, 0.05],
        [0.98, 1.01, 1.03],
        [3.0, -12.0, 0.5],
        8192,
        65.5,
        [8000, -3000, 12, 9, 655, -99, 1],
    ),
    "closed_form": (TIPPED,),
    "fit": (TIPPED,),
    "side_of": (TIPPED[3],),
    "free_pose": ([0, 0, 0], [1, 1, 1], [0.6, 0.0, 0.8]),
    "two_position": ((MOUNTING.T @ leaned(-12)).tolist(), (MOUNTING.T @ leaned(0)).tolist(), "left"),
}
REFUSED = [
    ("capture", (SHAKEN.tolist(),)),
    ("two_position", ([0, 1, 0], [0, 1, 0], "left")),
    ("free_pose", ([0.05, 0, 0], [1, 1, 1], [0.6, 0.0, 0.8])),
]


def flat(answer):
    return [number for item in answer for number in flat(item)] if isinstance(answer, list) else [answer]


@pytest.fixture(scope="module", params=engines.ENGINES)
def answers(request):
    return engines.run(request.param, [*CALLS.items(), ("capture", (POSE.tolist(),)), *REFUSED])


def test_the_results_are_those_of_cpython(answers):
    for (name, arguments), answer in zip(CALLS.items(), answers):
        assert flat(answer) == pytest.approx(flat(engines.run("cpython", [(name, arguments)])[0]), abs=1e-4), name


def test_a_still_pose_is_averaged(answers):
    accel, gyro = answers[len(CALLS)]
    assert accel == pytest.approx(POSE[:, :3].mean(axis=0) / 8192, abs=1e-6)
    assert gyro == pytest.approx(POSE[:, 4:].mean(axis=0) / 65.5, abs=1e-5)


def test_refusals_are_words_that_fit_the_display(answers):
    for answer, words in zip(answers[-3:], ("vibration", "same", "the free pose reads")):
        assert words in engines.words(answer)
        assert all(len(line) <= 16 for line in answer["lcd"])
