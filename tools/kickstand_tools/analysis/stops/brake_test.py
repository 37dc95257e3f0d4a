"""Stops, as a brake test has them: initial speed, distance, mean fully developed deceleration.

UN Regulation No. 13, Annex 4, paragraph 1.1.2: with the initial speed v0 when braking begins, vb = 0.8 v0 and
ve = 0.1 v0 in km/h, and sb and se the distances in metres from there to vb and ve,

    dm = (vb^2 - ve^2) / (25.92 (se - sb))   in m/s2.

Standing still, the force says how the road slopes, the gyro how far it is off. From there speed and pitch are
integrated backwards, so that the dive of the fork is not taken for braking:

    dq/dt = w_y sin t - w_x cos t,   dv/dt = f_z - g sin q       (as in kickstand.lean_filter)

Where the log has a speed, this one is fitted to it (speed_fit.py); else it has to be plausible (plausible.py).
"""

from dataclasses import dataclass

import numpy as np

from ..channels import Array, Channels
from ..signals import G, integral, smoothed
from .plausible import closes, plausible
from .speed_fit import fitted_speed, speed_delay_s
from .standstill import standing

RATE_S = 0.02  # of the samples these functions want, at most
MIN_SPEED_MPS = 10.0 / 3.6
MIN_MFDD_MPS2, MAX_MFDD_MPS2 = 1.0, 30.0  # past that it is a fall or a fault
LONGEST_S = 60.0
GAP_S = 0.5  # over missing readings nothing can be integrated
REST_S = 2.5  # of the standstill that are looked at,
SETTLE_S = 0.5  # but for its beginning, when the fork comes up again
ONSET_SHARE, FAINT_SHARE = 0.15, 0.04  # of the braking: it has begun; it had not
ONSET_S = 0.6  # from the one to the other, at most

# Above the point about which a bike pitches, in the height of its wheels' hubs: the nose going down, a sensor under
# the seat goes forward.
SENSOR_HEIGHT_M = 0.65


@dataclass
class Stop:
    """One stop. Times in s from the start of the log, side > 0 to the left."""

    start_s: float
    stop_s: float
    initial_speed_mps: float
    distance_m: float
    mfdd_mps2: float
    peak_mps2: float
    jerk_mps3: float  # largest, either way
    side_m: float  # how far off the straight line
    heading_deg: float  # turned to the left
    speed_from: str  # "log" or "integrated"

    @property
    def duration_s(self) -> float:
        return self.stop_s - self.start_s


def stops(ride: Channels) -> list[Stop]:
    """Every stop from over 10 km/h with at least 1 m/s2. ride: whole, samples at most RATE_S apart (thin.py)."""
    still = standing(ride)
    edges = np.flatnonzero(np.diff(np.concatenate(([False], still, [False]))))
    delay_s = speed_delay_s(ride)
    found, after = [], 0
    for start, end in zip(edges[::2], edges[1::2]):  # of each standstill
        first = max(after, int(np.searchsorted(ride.t_s, ride.t_s[start] - LONGEST_S)))
        last = int(np.searchsorted(ride.t_s, min(ride.t_s[end - 1], ride.t_s[start] + REST_S), side="right"))
        gaps = np.flatnonzero(np.diff(ride.t_s[first:last]) > GAP_S)
        first += int(gaps[-1]) + 1 if len(gaps) else 0
        if start - first > 10 and last - start > 10:
            stop = _stop(ride.part(slice(first, last)), start - first, delay_s, 0 < first == after)
            if stop:
                found.append(stop)
        after = int(end)
    return found


def mfdd_mps2(speed_mps: Array, distance_m: Array) -> float:
    """dm above. speed_mps: falling, from the initial speed to at most a tenth of it; distance_m: to each."""
    vb, ve = 0.8 * speed_mps[0], 0.1 * speed_mps[0]
    falling = np.minimum.accumulate(speed_mps)
    sb, se = np.interp([-vb, -ve], -falling, distance_m)
    if not se > sb:
        return float("inf")
    return float((3.6**2 * (vb * vb - ve * ve)) / (25.92 * (se - sb)))


