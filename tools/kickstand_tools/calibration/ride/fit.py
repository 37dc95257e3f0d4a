"""Alignment of a motorcycle's sensor from an ordinary ride, without poses."""

from dataclasses import dataclass

import numpy as np
from kickstand.errors import Notice, Refusal

from ...errors import InputError
from ...logs.frozen import without_frozen
from ...logs.reader import Source, read_log
from ...logs.source import Progress
from ...logs.table import Array
from ...refusals import RefusedInput
from ..file import CalibrationFile
from . import model as m
from .adjustment import Adjustment, adjust
from .first_guess import first_guess
from .phone import PHONES, mounting
from .rotations import rotation_between
from .windows import WINDOW_S, Windows, windows_of

_SLOWEST_HZ = 20.0
_ODD_SIGMAS, _ABSURD_SIGMAS = 4.0, 20.0  # of a sensor's errors that the fit needs: beyond, its quality is worse
_MAX_DEG = np.array([5.0, 5.0, 3.5])  # pitch, yaw, roll: known less exactly, an alignment is not given
_MOVED_DEG = 8.0


@dataclass
class RideFit:
    """What a ride gives. Angles in degrees.

    roll_deg, pitch_deg, yaw_deg: standard errors of the alignment about forward, left and up. The larger part of them
    are errors of the sensor that a ride does not tell. Upright is where the bike is balanced on straights. halves_deg:
    by how much two halves of the ride differ in these three. offset_g (3): of the accelerometer along left, up and
    forward, which the calibration takes off; offset_sigma_g (3): standard errors. used_s: from and to which second of
    the log the sensor was mounted. riding_s, standing_s: seconds of it. lean_deg: rms of the ride's lean. lag_s: by how
    much the log's speed is late, None without a speed. phone_deg: by how much the phone is turned against the way that
    was said, None if nothing was. notices: what is remarkable in the log.
    """

    calibration: CalibrationFile
    roll_deg: float
    pitch_deg: float
    yaw_deg: float
    halves_deg: tuple[float, float, float]
    offset_g: Array
    offset_sigma_g: Array
    used_s: tuple[float, float]
    riding_s: float
    standing_s: float
    lean_deg: float
    lag_s: float | None
    phone_deg: float | None
    notices: list[Notice]


def fit_ride(log: Source, phone: str | None = None, progress: Progress | None = None) -> RideFit:
    """How the sensor sits on a motorcycle, from a ride with bends, in which no pose was held.

    log: see read_log; a speed helps and is not needed. phone: None, or how it was mounted: "portrait", "landscape" or
    "flat" (see phone.py). progress: called with what is done of all there is. Up is where the bike is balanced on
    straights, forward is the axis about which it leans into its bends and along which it speeds up, left and right are
    told by leaning into bends. Scale errors of the accelerometer are not told by a ride. Raises InputError;
    RefusedInput, a subclass with code and values, where the ride does not tell how the sensor sits.

    >>> from kickstand_tools.api import Log, simulate_ride
    >>> ride = simulate_ride("city", seed=3, seconds=240.0)
    >>> found = fit_ride(Log.from_readings(ride.readings, ride.rate_hz))
    >>> found.yaw_deg < 2.0, found.roll_deg < 2.0, found.calibration.vehicle_from_sensor.shape
    (True, True, (3, 3))
    """
    if phone is not None and phone not in PHONES:
        raise InputError(f"no phone is mounted {phone}: there are {', '.join(PHONES)}")
    log = without_frozen(read_log(log))
    step_s = float(log.t_s[-1]) / (len(log.t_s) - 1)
    if step_s * _SLOWEST_HZ > 1.0:
        raise InputError(f"{log.name}: a sample every {step_s:.2f} s: at least {_SLOWEST_HZ:.0f} a second are needed")
    try:
        windows = windows_of(log)
        guess = first_guess(windows)
        expected = mounting(phone, guess.matrix) if phone else None
        found = adjust(windows, guess, expected, progress)
        return _checked(windows, found, expected, log.notices)
    except Refusal as refusal:
        raise RefusedInput(refusal, log.name) from refusal


def _checked(windows: Windows, found: Adjustment, expected: Array | None, notices: list[Notice]) -> RideFit:
    """The result with its quality. Raises Refusal where that is too low."""
    halves = np.degrees(found.halves)
    if np.max(np.abs(halves)) > _MOVED_DEG:
        raise Refusal("ride-halves", float(np.max(np.abs(halves))))
    odd = float(np.max(np.abs((found.parameters - m.USUAL) / m.SIGMA)[m.SENSOR]))
    if odd > _ABSURD_SIGMAS:
        raise Refusal("ride-contradicts")
    # where a half differs by more than its error, something that the model does not know was at work
    error = np.hypot(np.degrees(found.sigma[m.ROTATION]), 0.5 * halves) * max(1.0, odd / _ODD_SIGMAS)
    if np.any(error > _MAX_DEG):
        raise Refusal("ride-uncertain", *(float(error[i]) for i in (2, 0, 1)))
    pitch, yaw, roll = (float(angle) for angle in error)
    # so that the calibrated force on a level, upright bike is 1 g up, whatever the scale errors are
    offset = found.parameters[m.OFFSET] + found.parameters[m.ACCEL].reshape(3, 3)[:, 1]
    notes = {"ride_quality_deg": {"roll": round(roll, 2), "pitch": round(pitch, 2), "yaw": round(yaw, 2)}}
    calibration = CalibrationFile(
        accel_offset_g=offset @ found.matrix,
        gyro_bias_dps=np.degrees(found.bias),
        vehicle_from_sensor=found.matrix,
        aligned=True,
        vehicle="motorcycle",
        notes=notes,
    )
    lean = 0.5 * (found.states[1:, m.LEAN] + found.states[:-1, m.LEAN])[~windows.still]
    given = not np.all(np.isnan(windows.speed))
    off = None if expected is None else np.degrees(np.linalg.norm(rotation_between(found.matrix, expected)))
    return RideFit(
        calibration,
        roll,
        pitch,
        yaw,
        (float(halves[2]), float(halves[0]), float(halves[1])),
        offset,
        found.sigma[m.OFFSET],
        (float(windows.time_s[0] - WINDOW_S / 2.0), float(windows.time_s[-1] + WINDOW_S / 2.0)),
        float(np.count_nonzero(~windows.still)) * WINDOW_S,
        float(np.count_nonzero(windows.still)) * WINDOW_S,
        float(np.degrees(np.sqrt(np.mean(lean**2)))),
        float(found.parameters[m.DELAY]) if given else None,
        None if off is None else float(off),
        notices,
    )
