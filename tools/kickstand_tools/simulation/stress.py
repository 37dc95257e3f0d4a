"""What hurts: each a ride with one thing gone to its limit."""

from collections.abc import Callable

from .physics.road import CLASS_B, CLASS_C
from .plan import Conditions, Plan

Profile = Callable[[Plan], Conditions]


def banked(plan: Plan, road: Profile) -> Conditions:
    """A road banked into its turns by up to 10 degrees, and one cambered by 3 to 6 degrees on the straights.

    The tyres stand on the flank on a straight, and the change of bank comes with each turn.
    """
    conditions = road(plan)
    camber = plan.uniform(3.0, 6.0)
    for leg in plan.legs:
        turning = leg.lean_deg is not None and abs(leg.lean_deg) > 5.0
        leg.bank_deg = plan.uniform(0.1, 0.25) * (leg.lean_deg or 0.0) if turning else camber
    return conditions


def wheelie(plan: Plan) -> Conditions:
    """Street riding with the front wheel lifted by 10 to 35 degrees for some seconds now and then."""
    plan.begin()
    while plan.going_on:
        plan.to_speed(plan.uniform(9.0, 14.0), 3.0)
        plan.straight(plan.uniform(2.0, 5.0))
        lift = plan.uniform(10.0, 35.0)
        plan.add("wheelie", plan.uniform(1.5, 4.0), plan.speed + plan.uniform(5.0, 12.0), lift_deg=lift)
        plan.add("straight", 2.0, None, lift_deg=0.0)
        lean = plan.side() * plan.uniform(15.0, 35.0)
        plan.turn(lean, plan.uniform(12.0, 18.0), heading_deg=plan.uniform(40.0, 120.0))
        plan.out_of_turn(plan.speed, 3.0)
    plan.finish(15.0, 3.0)
    return Conditions()


def bumps(plan: Plan) -> Conditions:
    """Hard braking, 6 to 9 m/s2, over braking bumps of 15 mm every 1.2 m, on a poor road; then a turn."""
    plan.begin()
    while plan.going_on:
        plan.to_speed(plan.uniform(20.0, 32.0), plan.uniform(3.0, 5.0))
        plan.straight(plan.uniform(2.0, 6.0))
        lean, speed = plan.side() * plan.uniform(20.0, 40.0), plan.uniform(9.0, 15.0)
        plan.into_turn(lean, speed, plan.uniform(6.0, 9.0))
        plan.turn(lean, speed, heading_deg=plan.uniform(40.0, 150.0), roll_s=1.1)
        plan.out_of_turn(speed + 5.0, 3.0)
    plan.finish(18.0, 4.0)
    return Conditions(roughness=CLASS_C, bumps=[("braking", 1.2, 0.015, 1.0)])


def crosswind(plan: Plan, road: Profile) -> Conditions:
    """A wind that leans the bike 2 to 4 degrees on straights: from one side, then the other, with gusts."""
    conditions = road(plan)
    push = plan.side() * plan.uniform(0.35, 0.7)
    half = plan.seconds / 2.0
    passed = 0.0
    for leg in plan.legs:
        leg.crosswind_mps2 = push if passed < half else -push
        passed += leg.seconds
    conditions.gust_mps2 = plan.uniform(0.1, 0.2)
    return conditions


def weight(plan: Plan, road: Profile) -> Conditions:
    """A rider who hangs off in turns (up to 5 cm: 5 degrees), and luggage 1 to 2 cm beside the middle."""
    conditions = road(plan)
    beside = plan.side() * plan.uniform(0.01, 0.02)
    for leg in plan.legs:
        turning = leg.lean_deg is not None and abs(leg.lean_deg) > 12.0
        leg.hang_m = beside + (
            plan.uniform(0.02, 0.05) * (1.0 if (leg.lean_deg or 0.0) > 0 else -1.0) if turning else 0.0
        )
    conditions.sway_m = 0.004
    return conditions


def vibration(plan: Plan, road: Profile) -> Conditions:
    """Half a g at 6000/min, where the second order is at 200 Hz and aliases to nearly standing still."""
    conditions = road(plan)
    conditions.engine_rms_g = 0.5
    conditions.shift_rpm = 6600.0
    conditions.roughness = CLASS_B
    return conditions


def creep(plan: Plan, road: Profile) -> Conditions:
    """The sticky tape gives: by the end the sensor has turned 2 to 5 degrees about any axis."""
    conditions = road(plan)
    conditions.creep_deg = plan.uniform(2.0, 5.0)
    return conditions


def temperature(plan: Plan, road: Profile) -> Conditions:
    """From a cold garage into the sun: 25 C of warming, of a part that drifts three times as usual."""
    conditions = road(plan)
    conditions.start_c, conditions.rise_c, conditions.drift = 8.0, 25.0, 3.0
    return conditions


def fall(plan: Plan) -> Conditions:
    """Some riding in town, then over at walking pace to either side, 80 degrees, and left lying."""
    plan.begin()
    while plan.going_on:
        plan.to_speed(plan.uniform(8.0, 13.0), 2.5)
        plan.straight(plan.uniform(3.0, 8.0))
        plan.turn(plan.side() * plan.uniform(12.0, 25.0), plan.uniform(7.0, 11.0), heading_deg=90.0)
        plan.out_of_turn(plan.uniform(8.0, 12.0), 2.5)
    plan.to_speed(0.8, 3.0)
    plan.walk(3.0, 0.6)
    side = plan.side()
    plan.add("falling", 1.1, 0.0, lean_deg=side * 74.0, roll_s=1.05)
    plan.add("lying", 3.0, 0.0)
    plan.add("lying", plan.uniform(20.0, 40.0), 0.0, engine=0.0)
    return Conditions()


def parked(plan: Plan) -> Conditions:
    """Standing still, engine off, at one lean of up to 60 degrees, while the box warms up."""
    lean = plan.uniform(-60.0, 60.0)
    while plan.going_on:
        plan.add("parked", 10.0, 0.0, lean_deg=lean, slope_percent=0.0, engine=0.0)
    plan.add("parked", 45.0, 0.0)
    return Conditions()
