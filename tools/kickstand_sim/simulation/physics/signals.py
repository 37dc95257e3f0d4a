"""Functions for signals on a regular time grid: smooth steps, filters by FFT, coloured noise."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Signal = NDArray[np.float64]
_NOISE_MARGIN_S = 10.0  # margin at both ends of computed noise. The margins contain padding, so they are cut off
_BLOCK = 100_000  # number of frequencies that are computed at a time, to limit memory
# A signal is padded with its first and last value for this time, because an FFT joins its end to its start
_PAD_S = 4.0


def smoothstep(u: Signal) -> Signal:
    """Return a step from 0 to 1 while u goes from 0 to 1. The step and its first two derivatives have no jumps."""
    u = np.clip(u, 0.0, 1.0)
    return u * u * u * (10.0 + u * (6.0 * u - 15.0))


def derivative(x: Signal, rate_hz: float) -> Signal:
    return np.gradient(x, 1.0 / rate_hz)


def integral(x: Signal, rate_hz: float) -> Signal:
    """Integrate x over time from the first sample to each sample, by the trapezoidal rule."""
    return np.concatenate(([0.0], np.cumsum((x[1:] + x[:-1]) / (2.0 * rate_hz))))


def through(x: Signal, transfer: Callable[[Signal], NDArray], rate_hz: float) -> Signal:
    """Filter x by FFT. transfer: function that returns the complex gain for each frequency in Hz."""
    pad = int(_PAD_S * rate_hz)
    size = -(-(len(x) + 2 * pad) // 16384) * 16384  # an FFT is fast for a size with small prime factors
    padded = np.pad(x, (pad, size - len(x) - pad), mode="edge")
    spectrum = np.fft.rfft(padded)
    del padded
    frequency = np.linspace(0.0, rate_hz / 2.0, len(spectrum))
    # Work in blocks, because a transfer function needs several times the memory of its argument
    for start in range(0, len(spectrum), _BLOCK):
        part = slice(start, start + _BLOCK)
        spectrum[part] *= transfer(frequency[part])
    del frequency
    return np.fft.irfft(spectrum, size)[pad : pad + len(x)].copy()


def smoothed(x: Signal, seconds: float, rate_hz: float) -> Signal:
    """Smooth x with a Gaussian, without delay. seconds: standard deviation of the Gaussian."""
    return through(x, lambda f: np.exp(-0.5 * (2.0 * np.pi * f * seconds) ** 2), rate_hz)


def second_order(x: Signal, natural_hz: float, damping: float, rate_hz: float) -> Signal:
    """Filter x with a low-pass of second order, which delays the signal. Its gain is 1 at 0 Hz."""

    def transfer(f: Signal) -> NDArray:
        s = 1j * f / natural_hz
        return 1.0 / (1.0 + 2.0 * damping * s + s * s)

    return through(x, transfer, rate_hz)


def band_noise(chance: np.random.Generator, n: int, low_hz: float, high_hz: float, rate_hz: float) -> Signal:
    """Return n samples of normally distributed noise between two frequencies, with an rms of 1.

    Outside these frequencies, the amplitude falls as with a second-order filter.
    """

    def transfer(f: Signal) -> NDArray:
        low = (f / low_hz) ** 2
        return low / (1.0 + low) / (1.0 + (f / high_hz) ** 2)

    margin = int(_NOISE_MARGIN_S * rate_hz)
    noise = through(chance.standard_normal(n + 2 * margin), transfer, rate_hz)
    return noise[margin : margin + n] / np.std(noise)
