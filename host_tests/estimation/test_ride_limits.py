"""Which rides show an alignment, which part of a log counts, and how the result follows from the estimate."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from kickstand_tools.common.errors import InputError, RefusedInput
from kickstand_tools.estimation import alignment, unknowns as of
from kickstand_tools.estimation.first_guess import Axes
from kickstand_tools.logs.log import Log

NAN = float("nan")


def log_of(seconds, hz=50.0, up=(0.0, 1.0, 0.0), hand_s=(0.0, 0.0)) -> Log:
    """A log of a still sensor. hand_s: seconds at either end in which a hand holds it on its side."""
    n = round(seconds * hz)
    noise = np.random.default_rng(1).normal(0.0, 0.002, (n, 6))
    t_s, force = np.arange(n) / hz, np.tile(np.array(up, dtype=float), (n, 1))
    force[(t_s < hand_s[0]) | (t_s >= seconds - hand_s[1])] = np.roll(up, 1)
    return Log(t_s, noise[:, :3] + force, noise[:, 3:], name="n")


@pytest.mark.parametrize("hz", [19.9, 10.0])
def test_a_ride_needs_20_samples_per_second(hz):
    with pytest.raises(InputError, match=f"n: a sample every {1 / hz:.2f} s: at least 20 per second"):
        alignment.fit_ride(log_of(5.0, hz))
    with pytest.raises(RefusedInput, match="s of riding"):
        alignment.fit_ride(log_of(5.0, 20.0))


def test_another_name_of_a_mounting_is_refused():
    with pytest.raises(InputError, match="no phone is mounted sideways: there are portrait, landscape, flat"):
        alignment.fit_ride(log_of(5.0), "sideways")


@pytest.mark.parametrize(
    ("hand_s", "first_s", "last_s"),
    [((0.0, 0.0), 0.0, 200.0), ((40.0, 0.0), 45.0, 200.0), ((0.0, 40.0), 0.0, 155.0), ((40.0, 30.0), 45.0, 165.0)],
)
def test_the_time_in_a_hand_is_left_out(hand_s, first_s, last_s):
    """The direction of the force is a mean over 10 s, so it changes within 5 s of the hand, and 10 s more are left
    out."""
    found = alignment.mounted_windows(log_of(200.0, hand_s=hand_s))
    assert found.edges[0] == pytest.approx(first_s, abs=7.0) and found.edges[-1] == pytest.approx(last_s, abs=7.0)
    assert found.edges[0] >= hand_s[0] - 0.1 and found.edges[-1] <= 200.0 - hand_s[1] + 0.1


def test_a_log_is_used_for_half_an_hour(monkeypatch):
    monkeypatch.setattr(alignment, "LONGEST_S", 60.0)
    found = alignment.mounted_windows(log_of(100.0))
    assert (found.edges[0], found.edges[-1]) == pytest.approx((0.0, 60.0), abs=0.1)


@pytest.mark.parametrize(
    ("force_g", "rate_dps", "gap"), [(19.9, 0.0, 0), (20.1, 0.0, 1), (1.0, 2499.0, 0), (1.0, 2501.0, 1)]
)
def test_readings_beyond_any_sensor_are_left_out(force_g, rate_dps, gap):
    log = log_of(60.0)
    log.accel_g[1000:1050, 1], log.gyro_dps[1000:1050, 2] = force_g, -rate_dps
    assert np.count_nonzero(alignment.mounted_windows(log).gap) == gap


def test_a_log_of_one_usable_sample_is_too_short():
    log = log_of(2.0)
    log.accel_g[1:] = 30.0
    with pytest.raises(RefusedInput, match="only 0 s of riding"):
        alignment.mounted_windows(log)


def turned(axis, deg):
    """Return the matrix of a rotation about left (0), up (1) or forward (2)."""
    c, s = np.cos(np.radians(deg)), np.sin(np.radians(deg))
    rows = np.eye(3)
    i, k = (axis + 1) % 3, (axis + 2) % 3
    rows[i, i], rows[i, k], rows[k, i], rows[k, k] = c, -s, s, c
    return rows


@pytest.mark.parametrize(
    ("phone", "left", "up", "forward"),
    [
        ("portrait", [-1, 0, 0], [0, 1, 0], [0, 0, -1]),
        ("landscape", [0, 1, 0], [1, 0, 0], [0, 0, -1]),
        ("landscape", [0, -1, 0], [-1, 0, 0], [0, 0, -1]),
        ("flat", [-1, 0, 0], [0, 0, 1], [0, 1, 0]),
    ],
)
@pytest.mark.parametrize(("axis", "deg"), [(0, 44.0), (1, -44.0), (2, 20.0)])
def test_the_nearest_mounting_of_a_phone_is_used(phone, left, up, forward, axis, deg):
    """The screen faces the rider. In a flat phone the screen faces up, and the phone's top is ahead."""
    usual = np.array([left, up, forward], dtype=float)
    assert alignment._mounting(phone, turned(axis, deg) @ usual).tolist() == usual.tolist()
    assert np.linalg.det(usual) == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("axis", "deg", "code"),
    [
        (2, 44.9, None),
        (2, 45.1, "phone-otherwise"),
        (0, -90.0, "phone-otherwise"),
        (1, 90.0, "phone-otherwise"),
        (1, 180.0, "phone-otherwise"),
    ],
)
def test_a_phone_may_be_turned_by_45_degrees(axis, deg, code):
    usual = alignment.PHONES["portrait"][0]
    if code is None:
        assert alignment._mounting("portrait", turned(axis, deg) @ usual) is usual
        return
    with pytest.raises(RefusedInput) as refused:
        alignment._mounting("portrait", turned(axis, deg) @ usual)
    assert refused.value.code == code and f"turned by {abs(deg):.0f} degrees against portrait" in str(refused.value)


