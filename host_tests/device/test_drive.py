"""The device with a speed source: a car is aligned by driving, a motorcycle's alignment is checked and refined while
riding, and an unusable speed is reported."""

import math

import pytest
from kickstand.calibration.parameters import Calibration
from kickstand.calibration.store import Store
from kickstand_sim.simulation.scripted import sensor_errors
from support import engines

SHORT, LONG = 0.15, 1.2
POSES = [[2, SHORT], [12, SHORT]]
BEGIN_S, BLOCK_S = 20.0, 30.0  # the bike's blocks of town() begin at BEGIN_S, those of the car at 6 s
INFINITE = float("inf")
LONG_TEST = pytest.mark.long


def town(blocks):
    """Return a ride as [[name of a manoeuvre, arguments...], ...].

    Each block lasts 30 s. The vehicle accelerates, turns, rides straight, brakes and then rests for 8 or 9 s.
    """
    ride = []
    for k in range(blocks):
        ride += [["accelerate", 13.0 + k % 3, 6.0], ["turn", -25.0 if k % 2 else 20.0, 3.0], ["straight", 5.0]]
        ride += [["brake", 0.0, 4.0 + k % 2], ["wait", 9.0 - k % 2]]
    return ride


def stops(time_s, begin_s):
    """Return True if the vehicle is at rest at time_s."""
    return time_s < begin_s or (time_s - begin_s) % BLOCK_S > 21.0


def car(source, blocks, **plan):
    config = {"VEHICLE": "car", "SPEED": source, **plan.pop("config", {})}
    ride = [["wait", 6.0], *town(6)]
    return {"ride": ride, "seed": 3, source: {}, "until": 6.0 + BLOCK_S * blocks, **plan, "config": config}


def bike(source, blocks, stand=(-12.0,), upright=(0.0, 0.0), **plan):
    config = {"SPEED": source, **plan.pop("config", {})}
    ride = [["kickstand", 8.0, *stand], ["upright", 10.0, *upright], *town(8)]
    until = BEGIN_S + BLOCK_S * blocks
    return {"ride": ride, "presses": POSES, source: {}, "until": until, **plan, "config": config}


@pytest.fixture
def stored(tmp_path):
    """Return a function that reads the calibration in flash."""
    return Store(0x68, 8, str(tmp_path)).load


def forward_error_deg(calibration, seed=None):
    """Return the alignment's error in yaw, which driving corrects. seed: the sensor's seed."""
    true = sensor_errors.Sensor(seed=seed).vehicle_from_sensor
    forward = calibration.vehicle_from_sensor[6:9]
    left, up, ahead = (sum(a * b for a, b in zip(true[i : i + 3], forward, strict=True)) for i in (0, 3, 6))
    assert abs(up) < 0.15
    return abs(math.degrees(math.atan2(left, ahead)))


@pytest.mark.parametrize(
    "engine", ["cpython", pytest.param(*engines.ENGINES[1].values, marks=[LONG_TEST, *engines.ENGINES[1].marks])]
)
def test_car_finds_its_alignment_and_shows_the_next_step(engine, run, stored):
    record = run(car("gps", 5, presses=[[60, SHORT], [65, SHORT]]), engine)
    assert record.at(3.0) == ["Brakings   0/5  ", "stop needed     "]
    assert record.first("brake straight") < 8.0 and record.first("braking...") < 30.0
    assert record.at(62.0)[0].startswith("Raw")  # the first press has left the page of the alignment
    assert record.first("Brakings   [2-4]/5", 65.0) < 67.0
    saved_s = record.first("Aligned by drive")
    assert saved_s < 150.0 and stops(saved_s, 6.0) and record.at(saved_s)[1].startswith("error about")
    assert record.first("Accel    0.3", saved_s) < INFINITE  # the first page of a car
    calibration = stored()
    assert calibration.aligned and calibration.by_drive and forward_error_deg(calibration, 3) < 1.5
    assert list(calibration.gyro_bias) == pytest.approx(sensor_errors.Sensor(seed=3).gyro_bias_dps, abs=0.1)
    assert all(len(line) == 16 for frame in record.frames for line in frame[1:])
    later = run(car("gps", 1), engine)
    assert later.at(2.0)[0].startswith(("Accel", "Brake")) and later.at(25.0)[0].startswith("Brake    0.")


