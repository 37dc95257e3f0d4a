"""Tests the noise, the priors and the first guess of the estimation. The expected values were computed by hand. Also
compares the figures of one smoothed ride with known figures."""

from dataclasses import replace

import numpy as np
import pytest
from kickstand_tools.api import Log, simulate_ride, smooth
from kickstand_tools.calibration.file import CalibrationFile
from kickstand_tools.common.errors import RefusedInput
from kickstand_tools.estimation import equations as eq, first_guess, hypotheses, unknowns as of
from kickstand_tools.estimation.noise import Noise, jolted
from kickstand_tools.estimation.windows import Windows, windows_of
from made_windows import windows

G = 9.80665


def noise_of(made: Windows, still=False, speed=20.0, lean=0.0, pitch=0.0) -> Noise:
    n = len(made)
    noise = Noise(made, np.full(n, still))
    noise.speed, noise.lean, noise.pitch = np.full(n, speed), np.full(n, lean), np.full(n, pitch)
    return noise


def test_the_noise_of_riding_by_hand():
    """The speed is 20 m/s, and the windows are 0.2 s long. An error that lasts for t seconds is the same in many
    windows, so its standard deviation is multiplied by sqrt(2 t / 0.2)."""
    row = noise_of(windows(speed=20.0)).sigma()[5]
    root = np.sqrt(0.2)
    assert row[of.LEAN] == row[of.PITCH] == pytest.approx(np.radians(0.2) * root)
    assert row[[of.LEFT, of.UP, of.FORWARD]] == pytest.approx(np.array([0.05, 0.05, 0.1]) * root)
    assert row[of.BIAS] == pytest.approx(np.full(3, np.radians(0.01)) * root)
    assert row[eq.SLIDING] == pytest.approx(0.15 * np.sqrt(5.0))
    assert row[eq.CLIMBING] == pytest.approx(np.hypot(0.1, 20.0 * np.radians(2.5)) * np.sqrt(5.0))
    assert row[eq.SLOPING] == pytest.approx(np.hypot(0.1, 20.0 * np.radians(2.0)) * np.sqrt(40.0))
    assert row[eq.BALANCED] == pytest.approx(0.011 * np.sqrt(30.0))
    assert row[eq.ANY_SPEED] == pytest.approx(20.0 * np.sqrt(600.0))
    assert (row[eq.MEASURED_SPEED], row[eq.BACKWARD]) == (1.0, 0.3)
    assert np.isinf(row[eq.RESTING]).all() and np.isinf(row[eq.RESTING_RATE]).all()


def test_the_noise_of_a_lean_and_a_wheelie():
    row = noise_of(windows(), lean=0.5, pitch=np.radians(10.0)).sigma()[5]
    assert row[eq.SLIDING] == pytest.approx(np.hypot(0.15, 0.01 * 20.0 * np.tan(0.5)) * np.sqrt(5.0))
    assert row[eq.BALANCED] == pytest.approx(np.hypot(0.011, 0.045 * np.sin(0.5)) * np.sqrt(30.0))
    assert row[eq.CLIMBING] == pytest.approx(2.0 * np.hypot(0.1, 20.0 * np.radians(2.5)) * np.sqrt(5.0))
    assert np.isinf(row[eq.MEASURED_SPEED])
    assert np.isinf(noise_of(windows(), speed=4.0).sigma()[5, eq.BALANCED])
    assert np.isfinite(noise_of(windows(), speed=4.1).sigma()[5, eq.BALANCED])
    warm = noise_of(windows(warm=np.ones(20))).sigma()[5]
    assert warm[of.BIAS] == pytest.approx(np.full(3, np.radians(0.005)) * np.sqrt(0.2))


def test_factors_of_the_noise():
    noise, plain = noise_of(windows()), noise_of(windows()).sigma()[5]
    noise.roughness, noise.misfit, noise.unbalance = np.full(20, 2.0), np.full(20, 3.0), 0.5
    row = noise.sigma()[5] / np.where(np.isinf(plain), 1.0, plain)
    assert row[[of.LEAN, of.PITCH]] == pytest.approx([2.0, 2.0])
    assert row[[of.LEFT, of.UP, of.FORWARD]] == pytest.approx([6.0, 6.0, 6.0])
    assert row[[eq.SLIDING, eq.CLIMBING, eq.SLOPING, eq.BALANCED]] == pytest.approx([2.0, 2.0, 1.0, 0.5])


