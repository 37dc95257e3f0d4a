"""Finds the alignment of a motorcycle's sensor, with its covariance, from an ordinary ride. It needs no poses.

First, axes() finds rough axes. Then the misalignment relative to them is estimated together with the motion, the gyro's
bias and the errors of sensor and bike. Its prior is so wide that it adds no information. The lean follows the gyro
through the bends. On straights the bike is balanced, so the mean lean on straights shows the bike's own up. The
residual force across the bike is the bias of the accelerometer.

Two errors cannot be distinguished from a misalignment. A centre of mass beside the middle of the bike looks like a roll
misalignment. Cross-axis errors of the sensor look like any misalignment, and cause most of the alignment's standard
deviation.
"""

from dataclasses import dataclass, replace

import numpy as np
from kickstand.units import STANDARD_GRAVITY

from ..calibration.file import CalibrationFile
from ..checks.axes import AxesMisfit, LeftHanded, RatesMisfit
from ..checks.leaning import WINDOW_S, Leaning, RatesInRadians, averaged, leaning_of, speed_in_radians, without_drift
from ..checks.log import SpeedStuck, SpeedUnit, read_with_notices, without_frozen
from ..checks.turning import bias_dps
from ..common.messages import AT_REST, InputError, Message, RefusedInput, Remedy, kind
from ..logs.csv_text import MOST_DPS, MOST_G
from ..logs.log import Log, Source
from ..logs.source import Progress
from ..signals import Array, Bools, intervals, rotation_angle, rotation_vector
from . import model as of
from .least_squares import Estimate
from .model import Hypotheses, Prior
from .windows import MOUNTED_DEG, MOUNTED_S, Windows, calm, standing, windows_of

MIN_RIDING_S = 30.0
MIN_LEAN = np.radians(3.0)  # a ride whose lean has a smaller rms does not show forward
MIN_CORRELATION = 0.5  # least correlation between leaning and turning; bikes have over 0.75
# Largest force to the side in bends, divided by the lean. Bikes have 0.1 to 0.2, due to the width of the tyres.
MAX_PUSHED = 0.5
# A car has a larger rms of the force to the side, also divided by the lean, and a smaller rms of lean. The rates are
# about the force: in recorded drives the angle was at most 16 degrees. A leaning bike's rates are not, even in a bend
# that is so long that the lean hardly changes. In less than CAR_S, the force to the side must also fit the yaw rate.
CAR_G, CAR_PUSHED, CAR_LEAN, CAR_TILT = 0.045, 2.0, np.radians(5.0), np.radians(20.0)
CAR_S, CAR_CORRELATION = 60.0, 0.35
CONTRADICTS_S = 120.0  # less riding that no mounting explains is only not enough
# A log's speed is stuck if it changes by less than STUCK_MPS, although the force along the vehicle changes the speed by
# an rms of PUSHED_MPS.
STUCK_MPS, PUSHED_MPS = 0.5, 1.5
MAX_SPEED_FACTOR = 1.8  # largest factor between the log's speed and the speed from the bends

SLOWEST_HZ = 20.0  # a log with a lower sample rate is refused
LONGEST_S = 1800.0  # the longest part of a ride that is used; a longer part does not improve the result
# Standard deviations of the prior
ROTATION_SIGMA = 10.0  # misalignment, in rad; large, because nothing is known about it
AXES_SIGMA = 0.012  # scale and cross-axis errors of the accelerometer, as a ratio
BESIDE_SIGMA_G = 0.005  # force to the side on straights, caused by luggage or camber
UNSETTLED = np.radians(0.5)  # if the last step changed an angle by more than this, the estimate has not converged
# An estimated error of the sensor over ODD_SIGMAS standard deviations of its prior enlarges the standard errors. An
# error over ABSURD_SIGMAS standard deviations refuses the ride.
ODD_SIGMAS, ABSURD_SIGMAS = 4.0, 20.0
MAX_DEG = np.array([5.0, 5.0, 3.5])  # largest accepted standard errors of pitch, yaw and roll
MOVED_DEG = 8.0  # largest accepted difference between the alignments from the two halves of the ride
CONSTANT = Hypotheses(*np.array([[1e-5], [1e-5], [1e-4], [0.0], [1.0]]))  # mount and wind do not change during the ride

# The mountings of a phone that its user can name. A named mounting checks the ride's result, and helps if the ride has
# few bends. A phone's axes, as seen by a person looking at the screen, are: x to the right, y to the top, z out of the
# screen (W3C Device Orientation; the same on Android and iOS).
X, Y, Z = np.eye(3)

