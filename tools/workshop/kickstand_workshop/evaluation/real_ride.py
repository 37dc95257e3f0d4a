"""Compares estimators on a recorded ride. The calibration and a reference lean are computed from the ride itself.

The calibration comes from `kickstand calibrate ride`. The reference lean is atan(v * yaw rate / g), averaged over 1 s,
with the yaw rate about the bike's own up axis. Do not trust the values of the reference lean. The reference lean is too
small for three reasons. The speed changes only once per second, tyres are wide, and the up axis leans with the bike.
The reference also ignores slope and bank of the road. Use the reference to compare methods, and to reveal a lean that
decays in a bend.
"""

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from kickstand.units import STANDARD_GRAVITY
from kickstand_tools.calibration.file import CalibrationFile
from kickstand_tools.calibration.mount import read_ride
from kickstand_tools.common.errors import InputError
from kickstand_tools.common.messages import Message
from kickstand_tools.estimation.alignment import fit_ride
from kickstand_tools.logs.log import Log
from kickstand_tools.logs.reader import read_log
from kickstand_tools.signals import moving_mean
from numpy.typing import NDArray

from .estimators import calibrated, estimate
from .metrics import rms, slope

AVERAGE_S = 1.0
_RIDING_MPS = 2.0  # smallest speed of samples that are scored
_LEANED_DEG = 5.0  # smallest lean for the fit of the slope. The reference is rarely over 10 degrees


@dataclass
class RealScore:
    """The errors of a lean against the rough reference."""

    rms_deg: float  # root of the mean square of the error
    slope: float  # shown lean divided by reference lean, for reference leans over 5 degrees


@dataclass
class RecordingScores:
    """The scores of all estimators on a recording."""

    name: str  # name of the recording's file
    scores: dict[str, RealScore]  # score of each estimator, by its name
    # "time" in s, and the leans in degrees, positive to the right: "reference" and each estimator. Each has shape (N).
    traces: dict[str, NDArray[np.float64]]
    # Remarks about the recording, and about readings that contradict its calibration
    notices: list[Message] = field(default_factory=list)


def compare(path: Path) -> RecordingScores:
    """Run every estimator over a recorded ride with speed. Raises InputError if the recording cannot be used."""
    log = read_log(path)
    speed, calibration = _speed(log), fit_ride(log).calibration
    reference = reference_lean(log, calibration)
    time = log.t_s
    riding = speed > _RIDING_MPS
    leans = estimate(log, calibration)
    scores = {
        name: RealScore(rms((lean - reference)[riding]), slope(lean[riding], reference[riding], _LEANED_DEG))
        for name, lean in leans.items()
    }
    notices = read_ride(log, calibration).notices
    return RecordingScores(path.name, scores, {"time": time, "reference": reference, **leans}, notices)


def reference_lean(log: Log, calibration: CalibrationFile) -> NDArray[np.float64]:
    """Compute the reference lean atan(v * yaw rate / g), averaged over 1 s, in degrees; positive to the right."""
    samples = calibrated(log, calibration)
    centripetal = _speed(log) * np.radians(samples.rate[:, 1])
    lean = -np.degrees(np.arctan(centripetal / STANDARD_GRAVITY))
    return moving_mean(lean, round(AVERAGE_S * samples.rate_hz))


def _speed(log: Log) -> NDArray[np.float64]:
    """Return the speed at each sample in m/s, interpolated between the logged values."""
    has_speed = ~np.isnan(log.speed_mps)
    if np.count_nonzero(has_speed) < 2:
        raise InputError(f"{log.name} has no speed: without it there is no reference")
    return np.interp(log.t_s, log.t_s[has_speed], log.speed_mps[has_speed])
