"""Simulates engine vibration: harmonics of the crankshaft's speed, computed from the road speed and the gear."""

import numpy as np
from kickstand.units import STANDARD_GRAVITY
from numpy.typing import NDArray

from .signals import Signal, integral, smoothed

_RPM_PER_MPS = (370.0, 260.0, 205.0, 170.0, 150.0, 135.0)  # engine speed per road speed in each gear
# Frequencies of a four-stroke twin's vibration as multiples of the crankshaft's speed: firing, primary and secondary
_ORDERS = (0.5, 1.0, 2.0)
_IDLE_SHARE = 0.25  # vibration at idle, divided by the vibration at _FULL_RPM
_IDLE_RPM, _FULL_RPM = 1250.0, 6000.0
_MAX_G = 0.5
_BLOCK = 100_000  # number of rows that are computed at a time, to limit memory
_DPS_PER_G = 15.0  # rms of the vibration's rates, divided by the rms of its force


def crank_rpm(speed: Signal, shift_rpm: float, rate_hz: float) -> Signal:
    """Compute the speed of the crankshaft at each sample, in 1/min.

    The rider uses the lowest gear with an engine speed under shift_rpm. Below idle speed the clutch slips.
    """
    rpm = speed * _RPM_PER_MPS[-1]
    for ratio in reversed(_RPM_PER_MPS[:-1]):
        rpm = np.where(speed * ratio < shift_rpm, speed * ratio, rpm)
    return smoothed(np.maximum(rpm, _IDLE_RPM), 0.15, rate_hz)


def vibration(
    chance: np.random.Generator, speed: Signal, running: Signal, rms_g: float, shift_rpm: float, rate_hz: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Simulate the vibration along the bike's left, up and forward.

    Args:
        chance: Source of random numbers.
        speed: Speed of the bike, shape (n), in m/s.
        running: 1 while the engine is running, otherwise 0, shape (n).
        rms_g: Vibration along each axis at 6000/min, rms, before the chip's filter.
        shift_rpm: Engine speed at which the rider changes up.
        rate_hz: Number of samples per second.

    Returns:
        force: specific force, shape (n, 3), in m/s2.
        rates: angular rates, shape (n, 3), in rad/s.
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
