"""The checks report left-handed axes, a gyro of the opposite sign and exchanged axes. Correct logs get no remark."""

import itertools

import numpy as np
import pytest
from checked import cells_of, simulated, words
from kickstand_tools.checks.handedness import EXCHANGES, better_exchange, handedness, liveliest
from kickstand_tools.logs.log import Log
from kickstand_tools.logs.reader import read_log
from kickstand_tools.simulation.profiles import MAIN, PROFILES
from kickstand_tools.simulation.ride import random_rotation

SIGNED = [
    np.eye(3)[list(order)] * np.array(signs)
    for order in itertools.permutations(range(3))
    for signs in itertools.product((1.0, -1.0), repeat=3)
]
MINUS = -np.eye(3)
EITHER, INSTEAD = "either the accelerations", "and instead of gx, gy, gz right would be"
WRONG_WAY = "are the axes left-handed (reverse one in both sensors) or the gyro of the opposite sign"


def judged(log, accel=None, gyro=None, speed=True):
    """Return the remark on a log whose axes these matrices exchange and reverse, or "" if there is no remark."""
    return words(handedness(cells_of(log, accel, gyro, speed)))


@pytest.mark.parametrize(
    ("profile", "speed"), [("street", False), pytest.param("city", True, marks=pytest.mark.nightly)]
)
def test_all_48_ways_to_exchange_and_reverse_axes(profile, speed):
    """Each matrix is applied to both sensors. A remark is made for the left-handed axes only."""
    remarks = [judged(simulated(profile), exchange, exchange, speed) for exchange in SIGNED]
    for exchange, said in zip(SIGNED, remarks, strict=True):
        assert (WRONG_WAY in said) == bool(said) == (np.linalg.det(exchange) < 0.0), (exchange, said)
    assert sum(map(bool, remarks)) == 24


@pytest.mark.parametrize("profile", PROFILES)
def test_simulated_rides(profile):
    """Without a speed, the check misses some wrong logs, but it never reports a correct log."""
    log = simulated(profile)
    assert judged(log) == judged(log, speed=False) == ""
    assert (WRONG_WAY in judged(log, gyro=MINUS)) is (profile != "parked")
    if profile not in ("parked", "city"):
        assert WRONG_WAY in judged(log, gyro=MINUS, speed=False)
    assert judged(log, gyro=np.eye(3) * np.radians(1.0)) == ""  # rates in rad/s get another remark


@pytest.mark.parametrize("profile", MAIN)
def test_other_rates_biases_and_lengths_do_not_accuse(profile):
    chance = np.random.default_rng(3)
    log = simulated(profile)
    for every, begin, seconds in ((1, 0, 100), (2, 40, 30), (2, 5, 15), (2, 60, 60)):
        part = slice(50 * begin, 50 * (begin + seconds), every)
        rate = log.gyro_dps[part] + chance.uniform(-5.0, 5.0, 3)
        cut = Log(log.t_s[part], log.accel_g[part], rate, log.speed_mps[part])
        assert judged(cut, speed=False) == "", (every, begin, seconds)
        assert judged(cut) == "", (every, begin, seconds)


def test_the_remark_names_what_fits():
    log = simulated("sweeper")
    swap = np.eye(3)[[1, 0, 2]]
    for gyro, accel, line in (
        (np.diag([1, 1, -1]), None, f": the rates are reversed about z, {INSTEAD} gx, gy, -gz"),
        (swap, None, f": the rates about x and y are exchanged, {INSTEAD} gy, gx, gz"),
        (
            None,
            np.diag([1, -1, 1]),
            f"{EITHER} along y are reversed, or the rates are reversed about x and z, {INSTEAD}",
        ),
        (None, swap, f"{EITHER} along x and y are exchanged, or the rates are in another order or of another sign"),
        (np.eye(3)[[1, 2, 0]], None, f": the rates are in another order or of another sign, {INSTEAD} gz, gx, gy"),
        (MINUS, None, WRONG_WAY),
        (None, MINUS, None),  # the log is a mirror image, which motion alone cannot show
    ):
        said = judged(log, accel, gyro)
        assert (line in said) if line else said == "", said