@pytest.mark.long
def test_car_finds_out_that_its_sensor_was_remounted(run, stored, tmp_path):
    old = Calibration().with_alignment(sensor_errors.Sensor(seed=3).vehicle_from_sensor, [0.0] * 3, 0.0, True)
    Store(0x68, 8, str(tmp_path)).save(old)
    record = run({**car("wheel", 7, remount=[20.0, 8]), "ride": [["wait", 6.0], *town(7)]})
    assert record.first("Aligned by drive") < INFINITE
    new, true = stored().vehicle_from_sensor, sensor_errors.random_mounting(8)
    # the sensor's errors cause an error of up to 4 degrees
    assert max(abs(a - b) for a, b in zip(new, true, strict=True)) < 0.12


QUESTION = "Side was wrong"
ASKED_S = BEGIN_S + 24.0  # the display asks about the side within 23.5 s, at the first stop
TURN_S = BEGIN_S + BLOCK_S + 9.0  # a time in a left bend with a lean of 25 degrees


def wrong_side(*presses, until_s=TURN_S + 1.0):
    """Return a ride whose kickstand is not on the side that is set."""
    return bike("gps", 2, (12.0,), presses=[*POSES, *presses], until=until_s)


def test_wrong_kickstand_side_hides_the_lean_until_an_answer(run):
    record = run(wrong_side())
    asked_s = record.first(QUESTION)
    assert asked_s < ASKED_S and stops(asked_s, BEGIN_S) and record.at(asked_s)[1] == "hold = fix      "
    assert not stops(record.first("Lean", asked_s), BEGIN_S)  # the question disappears while the bike rides
    assert record.at(TURN_S) == ["Lean  --        ", "side was wrong? "]


def test_wrong_kickstand_side_is_corrected_by_a_long_press(run, stored):
    record = run(wrong_side([ASKED_S, LONG]))
    assert record.first("Side corrected") < ASKED_S + 3.0
    assert record.lean_at(TURN_S) == pytest.approx(-25, abs=4)
    assert record.first(QUESTION, ASKED_S + 3.0) == INFINITE
    assert forward_error_deg(stored()) < 2.0


@pytest.mark.long
def test_errors_of_both_poses_are_found_while_riding(run, stored):
    """A pitch of two degrees on the kickstand gives a yaw error of almost ten degrees. The firmware refines forward at
    a stop. The upright pose was 2 degrees off, which the trim corrects. The new alignment keeps the trim and the
    maxima."""
    errors = []
    plan = bike("wheel", 8, (-12.0, 2.0), (2.0, 0.0))
    plan["presses"] = [*POSES, [BEGIN_S + 232.0, SHORT]]
    record = run(plan, fit=lambda board: board.at(19.0, lambda: errors.append(forward_error_deg(stored()))))
    assert record.first("Aligned!") < 19.0 and errors[0] > 7.0
    assert forward_error_deg(stored()) < 1.5 and stored().by_drive
    for k in range(3, 7):
        assert record.lean_at(BEGIN_S + BLOCK_S * k - 1.0) in (-1, 0, 1)  # the bike is upright here
    assert record.first("Max right +(19|2[0-9])°", BEGIN_S + 232.0) < INFINITE


@pytest.mark.long
def test_moved_mount_hides_the_lean_despite_other_messages(run):
    """Later the wheel's wire also breaks, before the rider has answered the first message."""
    record = run(bike("wheel", 6, remount=[BEGIN_S + 2 * BLOCK_S, 8], wheel={"until_s": 130.0}))
    moved_s = record.first("Mount has moved")
    assert moved_s > BEGIN_S + 2 * BLOCK_S and stops(moved_s, BEGIN_S)
    assert moved_s < record.first("Speed stuck") < INFINITE
    assert not record.leans(moved_s, 500.0)


@pytest.mark.parametrize(
    ("source", "model", "config", "blocks", "words"),
    [
        ("gps", {"faults": [["void", 0, 1000]]}, {}, 1, "GPS: no fix"),
        pytest.param("gps", {"latency_s": 2.5}, {}, 5, "Speed 2.. s late", marks=LONG_TEST),
        pytest.param("wheel", {}, {"PULSES_PER_METRE": 0.5 / 3.6}, 5, "Speed 3.. times", marks=LONG_TEST),
        ("wheel", {"until_s": 40.0}, {}, 3, "Speed stuck at"),
    ],
)
def test_unusable_speed_is_reported_and_nothing_is_stored(source, model, config, blocks, words, run, tmp_path):
    record = run({**car(source, blocks, config=config), source: model})
    assert record.first(words) < INFINITE
    assert list(tmp_path.iterdir()) == []
