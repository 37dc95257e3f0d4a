"""Tests the single steps of alignment by driving. Computed results are compared with numpy."""

import types

import numpy as np
import pytest
from kickstand.drive_alignment import parts, vertical
from kickstand.drive_alignment.history import BIN_US, MASK, SIZE, ForceHistory
from kickstand.drive_alignment.regression import Fit, ForwardRegression
from kickstand.drive_alignment.speed_check import SpeedCheck
from kickstand.drive_alignment.vertical import StandingVertical, Vertical
from kickstand_tools.calibration import published
from support.engines import ENGINES, run

UP = [0.0, 1.0, 0.0]


def unit(rng):
    v = rng.normal(size=3)
    return (v / np.linalg.norm(v)).tolist()


@pytest.mark.parametrize("off_deg", [0.0, 0.01, 45.0, 89.9, 90.1, 179.99, 180.0])
def test_rotation_between_is_safe_at_every_angle(off_deg):
    """The result is a rotation from a to b within 1e-12, even if a and b are exactly antiparallel."""
    rng = np.random.default_rng(3)
    off = np.radians(off_deg)
    for axis, b in ((0, published.UP), (2, published.UP), (1, published.BACKWARD)):
        for turn in rng.uniform(0, 2 * np.pi, 6):
            side = np.zeros(3)
            free = [i for i in range(3) if b[i] == 0.0]
            side[free[0]], side[free[1]] = np.cos(turn), np.sin(turn)
            a = np.cos(off) * np.array(b) + np.sin(off) * side
            r = published.rotation_between(a, b, axis)
            assert np.abs(r @ r.T - np.eye(3)).max() < 1e-12
            assert np.linalg.det(r) > 0.99
            assert np.abs(r @ a - b).max() < 1e-12


@pytest.mark.parametrize("sigma_deg", [1.0, 20.0])
def test_dispersion_is_fishers(sigma_deg):
    rng = np.random.default_rng(7)
    angles = 2.5 + np.radians(sigma_deg) * rng.normal(size=400)
    mean = np.angle(np.exp(1j * angles).mean())
    expected = (1 - np.cos(2 * (angles - mean)).mean()) / (2 * abs(np.exp(1j * angles).mean()) ** 2)
    value = published.circular_dispersion(np.exp(1j * angles).tolist())
    assert value == pytest.approx(expected, rel=1e-9)
    assert value == pytest.approx(np.radians(sigma_deg) ** 2, rel=0.2)
    assert published.circular_dispersion([1.0, -1.0]) == published.NO_MEAN


def test_history_is_exact_and_wraps_round():
    """Differences between two integrals equal numpy's, also after the time or a sum has wrapped around. A time outside
    the history gives no result."""
    rng = np.random.default_rng(2)
    history = ForceHistory()
    history.now = MASK - 3_000_000
    history.clear()
    times, totals = [0], [np.zeros(4)]
    out, before = [0] * 4, [0] * 4
    for k in range(400):
        length = int(BIN_US + rng.integers(0, 60_000))
        force = rng.normal(size=3) * 3.0 * length
        yaw = rng.normal() * 1e5
        history.add(force, yaw, length)
        times.append(times[-1] + length)
        totals.append(totals[-1] + [*force, yaw])
        if k < SIZE:
            continue
        oldest = times[-1] - times[-SIZE]
        one, two = sorted(rng.integers(0, oldest - 1, 2))
        assert history.at(out, history.now - int(one))
        assert history.at(before, history.now - int(two))
        expected = [np.interp(times[-1] - one, times, np.array(totals)[:, i]) for i in range(4)]
        expected -= np.array([np.interp(times[-1] - two, times, np.array(totals)[:, i]) for i in range(4)])
        got = [((a - b + 2**28) & MASK) - 2**28 for a, b in zip(out, before, strict=True)]
        # the values are about a million; a difference of 200 allows for the rounding of about 60 bins
        assert np.abs(np.array(got) - expected).max() < 200
        assert not history.at(out, history.now + 1000)
        assert not history.at(out, history.now - oldest - 1000)
    history.clear()
    assert not history.at(out, history.now)


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("count", [60, 300])
def test_regression_is_weighted_least_squares(engine, count):
    """Forward and level match numpy for any number of joined blocks."""
    rng = np.random.default_rng(count)
    seconds = rng.uniform(0.4, 1.1, count)
    a, c = rng.normal(0, 0.1, count), rng.normal(0, 0.03, count)
    force = np.array([0.3, 0.9, 0.1]) + np.outer(a, [0.6, -0.2, 0.7]) + np.outer(c, [0.1, 0.5, 0.2])
    force += rng.normal(0, 0.02, force.shape)
    rows = [[s, x * s, y, (f * s).tolist()] for s, x, y, f in zip(seconds, a, c, force, strict=True)]
    [(forward, level, blocks)] = run(engine, [("regression", (rows, 3))])
    weight = np.sqrt(seconds)[:, None]
    design = np.column_stack((a, np.ones(count), c))
    expected = np.linalg.lstsq(design * weight, force * weight, rcond=None)[0]
    # the tolerance allows for the ridge term of c and for 32-bit sums
    assert np.abs(np.array(forward) - expected[0]).max() < 2e-3
    assert np.abs(np.array(level) - expected[1]).max() < 2e-4
    assert 5 <= blocks <= 8


