"""Simulates a motorcycle in balance whose lean is known at every instant, and a perfect sensor on it.

This is plain Python for CPython and MicroPython. The module does not use the firmware's mathematics, because it tests
them.

The vehicle's axes are left, up and forward (right-handed). The lean is positive to the right, the yaw rate is positive
in a left turn, and the slope is positive uphill. The attitude consists of three rotations in this order: heading about
the vertical, slope about the lateral axis, lean about the forward axis. A lean to the right turns the left axis upward.
This is a positive rotation about forward, so on a level road the rate about forward is d(lean)/dt. The sensor is on the
roll axis, and the tyres have no width.

    ride = Ride([kickstand(8), upright(8), accelerate(15, 5), turn(-30, 5), brake(0, 4)])
    ride.motion(20.0)   # (left, up, forward in g, then rates about left, up, forward in deg/s)
    ride.truth(20.0)    # a Truth: lean_deg, speed_mps, yaw_rate_dps, phase
"""

from collections import namedtuple
from math import cos, degrees, pi, radians, sin, sqrt, tan

from kickstand.units import STANDARD_GRAVITY

from .sensor_errors import glide

KICKSTAND_DEG = -12.0  # lean on the kickstand, to the left as on most bikes
MOVE_S = 2.0  # time for moving the bike from the kickstand to upright, or back
STANDING_SWAY_DEG = 0.1  # amplitude of the lean's changes while the rider holds the bike upright
RIDING_SWAY_DEG = 0.5  # amplitude of the lean's changes at speed
WALKING_MPS, RIDING_MPS = 1.0, 4.0  # only feet balance the bike below the first speed, only steering above the second

_SWAY = ((0.31, 0.6, 0.0), (0.73, 0.4, 1.0))  # frequency in Hz, share and phase of each part of the sway
_ROAD_HZ = (2.3, 5.9, 11.7, 19.3, 31.1)
_ROAD_G = (0.5, 1.0, 0.5)  # shares of vibration_g along left, up, forward
_ROAD_DPS = (25.0, 10.0, 15.0)  # rates about left, up, forward, in deg/s per g of vibration
_IDLE_HZ = 20.0
_ENGINE_CYCLES_PER_M = 3.7  # additional cycles of the engine per metre. At 15 m/s, its frequency is 75 Hz
_ENGINE_SHARE = 0.5  # share of vibration_g that comes from the engine


class Segment:
    """A part of the ride, in which lean, speed, slope, sway and engine change smoothly to new values.

    A value of None stays unchanged.
    """

    def __init__(self, phase, seconds, lean_deg=None, speed_mps=None, slope_deg=None, sway_deg=None, engine=None):
        self.phase = phase
        self.seconds = seconds
        self.targets = (lean_deg, speed_mps, slope_deg, sway_deg, engine)


def kickstand(seconds, lean_deg=KICKSTAND_DEG, slope_deg=None):
    """Lean the bike onto its kickstand and leave it there, with the engine off."""
    return Segment("moving", MOVE_S, lean_deg, 0.0, slope_deg, 0.0, 0.0), Segment("kickstand", seconds)


def upright(seconds, lean_deg=0.0, slope_deg=None):
    """Bring the bike upright, where the rider holds it, with the engine off. lean_deg: error of the upright pose."""
    return Segment("moving", MOVE_S, lean_deg, 0.0, slope_deg, STANDING_SWAY_DEG, 0.0), Segment("upright", seconds)


def wait(seconds):
    return (Segment("wait", seconds),)


def straight(seconds, slope_deg=None):
    return (Segment("straight", seconds, slope_deg=slope_deg),)


def turn(lean_deg, seconds, roll_s=1.5):
    """Roll to lean_deg within roll_s, hold this lean for `seconds`, and roll back within roll_s."""
    return Segment("roll in", roll_s, lean_deg), Segment("held turn", seconds), Segment("roll out", roll_s, 0.0)


