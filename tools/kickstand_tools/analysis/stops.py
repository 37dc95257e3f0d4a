"""Measures stops as in a brake test: initial speed, distance, mean fully developed deceleration.

UN Regulation No. 13, Annex 4, paragraph 1.1.2, defines the mean fully developed deceleration dm. Braking starts at the
speed v0. The speed falls to vb = 0.8 v0 after the distance sb, and to ve = 0.1 v0 after the distance se.

    dm = (vb^2 - ve^2) / (25.92 (se - sb))       dm in m/s2, speeds in km/h, distances in m

At the standstill, the force shows the slope of the road, and the gyro reads only its bias. Speed and pitch are
integrated backwards from the standstill. Because the pitch is known, the dive of the fork does not look like braking:

    dq/dt = w_y sin t - w_x cos t,   dv/dt = f_z - g sin q       (as in kickstand.lean.bike_model)

The symbols are lean t (positive to the right), pitch q (positive if the nose is up), speed v, rates w, and specific
force f. The axes are left (x), up (y) and forward (z).

If the log has a speed, the integrated speed is fitted to it (speed_fit.py). Otherwise the result must be plausible,
because integration from a wrong standstill can give any speed and distance.
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
from ..signals import STANDING_MPS, Array, integral, intervals, smoothed
from .channels import Channels, channels, downsampled, joined, thinned
from .ride import Ride
from .speed_fit import fitted_speed, speed_delay_s
from .standstill import standing

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

    >>> from kickstand_tools.api import Log, fit_two_positions, simulate_ride, vehicle_channels
    >>> ride = simulate_ride("street", seed=1, seconds=60.0)
    >>> poses = [Log.from_readings(pose, ride.rate_hz) for pose in (ride.kickstand, ride.upright)]
    >>> log = Log.from_readings(ride.readings, ride.rate_hz)
    >>> log.speed_mps[::200] = ride.truth["speed_mps"][::200]  # once per second
    >>> stops = find_stops(vehicle_channels(log, fit_two_positions(*poses).calibration))
    >>> stops[-1].speed_from, stops[-1].initial_speed_mps > 3.0, stops[-1].mfdd_mps2 > 1.0
    ('log', True, True)
    """
    ride = thinned(ride, RATE_S)
    return stops_of(ride, standing(ride))


def brake_tests(log: Source, calibration: CalibrationFile) -> list[Stop]:
    """Find every stop of a log from over 10 km/h, and measure it by UN Regulation No. 13 (see find_stops).

    The firmware's lean filter takes most of the time. The filter runs only for motorcycles, because a car has no lean.

    calibration: must be aligned.
    Raises InputError.

    >>> from kickstand_tools.api import Log, fit_two_positions, simulate_ride
    >>> ride = simulate_ride("street", seed=1, seconds=60.0)
    >>> poses = [Log.from_readings(pose, ride.rate_hz) for pose in (ride.kickstand, ride.upright)]
    >>> log = Log.from_readings(ride.readings, ride.rate_hz)
    >>> log.speed_mps[::200] = ride.truth["speed_mps"][::200]  # once per second
    >>> stops = brake_tests(log, fit_two_positions(*poses).calibration)
    >>> stops[-1].initial_speed_mps > 3.0, stops[-1].mfdd_mps2 > 1.0
    (True, True)
    """
    ride = Ride(check_log(read_log(log), axes=False), calibration)
    parts = _car_channels(ride) if ride.car else ride.read().parts()
    return find_stops(joined(downsampled(parts, RATE_S)))


def _car_channels(ride: Ride) -> Iterator[Channels]:
    """Yield the channels of a car's ride, without a lean."""
    for _, part in ride.log.parts(ride.checked.measured):
        lean: dict[str, Array] = {name: np.zeros(len(part.t_s)) for name in ("shown_g", "resting", "sure")}
        if len(part.t_s):
            yield channels(part, ride.calibration, lean, car=True)


def stops_of(ride: Channels, still: NDArray[np.bool_]) -> list[Stop]:
    """Find the stops of a whole ride.

    ride: means over RATE_S each.
    still: True where the vehicle stands still, shape (n).
    """
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
    """Return the mean fully developed deceleration, dm in the module's docstring.

    Speeds are in m/s instead of km/h, so the factor 25.92 becomes 2.

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
    """True if a speed integrated backwards from a standstill is close enough to 0 at the previous standstill.

    speed_mps: the integrated speed at the previous standstill.
    seconds: time between both standstills.
    """
    return seconds > SHOWING_S or abs(speed_mps) < OPEN_MPS + OPEN_MPS2 * seconds


def plausible(initial_speed_mps: float, side_m: float, heading_deg: float) -> bool:
    """True if initial speed, deviation from the straight line and change of heading are within the limits of a stop."""
    return initial_speed_mps < MAX_SPEED_MPS and abs(side_m) < MAX_SIDE_M and abs(heading_deg) < MAX_HEADING_DEG


def stops_by_speed(ride: Channels) -> bool:
    """True if the log's speed shows a stop from over 10 km/h that is certainly hard enough for a brake test.

    The force may not show this stop.
    """
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

    part: the ride up to some time after the beginning of the standstill.
    standstill: index in `part` at which the standstill begins.
    delay_s: delay of the log's speed.
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
    v = speed[begin:]
    below = np.flatnonzero(v <= 0.02 * v[0])
    if v[0] < MIN_SPEED_MPS or not len(below):
        return None
    braked = slice(begin, begin + int(below[0]) + 1)
    v, t = np.maximum(speed[braked], 0.0), time[braked]
    distance = integral(t, v)
    mfdd = mfdd_mps2(v, distance)
    if not MIN_MFDD_MPS2 <= mfdd < MAX_MFDD_MPS2:
        return None
    heading = integral(t, yaw_rate[braked])
    straight = np.mean(heading[t <= t[0] + STRAIGHT_S])
    # The fork's rebound hides the last hundredths of the braking. Assume that the speed falls evenly to zero.
    tail = v[-1] / mfdd
    stop = Stop(
        float(t[0]),
        float(t[-1] + tail),
        float(v[0]),
        float(distance[-1] + 0.5 * v[-1] * tail),
        mfdd,
        float(-np.min(smooth[braked])),
        float(np.max(np.abs(smoothed(np.gradient(smooth, time), time, SMOOTH_S)[braked]))),
        float(integral(t, v * np.sin(np.radians(heading - straight)))[-1]),
        float(heading[-1]),
        source,
    )
    if source == "integrated" and not plausible(stop.initial_speed_mps, stop.side_m, stop.heading_deg):
        return None
    return stop


def _acceleration(part: Channels, standstill: int) -> tuple[Array, Array, Array]:
    """Compute acceleration and rates. The values at standstill are subtracted.

    Returns:
        acceleration: along the road, shape (n), in m/s2.
        pitch_rate: rate of pitch, shape (n), in deg/s.
        yaw_rate: yaw rate, shape (n), in deg/s.
    """
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
