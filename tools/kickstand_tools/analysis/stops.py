"""Finds standstills, and measures stops as in a brake test: initial speed, distance, mean fully developed deceleration.

UN Regulation No. 13, Annex 4, paragraph 1.1.2, defines the mean fully developed deceleration dm. Braking starts at the
speed v0. The speed falls to vb = 0.8 v0 after the distance sb, and to ve = 0.1 v0 after the distance se.

    dm = (vb^2 - ve^2) / (25.92 (se - sb))       dm in m/s2, speeds in km/h, distances in m

At the standstill, the force shows the slope of the road, and the gyro reads only its bias. Speed v and pitch q are
integrated backwards from it. Because the pitch is known, the dive of the fork does not look like braking:

    dq/dt = w_y sin t - w_x cos t,   dv/dt = f_z - g sin q       (as in kickstand.lean.bike_model)

If the log has a speed, the integrated speed is fitted to it (fitted_speed()). Otherwise the result must be plausible,
because integration from a wrong standstill can give any speed and distance.

The limits of a standstill are relative to the shaking of the ride. In simulated rides, they find all of the standing
time, where the fixed limits of estimation.windows find 54 to 92 %. Relative limits are worse only if an idling engine
shakes as much as the road: they find 17 to 41 % then, and fixed limits 91 %.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from kickstand.units import STANDARD_GRAVITY
from numpy.typing import NDArray

from ..calibration.file import CalibrationFile
from ..checks.log import check_log
from ..logs.log import Source
from ..logs.reader import read_log
from ..signals import STANDING_MPS, Array, Bools, best_lag, integral, intervals, smoothed, window_means, window_spreads
from .ride import Channels, Ride, channels, downsampled, joined, spacing_s, thinned

STALE_S = 3.0  # an older speed is not used

# Without a speed, standstills are found by the shaking. At a standstill, the shaking over QUIET_S is less than a share
# of the shaking while moving.
QUIET_S = 1.0
QUIET_SHARE = 0.15  # the share for the rates of pitch and yaw
# The share for the vertical force. After a stop the fork shakes less than this. Smooth roads and idling engines cause
# more shaking.
QUIET_UP_SHARE = 0.2
RIDING_PERCENTILE = 90.0  # this percentile of the shaking comes from a moving vehicle, even with long pauses
# Limits of the road's shaking. Shaking faster than ENGINE_S is the engine's. Changes slower than BEND_S are bends and
# the dive of the fork
ENGINE_S, BEND_S = 0.1, 0.5
STILL_DPS, STILL_G = 1.0, 0.01  # at a standstill, largest rate, and largest change of the forward force over QUIET_S
MAX_OFF_G = 0.05  # at a standstill, largest difference from the force at rest; even gentle braking and bends exceed it
UNCALIBRATED_G = 0.12  # for a ride without a rest: largest difference from 1 g, also of an uncalibrated sensor

LEAD_S = 4.0  # the fit also uses the logged speeds in this time before the braking
DELAYS_S = np.arange(-0.5, 1.51, 0.05)  # delays of the speed to try, in s
# A delay is searched only with at least ENOUGH_SPEEDS speeds, one per second. The standard deviation of the changes
# from one speed to the next must be at least ENOUGH_CHANGE_MPS.
ENOUGH_SPEEDS, ENOUGH_CHANGE_MPS = 30, 0.5

# Standard deviations of each fitted parameter, and of a logged speed
SIGMA_SCALE, SIGMA_SLOPE_MPS2, SIGMA_DELAY_S, SIGMA_SPEED_MPS = 0.01, 0.05, 0.05, 0.05
# The random walk of the acceleration error, per square root of a second, and the time between its knots
SIGMA_WALK_MPS2, KNOT_S = 0.1, 0.5

RATE_S = 0.02  # time between samples for the search of stops
MIN_SPEED_MPS = 10.0 / 3.6
# Smallest and largest mean deceleration of a stop. A larger deceleration means a fall or a fault.
MIN_MFDD_MPS2, MAX_MFDD_MPS2 = 1.0, 30.0
LONGEST_S = 60.0  # the search for the start of the braking goes back at most this long
FEWEST = 10  # least number of samples at a standstill, to compute slope and bias
GAP_S = 0.5  # longest gap in the readings over which speed and pitch are integrated
REST_S = 2.5  # duration of the standstill that is used
SETTLE_S = 0.5  # first part of a standstill that is not used, because the fork rebounds
# Shares of the full deceleration. Over ONSET_SHARE, the vehicle is braking. Under FAINT_SHARE, the vehicle is not
# braking.
ONSET_SHARE, FAINT_SHARE = 0.15, 0.04
ONSET_S = 0.6  # longest time in which the deceleration rises from FAINT_SHARE to ONSET_SHARE

# Height of the sensor above the point about which a bike pitches. This point is as high as the hubs of the wheels. When
# the nose goes down, a sensor under the seat moves forward.
SENSOR_HEIGHT_M = 0.65

MAX_SPEED_MPS = 250.0 / 3.6
MAX_SIDE_M, MAX_HEADING_DEG = 15.0, 30.0  # a stop that deviates more from a straight line is a bend
# The speed is integrated backwards from a standstill to the previous standstill, where it should be 0. It may differ
# from 0 by OPEN_MPS, plus OPEN_MPS2 for each second between the two standstills. A pitch error of one degree causes
# 0.17 m/s2, and the gyro's drift adds to it. If more than SHOWING_S are between the standstills, this is not tested.
OPEN_MPS, OPEN_MPS2, SHOWING_S = 3.0, 0.7, 30.0
SPEED_S, SURELY_MPS2 = 15.0, 1.5  # longest duration and smallest deceleration of a stop that only the log's speed shows

STRAIGHT_S = 0.1  # the mean heading over this first part of the braking gives the straight line
SMOOTH_S = 0.2  # averaging time of accelerations and jerks


def standing(ride: Channels) -> Bools:
    """Find the standstills, shape (n), by the log's speed or, without a speed, by the shaking."""
    still = _quiet(ride)
    if not np.any(still):
        still = _rests_of_filter(ride)
    valid = ~np.isnan(ride.speed_mps)
    latest = np.maximum.accumulate(np.where(valid, np.arange(len(valid)), 0))
    recent = valid[latest] & (ride.t_s - ride.t_s[latest] < STALE_S)
    return np.where(recent, ride.speed_mps[latest] < STANDING_MPS, still)


