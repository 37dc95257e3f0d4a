"""Defines the profiles, which are kinds of ride: ordinary rides, and hard rides with one extreme condition each.

A profile is a function that adds the legs of a ride to a plan, and returns the conditions of the ride.
"""

from collections.abc import Callable

from kickstand_tools.common.messages import InputError

from .physics.road import CLASS_A, CLASS_B, CLASS_C
from .plan import Conditions, Plan, lean_for


def street(plan: Plan) -> Conditions:
    """Country road at 45 to 100 km/h: bends of 10 to 38 degrees, s-bends, lane changes, some traffic lights."""
    plan.begin()
    cruise = plan.uniform(15.0, 24.0)
    plan.to_speed(cruise, 2.5)
    while plan.going_on:
        choice = plan.uniform(0.0, 1.0)
        if choice < 0.12:
            plan.stop(plan.uniform(4.0, 15.0), plan.uniform(2.0, 4.5))
            plan.to_speed(plan.uniform(14.0, 22.0), plan.uniform(2.0, 4.0))
        elif choice < 0.24:  # a lane change
            side, lean = plan.side(), plan.uniform(5.0, 12.0)
            plan.turn(side * lean, plan.speed, seconds=0.1, roll_s=0.9)
            plan.turn(-side * lean, plan.speed, seconds=0.1, roll_s=1.2)
            plan.straight(plan.uniform(2.0, 6.0))
        else:
            _bends(plan, plan.uniform(10.0, 38.0), (11.0, 22.0), 0.35)
        if plan.likely(0.7):
            plan.straight(plan.uniform(2.0, 10.0), plan.uniform(14.0, 27.0))
    plan.finish(plan.uniform(15.0, 22.0), 3.0)
    return Conditions(roughness=CLASS_B * plan.uniform(0.6, 2.0), engine_rms_g=plan.uniform(0.05, 0.2))


def track(plan: Plan) -> Conditions:
    """A race track: leans of 35 to 55 degrees, from side to side in a second, acceleration 0.5 g, braking 0.95 g."""
    plan.begin()
    plan.slope_percent, plan.roll_dps = 4.0, 100.0
    plan.to_speed(30.0, 4.0)
    while plan.going_on:
        lean = plan.side() * plan.uniform(33.0, 49.0)
        corner = plan.uniform(16.0, 38.0)
        if plan.speed > corner + 4.0:
            plan.into_turn(lean, corner, plan.uniform(6.0, 9.3))
        plan.turn(lean, corner, heading_deg=plan.uniform(40.0, 150.0), roll_s=plan.uniform(0.7, 1.2))
        while plan.likely(0.35):  # another turn, to the other side
            lean = -lean * plan.uniform(0.85, 1.1)
            lean = max(-49.0, min(49.0, lean))
            roll_s = plan.uniform(0.7, 1.2)
            plan.turn(lean, plan.speed, heading_deg=plan.uniform(25.0, 80.0), roll_s=roll_s)
        plan.out_of_turn(min(plan.speed + plan.uniform(8.0, 25.0), 62.0), plan.uniform(3.5, 5.5), roll_s=1.2)
        if plan.likely(0.5):
            plan.straight(plan.uniform(1.0, 6.0), min(plan.speed + 5.0, 65.0))
    plan.finish(30.0, 5.0)
    return Conditions(CLASS_A * plan.uniform(0.7, 1.5), plan.uniform(0.08, 0.25), shift_rpm=10000.0, unrest_deg=0.5)


def sweeper(plan: Plan) -> Conditions:
    """Turns held for 60 s at 15 to 45 degrees, with short straights between them."""
    plan.begin()
    plan.slope_percent = 1.5
    speed = plan.uniform(18.0, 28.0)
    plan.to_speed(speed, 3.0)
    side = plan.side()
    while plan.going_on:
        lean, speed = plan.uniform(15.0, 45.0), plan.uniform(17.0, 32.0)
        plan.to_speed(speed, 2.5)
        plan.turn(side * lean, speed, seconds=60.0, roll_s=plan.uniform(1.5, 3.0))
        plan.out_of_turn(speed, 2.0, roll_s=plan.uniform(1.2, 2.5))
        plan.straight(plan.uniform(4.0, 12.0))
        side = -side if plan.likely(0.6) else side
    plan.finish(speed, 3.0)
    return Conditions(CLASS_B * plan.uniform(0.4, 1.2), plan.uniform(0.05, 0.2))


