"""Tests which motions spoil a still pose, one axis at a time. The sensor has 8192 counts per g and 65.5 counts per
deg/s. test_calibration.py tests other causes of a spoilt pose."""

import math

import pytest
from kickstand.calibration.still_pose import StillPose
from kickstand.errors import CaptureError

LEVEL: tuple[int, ...] = (100, -200, 8192, -521, 65, -131, 655)


def samples(count=100):
    """Return samples at rest with noise of one count in each reading. The mean of the noise is zero in both halves."""
    return [[value + (-1) ** k for value in LEVEL] for k in range(count)]


def finished(rows, expected=None, limit=32700):
    pose = StillPose(8192, 65.5, limit, expected or len(rows))
    for row in rows:
        pose.add(row)
    try:
        pose.finish()
    except CaptureError:
        assert pose.accel is None
        raise
    return pose


def problem_of(rows, **settings):
    try:
        finished(rows, **settings)
    except CaptureError as error:
        return error.code
    return None


@pytest.mark.parametrize("axis", [0, 1, 2, 4, 5, 6])
@pytest.mark.parametrize("sign", [-1, 1])
def test_a_knock_about_or_along_any_axis_spoils_the_pose(axis, sign):
    """A single sample that differs too much from the first one spoils the pose. The sample changes the mean too little
    to be noticed by the other limits."""
    peak = 0.08 * 8192 if axis < 3 else 5.0 * 65.5
    for at in (1, 50, 99):
        for share, code in ((0.8, None), (1.2, "moved")):
            rows = samples()
            rows[at][axis] = rows[0][axis] + sign * round(share * peak)
            assert problem_of(rows) == code


def test_a_pose_has_at_least_20_samples():
    assert problem_of(samples(20)) is None
    with pytest.raises(CaptureError) as refusal:
        finished(samples(19))
    assert (refusal.value.code, refusal.value.values) == ("too-few", (19, 20))
    assert problem_of(samples(21)) is None


def test_readings_that_never_change_are_frozen():
    rows = [list(LEVEL) for _ in range(100)]
    assert problem_of(rows) == "frozen-pose"
    for row in rows:
        row[3] = row[3] + 1  # the temperature is the only reading that changes
    rows[50][3] += 7
    assert problem_of(rows) == "frozen-pose"


@pytest.mark.parametrize(
    ("axis", "code"),
    [(0, "stuck-accel"), (1, "stuck-accel"), (2, "stuck-accel"), (4, "dead-gyro"), (5, "dead-gyro"), (6, "dead-gyro")],
)
def test_each_axis_has_to_change_by_a_count_now_and_then(axis, code):
    rows = [[*row[:axis], LEVEL[axis], *row[axis + 1 :]] for row in samples()]
    assert problem_of(rows) == code
    rows[50][axis] += 1
    assert problem_of(rows) is None


@pytest.mark.parametrize("axis", [4, 5, 6])
def test_a_noisy_gyro_spoils_the_pose_and_a_sway_does_not(axis):
    for dps, code in ((0.5, None), (0.7, "noisy-gyro")):
        rows = samples(600)
        for k, row in enumerate(rows):  # add noise with the rms `dps`
            row[axis] += round((-1, 1, 1, -1)[k % 4] * dps * 65.5)
        assert problem_of(rows) == code
    rows = samples(600)
    for k, row in enumerate(rows):
        row[axis] += round(2.0 * 65.5 * math.sin(2 * math.pi * k / 300))
    assert problem_of(rows) is None


@pytest.mark.parametrize("axis", [4, 5, 6])
@pytest.mark.parametrize(("rate_dps", "code"), [(-46, "gyro-offset"), (-44, None), (44, None), (46, "gyro-offset")])
def test_a_large_gyro_offset_spoils_the_pose(axis, rate_dps, code):
    rows = [[*row[:axis], round(rate_dps * 65.5) + k % 2, *row[axis + 1 :]] for k, row in enumerate(samples())]
    assert problem_of(rows) == code
