"""Tests the parts of the simulation with small inputs. The expected results were computed by hand."""

from types import SimpleNamespace

import numpy as np
import pytest
from kickstand_tools.common.errors import InputError
from kickstand_tools.simulation import files, hands, poses, profiles, ride
from kickstand_tools.simulation.commands import Leg, commands
from kickstand_tools.simulation.physics import bike, chip, engine, mount, road, signals
from kickstand_tools.simulation.plan import Plan, lean_for
from kickstand_tools.simulation.scripted import script, sensor_errors

G = 9.80665


def test_a_smooth_step_is_half_way_in_the_middle():
    """The step is u^3 (10 - 15 u + 6 u^2). At u = 1 / 4 the step is 0.015625 * 6.625."""
    found = signals.smoothstep(np.array([-1.0, 0.0, 0.25, 0.5, 1.0, 2.0]))
    assert found == pytest.approx([0.0, 0.0, 0.103515625, 0.5, 1.0, 1.0])
    assert script._glide(2.0, 6.0, 0.25, 2.0) == pytest.approx((2.4140625, 4.0 * 30.0 * 0.0625 * 0.5625 / 2.0))
    assert script._glide(3.0, 3.0, 0.5, 0.0) == (3.0, 0.0)


def test_integral_and_derivative_of_a_line():
    line = np.array([0.0, 2.0, 4.0])
    assert signals.integral(line, 2.0) == pytest.approx([0.0, 0.5, 2.0])
    assert signals.derivative(line, 2.0) == pytest.approx([4.0, 4.0, 4.0])


def test_smoothing_and_noise_have_their_size():
    step = np.where(np.arange(4000) < 2000, 0.0, 1.0)
    found = signals.smoothed(step, 0.1, 1000.0)
    assert found[1900] == pytest.approx(0.1587, abs=0.003)  # the normal distribution at one sigma before the step
    assert found[[0, -1]] == pytest.approx([0.0, 1.0], abs=1e-6)
    noise = signals.band_noise(np.random.default_rng(1), 20_000, 1.0, 5.0, 200.0)
    power = np.abs(np.fft.rfft(noise)) ** 2
    hz = np.linspace(0.0, 100.0, len(power))
    assert np.std(noise) == pytest.approx(1.0, rel=0.1)
    assert np.mean(power[(hz > 1.5) & (hz < 3.0)]) > 8.0 * np.mean(power[hz < 0.5])
    # The power at 20 Hz is multiplied by (1 + 16)^-2, and the power at 2 Hz by (4 / 5)^2 / (1 + 0.16)^2.
    ratio = np.mean(power[(hz > 19) & (hz < 21)]) / np.mean(power[(hz > 1.9) & (hz < 2.1)])
    assert ratio == pytest.approx((1.0 / 17.0) ** 2 / (0.64 / 1.3456), rel=0.3)


def test_legs_become_signals():
    """In the first leg the bike stands for 2 s. In the second leg the bike reaches 10 m/s within 4 s. In the third leg
    it rides at 10 m/s for 4 s, and reaches a lean of 30 degrees within 2 s."""
    made = commands([Leg("a", 2.0, 0.0), Leg("b", 4.0, 10.0), Leg("a", 4.0, lean_deg=30.0, roll_s=2.0)], 100.0)
    assert len(made.time) == 1000 and made.time[100] == 1.0
    assert made.speed[[100, 400, 800]] == pytest.approx([0.0, 5.0, 10.0], abs=0.01)
    assert made.distance[-1] == pytest.approx(20.0 + 40.0, abs=0.2)
    assert np.degrees(made.lean[[599, 700, 801]]) == pytest.approx([0.0, 15.0, 30.0], abs=0.01)
    assert made.phases == ["a", "b"] and made.phase[[0, 199, 200, 599, 600]].tolist() == [0, 0, 1, 1, 0]
    assert np.all(made.speed[:100] == 0.0) and np.all(made.engine == 0.0)


