"""Simulates how a two-wheeler leans and yaws. Defines its dimensions and the position of the sensor.

The rider commands a lean, and the bike stays in roll balance. The lean is positive to the right, the yaw rate is
positive in a left turn. The balance lean b is the lean of the line from the contact point to the centre of mass. The
chassis leans more than b, because wide tyres touch the road beside their middle.

body_rates() and specific_force() compute what a perfect sensor measures, exactly, from the attitude of the chassis. The
vehicle's axes are left, up and forward. The attitude consists of three rotations in this order: heading about the
vertical, pitch about the lateral axis, lean about the forward axis. So at rest the lean is atan2(left, up) of the
specific force.
"""

from dataclasses import dataclass, replace

import numpy as np
from kickstand.units import STANDARD_GRAVITY
from numpy.typing import NDArray

from ..commands import RiderCommands
from .signals import Signal, band_noise, derivative, second_order, smoothed, smoothstep

_STEERING_S = 0.04  # smoothing time of the yaw rate, because a rider turns the handlebar at a limited speed
_WANDER = 0.06  # rms of the lean's changes in a bend, as a share of the lean
_STANDS_MPS, _RIDES_MPS = 0.4, 1.5  # feet hold the bike below the first speed, steering balances it above the second


@dataclass(frozen=True)
class Bike:
    """Dimensions of a bike, in m. Source: V. Cossalter, Motorcycle Dynamics, 2nd ed., chapters 3, 4, 6 and 8.

    The defaults describe an average naked bike with its rider. random() varies them within the range of real bikes.
    """

    mass_height: float = 0.62  # height of the centre of mass of bike and rider together
    roll_gyration: float = 0.27  # radius of gyration about the roll axis through the centre of mass
    tyre_radius: float = 0.06  # radius of the tyres' cross-section, mean of front and rear
    # Gyroscopic moment of the wheels in a turn: I/r of both wheels, divided by mass * mass_height
    wheel_inertia: float = 0.024
    wheelbase: float = 1.43
    sensor_height: float = 0.70
    sensor_forward: float = 0.75  # distance of the sensor in front of the rear contact point
    sensor_left: float = 0.0
    # Pitch caused by the springs while both wheels are on the road, measured by a superbike's suspension sensors.
    dive_deg_per_g: float = 2.8  # nose down in braking, for a telescopic fork; negative for an anti-dive fork
    squat_deg_per_g: float = 1.3  # nose up in acceleration
    dive_hz: float = 1.7
    dive_damping: float = 0.45
    max_curvature: float = 0.4  # curvature of the tightest turn in 1/m, limited by the steering lock

    @staticmethod
    def random(chance: np.random.Generator) -> "Bike":
        bike = Bike(
            mass_height=chance.uniform(0.55, 0.68),
            roll_gyration=chance.uniform(0.22, 0.30),
            tyre_radius=chance.uniform(0.045, 0.075),
            wheel_inertia=chance.uniform(0.018, 0.03),
            wheelbase=chance.uniform(1.38, 1.52),
            sensor_height=chance.uniform(0.6, 0.8),
            sensor_forward=chance.uniform(0.4, 1.1),
            sensor_left=chance.uniform(-0.1, 0.1),
            dive_deg_per_g=chance.uniform(2.0, 4.0),
            dive_hz=chance.uniform(1.4, 2.1),
            dive_damping=chance.uniform(0.35, 0.6),
        )
        return replace(bike, squat_deg_per_g=0.46 * bike.dive_deg_per_g)

    def dive(self, acceleration: Signal, rate_hz: float) -> Signal:
        """Compute the pitch of the chassis on its springs in rad, nose up positive, from its forward acceleration."""
        per_g = np.where(acceleration < 0.0, self.dive_deg_per_g, self.squat_deg_per_g)
        pushed = np.radians(per_g) * acceleration / STANDARD_GRAVITY
        return second_order(pushed, self.dive_hz, self.dive_damping, rate_hz)

    @property
    def pendulum(self) -> float:
        """The length of the equivalent pendulum in roll, in m."""
        return (self.mass_height**2 + self.roll_gyration**2) / self.mass_height


@dataclass
class Roll:
    lean: Signal  # lean of the chassis, in rad
    balance: Signal  # lean of the centre of mass, in rad
    yaw_rate: Signal  # rate about the vertical, in rad/s


def chassis_lean(balance: Signal, bike: Bike, bank: Signal | float = 0.0, hang: Signal | float = 0.0) -> Signal:
    """Compute the lean of the chassis from the lean of the centre of mass, in rad (Cossalter's equation 4.4).

    bank: tilt of the road to the right, in rad.
    hang: distance of the centre of mass to the right of the bike's plane, in m.
    """
    arm = bike.mass_height - bike.tyre_radius
    flank = np.arcsin(bike.tyre_radius * np.sin(balance - bank) / np.hypot(arm, hang))
    return balance + flank - np.arctan2(hang, arm)


