"""The whole device on the simulated board: a run described as data, its display recorded. CPython and
MicroPython.

As a script: reads the description as JSON from standard input, runs it in the current directory (the board's
flash) and prints the record as JSON on the last line.
"""

import json
import math
import sys

import cards
from kickstand_tools.simulated_board.simulator import Board
from kickstand_tools.simulation.scripted import script, sensor_errors

FRAME_S = 0.1


def standing(plan):
    """motion(t_s) of a bike that stands at the leans of the plan [[from_s, lean_deg], ...] and jumps between them."""

    def motion(t_s):
        now = plan[0]
        for entry in plan:
            if t_s >= entry[0]:
                now = entry
        lean = math.radians(now[1])
        return (math.sin(lean), math.cos(lean), 0.0, 0.0, 0.0, 0.0)

    return motion


def poses_of(seed, steps):
    """world(t_s) of the bare sensor: steps [[from_s, [up in its own axes] or None while it is being turned],
    ...]."""
    part = sensor_errors.Sensor(seed=seed)
    worlds = [(start, sensor_errors.resting(part, up) if up else None) for start, up in steps]
    still = sensor_errors.resting(part, (1, 0, 0))

    def world(t_s):
        now = still
        for start, candidate in worlds:
            if t_s >= start:
                now = candidate
        if now:
            return now(t_s)
        return [value + 0.5 * math.sin(30 * t_s + k) for k, value in enumerate(still(t_s))]

    return world


def remounted(world, motion, seed, at_s, mounting_seed):
    """world(t_s) of a sensor that is mounted at another angle from at_s on."""
    part = sensor_errors.Sensor(seed=seed)
    part.vehicle_from_sensor = sensor_errors.random_mounting(mounting_seed)
    later = part.world(motion)
    return lambda t_s: world(t_s) if t_s < at_s else later(t_s)


def take_firmware():
    """Forget the firmware's modules that are imported, and return them by name."""
    names = [name for name in sys.modules if name.split(".")[0] == "kickstand"]
    return {name: sys.modules.pop(name) for name in names}


def run_device(plan):
    """Run a plan. Returns the display's frames [[t_s, line1, line2], ...] as they changed, the last of them, and how
    each boot ended.

    plan: "until" (s); "lean" as for standing(), or "ride" [[name of a function in rides, arguments...], ...],
    or "poses" as for poses_of; "seed" of the part (None: perfect); its "temp_c"; "presses" [[at_s, for_s], ...];
    "faults" [[method, arguments], ...]; "board" arguments of Board; "config" settings; "power" [off_s, ...];
    "gps" or "wheel" arguments of the models, which are told the speed of the ride, the first also its "place":
    [latitude, longitude, degrees north a second, degrees east a second]; config "VEHICLE" "car": the ride
    is a car's; "remount" [at_s, seed of the mounting from then on]; "stream" True: as `kickstand record` starts it;
    "card" arguments of the model of an SD card, which is formatted, and whose content is returned as "rides"; "card
    faults" [[at_s, attribute, value], ...].
    """
    seed = plan.get("seed")
    ride = None
    if "poses" in plan:
        world = poses_of(seed, plan["poses"])
    else:
        if "ride" in plan:
            kind = script.CarRide if plan.get("config", {}).get("VEHICLE") == "car" else script.Ride
            ride = kind([getattr(script, name)(*more) for name, *more in plan["ride"]])
            motion = ride.motion
        else:
            motion = standing(plan.get("lean", [[0, 0]]))
        part = sensor_errors.Sensor(seed=seed)
        part.temp_c = plan.get("temp_c", 25.0)
        world = part.world(motion)
        if "remount" in plan:
            world = remounted(world, motion, seed, *plan["remount"])
    board = Board(world, **plan.get("board", {}))
    for source in ("gps", "wheel"):
        if ride and source in plan:
            more = dict(plan[source])
            if "place" in more:
                more["place"] = lambda t_s, p=more["place"]: (p[0] + p[2] * t_s, p[1] + p[3] * t_s)
            getattr(board, "fit_" + source)(lambda t_s, ride=ride: ride.truth(t_s)[1], **more)
    if "card" in plan:
        board.fit_card(**plan["card"])
        cards.format_card(board, plan)
    for at_s, for_s in plan.get("presses", []):
        board.press(at_s, for_s)
    for method, arguments in plan.get("faults", []):
        getattr(board.faults, method)(*arguments)
    frames = []

    def watch():
        text = board.lcd.text()
        if not frames or frames[-1][1:] != list(text):
            frames.append([board.clock.now_us / 1e6] + list(text))

    board.every(FRAME_S, watch)
    board.install()
    ends = []
    before = take_firmware() if board.poses else {}  # it needs firmware that is imported on it
    try:
        from kickstand import devices, settings, start
        from kickstand.app import App
        from kickstand.rides.usb_stream import RideStream
        from kickstand.settings import Settings

        class Config:
            pass

        for name, value in plan.get("config", {}).items():
            setattr(Config, name, tuple(value) if isinstance(value, list) else value)

        def stream():
            chosen = settings.load()
            App(chosen, devices.open_lcd(chosen), devices.open_sensor(chosen), RideStream()).run()

        main = stream if "stream" in plan else start.main
        load = settings.load
        settings.load = lambda: Settings(Config)
        for until_s in plan.get("power", []) + [plan["until"]]:
            end = "reset"
            while end == "reset":
                cards.eject()
                end = board.run(main, until_s)
                ends.append(end)
        if ends[-1] == "returned":  # with power on: what stays on the display
            watch()
        settings.load = load
        if ends[-1] == "returned":  # what it leaves on the display
            watch()
    finally:
        board.uninstall()
        if board.poses:
            take_firmware()
            sys.modules.update(before)
    answer = {
        "frames": frames,
        "ends": ends,
        "last": frames[-1][1:],
        "too_fast": board.too_fast,
        "touched": sorted(board.touched),
    }
    if board.card:
        answer["rides"] = cards.rides(board)
        answer["card_hz"] = board.card.most_hz
    return answer


if __name__ == "__main__":
    record = run_device(json.load(sys.stdin))
    print("\n" + json.dumps(record))