def test_values_of_a_leg_settle_within_their_times():
    """Hang, lift, engine and wind settle within 1 s, and the bank within 3 s. In a short leg all five settle by the end
    of the leg."""
    more = {"hang_m": 0.1, "lift_deg": 10.0, "engine": 1.0, "crosswind_mps2": 2.0, "bank_deg": 6.0}
    made = commands([Leg("a", 1.0, 5.0), Leg("b", 5.0, **more)], 100.0)  # type: ignore[arg-type]
    half = [made.hang[150], np.degrees(made.lift[150]), made.engine[150], made.crosswind[150]]
    assert half == pytest.approx([0.05, 5.0, 0.5, 1.0])
    assert np.degrees(made.bank[[250, 400]]) == pytest.approx([3.0, 6.0])
    short = commands([Leg("a", 1.0, 5.0), Leg("b", 0.5, hang_m=0.1), Leg("c", 2.0)], 100.0)
    assert short.hang[[125, 150, 300]] == pytest.approx([0.05, 0.1, 0.1])


def test_the_slope_changes_with_the_distance():
    """At 10 m/s the road is level for 50 m. Over the next 50 m the road's slope rises to 10 %."""
    made = commands([Leg("a", 5.0, 10.0, slope_percent=0.0), Leg("b", 5.0, slope_percent=10.0)], 100.0)
    assert np.tan(made.slope[[250, 750, 999]]) * 100.0 == pytest.approx([0.0, 5.0, 10.0], abs=0.03)
    still = commands([Leg("a", 1.0, 0.0, slope_percent=10.0), Leg("b", 1.0, slope_percent=5.0)], 100.0)
    assert np.tan(still.slope) == pytest.approx(np.full(200, 0.1))


def a_plan(seconds=100.0) -> Plan:
    return Plan(np.random.default_rng(1), seconds)


def test_a_lean_balances_its_radius():
    """At 10 m/s on a radius of 10.197 m, the acceleration is 1 g and the lean 45 degrees."""
    assert lean_for(10.0, 100.0 / G) == pytest.approx(45.0)


def test_a_plan_goes_on_until_45_s_before_its_end():
    plan = a_plan(100.0)
    plan.add("a", 54.9)
    assert plan.going_on
    plan.add("a", 0.2)
    assert not plan.going_on and plan.seconds == pytest.approx(55.1)
    short = a_plan(30.0)  # the plan continues for at least 20 s
    short.add("a", 19.9)
    assert short.going_on
    short.add("a", 0.1)
    assert not short.going_on


def test_a_turn_lasts_until_its_heading_has_changed():
    """A lean of 45 degrees at 9.80665 m/s gives a yaw rate of 1 rad/s. A turn by 90 degrees takes 1.571 s. The bike
    rolls into the lean in 1 s, and half of this second counts as part of the turn."""
    plan = a_plan()
    plan.turn(45.0, G, heading_deg=90.0, roll_s=1.0)
    assert plan.legs[-1].seconds == pytest.approx(1.0 + np.pi / 2.0 - 0.5)
    assert (plan.legs[-1].phase, plan.legs[-1].lean_deg, plan.speed) == ("turn", 45.0, G)
    plan.turn(-45.0, G, seconds=3.0, roll_s=1.0)  # the lean changes by 90 degrees at 60 deg/s
    assert plan.legs[-1].roll_s == pytest.approx(1.5) and plan.legs[-1].seconds == pytest.approx(4.5)
    plan.turn(-45.0, G, heading_deg=1.0)
    assert plan.legs[-1].seconds == pytest.approx(1.5 + 0.5)
    plan.turn(-2.0, 30.0, heading_deg=90.0)
    assert plan.legs[-1].seconds == pytest.approx(1.5 + 12.0)
    plan.turn(45.0, 0.5, roll_s=1.0)  # computed as for 1 m/s, with a change of heading of 45 degrees
    assert plan.legs[-1].seconds == pytest.approx(1.0 + 0.5)


def test_speed_changes_take_their_time():
    plan = a_plan()
    plan.to_speed(10.0, 2.5)
    plan.to_speed(4.0, 3.0)
    plan.to_speed(4.1, 3.0)
    assert [(leg.phase, leg.seconds) for leg in plan.legs] == [
        ("speeding up", 4.0), ("braking", 2.0), ("speeding up", 1.0),
    ]  # fmt: skip
    plan.turn(30.0, 10.0, seconds=1.0)
    plan.out_of_turn(16.0, 3.0, roll_s=1.0)
    assert (plan.legs[-1].seconds, plan.legs[-1].roll_s) == pytest.approx((2.0, 1.0))
    plan.out_of_turn(16.0, 3.0, roll_s=1.0)
    assert plan.legs[-1].seconds == pytest.approx(1.0)