def city(plan: Plan) -> Conditions:
    """Town: junctions, roundabouts, traffic lights with a foot down, walking pace, U-turns."""
    plan.begin()
    plan.slope_percent = 4.0
    plan.to_speed(plan.uniform(8.0, 13.0), 2.5)
    while plan.going_on:
        choice = plan.uniform(0.0, 1.0)
        if choice < 0.3:
            speed = plan.uniform(4.0, 7.5)
            lean = plan.side() * lean_for(speed, plan.uniform(7.0, 14.0))
            plan.into_turn(lean, speed, plan.uniform(2.0, 3.5))
            plan.turn(lean, speed, heading_deg=plan.uniform(70.0, 100.0), roll_s=plan.uniform(0.9, 1.5))
            plan.out_of_turn(plan.uniform(9.0, 14.0), 2.5)
        elif choice < 0.5:
            plan.stop(plan.uniform(3.0, 25.0), plan.uniform(2.0, 4.0))
            plan.to_speed(plan.uniform(8.0, 15.0), plan.uniform(2.0, 3.5))
        elif choice < 0.65:
            plan.to_speed(plan.uniform(1.2, 2.5), 2.0)
            plan.walk(plan.uniform(5.0, 20.0), plan.uniform(0.9, 2.5))
            if plan.likely(0.4):
                plan.turn(plan.side() * plan.uniform(4.0, 9.0), 2.2, heading_deg=150.0, phase="turning round")
            plan.to_speed(plan.uniform(7.0, 12.0), 2.5)
        elif choice < 0.8:  # a roundabout: lean to one side, to the other, and back
            speed, side = plan.uniform(6.0, 9.0), plan.side()
            lean = lean_for(speed, plan.uniform(12.0, 22.0))
            plan.into_turn(-side * lean * 0.6, speed, 2.5)
            plan.turn(side * lean, speed, heading_deg=plan.uniform(90.0, 300.0), roll_s=1.4)
            plan.turn(-side * lean * 0.6, speed, heading_deg=40.0, roll_s=1.3)
            plan.out_of_turn(plan.uniform(9.0, 14.0), 2.5)
        else:
            plan.straight(plan.uniform(3.0, 15.0), plan.uniform(7.0, 15.0))
    plan.finish(plan.uniform(8.0, 13.0), 3.0)
    return Conditions(CLASS_B * plan.uniform(0.8, 3.0), plan.uniform(0.05, 0.2), shift_rpm=4000.0)


def hills(plan: Plan) -> Conditions:
    """A mountain pass: slopes up to 12 %, hairpins of 25 to 42 degrees in which the slope changes."""
    plan.begin()
    plan.slope_percent = 12.0
    plan.to_speed(plan.uniform(11.0, 16.0), 2.5)
    climb = plan.side()
    while plan.going_on:
        climb = -climb if plan.likely(0.1) else climb
        entry, exit_ = climb * plan.uniform(3.0, 12.0), climb * plan.uniform(2.0, 12.0)
        if plan.likely(0.4):  # a hairpin whose slope changes in its middle
            speed, lean = plan.uniform(5.5, 9.0), plan.side() * plan.uniform(22.0, 40.0)
            plan.into_turn(lean, speed, plan.uniform(2.5, 5.0))
            roll_s, inside = plan.uniform(1.0, 1.6), plan.uniform(-2.0, 12.0) * climb
            heading = plan.uniform(150.0, 190.0)
            plan.turn(lean, speed, heading / 2, roll_s=roll_s, phase="hairpin", slope_percent=inside)
            plan.turn(lean, speed, heading / 2, roll_s=0.5, phase="hairpin", slope_percent=exit_)
            plan.out_of_turn(plan.uniform(10.0, 17.0), plan.uniform(2.0, 4.0))
        else:
            _bends(plan, plan.uniform(12.0, 40.0), (9.0, 18.0), 0.4)
        if plan.likely(0.6):
            plan.add("straight", plan.uniform(2.0, 7.0), plan.uniform(12.0, 20.0), lean_deg=0.0, slope_percent=entry)
    plan.finish(plan.uniform(11.0, 16.0), 3.0)
    return Conditions(CLASS_B * plan.uniform(0.6, 2.0), plan.uniform(0.05, 0.2))


def _bends(plan: Plan, lean_deg: float, speeds: tuple[float, float], linked: float) -> None:
    """Add a bend, then further bends to alternate sides. Each further bend follows with the probability `linked`."""
    lean, speed = plan.side() * lean_deg, plan.uniform(*speeds)
    if plan.speed > speed + 2.0:
        plan.into_turn(lean, speed, plan.uniform(2.0, 5.0))
    plan.turn(lean, speed, heading_deg=plan.uniform(20.0, 110.0), roll_s=plan.uniform(1.0, 2.0))
    while plan.likely(linked):
        lean = -lean * plan.uniform(0.7, 1.1)
        lean = max(-42.0, min(42.0, lean))
        roll_s = plan.uniform(1.0, 2.0)
        plan.turn(lean, plan.speed * plan.uniform(0.9, 1.1), heading_deg=plan.uniform(20.0, 80.0), roll_s=roll_s)
    plan.out_of_turn(plan.uniform(*speeds) + 2.0, plan.uniform(1.5, 3.5), roll_s=plan.uniform(1.0, 2.0))