# The rows of each matrix are left, up and forward in the phone's axes. The screen faces the rider, so it faces
# backward. A phone in landscape may be turned to either side.
PHONES = {
    "portrait": [np.array([-X, Y, -Z])],
    "landscape": [np.array([Y, X, -Z]), np.array([-Y, -X, -Z])],
    "flat": [np.array([-X, Z, Y])],
}
PHONE_SIGMA_DEG = 20.0  # standard deviation of the mounting, because a holder may be tilted towards the rider's eyes
PHONE_MAX_DEG = 45.0  # largest accepted difference: half of the 90 degrees between two mountings

RideShort = kind(
    "ride-short",
    "riding_s least_s",
    "only {riding_s:.0f} s of riding",
    Remedy("at least {least_s:.0f} s with bends are needed"),
)
NoBends = kind(
    "no-bends",
    "lean_deg",
    "it hardly leans ({lean_deg:.1f} degrees rms)",
    Remedy("a motorcycle's ride with bends to both sides is needed"),
)
NotLeaning = kind(
    "not-leaning",
    text="in bends it is pushed aside and does not lean, as a car",
    todo=Remedy(
        "with a speed in the log take kickstand calibrate drive --vehicle car", "this page aligns motorcycles only"
    ),
)
# A long bend to one side looks the same if it is mirrored
SideUnsure = kind(
    "side-unsure",
    text="it does not show to which side the bike leans in the bends",
    todo=Remedy("a ride with straights between bends to both sides is needed"),
)
RideContradicts = kind(
    "ride-contradicts",
    text="no one mounting explains these readings",
    todo=Remedy("was the sensor moved, or are axes exchanged between accelerometer and gyro?"),
)


@dataclass
class Axes:
    matrix: Array  # rotation from sensor to vehicle axes, shape (3, 3). The rows are left, up and forward.
    bias: Array  # the gyro's bias along the sensor's axes, shape (3), in rad/s


def axes(w: Windows) -> Axes:
    """Find the vehicle's axes, within some degrees, and the gyro's bias, from windows along the sensor's axes.

    In balance, the specific force points along the bike's own up. For forward and the handedness see checks/leaning.py.

    Raises RefusedInput if the ride is not a motorcycle's, or has too little lean.
    """
    bias = _rough_bias(w)
    w = replace(w, rate=w.rate - bias)
    riding = ~w.gap & ~standing(w)
    seconds = float(np.sum(w.seconds[riding]))
    if seconds < MIN_RIDING_S:
        raise RefusedInput(RideShort(seconds, MIN_RIDING_S))
    leaning = leaning_of(w.rate, w.force, riding)
    _refuse_no_motorcycle(leaning, without_drift(w.force @ leaning.matrix[0]), _tilt(w, riding), riding)
    pushed = without_drift(np.cumsum(w.force @ leaning.matrix[2]) * WINDOW_S * STANDARD_GRAVITY)
    _refuse_wrong_speed(w.known_speed[riding], leaning.rolled[riding], leaning.turned[riding], pushed[riding])
    return Axes(leaning.matrix, bias)


def _rough_bias(w: Windows) -> Array:
    """Return the gyro's bias in rad/s: the median rate at rest.

    Without a standstill it is the bias with which the rates explain the forces best, as the median rate may be that of
    a long bend.
    """
    still = calm(w)
    if np.any(still):
        return np.median(w.rate[still], axis=0)
    fitted = bias_dps(w.force, np.degrees(w.rate), ~w.gap, WINDOW_S)
    return np.median(w.rate[~w.gap], axis=0) if fitted is None else np.radians(fitted)


def _tilt(w: Windows, riding: Bools) -> float:
    force, rate = averaged(w.force, 2.0)[riding], averaged(w.rate, 2.0)[riding]
    return float(np.arctan2(np.linalg.norm(np.cross(force, rate)), np.linalg.norm(np.sum(force * rate, axis=1))))