def _quiet(ride: Channels) -> Bools:
    """Find the seconds without shaking, rotation and change of force, shape (n)."""
    still = np.zeros(len(ride.t_s), dtype=bool)
    second = max(4, round(QUIET_S / spacing_s(ride)))
    if len(still) < 2 * second:
        return still
    quiet = np.ones(len(still) - second + 1, dtype=bool)
    for rate in ride.pitch_rate_dps, ride.yaw_rate_dps:
        slow = smoothed(rate, ride.t_s, ENGINE_S)
        quiet &= (np.abs(window_means(slow, second)) < STILL_DPS) & _is_calm(slow, second, QUIET_SHARE)
        quiet &= _is_calm(_shaking_by_road(rate, ride.t_s), second, QUIET_SHARE)
    quiet &= _is_calm(_shaking_by_road(ride.up_g, ride.t_s), second, QUIET_UP_SHARE)
    half = second // 2
    forward = window_means(ride.forward_g, half)
    quiet &= np.abs(forward[second - half :] - forward[: len(quiet)]) < STILL_G
    quiet &= _has_force_at_rest(ride, second) & (window_means(ride.rolling, second) < 0.5)
    for shift in range(second):  # mark every sample of a quiet window
        still[shift : shift + len(quiet)] |= quiet
    return still


def _rests_of_filter(ride: Channels) -> Bools:
    """Return the rests that the lean filter finds, for a road that is too smooth to detect standstills by shaking.

    Each rest is extended back to the time when the forward force reached its value at rest.
    """
    still = ride.resting > 0.5
    forward = smoothed(ride.forward_g, ride.t_s, ENGINE_S)
    for start, _ in intervals(still):
        weight = np.median(forward[start : start + 10])
        moving = np.flatnonzero(np.abs(forward[:start] - weight) > 2 * STILL_G)
        still[(int(moving[-1]) + 1 if len(moving) else 0) : start] = True
    return still


