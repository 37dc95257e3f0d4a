"""Rides that are hard for a lean meter: in each one condition of the ride is extreme."""

from collections.abc import Callable

from .physics.road import CLASS_A, CLASS_B, CLASS_C
from .plan import Conditions, Plan

Profile = Callable[[Plan], Conditions]


def banked(plan: Plan, road: Profile) -> Conditions:
    """A road that is banked into its turns by up to 10 degrees and cambered by 3 to 6 degrees on the straights.

    On a straight the tyres roll beside their middle, and the bank changes at each turn.
    """
    conditions = road(plan)
    camber = plan.uniform(3.0, 6.0)
    for leg in plan.legs:
        turning = leg.lean_deg is not None and abs(leg.lean_deg) > 5.0
        leg.bank_deg = plan.uniform(0.1, 0.25) * (leg.lean_deg or 0.0) if turning else camber
    return conditions


def wheelie(plan: Plan) -> Conditions:
    """Street riding with wheelies of 10 to 35 degrees, some seconds long."""
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
    """A gusty wind that leans the bike by 2 to 4 degrees on straights, first from one side, then from the other."""
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
    """A rider who hangs off in turns, and luggage on one side.

    Both move the centre of mass: by up to 5 cm, which is 5 degrees of lean, and by 1 to 2 cm.
    """
    conditions = road(plan)
    beside = plan.side() * plan.uniform(0.01, 0.02)
    for leg in plan.legs:
        turning = leg.lean_deg is not None and abs(leg.lean_deg) > 12.0
        leg.hang_m = beside + (
            plan.uniform(0.02, 0.05) * (1.0 if (leg.lean_deg or 0.0) > 0 else -1.0) if turning else 0.0
        )
    conditions.sway_m = 0.004
    return conditions


def held(plan: Plan) -> Conditions:
    """Turns of 60 s at 38 degrees to either side, directly one after the other, by a rider who moves about.

    No straight tells what is upright, and for a minute nothing but the sensor's errors can change the lean.
    """
    plan.begin()
    plan.slope_percent = 1.5
    speed = plan.uniform(18.0, 25.0)
    plan.to_speed(speed, 2.5)
    plan.straight(5.0)
    lean = plan.side() * 35.0  # of the centre of mass: the tyres' width adds 3 degrees to the bike's
    while plan.going_on:
        plan.turn(lean, speed, seconds=60.0, roll_s=2.0)
        lean = -lean
    plan.finish(speed, 3.0)
    return Conditions(CLASS_B * plan.uniform(0.4, 1.2), plan.uniform(0.05, 0.2), unrest_deg=1.5, sway_m=0.01)


def corners(plan: Plan) -> Conditions:
    """Corners of 30 to 55 degrees and 3 to 7 s, with few and short straights, by a rider who moves about."""
    plan.begin()
    plan.slope_percent, plan.roll_dps = 3.0, 80.0
    plan.to_speed(28.0, 4.0)
    while plan.going_on:
        lean = plan.side() * plan.uniform(27.0, 50.0)
        plan.turn(lean, plan.uniform(18.0, 33.0), seconds=plan.uniform(3.0, 7.0), roll_s=1.0)
        if plan.likely(0.4):
            plan.straight(plan.uniform(2.0, 5.0), plan.speed + plan.uniform(0.0, 8.0))
    plan.finish(28.0, 4.0)
    return Conditions(CLASS_A * plan.uniform(0.7, 1.5), plan.uniform(0.08, 0.2), unrest_deg=1.5, sway_m=0.01)


def vibration(plan: Plan, road: Profile) -> Conditions:
    """0.5 g of engine vibration at 6000/min. Its second order, 200 Hz, aliases to nearly 0 Hz."""
    conditions = road(plan)
    conditions.engine_rms_g = 0.5
    conditions.shift_rpm = 6600.0
    conditions.roughness = CLASS_B
    return conditions


def creep(plan: Plan, road: Profile) -> Conditions:
    """The sensor's mount yields: by the end it has turned by 2 to 5 degrees about a random axis."""
    conditions = road(plan)
    conditions.creep_deg = plan.uniform(2.0, 5.0)
    return conditions


def temperature(plan: Plan, road: Profile) -> Conditions:
    """From a cold garage into the sun: 25 C warmer, with a sensor that drifts three times as far as an ordinary one."""
    conditions = road(plan)
    conditions.start_c, conditions.rise_c, conditions.drift = 8.0, 25.0, 3.0
    return conditions


def fall(plan: Plan) -> Conditions:
    """Some riding in town, then a fall at walking pace to either side: 80 degrees of lean, and it stays there."""
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
    """Standing still with the engine off, at one lean of up to 60 degrees, while the sensor warms up."""
    lean = plan.uniform(-60.0, 60.0)
    while plan.going_on:
        plan.add("parked", 10.0, 0.0, lean_deg=lean, slope_percent=0.0, engine=0.0)
    plan.add("parked", 45.0, 0.0)
    return Conditions()