def test_braking_into_a_turn_has_two_parts():
    """The bike brakes from 20 to 10 m/s at 5 m/s2. The first part takes 1.3 s, and ends at 13.5 m/s. The second
    part takes 0.9 s instead of 0.7 s, and has half of the lean."""
    plan = a_plan()
    plan.to_speed(20.0, 5.0)
    plan.into_turn(30.0, 10.0, 5.0)
    first, second = plan.legs[-2:]
    assert (first.phase, first.seconds, first.speed_mps) == ("braking", pytest.approx(1.3), pytest.approx(13.5))
    assert (second.phase, second.seconds, second.roll_s) == ("trail braking", 0.9, 0.9)
    assert (second.lean_deg, second.speed_mps) == (15.0, 10.0)
    plan.into_turn(30.0, 10.0, 5.0)
    assert plan.legs[-2].seconds == pytest.approx(0.65 * 1.2)


def test_a_plan_is_shortened_at_its_longest_steady_legs():
    plan = a_plan()
    for seconds, speed in ((5.0, 0.0), (4.0, 10.0), (20.0, None), (8.0, 10.0)):
        plan.add("a", seconds, speed)
    plan.fit(33.0)
    assert [leg.seconds for leg in plan.legs] == [5.0, 4.0, 16.0, 8.0]
    plan.fit(35.0)
    assert [leg.seconds for leg in plan.legs] == [5.0, 4.0, 18.0, 8.0]
    plan.fit(1.0)
    assert plan.legs[2].seconds == 3.0 and plan.legs[0].seconds == 5.0 and plan.legs[1].seconds == 4.0


def test_an_unknown_profile_is_refused():
    profiles.check_profile("street")
    with pytest.raises(InputError, match="no profile cafe: there are street, track"):
        profiles.check_profile("cafe")


def exact_chip(**more) -> chip.Chip:
    zeros = np.zeros(3)
    return chip.Chip(np.eye(3), zeros, np.eye(3), zeros, zeros, zeros, gyro_walk=0.0, **more)


def read(part: chip.Chip, force, rates, temp_c=25.0, n=5000):
    return part.read(
        np.random.default_rng(1), np.tile(np.array(force, float), (n, 1)), np.tile(np.array(rates, float), (n, 1)),
        np.full(n, temp_c),
    )  # fmt: skip


def test_a_chip_adds_its_errors():
    """Acceleration adds 0.1 deg/s per g to the rates. Drifts are proportional to the temperature above 25 C."""
    seen = read(exact_chip(), [0.0, 1.0, -2.0], [10.0, 0.0, 0.0])
    assert seen.shape == (1000, 7)
    assert seen.mean(axis=0) == pytest.approx([0.0, 1.0, -2.0, 25.0, 10.0, 0.1, -0.2], abs=0.003)
    accel, gyro = np.eye(3), np.eye(3)
    accel[0, 1], gyro[2, 0] = 0.02, 0.05
    part = chip.Chip(
        accel, np.array([0.0, 0.1, 0.0]), gyro, np.array([5.0, 0.0, 0.0]), np.array([0.0, 0.0, 0.001]),
        np.array([0.0, 0.1, 0.0]), 0.0,
    )  # fmt: skip
    warm = read(part, [0.0, 1.0, 0.0], [20.0, 0.0, 0.0], temp_c=35.0).mean(axis=0)
    assert warm == pytest.approx([0.02, 1.1, 0.01, 35.0, 25.0, 1.1, 1.0], abs=0.003)