def accelerate(speed_mps, seconds):
    return (Segment("accelerate", seconds, 0.0, speed_mps, sway_deg=RIDING_SWAY_DEG, engine=1.0),)


def brake(speed_mps, seconds):
    """Slow down to speed_mps, upright. At a stop the rider holds the bike."""
    sway = RIDING_SWAY_DEG if speed_mps else STANDING_SWAY_DEG
    return (Segment("brake", seconds, 0.0, speed_mps, sway_deg=sway),)


def yaw_rate_in_balance(lean, lift_mps2, speed_mps):
    """Return the yaw rate that balances a lean in rad, in rad/s about the road's normal.

    lift_mps2: Specific force perpendicular to the road.
    Below RIDING_MPS the feet help to balance, so the yaw rate is smaller. Below WALKING_MPS the yaw rate is 0.
    """
    if speed_mps <= WALKING_MPS:
        return 0.0
    share = 1.0
    if speed_mps < RIDING_MPS:
        share, _ = glide(0.0, 1.0, (speed_mps - WALKING_MPS) / (RIDING_MPS - WALKING_MPS), 1.0)
    return -share * lift_mps2 * tan(lean) / speed_mps


def body_motion(lean, lean_rate, speed, acceleration, yaw_rate, slope=0.0, slope_rate=0.0):
    """Compute what a perfect sensor measures in the bike's own axes.

    The arguments are angles in rad, rates in rad/s, the speed in m/s, and the acceleration along the road in m/s2.
    Returns six numbers: specific force along left, up, forward in g, then the rates about these axes in deg/s.
    """
    # First compute in the road's axes: forward is along the road, left is level, up is perpendicular to both
    left = speed * yaw_rate * cos(slope)
    up = STANDARD_GRAVITY * cos(slope) + speed * slope_rate
    forward = acceleration + STANDARD_GRAVITY * sin(slope)
    w_left = -slope_rate  # nose up is a negative rotation about left
    w_up = yaw_rate * cos(slope)
    w_forward = yaw_rate * sin(slope) + lean_rate
    c, s = cos(lean), sin(lean)
    return (
        (left * c + up * s) / STANDARD_GRAVITY,
        (up * c - left * s) / STANDARD_GRAVITY,
        forward / STANDARD_GRAVITY,
        degrees(w_left * c + w_up * s),
        degrees(w_up * c - w_left * s),
        degrees(w_forward),
    )


# The truth at a time: lean in degrees, speed in m/s, yaw rate in deg/s, phase of the ride
Truth = namedtuple("Truth", ("lean_deg", "speed_mps", "yaw_rate_dps", "phase"))
_SPEED = 1  # index of the speed in Segment.targets


