"""Simulated rides: plans, possible values, the special condition of each profile, poses, files and memory."""

import functools

import numpy as np
import pytest
from kickstand.units import STANDARD_GRAVITY as G
from kickstand_sim.simulation import hands
from kickstand_sim.simulation.commands import Leg, commands
from kickstand_sim.simulation.files import simulate
from kickstand_sim.simulation.plan import Plan, lean_for
from kickstand_sim.simulation.profiles import PROFILES
from kickstand_sim.simulation.ride import ride
from kickstand_tools.logs.reader import read_log
from kickstand_tools.signals import rotation_matrix
from kickstand_workshop.evaluation.bands import QUANTITIES, bands_of
from support.command import works


def test_legs_become_signals():
    """The bike stands for 2 s, and reaches 10 m/s within 4 s. Then it reaches a lean of 30 degrees within 2 s. The
    rider's other values settle within 1 s, and the bank within 3 s."""
    extras = {"hang_m": 0.1, "lift_deg": 10.0, "engine": 1.0, "crosswind_mps2": 2.0, "bank_deg": 6.0}
    legs = [Leg("a", 2.0, 0.0), Leg("b", 4.0, 10.0), Leg("a", 4.0, lean_deg=30.0, roll_s=2.0, **extras)]
    signals = commands(legs, 100.0)
    assert len(signals.time) == 1000 and signals.time[100] == 1.0 and signals.phases == ["a", "b"]
    assert signals.speed[[100, 400, 800]] == pytest.approx([0.0, 5.0, 10.0], abs=0.01)
    assert signals.distance[-1] == pytest.approx(20.0 + 40.0, abs=0.2)
    assert np.degrees(signals.lean[[599, 700, 801]]) == pytest.approx([0.0, 15.0, 30.0], abs=0.01)
    assert signals.phase[[0, 199, 200, 599, 600]].tolist() == [0, 0, 1, 1, 0]
    half = [signals.hang[650], np.degrees(signals.lift[650]), signals.engine[650], signals.crosswind[650]]
    assert half == pytest.approx([0.05, 5.0, 0.5, 1.0])
    assert np.degrees(signals.bank[[750, 900]]) == pytest.approx([3.0, 6.0])


def test_the_slope_changes_with_the_distance():
    """At 10 m/s the road is level for 50 m. Over the next 50 m the road's slope rises to 10 %."""
    moving = commands([Leg("a", 5.0, 10.0, slope_percent=0.0), Leg("b", 5.0, slope_percent=10.0)], 100.0)
    assert np.tan(moving.slope[[250, 750, 999]]) * 100.0 == pytest.approx([0.0, 5.0, 10.0], abs=0.03)
    still = commands([Leg("a", 1.0, 0.0, slope_percent=10.0), Leg("b", 1.0, slope_percent=5.0)], 100.0)
    assert np.tan(still.slope) == pytest.approx(np.full(200, 0.1))


def test_a_turn_lasts_until_its_heading_has_changed():
    """A lean of 45 degrees at 9.80665 m/s gives a yaw rate of 1 rad/s. A turn by 90 degrees takes 1.571 s. The bike
    rolls into the lean in 1 s, and half of this second counts as part of the turn."""
    assert lean_for(10.0, 100.0 / G) == pytest.approx(45.0)
    plan = Plan(np.random.default_rng(1), 100.0)
    plan.turn(45.0, G, heading_deg=90.0, roll_s=1.0)
    plan.turn(-45.0, G, seconds=3.0, roll_s=1.0)  # the lean changes by 90 degrees at 60 deg/s
    plan.turn(-2.0, 30.0, heading_deg=90.0)
    plan.into_turn(30.0, 10.0, 5.0)
    plan.out_of_turn(16.0, 3.0, roll_s=1.0)
    plan.to_speed(10.0, 3.0)
    assert [(leg.phase, round(leg.seconds, 3), leg.speed_mps) for leg in plan.legs] == [
        ("turn", 2.071, G),
        ("turn", 4.5, G),
        ("turn", 13.5, 30.0),
        ("braking", 2.6, 17.0),
        ("trail braking", 1.4, 10.0),
        ("out of turn", 2.0, 16.0),
        ("braking", 2.0, 10.0),
    ]
    assert plan.seconds == pytest.approx(sum(leg.seconds for leg in plan.legs))
    plan.fit(20.0)  # the longest legs at a constant speed are shortened, but not below 3 s
    assert [round(leg.seconds, 1) for leg in plan.legs] == [2.1, 3.0, 13.5, 2.6, 1.4, 2.0, 2.0]


@functools.cache
def ride_of(name):
    return ride(name, 5, 150.0)


def test_a_seed_determines_the_ride():
    first, repeated, different = ride("street", 1, 30.0), ride("street", 1, 30.0), ride("street", 2, 30.0)
    for name in ("readings", "upright", "kickstand", "procedure", "vehicle_from_sensor"):
        assert np.array_equal(getattr(first, name), getattr(repeated, name))
        assert not np.array_equal(getattr(first, name), getattr(different, name))