def banked(plan: Plan) -> Conditions:
    """A road that is banked into its turns by up to 10 degrees and cambered by 3 to 6 degrees on the straights.

    On the cambered straights, the tyres roll beside their middle. The bank changes at each turn.
    """
    conditions = street(plan)
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
    """A poor road: hard braking, 6 to 9 m/s2, over bumps of 15 mm every 1.2 m, then a turn."""
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


def crosswind(plan: Plan) -> Conditions:
    """A gusty wind that leans the bike by 2 to 4 degrees on straights, first from one side, then from the other."""
    conditions = street(plan)
    push = plan.side() * plan.uniform(0.35, 0.7)
    half = plan.seconds / 2.0
    passed = 0.0
    for leg in plan.legs:
        leg.crosswind_mps2 = push if passed < half else -push
        passed += leg.seconds
    conditions.gust_mps2 = plan.uniform(0.1, 0.2)
    return conditions


def weight(plan: Plan) -> Conditions:
    """A rider who hangs off by up to 5 cm in turns (5 degrees of lean), and luggage that moves it by 1 to 2 cm."""
    conditions = street(plan)
    offset_m = plan.side() * plan.uniform(0.01, 0.02)
    for leg in plan.legs:
        leg.hang_m = offset_m
        if leg.lean_deg is not None and abs(leg.lean_deg) > 12.0:
            leg.hang_m += plan.uniform(0.02, 0.05) * (1.0 if leg.lean_deg > 0 else -1.0)
    conditions.sway_m = 0.004
    return conditions


def held(plan: Plan) -> Conditions:
    """Turns of 60 s at 38 degrees to alternate sides without a break, by a rider who moves around.

    Without a straight, the filter cannot see the upright direction. So during each turn the sensor's errors alone
    determine the error of the lean.
    """
    plan.begin()
    plan.slope_percent = 1.5
    speed = plan.uniform(18.0, 25.0)
    plan.to_speed(speed, 2.5)
    plan.straight(5.0)
    lean = plan.side() * 35.0  # lean of the centre of mass. On wide tyres the chassis leans 3 degrees more
    while plan.going_on:
        plan.turn(lean, speed, seconds=60.0, roll_s=2.0)
        lean = -lean
    plan.finish(speed, 3.0)
    return Conditions(CLASS_B * plan.uniform(0.4, 1.2), plan.uniform(0.05, 0.2), unrest_deg=1.5, sway_m=0.01)


def corners(plan: Plan) -> Conditions:
    """Corners of 30 to 55 degrees for 3 to 7 s, with few and short straights, by a rider who moves around."""
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


def vibration(plan: Plan) -> Conditions:
    """0.5 g of engine vibration at 6000/min. The vibration's second order, 200 Hz, aliases to nearly 0 Hz."""
    conditions = street(plan)
    conditions.engine_rms_g = 0.5
    conditions.shift_rpm = 6600.0
    conditions.roughness = CLASS_B
    return conditions


def creep(plan: Plan) -> Conditions:
    """The sensor's mount yields: by the end it has turned by 2 to 5 degrees about a random axis."""
    conditions = street(plan)
    conditions.creep_deg = plan.uniform(2.0, 5.0)
    return conditions


def temperature(plan: Plan) -> Conditions:
    """A ride from a cold garage into the sun. The sensor warms up by 25 C, and drifts three times as much as usual."""
    conditions = street(plan)
    conditions.start_c, conditions.rise_c, conditions.drift = 8.0, 25.0, 3.0
    return conditions


def fall(plan: Plan) -> Conditions:
    """Some riding in town, then a fall at walking pace to either side: the bike stays at 80 degrees of lean."""
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


_MAIN = street, track, sweeper, city, hills
_HARD = held, corners, banked, wheelie, bumps, crosswind, weight, vibration, creep, temperature, fall, parked
MAIN: dict[str, Callable[[Plan], Conditions]] = {profile.__name__: profile for profile in _MAIN}
PROFILES = MAIN | {profile.__name__: profile for profile in _HARD}


def check_profile(name: str) -> None:
    if name not in PROFILES:
        raise InputError(f"no profile {name}: there are {', '.join(PROFILES)}")