def test_axes_exchanged_in_one_sensor():
    """The log has a speed. 24 of the 47 possible exchanges of axes are tried. At least 23 exchanges must be found, and
    each result must be the right exchange."""
    seen = 0
    log = simulated("street")
    for exchange in EXCHANGES[1::2]:
        turning = liveliest(cells_of(log, gyro=exchange.T))  # `exchange` undoes exchange.T
        assert turning is not None
        place = better_exchange(turning)
        assert place is None or np.array_equal(EXCHANGES[place], exchange)
        seen += place is not None
    assert seen >= 23


def hand(seconds=60.0, seed=0, hz=50):
    """Simulate a phone that is waved in the hand. The phone turns by up to 90 degrees and moves by a few decimetres."""
    chance = np.random.default_rng(seed)
    time = np.arange(0.0, seconds, 1.0 / hz)
    waves = [chance.uniform(0.1, 0.7, (4, 3)), chance.uniform(0.0, 6.3, (4, 3)), chance.normal(0.0, 0.3, (4, 3))]
    angle = np.sum(waves[2] * np.sin(2 * np.pi * waves[0] * time[:, None, None] + waves[1]), axis=1)
    rotation = [np.eye(3)]
    rates = np.diff(angle, axis=0, append=angle[-1:]) * hz
    for rate in rates[:-1]:
        x, y, z = rate / hz
        turn = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
        rotation.append(rotation[-1] @ (np.eye(3) + turn + turn @ turn / 2))
    moved = np.diff(
        np.sin(2 * np.pi * 0.8 * time)[:, None] * chance.normal(0.0, 0.1, 3), n=2, axis=0, prepend=0, append=0
    )
    moved = np.clip(moved * hz * hz / 9.81, -1.0, 1.0)
    force = np.einsum("nji,nj->ni", np.array(rotation), moved + [0.0, 0.0, 1.0])
    return Log(time, force + chance.normal(0.0, 0.01, force.shape), np.degrees(rates))


def test_a_phone_in_the_hand():
    log = hand()
    assert judged(log) == ""
    assert WRONG_WAY in judged(log, gyro=MINUS)


def test_gaps_and_frozen_readings():
    log = simulated("street")
    kept = (log.t_s % 30.0) < 25.0  # leave out five seconds of every half minute
    gaps = log.part(kept)
    assert judged(gaps) == ""
    assert WRONG_WAY in judged(gaps, gyro=MINUS)
    force, rate = log.accel_g.copy(), log.gyro_dps.copy()
    for k in range(1000, len(force) - 1500, 1500):  # freeze the readings for 8 s in every 30 s
        force[k : k + 400], rate[k : k + 400] = force[k], rate[k]
    for sign, codes in (1.0, ["frozen-readings"]), (-1.0, ["frozen-readings", "left-handed"]):
        read = read_log(Log(log.t_s, force, sign * rate, log.speed_mps))
        assert [notice.code for notice in read.notices] == codes


def test_too_little_to_tell():
    still = Log(np.arange(0.0, 60.0, 0.02), np.tile([0.0, 1.0, 0.0], (3000, 1)), np.zeros((3000, 3)))
    assert judged(still) == ""
    assert judged(hand(seconds=8.0), gyro=MINUS) == ""


def test_recordings(shared_data):
    chance = np.random.default_rng(4)
    for path in sorted(shared_data.glob("*.csv.gz")):
        log, turned = read_log(path), random_rotation(chance)
        assert log.notices == [], path
        assert judged(log, turned, turned) == "", path
        assert WRONG_WAY in judged(log, turned, -turned), path
        assert WRONG_WAY in judged(log, -turned, -turned), path


def test_a_bias_is_found_while_fitting():
    """The gyro has a bias of 2.5 deg/s. The phone in the hand is never calm, so the bias cannot be measured in calm
    seconds. The fit itself must find the bias."""
    log = hand(seed=0)
    turning = {}
    for bias in 0.0, 2.5:
        turning[bias] = liveliest(cells_of(Log(log.t_s, log.accel_g, log.gyro_dps + bias)))
    known, unknown = (float(np.mean(turning[bias].unexplained(EXCHANGES[:1]))) for bias in (0.0, 2.5))
    assert unknown < 2.0 * known
