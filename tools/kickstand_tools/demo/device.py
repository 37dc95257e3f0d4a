"""The firmware on the simulated board, on a simulated bike. Runs under MicroPython's unix port or CPython.

    demo_device.py script|hand SPEED

SPEED: simulated seconds per second, 0 for as fast as it goes. Every 50 simulated ms a line of JSON goes to
standard output (LCD, true lean, speed, phase); other lines are the device's own console. Commands come in by
standard input, one a line: short, long (the button), left, right, kickstand, upright (the bike, if steered by
hand), pause, quit.
"""

import json
import sys
import time

from kickstand_tools.demo.hand_bike import HandBike
from kickstand_tools.simulated_board.simulator import Board, PowerOff
from kickstand_tools.simulation.scripted.script import Ride, accelerate, brake, kickstand, straight, turn, upright, wait
from kickstand_tools.simulation.scripted.sensor_errors import Sensor

TICK_S = 0.05
PART_SEED = 1
PART_SHARE = 0.5  # half of the data sheet's worst offset and scale: an ordinary part
HAND_LIMIT_S = 3600.0
LONG_PRESS_S = 1.2

# The rider presses once on the kickstand, once upright, and looks at the other two pages after the ride.
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

_real_sleep = time.sleep  # kept before the board puts its own clock in the place of time


class Commands:
    """Lines of standard input, without ever waiting for one."""

    def __init__(self):
        self._waiting = []
        self._partial = ""
        self._poll = None
        if sys.implementation.name == "micropython":
            import select

            self._poll = select.poll()
            self._poll.register(sys.stdin, select.POLLIN)
        else:  # select knows no pipes on Windows
            import threading

            threading.Thread(target=self._read_all, daemon=True).start()

    def _read_all(self):
        for line in sys.stdin:
            self._waiting.append(line.strip())
        self._waiting.append("quit")

    def next(self):
        """The next command, or None."""
        while self._poll and self._poll.poll(0):
            character = sys.stdin.read(1)
            if not character:
                self._waiting.append("quit")  # whoever watched is gone
                self._poll = None
            elif character == "\n":
                self._waiting.append(self._partial)
                self._partial = ""
            else:
                self._partial += character
        return self._waiting.pop(0) if self._waiting else None


class Demo:
    """The bike, the board and the talk with the host."""

    def __init__(self, by_hand, speed):
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
        self.board = Board(sensor.world(self.bike.motion), pace=speed)
        if not by_hand:
            self.board.press(KICKSTAND_PRESS_S)
            self.board.press(UPRIGHT_PRESS_S)
            for before_end_s in PAGES_BEFORE_END_S:
                self.board.press(self.seconds - before_end_s)
        self.board.every(TICK_S, self._tick)

    def run(self):
        """Power on, and on again after every reset, until time is up or the host says quit."""
        self.board.install()
        import main  # after install(), which decides what `machine` and `time` are

        ended = "reset"
        while ended == "reset":
            ended = self.board.run(main.main, self.seconds)
        self._say({"ended": ended})

    def _tick(self):
        t_s = self.board.clock.now_us / 1e6
        lean_deg, speed_mps, _, phase = self.bike.truth(t_s)
        self._say(
            {
                "t_s": round(t_s, 3),
                "of_s": self.of_s,
                "lcd": self.board.lcd.text(),
                "lean_deg": round(lean_deg, 2),
                "speed_mps": round(speed_mps, 2),
                "phase": phase,
                "pressed": self.board.button.closed,
            }
        )
        self._listen()
        while self._paused:
            _real_sleep(0.02)
            self._listen()

    def _listen(self):
        command = self._commands.next()
        if command == "short":
            self.board.press()
        elif command == "long":
            self.board.press(for_s=LONG_PRESS_S)
        elif command == "pause":
            self._paused = not self._paused
        elif command == "quit":
            raise PowerOff
        elif command and self._steer:
            self._steer(command)

    def _say(self, message):
        sys.stdout.write(json.dumps(message) + "\n")
        if hasattr(sys.stdout, "flush"):
            sys.stdout.flush()


def run(kind, speed):
    """kind: "script" or "hand"; speed: see above."""
    Demo(kind == "hand", float(speed)).run()


if __name__ == "__main__":
    run(sys.argv[1], sys.argv[2])
