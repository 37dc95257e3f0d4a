"""The checks report left-handed axes, a gyro of the opposite sign and exchanged axes. Correct logs get no remark."""

import numpy as np
import pytest
from checked import bins_of, hand, simulated, words
from kickstand_sim.simulation.profiles import PROFILES
from kickstand_sim.simulation.ride import random_rotation
from kickstand_tools.checks.axes import PERMUTATIONS, TurningFit, handedness, is_wrong, likeliest
from kickstand_tools.checks.log import check_log
from kickstand_tools.checks.turning import bias_dps
from kickstand_tools.logs.log import BIN_S, Log
from kickstand_tools.logs.reader import read_log

MINUS = -np.eye(3)
EITHER, INSTEAD = "either the accelerations", "and instead of gx, gy, gz right would be"
WRONG_WAY = "are the axes left-handed (reverse one in both sensors) or the gyro of the opposite sign"
UNNAMED = (
    "axes are exchanged or reversed in one of the sensors, or left-handed in both, and this ride does not show which"
)
UNSURE = "parked", "city"  # rides that do not show the sign of all rates
DEFAULT = "street", "sweeper"  # the other profiles take longer than the default tests may


def judged(log, accel=None, gyro=None, speed=True):
    """Return the remark on a log whose axes these matrices exchange and reverse, or "" if there is no remark."""
    return words(handedness(bins_of(log, accel, gyro, speed)))


@pytest.mark.parametrize("profile", [pytest.param(p, marks=[] if p in DEFAULT else pytest.mark.long) for p in PROFILES])
def test_only_rates_of_the_opposite_sign_are_reported(profile):
    log = simulated(profile)
    assert judged(log) == ""
    assert (WRONG_WAY in judged(log, gyro=MINUS)) is (profile not in UNSURE)
    assert judged(log, gyro=np.eye(3) * np.radians(1.0)) == ""  # rates in rad/s get another remark


@pytest.mark.parametrize("number", [7, 30, *(pytest.param(k, marks=pytest.mark.long) for k in range(1, 48, 4))])
def test_axes_exchanged_in_both_sensors_are_wrong_if_left_handed(number):
    exchange = PERMUTATIONS[number]
    remark = judged(simulated("street"), exchange, exchange)
    assert (WRONG_WAY in remark) == bool(remark) == (np.linalg.det(exchange) < 0.0)


@pytest.mark.parametrize(
    ("gyro", "accel", "line"),
    [
        (np.diag([1, 1, -1]), None, f": the rates are reversed about z, {INSTEAD} gx, gy, -gz"),
        (np.eye(3)[[1, 0, 2]], None, f": the rates about x and y are exchanged, {INSTEAD} gy, gx, gz"),
        (
            None,
            np.diag([1, -1, 1]),
            f"{EITHER} along y are reversed, or the rates are reversed about x and z, {INSTEAD}",
        ),
        (None, np.eye(3)[[1, 0, 2]], f"{EITHER} along x and y are exchanged, or the rates are in another order"),
        (np.eye(3)[[1, 2, 0]], None, f": the rates are in another order or of another sign, {INSTEAD} gz, gx, gy"),
    ],
)
def test_the_remark_names_what_fits(gyro, accel, line):
    assert line in judged(simulated("street"), accel, gyro)


def test_a_mirror_image_gets_no_remark():
    """If all accelerations have the opposite sign, the log is a correct log of the mirrored ride."""
    assert judged(simulated("street"), accel=MINUS) == ""


def fits(*left, windows=10):
    """Return the fits of exchanges 0, 1 and so on, with these mean squares of the unexplained force, in g2."""
    return {k: TurningFit(np.full(windows, g2), np.zeros(3), 0.0) for k, g2 in enumerate(left)}


@pytest.mark.parametrize(
    ("own", "other", "windows", "wrong"),
    [(0.0199, 0.01, 10, False), (0.0201, 0.01, 10, True), (0.0299, 0.01, 3, False), (0.0301, 0.01, 3, True)]
    + [(0.0017, 0.0008, 10, False), (0.0019, 0.0008, 10, True)],
)
def test_another_exchange_must_be_clearly_better(own, other, windows, wrong):
    """The residual must fall to below half, in few windows to below a third, and by at least 0.001 g2."""
    assert is_wrong(fits(own, other, windows=windows)) is wrong


