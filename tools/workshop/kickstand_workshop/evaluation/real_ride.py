"""Compares estimators on a recorded ride. The calibration and a reference lean are computed from the ride itself.

The calibration comes from `kickstand calibrate ride`. The reference lean is atan(v * yaw rate / g), averaged over
1 s, with the yaw rate about the bike's own up axis. It reads low (1 Hz speed, wide tyres, an axis that leans with the
bike) and ignores slope and bank of the road. It can compare methods and reveal a lean that decays in a turn. Do not
trust its values in degrees.
"""

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from kickstand.units import STANDARD_GRAVITY
from kickstand_tools.calibration.file import CalibrationFile
from kickstand_tools.checks.log import remarks
from kickstand_tools.common.errors import InputError
from kickstand_tools.common.messages import Message
from kickstand_tools.estimation.alignment import fit_ride
from kickstand_tools.logs.reader import Log, read_log
from kickstand_tools.signals import moving_mean
from numpy.typing import NDArray

from .estimators import calibrated, estimate
from .metrics import rms, slope

AVERAGE_S = 1.0
_RIDING_MPS = 2.0  # only higher speeds are scored
_LEANED_DEG = 5.0  # the slope is fitted above this: the reference is rarely over 10 degrees


@dataclass
class RealScore:
    """Errors against the rough reference. slope: shown over reference lean, for reference leans over 5 degrees."""

    rms_deg: float
    slope: float


@dataclass
class RecordingScores:
    """name: of the recording's file. scores: by estimator.

    traces: (N,) each: "time" in s; "reference" and each estimator's lean in degrees, > 0 to the right. notices: remarks
    about the recording, and contradictions to the calibration found in it.
    """

    name: str
    scores: dict[str, RealScore]
    traces: dict[str, NDArray[np.float64]]
    notices: list[Message] = field(default_factory=list)


def compare(path: Path) -> RecordingScores:
    """Run every estimator over a recorded ride with speed. Raises InputError if it cannot be used."""
    log = read_log(path)
    speed, calibration = _speed(log), fit_ride(log).calibration
    reference = reference_lean(log, calibration)
    time = log.t_s
    riding = speed > _RIDING_MPS
    shown = estimate(log, calibration)
    scores = {
        name: RealScore(rms((lean - reference)[riding]), slope(lean[riding], reference[riding], _LEANED_DEG))
        for name, lean in shown.items()
    }
    notices = [*log.notices, *remarks(log, calibration, axes=False)]
    return RecordingScores(path.name, scores, {"time": time, "reference": reference, **shown}, notices)


def reference_lean(log: Log, calibration: CalibrationFile) -> NDArray[np.float64]:
    """atan(v * yaw rate / g) in degrees, > 0 to the right, averaged over 1 s."""
    samples = calibrated(log, calibration)
    centripetal = _speed(log) * np.radians(samples.rate[:, 1])
    lean = -np.degrees(np.arctan(centripetal / STANDARD_GRAVITY))
    return moving_mean(lean, round(AVERAGE_S * samples.rate_hz))


def _speed(log: Log) -> NDArray[np.float64]:
    """Speed in m/s at each sample, interpolated between the logged values."""
    there = ~np.isnan(log.speed_mps)
    if np.count_nonzero(there) < 2:
        raise InputError(f"{log.name} has no speed: without it there is no reference")
    return np.interp(log.t_s, log.t_s[there], log.speed_mps[there])