def test_the_noise_at_rest_and_in_gaps():
    row = noise_of(windows(), still=True).sigma()[5]
    assert row[eq.RESTING] == pytest.approx(0.05) and row[eq.RESTING_RATE] == pytest.approx(np.radians(0.15))
    assert np.isinf(row[[eq.SLIDING, eq.CLIMBING, eq.SLOPING, eq.BALANCED, eq.ANY_SPEED, eq.BACKWARD]]).all()
    gap = np.arange(20) == 5
    lost = noise_of(windows(gap=gap)).sigma()[5]
    by_hand = np.array([np.radians(30.0), np.radians(5.0), 3.0, 1.0, 4.0]) * np.sqrt(0.2)
    assert lost[: of.BIAS.start] == pytest.approx(by_hand) and np.isinf(lost[eq.SLIDING])
    edges = np.arange(21) * 0.2
    edges[6:] += 1000.0
    most = noise_of(windows(gap=gap, edges=edges)).sigma()[5]
    assert most[: of.BIAS.start] == pytest.approx([np.radians(60.0), np.radians(8.0), 20.0, 2.0, 20.0])


def test_a_jolt_makes_the_angles_uncertain():
    made = windows(jolt=np.full(20, np.radians(250.0)))
    assert jolted(made) == pytest.approx(np.full(20, 0.06 * np.radians(100.0)))
    assert noise_of(made).sigma()[5, of.LEAN] == pytest.approx(
        np.hypot(np.radians(0.2) * np.sqrt(0.2), 0.06 * np.radians(100.0))
    )
    assert jolted(windows(jolt=np.full(20, np.radians(149.0)))) == pytest.approx(np.zeros(20))


def test_outliers_weigh_less():
    """A residual of the process is an outlier over 4 sigmas. A residual of a measurement is an outlier over 2 sigmas,
    without the factor for the duration of a disturbance. The bias has no outliers."""
    noise, sigma = noise_of(windows()), np.ones((20, eq.ROWS))
    found = noise.robust(sigma, np.full((20, eq.ROWS), 4.0))[5]
    assert found[: of.BIAS.start] == pytest.approx(np.full(5, np.sqrt(2.0)))
    assert found[of.BIAS] == pytest.approx(np.ones(3))
    assert found[eq.MEASURED_SPEED] == pytest.approx(np.hypot(1.0, 2.0))
    assert found[eq.SLIDING] == pytest.approx(np.hypot(1.0, 4.0 * np.sqrt(5.0) / 2.0))


def test_roughness_follows_the_residuals():
    """Residuals of the expected size give a roughness of 1. Residuals of half the expected size give a roughness of
    0.5. The roughness is kept between 0.1 and 4."""
    expected = np.zeros((400, eq.ROWS))
    expected[:, [of.LEAN, of.PITCH, of.LEFT, of.UP, of.FORWARD]], expected[:, [eq.SLIDING, eq.CLIMBING]] = 0.38, 0.5
    for factor, roughness in ((1.0, 1.0), (0.5, 0.5), (0.01, 0.1), (9.0, 4.0)):
        noise = noise_of(windows(400))
        noise.estimate_roughness(factor * expected)
        assert noise.roughness[200] == pytest.approx(roughness)
    noise = noise_of(windows(400))
    noise.misfit = np.full(400, 3.0)
    noise.estimate_roughness(0.01 * expected)
    assert noise.roughness[200] == pytest.approx(0.42)
    noise = noise_of(windows(400), still=True)
    noise.estimate_roughness(expected)
    assert noise.roughness[200] == 1.0


