"""Runs one program of firmware/examples on the simulated board, under MicroPython.

As a script: reads JSON from standard input and runs the program in the current directory, which is the board's flash.
The bike is aligned and rides a long right turn. The input has these entries:

    program: path of the program. Without a program the lean meter runs with the files in flash.
    until: end of the run in s.
    turn_to: see run().

The output begins with the program's own output. The last line is JSON with these entries:

    frames: text of the display, once per second.
    sent: the bytes that were sent to a UART.
    lamp: level of GPIO 16, once per second.
"""

import json
import sys

from kickstand_sim.simulated_board.simulator import Board
from kickstand_sim.simulation.scripted.script import Ride, accelerate, kickstand, turn
from kickstand_sim.simulation.scripted.sensor_errors import Sensor
from support.page_turner import PageTurner

RIDE = (kickstand(2.0, 0.0), accelerate(15.0, 4.0), turn(35.0, 6.0))


def save_calibration(part, directory=""):
    """Save the calibration that a device with this sensor has after the six positions and the alignment."""
    from kickstand.calibration.parameters import Calibration
    from kickstand.calibration.store import Store

    calibration = Calibration()
    slope = [1.0 / scale for scale in part.accel_scale]
    offset = [-part.accel_offset_g[i] * slope[i] for i in range(3)]
    calibration.set_parameters(offset + slope + list(part.gyro_bias_dps) + list(part.vehicle_from_sensor) + [0.0])
    calibration.six_done = calibration.aligned = True
    Store(0x68, 8, directory).save(calibration)


def run(program, until_s, turn_to):
    """Run the program on the simulated board.

    turn_to: [[at_s, name of a view], ...]. From at_s on, the button is pressed until this view is shown.

    Raises AssertionError if a view is never shown.
    """
    part = Sensor(seed=3)
    board = Board(part.world(Ride(RIDE).motion))
    board.install()
    save_calibration(part)
    turner, apps = PageTurner(), []
    for at_s, name in turn_to:
        board.at(at_s, lambda name=name: turner.turn_to(name))

    def turn_page():
        if turner.presses(apps[0].screen.view if apps else None):
            board.press()

    def run_app(app):
        apps.append(app)
        app.run()

    board.every(0.5, turn_page)
    board.volts[26] = 12.6 / 11
    frames, lamp = [], []
    board.every(1.0, lambda: frames.append(board.lcd.text()))
    board.every(1.0, lambda: lamp.append(board.pin_level(16)))
    if program:
        with open(program, encoding="utf-8") as file:
            source = file.read()
        board.run(lambda: exec(source, {"__name__": "__main__"}), until_s)
    else:
        from kickstand.start import main

        board.run(lambda: main(run_app), until_s)
    turner.check()
    return {"frames": frames, "lamp": lamp, "sent": board.sent.decode()}


if __name__ == "__main__":
    plan = json.load(sys.stdin)
    print("\n" + json.dumps(run(plan["program"], plan["until"], plan["turn_to"])))
