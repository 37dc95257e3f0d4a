"""Which motions spoil a still pose. The sensor has 8192 counts per g and 65.5 counts per deg/s."""

import math

import pytest
from kickstand.calibration.poses import StillPose
from kickstand.errors import CaptureError

LEVEL = (100, -200, 8192, -521, 65, -131, 655)
MOTIONS = 0, 1, 2, 4, 5, 6  # indices of forces and rates in a sample


def samples(count=100):
    """Return samples at rest with noise of one count in each reading. The mean of the noise is zero in both halves."""
    return [[value + (-1) ** k for value in LEVEL] for k in range(count)]


def problem_of(rows):
    """Return the code of the refusal of a pose, or None."""
    pose = StillPose(8192, 65.5, 32700, len(rows))
    try:
        for row in rows:
            pose.add(row)
        pose.finish()
    except CaptureError as refusal:
        assert pose.accel is None
        return refusal.code
    return None


@pytest.mark.parametrize("axis", MOTIONS)
@pytest.mark.parametrize("sign", [-1, 1])
def test_a_knock_along_or_about_any_axis_spoils_the_pose(axis, sign):
    """A single sample may differ from the first one by 0.08 g or by 5 deg/s."""
    peak = 0.08 * 8192 if axis < 3 else 5.0 * 65.5
    for row, share, code in ((1, 0.8, None), (1, 1.2, "moved"), (99, 1.2, "moved")):
        rows = samples()
        rows[row][axis] = rows[0][axis] + sign * round(share * peak)
        assert problem_of(rows) == code


@pytest.mark.parametrize(
    ("change", "code"),
    [
        (lambda k: [round(250 * math.sin(k)), 0, 0, 0, 0, 0, 0], "vibration"),
        (lambda k: [round(k * 8192 * math.radians(1.0) / 300), 0, 0, 0, 0, 0, 0], "tilting"),
        (lambda k: [0, 0, 32767 - 8193, 0, 0, 0, 0], "saturated"),
        (lambda k: [0, 0, 0, 0, 0, 0, 46 * 65], "gyro-offset"),
    ],
)
def test_a_pose_that_is_not_still_is_refused(change, code):
    rows = [[value + step for value, step in zip(row, change(k))] for k, row in enumerate(samples(300))]
    assert code in problem_of(rows)


def test_a_pose_has_at_least_20_samples():
    assert problem_of(samples(20)) is None
    assert problem_of(samples(19)) == "too-few"


def test_readings_that_never_change_are_frozen():
    rows = [[*LEVEL[:3], LEVEL[3] + k % 3, *LEVEL[4:]] for k in range(100)]  # only the temperature changes
    assert problem_of(rows) == "frozen-pose"


@pytest.mark.parametrize("axis", MOTIONS[3:])
def test_a_noisy_gyro_spoils_the_pose_and_a_sway_does_not(axis):
    def changed(change):
        rows = samples(600)
        for k, row in enumerate(rows):
            row[axis] += round(change(k) * 65.5)
        return problem_of(rows)

    assert changed(lambda k: 0.5 * (-1, 1, 1, -1)[k % 4]) is None
    assert changed(lambda k: 0.7 * (-1, 1, 1, -1)[k % 4]) == "noisy-gyro"
    assert changed(lambda k: 2.0 * math.sin(2 * math.pi * k / 300)) is None