def test_two_fits_at_the_same_time_do_not_interfere():
    """The main loop may compare an alignment with the drive while another fit, for the quality, is in progress."""
    rng = np.random.default_rng(5)
    regression = ForwardRegression()
    for k in range(8):
        for change, curve in rng.normal(size=(6, 2)):
            regression.add(0, 0.5, 0.1 * change, 0.03 * curve, [0.1 * change * k, 0.5, 0.1 * change])
        list(regression.end_event())
    alone, begun, between = Fit(), Fit(), Fit()
    assert regression.fit(alone, 0)
    work = regression.fitting(begun, 0)
    next(work)
    assert regression.fit(between, 0, 0, 1)
    list(work)
    assert begun.found and begun.forward == alone.forward != between.forward


@pytest.mark.parametrize("engine", ENGINES)
def test_parts_of_a_drive(engine):
    """Forward turns by 12 degrees after five of eight blocks. The pitch changes by 5 degrees after four blocks. The
    differences between the parts match numpy. The differences do not depend on the forward direction of the whole
    drive, so two directions are tried."""
    rng = np.random.default_rng(5)
    weights, seconds = rng.uniform(0.1, 0.5, 8), rng.uniform(25.0, 40.0, 8)
    angles = np.array([0.0] * 5 + [12.0] * 3) + rng.normal(0.0, 1.0, 8)
    one, two = slice(0, 5), slice(5, 8)
    means = [np.average(angles[part], weights=weights[part]) for part in (one, two)]
    scatter = sum((weights[p] * (angles[p] - m) ** 2).sum() for p, m in zip((one, two), means, strict=True))
    unit = (scatter + parts.PRIOR_FREEDOM * parts.PRIOR_DEG**2) / (6 + parts.PRIOR_FREEDOM)
    variance = sum(
        unit / weights[p].sum() + parts.STRETCH_DEG**2 * (weights[p] ** 2).sum() / weights[p].sum() ** 2
        for p in (one, two)
    )
    for whole in (0.0, 175.0):
        a = np.radians(angles - whole)
        columns = (np.sin(a), np.cos(a), np.zeros(8), np.radians(np.repeat((0.0, 5.0), 4)), weights, seconds)
        [(forward_deg, sigmas, roll_deg, pitch_deg)] = run(engine, [("parts", [np.column_stack(columns).tolist()])])
        assert forward_deg == pytest.approx(means[1] - means[0], abs=0.1)
        assert sigmas == pytest.approx(forward_deg / np.sqrt(variance), rel=0.01)
        assert roll_deg == 0.0
        assert pitch_deg == pytest.approx(5.0, rel=1e-3)


def stand(standing, force, seconds, speed=0.0, rate=(0.0, 0.0, 0.0)):
    for _ in range(round(seconds * 10)):
        standing.update(force, rate, speed, 0.1)


def level(pitch_deg, roll_deg=0.0):
    p, r = np.radians((pitch_deg, roll_deg))
    return [np.sin(r), np.cos(p) * np.cos(r), np.sin(p) * np.cos(r)]


def test_each_stop_counts_once_in_the_vertical():
    standing = StandingVertical()
    for k, (pitch, seconds) in enumerate([(3.0, 300.0), (-3.0, 5.0), (2.0, 5.0), (-2.0, 5.0)]):
        stand(standing, level(pitch), seconds, rate=(0.1 * k, -0.2, 0.3))
        assert standing.standing
        stand(standing, level(10.0), 3.0, speed=10.0)
    assert standing.stops == 4
    assert standing.up and np.degrees(np.arcsin(standing.up[2])) == pytest.approx(0.0, abs=0.01)
    assert standing.bias == pytest.approx((0.3, -0.2, 0.3), abs=1e-5)
    assert not standing.moved


