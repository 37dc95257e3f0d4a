"""Tests how a ride is cut for smoothing, and the values and messages of the result. The estimate is replaced."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from kickstand_tools.calibration.file import CalibrationFile
from kickstand_tools.checks.bends import LeftHanded
from kickstand_tools.common.errors import InputError
from kickstand_tools.estimation import smooth, unknowns as of
from kickstand_tools.estimation.windows import windows_of
from kickstand_tools.logs.log import Log, Stretch
from kickstand_tools.logs.reader import read_blocks

ALIGNED = CalibrationFile(aligned=True)


def standing(seconds, hz=10.0, frozen=()) -> Log:
    """A log of a bike that stands upright, with noise. frozen: (first, last) sample that repeats."""
    n = round(seconds * hz)
    noise = np.random.default_rng(1).normal(0.0, 0.002, (n, 6))
    if frozen:
        noise[slice(*frozen)] = noise[frozen[0]]
    return Log(np.arange(n) / hz, noise[:, :3] + [0.0, 1.0, 0.0], noise[:, 3:], name="n")


@pytest.fixture
def estimated(monkeypatch):
    """Replace the estimate: the lean of a sample is its time. Returns the list of (first s, last s, own samples)."""
    calls: list = []

    def estimated(self, segments, own):
        t_s = np.concatenate([segment.t_s for segment in segments])
        calls.append((t_s[0], t_s[-1], own.start, own.stop))
        return np.tile(t_s[:, None], (1, 5))

    monkeypatch.setattr(smooth.Smoother, "estimated", estimated)
    return calls


def test_a_short_ride_is_estimated_as_a_whole(estimated):
    found = smooth.smooth(standing(100.0), ALIGNED)
    assert estimated == [(0.0, pytest.approx(99.9), 0, 1000)]
    assert found.t_s.tolist() == found.lean_deg.tolist() == found.speed_mps.tolist() and len(found.t_s) == 1000


@pytest.mark.parametrize(
    ("segments", "calls"),
    [
        (8, [(0, 8, 0, 8)]),
        (9, [(0, 9, 0, 8), (1, 9, 7, 8)]),
        (10, [(0, 9, 0, 8), (2, 10, 6, 8)]),
        (17, [(0, 9, 0, 8), (7, 17, 1, 9), (9, 17, 7, 8)]),
    ],
)
def test_a_long_ride_is_estimated_in_parts_of_eight_segments(estimated, segments, calls, monkeypatch):
    """The estimate of a part also uses one segment before and one after the part. The estimate of the ride's last part
    also uses earlier segments, so that it uses eight segments. Each call is the range of the segments that it uses, and
    the range of the segments whose lean is wanted."""
    monkeypatch.setattr(smooth, "SEGMENT_S", 1.0)
    found = smooth.smooth(standing(float(segments)), ALIGNED)
    assert len(found.t_s) == 10 * segments and found.lean_deg == pytest.approx(found.t_s)
    assert [(round(first), round(last + 0.1), own / 10, end / 10) for first, last, own, end in estimated] == calls


def test_a_segment_lasts_two_minutes():
    cut = list(smooth._segments(read_blocks(standing(250.0, 1.0))))
    assert [(one.t_s[0], one.t_s[-1]) for one in cut] == [(0.0, 119.0), (120.0, 239.0), (240.0, 249.0)]


def test_frozen_readings_have_no_lean(estimated):
    found = smooth.smooth(standing(20.0, frozen=(50, 100)), ALIGNED)
    unknown = np.isnan(found.lean_deg)
    assert np.flatnonzero(unknown).tolist() == list(range(51, 100))
    assert found.lean_deg[~unknown].tolist() == found.t_s[~unknown].tolist()
    assert [notice.code for notice in found.notices] == ["frozen-readings"]


def test_a_stretch_has_its_own_samples(estimated):
    found = smooth.smooth(Stretch(standing(20.0), 5.0, 6.0), ALIGNED)
    assert found.lean_deg.tolist() == pytest.approx([5.0 + k / 10 for k in range(11)])
    assert estimated == [(0.0, pytest.approx(19.9), 0, 200)]


def test_what_cannot_be_smoothed_is_refused():
    with pytest.raises(InputError, match=r"^n: a car does not lean"):
        smooth.smooth(standing(5.0), CalibrationFile(aligned=True, vehicle="car"))
    with pytest.raises(InputError, match="is not aligned"):
        smooth.smooth(standing(5.0), CalibrationFile())
    with pytest.raises(InputError, match=r"^n: under 10 samples per second"):
        smooth.smooth(standing(9.0, 9.9), ALIGNED)


def test_a_single_sample_has_no_lean():
    (block,) = read_blocks(standing(0.1), minimum=1)
    found = smooth.Smoother(ALIGNED).estimated([block], slice(0, 1))
    assert found is not None and found.shape == (1, 5) and np.all(np.isnan(found))


def counted(*windows, odd=0.0):
    """A Smoother that has counted windows of (seconds, riding, doubtful, degrees of the pose)."""
    made = smooth.Smoother(ALIGNED)
    for seconds, riding, doubtful, pose_deg in windows:
        made.add(np.array([seconds]), np.array([riding]), np.array([doubtful]), np.radians(pose_deg))
    made._odd = odd
    return made


@pytest.mark.parametrize(
    ("windows", "codes"),
    [
        ([(10.0, False, True, 9.0)], []),
        ([(8.0, True, False, 0.0), (2.0, True, True, 0.0)], []),
        ([(7.9, True, False, 0.0), (2.1, True, True, 0.0), (99.0, False, False, 0.0)], ["not-the-bikes"]),
        ([(10.0, True, False, 1.79)], []),
        ([(10.0, True, False, 1.81)], ["pose-off"]),
        ([(10.0, True, False, -1.81)], ["pose-off"]),
        ([(1.0, True, False, -9.0), (9.0, True, False, 1.0)], []),
        ([(10.0, True, True, 2.0)], ["not-the-bikes", "pose-off"]),
    ],
)
def test_remarks_about_a_ride_have_their_limits(windows, codes):
    """A fifth of the riding may be doubtful, and the mean pose of the riding may be off by 1.8 degrees."""
    assert [remark.code for remark in counted(*windows).remarks([])] == codes


def test_a_faulty_gyro_is_the_only_remark():
    made = counted((10.0, True, True, 9.0), odd=5.4)
    (remark,) = made.remarks([])
    assert remark.code == "sensor-odd" and "would be 5 standard deviations" in remark.line()
    assert made.remarks([LeftHanded()]) == [] and counted(odd=5.4).remarks([]) == []


def test_figures_in_the_remarks():
    doubtful, pose = counted((6.0, True, True, -2.04), (4.0, True, False, -2.04)).remarks([])
    assert doubtful.line().startswith("in 60 % of the riding")
    assert "in balance 2.0 degrees to the left of" in pose.line()
    (right,) = counted((1.0, True, False, 3.0)).remarks([])
    assert "3.0 degrees to the right of" in right.line()


def sampled(states, sigma, rate, delay_s=0.0, n=20):
    """Return at_samples() of one window of n samples at 100 Hz, between two states of (lean, pitch, forward speed)."""
    t_s = np.arange(n) / 100.0
    rate = np.tile(rate, (n, 1))
    made = windows_of(t_s, np.tile([0.0, 1.0, 0.0], (n, 1)), rate, np.full(n, np.nan), np.zeros(n), aligned=True)
    count = len(made) + 1
    state = np.zeros((count, of.BIAS.stop))
    for place, (first, last) in zip((of.LEAN, of.PITCH, of.FORWARD), states, strict=True):
        state[:, place] = np.linspace(first, last, count)
    spread = np.zeros((count, of.BIAS.stop))
    spread[:, of.LEAN] = np.linspace(sigma[0], sigma[1], count)
    found: Any = SimpleNamespace(states=state, sigma=lambda: spread, unknowns=lambda number, middle: None)
    return made, smooth.at_samples(made, rate, found, delay_s)


@pytest.fixture
def plain(monkeypatch):
    """Leave the rates as they are, because the gyro has no errors."""
    monkeypatch.setattr(smooth, "corrected_rates", lambda rates, unknowns, warm: rates)
    monkeypatch.setattr(smooth, "jolted", lambda windows: np.zeros(len(windows)))


def test_values_between_the_edges_of_windows_are_on_lines(plain):
    """The lean grows by 0.1 rad in the 0.2 s of the samples, as the rate of 0.5 rad/s says."""
    made, found = sampled([(0.0, 0.1), (0.0, 0.0), (10.0, 12.0)], (0.01, 0.01), (0.0, 0.0, 0.5))
    share = (np.arange(20) + 0.5) / 20.0
    assert found[:, 0] == pytest.approx(0.1 * share, abs=1e-9)
    assert found[:, 3] == pytest.approx(10.0 + 2.0 * share)
    spread = np.sqrt(0.01**2 + (0.002 * 0.5) ** 2 + (0.001 * 0.1 * share) ** 2)
    assert found[:, 1] == pytest.approx(spread) and np.all(found[:, 2] == 0.0)
    assert made.edges[-1] - made.edges[0] == pytest.approx(0.2)


def test_a_wrong_rate_is_corrected_over_the_window(plain):
    """The lean stays the same at both edges, so the mean rate of 0.5 rad/s is an error, and has no effect."""
    _, found = sampled([(0.3, 0.3), (0.0, 0.0), (0.0, 0.0)], (0.0, 0.0), (0.0, 0.0, 0.5))
    assert found[:, 0] == pytest.approx(np.full(20, 0.3))


def test_the_delay_of_the_gyro_is_made_up_for(plain):
    _, found = sampled([(0.0, 0.1), (0.0, 0.0), (0.0, 0.0)], (0.0, 0.0), (0.0, 0.0, 0.5), delay_s=0.02)
    assert found[0, 0] == pytest.approx(0.1 * 0.5 / 20 + 0.02 * 0.5)


def test_a_pitch_turns_yaw_into_roll(plain):
    """With the nose up by 0.2 rad, a yaw rate of 1 rad/s reduces the roll rate by tan(0.2)."""
    _, found = sampled([(0.0, 0.0), (0.2, 0.2), (0.0, 0.0)], (0.0, 0.0), (0.0, 1.0, 0.0), delay_s=0.01)
    assert found[:, 0] == pytest.approx(np.full(20, -0.01 * np.tan(0.2))) and found[:, 2] == pytest.approx([0.2] * 20)


def test_a_jolt_is_uncertain_in_the_middle_of_a_window(plain, monkeypatch):
    monkeypatch.setattr(smooth, "jolted", lambda windows: np.full(len(windows), 0.05))
    _, found = sampled([(0.0, 0.0), (0.0, 0.0), (0.0, 0.0)], (0.0, 0.0), (0.0, 0.0, 0.0))
    share = (np.arange(20) + 0.5) / 20.0
    assert found[:, 1] == pytest.approx(0.1 * np.sqrt(share * (1.0 - share)))


def test_the_oddness_is_the_largest_error_of_the_gyro():
    mean, sigma = np.zeros(of.PARAMETERS), np.ones(of.PARAMETERS)
    sigma[of.GYRO] = 0.01
    parameters = np.zeros((2, of.PARAMETERS))
    parameters[1, of.GYRO.start], parameters[0, of.GYRO.stop - 1] = -0.045, 0.02
    parameters[:, of.HEIGHT] = 99.0
    found: Any = SimpleNamespace(parameters=parameters, prior=SimpleNamespace(mean=mean, sigma=sigma))
    assert smooth.oddness(found) == pytest.approx(4.5)
