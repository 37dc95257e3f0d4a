"""Runs the whole device on the simulated board and records its display. A run is described as data. Runs on CPython and
MicroPython.

As a script: reads the description as JSON from standard input, runs it in the current directory (the board's
flash) and prints the record as JSON on the last line.
"""

import json
import math
import os
import sys

from kickstand_sim.simulated_board.simulator import Board
from kickstand_sim.simulation.scripted import script, sensor_errors
from kickstand_tools.rides.stream_guest import stream

from support import sd_cards, simulated_phones
from support.page_turner import PageTurner

if sys.implementation.name == "cpython":
    from support import earlier_names

    earlier_names.install()

FRAME_S = 0.1
PRESS_EVERY_S = 0.4  # time between two presses while a page is searched


class CarRide(script.Ride):
    """A ride by car. The car has the yaw rate of a motorcycle with the same lean. The car's body rolls a little
    outwards."""

    ROLL_SHARE = -0.08  # the car's roll as a share of the motorcycle's lean

    def state(self, t_s):
        state = super().state(t_s)
        return state[:1] + (self.ROLL_SHARE * state[1], self.ROLL_SHARE * state[2]) + state[3:]


RAISE_S = 0.3  # duration of the change from one lean of standing() to the next


def standing(plan):
    """Return motion(t_s) of a bike at rest, held at one lean after the other. The bike moves to each lean within
    RAISE_S.

    plan: [[from_s, lean_deg], ...].
    """

    def motion(t_s):
        current = previous = plan[0]
        for entry in plan:
            if t_s >= entry[0]:
                previous, current = current, entry
        share = min(1.0, (t_s - current[0]) / RAISE_S) if current is not previous else 1.0
        change = current[1] - previous[1]
        lean = math.radians(previous[1] + change * share)
        return (math.sin(lean), math.cos(lean), 0.0, 0.0, 0.0, change / RAISE_S if share < 1.0 else 0.0)

    return motion


def poses_of(seed, steps):
    """Return world(t_s) of a sensor that is held in the hand. The sensor is shaken before the first pose and after the
    last.

    steps: [[from_s, up], ...]. `up` is the direction up in the sensor's axes, or None while the sensor is turned.
    """
    part = sensor_errors.Sensor(seed=seed)
    worlds = []
    for i, (start, up) in enumerate(steps):
        if up:
            worlds.append((start, sensor_errors.resting(part, up)))
        elif 0 < i < len(steps) - 1:
            turned = sensor_errors.turning(part, steps[i - 1][1], steps[i + 1][1], start, steps[i + 1][0])
            worlds.append((start, turned))
        else:
            worlds.append((start, None))
    still = sensor_errors.resting(part, (1, 0, 0))

    def world(t_s):
        motion_now = still
        for start, candidate in worlds:
            if t_s >= start:
                motion_now = candidate
        if motion_now:
            return motion_now(t_s)
        return [value + 0.5 * math.sin(30 * t_s + k) for k, value in enumerate(still(t_s))]

    return world


def remounted(world, motion, seed, at_s, mounting_seed):
    """Return world(t_s) of a sensor whose mounting changes at at_s.

    world: the readings before that. motion: the motion of the bike. mounting_seed: seed of the new mounting.
    """
    part = sensor_errors.Sensor(seed=seed)
    part.vehicle_from_sensor = sensor_errors.random_mounting(mounting_seed)
    later = part.world(motion)
    return lambda t_s: world(t_s) if t_s < at_s else later(t_s)


class Device:
    """The whole device on a simulated board. First schedule the events with the methods of the board and the methods
    below, then call run()."""

    def __init__(self, world, **fitted):
        """world(t_s): the motion that the sensor measures. fitted: arguments of Board.

        app: the App that runs, or None.
        """
        self.board = Board(world, **fitted)
        self.frames, self.ends = [], []
        self.phones = []
        self.app = None
        self._turner = PageTurner()

    def turn_to(self, at_s, name):
        """Press the button from at_s on, until the view with this name appears.

        The names are in kickstand/ui/pages.py. run() raises AssertionError if the view never appears.
        """
        self.board.at(at_s, lambda: self._turner.turn_to(name))

    def fit_speed(self, source, ride, place=None, **model):
        """Fit a speed source that measures the speed of the ride.

        source: "gps" or "wheel".
        place: [latitude, longitude, degrees north per second, degrees east per second] of a GPS receiver.
        model: arguments of the source's model.
        """
        if place:
            model["place"] = lambda t_s: (place[0] + place[2] * t_s, place[1] + place[3] * t_s)
        getattr(self.board, "fit_" + source)(lambda t_s: ride.truth(t_s)[1], **model)

    def fit_card(self, formatted=True, faults=(), **model):
        """Fit an SD card with MicroPython's own FAT. faults: [[at_s, attribute, value], ...]."""
        self.board.fit_card(**model)
        if formatted:
            os.VfsFat.mkfs(self.board.card)  # pyright: ignore[reportAttributeAccessIssue]
        for at_s, attribute, value in faults:
            self.board.at(at_s, lambda attribute=attribute, value=value: setattr(self.board.card, attribute, value))

    def run(self, config, off_s, streams=False, prompt_s=0.0):
        """Run the firmware with these settings.

        config: the values in config.py, or None for the file config.py on the import path.
        off_s: times in s at which the power is switched off. After each switch-off except the last, the power is
            switched on again.
        streams: True to start the app as `kickstand record` does.
        prompt_s: time in s at the prompt after the firmware has ended.
        """
        self.board.every(FRAME_S, self._watch)
        self.board.every(PRESS_EVERY_S, self._turn_page)
        self.board.install()
        try:
            if self.board.poses:  # the firmware must be imported on this board
                with FreshFirmware():
                    self._run(config, off_s, streams, prompt_s)
            else:
                self._run(config, off_s, streams, prompt_s)
            if self.ends[-1] == "returned":  # record what the display shows before the power is cut
                self._watch()
            self._turner.check()
        finally:
            self.app = None  # the board's clock would keep it
            forget_config()
            self.board.uninstall()

    def _run(self, config, off_s, streams, prompt_s):
        from kickstand import start

        def main():
            start.main(self._run_app)
            self.board.clock.advance(int(1e6 * prompt_s))

        for until_s in off_s:
            self._run_until(until_s, config, stream if streams else main)

    def _run_app(self, app):
        self.app = app
        app.run()

    def _turn_page(self):
        if self._turner.presses(self.app.screen.view if self.app else None):
            self.board.press(for_s=0.15)

    def record(self):
        """Return the record as data for JSON."""
        board = self.board
        recorded = {"frames": self.frames, "ends": self.ends, "last": self.frames[-1][1:], "too_fast": board.too_fast}
        recorded["touched"] = sorted(board.touched)
        if self.phones:
            recorded["phones"] = [phone.record() for phone in self.phones]
        if board.card:
            recorded["rides"], recorded["card_hz"] = sd_cards.rides(board), board.card.most_hz
        return recorded

    def _run_until(self, until_s, config, main):
        end = "reset"
        while end == "reset":
            sd_cards.eject()
            write_config(config)
            end = self.board.run(main, until_s)
            self.ends.append(end)

    def _watch(self):
        text = list(self.board.lcd.text())
        if not self.frames or self.frames[-1][1:] != text:
            self.frames.append([self.board.clock.now_us / 1e6] + text)


