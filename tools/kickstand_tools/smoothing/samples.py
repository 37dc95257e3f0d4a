"""From the edges of the windows to each sample: between them the corrected gyro tells the lean."""

import numpy as np

from ..logs.table import Array
from .adjust import Adjusted
from .noise import jolted
from .parameters import FORWARD, LEAN, PITCH, corrected_rates
from .windows import Windows

LEANED_SHARE = 0.004  # of the lean: what the model leaves out, such as a gyro that feels forces, grows with it
TIMING_S = 0.004  # s: of what the delay of the gyro's low-pass, and the times of samples, are off


def at_samples(windows: Windows, rate: Array, found: Adjusted, delay_s: float) -> Array:
    """(samples, 4): lean, its standard deviation, pitch (rad) and speed (m/s). rate (samples, 3): rad/s, as
    windows_of() took it. delay_s: by how much the gyro's low-pass is late."""
    number, edges, states = windows.number, windows.edges, found.states
    duration = windows.before + windows.after
    first = np.append(True, np.diff(number) > 0)  # sample of its window
    begin = np.flatnonzero(first)[np.cumsum(first) - 1]
    since = np.cumsum(duration)
    since = since - duration - (since - duration)[begin]  # of the window's begin, until the sample's own time begins
    share = (since + windows.before) / (edges[1:] - edges[:-1])[number]
    before, after = states[number], states[number + 1]
    lean = before[:, LEAN] + share * (after - before)[:, LEAN]
    pitch = before[:, PITCH] + share * (after - before)[:, PITCH]
    speed = before[:, FORWARD] + share * (after - before)[:, FORWARD]
    wx, wy, wz = corrected_rates(rate, 0.5 * (before + after), found.parameters[number], windows.warm[number])
    roll_rate = wz - np.tan(pitch) * (wx * np.sin(lean) + wy * np.cos(lean))
    turned = np.cumsum(roll_rate * duration)
    until = turned - roll_rate * duration
    until = until - until[begin] + roll_rate * windows.before
    last = np.append(np.flatnonzero(first)[1:], len(number)) - 1  # sample of its window
    whole = (turned[last] - (turned - roll_rate * duration)[np.flatnonzero(first)])[np.cumsum(first) - 1]
    lean = before[:, LEAN] + until + share * ((after - before)[:, LEAN] - whole)
    sigma = found.sigma[number, LEAN] + share * (found.sigma[number + 1] - found.sigma[number])[:, LEAN]
    jolt = 2.0 * np.sqrt(np.clip(share * (1.0 - share), 0.0, 1.0)) * jolted(windows)[number]
    for more in (TIMING_S * roll_rate, LEANED_SHARE * lean, jolt):
        sigma = np.hypot(sigma, more)
    return np.column_stack((lean + delay_s * roll_rate, sigma, pitch, speed))