def test_a_chips_noise_and_steps():
    """The noise is 400 ug/sqrt(Hz) and 0.005 deg/s/sqrt(Hz). The low-pass has a noise bandwidth of about 50 Hz."""
    seen = read(exact_chip(), [0.0, 0.0, 0.0], [0.0, 0.0, 0.0], n=50_000)
    assert seen[:, :3].std() == pytest.approx(sensor_errors.ACCEL_NOISE_G, rel=0.2)
    assert seen[:, 4:].std() == pytest.approx(sensor_errors.GYRO_NOISE_DPS, rel=0.2)
    counts = seen[:, 0] * 4096.0, seen[:, 4] * 65.5
    assert all(np.allclose(one, np.round(one), atol=1e-6) for one in counts)
    raw = read(exact_chip(low_pass=False), [0.0, 0.0, 0.0], [0.0, 0.0, 0.0], n=50_000)
    assert raw[:, 0].std() == pytest.approx(400e-6 * np.sqrt(500.0), rel=0.02)
    assert raw[:, 4].std() == pytest.approx(0.005 * np.sqrt(500.0), rel=0.02)


def test_a_chip_clips_at_its_range():
    seen = read(exact_chip(), [9.0, -9.0, 0.0], [600.0, -600.0, 0.0])
    assert seen[0, [0, 1]] == pytest.approx([8.0, -8.0], abs=3e-4)
    assert seen[0, [4, 5]] == pytest.approx([500.0, -500.0], abs=0.02)


def test_the_low_pass_delays_by_5_ms():
    force = np.zeros((2000, 3))
    force[1000:, 0] = 1.0
    seen = exact_chip().read(np.random.default_rng(1), force, np.zeros((2000, 3)), np.full(2000, 25.0))[:, 0]
    # on average a step appears half a sample late
    assert np.sum(1.0 - seen[200:260]) * 5.0 == pytest.approx(4.9 + 2.5, abs=1.0)
    assert chip._DLPF.sum() == pytest.approx(1.0)
    assert chip._DLPF @ np.arange(40) == pytest.approx(4.9, abs=0.2)


def test_a_random_chip_is_within_the_data_sheet():
    chips = [chip.Chip.random(np.random.default_rng(k)) for k in range(200)]
    for values, limit in (
        (np.array([one.accel_offset for one in chips]), np.array([0.05, 0.05, 0.08])),
        (np.array([one.gyro_bias for one in chips]), np.full(3, 20.0)),
        (np.array([one.accel_per_c for one in chips]), np.full(3, 0.0003)),
        (np.array([one.gyro_per_c for one in chips]), np.full(3, 0.06)),
    ):
        assert np.abs(values).max(axis=0) == pytest.approx(limit, rel=0.05) and np.all(np.abs(values) <= limit)
        assert values.min() < 0.0 < values.max()
    for matrices in (np.array([one.accel_matrix for one in chips]), np.array([one.gyro_matrix for one in chips])):
        off = np.abs(matrices - np.eye(3)).max(axis=0)
        assert off == pytest.approx(np.where(np.eye(3) > 0.0, 0.03, 0.02))
    half = chip.Chip.random(np.random.default_rng(1), share=0.5, drift=3.0)
    assert half.accel_offset == pytest.approx(0.5 * chips[1].accel_offset)
    assert half.gyro_per_c == pytest.approx(1.5 * chips[1].gyro_per_c)


def test_gears_keep_the_engine_under_its_shift():
    """The six gears give 370, 260, 205, 170, 150 and 135 revolutions per minute for each m/s. The engine runs at 1250
    per minute or faster."""
    speeds = {0.0: 1250.0, 10.0: 3700.0, 15.0: 3900.0, 22.0: 4510.0, 27.0: 4590.0, 31.0: 4650.0, 40.0: 5400.0}
    for speed, rpm in speeds.items():
        assert engine.crank_rpm(np.full(4000, speed), 5000.0, 1000.0)[2000] == pytest.approx(rpm)