def weave(chance: np.random.Generator, command: RiderCommands, riding_deg: float) -> Signal:
    """Simulate the rider's random changes of the lean, in rad, including corrections of the line in bends.

    The changes are larger at walking pace, and small while the feet are on the ground. riding_deg: their rms at speed.
    """
    n, rate = len(command.time), command.rate_hz
    v = command.speed
    slow = smoothstep(v / _RIDES_MPS) * (1.0 + 2.0 * (1.0 - smoothstep((v - 1.0) / 5.0)))
    moving = band_noise(chance, n, 0.15, 0.6, rate) * riding_deg * slow
    wander = _WANDER * command.lean * slow * band_noise(chance, n, 0.05, 0.3, rate)
    feet = band_noise(chance, n, 0.2, 0.6, rate) * 0.12 * (1.0 - smoothstep(v / _RIDES_MPS)) * command.engine
    return np.radians(moving + feet) + wander


def roll(command: RiderCommands, bike: Bike, unrest: Signal) -> Roll:
    """Compute lean and yaw rate from the commanded lean.

    The pendulum's roll equation gives the yaw rate p:

        pendulum * b'' = g_n sin b + ((1 + wheels) v p + wind) cos b

    b is the balance lean, g_n the acceleration perpendicular to the road, v the speed. According to this equation, a
    quick roll to the right begins with a yaw to the left. This is countersteering.

    unrest: the result of weave().
    """
    rate, v = command.rate_hz, command.speed
    normal_g = STANDARD_GRAVITY * np.cos(command.slope) + v * derivative(command.slope, rate)
    wind = command.crosswind * smoothstep(v / 5.0)
    balance = np.arctan(np.tan(command.lean) - wind / normal_g) + unrest
    acceleration = derivative(derivative(balance, rate), rate)
    centripetal = bike.pendulum * acceleration / np.cos(balance) - normal_g * np.tan(balance) - wind
    centripetal /= 1.0 + bike.wheel_inertia  # v p of the equation, in m/s2
    riding = smoothstep((v - _STANDS_MPS) / (_RIDES_MPS - _STANDS_MPS))  # 0 standing, 1 riding
    lock = bike.max_curvature
    steer = centripetal / (lock * np.maximum(v, 0.1) ** 2)  # share of the steering lock
    curvature = riding * lock * steer / (1.0 + steer**6) ** (1.0 / 6.0)  # limited smoothly near the steering lock
    yaw_rate = smoothed(curvature * v, _STEERING_S, rate) / np.cos(command.slope)
    hang = command.hang
    return Roll(chassis_lean(balance, bike, command.bank * smoothstep(v / 5.0), hang), balance, yaw_rate)


_BLOCK = 100_000  # number of rows that are computed at a time, to limit memory


@dataclass
class Motion:
    """The motion of the rear contact point, and the attitude of the chassis."""

    rate_hz: float  # number of samples per second
    speed: Signal  # speed in m/s
    slope: Signal  # slope of the road, in rad
    yaw_rate: Signal  # rate about the vertical, in rad/s
    lean: Signal  # lean of the chassis, in rad
    pitch: Signal  # pitch of the chassis against the horizontal, in rad, positive if the nose is up
    heave: Signal  # vertical acceleration of the rear of the chassis against the road, in m/s2


def body_rates(motion: Motion) -> NDArray[np.float64]:
    """Compute the rates about left, up and forward, shape (n, 3), in rad/s."""
    lean_rate = derivative(motion.lean, motion.rate_hz)
    pitch_rate = derivative(motion.pitch, motion.rate_hz)
    c, s = np.cos(motion.lean), np.sin(motion.lean)
    level_yaw = motion.yaw_rate * np.cos(motion.pitch)
    return np.column_stack(
        (
            level_yaw * s - pitch_rate * c,  # nose up is a negative rotation about left
            level_yaw * c + pitch_rate * s,
            lean_rate + motion.yaw_rate * np.sin(motion.pitch),
        )
    )


def specific_force(motion: Motion, bike: Bike) -> NDArray[np.float64]:
    """Compute the specific force at the sensor along left, up and forward, shape (n, 3), in m/s2.

    The specific force is the sensor's acceleration minus gravity. The body rotates about the centre of the rear tyre's
    cross-section, which is above the road by the radius of this cross-section.
    """
    rate, v, slope = motion.rate_hz, motion.speed, motion.slope
    left = v * motion.yaw_rate * np.cos(slope)
    up = STANDARD_GRAVITY * np.cos(slope) + v * derivative(slope, rate) + motion.heave
    forward = STANDARD_GRAVITY * np.sin(slope) + derivative(v, rate)
    nose = motion.pitch - slope
    up, forward = up * np.cos(nose) - forward * np.sin(nose), forward * np.cos(nose) + up * np.sin(nose)
    c, s = np.cos(motion.lean), np.sin(motion.lean)
    force = np.column_stack((left * c + up * s, up * c - left * s, forward))
    arm = np.array([bike.sensor_left, bike.sensor_height - bike.tyre_radius, bike.sensor_forward])
    rates = body_rates(motion)
    turning = np.gradient(rates, 1.0 / rate, axis=0)
    for start in range(0, len(force), _BLOCK):  # np.cross needs several times the memory of its arguments
        part = slice(start, start + _BLOCK)
        force[part] += np.cross(turning[part], arm)
        force[part] += np.cross(rates[part], np.cross(rates[part], arm))
    return force
