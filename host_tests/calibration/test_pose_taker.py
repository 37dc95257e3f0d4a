"""Tests how the device waits for a still pose and captures it. The sensor has 8192 counts per g and 65.5 counts per
deg/s."""

import pytest
from kickstand.calibration.pose_taker import AVERAGING, DONE, SETTLED, SETTLING, PoseTaker
from kickstand.errors import CaptureError
from test_still_pose import LEVEL, samples


class Chip:
    accel_lsb_per_g, gyro_lsb_per_dps, SATURATED = 8192, 65.5, 32700


def taker():
    """Return a PoseTaker for 100 samples per second. The PoseTaker needs 50 still samples, then averages 300 samples,
    and gives up after 1000 samples."""
    return PoseTaker(Chip, 100, 3.0)


def step(taking, row):
    """Pass a sample to the PoseTaker. Return the result of its step(), or the code of the CaptureError."""
    try:
        return taking.step(row)
    except CaptureError as error:
        return error.code


def moving(k):
    row = list(LEVEL)
    row[k % 3] += 2000 * (k % 5)
    return row


def test_half_a_second_of_stillness_then_three_seconds_are_taken():
    taking = taker()
    assert taking.progress() == (0, 300)
    rows = samples(351)
    states = []
    for k, row in enumerate(rows):
        states.append(taking.step(row))
        assert not taking.restless
        if k == 60:
            assert taking.progress() == (11, 300)
    assert states[:350] == [SETTLING] * 49 + [SETTLED] + [AVERAGING] * 299 + [DONE]
    assert states[350] not in (SETTLING, SETTLED, AVERAGING, DONE)
    assert taking.settled == pytest.approx([LEVEL[i] / 8192 for i in range(3)])
    assert taking.pose.count == 300
    assert taking.pose.gyro == pytest.approx([LEVEL[i] / 65.5 for i in (4, 5, 6)])


def test_missing_stillness_is_reported_after_a_second():
    taking = taker()
    for k in range(100):
        assert taking.step(moving(k)) == SETTLING
        assert not taking.restless
    for k in range(100, 130):
        assert taking.step(moving(k)) == SETTLING
        assert taking.restless
    states = [taking.step(row) for row in samples(60)]
    assert states.count(SETTLED) == 1
    assert states[-1] == AVERAGING
    assert not taking.restless


@pytest.mark.parametrize("code", ["moved", "frozen-pose"])
def test_it_gives_up_after_10_seconds(code):
    taking = taker()
    states = [step(taking, moving(k) if code == "moved" else list(LEVEL)) for k in range(1200)]
    assert states.count(code) == 1
    waited = states.index(code) + 1
    assert waited == 1000 if code == "frozen-pose" else 1000 <= waited <= 1050
    assert set(states[: waited - 1]) == {SETTLING}
    assert not taking.restless


def test_a_pose_spoilt_by_a_knock_can_be_repeated():
    taking = taker()
    rows = samples(100)
    rows[80][1] += 1000
    states = [step(taking, row) for row in rows]
    assert states[79:81] == [AVERAGING, "moved"]
    assert "moved" not in states[81:]
    assert taking.progress() == (0, 300)
    taking.restart()
    assert taking.settled is None
    assert [taking.step(row) for row in samples(350)][-1] == DONE