def _refuse_no_motorcycle(found: Leaning, sideways: Array, tilt: float, riding: Bools) -> None:
    """Raise RefusedInput if the ride is not a motorcycle's, or does not show lean and side.

    sideways: the force to the left without its slow changes, shape (n), in g.
    """
    in_radians_mps = speed_in_radians(found)
    if in_radians_mps is not None:
        raise RefusedInput(RatesInRadians(in_radians_mps))
    rolled, turned, sideways = found.rolled[riding], found.turned[riding], sideways[riding]
    lean, side = float(np.sqrt(np.mean(rolled**2))), float(np.sqrt(np.mean(sideways**2)))
    pushed = abs(float(sideways @ turned)) / max(abs(float(rolled @ turned)), 1e-30)
    correlation = abs(float(sideways @ turned)) / max(float(np.linalg.norm(sideways) * np.linalg.norm(turned)), 1e-30)
    car = pushed > CAR_PUSHED and side > CAR_G and lean < CAR_LEAN and tilt < CAR_TILT
    riding_s = np.count_nonzero(riding) * WINDOW_S
    if car and (correlation > CAR_CORRELATION or riding_s > CAR_S):
        raise RefusedInput(NotLeaning())
    if lean < MIN_LEAN:
        raise RefusedInput(NoBends(float(np.degrees(lean))))
    if pushed > MAX_PUSHED or found.correlation < MIN_CORRELATION:
        raise RefusedInput(RideContradicts() if riding_s > CONTRADICTS_S else SideUnsure())
    # A leaning bike that turns also rotates about its own left. The opposite sign of this rotation contradicts the side
    # of the lean. The handedness itself is judged when the log is read.
    if found.share < 0.0:
        raise RefusedInput(SideUnsure())


def _refuse_wrong_speed(known: Array, rolled: Array, turned: Array, pushed: Array) -> None:
    """Raise RefusedInput if the log's speed is stuck, or not the speed at which yaw rate and lean balance in the bends.

    known, pushed: the log's speed, NaN without one, and its changes by the force along the vehicle, in m/s.
    """
    if not len(known) or np.isnan(known[0]):
        return
    if np.ptp(known) < STUCK_MPS and np.std(pushed) > PUSHED_MPS:
        raise RefusedInput(SpeedStuck(float(known[0])))
    expected = known * turned
    balance = -float(expected @ rolled) * STANDARD_GRAVITY
    factor = float(expected @ expected) / balance if balance > 0.0 else 0.0
    if not 1.0 / MAX_SPEED_FACTOR < factor < MAX_SPEED_FACTOR:
        raise RefusedInput(SpeedUnit(factor))


RideHalves = kind(
    "ride-halves",
    "differ_deg",
    "two halves of the ride disagree by {differ_deg:.0f} degrees",
    Remedy("did the mount move? Give a part in which it did not"),
)
RideUncertain = kind(
    "ride-uncertain",
    "roll_deg pitch_deg yaw_deg",
    "the alignment is known to {roll_deg:.1f} degrees in roll, {pitch_deg:.1f} in pitch and {yaw_deg:.1f} in yaw only",
    Remedy("a longer ride is needed, with bends to both sides"),
)
PhoneOtherwise = kind(
    "phone-otherwise",
    "phone off_deg",
    "by the ride the phone is turned by {off_deg:.0f} degrees against {phone}",
    Remedy("mounted another way? Then leave out --phone", "mounted another way?"),
)
PhoneUpsideDown = kind(
    "phone-upside-down",
    "phone",
    "for a phone mounted {phone} all accelerations have the opposite sign",
    Remedy(AT_REST),
)


