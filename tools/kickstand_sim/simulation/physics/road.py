"""Simulates how a rough road shakes the bike through tyres and suspension.

The road is a random profile of ISO 8608, whose slope is white noise over distance. So the same road shakes the bike
more at higher speed. The rear wheel meets the same bumps as the front wheel, but later. Each end of the bike is
simulated by a quarter-car model: the wheel moves on its tyre, and the chassis on its spring.
"""

from dataclasses import dataclass

import numpy as np
from kickstand.units import STANDARD_GRAVITY
from numpy.typing import NDArray

from .bike import Bike
from .signals import Signal, band_noise, integral, smoothed, through

# Roughness in the middle of each class of ISO 8608, as the PSD of the displacement at 0.1 cycles/m, in m3
CLASSES = {"A": 16e-6, "B": 64e-6, "C": 256e-6, "D": 1024e-6}
CLASS_A, CLASS_B, CLASS_C, _ = CLASSES.values()
_STEP_M = 0.02
_CONTACT_M = 0.10  # length of a tyre's contact patch, which averages out shorter waves of the road

# One end of a motorcycle with half of its rider: two masses in kg, spring in N/m, damper in Ns/m, tyre in N/m
_SPRUNG, _UNSPRUNG, _SPRING, _DAMPER, _TYRE = 120.0, 15.0, 17e3, 1100.0, 150e3
_LATERAL = 0.35  # rms of the force along left and along forward, divided by the vertical rms
# rms of the rates about left, up and forward, in deg/s per 9.8 m/s2 of vertical rms. The rate about left is 0, because
# pitch is simulated separately
_RATE_DPS = np.array([0.0, 8.0, 14.0])


@dataclass
class Shaking:
    """The motion of the chassis that the road causes."""

    heave: Signal  # vertical acceleration of the rear, shape (n), in m/s2
    pitch: Signal  # Pitch, shape (n), in rad
    force: NDArray[np.float64]  # additional force along left, up and forward, shape (n, 3), in m/s2
    rates: NDArray[np.float64]  # additional rates about left, up and forward, shape (n, 3), in rad/s


def transmitted(f: Signal) -> NDArray:
    """Compute the displacement of the chassis divided by that of the road, at each frequency f in Hz."""
    w = 2.0 * np.pi * f
    strut = _SPRING + 1j * w * _DAMPER
    return _TYRE * strut / ((strut - _SPRUNG * w * w) * (strut + _TYRE - _UNSPRUNG * w * w) - strut * strut)


def profile_slope(chance: np.random.Generator, length_m: float, roughness: float) -> Signal:
    """Return the slope dz/ds of a random road at every _STEP_M. roughness: PSD in m3, like CLASS_A."""
    density = (2.0 * np.pi * 0.1) ** 2 * roughness
    white = chance.standard_normal(int(length_m / _STEP_M) + 200) * np.sqrt(density / (2.0 * _STEP_M))
    taps = round(_CONTACT_M / _STEP_M)
    return np.convolve(white, np.full(taps, 1.0 / taps), mode="same")


def add_bumps(slope: Signal, places_m: list[float], height_m: float, length_m: float) -> None:
    """Add bumps to a profile's slope, in place. A bump has the shape 1 - cos. places_m: distance of each bump."""
    n = int(length_m / _STEP_M)
    shape = np.pi * height_m / length_m * np.sin(2.0 * np.pi * np.arange(n) / n)
    for distance in places_m:
        first = int(distance / _STEP_M)
        if first + n < len(slope):
            slope[first : first + n] += shape


