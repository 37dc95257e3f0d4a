"""Runs the firmware on the simulated board, on a simulated bike, with MicroPython's unix port or CPython.

    device.py script|hand SPEED DISPLAY

SPEED: Simulated seconds per second. 0 means as fast as possible.
DISPLAY: "lcd", "ssd1306" or "sh1106".

Every 50 simulated ms the program prints a line of JSON (see score.State). All other lines of its output are the
firmware's console. The program reads one command per line from standard input:

    short, long                         press the button
    left, right, kickstand, upright     steer the bike by hand
    pause, quit
"""

import json
import os
import sys
import time

from kickstand_sim.demo.hand_bike import HandBike
from kickstand_sim.simulated_board.clock import Clock
from kickstand_sim.simulated_board.oled import Oled
from kickstand_sim.simulated_board.simulator import Board
from kickstand_sim.simulation.scripted.script import Ride, accelerate, brake, kickstand, straight, turn, upright, wait
from kickstand_sim.simulation.scripted.sensor_errors import Sensor

TICK_S = 0.05
PART_SEED = 1
PART_SHARE = 0.5  # limits of the sensor's errors as a share of the data sheet's limits, as for an ordinary sensor
HAND_LIMIT_S = 3600.0
BATTERY_V = 12.6 / 11  # voltage at GPIO 26, after the divider in firmware/examples/user_battery.py
LONG_PRESS_S = 1.2

# The rider presses the button once on the kickstand and once upright, and switches to two other pages after the ride.
# If there is a user.py, the rider also switches to its first page, after the first turn
SCRIPT = (
    kickstand(8.0),
    upright(7.5),
    accelerate(15.0, 6.0),
    turn(-30.0, 4.0),
    straight(1.5),
    turn(38.0, 4.0),
    accelerate(20.0, 3.0),
    turn(-45.0, 4.0),
    straight(1.0),
    brake(0.0, 6.0),
    wait(7.0),
)
KICKSTAND_PRESS_S, UPRIGHT_PRESS_S = 3.5, 11.5
PAGES_BEFORE_END_S = (5.0, 2.5)
OWN_PAGE_S, BETWEEN_PRESSES_S = 28.0, 0.5

_real_sleep = time.sleep  # kept before Board.install() replaces `time`


class Commands:
    """Reads lines from standard input without waiting."""

    def __init__(self):
        self._waiting = []
        self._partial = ""
        self._poll = None
        if sys.implementation.name == "micropython":
            import select

            self._poll = select.poll()
            self._poll.register(sys.stdin, select.POLLIN)
        else:  # a thread reads, because select does not work with pipes on Windows
            import threading

            threading.Thread(target=self._read_all, daemon=True).start()

    def _read_all(self):
        for line in sys.stdin:
            self._waiting.append(line.strip())
        self._waiting.append("quit")

    def next(self):
        """Return the next command, or None."""
        while self._poll and self._poll.poll(0):
            character = sys.stdin.read(1)
            if not character:
                self._waiting.append("quit")  # the input ends when the other process has ended
                self._poll = None
            elif character == "\n":
                self._waiting.append(self._partial)
                self._partial = ""
            else:
                self._partial += character
        return self._waiting.pop(0) if self._waiting else None


def seen(board, bike, of_s=None):
    """Return a dictionary with the fields of score.State, except an OLED's pixels.

    of_s: duration of the run, or None.
    """
    t_s = board.clock.now_us / 1e6
    true = bike.truth(t_s)
    return {
        "t_s": round(t_s, 3),
        "of_s": of_s,
        "lcd": board.lcd.text(),
        "lean_deg": round(true.lean_deg, 2),
        "speed_mps": round(true.speed_mps, 2),
        "phase": true.phase,
        "pressed": board.button.closed,
    }


class Demo:
    """The bike and the board, and the communication with the process that draws."""

    def __init__(self, by_hand, speed, display):
        self._commands = Commands()
        self._paused = False
        self._steer = None
        if by_hand:
            self.bike = HandBike()
            self._steer = self.bike.command
            self.of_s, self.seconds = None, HAND_LIMIT_S
        else:
            self.bike = Ride(SCRIPT)
            self.of_s = self.seconds = self.bike.seconds
        sensor = Sensor(seed=PART_SEED, share=PART_SHARE)
        self.board = Board(sensor.world(self.bike.motion), clock=Clock(speed), display=display)
        self.board.volts[26] = BATTERY_V
        self._pixels, self._seen = "", -1  # an OLED's pixels, and its count of changes when they were read
        if not by_hand:
            self.board.press(KICKSTAND_PRESS_S)
            self.board.press(UPRIGHT_PRESS_S)
            for before_end_s in PAGES_BEFORE_END_S:
                self.board.press(self.seconds - before_end_s)
        self.board.every(TICK_S, self._tick)

    def run(self):
        """Switch the board on, and restart it after every reset, until the time is over or "quit" arrives."""
        self.board.install()
        from kickstand.start import main  # after install(), which replaces `machine` and `time`
        from kickstand.ui.pages import MOTORCYCLE  # the pages of user.py come after these pages

        if not self._steer and "user.py" in os.listdir():
            for k in range(len(MOTORCYCLE)):
                self.board.press(OWN_PAGE_S + BETWEEN_PRESSES_S * k)
        ended = "reset"
        while ended == "reset":
            ended = self.board.run(main, self.seconds)
        self._say({"ended": ended})

    def _tick(self):
        state = seen(self.board, self.bike, self.of_s)
        if isinstance(self.board.lcd, Oled):
            state["pixels"] = self._drawn(self.board.lcd)
        self._say(state)
        self._listen()
        while self._paused:
            _real_sleep(0.02)
            self._listen()

    def _drawn(self, oled):
        if oled.changes != self._seen:
            self._seen = oled.changes
            self._pixels = "".join(["%02x" % byte for byte in oled.pixels()])
        return self._pixels

    def _listen(self):
        command = self._commands.next()
        if command == "short":
            self.board.press()
        elif command == "long":
            self.board.press(for_s=LONG_PRESS_S)
        elif command == "pause":
            self._paused = not self._paused
        elif command == "quit":
            self.board.clock.power_off()
        elif command and self._steer:
            self._steer(command)

    def _say(self, message):
        sys.stdout.write(json.dumps(message) + "\n")
        if hasattr(sys.stdout, "flush"):
            sys.stdout.flush()


def run(kind, speed, display="lcd"):
    """Run the demo's device. kind: "script" or "hand". speed, display: see the module's docstring."""
    Demo(kind == "hand", float(speed), display).run()


if __name__ == "__main__":
    run(*sys.argv[1:])
