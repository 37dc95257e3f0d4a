"""The device of the page Try: the firmware on the simulated board, on a bike that the user steers.

The module runs on MicroPython (in the browser and elsewhere) and on CPython.

    device = PageDevice()
    device.order("button", True)    # do an action of the page's controls, see act()
    device.run_to(0.5)              # run until this board time, in s
    device.take()                   # return a record of display and bike as JSON
"""

import json

from kickstand_sim.demo.hand_bike import HandBike
from kickstand_sim.simulated_board import app_state
from kickstand_sim.simulated_board.clock import PowerOff, Reset, to_us
from kickstand_sim.simulated_board.lcd import shown_lean
from kickstand_sim.simulated_board.oled import Oled
from kickstand_sim.simulated_board.simulator import Board
from kickstand_sim.simulation.scripted.sensor_errors import Sensor

PART_SEED = 1
PART_SHARE = 0.5  # the simulated sensor's errors, as a share of the data sheet's limits
TICK_S = 0.02  # time between two records
REST_US = 10_000  # length of a time step while no firmware runs
CUT_AFTER_BYTES = 40  # bytes of a calibration that are written before the supply is cut
FOREVER_S = 1e9
SHORTEST_PRESS_US = 100_000  # shortest press of the button, in the board's time
STATE = "view", "code", "step", "pose", "entry", "trusted", "fault"
WHOLE_TICKS = 10  # a display that keeps changing is sent at least once per this number of ticks