def shaking(
    chance: np.random.Generator, distance: Signal, speed: Signal, slope: Signal, bike: Bike, rate_hz: float
) -> Shaking:
    """Simulate driving over a profile (see profile_slope()). distance: of the rear wheel at each sample, in m."""
    height = np.cumsum(slope) * _STEP_M
    along_m = np.arange(len(slope)) * _STEP_M
    front = distance + bike.wheelbase

    def lifted(f: Signal) -> NDArray:
        return 2j * np.pi * f * transmitted(f)

    heave = through(speed * np.interp(distance, along_m, slope), lifted, rate_hz)
    difference = np.interp(front, along_m, height)
    difference -= np.interp(distance, along_m, height)
    del front, along_m, height
    pitch = through(difference / bike.wheelbase, transmitted, rate_hz)
    n = len(distance)
    # Forces along left and forward, and rates about up and forward, in proportion to the vertical rms
    size = np.sqrt(smoothed(heave * heave, 0.5, rate_hz).clip(0.0))
    force = np.zeros((n, 3))
    for axis in (0, 2):
        force[:, axis] = _LATERAL * size * band_noise(chance, n, 3.0, 25.0, rate_hz)
    rates = np.zeros((n, 3))
    for axis in (1, 2):
        rates[:, axis] = np.radians(_RATE_DPS[axis]) * size / 9.8 * band_noise(chance, n, 4.0, 20.0, rate_hz)
    return Shaking(heave, pitch, force, rates)


_RPM_PER_MPS = (370.0, 260.0, 205.0, 170.0, 150.0, 135.0)  # engine speed per road speed in each gear
# Frequencies of a four-stroke twin's vibration as multiples of the crankshaft's speed: firing, primary and secondary
_ORDERS = (0.5, 1.0, 2.0)
_IDLE_SHARE = 0.25  # vibration at idle, divided by the vibration at _FULL_RPM
_IDLE_RPM, _FULL_RPM = 1250.0, 6000.0
_MAX_G = 0.5
_BLOCK = 100_000  # number of rows that are computed at a time, to limit memory
_DPS_PER_G = 15.0  # rms of the vibration's rates, divided by the rms of its force


def crank_rpm(speed: Signal, shift_rpm: float, rate_hz: float) -> Signal:
    """Compute the speed of the crankshaft in 1/min. The rider uses the lowest gear with a speed under shift_rpm."""
    rpm = speed * _RPM_PER_MPS[-1]
    for ratio in reversed(_RPM_PER_MPS[:-1]):
        rpm = np.where(speed * ratio < shift_rpm, speed * ratio, rpm)
    return smoothed(np.maximum(rpm, _IDLE_RPM), 0.15, rate_hz)


def vibration(
    chance: np.random.Generator, speed: Signal, running: Signal, rms_g: float, shift_rpm: float, rate_hz: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Simulate the engine's vibration along left, up and forward: force in m/s2 and rates in rad/s, shape (n, 3) each.

    running: 1 while the engine runs, otherwise 0, shape (n).
    rms_g: along each axis at 6000/min, before the chip's filter.
    """
    rpm = crank_rpm(speed, shift_rpm, rate_hz)
    turns = integral(rpm / 60.0, rate_hz)
    growth = _IDLE_SHARE + (1.0 - _IDLE_SHARE) * (rpm / _FULL_RPM) ** 2
    size = np.minimum(rms_g * growth, _MAX_G) * running
    weights = chance.dirichlet(np.full(len(_ORDERS), 2.0), size=6) ** 0.5
    phases = chance.uniform(0.0, 2.0 * np.pi, size=(6, len(_ORDERS)))
    shaken = np.zeros((len(speed), 6))
    for start in range(0, len(speed), _BLOCK):
        part = slice(start, start + _BLOCK)
        for k, order in enumerate(_ORDERS):
            angle = 2.0 * np.pi * order * turns[part]
            sine, cosine = np.sin(angle), np.cos(angle)
            for axis in range(6):
                phase = phases[axis, k]
                shaken[part, axis] += weights[axis, k] * (sine * np.cos(phase) + cosine * np.sin(phase))
    shaken *= np.sqrt(2.0) * size[:, None]
    shaken[:, :3] *= STANDARD_GRAVITY
    shaken[:, 3:] *= np.radians(_DPS_PER_G)
    return shaken[:, :3], shaken[:, 3:]