def test_a_seed_gives_the_rides_of_earlier_versions():
    """Published figures depend on the rides. The figures are sums over the plans of all profiles, and mean readings."""
    legs = []
    for name, profile in PROFILES.items():
        plan = Plan(np.random.default_rng([1, *name.encode()]), 400.0)
        profile(plan)
        legs += plan.legs
    sums = [sum(getattr(leg, name) or 0.0 for leg in legs) for name in ("seconds", "speed_mps", "lean_deg")]
    assert [len(legs), *sums] == pytest.approx([1525, 6964.6172, 21399.6515, 289.497797])
    simulated = ride("fall", 1, 35.0, road="D", mount="holder")
    readings = [0.5444, 0.5244, 0.4558, 22.7288, 5.1693, 5.6495, 9.0380]
    assert np.abs(simulated.readings).mean(axis=0) == pytest.approx(readings, abs=1e-4)
    assert simulated.upright.mean(axis=0)[:3] == pytest.approx([-0.1136, -0.9301, -0.2875], abs=1e-4)
    assert simulated.procedure.mean(axis=0)[:3] == pytest.approx([-0.0453, -0.0142, 0.0650], abs=1e-4)


DEFAULT = "street", "city", "fall"
TIERED = [name if name in DEFAULT else pytest.param(name, marks=pytest.mark.long) for name in PROFILES]
# Ranges of the largest lean in degrees, the largest speed in m/s, and the largest yaw rate in deg/s
RANGES = {
    "street": ((25, 45), (18, 28), (12, 60)),
    "track": ((40, 58), (30, 66), (20, 90)),
    "sweeper": ((15, 53), (17, 33), (6, 35)),
    "city": ((12, 45), (9, 16), (20, 90)),
    "hills": ((28, 50), (11, 21), (25, 110)),
    "held": ((36, 50), (18, 26), (14, 40)),
    "corners": ((38, 60), (20, 45), (15, 60)),
}
CONDITIONS = {
    "fall": lambda r: seconds(r, r.phase == "lying") > 20 and abs(abs(r.truth["lean_deg"][-1]) - 80.0) < 2.0,
    "city": lambda r: "stopped" in r.phase or "walking pace" in r.phase,
    "sweeper": lambda r: seconds(r, r.phase == "turn") > 60,
    "held": lambda r: all(seconds(r, sign * r.truth["lean_deg"] > 25.0) > 40 for sign in (1, -1)),
    "hills": lambda r: np.abs(r.truth["slope_deg"]).max() > 4.0,
    "wheelie": lambda r: r.truth["pitch_deg"].max() > 9.0,
    "bumps": lambda r: np.gradient(r.truth["speed_mps"], 0.005).min() < -5.5,
    "parked": lambda r: np.ptp(r.truth["lean_deg"]) == 0.0,
    "temperature": lambda r: np.ptp(r.readings[:, 3]) > 5.0,
    "crosswind": lambda r: abs(np.mean(r.truth["lean_deg"][(r.phase == "straight") & (r.time > 0.5 * r.time[-1])])) > 1,
}


def seconds(simulated, where):
    return np.sum(where) / simulated.rate_hz


@pytest.mark.parametrize("name", TIERED)
def test_simulated_values_are_possible_for_a_motorcycle(name):
    simulated = ride_of(name)
    truth = simulated.truth
    assert all(np.all(np.isfinite(values)) for values in [simulated.readings, *truth.values()])
    assert simulated.rate_hz == 200.0 and np.allclose(np.diff(simulated.time), 0.005)
    assert 140.0 < simulated.time[-1] < 270.0
    assert np.abs(truth["lean_deg"]).max() < (85.0 if name in ("fall", "parked") else 60.0)
    assert 0.0 <= truth["speed_mps"].min() and truth["speed_mps"].max() < 70.0
    assert np.abs(truth["slope_deg"]).max() < np.degrees(np.arctan(0.125))
    assert np.abs(np.gradient(truth["lean_deg"], 0.005)).max() < 250.0
    standing = truth["speed_mps"] == 0.0
    assert np.abs(truth["yaw_rate_dps"][standing]).max(initial=0.0) < 0.5
    assert name not in CONDITIONS or CONDITIONS[name](simulated)
    for column, (least, highest) in zip(("lean_deg", "speed_mps", "yaw_rate_dps"), RANGES.get(name, ())):
        assert least < np.abs(truth[column]).max() < highest
    stand = truth["lean_deg"][simulated.phase == "kickstand"]
    assert np.all(np.abs(stand - stand[:1]) < 0.02)  # a moving rider does not tilt a bike on its stand


def in_vehicle(simulated):
    """Return the force in g and the rates in deg/s along the vehicle's axes, while the bike rides."""
    riding = simulated.truth["speed_mps"] > 5.0
    turned = simulated.vehicle_from_sensor.T
    return (simulated.readings[:, :3] @ turned)[riding], (simulated.readings[:, 4:7] @ turned)[riding]


