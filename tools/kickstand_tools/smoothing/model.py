"""The equations as residuals of least squares, each over its standard deviation, and their derivatives."""

from dataclasses import dataclass

import numpy as np

from ..logs.table import Array
from . import noise
from .derivatives import by_unknowns
from .equations import motion_and_measurements
from .noise import OUTLIER, Circumstances
from .parameters import BIAS, STATES


@dataclass
class Residuals:
    """Of n windows. motion (n, STATES), measured (n, MEASURED): of motion_and_measurements(). scale (n, STATES), weight
    (n, MEASURED): by what they are multiplied. values (n, ROWS): over their standard deviations. sigma (n, STATES): of
    what the states change by."""

    motion: Array
    measured: Array
    sigma: Array
    scale: Array
    weight: Array
    values: Array


def residuals(known: Circumstances, states: Array, p: Array, robust: bool) -> Residuals:
    """states (n + 1, STATES): at the windows' edges. p (n, PARAMETERS). robust: outliers count less (Cauchy)."""
    windows = known.windows
    middle, step = 0.5 * (states[1:] + states[:-1]), states[1:] - states[:-1]
    seconds = np.where(windows.gap, 0.0, windows.seconds)[:, None]
    motion, measured = motion_and_measurements(windows, middle, p)
    sigma, weight = known.of_motion(), 1.0 / known.of_measurements()
    if robust:
        off = (step - seconds * motion)[:, : BIAS.start] / sigma[:, : BIAS.start]
        sigma[:, : BIAS.start] *= np.hypot(1.0, off / noise.JOLT)
        # what holds for long is judged by its own sigma, not by its share of a window
        weight = weight / np.hypot(1.0, measured * weight * known.lasting() / OUTLIER)
    scale = seconds / sigma
    values = np.concatenate((step / sigma - scale * motion, weight * measured), axis=1)
    return Residuals(motion, measured, sigma, scale, weight, values)


def linearised(known: Circumstances, states: Array, p: Array, robust: bool) -> tuple[Array, Array]:
    """(n, ROWS, STATES + PARAMETERS + 1): derivatives of the residuals by the states at either end of each window and
    by the parameters, and the residuals. (n, STATES): what the derivatives of the first residuals by the states at the
    end have in addition, and those by the states at the begin have less. See residuals()."""
    at, middle = residuals(known, states, p, robust), 0.5 * (states[1:] + states[:-1])
    factor = np.concatenate((-at.scale, at.weight), axis=1).T
    found = by_unknowns(known.windows, middle, p, factor)
    found[:, :, :STATES] *= 0.5  # the middle moves by half
    found[:, :, -1] = at.values
    return found, 1.0 / at.sigma