def test_a_late_speed_is_no_rotated_sensor():
    """A late speed is still zero while the vehicle already accelerates evenly for some seconds. Only a constant force
    that lasts longer shows a rotated sensor."""
    standing = StandingVertical()
    stand(standing, level(0.0), 5.0)
    stand(standing, level(15.0), 2.5)
    assert not standing.moved
    assert standing.up and np.degrees(np.arcsin(standing.up[2])) < 0.2
    stand(standing, level(15.0), 10.0)
    assert standing.moved


def test_each_vehicle_has_its_source_of_the_vertical():
    """A car uses the vertical of its stops. With a fit, the car uses the mean of the verticals from stops and fit. A
    motorcycle uses its upright pose. Without the upright pose a motorcycle uses the fit, or straight riding."""
    standing = types.SimpleNamespace(up=None)
    fit = types.SimpleNamespace(level=[2.0 * part for part in level(4.0)])

    def pitch(vertical, fit=None):
        out = [0.0] * 3
        return np.degrees(np.arctan2(out[2], out[1])) if vertical.known(out, fit) else None

    car, bike, posed = Vertical(True, None, standing), Vertical(False, None, standing), Vertical(False, UP, standing)
    assert (pitch(car), pitch(bike), pitch(posed), pitch(car, fit)) == (None, None, 0.0, None)
    assert (pitch(bike, fit), pitch(posed, fit)) == (pytest.approx(4.0), 0.0)
    standing.up = level(10.0)
    assert (pitch(car), pitch(car, fit)) == (pytest.approx(10.0), pytest.approx(7.0))
    # the result is the mean of the last minute
    for pitch_deg, times, mean in ((0.0, 1, 0.0), (8.0, 1, 4.0), (8.0, 60, 8.0)):
        for _ in range(times):
            bike.update(level(pitch_deg), 10.0)
        assert pitch(bike) == pytest.approx(mean, abs=0.1)
    assert bike.turn_axis == pytest.approx(level(8.0), abs=0.01)
    assert posed.turn_axis == pytest.approx(UP)
    assert car.turn_axis is standing.up


@pytest.mark.parametrize(("share", "moved"), [(0.9, True), (1.1, False)])
def test_a_bend_at_a_stuck_zero_is_no_stop(share, moved):
    """The speed stays at zero while the vehicle is in a bend. The measured rate then differs from the bias at the last
    stop by more than the gyro's drift while warming up."""
    standing = StandingVertical()
    stand(standing, level(0.0), 5.0, rate=(1.0, -4.0, 2.0))
    stand(standing, level(0.0), 3.0, speed=10.0)
    stand(standing, level(15.0), 10.0, rate=(1.0, -4.0 + share * vertical.TURNING_DPS, 2.0))
    assert standing.moved is moved
    assert standing.stops == (2 if moved else 1)


@pytest.mark.parametrize(
    ("seconds", "speed", "shake_g", "stops"),
    [(2.0, 0.0, 0.02, 0), (4.0, 0.0, 0.02, 1), (9.0, 1.0, 0.0, 0), (9.0, 0.0, 0.2, 0)],
)
def test_a_stop_requires_stillness_and_time(seconds, speed, shake_g, stops):
    """A stop needs three seconds at rest. The force may shake no more than with an idling engine."""
    standing = StandingVertical()
    for k in range(round(seconds * 10)):
        standing.update([0.0, 1.0, shake_g * (-1) ** k], (0.0, 0.0, 0.0), speed, 0.1)
    assert standing.stops == stops


@pytest.mark.parametrize(
    ("speeds", "yaw_dps", "stuck"), [((7.0, 7.0), 0.0, True), ((7.0, 7.1), 0.0, False), ((7.0, 7.0), 10.0, False)]
)
def test_a_speed_that_stays_the_same_in_a_lively_ride_is_stuck(speeds, yaw_dps, stuck):
    """A speed that changes is not stuck. A constant speed in bends is not stuck either."""
    check = SpeedCheck()
    for k in range(30):
        check.measure(speeds[k % 6 // 3])
        check.update_second([0.0, 1.0, 0.1 * (-1) ** k], yaw_dps)
    assert (check.problem is not None) is stuck