def test_vibration_grows_with_the_engine():
    """At 6000 revolutions per minute the vibration has the rms rms_g. At idle the rms is multiplied by
    0.25 + 0.75 (1250 / 6000)^2. The vibration is at most 0.5 g. The rates vibrate by 15 deg/s per g."""
    running = np.ones(20_000)

    def rms(speed, rms_g, share=1.0):
        force, rates = engine.vibration(
            np.random.default_rng(1), np.full(20_000, speed), share * running, rms_g, 7000.0, 1000.0
        )
        return np.sqrt((force**2).mean(axis=0)) / G, np.degrees(np.sqrt((rates**2).mean(axis=0)))

    force, rates = rms(6000.0 / 370.0, 0.2)
    assert force == pytest.approx([0.2] * 3, rel=0.02) and rates == pytest.approx([3.0] * 3, rel=0.02)
    assert rms(0.0, 0.2)[0] == pytest.approx([0.2 * (0.25 + 0.75 * (1250.0 / 6000.0) ** 2)] * 3, rel=0.02)
    assert rms(6000.0 / 370.0, 0.9)[0] == pytest.approx([0.5] * 3, rel=0.02)
    assert rms(6000.0 / 370.0, 0.2, 0.5)[0] == pytest.approx([0.1] * 3, rel=0.02)


def test_bumps_are_added_to_the_road():
    """The bump is 15 mm high and 1 m long, and begins at 2 m. The road's height is 15 mm in its middle, then 0."""
    slope = np.zeros(200)
    road.add_bumps(slope, [2.0, 3.5], 0.015, 1.0)
    height = np.cumsum(slope) * 0.02
    assert height[99] == pytest.approx(0.0) and height[124] == pytest.approx(0.015, rel=0.02)
    # The road ends before the second bump
    assert height[149] == pytest.approx(0.0, abs=1e-9) and np.all(slope[150:] == 0.0)


def test_the_road_has_the_roughness_of_its_class():
    """For slopes averaged over a length, the variance is (2 pi 0.1)^2 G / (2 length). G is the road's roughness. The
    lengths here are 2 m and 0.1 m."""
    slope = road.profile_slope(np.random.default_rng(1), 20_000.0, road.CLASS_B)
    means = slope[: len(slope) // 100 * 100].reshape(-1, 100).mean(axis=1)
    assert np.var(means) == pytest.approx((2 * np.pi * 0.1) ** 2 * 64e-6 / (2.0 * 2.0), rel=0.05)
    assert np.var(slope) == pytest.approx((2 * np.pi * 0.1) ** 2 * 64e-6 / (2.0 * 0.1), rel=0.05)
    assert len(road.profile_slope(np.random.default_rng(1), 10.0, 1.0)) == 700


def test_the_chassis_moves_as_two_masses_on_two_springs():
    """A mass of 120 kg is on a spring of 17 kN/m with a damper of 1100 Ns/m. Below the spring a mass of 15 kg is on a
    tyre of 150 kN/m. The equations of motion of both masses are solved at four frequencies."""
    for hz in (0.0, 0.1, 1.8, 15.0):
        w = 2.0 * np.pi * hz
        strut = 17e3 + 1j * w * 1100.0
        masses = np.array([[strut - 120.0 * w * w, -strut], [-strut, strut + 150e3 - 15.0 * w * w]])
        chassis, _ = np.linalg.solve(masses, np.array([0.0, 150e3]))
        assert road.transmitted(np.array([hz]))[0] == pytest.approx(chassis)


def test_up_is_seen_by_lean_and_pitch():
    assert poses.up_seen(30.0, 0.0) == pytest.approx([0.5, np.cos(np.radians(30)), 0.0])
    assert poses.up_seen(0.0, 30.0) == pytest.approx([0.0, np.cos(np.radians(30)), 0.5])
    assert poses.up_seen(np.array([90.0, 0.0]), 0.0) == pytest.approx(np.array([[1, 0, 0], [0, 1, 0]]), abs=1e-9)


def test_six_sides_up_to_four_degrees_askew_and_a_slanted_pose():
    seen = [np.array(list(poses.ups(np.random.default_rng(k)))) for k in range(50)]
    for ups in seen:
        assert np.linalg.norm(ups, axis=1) == pytest.approx(np.ones(7))
        sides = {(int(np.argmax(np.abs(up))), bool(up[np.argmax(np.abs(up))] > 0.0)) for up in ups[:6]}
        assert len(sides) == 6
        assert np.min(np.abs(ups[6])) > 0.3
    askew = np.degrees(np.arccos([np.abs(ups[:6]).max(axis=1) for ups in seen]))
    assert 3.9 < askew.max() <= 4.0 and askew.min() < 0.1


def test_a_pose_takes_four_seconds(monkeypatch):
    chance = np.random.default_rng(1)
    held = poses.standing(chance, exact_chip(), np.eye(3), 5.0, 2.0, 30.0, held=True)
    still = poses.standing(chance, exact_chip(), np.eye(3), 5.0, 2.0, 30.0, held=False)
    assert held.shape == still.shape == (800, 7)
    for seen in (held, still):
        assert seen[:, :3].mean(axis=0) == pytest.approx(poses.up_seen(5.0, 2.0), abs=1e-3)
        assert np.all(seen[:, 3] == 30.0)
    monkeypatch.setattr(poses, "still", lambda chance, part, up, temp_c: up)
    swaying = poses.standing(chance, exact_chip(), np.eye(3), 5.0, 0.0, 30.0, held=True)
    # the tolerance is wide, because some of the sway is slower than the 4 s
    assert np.degrees(np.arcsin(swaying[:, 0])).std() == pytest.approx(0.05, rel=0.6)
    assert np.ptp(poses.standing(chance, exact_chip(), np.eye(3), 5.0, 0.0, 30.0, held=False)[:, 0]) == 0.0


def test_the_smallest_rotation_between_two_vectors():
    x, y = np.array([1.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0])
    assert hands._turn_between(x, y) == pytest.approx(np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1]]), abs=1e-12)
    assert hands._turn_between(x, x) == pytest.approx(np.eye(3))
    back = hands._turn_between(x, -x)
    assert back @ x == pytest.approx(-x, abs=1e-12) and np.linalg.det(back) == pytest.approx(1.0)