def _shaking_by_road(values: Array, time: Array) -> Array:
    """Return only the road's shaking: remove the engine's faster shaking, and slower bends and braking."""
    slow = smoothed(values, time, ENGINE_S)
    return slow - smoothed(slow, time, BEND_S)


def _is_calm(values: Array, n: int, share: float) -> Bools:
    """Return True where the standard deviation of n successive samples is below a share of its value while moving."""
    spread = window_spreads(values, n)
    return spread < share * np.percentile(spread, RIDING_PERCENTILE)


def _has_force_at_rest(ride: Channels, n: int) -> Bools:
    """True where the mean force over n samples is the force at rest, within the errors of the calibration."""
    size = np.sqrt(sum(window_means(axis, n) ** 2 for axis in (ride.left_g, ride.up_g, ride.forward_g)))
    rests = size[window_means(ride.resting, n) > 0.99]
    weight = float(np.median(rests)) if len(rests) else 1.0
    return np.abs(size - weight) < (MAX_OFF_G if len(rests) else UNCALIBRATED_G)


def speed_delay_s(ride: Channels) -> float:
    """Find the delay in s at which the changes of the log's speed best match the integrated force; 0 if none."""
    valid = np.flatnonzero(~np.isnan(ride.speed_mps))
    valid = valid[np.unique(np.floor(ride.t_s[valid]), return_index=True)[1]]  # one speed per second
    time, changes = ride.t_s[valid], np.diff(ride.speed_mps[valid])
    pushed = integral(ride.t_s, STANDARD_GRAVITY * ride.forward_g)
    if len(valid) < ENOUGH_SPEEDS or np.std(changes) < ENOUGH_CHANGE_MPS:
        return 0.0

    def earlier(by_s: float) -> tuple[Array, Array] | None:
        pushes = np.diff(np.interp(time - by_s, ride.t_s, pushed))
        return (changes, pushes[:, None]) if np.std(pushes) >= ENOUGH_CHANGE_MPS else None

    lag = best_lag(DELAYS_S, earlier)
    return lag.lag_s if lag and lag.inside else 0.0


def fitted_speed(part: Channels, begin: int, speed: Array, acceleration: Array, delay_s: float) -> Array | None:
    """Correct a speed integrated from the acceleration, whose integral drifts, by the log's speed, one per second.

    Least squares with a prior find the correction. The log's speed at the time t is

        u(t) = (1 + k) v(t) + integral of b from t to the end - d a(t)

    v is the integrated speed, and a the measured acceleration. The unknowns are the scale error k, the acceleration
    error b (m/s2), which slopes and fork dive cause, and the delay error d (s). The model of b is a random walk
    backwards in time. It is nearly 0 at standstill, and linear between knots (linear B-splines).

    part: the ride up to a standstill.
    begin: index at which braking begins.
    speed: integrated speed, shape (n), in m/s.
    acceleration: measured acceleration, shape (n), in m/s2.
    delay_s: delay of the log's speed.
    Returns the corrected speed, shape (n), in m/s; None if the log has too few speeds during the stop.
    """
    time = part.t_s
    logged = np.flatnonzero(~np.isnan(part.speed_mps))
    # Indices of the samples at which the vehicle really had the logged speeds.
    actual = np.minimum(np.searchsorted(time, time[logged] - delay_s - 1e-6), len(time) - 1)
    near = time[actual] >= time[begin] - LEAD_S
    logged, actual = logged[near], actual[near]
    if len(actual) < 2 or actual[-1] < begin:
        return None
    knots = np.arange(float(time[-1]), float(min(time[actual[0]], time[begin])) - KNOT_S, -KNOT_S)
    hats = np.column_stack([np.interp(time, knots[::-1], row[::-1]) for row in np.eye(len(knots))])
    pushed = np.column_stack([integral(time, hat) for hat in hats.T])
    pushed = pushed[-1] - pushed  # the integral from each sample to the end
    terms = np.column_stack((speed, pushed, -smoothed(acceleration, time, SMOOTH_S)))[actual]
    error = part.speed_mps[logged] - speed[actual]
    prior = _prior(len(knots))
    weighted = np.vstack((terms / SIGMA_SPEED_MPS, prior))
    right_side = np.concatenate((error / SIGMA_SPEED_MPS, np.zeros(len(prior))))
    scale_error, *knot_errors, _ = np.linalg.lstsq(weighted, right_side, rcond=None)[0]
    return (1.0 + scale_error) * speed + pushed @ np.array(knot_errors)