def _stop(part: Channels, rest: int, delay_s: float, from_rest: bool) -> Stop | None:
    """part: to some time into this standstill, which begins at index rest; from_rest: from the one before."""
    time = part.t_s
    acceleration, pitch_rate, yaw_rate = _acceleration(part, rest)
    felt = integral(time, acceleration)
    speed = felt - felt[-1] + SENSOR_HEIGHT_M * np.radians(pitch_rate)  # backwards from standstill
    smooth = smoothed(acceleration, time)
    begin = _onset(smooth, time, rest)
    if begin is None:
        return None
    known = "integrated"
    fitted = fitted_speed(part, begin, speed, acceleration, delay_s)
    if fitted is not None:
        speed, known = fitted, "log"
    elif from_rest and not closes(float(speed[0]), float(time[rest] - time[0])):
        return None
    smooth = smoothed(np.gradient(speed, time), time)
    v = speed[begin:]
    below = np.flatnonzero(v <= 0.02 * v[0])
    if v[0] < MIN_SPEED_MPS or not len(below):
        return None
    end = begin + int(below[0])
    v, t = np.maximum(speed[begin : end + 1], 0.0), time[begin : end + 1]
    distance = integral(t, v)
    mfdd = mfdd_mps2(v, distance)
    if not MIN_MFDD_MPS2 <= mfdd < MAX_MFDD_MPS2:
        return None
    heading = integral(t, yaw_rate[begin : end + 1])
    side = np.radians(heading - _line(t, heading))
    # the last hundredths of the speed are lost in the fork's rebound: evenly on to zero
    tail = v[-1] / mfdd
    stop = Stop(
        float(t[0]),
        float(t[-1] + tail),
        float(v[0]),
        float(distance[-1] + 0.5 * v[-1] * tail),
        mfdd,
        float(-np.min(smooth[begin : end + 1])),
        float(np.max(np.abs(smoothed(np.gradient(smooth, time), time)[begin : end + 1]))),
        float(integral(t, v * np.sin(side))[-1]),
        float(heading[-1]),
        known,
    )
    if known == "integrated" and not plausible(stop.initial_speed_mps, stop.side_m, stop.heading_deg):
        return None
    return stop


def _acceleration(part: Channels, rest: int) -> tuple[Array, Array, Array]:
    """Of the sensor along the road in m/s2; pitch and yaw rate in deg/s; with what the standstill says of both."""
    time = part.t_s
    settled = int(np.searchsorted(time, time[rest] + SETTLE_S))
    still = slice(settled if settled < len(time) - 5 else rest, len(time))
    lean = np.radians(np.nan_to_num(part.lean_deg))
    pitch_rate = part.pitch_rate_dps - np.mean(part.pitch_rate_dps[still])
    yaw_rate = part.yaw_rate_dps - np.mean(part.yaw_rate_dps[still])
    level_pitch_rate = yaw_rate * np.sin(lean) + pitch_rate * np.cos(lean)
    turned = integral(time, np.radians(level_pitch_rate))
    stood = np.arcsin(np.clip(np.mean(part.forward_g[still]), -0.5, 0.5))
    pitch = stood + turned - np.mean(turned[still])
    return G * (part.forward_g - np.sin(pitch)), level_pitch_rate, yaw_rate


def _onset(smooth: Array, time: Array, rest: int) -> int | None:
    """Index at which the braking that ends in this standstill begins."""
    braking = -smooth[:rest]
    hard = np.flatnonzero(braking > 0.5 * MIN_MFDD_MPS2)
    if not len(hard):
        return None
    end = int(hard[-1])
    near = slice(int(np.searchsorted(time, time[end] - 2.0)), end + 1)
    level = float(np.percentile(braking[near], 75))
    weak = np.flatnonzero(braking[: end + 1] < max(ONSET_SHARE * level, 0.25))
    weak = weak[weak < end - int(0.3 / np.median(np.diff(time)))]  # a pause just before standing still is none
    begin = int(weak[-1]) if len(weak) else 0
    earliest = int(np.searchsorted(time, time[begin] - ONSET_S))
    while begin > earliest and braking[begin] > FAINT_SHARE * level:
        begin -= 1
    return begin


def _line(time: Array, heading: Array) -> float:
    """The direction ridden just before braking: that of its first tenth of a second."""
    return float(np.mean(heading[time <= time[0] + 0.1]))