def test_a_rough_road_and_a_bad_mount_change_the_readings():
    """A class D road is eight times as rough as class A, measured from 1 to 3 Hz, where the springs resonate. The mount
    changes the readings, but not the ride."""
    calm, rough = (ride("street", 3, 40.0, road=road) for road in "AD")
    assert np.array_equal(calm.truth["speed_mps"], rough.truth["speed_mps"])
    bands = [bands_of(*in_vehicle(simulated), 200.0)[QUANTITIES[0]] for simulated in (calm, rough)]
    assert 5.0 < bands[1][3] / bands[0][3] < 9.0
    assert bands[0][3] < 0.078 < bands[1][3]  # a recorded ride through town has 0.078 g
    for mount in ("holder", "clipping"):
        bad = ride("street", 3, 40.0, road="D", mount=mount)
        assert np.array_equal(rough.truth["lean_deg"], bad.truth["lean_deg"])
        assert not np.allclose(rough.readings, bad.readings, atol=0.01)


def test_poses_have_six_sides_up_and_one_slanted():
    """A hand tilts the sensor by up to 4 degrees."""
    tilts = []
    for seed in range(50):
        ups = np.array(list(hands.ups(np.random.default_rng(seed))))
        assert np.linalg.norm(ups, axis=1) == pytest.approx(np.ones(7)) and np.min(np.abs(ups[6])) > 0.3
        axes = np.argmax(np.abs(ups[:6]), axis=1)
        assert len({(int(axis), bool(up[axis] > 0.0)) for axis, up in zip(axes, ups)}) == 6
        tilts.append(np.degrees(np.arccos(np.abs(ups[:6]).max(axis=1))))
    assert 3.9 < np.max(tilts) <= 4.0 and np.min(tilts) < 0.1
    assert hands.up_seen(30.0, 0.0) == pytest.approx([0.5, np.cos(np.radians(30)), 0.0])
    assert hands.up_seen(0.0, 30.0) == pytest.approx([0.0, np.cos(np.radians(30)), 0.5])


def test_the_rates_of_a_hand_turn_gravity_to_each_pose():
    """The test integrates the direction up in the sensor's axes: du/dt = -rate x u. Between the poses, the hand also
    accelerates the sensor. share=0: the sensor has no errors besides noise."""
    simulated = ride("parked", 1, 20.0, share=0.0)
    readings = simulated.procedure
    still = np.linalg.norm(readings[:, 4:], axis=1) < 1.0
    up, off = readings[:200, :3].mean(axis=0), []
    for reading, rests in zip(readings, still):
        up = rotation_matrix(-np.radians(reading[4:]) / 200.0) @ up
        if rests:
            off.append(np.linalg.norm(up - reading[:3]))
    assert np.median(off) < 0.03 and np.percentile(off, 95) < 0.1
    assert 7 * 4.5 < seconds(simulated, still) < 7 * 6.5
    assert 7 * 4.5 + 6 * 0.9 < len(readings) / 200.0 < 7 * 6.0 + 6 * 3.2
    for pose, is_still in ((simulated.kickstand, False), (simulated.upright, True)):
        assert pose.shape == (800, 7)
        lean = np.degrees(np.arctan2(*(pose[:, :3] @ simulated.vehicle_from_sensor.T).T[:2]))
        assert np.mean(lean) == pytest.approx(0.0 if is_still else simulated.stand_deg, abs=0.1)


def test_simulate_writes_logs_that_calibrate_and_replay(tmp_path):
    directory = tmp_path / "r"
    simulated = simulate("hills", 2, directory, 60.0, speed=True)
    six, aligned, log = tmp_path / "six.json", tmp_path / "both.json", directory / "RIDE.csv"
    works("calibrate", "six", *[directory / f"POSE_{k}.csv" for k in range(1, 8)], "--out", six)
    pair = directory / "KICKSTAND.csv", directory / "UPRIGHT.csv"
    works("calibrate", "two", *pair, "--calibration", six, "--out", aligned)
    works("replay", log, "--calibration", aligned, "--out", tmp_path / "lean.csv")
    truth = (directory / "TRUTH.csv").read_text().splitlines()
    assert truth[0] == "t_s,lean_deg,speed_mps,yaw_rate_dps,pitch_deg,slope_deg,phase"
    assert len(truth) == len(log.read_text().splitlines()) == 60 * 200 + 1
    ride_log, speed = read_log(log), simulated.truth["speed_mps"]
    assert np.flatnonzero(~np.isnan(ride_log.speed_mps))[:3].tolist() == [0, 200, 400]
    assert ride_log.speed_mps[8000] == pytest.approx(speed[8000], abs=0.01)
    # A degree of latitude is 111.2 km
    north_m, east_m = 111_195.0 * np.diff(ride_log.lat_deg[::200]), 75_000.0 * np.diff(ride_log.lon_deg[::200])
    assert np.hypot(north_m, east_m).sum() == pytest.approx(speed.sum() / 200.0, rel=0.02)
    assert ride_log.utc_s[200] - ride_log.utc_s[0] == pytest.approx(1.0)