def _prior(knots: int) -> Array:
    """Return the matrix of the prior, shape (knots + 2, knots + 2).

    The unknowns are k, then b at each knot, the last knot first, then d. The product of the matrix and the unknowns has
    a prior with mean 0 and standard deviation 1.
    """
    walk = [SIGMA_WALK_MPS2 * KNOT_S**0.5] * (knots - 1)
    sigma = np.array([SIGMA_SCALE, SIGMA_SLOPE_MPS2, *walk, SIGMA_DELAY_S])
    prior = np.eye(knots + 2)
    prior[range(2, knots + 1), range(1, knots)] = -1.0
    return prior / sigma[:, None]


@dataclass
class Stop:
    """One stop.

    start_s, stop_s: times in the log at which the braking begins and the vehicle stands.
    initial_speed_mps: speed at start_s.
    distance_m: distance from start_s to stop_s.
    mfdd_mps2: mean fully developed deceleration.
    peak_mps2: largest deceleration.
    jerk_mps3: largest absolute value of the jerk.
    side_m: deviation from the straight line, positive to the left.
    heading_deg: change of heading, positive to the left.
    speed_from: "log" or "integrated".
    """

    start_s: float
    stop_s: float
    initial_speed_mps: float
    distance_m: float
    mfdd_mps2: float
    peak_mps2: float
    jerk_mps3: float
    side_m: float
    heading_deg: float
    speed_from: str

    @property
    def duration_s(self) -> float:
        return self.stop_s - self.start_s


def find_stops(ride: Channels) -> list[Stop]:
    """Find every stop from over 10 km/h with at least 1 m/s2, measured by UN Regulation No. 13 (see the module).

    ride: a whole ride, from vehicle_channels(). pandas.DataFrame accepts the returned list.

    >>> ride = simulate_ride("street", seed=1, seconds=60.0)
    >>> log = Log.from_readings(ride.readings, ride.rate_hz)
    >>> log.speed_mps[::200] = ride.truth["speed_mps"][::200]  # once per second
    >>> calibration = CalibrationFile(vehicle_from_sensor=ride.vehicle_from_sensor, aligned=True)
    >>> stops = find_stops(vehicle_channels(log, calibration))
    >>> stops[-1].speed_from, stops[-1].initial_speed_mps > 3.0, stops[-1].mfdd_mps2 > 1.0
    ('log', True, True)
    """
    ride = thinned(ride, RATE_S)
    return stops_of(ride, standing(ride))


def brake_tests(log: Source, calibration: CalibrationFile) -> list[Stop]:
    """Call find_stops() for a log with an aligned calibration. Raises InputError.

    The firmware's lean filter takes most of the time. It runs only for motorcycles, because a car has no lean.

    >>> ride = simulate_ride("street", seed=1, seconds=60.0)
    >>> log = Log.from_readings(ride.readings, ride.rate_hz)
    >>> log.speed_mps[::200] = ride.truth["speed_mps"][::200]  # once per second
    >>> calibration = CalibrationFile(vehicle_from_sensor=ride.vehicle_from_sensor, aligned=True)
    >>> brake_tests(log, calibration)[-1].mfdd_mps2 > 1.0
    True
    """
    ride = Ride(check_log(read_log(log), axes=False), calibration)
    parts = _car_channels(ride) if ride.car else ride.read().parts()
    return find_stops(joined(downsampled(parts, RATE_S)))