class PageDevice:
    """A board on a bike, with a record of what the display and the bike showed. powered: False while the supply is off.

    The firmware runs in short pieces, calls of App.step(), because the page must regain control.
    """

    def __init__(self):
        self.bike = HandBike()
        self.board = Board(Sensor(seed=PART_SEED, share=PART_SHARE).world(self.bike.motion))
        self.powered = True
        self._ticks = []
        self._latest_changes = -1  # number of changes of the display until the last tick
        self._sent_changes = -1  # number of changes of the display until it was last sent
        self._held_ticks = 0  # number of ticks since a change was held back
        self._sent_state = None  # the state that was sent last
        self._plugged = True
        self._pressed_us = 0
        self._text = {}
        self._app = None  # the App while its loop runs
        self._stopped = False  # True if main() has ended, as in safe mode
        self.board.every(TICK_S, self._tick)
        self.board.install()

    def act(self, name, value):
        """Do an action at the board's present time. Names and values:

        button: True to press it, False to release it.
        pose: "kickstand", "upright", or a speed in m/s at which the bike rides.
        lean: the lean in degrees, positive to the right.
        sensor: False to pull the sensor's wire, True to plug it in.
        display: "lcd", "ssd1306" or "sh1106".
        cut_save: True to cut the supply during the next save of a calibration, False to cancel this.
        power: True or False.
        """
        board = self.board
        if name == "button":
            now_us = board.clock.now_us
            if value:
                self._pressed_us = now_us
            # board.mjs times a press by the page's clock. After a stall, press and release can arrive at the same board
            # time. Then the firmware would not notice the press.
            board.button.turn(value, now_us if value else max(now_us, self._pressed_us + SHORTEST_PRESS_US))
        elif name == "pose":
            if value in ("kickstand", "upright"):
                self.bike.stand(value)
            else:
                self.bike.ride(value)
        elif name == "lean":
            self.bike.lean_to(value)
        elif name == "sensor":
            if value and not self._plugged:
                board.fit_sensor()
            elif self._plugged and not value:
                board.remove_sensor()
            self._plugged = value
        elif name == "display":
            board.change_display(value)
            if not self.powered:
                board.lcd.power_off()
            self._sent_changes = -1
        elif name == "cut_save":
            if value:
                board.faults.cut_file(".cal", CUT_AFTER_BYTES)
            else:
                board.faults.restore("open")
        elif value:  # the name is "power"
            board.faults.restore("open")  # the supply is cut in one save only
            self.powered = True
        elif self.powered:
            board.clock.power_off()

    def rest(self):
        """Advance the board's time by one step without running the firmware."""
        self.board.clock.advance(REST_US)

    def resume(self, function):
        """Call a function that continues a running firmware. Like Board.run(), but without starting the firmware."""
        try:
            function()
            return "returned"
        except (PowerOff, Reset) as error:
            ended = error  # MicroPython deletes `error` at the end of this block
            return self.board.run(lambda: _raise(ended), FOREVER_S)

    def _tick(self):
        """Add a record, see take(). Display and state are added when they have changed and the display is complete."""
        board = self.board
        t_s = board.clock.now_us / 1e6
        true = self.bike.truth(t_s)
        tick = {
            "t_s": round(t_s, 3),
            "lean_deg": round(true.lean_deg, 2),
            "speed_mps": round(true.speed_mps, 2),
            "yaw_rate_dps": round(true.yaw_rate_dps, 1),
            "phase": true.phase,
            "powered": self.powered,
        }
        meter = self.meter()
        if meter:
            tick["meter"] = meter
        if self._is_settled():
            if board.lcd.changes != self._sent_changes:
                self._sent_changes = board.lcd.changes
                tick["display"] = self._display()
            state = self.state()
            if state != self._sent_state:
                self._sent_state = tick["state"] = state
        self._ticks.append(tick)

    def _is_settled(self):
        """Return True if the display's text is complete, False while the firmware writes some of its characters."""
        changes = self.board.lcd.changes
        still = changes == self._latest_changes
        self._latest_changes = changes
        self._held_ticks = 0 if still else self._held_ticks + 1
        return still or self._held_ticks > WHOLE_TICKS

    def _display(self):
        state = display(self.board.lcd)
        # While an OLED receives a new picture, the text still describes the old one
        if not state["text"][0].startswith("?"):
            self._text = {name: state[name] for name in ("text", "shown_deg")}
        state.update(self._text)
        return state

    def take(self):
        """Return the records since the last call, one per TICK_S, as a JSON list of objects:

        t_s: the board's time.
        lean_deg, speed_mps, yaw_rate_dps, phase: the bike's true motion.
        powered: False while the supply is off.
        meter: result of meter(); missing without a meter.
        display, state: results of display() and state(); missing if unchanged.
        """
        ticks, self._ticks = self._ticks, []
        return json.dumps(ticks)

    def order(self, name, value):
        """Do act(name, value), and return the board's time in s."""
        self._ended(self.resume(lambda: self.act(name, value)))
        return self.board.clock.now_us / 1e6

    def run_to(self, until_s):
        """Advance the board's time to until_s. A start of the firmware may take longer."""
        until_us = to_us(until_s)
        clock = self.board.clock
        while clock.now_us < until_us:
            if not self.powered:
                self.rest()
            elif self._app:
                self._ended(self.resume(lambda: self._turn(self._app, until_us)))
            elif self._stopped:
                self._ended(self.resume(self.rest))
            else:
                self._start()

    def meter(self):
        """Return the lean meter's [lean_deg, forward_g], or None without a meter.

        lean_deg is None if the meter does not trust it, and both values before the alignment.
        """
        if not self._app:
            return None
        meter = self._app.meter
        aligned, lean = meter.calibration.aligned, round(meter.lean_deg, 1)
        return [lean if aligned and meter.trusted else None, round(meter.smooth_force[2], 3) if aligned else None]

    def state(self):
        """Return the entries of STATE. Without an App: the view "off", "starting" or "safe"."""
        if not self._app:
            return {"view": "safe" if self._stopped else "starting" if self.powered else "off"}
        state = app_state.state(self._app)
        return {name: state[name] for name in STATE}

    def _hand_over(self, app):
        """Keep the App to call its step(), instead of calling App.run()."""
        self._app = app

    def _start(self):
        from kickstand.start import main

        ended = self.board.run(lambda: main(self._hand_over, closed_ms=0), FOREVER_S)
        self._stopped = ended == "returned" and self._app is None
        self._ended(ended)
        if self._app:
            self._ended(self.resume(self._app.begin))

    def _turn(self, app, until_us):
        clock = self.board.clock
        while clock.now_us < until_us:
            app.step()

    def _ended(self, ended):
        if ended != "returned":
            self._app = None
            self._stopped = False
            self.powered = ended == "reset"


def display(lcd):
    """Return what a display shows:

    codes, cgram: character codes of both lines, and 8 rows for each of 8 characters; only for an LCD.
    pixels: 64 rows of 128 pixels, 8 pixels per byte, the leftmost in bit 7; only for an OLED.
    lit: True if the display is lit.
    text: the text of both lines.
    shown_deg: the lean that the text shows, in degrees, or None.
    """
    text = lcd.text()
    shown = {"lit": lcd.backlight, "text": text, "shown_deg": shown_lean(text)}
    if isinstance(lcd, Oled):
        shown["pixels"] = list(lcd.pixels())
    else:
        shown["codes"] = lcd.codes() if lcd.on and lcd.two_lines else [[0x20] * 16, [0x20] * 16]
        shown["cgram"] = list(lcd.cgram)
    return shown


def _raise(error):
    raise error
