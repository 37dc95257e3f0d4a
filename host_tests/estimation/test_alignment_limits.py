"""What an alignment from a ride assumes, which estimates it refuses, and how the lean and the lag of a ride follow."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from kickstand_tools.checks.handedness import RatesMisfit
from kickstand_tools.common.errors import RefusedInput
from kickstand_tools.estimation import alignment, unknowns as of
from kickstand_tools.estimation.first_guess import Axes
from kickstand_tools.logs.log import Log


def still_log(seconds: float, hz: float = 20.0) -> Log:
    n = round(seconds * hz)
    noise = np.random.default_rng(1).normal(0.0, 0.002, (n, 6))
    return Log(np.arange(n) / hz, noise[:, :3] + [0.0, 1.0, 0.0], noise[:, 3:], name="n")


@pytest.fixture(scope="module")
def windows():
    return alignment.mounted_windows(still_log(60.0))


TURN = np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])  # a quarter about forward


@pytest.fixture
def estimated(monkeypatch, windows):
    """Return a function that returns the arguments of the Estimate. change: the largest change in the last step."""

    def estimate(expected=None, change=0.0, fails=False):
        given: list[Any] = []

        def made(*arguments):
            given.extend(arguments)
            if fails:
                raise np.linalg.LinAlgError
            return SimpleNamespace(change=change)

        monkeypatch.setattr(alignment, "Estimate", made)
        alignment.estimate_alignment(windows, Axes(TURN, np.array([0.1, 0.2, 0.3])), expected)
        return given

    return estimate


def test_the_prior_of_an_alignment_knows_no_direction(estimated, windows):
    turned, prior, hypotheses = estimated()
    assert turned.force == pytest.approx(windows.force @ TURN.T)
    assert turned.rate == pytest.approx((windows.rate - [0.1, 0.2, 0.3]) @ TURN.T)
    assert prior.sigma[of.ROTATION].tolist() == [10.0] * 3 and prior.mean[of.ROTATION].tolist() == [0.0] * 3
    assert prior.sigma[of.ACCEL].tolist() == [0.012] * 9 and prior.sigma[of.BESIDE] == 0.005
    assert prior.sigma[of.OFFSET].tolist() == [0.04] * 3 and not prior.posed
    assert not prior.sigma[of.OFFSET_PER_C].any() and not prior.sigma[of.BIAS_PER_C].any()
    assert len(hypotheses.weight) == 1 and hypotheses.weight[0] == 1.0
    assert of.SIGMA[of.BESIDE] == 0.001 and of.MEAN[of.ROTATION].tolist() == [0.0] * 3  # these stay as they are


def test_a_named_mounting_is_the_prior_with_20_degrees(estimated):
    """The guess differs from the named mounting by 0.1 rad about forward."""
    c, s = np.cos(0.1), np.sin(0.1)
    prior = estimated(np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]) @ TURN)[1]
    assert prior.sigma[of.ROTATION] == pytest.approx(np.radians([20.0] * 3))
    assert prior.mean[of.ROTATION] == pytest.approx([0.0, 0.0, 0.1])


@pytest.mark.parametrize(("given", "code"), [
    ({"change": np.radians(0.49)}, None), ({"change": np.radians(0.51)}, "ride-contradicts"),
    ({"change": np.nan}, "ride-contradicts"), ({"fails": True}, "ride-contradicts"),
])  # fmt: skip
def test_an_estimate_that_does_not_settle_is_refused(estimated, given, code):
    if code is None:
        estimated(**given)
        return
    with pytest.raises(RefusedInput) as refused:
        estimated(**given)
    assert refused.value.code == code


def test_half_an_hour_of_a_ride_is_used():
    found = alignment.mounted_windows(still_log(1830.0))
    assert found.edges[-1] == pytest.approx(1800.0, abs=0.1)


@pytest.mark.parametrize(("deg", "first_s"), [(34.0, 0.0), (38.0, 46.0)])
def test_a_sensor_is_mounted_while_its_force_is_within_35_degrees_of_the_usual_one(deg, first_s):
    """The first 36 s have another direction. The mean over 51 windows of 0.2 s is then within 35 degrees. 10 s after
    the last other mean, the ride begins."""
    log = still_log(200.0)
    log.accel_g[log.t_s < 36.0] = [np.sin(np.radians(deg)), np.cos(np.radians(deg)), 0.0]
    assert alignment.mounted_windows(log).edges[0] == pytest.approx(first_s, abs=5.5)


def test_the_ride_begins_10_s_after_the_hand_and_ends_10_s_before_it():
    """The sensor is upside down until 40 s and from 160 s. The mean over 10 s is right from 41.2 s to 158.8 s."""
    log = still_log(200.0)
    log.accel_g[(log.t_s < 40.0) | (log.t_s >= 160.0)] *= -1.0
    found = alignment.mounted_windows(log)
    assert (found.edges[0], found.edges[-1]) == pytest.approx((50.2, 149.8), abs=0.3)


def test_a_sensor_that_is_never_mounted_has_no_ride():
    log = still_log(60.0)
    log.accel_g[:] = [0.0, 0.0, 0.0]
    with pytest.raises(RefusedInput, match="only 0 s of riding"):
        alignment.mounted_windows(log)


def checked(windows, lean: Any = 0.0, delay=0.4, expected=None):
    """Return _checked() of an estimate with this lean at all edges and this delay of the speed."""
    parameters, states = np.zeros((3, of.PARAMETERS)), np.zeros((len(windows) + 9, of.STATES))
    states[:, of.LEAN], parameters[:, of.DELAY] = lean, delay
    states[len(windows) + 1 :] = 9.0  # the padded windows do not count
    states[:, of.BIAS] += [0.0, 0.1, 0.0]
    prior = SimpleNamespace(sigma=np.ones(of.PARAMETERS))
    estimate: Any = SimpleNamespace(
        split=lambda: np.zeros(3), prior=prior, parameters=parameters, matrix=np.eye(3), states=states,
        parameter_sigma=lambda: np.zeros(of.PARAMETERS),
    )  # fmt: skip
    return alignment._checked(windows, Axes(np.eye(3), np.zeros(3)), estimate, expected, [])


def test_only_the_lean_of_riding_counts(windows):
    """The sensor shakes for the first half of the time. The lean is 0.1 rad there, and 0.5 rad at rest."""
    force = windows.force.copy()
    force[:150:2, 0] += 0.3
    shaken = replace(windows, force=force)
    lean = np.where(np.arange(len(windows) + 9) < 156, 0.1, 0.5)
    found = checked(shaken, lean)
    assert found.lean_deg == pytest.approx(np.degrees(0.1))
    assert (found.riding_s, found.standing_s) == pytest.approx((30.7, 29.3), abs=0.3)
    assert found.used_s == pytest.approx((0.0, 60.0), abs=0.1)
    assert found.lag_s is None and found.calibration.gyro_bias_dps[1] == pytest.approx(np.degrees(0.1))


def test_the_lag_of_a_logged_speed(windows):
    shaken = replace(windows, force=windows.force + np.where(np.arange(len(windows)) % 2, 0.3, 0.0)[:, None])
    assert checked(shaken).lag_s is None
    speed = np.where(np.arange(len(windows)) == 9, 12.0, np.nan)
    assert checked(replace(shaken, speed=speed), delay=0.7).lag_s == pytest.approx(0.7)


def test_the_refusal_of_a_ride_names_the_log(monkeypatch):
    for name in ("axes", "mounted_windows", "read_log"):
        monkeypatch.setattr(alignment, name, lambda log: log)

    def refused(*_):
        raise RefusedInput(alignment.RideContradicts())

    monkeypatch.setattr(alignment, "estimate_alignment", refused)
    with pytest.raises(RefusedInput, match=r"^n: no one mounting"):
        alignment.fit_ride(still_log(5.0))


def test_rates_that_do_not_fit_refuse_a_ride(monkeypatch):
    misfit = RatesMisfit((1, 0, 0), (0, 1, 0), (0, 0, -1))
    monkeypatch.setattr(alignment, "without_frozen", lambda log: SimpleNamespace(notices=[misfit], name="n"))
    with pytest.raises(RefusedInput) as refused:
        alignment.fit_ride(still_log(5.0))
    assert refused.value.code == "rates-misfit" and str(refused.value).startswith("n: ")


def test_a_named_mounting_goes_into_the_estimate(monkeypatch):
    """The guess of the axes is 10 degrees from the portrait. The estimate gets the portrait itself."""
    c, s = np.cos(np.radians(10.0)), np.sin(np.radians(10.0))
    usual = alignment.PHONES["portrait"][0]
    guess = Axes(np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]) @ usual, np.zeros(3))
    given, done = [], []
    monkeypatch.setattr(alignment, "mounted_windows", lambda log: "windows")
    monkeypatch.setattr(alignment, "axes", lambda windows: guess)
    monkeypatch.setattr(alignment, "estimate_alignment", lambda *of: given.append(of) or "estimate")
    monkeypatch.setattr(alignment, "_checked", lambda *of: given.append(of) or "fit")
    found: Any = alignment.fit_ride(still_log(5.0), "portrait", lambda *of: done.append(of))
    assert found == "fit" and done == [(1, 2), (2, 2)]
    assert given == [("windows", guess, usual), ("windows", guess, "estimate", usual, [])]
    given.clear()
    alignment.fit_ride(still_log(5.0))
    assert given[0] == ("windows", guess, None)