def test_rotation_vectors_and_matrices_belong_together():
    for vector in ([0.0, 0.0, 0.0], [0.3, -0.2, 0.9], [0.0, 3.0, 0.0], [-2.0, 1.0, 1.0]):
        matrix = hands._rotations(np.array([vector]))[0]
        assert matrix @ matrix.T == pytest.approx(np.eye(3))
        assert hands._rotation_vector(matrix) == pytest.approx(vector, abs=1e-9)
    quarter = hands._rotations(np.array([[0.0, 0.0, np.pi / 2]]))[0]
    assert quarter @ [1.0, 0.0, 0.0] == pytest.approx([0.0, 1.0, 0.0])


def test_a_hand_holds_still_and_turns():
    """Each of three poses takes 4.5 to 6 s. The turn by 90 degrees takes 0.9 to 2 s, and the turn by 180 degrees about
    1.6 times as long."""
    ups = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]])
    hand = hands.Hand(still_s=(5.0, 5.0), turn_s=(1.0, 1.0), heading_deg=0.0, detour_deg=0.0, push_g=0.0)
    seen = hands.procedure(np.random.default_rng(1), exact_chip(), ups, 21.0, hand)
    assert len(seen) / 200.0 == pytest.approx(15.0 + 1.0 + 1.75**0.7, abs=0.02)
    for at_s, up in zip((2.5, 8.5, 15.0), ups):
        assert seen[round(at_s * 200), :3] == pytest.approx(up, abs=0.02)
    turning = slice(1000, 1200)
    assert np.linalg.norm(seen[turning, 4:], axis=1).max() == pytest.approx(90.0 * 15.0 / 8.0, rel=0.01)
    assert np.abs(seen[turning, 4:].sum(axis=0) / 200.0).max() == pytest.approx(90.0, abs=0.5)
    usual = hands.procedure(np.random.default_rng(1), exact_chip(), ups, 21.0)
    assert 3 * 4.5 + 0.9 * 1.6 < len(usual) / 200.0 < 3 * 6.0 + 2.0 * 3.2
    away = hands.procedure(np.random.default_rng(1), exact_chip(), ups, 21.0, hands.Hand(push_g=0.0, heading_deg=0.0))
    norm = np.linalg.norm(away[:, :3], axis=1)
    assert norm == pytest.approx(np.ones(len(norm)), abs=0.02)


