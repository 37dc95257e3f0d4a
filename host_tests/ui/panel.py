"""The Screen of a real App on a simulated board, whose events and samples come from the test."""

import math
from array import array
from typing import Any

import numpy as np
from kickstand.calibration.parameters import Calibration
from kickstand_sim.simulated_board.simulator import Board
from support.board_access import level

with Board(level):  # for the clock
    from kickstand.ui import pages as pages

panels = []  # those of the present test, whose recordings the fixture `board` ends
SHORT, LONG = 1, 2  # as in board/button.py
RATE_HZ = 200
G_LSB, DPS_LSB = 2048, 65.5  # counts per g and per deg/s of the ranges of 16 g and 500 deg/s
AXES = (1, 0, 0, 0, 0, 1, 0, -1, 0)  # left, up, forward along the sensor's x, z, -y


def turned(angle_deg, axis):
    """Return a rotation matrix (Rodrigues)."""
    x, y, z = np.array(axis) / np.linalg.norm(axis)
    cross, angle = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]]), math.radians(angle_deg)
    return np.eye(3) + math.sin(angle) * cross + (1.0 - math.cos(angle)) * cross @ cross


class Panel:
    """A rider's view of the device: presses and samples in, two lines out.

    now_ms: the present time, which hold() and turn() advance.
    attitude: rotation from the sensor's axes to the world's axes, whose z points up.
    """

    def __init__(self, aligned=True, **config):
        from kickstand.app import App
        from kickstand.settings import Settings

        settings = Settings(type("Config", (), config))
        sensor = settings.open_sensor()
        sensor.chip.who_am_i = 0x68
        sensor.chip.take = lambda k: None  # sample() sets the counts
        sensor.fault = None
        self.app: Any = App(settings, settings.open_lcd(), sensor)
        self.app.calibration.chip_started(sensor.chip)
        if aligned:
            self.app.calibration.save(self.app.calibration.value.with_alignment(AXES, (0.0, 0.0, 0.0)))
        self.sensor: Any = sensor
        panels.append(self)
        self.screen: Any = self.app.screen
        self.meter: Any = self.app.meter
        self.now_ms = 0
        self.attitude = np.eye(3)
        self.bias_dps = np.zeros(3)
        self.noise = np.random.default_rng(1)
        self.stand()

    def stand(self):
        """Let the meter read two seconds at rest, after which it trusts its lean."""
        for _ in range(2 * RATE_HZ):
            self.meter.update_sum(array("i", (0, 0, G_LSB, 0, 0, 0, 0)), 1, 1_000_000 // RATE_HZ)

    def press(self, event, at_ms=None):
        self.now_ms = self.now_ms if at_ms is None else at_ms
        self.screen.press(event, self.now_ms)
        return self.lines()

    def content(self):
        """Return what the App would pass to the display now."""
        if self.screen.wizard:
            self.screen.guide(0, 0, self.now_ms)
        self.screen.tick(self.now_ms)
        return self.screen.lines(self.now_ms)

    def lines(self, at_ms=None):
        """Return the two lines, with a degree sign and # for a full cell."""
        self.now_ms = self.now_ms if at_ms is None else at_ms
        line1, line2 = self.content()[:2]
        return line1.replace("\xdf", "°"), line2.replace("\xdf", "°").replace("\xff", "#") if isinstance(
            line2, str
        ) else line2

    def choose(self, entry):
        """Open the menu and choose an entry. Return the lines after it."""
        self.press(LONG)
        while self.screen.menu.entry != entry:
            self.press(SHORT)
        return self.press(LONG)

    def sample(self, rate_dps=(0.0, 0.0, 0.0), force_g=(0.0, 0.0, 0.0)):
        """Pass a sample to the wizard, as App does. force_g: additional force along the sensor's axes."""
        self.now_ms += 1000 // RATE_HZ
        chip = self.sensor.chip
        if self.screen.wizard is None:
            return
        up = self.attitude.T @ (0, 0, 1) + force_g
        values = [*(G_LSB * up), 0, *(DPS_LSB * (np.array(rate_dps) + self.bias_dps))]
        for i, value in enumerate(np.round(values + self.noise.normal(0, 2, 7))):
            chip.counts[i] = chip.sums[i] = max(-32768, min(32767, int(value)))
        self.screen.guide(1, 1_000_000 // RATE_HZ, self.now_ms)

    def hold(self, seconds, **motion):
        for _ in range(round(RATE_HZ * seconds)):
            self.sample(**motion)
        return self.lines()

    def turn(self, angle_deg, axis, seconds=1.0):
        """Turn the sensor about an axis of its own."""
        count = round(RATE_HZ * seconds)
        axis = np.array(axis) / np.linalg.norm(axis)
        step = turned(angle_deg / count, axis)
        for _ in range(count):
            self.attitude = self.attitude @ step
            self.sample(rate_dps=angle_deg / seconds * axis)
        return self.lines()

    def walk(self, count):
        """Return the names of the pages on `count` short presses."""
        names = []
        for _ in range(count):
            self.lines()
            names.append(self.screen.view)
            self.press(SHORT)
        return names


def reading(counts, calibration=None):
    """Return a LeanMeter after one reading of 4096 counts per g and 65.5 counts per deg/s."""
    from kickstand.lean.meter import LeanMeter

    calibration = calibration or Calibration()
    calibration.set_scale(4096, DPS_LSB)
    meter = LeanMeter(calibration)
    meter.update_sum(array("i", counts), 1, 0)
    return meter
