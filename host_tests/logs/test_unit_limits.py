"""When a log's rates are said to be in rad/s, and its speed not in m/s: each condition from both sides of its limit."""

import numpy as np
import pytest
from kickstand.units import STANDARD_GRAVITY
from kickstand_tools.errors import InputError
from kickstand_tools.logs.axes.bends import Bends
from kickstand_tools.logs.speed_unit import SpeedUnit
from kickstand_tools.simulation.scripted.sensor_errors import random_mounting

KMH, KNOTS = 3.6, 1.9438


TURNED = np.reshape(random_mounting(3), (3, 3))


def weaving(scale=57.0, noise_dps=0.0, unlike=0.0, seconds=40.0, rest_s=8.0) -> Bends:
    """A ride of bends to both sides at 15 m/s, its rates so many times too small; noise in that about left.

    unlike: part of the rolling that has nothing to do with turning. rest_s: at rest, after the ride.
    """
    chance = np.random.default_rng(7)
    time = np.arange(0.0, seconds + rest_s, 0.02)
    moving = np.where(time < seconds, 1.0, 0.0)
    lean = 0.4 * np.sin(1.1 * time) * moving
    yaw = -STANDARD_GRAVITY * np.tan(lean) / 15.0
    rolling = (0.44 * np.cos(1.1 * time) + unlike * np.cos(2.3 * time)) * moving
    about_left = yaw * np.sin(lean) + np.radians(noise_dps) * chance.normal(size=len(time)) * moving
    rate = np.degrees(np.column_stack((about_left, yaw * np.cos(lean), rolling))) / scale
    force = np.column_stack((0.0 * time, 1.0 / np.cos(lean), 0.3 * np.sin(2.0 * time) * moving))
    unit = Bends()
    for part in np.array_split(np.arange(len(time)), 7):
        unit.add(time[part], force[part] @ TURNED, rate[part] @ TURNED, np.full(len(part), np.nan))
    return unit


@pytest.mark.parametrize(
    ("wrong", "right"),
    [
        ({"scale": 16.0}, {"scale": 13.0}),  # a share of 15
        ({"noise_dps": 15.0}, {"noise_dps": 60.0}),  # by under 4.5 sigmas it is chance
        ({"unlike": 0.3}, {"unlike": 1.0}),  # a bike's rolling goes with its turning
        ({"seconds": 16.0}, {"seconds": 12.0}),  # a quarter of a minute of riding
        ({"rest_s": 1770.0}, {"rest_s": 1800.0}),  # half an hour is kept
    ],
)
def test_what_it_takes_to_be_sure_of_rates_in_radians(wrong, right):
    notice = weaving(**wrong).notice()
    assert notice
    assert notice.code == "rates-in-radians"
    assert notice.values[0] == pytest.approx(15.0 * 57.3, rel=0.2)
    assert weaving(**right).notice() is None


def jerky(
    scale=KMH, late_s=0.0, every_s=1.0, step_s=0.1, seconds=60, size_g=0.3, pushed=None, noise_g=0.0, blocks=1
) -> str:
    """What is said of a log with another push each second, +size_g or -size_g by chance, along (0.6, 0, 0.8).

    pushed: only so many of the seconds are. noise_g: of the force in each second. blocks: in which it comes.
    """
    chance = np.random.default_rng(7)
    push = size_g * np.sign(chance.normal(size=seconds))
    if pushed is not None:
        push[np.argsort(chance.random(seconds))[pushed:]] = 0.0
        push[np.flatnonzero(push)] *= np.resize([1.0, -1.0], np.count_nonzero(push)) * np.sign(push[push != 0.0])
    time = np.arange(0.0, seconds, step_s)
    second = np.clip(np.ceil(time - 1e-9).astype(int) - 1, 0, seconds - 1)  # a force lasts from the sample before
    force = np.outer((push + noise_g * chance.normal(size=seconds))[second], [0.6, 0.0, 0.8]) + [0.0, 1.0, 0.0]
    mps = 50.0 + STANDARD_GRAVITY * np.concatenate(([0.0], np.cumsum(push)))
    speed = np.full(len(time), np.nan)
    given = np.arange(0.0, seconds - every_s / 2.0, every_s)
    speed[np.searchsorted(time, given - 1e-9)] = scale * np.interp(given - late_s, np.arange(seconds + 1.0), mps)
    unit = SpeedUnit("log")
    try:
        for part in np.array_split(np.arange(len(time)), blocks):
            unit.add(time[part], force[part], speed[part])
    except InputError as refused:
        return str(refused)
    return ""


@pytest.mark.parametrize(
    ("refused", "not_refused"),
    [
        ({"scale": 1.52}, {"scale": 1.48}),  # 1.5 times as much as the force explains; knots are 1.94
        ({"size_g": 0.175}, {"size_g": 0.125}),  # 0.15 g is no slope of an ordinary road
        ({"seconds": 300, "pushed": 11}, {"seconds": 300, "pushed": 8}),  # ten seconds of it
        ({"seconds": 28}, {"seconds": 24}),  # 25 seconds: five sigmas of the correlation cannot be reached before
        ({"late_s": 2.0}, {"late_s": 3.0}),  # a satellite receiver's delay
        ({"every_s": 2.1, "seconds": 120, "late_s": 0.1}, {"every_s": 2.3, "seconds": 120, "late_s": 0.1}),
        ({"step_s": 0.19}, {"step_s": 0.21, "seconds": 120}),  # a gap: the force in it is unknown
        ({"blocks": 7}, {"blocks": 7, "scale": 1.0}),
    ],
)
def test_what_it_takes_to_be_sure_of_another_unit_of_speed(refused, not_refused):
    assert "the speed changes" in jerky(**refused)
    assert jerky(**not_refused) == ""


@pytest.mark.parametrize(("noise_g", "told"), [(0.7, True), (1.6, False)])
def test_what_could_be_chance(noise_g, told):
    """Over 100 s five sigmas are a correlation of 0.5: 0.6 is told, 0.35 is not."""
    assert bool(jerky(scale=20.0, noise_g=noise_g, seconds=101, size_g=0.5)) is told


def test_how_much_it_says_is_how_much_it_is():
    assert "3.6 times as much" in jerky()
    assert "1.9 times as much" in jerky(scale=KNOTS)