class Ride:
    """A scripted ride. It starts with the values of its first segment.

    segments: Results of the functions above, in order from t = 0.
    vibration_g: Vibration along the up axis at 10 m/s or more, rms, before the chip's filter.
    """

    def __init__(self, segments, vibration_g=0.05):
        self.vibration_g = vibration_g
        self.seconds = 0.0
        self._segments = []  # (start, segment, values at its start, values at its end, distance at its start)
        distance = 0.0
        first = segments[0][0].targets
        values = tuple([0.0 if v is None else v for v in first])
        for group in segments:
            for segment in group:
                targets = segment.targets
                end = tuple([values[i] if targets[i] is None else targets[i] for i in range(5)])
                if segment.phase == "moving" and end == values:
                    continue  # the bike is in this pose already
                self._segments.append((self.seconds, segment, values, end, distance))
                self.seconds += segment.seconds
                distance += segment.seconds * (values[_SPEED] + end[_SPEED]) / 2.0
                values = end
        self._at = 0

    def _find(self, t_s):
        """Return the segment at t_s: the first segment before the start, and the last segment after the end."""
        i = self._at
        while i > 0 and t_s < self._segments[i][0]:
            i -= 1
        while i + 1 < len(self._segments) and t_s >= self._segments[i + 1][0]:
            i += 1
        self._at = i  # the next search starts here, because time mostly increases
        return self._segments[i]

    def state(self, t_s):
        """Return the state at t_s. Units are rad, m and s.

        The state is a tuple: (phase, lean, lean rate, speed, acceleration, yaw rate, slope, slope rate, distance,
        engine). The engine is 0 (off) to 1 (running).
        """
        start, segment, initial, final, distance = self._find(t_s)
        seconds = segment.seconds
        u = min(1.0, max(0.0, (t_s - start) / seconds)) if seconds else 1.0
        glides = [glide(begin, end, u, seconds) for begin, end in zip(initial, final)]  # as in Segment.targets
        (lean, lean_rate), (speed, acceleration), (slope, slope_rate), (sway, sway_rate), (engine, _) = glides
        for hz, share, phase in _SWAY:
            angle = 2.0 * pi * hz * t_s + phase
            lean += sway * share * sin(angle)
            lean_rate += share * (sway_rate * sin(angle) + sway * 2.0 * pi * hz * cos(angle))
        lean, lean_rate = radians(lean), radians(lean_rate)
        slope, slope_rate = radians(slope), radians(slope_rate)
        # The distance needs the integral of glide(), which is u^6 - 3 u^5 + 2.5 u^4
        glided = u * u * u * u * (2.5 + u * (u - 3.0))
        distance += seconds * (initial[_SPEED] * u + (final[_SPEED] - initial[_SPEED]) * glided)
        if t_s > self.seconds:
            distance += final[_SPEED] * (t_s - self.seconds)
        lift = STANDARD_GRAVITY * cos(slope) + speed * slope_rate
        yaw = yaw_rate_in_balance(lean, lift, speed) / cos(slope)  # about the vertical
        return segment.phase, lean, lean_rate, speed, acceleration, yaw, slope, slope_rate, distance, engine

    def truth(self, t_s):
        """Return the Truth at t_s."""
        phase, lean, _, speed, _, yaw_rate = self.state(t_s)[:6]
        return Truth(degrees(lean), speed, degrees(yaw_rate), phase)

    def motion(self, t_s):
        """Return what a perfect sensor measures at t_s, with vibration, in the form of body_motion()."""
        _, lean, lean_rate, speed, acceleration, yaw_rate, slope, slope_rate, distance, engine = self.state(t_s)
        motion = body_motion(lean, lean_rate, speed, acceleration, yaw_rate, slope, slope_rate)
        return shaken(motion, t_s, self.vibration_g, speed, distance, engine)


def shaken(motion, t_s, vibration_g, speed_mps, distance_m, engine):
    """Add the vibration of road and engine to a motion. engine: 0 (off) to 1 (running)."""
    road = vibration_g * min(1.0, speed_mps / 10.0) * sqrt(1.0 - _ENGINE_SHARE * _ENGINE_SHARE)
    firing = vibration_g * engine * _ENGINE_SHARE
    if road == 0.0 and firing == 0.0:
        return motion
    peak = sqrt(2.0 / len(_ROAD_HZ))  # amplitude of each sine wave. Their sum has an rms of 1
    turns = 2.0 * pi * (_IDLE_HZ * t_s + _ENGINE_CYCLES_PER_M * distance_m)
    sums = []
    for axis in range(6):
        wave = 0.0
        for k in range(len(_ROAD_HZ)):
            wave += sin(2.0 * pi * _ROAD_HZ[k] * t_s + 2.4 * (5 * axis + k))
        shake = road * peak * wave + firing * sqrt(2.0) * sin(turns + 2.4 * axis)
        share = _ROAD_G[axis] if axis < 3 else _ROAD_DPS[axis - 3]
        sums.append(motion[axis] + share * shake)
    return tuple(sums)