@pytest.mark.parametrize(
    ("second", "windows", "named"), [(0.0129, 10, None), (0.0131, 10, 1), (0.0179, 3, None), (0.0181, 3, 1)]
)
def test_an_exchange_is_named_only_if_no_other_fits_nearly_as_well(second, windows, named):
    assert likeliest(fits(second, 0.01, windows=windows)) == named


@pytest.mark.parametrize(
    "number", [pytest.param(k, marks=[] if k == 20 else pytest.mark.long) for k in range(2, 48, 6)]
)
def test_a_named_exchange_is_the_right_one(number):
    remark = handedness(bins_of(simulated("street"), gyro=PERMUTATIONS[number].T))
    assert remark is not None
    assert remark.code == "axes-misfit" or np.array_equal(remark.values, PERMUTATIONS[number])


def test_a_phone_in_the_hand():
    log = hand()
    assert judged(log) == ""
    assert WRONG_WAY in judged(log, gyro=MINUS)
    assert "right would be gy, gx, gz" in judged(log, gyro=np.eye(3)[[1, 0, 2]])


def test_gaps_and_frozen_readings():
    log = simulated("street")
    gaps = log.part((log.t_s % 30.0) < 25.0)  # leave out five seconds of every half minute
    assert judged(gaps) == ""
    assert WRONG_WAY in judged(gaps, gyro=MINUS)
    force, rate = log.accel_g.copy(), log.gyro_dps.copy()
    for k in range(1000, len(force) - 1500, 1500):  # freeze the readings for 8 s in every 30 s
        force[k : k + 400], rate[k : k + 400] = force[k], rate[k]
    for sign, codes in (1.0, ["frozen-readings"]), (-1.0, ["frozen-readings", "left-handed"]):
        checked = check_log(Log(log.t_s, force, sign * rate, log.speed_mps))
        assert [notice.code for notice in checked.notices] == codes


def test_too_little_to_tell():
    still = Log(np.arange(0.0, 60.0, 0.02), np.tile([0.0, 1.0, 0.0], (3000, 1)), np.zeros((3000, 3)))
    assert judged(still) == ""
    assert judged(hand(seconds=8.0), gyro=MINUS) == ""


@pytest.mark.parametrize("bias", [[0.0, 0.0, 0.0], [12.0, -5.0, 3.0]])
def test_the_bias_is_found_in_a_ride_of_long_bends(bias):
    """Without a standstill and in bends of 60 s, the median rate is not the gyro's bias."""
    log = simulated("held")
    bins = bins_of(log.part((log.t_s > 20.0) & (log.t_s < 130.0)))
    resting_rate = np.mean(log.gyro_dps[log.t_s < 2.0], axis=0)
    fitted = bias_dps(bins.force, bins.rate - resting_rate + bias, bins.valid, BIN_S)
    assert fitted == pytest.approx(np.array(bias), abs=1.5)


def test_recordings(shared_data):
    chance = np.random.default_rng(4)
    for path in sorted(shared_data.glob("*.csv.gz")):
        log, turned = read_log(path), random_rotation(chance)
        assert check_log(log).notices == [], path
        assert judged(log, turned, turned) == "", path
        if "car" not in path.name:  # a car hardly leans, so its log need not show a wrong sign
            remark = judged(log, turned, -turned)
            assert WRONG_WAY in remark or UNNAMED in remark, path


@pytest.mark.long
def test_recordings_of_the_opposite_sign(shared_data):
    for path in sorted(shared_data.glob("*.csv.gz")):
        for accel, gyro in ((np.eye(3), MINUS), (MINUS, MINUS)):
            remark = judged(read_log(path), accel, gyro)
            assert WRONG_WAY in remark or UNNAMED in remark or (remark == "" and "car" in path.name), path