def write_config(settings):
    """Make config.py have these settings for the next boot. None: the file on the import path."""
    if settings is not None:
        sys.modules["config"] = _config(settings)  # type: ignore[assignment]


def forget_config():
    """Undo write_config()."""
    sys.modules.pop("config", None)


def _config(settings):
    """Return a module config.py with these settings. Convert lists to tuples, because JSON has no tuples."""
    values = {name: tuple(value) if isinstance(value, list) else value for name, value in settings.items()}
    return type("Config", (), values)


class FreshFirmware:
    """A context manager in which the firmware is imported again. At its end the earlier modules are back."""

    def __enter__(self):
        self._modules = take_firmware()

    def __exit__(self, *_):
        take_firmware()
        sys.modules.update(self._modules)


def take_firmware():
    """Remove the firmware's modules from Python's imported modules. Return them by name."""
    names = [name for name in sys.modules if name.split(".")[0] == "kickstand"]
    return {name: sys.modules.pop(name) for name in names}


def world_of(plan):
    """Return (world, ride): world(t_s) of a plan, and its Ride or None."""
    seed = plan.get("seed")
    if "poses" in plan:
        return poses_of(seed, plan["poses"]), None
    ride, motion = None, standing(plan.get("lean", [[0, 0]]))
    if "ride" in plan:
        kind = CarRide if (plan.get("config") or {}).get("VEHICLE") == "car" else script.Ride
        ride = kind([getattr(script, name)(*arguments) for name, *arguments in plan["ride"]])
        motion = ride.motion
    part = sensor_errors.Sensor(seed=seed)
    world = part.world(motion)
    if "remount" in plan:
        world = remounted(world, motion, seed, *plan["remount"])
    return world, ride


def run_device(plan, fit=None, made=None):
    """Run a plan and return Device.record(). A plan is data, which can be sent to another process.

    fit: fit(board) changes the board before power-on, or None. made: the result of world_of(plan), if it exists.

    A plan has the time "until" (s) and one of three motions. All other entries are optional.
        "lean": as for standing().
        "ride": [[name of a function in rides, arguments...], ...]. It is a car's ride if "config" has "VEHICLE" "car".
        "poses": as for poses_of().
        "seed": seed of the sensor's errors. None: a perfect sensor.
        "remount": [at_s, seed of the mounting from then on].
        "presses": [[at_s, for_s], ...].
        "turn_to": [[at_s, name of a view], ...], as for Device.turn_to().
        "faults": [[method, arguments], ...].
        "power": [off_s, ...], as for Device.run().
        "config": settings, or None for the file config.py in the flash.
        "board": arguments of Board.
        "gps", "wheel", "card": arguments of Device's methods.
        "phones": one list of acts per simulated Phone, in the order of their visits: [at_s, method, arguments...].
        "stream": True to start the app as `kickstand record` does.
        "prompt": time at the prompt after the firmware has ended, in s.
    """
    world, ride = made or world_of(plan)
    device = Device(world, **plan.get("board", {}))
    for source in ("gps", "wheel"):
        if ride and source in plan:
            device.fit_speed(source, ride, **plan[source])
    if "card" in plan:
        device.fit_card(**plan["card"])
    for acts in plan.get("phones", []):
        device.phones.append(simulated_phones.Phone(device.board, acts))
    for at_s, for_s in plan.get("presses", []):
        device.board.press(at_s, for_s)
    for at_s, name in plan.get("turn_to", []):
        device.turn_to(at_s, name)
    for method, arguments in plan.get("faults", []):
        getattr(device.board.faults, method)(*arguments)
    if fit:
        fit(device.board)
    off_s = plan.get("power", []) + [plan["until"]]
    device.run(plan.get("config", {}), off_s, "stream" in plan, plan.get("prompt", 0.0))
    return device.record()


if __name__ == "__main__":
    record = run_device(json.load(sys.stdin))
    print()
    json.dump(record, sys.stdout)  # one text of all would need one piece of heap
    print()
