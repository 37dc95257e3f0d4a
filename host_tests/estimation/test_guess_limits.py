"""The limits of the first guess: standstills, a hand, the gyro's bias, and rides that are no motorcycle's."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from kickstand_tools.common.errors import RefusedInput
from kickstand_tools.estimation import first_guess
from kickstand_tools.signals.leaning import Leaning
from made_windows import windows


def alternating(n: int, size: float) -> np.ndarray:
    """Return n values with this standard deviation, shape (n, 3). Only the first component changes."""
    values = np.zeros((n, 3))
    values[:, 0] = np.where(np.arange(n) % 2, size, -size)
    return values


# The moving standard deviation over 9 windows is sqrt(80) / 9 = 0.9938 times the size.
@pytest.mark.parametrize(
    ("rate_dps", "force_g", "still"), [(0.35, 0.0, True), (0.355, 0.0, False), (0.0, 0.01, True), (0.0, 0.0102, False)]
)
def test_a_standing_bike_may_shake_a_little(rate_dps, force_g, still):
    made = windows(60, np.radians(alternating(60, rate_dps)), alternating(60, force_g) + [0.0, 1.0, 0.0])
    assert first_guess.standing(made)[30] == still


def test_a_jolt_ends_a_standstill_for_four_windows_on_either_side():
    """The readings must not change over 9 windows, which last 1.8 s. A gap is no standstill."""
    force = np.tile([0.0, 1.0, 0.0], (60, 1))
    force[30, 0] = 0.5
    assert np.flatnonzero(~first_guess.standing(windows(60, force=force))).tolist() == list(range(26, 35))
    gap = np.arange(60) == 10
    assert np.flatnonzero(~first_guess.standing(replace(windows(60), gap=gap))).tolist() == [10]


def held(*parts: tuple[int, int], n=1500, deg=90.0):
    """Return in_hand() of a sensor that is turned by this angle from the first to before the last window of a part."""
    force = np.tile([0.0, 1.0, 0.0], (n, 1))
    for begin, end in parts:
        force[begin:end] = [np.sin(np.radians(deg)), np.cos(np.radians(deg)), 0.0]
    return first_guess.in_hand(windows(n, force=force))


def limits(found) -> list[int]:
    """Return the first and the last window of each part."""
    edges = np.flatnonzero(np.diff(np.concatenate(([0], found.astype(int), [0]))))
    return [int(edge) for pair in zip(edges[::2], edges[1::2] - 1, strict=True) for edge in pair]


def test_a_hand_is_found_by_the_mean_force_over_10_s():
    """The mean over 51 windows is beyond 35 degrees if 22 of them are on their side, because tan(35) = 0.7. So the hand
    is found from 4 windows before its beginning. It is sure 10 windows later, and perhaps 25 windows earlier."""
    surely, perhaps = held((600, 900))
    assert limits(surely) == [606, 893]
    assert limits(perhaps) == [571, 928]


@pytest.mark.parametrize(("deg", "found"), [(34.9, False), (35.1, True)])
def test_a_mounted_sensor_is_within_35_degrees_of_up(deg, found):
    assert held((600, 900), deg=deg)[0].any() == found


@pytest.mark.parametrize(("between", "parts"), [(104, 1), (108, 2)])
def test_less_than_20_s_between_two_hands_count_as_a_hand(between, parts):
    """The hands are found from 4 windows before their beginning to 4 windows after their end."""
    assert len(limits(held((400, 500), (500 + between, 600 + between))[0])) == 2 * parts


@pytest.mark.parametrize(("between", "parts"), [(106, 1), (107, 2)])
def test_the_first_window_of_a_hand_counts_as_time_between(monkeypatch, between, parts):
    """From the first hand's last window to the second hand's first window are n - 6 windows of 0.2 s."""
    monkeypatch.setattr(first_guess, "BETWEEN_S", 20.1)
    assert len(limits(held((400, 500), (500 + between, 600 + between))[0])) == 2 * parts


@pytest.mark.parametrize(("begin", "first"), [(101, 0), (105, 111)])
def test_less_than_20_s_before_the_first_hand_count_as_a_hand(begin, first):
    assert limits(held((begin, begin + 200))[0])[0] == first
    assert limits(held((1300 - begin, 1500 - begin))[0])[1] == 1499 - first


def test_the_bias_is_the_rate_at_rest_or_in_calm_riding():
    """Rest needs 9 calm windows, and calm riding needs 5. Otherwise the median of the whole ride counts."""
    rate = np.tile([0.3, 0.2, 0.1], (200, 1))
    rate[::2] += 0.05

    def bias(calm):
        mixed = rate.copy()
        mixed[100 : 100 + calm] = [0.01, 0.02, 0.03]
        return first_guess._bias(windows(200, mixed)).tolist()

    assert bias(9) == bias(5) == pytest.approx([0.01, 0.02, 0.03])
    assert bias(4)[0] > 0.2


def leaning(lean=0.2, turned=0.2, like=0.9, share=1.0) -> Leaning:
    """A ride whose lean and yaw rate change their sign in each window. The rms of the lean is `lean`."""
    sign = np.where(np.arange(100) % 2, 1.0, -1.0)
    return Leaning(np.eye(3), lean * sign, -turned * sign, like, 10.0, share, 1.0)


def refusal(pushed=0.1, side=None, **more) -> str | None:
    """Return the code of the refusal. pushed: force to the side over the lean. side: rms of this force, if another."""
    found = leaning(**more)
    sideways = pushed * found.rolled
    if side is not None:  # a force that does not follow the bends
        sideways = sideways + np.tile([1.0, 1.0, -1.0, -1.0], 25) * np.sqrt(side**2 - np.mean(sideways**2))
    try:
        first_guess._refuse_no_motorcycle(found, sideways, np.ones(100, dtype=bool))
    except RefusedInput as error:
        return error.code
    return None


@pytest.mark.parametrize(
    ("given", "code"),
    [
        ({}, None),
        ({"lean": np.radians(3.01)}, None),
        ({"lean": np.radians(2.99)}, "no-bends"),
        ({"like": 0.51}, None),
        ({"like": 0.49}, "ride-contradicts"),
        ({"pushed": 0.49}, None),
        ({"pushed": -0.49}, None),
        ({"pushed": 0.51}, "ride-contradicts"),
        ({"pushed": -0.51}, "ride-contradicts"),
        ({"share": 0.01}, None),
        ({"share": -0.01}, "left-handed"),
        ({"lean": np.radians(4.9), "pushed": 0.51, "side": 0.0455}, "not-leaning"),
        ({"lean": np.radians(4.9), "pushed": 0.51, "side": 0.0445}, "ride-contradicts"),
        ({"lean": np.radians(5.1), "pushed": 0.51, "side": 0.0465}, "ride-contradicts"),
        ({"lean": np.radians(4.9), "pushed": 0.49, "side": 0.0455}, None),
        ({"lean": np.radians(0.1), "pushed": 80.0, "side": 0.15}, "not-leaning"),
    ],
)
def test_only_a_motorcycles_ride_is_used(given, code):
    assert refusal(**given) == code


def test_only_riding_windows_are_judged():
    found = leaning()
    found.rolled[50:] = 0.0
    riding = np.arange(100) < 50
    first_guess._refuse_no_motorcycle(replace(found, rolled=found.rolled * 0.3), np.zeros(100), riding)
    with pytest.raises(RefusedInput):
        first_guess._refuse_no_motorcycle(replace(found, rolled=found.rolled * 0.2), np.zeros(100), riding)


@pytest.mark.parametrize(("ptp", "refused"), [(0.49, True), (0.51, False)])
def test_a_speed_that_changes_by_under_half_a_metre_per_second_is_stuck(ptp, refused):
    known: Any = 15.0 + ptp * (np.arange(100) % 2)
    turned = np.full(100, 0.3)

    def check():
        first_guess._refuse_wrong_speed(known, -15.0 * turned / 9.80665, turned)

    if refused:
        with pytest.raises(RefusedInput) as error:
            check()
        assert error.value.code == "speed-stuck"
    else:
        check()
        first_guess._refuse_wrong_speed(np.zeros(0), turned, turned)


@pytest.mark.parametrize(("riding", "refused"), [(149, True), (150, False)])
def test_a_ride_needs_30_s_of_riding(monkeypatch, riding, refused):
    """Each window lasts 0.2 s. The rest of the ride is a standstill."""
    monkeypatch.setattr(first_guess, "standing", lambda w: np.arange(300) >= riding)
    monkeypatch.setattr(first_guess, "_refuse_no_motorcycle", lambda *_: None)
    made = windows(300, rate=(0.1, 0.2, 0.3))
    if refused:
        with pytest.raises(RefusedInput, match=r"only 30 s of riding: at least 30 s with bends"):
            first_guess.axes(made)
    else:
        assert first_guess.axes(made).bias == pytest.approx([0.1, 0.2, 0.3])