@dataclass
class RideFit:
    """The alignment from a ride, with its quality. Upright is the balanced position on straights.

    calibration: the alignment.
    roll_deg, pitch_deg, yaw_deg: its standard errors about forward, left and up, mostly from errors of the sensor that
        a ride does not show.
    halves_deg: roll, pitch and yaw from the second half of the ride minus those from the first half.
    offset_g: bias of the accelerometer along left, up and forward, shape (3). The calibration subtracts it.
    offset_sigma_g: standard errors of offset_g, shape (3).
    used_s: begin and end of the used part of the log, in s. In this part the sensor was mounted.
    riding_s, standing_s: seconds of riding and of standing in the used part.
    lean_deg: rms of the lean.
    lag_s: delay of the log's speed; None without a speed.
    phone_deg: angle between the mounting found and the mounting that the user named; None if no mounting was named.
    notices: remarks about the log.
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
    notices: list[Message]


def fit_ride(log: Source, phone: str | None = None, progress: Progress | None = None) -> RideFit:
    """Find the alignment of a sensor on a motorcycle from a ride with bends, without poses.

    Up is the direction in which the bike is balanced on straights. Forward is the axis about which the bike leans into
    bends, and along which it speeds up. The lean in bends distinguishes left from right. Scale errors of the
    accelerometer are not observable from a ride.

    log: a speed improves the result, but is optional.
    phone: the phone's mounting, "portrait", "landscape" or "flat" (see PHONES); None if unknown.
    Raises InputError. Raises its subclass RefusedInput, with a Message, if the ride does not determine the mounting.

    >>> ride = simulate_ride("city", seed=3, seconds=240.0)
    >>> fit = fit_ride(Log.from_readings(ride.readings, ride.rate_hz))
    >>> fit.yaw_deg < 2.0, fit.roll_deg < 2.0, fit.calibration.vehicle_from_sensor.shape
    (True, True, (3, 3))
    """
    if phone is not None and phone not in PHONES:
        raise InputError(f"no phone is mounted {phone}: there are {', '.join(PHONES)}")
    log = without_frozen(read_with_notices(log, sensor=True))
    misfit = next((notice for notice in log.notices if isinstance(notice, (LeftHanded, RatesMisfit, AxesMisfit))), None)
    if misfit:
        raise RefusedInput(misfit, log.name)
    step_s = min(float(log.t_s[-1]) / (len(log.t_s) - 1), float(np.median(np.diff(log.t_s))))  # without the gaps
    if step_s * SLOWEST_HZ > 1.002:
        raise InputError(f"{log.name}: a sample every {step_s:.2f} s: at least {SLOWEST_HZ:.0f} per second are needed")
    try:
        windows = mounted_windows(log)
        guess = axes(windows)
        if progress:
            progress(1, 2)
        expected = _mounting(phone, guess.matrix) if phone else None
        fit = _checked(windows, guess, estimate_alignment(windows, guess, expected), expected, log.notices)
    except RefusedInput as refusal:
        raise refusal.at(log.name) from refusal
    if progress:
        progress(2, 2)
    return fit


def estimate_alignment(windows: Windows, guess: Axes, expected: Array | None) -> Estimate:
    """Estimate the motion, and the misalignment relative to a first guess: multiply the result's matrix by the guess's.

    windows: along the sensor's axes.
    expected: rotation from sensor to vehicle axes of the mounting that the user named, shape (3, 3); None if unknown.
        This rotation is the prior, with the standard deviation PHONE_SIGMA_DEG.
    Raises RefusedInput if the equations have no solution, or if the estimate does not converge.
    """
    sigma, mean = Prior.of_pose(six_done=False).sigma, of.MEAN.copy()
    sigma[of.ROTATION], sigma[of.ACCEL], sigma[of.BESIDE] = ROTATION_SIGMA, AXES_SIGMA, BESIDE_SIGMA_G
    sigma[of.OFFSET_PER_C] = sigma[of.BIAS_PER_C] = 0.0
    if expected is not None:
        mean[of.ROTATION], sigma[of.ROTATION] = rotation_vector(expected @ guess.matrix.T), np.radians(PHONE_SIGMA_DEG)
    try:
        estimate = Estimate(windows.turned(guess.matrix, guess.bias), Prior(mean, sigma, posed=False), CONSTANT)
    except np.linalg.LinAlgError as error:
        raise RefusedInput(RideContradicts()) from error
    if not estimate.change < UNSETTLED:
        raise RefusedInput(RideContradicts())
    return estimate


def mounted_windows(log: Log) -> Windows:
    """Return the windows of the part of a log in which the sensor was mounted, along the sensor's axes.

    This part is the longest stretch in which the mean force keeps its direction. Before and after it, a hand held the
    sensor. Readings beyond MOST_G and MOST_DPS are left out. Raises RefusedInput.
    """
    log = log.part(np.all(np.abs(log.accel_g) < MOST_G, axis=1) & np.all(np.abs(log.gyro_dps) < MOST_DPS, axis=1))
    windows = _windows(log)
    mean = averaged(windows.force, MOUNTED_S)
    mean /= np.maximum(np.linalg.norm(mean, axis=1), 1e-9)[:, None]
    usual = np.median(mean, axis=0)
    near = mean @ usual > np.cos(np.radians(MOUNTED_DEG)) * np.linalg.norm(usual)
    mounted = intervals(near)
    if not len(mounted):
        raise RefusedInput(RideShort(0.0, MIN_RIDING_S))
    begin, end = mounted[np.argmax(np.diff(mounted, axis=1))]
    margin = round(MOUNTED_S / WINDOW_S)  # number of windows from the edge after which a mean contains only the ride
    first = windows.edges[begin + margin * (begin > 0)]
    last = windows.edges[end - margin * (end < len(windows))]
    return _windows(log, (log.t_s >= first) & (log.t_s < min(last, first + LONGEST_S)))


def _windows(log: Log, part: Bools | slice = slice(None)) -> Windows:
    t_s, rate = log.t_s[part], np.radians(log.gyro_dps[part])
    if len(t_s) < 2:
        raise RefusedInput(RideShort(0.0, MIN_RIDING_S))
    return windows_of(t_s, log.accel_g[part], rate, log.speed_mps[part], np.zeros(len(t_s)))


def _checked(
    windows: Windows, guess: Axes, estimate: Estimate, expected: Array | None, notices: list[Message]
) -> RideFit:
    """Return the estimate as a RideFit. Raises RefusedInput if the quality of the estimate is too low."""
    halves = np.degrees(estimate.split())
    half_pitch, half_yaw, half_roll = halves.tolist()  # about left, up, forward
    if np.max(np.abs(halves)) > MOVED_DEG:
        raise RefusedInput(RideHalves(float(np.max(np.abs(halves)))))
    parameters, sigma = np.mean(estimate.parameters, axis=0), estimate.parameter_sigma()
    odd = float(np.max(np.abs(parameters[of.SENSOR] / estimate.prior.sigma[of.SENSOR])))
    if odd > ABSURD_SIGMAS:
        raise RefusedInput(RideContradicts())
    # If the halves differ by more than the standard error, the model lacks a disturbance of this ride. So the error is
    # enlarged by half of their difference.
    error = np.hypot(np.degrees(sigma[of.ROTATION]), 0.5 * halves) * max(1.0, odd / ODD_SIGMAS)
    pitch, yaw, roll = error.tolist()
    if np.any(error > MAX_DEG):
        raise RefusedInput(RideUncertain(roll, pitch, yaw))
    # With this offset, the calibrated force on a level, upright bike is 1 g up, even if the scale is wrong.
    offset = parameters[of.OFFSET] + parameters[of.ACCEL].reshape(3, 3)[:, 1]
    matrix, states = estimate.matrix @ guess.matrix, estimate.states[: len(windows) + 1]
    bias = guess.bias + np.median(states[:, of.BIAS], axis=0) @ matrix
    standstill = standing(windows.turned(matrix, guess.bias))
    lean = (0.5 * (states[1:, of.LEAN] + states[:-1, of.LEAN]))[~standstill]
    has_speed = not np.all(np.isnan(windows.speed))
    notes = {"ride_quality_deg": {"roll": round(roll, 2), "pitch": round(pitch, 2), "yaw": round(yaw, 2)}}
    calibration = CalibrationFile(
        accel_offset_g=offset @ matrix,
        gyro_bias_dps=np.degrees(bias),
        vehicle_from_sensor=matrix,
        aligned=True,
        vehicle="motorcycle",
        notes=notes,
    )
    return RideFit(
        calibration,
        roll_deg=roll,
        pitch_deg=pitch,
        yaw_deg=yaw,
        halves_deg=(half_roll, half_pitch, half_yaw),
        offset_g=offset,
        offset_sigma_g=sigma[of.OFFSET],
        used_s=(float(windows.edges[0]), float(windows.edges[-1])),
        riding_s=float(np.sum(windows.covered[~standstill])),
        standing_s=float(np.sum(windows.covered[standstill])),
        lean_deg=float(np.degrees(np.sqrt(np.mean(lean**2)))),
        lag_s=float(parameters[of.DELAY]) if has_speed else None,
        phone_deg=None if expected is None else _off_deg(matrix, expected),
        notices=notices,
    )


def _mounting(phone: str, estimated: Array) -> Array:
    """Return the matrix (3, 3) of PHONES[phone] nearest to `estimated`; refuse over PHONE_MAX_DEG between them."""
    off, nearest = min(((_off_deg(estimated, matrix), i) for i, matrix in enumerate(PHONES[phone])))
    if off > PHONE_MAX_DEG:
        mirrored = estimated * [[1.0], [-1.0], [-1.0]]  # the result if the accelerations have the opposite sign
        if min(_off_deg(mirrored, matrix) for matrix in PHONES[phone]) < PHONE_MAX_DEG:
            raise RefusedInput(PhoneUpsideDown(phone))
        raise RefusedInput(PhoneOtherwise(phone, off))
    return PHONES[phone][nearest]


def _off_deg(estimated: Array, matrix: Array) -> float:
    return float(np.degrees(rotation_angle(estimated @ matrix.T)))