def test_accelerations_of_the_opposite_sign_are_recognised():
    reversed_sign = alignment.PHONES["portrait"][0] * [[1.0], [-1.0], [-1.0]]
    with pytest.raises(RefusedInput) as refused:
        alignment._mounting("portrait", reversed_sign)
    assert refused.value.code == "phone-upside-down"


WINDOWS = alignment.mounted_windows(log_of(60.0))


def checked(halves=(0.0, 0.0, 0.0), sigma_deg=(1.0, 1.0, 1.0), odd=0.0, expected=None, **parameters):
    """Return _checked() of an estimate that found these halves, standard errors and errors of the sensor.

    halves, sigma_deg: about left, up and forward (pitch, yaw, roll). odd: in standard deviations of the prior.
    """
    prior_sigma, found, sigma = np.full(of.PARAMETERS, 0.01), np.zeros((2, of.PARAMETERS)), np.zeros(of.PARAMETERS)
    found[:, np.arange(of.PARAMETERS)[of.SENSOR][0]] = odd * 0.01
    for name, value in parameters.items():
        found[:, getattr(of, name)] = value
    sigma[of.ROTATION], sigma[of.OFFSET] = np.radians(sigma_deg), 0.004
    states = np.zeros((len(WINDOWS) + 5, of.BIAS.stop))
    states[:, of.BIAS] = [0.01, 0.02, 0.03]
    estimate: Any = SimpleNamespace(
        split=lambda: np.radians(halves), prior=SimpleNamespace(sigma=prior_sigma), parameters=found,
        parameter_sigma=lambda: sigma, matrix=turned(1, 10.0), states=states,
    )  # fmt: skip
    guess = Axes(np.eye(3), np.array([0.1, 0.2, 0.3]))
    return alignment._checked(WINDOWS, guess, estimate, expected, [])


def test_errors_and_halves_have_their_names():
    found = checked(halves=(2.0, 4.0, 6.0), sigma_deg=(3.0, 1.5, 1.0))
    assert found.halves_deg == pytest.approx((6.0, 2.0, 4.0))
    assert (found.pitch_deg, found.yaw_deg, found.roll_deg) == pytest.approx((10**0.5, 2.5, 10**0.5))
    assert found.calibration.notes["ride_quality_deg"] == {"roll": 3.16, "pitch": 3.16, "yaw": 2.5}
    assert found.offset_sigma_g.tolist() == [0.004] * 3
    assert found.used_s == pytest.approx((0.0, 60.0), abs=0.1)
    assert (found.riding_s + found.standing_s) == pytest.approx(60.0, abs=0.1)
    assert found.lag_s is None and found.phone_deg is None


@pytest.mark.parametrize(
    ("given", "code"),
    [
        ({"halves": (0.0, -7.9, 0.0)}, None),
        ({"halves": (0.0, -8.1, 0.0)}, "ride-halves"),
        ({"sigma_deg": (4.9, 4.9, 3.4)}, None),
        ({"sigma_deg": (5.1, 1.0, 1.0)}, "ride-uncertain"),
        ({"sigma_deg": (1.0, 5.1, 1.0)}, "ride-uncertain"),
        ({"sigma_deg": (1.0, 1.0, 3.6)}, "ride-uncertain"),
        ({"odd": 19.9, "sigma_deg": (0.5, 0.5, 0.5)}, None),
        ({"odd": -20.1, "sigma_deg": (0.1, 0.1, 0.1)}, "ride-contradicts"),
    ],
)
def test_an_alignment_that_is_not_certain_is_refused(given, code):
    if code is None:
        checked(**given)
        return
    with pytest.raises(RefusedInput) as refused:
        checked(**given)
    assert refused.value.code == code


def test_the_refusal_names_roll_pitch_and_yaw():
    with pytest.raises(RefusedInput, match=r"known to 1\.0 degrees in roll, 6\.0 in pitch and 2\.0 in yaw only"):
        checked(sigma_deg=(6.0, 2.0, 1.0))


@pytest.mark.parametrize(("odd", "factor"), [(4.0, 1.0), (8.0, 2.0), (-8.0, 2.0)])
def test_odd_errors_of_the_sensor_enlarge_the_standard_errors(odd, factor):
    assert checked(odd=odd).yaw_deg == pytest.approx(factor)


def test_the_calibration_of_a_ride_is_along_the_sensors_axes():
    found = checked(OFFSET=[0.01, 0.02, 0.03])
    matrix = turned(1, 10.0)
    assert found.calibration.vehicle_from_sensor == pytest.approx(matrix)
    assert found.offset_g == pytest.approx([0.01, 0.02, 0.03])
    assert found.calibration.accel_offset_g == pytest.approx(np.array([0.01, 0.02, 0.03]) @ matrix)
    bias = np.degrees([0.1, 0.2, 0.3] + np.array([0.01, 0.02, 0.03]) @ matrix)
    assert found.calibration.gyro_bias_dps == pytest.approx(bias)
    assert found.calibration.aligned and found.calibration.vehicle == "motorcycle"


def test_an_error_of_the_up_axis_counts_as_an_offset():
    cross = np.zeros((3, 3))
    cross[:, 1] = [0.01, -0.02, 0.03]
    assert checked(ACCEL=cross.ravel(), odd=0.0).offset_g == pytest.approx([0.01, -0.02, 0.03])


def test_a_named_mounting_is_compared_with_the_result():
    assert checked(expected=turned(1, 13.0)).phone_deg == pytest.approx(3.0)