def _car_channels(ride: Ride) -> Iterator[Channels]:
    for _, part in ride.log.parts(ride.checked.measured):
        lean: dict[str, Array] = {name: np.zeros(len(part.t_s)) for name in ("shown_g", "resting", "sure")}
        if len(part.t_s):
            yield channels(part, ride.calibration, lean, car=True)


def stops_of(ride: Channels, still: NDArray[np.bool_]) -> list[Stop]:
    """Find the stops of a whole ride of means over RATE_S. still: True where the vehicle stands still, shape (n)."""
    delay_s = speed_delay_s(ride)
    stops, earlier_end = [], 0
    for start, end in intervals(still):
        first = max(earlier_end, int(np.searchsorted(ride.t_s, ride.t_s[start] - LONGEST_S)))
        last = min(int(end), int(np.searchsorted(ride.t_s, ride.t_s[start] + REST_S, side="right")))
        gaps = np.flatnonzero(np.diff(ride.t_s[first:last]) > GAP_S)
        first += int(gaps[-1]) + 1 if len(gaps) else 0
        if start - first > FEWEST and last - start > FEWEST:
            stop = _stop(ride.part(slice(first, last)), start - first, delay_s, 0 < first == earlier_end)
            if stop:
                stops.append(stop)
        earlier_end = int(end)
    return stops


def mfdd_mps2(speed_mps: Array, distance_m: Array) -> float:
    """Return the mean fully developed deceleration, dm in the module's docstring, with a factor of 2 for speeds in m/s.

    speed_mps: falls from the initial speed to at most a tenth of it, shape (n).
    distance_m: distances from the start of braking, shape (n).
    """
    vb, ve = 0.8 * speed_mps[0], 0.1 * speed_mps[0]
    falling = np.minimum.accumulate(speed_mps)
    sb, se = np.interp([-vb, -ve], -falling, distance_m)
    if not se > sb:
        return float("inf")
    return float((vb * vb - ve * ve) / (2.0 * (se - sb)))


def closes(speed_mps: float, seconds: float) -> bool:
    """True if a speed integrated backwards is close enough to 0 at the previous standstill, some seconds before."""
    return seconds > SHOWING_S or abs(speed_mps) < OPEN_MPS + OPEN_MPS2 * seconds


def plausible(initial_speed_mps: float, side_m: float, heading_deg: float) -> bool:
    """True if initial speed, deviation from the straight line and change of heading are within the limits of a stop."""
    return initial_speed_mps < MAX_SPEED_MPS and abs(side_m) < MAX_SIDE_M and abs(heading_deg) < MAX_HEADING_DEG


def stops_by_speed(ride: Channels) -> bool:
    """True if the log's speed shows a stop from over 10 km/h that is certainly hard enough for a brake test."""
    valid = ~np.isnan(ride.speed_mps)
    time, speed = ride.t_s[valid], ride.speed_mps[valid]
    for end in np.flatnonzero((speed[1:] < STANDING_MPS) & (speed[:-1] >= STANDING_MPS)) + 1:
        window = slice(int(np.searchsorted(time, time[end] - SPEED_S)), end)
        fall = speed[window] / (time[end] - time[window])
        if np.any((speed[window] > MIN_SPEED_MPS) & (fall > SURELY_MPS2)):
            return True
    return False