def test_positions_are_integrated_from_speed_and_yaw():
    """The vehicle goes 1000 m east in 100 s. 1000 m are 0.0089932 degrees of latitude. For the longitude, 0.0089932
    degrees are divided by cos(47.6 degrees)."""
    n = 20_000
    truth = {"speed_mps": np.full(n, 10.0), "yaw_rate_dps": np.zeros(n)}
    lat, lon, utc_s = files.positions(SimpleNamespace(truth=truth, rate_hz=200.0, time=np.arange(n) / 200.0))  # type: ignore[arg-type]
    assert lat[-1] == pytest.approx(47.6)
    assert lon[-1] == pytest.approx(8.0 + 0.0089932 / np.cos(np.radians(47.6)), abs=1e-6)
    assert utc_s[[0, 200]].tolist() == [1_779_008_400.0, 1_779_008_401.0]
    truth["yaw_rate_dps"][0] = 90.0 * 200.0  # the vehicle turns left to the north within one sample
    lat, lon, _ = files.positions(SimpleNamespace(truth=truth, rate_hz=200.0, time=np.zeros(n)))  # type: ignore[arg-type]
    assert lat[-1] == pytest.approx(47.6089932, abs=1e-6) and lon[-1] == pytest.approx(8.0)


def test_a_sideways_acceleration_is_turned_by_the_lean():
    lean, left = np.radians([0.0, 30.0]), np.array([2.0, 2.0])
    found = ride._sideways(lean, left)
    assert found == pytest.approx(np.array([[2.0, 0.0, 0.0], [np.sqrt(3.0), -1.0, 0.0]]))


def test_bumps_are_at_multiples_of_their_spacing():
    command = SimpleNamespace(phases=["a", "b"], phase=np.array([0, 1, 1, 1, 0]), distance=np.array([0, 2.5, 3, 5, 9]))
    assert ride._distances_in_phase(command, "b", 1.2) == pytest.approx([2.4, 4.8])  # type: ignore[arg-type]
    assert ride._distances_in_phase(command, "c", 1.2) == []  # type: ignore[arg-type]


def test_the_mount_turns_vectors_to_the_sensor():
    mounting = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])
    vector = np.array([[1.0, 2.0, 3.0]])
    assert ride._to_sensor(vector, mounting, np.zeros((1, 3))) == pytest.approx(np.array([[2.0, 1.0, -3.0]]))
    turned = ride._to_sensor(np.array([[1.0, 0.0, 0.0]]), np.eye(3), np.array([[0.0, 0.0, 0.1]]))
    assert turned == pytest.approx(np.array([[0.995, 0.1, 0.0]]))  # cos and sin of 0.1 to second order


def test_a_random_mounting_is_a_rotation():
    for k in range(20):
        turn = ride.random_rotation(np.random.default_rng(k))
        assert turn @ turn.T == pytest.approx(np.eye(3), abs=1e-12) and np.linalg.det(turn) == pytest.approx(1.0)


def test_a_fall_ends_with_an_impact():
    command = SimpleNamespace(
        time=np.arange(2000) / 1000.0, phases=["falling", "lying"], phase=np.where(np.arange(2000) < 1000, 0, 1)
    )
    force = ride._impact(np.random.default_rng(1), command) / G  # type: ignore[arg-type]
    assert np.all(force[:1001] == 0.0)
    assert 2.5 < np.abs(force).max() < 4.0
    assert np.abs(force[1400:]).max() < 4.0 * np.exp(-5.0)
    command.phases = ["falling", "standing"]
    assert np.all(ride._impact(np.random.default_rng(1), command) == 0.0)  # type: ignore[arg-type]


def test_mounts_change_what_they_name():
    part, chance = exact_chip(), np.random.default_rng(1)
    assert mount.aliasing(chance, part).chip.low_pass is False
    clipped = mount.clipping(chance, part).chip
    assert (clipped.accel_range_g, clipped.gyro_range_dps) == (2.0, 250.0)
    warm = [mount.warming(chance, part) for _ in range(200)]
    rises = [one.rise_c for one in warm if one.rise_c is not None]
    assert 15.0 < min(rises) < 15.5 and 24.5 < max(rises) < 25.0 and len(rises) == 200
    drifts = np.array([one.chip.accel_per_c for one in warm])
    assert np.abs(drifts).max() == pytest.approx(0.0015, rel=0.05) and drifts.min() < 0.0
    held = [mount.Holder.random(chance) for _ in range(300)]
    hz, damping = np.array([one.hz for one in held]), np.array([one.damping for one in held])
    assert 5.0 < hz.min() < 5.2 and 38.0 < hz.max() < 40.0
    assert 0.02 < damping.min() < 0.021 and 0.095 < damping.max() < 0.1
    sag = np.degrees([one.sag for one in held]) / (10.0 / hz) ** 2
    assert np.all(sag[:, 1] == 0.0)
    assert (sag[:, [0, 2]].min(), sag[:, [0, 2]].max()) == pytest.approx((0.1, 0.3), abs=0.005)


