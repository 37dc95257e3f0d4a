"""Simulates a bike that you steer with keys or in the browser. Runs on CPython and MicroPython.

The bike's motion follows the same equations as simulation/scripted/script.py.
"""

from math import degrees, pi, radians, sin

from kickstand.units import STANDARD_GRAVITY

from ..simulation.scripted import script

CRUISE_MPS = 15.0
LEAN_STEP_DEG = 5.0
MAX_LEAN_DEG = 50.0

_STEP_S = 0.005
# The lean follows the commanded lean like a critically damped oscillator with this natural frequency, in rad/s
_ROLL_RATE = 4.0
_SPEED_RATE = 1.5  # rate in 1/s at which the speed approaches the commanded speed
_MAX_ACCELERATION, _MAX_BRAKING = 3.0, 5.0  # m/s2
_SWAY_RADPS = 2.0 * pi * 0.4


class HandBike:
    """A bike that starts on the kickstand. Steer it with command(), or with stand(), ride() and lean_to().

    motion() and truth() return the same values as in script.Ride, but their argument t_s must not decrease.
    """

    def __init__(self, vibration_g=0.05):
        self._vibration_g = vibration_g
        self._t_s = 0.0
        self._pose = "kickstand"  # "kickstand", "upright" or "riding"
        self._lean_wish = 0.0
        self._cruise = CRUISE_MPS
        self._lean, self._lean_rate = radians(script.KICKSTAND_DEG), 0.0
        self._speed, self._acceleration, self._distance = 0.0, 0.0, 0.0
        self._sway = 0.0  # amplitude, rad

    def command(self, name):
        """Carry out a command.

        "left" and "right" make a standing bike set off. They lean a riding bike 5 degrees further to that side.
        "upright" and "kickstand" stop the bike in this pose.
        """
        if name in ("kickstand", "upright"):
            self.stand(name)
        elif name in ("left", "right") and self._pose != "kickstand":
            step = LEAN_STEP_DEG if name == "right" else -LEAN_STEP_DEG
            if self._pose == "riding":
                self.lean_to(self._lean_wish + step)
            self._pose = "riding"

    def stand(self, pose):
        """Stop, and stand in this pose, "kickstand" or "upright"."""
        self._pose = pose
        self._lean_wish = 0.0

    def ride(self, speed_mps):
        """Set off, or change the speed. speed_mps must be over script.RIDING_MPS. A slower bike does not lean."""
        self._pose = "riding"
        self._cruise = speed_mps

    def lean_to(self, lean_deg):
        """Lean to this angle, positive to the right, at most 50 degrees.

        The bike stays upright while it stands or sets off.
        """
        self._lean_wish = max(-MAX_LEAN_DEG, min(MAX_LEAN_DEG, lean_deg))

    def _advance(self, t_s):
        while self._t_s < t_s:
            step = min(_STEP_S, t_s - self._t_s)
            self._t_s += step
            cruise = self._cruise if self._pose == "riding" else 0.0
            wish = _SPEED_RATE * (cruise - self._speed)
            self._acceleration = max(-_MAX_BRAKING, min(_MAX_ACCELERATION, wish))
            if cruise == 0.0 and self._speed < 0.02:
                self._speed = self._acceleration = 0.0
            self._distance += self._speed * step
            self._speed += self._acceleration * step
            target = 0.0
            if self._speed > script.RIDING_MPS:
                target = radians(self._lean_wish)
            elif self._speed == 0.0 and self._pose == "kickstand":
                target = radians(script.KICKSTAND_DEG)
            # A spring to the target, critically damped: the lean reaches it without swinging
            pull = _ROLL_RATE * _ROLL_RATE * (target - self._lean) - 2.0 * _ROLL_RATE * self._lean_rate
            self._lean_rate += pull * step
            self._lean += self._lean_rate * step
            sway = {"kickstand": 0.0, "upright": script.STANDING_SWAY_DEG, "riding": script.RIDING_SWAY_DEG}[self._pose]
            self._sway += (radians(sway) - self._sway) * step

    def _attitude(self, t_s):
        self._advance(t_s)
        lean = self._lean + self._sway * sin(_SWAY_RADPS * t_s)
        lean_rate = self._lean_rate + self._sway * _SWAY_RADPS * sin(_SWAY_RADPS * t_s + pi / 2.0)
        return lean, lean_rate, script.yaw_rate_in_balance(lean, STANDARD_GRAVITY, self._speed)

    def motion(self, t_s):
        """Return the six readings of a perfect sensor, including vibration.

        They are the specific force along left, up, forward in g, then the rates about these axes in deg/s.
        """
        lean, lean_rate, yaw_rate = self._attitude(t_s)
        clean = script.body_motion(lean, lean_rate, self._speed, self._acceleration, yaw_rate)
        engine = min(1.0, self._speed / 2.0)
        return script.shaken(clean, t_s, self._vibration_g, self._speed, self._distance, engine)

    def truth(self, t_s):
        """Return a script.Truth."""
        lean, _, yaw_rate = self._attitude(t_s)
        return script.Truth(degrees(lean), self._speed, degrees(yaw_rate), self._phase())

    def _phase(self):
        settled = abs(self._lean_rate) < 0.02
        if self._speed == 0.0:
            pose = radians(script.KICKSTAND_DEG) if self._pose == "kickstand" else 0.0
            return self._pose if settled and abs(self._lean - pose) < 0.01 else "moving"
        if self._pose != "riding":
            return "brake"
        if self._speed < self._cruise - 1.0:
            return "accelerate"
        if settled and self._lean_wish and abs(self._lean - radians(self._lean_wish)) < 0.02:
            return "held turn"
        return "straight" if abs(self._lean) < 0.02 else "roll"