def _stop(part: Channels, standstill: int, delay_s: float, from_rest: bool) -> Stop | None:
    """Return the stop that ends in a standstill; None without a stop.

    part: the ride up to some time after the index `standstill`, at which the standstill begins.
    from_rest: True if `part` begins at the end of the previous standstill.
    """
    time = part.t_s
    acceleration, pitch_rate, yaw_rate = _acceleration(part, standstill)
    integrated = integral(time, acceleration)
    # Integrate the speed backwards from the standstill. Correct the speed for the motion of the sensor when the bike
    # pitches.
    speed = integrated - integrated[-1] + SENSOR_HEIGHT_M * np.radians(pitch_rate)
    smooth = smoothed(acceleration, time, SMOOTH_S)
    begin = _onset(smooth, time, standstill)
    if begin is None:
        return None
    source = "integrated"
    fitted = fitted_speed(part, begin, speed, acceleration, delay_s)
    if fitted is not None:
        speed, source = fitted, "log"
    elif from_rest and not closes(float(speed[0]), float(time[standstill] - time[0])):
        return None
    smooth = smoothed(np.gradient(speed, time), time, SMOOTH_S)
    initial_mps = float(speed[begin])
    ended = np.flatnonzero(speed[begin:] <= 0.02 * initial_mps)
    if initial_mps < MIN_SPEED_MPS or not len(ended):
        return None
    braked = slice(begin, begin + int(ended[0]) + 1)
    v, t = np.maximum(speed[braked], 0.0), time[braked]
    distance = integral(t, v)
    mfdd = mfdd_mps2(v, distance)
    if not MIN_MFDD_MPS2 <= mfdd < MAX_MFDD_MPS2:
        return None
    heading = integral(t, yaw_rate[braked])
    off_line = np.radians(heading - np.mean(heading[t <= t[0] + STRAIGHT_S]))
    jerk = smoothed(np.gradient(smooth, time), time, SMOOTH_S)
    # The fork's rebound hides the last hundredths of the braking. Assume that the speed falls evenly to zero.
    tail_s = v[-1] / mfdd
    stop = Stop(
        start_s=float(t[0]),
        stop_s=float(t[-1] + tail_s),
        initial_speed_mps=initial_mps,
        distance_m=float(distance[-1] + 0.5 * v[-1] * tail_s),
        mfdd_mps2=mfdd,
        peak_mps2=float(-np.min(smooth[braked])),
        jerk_mps3=float(np.max(np.abs(jerk[braked]))),
        side_m=float(integral(t, v * np.sin(off_line))[-1]),
        heading_deg=float(heading[-1]),
        speed_from=source,
    )
    if source == "integrated" and not plausible(stop.initial_speed_mps, stop.side_m, stop.heading_deg):
        return None
    return stop


def _acceleration(part: Channels, standstill: int) -> tuple[Array, Array, Array]:
    """Return the acceleration along the road in m/s2, pitch and yaw rate in deg/s, without their values at rest."""
    time = part.t_s
    settled = int(np.searchsorted(time, time[standstill] + SETTLE_S))
    still = slice(settled if settled < len(time) - 5 else standstill, len(time))
    lean = np.radians(np.nan_to_num(part.lean_deg))
    pitch_rate = part.pitch_rate_dps - np.mean(part.pitch_rate_dps[still])
    yaw_rate = part.yaw_rate_dps - np.mean(part.yaw_rate_dps[still])
    level_pitch_rate = yaw_rate * np.sin(lean) + pitch_rate * np.cos(lean)
    turned = integral(time, np.radians(level_pitch_rate))
    stood = np.arcsin(np.clip(np.mean(part.forward_g[still]), -0.5, 0.5))
    pitch = stood + turned - np.mean(turned[still])
    return STANDARD_GRAVITY * (part.forward_g - np.sin(pitch)), level_pitch_rate, yaw_rate


def _onset(smooth: Array, time: Array, standstill: int) -> int | None:
    """Return the index at which the braking begins that ends in this standstill; None without braking."""
    braking = -smooth[:standstill]
    hard = np.flatnonzero(braking > 0.5 * MIN_MFDD_MPS2)
    if not len(hard):
        return None
    braking = braking[: int(hard[-1]) + 1]
    end_s = time[hard[-1]]
    level = float(np.percentile(braking[int(np.searchsorted(time, end_s - 2.0)) :], 75))
    weak = np.flatnonzero(braking < max(ONSET_SHARE * level, 0.25))
    weak = weak[time[weak] < end_s - 0.3]  # weak braking just before the standstill does not end the search
    begin = int(weak[-1]) if len(weak) else 0
    earliest = int(np.searchsorted(time, time[begin] - ONSET_S))
    while begin > earliest and braking[begin] > FAINT_SHARE * level:
        begin -= 1
    return begin