def test_a_pendulum_is_longer_than_its_height():
    assert bike.Bike(mass_height=0.6, roll_gyration=0.3).pendulum == pytest.approx(0.75)


def test_a_hash_gives_numbers_of_mean_0_and_rms_1():
    assert (sensor_errors.normal(0), sensor_errors.normal(0xFFFFFFFF)) == pytest.approx((-510 / 147.8, 510 / 147.8))
    assert sensor_errors.normal(0x01020304) == pytest.approx((10 - 510) / 147.8)
    numbers = [sensor_errors.normal(sensor_errors.scrambled(k)) for k in range(4000)]
    assert np.mean(numbers) == pytest.approx(0.0, abs=0.05) and np.std(numbers) == pytest.approx(1.0, abs=0.03)
    chance = sensor_errors.Chance(1)
    drawn = [chance.uniform(2.0, 4.0) for _ in range(1000)]
    assert 2.0 <= min(drawn) < 2.02 and 3.98 < max(drawn) <= 4.0 and np.mean(drawn) == pytest.approx(3.0, abs=0.05)


def test_a_scripted_ride_knows_its_distance():
    """The ride covers 20 m while it accelerates from 0 to 10 m/s in 4 s. Then the ride continues at 10 m/s."""
    made = script.Ride([script.upright(1), script.accelerate(10, 4), script.straight(2)], 0.0)
    assert made.seconds == 7.0  # the bike is upright from the beginning, so no time is needed to raise it
    assert made.state(5.0)[8] == pytest.approx(20.0) and made.state(7.0)[8] == pytest.approx(40.0)
    assert made.state(9.0)[8] == pytest.approx(60.0) and made.state(0.5)[8] == 0.0
    assert made.state(3.0)[3:5] == pytest.approx((5.0, 10.0 * 1.875 / 4.0))
    assert made.state(3.0)[9] == pytest.approx(0.5) and made.state(6.0)[0] == "straight"
    assert made.state(0.5)[0] == "upright"


def test_feet_help_below_4_mps():
    lean = np.radians(-45.0)
    assert script.yaw_rate_in_balance(lean, G, 1.0) == 0.0
    assert script.yaw_rate_in_balance(lean, G, 2.5) == pytest.approx(0.5 * G / 2.5)
    assert script.yaw_rate_in_balance(lean, G, 4.0) == pytest.approx(G / 4.0)


def test_the_motion_of_a_body_by_hand():
    """The vehicle turns left with 0.5 rad/s at 10 m/s, so its lateral acceleration is 5 m/s2. First the vehicle is
    upright on a road that rises by 0.1 rad. Then it leans by 30 degrees on a level road."""
    left, up, forward, w_left, w_up, w_forward = script.body_motion(0.0, 0.2, 10.0, 2.0, 0.5, 0.1, 0.03)
    assert left * G == pytest.approx(5.0 * np.cos(0.1)) and up * G == pytest.approx(G * np.cos(0.1) + 0.3)
    assert forward * G == pytest.approx(2.0 + G * np.sin(0.1))
    assert np.radians([w_left, w_up, w_forward]) == pytest.approx([-0.03, 0.5 * np.cos(0.1), 0.5 * np.sin(0.1) + 0.2])
    leaned = script.body_motion(np.radians(30.0), 0.0, 10.0, 0.0, 0.5)
    assert leaned[0] * G == pytest.approx(5.0 * np.cos(np.radians(30)) + G / 2.0)
    assert leaned[1] * G == pytest.approx(G * np.cos(np.radians(30)) - 2.5)
    assert np.radians(leaned[3:5]) == pytest.approx([0.25, 0.5 * np.cos(np.radians(30))])
