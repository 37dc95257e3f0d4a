"""Stops, as a brake test has them: initial speed, distance, mean fully developed deceleration.

UN Regulation No. 13, Annex 4, paragraph 1.1.2: with the initial speed v0 when braking begins, vb = 0.8 v0 and
ve = 0.1 v0 in km/h, and sb and se the distances in metres from there to vb and ve,

    dm = (vb^2 - ve^2) / (25.92 (se - sb))   in m/s2.

Standing still, the force says how the road slopes, the gyro how far it is off. From there speed and pitch are
integrated backwards, so that the dive of the fork is not taken for braking:

    dq/dt = w_y sin t - w_x cos t,   dv/dt = f_z - g sin q       (as in kickstand.lean_filter)

Where the log has a speed, scale, slope and delay of the two are fitted to each other over the stop: a speed once
a second has two or three values in a hard stop, which alone would tell nothing of its shape.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .channels import Array, Channels
from .thin import spacing_s

G = 9.80665
RATE_S = 0.02  # of the samples these functions want, at most
MIN_SPEED_MPS = 10.0 / 3.6
MIN_MFDD_MPS2 = 1.0
LONGEST_S = 60.0
STOPPED_MPS = 0.3  # a speed that counts as standing; satellites never quite say 0
REST_S = 2.5  # of the standstill that are looked at,
SETTLE_S = 0.5  # but for its beginning, when the fork comes up again
LEAD_S = 4.0  # of speed before the braking that are taken into the fit
SMOOTH_S = 0.2
QUIET_S = 1.0  # without a speed: what stands shakes for so long by no more than this share of what it does riding,
QUIET_SHARE = 0.3  # of its turning; and of its jolts up and down, with the engine's:
QUIET_UP_SHARE = 0.5
ENGINE_S = 0.1  # an idling engine is quicker
STILL_DPS, STILL_G = 1.0, 0.01  # turns no faster, and is as steep at the end as at the beginning
ONSET_SHARE, FAINT_SHARE = 0.15, 0.04  # of the braking: it has begun; it had not
ONSET_S = 0.6  # from the one to the other, at most

DELAYS_S = np.arange(-0.5, 1.51, 0.05)  # of a speed, that are tried
ENOUGH_SPEEDS, ENOUGH_CHANGE_MPS = 30, 0.5

# Above the point about which a bike pitches, in the height of its wheels' hubs: the nose going down, a sensor under
# the seat goes forward.
SENSOR_HEIGHT_M = 0.65

# One sigma, of what is fitted and of a speed
SIGMA_SCALE, SIGMA_SLOPE_MPS2, SIGMA_DELAY_S, SIGMA_SPEED_MPS = 0.01, 0.05, 0.05, 0.05
SIGMA_WALK_MPS2, KNOT_S = 0.1, 0.5  # per square root of a second


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
        if start - first > 10 and last - start > 10:
            stop = _stop(ride.part(slice(first, last)), start - first, delay_s)
            if stop:
                found.append(stop)
        after = int(end)
    return found


def mfdd_mps2(speed_mps: Array, distance_m: Array) -> float:
    """dm above. speed_mps: falling, from the initial speed to at most a tenth of it; distance_m: to each."""
    vb, ve = 0.8 * speed_mps[0], 0.1 * speed_mps[0]
    falling = np.minimum.accumulate(speed_mps)
    sb, se = np.interp([-vb, -ve], -falling, distance_m)
    return float((3.6**2 * (vb * vb - ve * ve)) / (25.92 * (se - sb)))


def standing(ride: Channels) -> NDArray[np.bool_]:
    """True where the bike stands still: by the log's own speed, or where there is none by how little it shakes."""
    there = np.flatnonzero(~np.isnan(ride.speed_mps))
    if len(there):
        latest = there[np.clip(np.searchsorted(there, np.arange(len(ride.t_s)), side="right") - 1, 0, None)]
        return ride.speed_mps[latest] < STOPPED_MPS
    second = max(4, round(QUIET_S / spacing_s(ride)))
    if len(ride.t_s) < 2 * second:
        return np.zeros(len(ride.t_s), dtype=bool)
    pitch, pitch_spread = _window(_smoothed(ride.pitch_rate_dps, ride.t_s, ENGINE_S), second)
    yaw, yaw_spread = _window(_smoothed(ride.yaw_rate_dps, ride.t_s, ENGINE_S), second)
    forward, _ = _window(ride.forward_g, second // 2)
    quiet = (pitch_spread < QUIET_SHARE * np.percentile(pitch_spread, 75)) & (
        yaw_spread < QUIET_SHARE * np.percentile(yaw_spread, 75)
    )
    _, up_spread = _window(ride.up_g, second)
    quiet &= up_spread < QUIET_UP_SHARE * np.percentile(up_spread, 75)
    quiet &= (np.abs(pitch) < STILL_DPS) & (np.abs(yaw) < STILL_DPS)
    quiet &= np.abs(forward[second - second // 2 :][: len(quiet)] - forward[: len(quiet)]) < STILL_G
    still = np.zeros(len(ride.t_s), dtype=bool)
    for shift in range(second):  # every sample of a quiet window
        still[shift : shift + len(quiet)] |= quiet
    return still


def _window(values: Array, n: int) -> tuple[Array, Array]:
    """Mean and standard deviation of each n values in a row."""
    middle = float(np.mean(values))  # taken off, or the squares of a large one would hide the spread
    values = values - middle
    first, second = (np.cumsum(np.concatenate(([0.0], x))) for x in (values, values * values))
    mean = (first[n:] - first[:-n]) / n
    return mean + middle, np.sqrt(np.maximum(0.0, (second[n:] - second[:-n]) / n - mean * mean))


def _stop(part: Channels, rest: int, delay_s: float) -> Stop | None:
    """part: from after the standstill before to some time into this one, which begins at index rest."""
    time = part.t_s
    acceleration, pitch_rate, yaw_rate = _acceleration(part, rest)
    felt = _integral(time, acceleration)
    speed = felt - felt[-1] + SENSOR_HEIGHT_M * np.radians(pitch_rate)  # backwards from standstill
    smooth = _smoothed(acceleration, time)
    begin = _onset(smooth, time, rest)
    if begin is None:
        return None
    known = "integrated"
    fitted = _fitted(part, begin, speed, acceleration, delay_s)
    if fitted is not None:
        speed, known = fitted, "log"
    smooth = _smoothed(np.gradient(speed, time), time)
    v = speed[begin:]
    below = np.flatnonzero(v <= 0.02 * v[0])
    if v[0] < MIN_SPEED_MPS or not len(below):
        return None
    end = begin + int(below[0])
    v, t = np.maximum(speed[begin : end + 1], 0.0), time[begin : end + 1]
    distance = _integral(t, v)
    mfdd = mfdd_mps2(v, distance)
    if not mfdd >= MIN_MFDD_MPS2:
        return None
    heading = _integral(t, yaw_rate[begin : end + 1])
    side = np.radians(heading - _line(t, heading, v))
    # the last hundredths of the speed are lost in the fork's rebound: evenly on to zero
    tail = v[-1] / mfdd
    return Stop(
        float(t[0]),
        float(t[-1] + tail),
        float(v[0]),
        float(distance[-1] + 0.5 * v[-1] * tail),
        mfdd,
        float(-np.min(smooth[begin : end + 1])),
        float(np.max(np.abs(_smoothed(np.gradient(smooth, time), time)[begin : end + 1]))),
        float(_integral(t, v * np.sin(side))[-1]),
        float(heading[-1]),
        known,
    )


def _acceleration(part: Channels, rest: int) -> tuple[Array, Array, Array]:
    """Of the sensor along the road in m/s2; pitch and yaw rate in deg/s; with what the standstill says of both."""
    time = part.t_s
    settled = int(np.searchsorted(time, time[rest] + SETTLE_S))
    still = slice(settled if settled < len(time) - 5 else rest, len(time))
    lean = np.radians(np.nan_to_num(part.lean_deg))
    pitch_rate = part.pitch_rate_dps - np.mean(part.pitch_rate_dps[still])
    yaw_rate = part.yaw_rate_dps - np.mean(part.yaw_rate_dps[still])
    level_pitch_rate = yaw_rate * np.sin(lean) + pitch_rate * np.cos(lean)
    turned = _integral(time, np.radians(level_pitch_rate))
    stood = np.arcsin(np.clip(np.mean(part.forward_g[still]), -0.5, 0.5))
    pitch = stood + turned - np.mean(turned[still])
    return G * (part.forward_g - np.sin(pitch)), level_pitch_rate, yaw_rate


def speed_delay_s(ride: Channels) -> float:
    """How late the log's speed is, as that of satellites is: where its changes best fit those felt. 0 if unknown."""
    there = np.flatnonzero(~np.isnan(ride.speed_mps))
    if len(there) < ENOUGH_SPEEDS:
        return 0.0
    second = np.floor(ride.t_s[there])
    there = there[np.flatnonzero(np.diff(second, prepend=-1.0))]  # one a second
    time, changes = ride.t_s[there], np.diff(ride.speed_mps[there])
    felt = _integral(ride.t_s, G * ride.forward_g)
    if len(there) < ENOUGH_SPEEDS or np.std(changes) < ENOUGH_CHANGE_MPS:
        return 0.0
    left = []
    for delay in DELAYS_S:
        pushes = np.diff(np.interp(time - delay, ride.t_s, felt))
        left.append(1.0 - np.corrcoef(pushes, changes)[0, 1] ** 2)
    best = int(np.argmin(left))
    if best in (0, len(left) - 1):
        return 0.0
    before, least, after = left[best - 1 : best + 2]  # a parabola through these
    return float(DELAYS_S[best] + 0.5 * (before - after) / (before - 2.0 * least + after) * (DELAYS_S[1] - DELAYS_S[0]))


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


def _fitted(
    part: Channels, begin: int, speed: Array, acceleration: Array, delay_s: float
) -> Array | None:
    """A speed that agrees with the log's; None if that has none there.

    Least squares with what was known before: log = (1 + scale) v + integral of slope to the end - delay dv/dt,
    where slope, what the force has of hill and dive that the gyro has not told, is a random walk back in time
    from nearly none at standstill.
    """
    time = part.t_s
    values = np.flatnonzero(~np.isnan(part.speed_mps))
    wanted = np.searchsorted(time, time[values] - delay_s - 1e-6).clip(0, len(time) - 1)  # when they were so
    values, wanted = (these[time[wanted] >= time[begin] - LEAD_S] for these in (values, wanted))
    if len(wanted) < 2 or wanted[-1] < begin:
        return None
    knots = np.arange(float(time[-1]), float(min(time[wanted[0]], time[begin])) - KNOT_S, -KNOT_S)
    hats = np.column_stack([np.interp(time, knots[::-1], row[::-1]) for row in np.eye(len(knots))])
    pushed = np.column_stack([_integral(time, hat) for hat in hats.T])
    pushed = pushed[-1] - pushed  # from each sample to the end
    terms = np.column_stack((speed, pushed, -_smoothed(acceleration, time)))[wanted]
    error = part.speed_mps[values] - speed[wanted]
    prior = np.zeros((len(knots) + 2, len(knots) + 2))
    prior[0, 0], prior[-1, -1] = 1.0 / SIGMA_SCALE, 1.0 / SIGMA_DELAY_S
    prior[1, 1] = 1.0 / SIGMA_SLOPE_MPS2
    for k in range(2, len(knots) + 1):
        prior[k, k], prior[k, k - 1] = np.array([1.0, -1.0]) / (SIGMA_WALK_MPS2 * KNOT_S**0.5)
    weighted = np.vstack((terms / SIGMA_SPEED_MPS, prior))
    known = np.concatenate((error / SIGMA_SPEED_MPS, np.zeros(len(prior))))
    found = np.linalg.lstsq(weighted, known, rcond=None)[0]
    scale, slope = 1.0 + found[0], found[1:-1]
    return scale * speed + pushed @ slope


def _integral(time: Array, values: Array) -> Array:
    """From the first sample to each, by trapezia."""
    steps = np.diff(time) * (values[1:] + values[:-1]) / 2.0
    return np.concatenate(([0.0], np.cumsum(steps)))


def _smoothed(values: Array, time: Array, over_s: float = SMOOTH_S) -> Array:
    """Mean over so much time around each sample."""
    half = max(0, round(0.5 * over_s / float(np.median(np.diff(time)))))
    padded = np.concatenate((np.full(half, values[0]), values, np.full(half, values[-1])))
    return np.convolve(padded, np.full(2 * half + 1, 1.0 / (2 * half + 1)), mode="valid")


def _line(time: Array, heading: Array, speed: Array) -> float:
    """The direction ridden just before braking: that of its first tenth of a second."""
    return float(np.mean(heading[time <= time[0] + 0.1]))