def test_unbalance_follows_the_force_to_the_side():
    """A force of 0.011 g changes its sign every 10 s. Means over 3 s keep the size of this force. A constant force
    counts as no unbalance, so the result is the lowest value."""
    force = 0.011 * np.where(np.arange(2000) // 50 % 2, 1.0, -1.0)
    noise = noise_of(windows(2000))
    noise.estimate_unbalance(force, 3.0)
    left = 2.0 * np.exp(-1.0)  # factor on the variance of an error that lasts for the 3 s of a mean
    # A mean that includes a change of sign is smaller
    assert noise.unbalance == pytest.approx(np.sqrt(0.8 / left), abs=0.05)
    noise.estimate_unbalance(np.full(2000, 0.1), 3.0)
    assert noise.unbalance == pytest.approx(0.12)
    noise.estimate_unbalance(1000.0 * force, 10.0)
    assert noise.unbalance == 6.0
    noise = noise_of(windows(49))
    noise.estimate_unbalance(force[:49], 3.0)
    assert noise.unbalance == 1.0


def test_the_hypotheses_are_three_mounts_times_three_winds():
    every = hypotheses.ALL
    assert every.minus_two_log_prior.tolist() == [0.0, 8.0, 5.0, 1.0, 9.0, 6.0, 1.0, 9.0, 6.0]
    assert np.degrees(every.turning) == pytest.approx([0.05] * 6 + [0.11] * 3)
    assert np.degrees(every.rolling) == pytest.approx([0.05] * 3 + [0.11] * 6)
    assert every.pushed == pytest.approx([0.00052, 0.01047, 0.03142] * 3)
    assert np.sum(every.weight) == pytest.approx(1.0)
    first = every.first()
    assert first.weight.tolist() == [1.0] and first.pushed == pytest.approx([0.00052])


def test_the_random_walks_of_the_hypotheses():
    prior = of.Prior.of_pose(six_done=True)
    parameters = np.tile(prior.mean, (3, 1))
    parameters[1:, of.BESIDE] = 0.01
    walks = hypotheses.ALL.random_walks(prior, parameters)
    place = {int(p): k for k, p in enumerate(prior.unknown)}
    variance = walks.variance[:, 0]
    assert variance[1, place[of.BESIDE]] == pytest.approx(0.01047**2 * 2.0 * 10.0 / 120.0)
    assert np.degrees(np.sqrt(variance[8, [place[0], place[1], place[2]]])) == pytest.approx([0.11, 0.11, 0.11])
    assert np.degrees(np.sqrt(variance[3, [place[0], place[2]]])) == pytest.approx([0.05, 0.11])
    assert variance[0, place[of.OFFSET.start]] == pytest.approx((0.15 * 0.001) ** 2 + 0.0015**2)
    assert variance[0, place[of.HEIGHT]] == pytest.approx((1e-4 * 0.3) ** 2)
    assert walks.between[:, place[of.BESIDE]].tolist() == [0.01, 0.0]
    assert walks.prior[2, place[of.BESIDE], place[of.BESIDE]] == pytest.approx(1.0 / (0.001**2 + 0.03142**2))
    assert np.all(walks.prior[:, :, -1] == 0.0)


def test_the_prior_with_and_without_six_positions():
    known, unknown = of.Prior.of_pose(True), of.Prior.of_pose(False)
    assert known.sigma[of.OFFSET].tolist() == [0.001, 0.003, 0.003] and known.sigma[of.UP_SCALE] == 0.004
    assert unknown.sigma[of.OFFSET].tolist() == [0.04] * 3 and unknown.sigma[of.UP_SCALE] == 0.015
    assert np.degrees(known.sigma[of.ROTATION]) == pytest.approx([1.5, 5.0, 2.0])
    assert known.mean[[of.HEIGHT, of.AHEAD, of.TYRES, of.DELAY, of.DIVE]].tolist() == [0.5, 0.6, 0.07, 0.4, 0.026]
    assert known.sigma[[of.HEIGHT, of.AHEAD, of.TYRES, of.DELAY, of.DIVE]].tolist() == [0.3, 0.5, 0.06, 0.4, 0.035]
    assert of.ACCEL.start not in known.unknown and of.UP_SCALE in known.unknown
    information = known.information(known.sigma)
    place = {int(p): k for k, p in enumerate(known.unknown)}
    roll, left = place[2], place[of.OFFSET.start]
    tight = 1.0 / np.radians(2.0) ** 2
    assert information[roll, roll] == pytest.approx(tight) and information[roll, left] == pytest.approx(-tight)
    assert information[left, left] == pytest.approx(1e6 + tight)
    assert information[place[0], place[of.OFFSET.stop - 1]] == pytest.approx(1.0 / np.radians(1.5) ** 2)
    free = of.Prior(known.mean, known.sigma, posed=False).information(known.sigma)
    assert free[roll, left] == 0.0 and free[left, left] == pytest.approx(1e6)


def test_windows_are_padded_with_gaps_of_no_time():
    made = windows(5, speed=3.0)
    padded = made.padded(4)
    assert len(padded) == 8 and padded.seconds[5:].tolist() == [0.0, 0.0, 0.0] and padded.gap[5:].all()
    assert np.isnan(padded.speed[5:]).all() and np.all(padded.force[5:] == 0.0)
    assert len(made.padded(5)) == 5
    assert padded.covered == pytest.approx([0.2] * 5 + [0.0] * 3)


def test_the_speed_between_its_values_is_interpolated():
    speed = np.full(5, np.nan)
    speed[1] = 2.0
    assert np.isnan(windows(5, speed=speed).known_speed).all()
    speed[3] = 6.0
    assert windows(5, speed=speed).known_speed == pytest.approx([2.0, 2.0, 4.0, 6.0, 6.0])


def test_axes_are_turned_after_the_bias():
    quarter = np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    made = windows(2, rate=(0.3, 0.1, 0.0)).turned(quarter, np.array([0.1, 0.0, 0.0]))
    assert made.rate[0] == pytest.approx([0.1, -0.2, 0.0]) and made.force[0] == pytest.approx([1.0, 0.0, 0.0])


def test_a_step_of_over_170_ms_is_a_gap():
    for step_s, gaps in ((0.16, 0), (0.18, 1)):
        t_s = np.append(np.arange(50) * 0.01, 0.49 + step_s + np.arange(50) * 0.01)
        made = windows_of(
            np.asarray(t_s, dtype=float), np.ones((100, 3)), np.ones((100, 3)), np.full(100, np.nan), np.zeros(100)
        )
        assert np.count_nonzero(made.gap) == gaps
    assert made.seconds[made.gap] == pytest.approx([0.17])  # the gap begins and ends half a step from a reading
    assert made.edges[0] == pytest.approx(-0.005) and made.before[0] == pytest.approx(0.005)


def test_a_bike_without_changes_stands_still():
    chance = np.random.default_rng(1)
    quiet = windows(100, force=(0.0, 1.0, 0.0))
    shaken = replace(quiet, force=quiet.force + chance.normal(0.0, 0.02, (100, 3)))
    assert first_guess.standing(quiet).all()
    assert not first_guess.standing(shaken).any()
    assert not first_guess.standing(windows(100, rate=(0.0, np.radians(4.1), 0.0))).any()
    assert first_guess.standing(windows(100, rate=(0.0, np.radians(3.9), 0.0))).all()
    assert not first_guess.standing(windows(100, speed=5.0)).any()


def test_lean_and_speed_of_a_steady_bend():
    """The bike leans by 0.5 rad to the left at 15 m/s, so its yaw rate is 0.357 rad/s. The speed is found from the
    force. A prior speed of 10 m/s has the weight of a yaw rate of 0.14 rad/s.
    """
    yaw = G * np.tan(0.5) / 15.0
    made = windows(600, force=(0.0, 1.0 / np.cos(0.5), 0.0), rate=(-yaw * np.sin(0.5), yaw * np.cos(0.5), 0.0))
    still = np.zeros(600, dtype=bool)
    turning = yaw * np.cos(0.5)
    lean, speed = first_guess.lean_and_speed(made, still)
    by_hand = (np.tan(0.5) * turning * G + 0.14**2 * 10.0) / (turning**2 + 0.14**2)
    assert speed[300] == pytest.approx(by_hand) and lean[300] == pytest.approx(-np.arctan(by_hand * turning / G))
    known = first_guess.lean_and_speed(replace(made, speed=np.full(600, 12.0)), still)[1]
    assert known[300] == pytest.approx(12.0)
    tilted = windows(600, force=(np.sin(0.2), np.cos(0.2), 0.0))
    lean, speed = first_guess.lean_and_speed(tilted, ~still)
    assert lean[300] == pytest.approx(0.2) and speed[300] == 0.0


def test_a_speed_that_does_not_fit_the_bends_is_refused():
    turned = 0.3 * np.sin(np.arange(500) / 20.0)
    rolled = -15.0 * turned / G

    def check(known):
        first_guess._refuse_wrong_speed(np.asarray(known), rolled, turned)

    check(np.full(500, np.nan))
    drive = 15.0 + np.arange(500) * 1e-3 + 0.5 * (np.arange(500) > 250)
    check(drive)
    check(1.7 * drive)
    check(drive / 1.8)
    for factor in (1.8, 1.0 / 1.9, -1.0):
        with pytest.raises(RefusedInput):
            check(factor * drive)
    with pytest.raises(RefusedInput):
        check(np.full(500, 15.0))


def test_a_hand_holds_the_sensor_far_from_its_usual_up():
    force = np.tile([0.0, 1.0, 0.0], (1000, 1))
    force[300:400] = [1.0, 0.0, 0.0]
    surely, around = first_guess.in_hand(replace(windows(1000), force=force))
    assert surely[350] and not surely[200] and not surely[500]
    assert around[290] and around[410] and not around[100] and not around[700]


FIGURES = {"lean_deg": 3.0298, "lean_sigma_deg": 0.87673, "pitch_deg": 1.6246, "speed_mps": 19.081}


def test_the_figures_of_a_smoothed_ride():
    """The figures are the rms of the lean, of its standard deviation, of the pitch and of the speed. If nearly any
    number of the model is changed, these figures change."""
    made = simulate_ride("street", seed=4, seconds=60.0)
    log = Log.from_readings(made.readings[::4], made.rate_hz / 4)
    found = smooth(log, CalibrationFile(vehicle_from_sensor=made.vehicle_from_sensor, aligned=True))
    seen = {name: float(np.sqrt(np.nanmean(getattr(found, name) ** 2))) for name in FIGURES}
    assert seen == pytest.approx(FIGURES, rel=2e-4)
