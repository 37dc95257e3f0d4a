"""Signals on a regular time grid: smooth steps, filters by FFT, coloured noise."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Signal = NDArray[np.float64]
_NOISE_MARGIN_S = 10.0  # noise is computed with this margin at both ends, which is then cut, because through() pads
_BLOCK = 100_000  # frequencies computed at a time, to limit memory
_PAD_S = 4.0  # padding with the first and the last value, because an FFT joins the end to the start


def smoothstep(u: Signal) -> Signal:
    """A step from 0 to 1 while u goes from 0 to 1, constant outside. Value, first and second derivative have no
    jumps."""
    u = np.clip(u, 0.0, 1.0)
    return u * u * u * (10.0 + u * (6.0 * u - 15.0))


def derivative(x: Signal, rate_hz: float) -> Signal:
    """The derivative of x per second, by central differences."""
    return np.gradient(x, 1.0 / rate_hz)


def integral(x: Signal, rate_hz: float) -> Signal:
    """The integral of x over time by the trapezoidal rule, 0 at the start."""
    return np.concatenate(([0.0], np.cumsum((x[1:] + x[:-1]) / (2.0 * rate_hz))))


def through(x: Signal, transfer: Callable[[Signal], NDArray], rate_hz: float) -> Signal:
    """x filtered by FFT. transfer: called with frequencies in Hz, returns the complex gains."""
    pad = int(_PAD_S * rate_hz)
    size = -(-(len(x) + 2 * pad) // 16384) * 16384  # few small prime factors: a fast FFT
    padded = np.pad(x, (pad, size - len(x) - pad), mode="edge")
    spectrum = np.fft.rfft(padded)
    del padded
    frequency = np.linspace(0.0, rate_hz / 2.0, len(spectrum))
    for start in range(0, len(spectrum), _BLOCK):  # a transfer function needs several times the memory of its argument
        part = slice(start, start + _BLOCK)
        spectrum[part] *= transfer(frequency[part])
    del frequency
    return np.fft.irfft(spectrum, size)[pad : pad + len(x)].copy()


def smoothed(x: Signal, seconds: float, rate_hz: float) -> Signal:
    """x smoothed with a Gaussian of this standard deviation, without delay."""
    return through(x, lambda f: np.exp(-0.5 * (2.0 * np.pi * f * seconds) ** 2), rate_hz)


def second_order(x: Signal, natural_hz: float, damping: float, rate_hz: float) -> Signal:
    """x filtered by a low-pass of second order with gain 1 at 0 Hz, including the filter's delay."""

    def transfer(f: Signal) -> NDArray:
        s = 1j * f / natural_hz
        return 1.0 / (1.0 + 2.0 * damping * s + s * s)

    return through(x, transfer, rate_hz)


def band_noise(chance: np.random.Generator, n: int, low_hz: float, high_hz: float, rate_hz: float) -> Signal:
    """Normally distributed noise of rms 1 between two frequencies. Outside them its amplitude falls by second order."""

    def transfer(f: Signal) -> NDArray:
        low = (f / low_hz) ** 2
        return low / (1.0 + low) / (1.0 + (f / high_hz) ** 2)

    margin = int(_NOISE_MARGIN_S * rate_hz)
    noise = through(chance.standard_normal(n + 2 * margin), transfer, rate_hz)
    return noise[margin : margin + n] / np.std(noise)
