"""Finds the time of a track in a ride: the best of all shifts between their clocks, or the reason why none fits."""

from dataclasses import dataclass

import numpy as np
from kickstand.units import STANDARD_GRAVITY

from ..common.messages import OPPOSITE_SIGN, InputError
from ..signals import Array, Bools, correlations, log_likelihood_ratio, moving_mean, peaks
from .fit import AROUND_S, TrackFit, cost_of_one_shift, fitted
from .motion import STEP_S, BinMotion
from .track import LONGEST_S, SLOWEST_MPS, STEPS, Course, Track, course, segments

_GRID_S = 0.5
_SPAN_S = 4.0  # rough shifts are found from changes of course over this time
_APART_S = 10.0  # least distance between two rough shifts
_CANDIDATES = 5
_WORTH = 0.1  # a rough shift is tried if it has at least this share of the largest evidence
LEAST_S = 60.0  # least time of riding in common
_LEAST_TURN_DEG = 360.0  # least sum of the changes of course
LEAST_EVIDENCE = 15.0  # least evidence of a match; tracks of other rides reach 9
LEAST_LEAD = 6.0  # the evidence of the best shift must exceed that of any other shift by this
_MOST_APART = 3.0
MOST_DRIFT = 400e-6  # largest drift; a crystal in the heat of an engine has 100e-6
_ALIKE = 0.9  # a higher correlation is not due to chance, but may come from another, similar bend
_LEAST_CORRELATION = 0.6
_MOST_SIGMA_S = 0.3


@dataclass
class Match:
    """The time of a track in a ride.

    start_utc_s: the track's time at the ride's first sample, in s since 1970. This time is corrected for the receiver's
        delay, so positions are where the bike is.
    drift: seconds per second that the ride's clock loses.
    sigma_s: standard deviation of start_utc_s.
    correlation: correlation of the changes of course, 0 to 1.
    common_s: time that ride and track have in common, in s.
    """

    start_utc_s: float
    drift: float
    sigma_s: float
    correlation: float
    common_s: float

    def ride_s(self, utc_s: Array) -> Array:
        """Convert Universal Times to seconds since the ride's first sample."""
        return (utc_s - self.start_utc_s) * (1.0 - self.drift)


def match(motion: BinMotion, track: Track) -> Match:
    """The Match of a track with a ride. Raises InputError if the track does not belong to the ride, or if this is
    uncertain. Callers put both names in front of the error's text."""
    track = track.once_a_second()
    steps = course(track)
    parts = segments(steps)
    _check_turns(motion, steps)
    fits: list[TrackFit] = []
    mirrored, rough = _rough_shifts(motion, steps)
    for shift_s in rough:
        fit = fitted(motion, steps, parts, shift_s)
        if fit is not None:
            fits.append(fit)
    if not fits:
        raise InputError(f"they have less than {LEAST_S:.0f} s of riding in common: {_OTHER}")
    fits.sort(key=lambda fit: -fit.evidence)
    best = fits[0]
    if best.evidence < LEAST_EVIDENCE or best.correlation < _LEAST_CORRELATION:
        if mirrored:
            raise InputError("the ride turns left where the track turns right: " + OPPOSITE_SIGN)
        if best.correlation > _ALIKE:
            common_s = best.segments * STEPS
            raise InputError(f"they have {common_s} s with too few bends in common to be sure: {_LONGER}")
        raise InputError(f"at no time does the ride turn like the track: {_OTHER}")
    others = [fit for fit in fits if abs(fit.shift_s - best.shift_s) > AROUND_S]
    if others and others[0].evidence > best.evidence - LEAST_LEAD:
        far_s = abs(others[0].shift_s - best.shift_s)
        raise InputError(f"the track fits at two times, {far_s:.0f} s apart, as its bends are alike: {_LONGER}")
    if abs(best.drift) > MOST_DRIFT or cost_of_one_shift(motion, steps, parts, best) > _MOST_APART:
        raise InputError(
            "the ride turns like the track, but at other times: it is the same road on another day, or other bends "
            "that are alike"
        )
    if best.sigma_s > _MOST_SIGMA_S:
        raise InputError(f"the track fits only to {best.sigma_s:.1f} s, not to {_MOST_SIGMA_S} s: {_LONGER}")
    start_utc_s = float(track.utc_s[0]) + best.shift_s
    result = Match(start_utc_s, best.drift, best.sigma_s, best.correlation, 0.0)
    begin_s, end_s = result.ride_s(track.utc_s[[0, -1]])
    result.common_s = float(min(end_s, motion.seconds) - max(begin_s, 0.0))
    return result


_LONGER = "a longer ride with more bends is needed, or a track with a point every second"
_OTHER = "is it the track of another ride or another day?"


def _check_turns(motion: BinMotion, steps: Course) -> None:
    if motion.seconds < LEAST_S:
        raise InputError(f"the ride lasts {motion.seconds:.0f} s: at least {LEAST_S:.0f} s with bends are needed")
    moving_s = float((steps.end_s - steps.begin_s)[steps.good].sum())
    if moving_s < LEAST_S:
        raise InputError(
            f"the track moves for {moving_s:.0f} s only, faster than {SLOWEST_MPS} m/s and with a point at least every "
            f"{LONGEST_S:.0f} s: {LEAST_S:.0f} s are needed"
        )
    yaw_dps = moving_mean(motion.rate_dps @ motion.up, round(1.0 / STEP_S))
    turned_deg = float(np.abs(yaw_dps[np.abs(yaw_dps) > 3.0]).sum()) * STEP_S
    if turned_deg < _LEAST_TURN_DEG:
        raise InputError(f"the ride turns by {turned_deg:.0f} degrees in all: too few bends to match a track")


def _rough_shifts(motion: BinMotion, steps: Course) -> tuple[bool, list[float]]:
    """Return True if the ride would fit better with the opposite sign of yaw, and the shifts that fit best."""
    of_track, track_good = _changes_of_track(steps)
    of_ride, ride_good = _changes_of_ride(motion)
    correlation, count = correlations(of_track, track_good, of_ride, ride_good)
    correlation = np.where(count * _GRID_S >= LEAST_S / 2.0, correlation, 0.0)
    likely = log_likelihood_ratio(correlation, count, _GRID_S / _SPAN_S)
    mirrored_ratio = log_likelihood_ratio(-correlation, count, _GRID_S / _SPAN_S)
    indices = [p for p in peaks(likely, round(_APART_S / _GRID_S), _CANDIDATES) if likely[p] > _WORTH * likely.max()]
    shifts = [(index - (len(of_ride) - 1)) * _GRID_S for index in indices]
    return bool(mirrored_ratio.max() > LEAST_EVIDENCE and mirrored_ratio.max() > 2.0 * likely.max()), shifts


def _changes_of_track(steps: Course) -> tuple[Array, Bools]:
    """Return two arrays with a value every _GRID_S: the change of course within _SPAN_S, and True where it is known.

    The change is in degrees, as the gyro of a leaning bike would measure it."""
    middle_s, at_s = (steps.begin_s + steps.end_s) / 2.0, np.arange(0.0, steps.end_s[-1], _GRID_S)
    half = _SPAN_S / 2.0
    heading = np.cumsum(steps.turn_deg)
    change = np.interp(at_s + half, middle_s, heading) - np.interp(at_s - half, middle_s, heading)
    speed = np.interp(at_s, middle_s, np.where(steps.good, steps.speed_mps, 0.0))
    bad = np.append(0, np.cumsum(~steps.good))
    first, last = np.searchsorted(steps.end_s, at_s - half), np.searchsorted(steps.begin_s, at_s + half)
    valid = (bad[last] == bad[first]) & (at_s >= half) & (at_s <= steps.end_s[-1] - half)
    return change * np.cos(np.arctan(speed * np.radians(change / _SPAN_S) / STANDARD_GRAVITY)), valid


def _changes_of_ride(motion: BinMotion) -> tuple[Array, Bools]:
    """Return two arrays with a value every _GRID_S: the rotation of the ride about its up within _SPAN_S, in degrees,
    and True where it is known."""
    at_s, half = np.arange(0.0, motion.seconds, _GRID_S), _SPAN_S / 2.0
    edges_s = np.arange(len(motion.valid) + 1) * STEP_S
    turned = np.append(0.0, np.cumsum(motion.rate_dps @ motion.up)) * STEP_S
    change = np.interp(at_s + half, edges_s, turned) - np.interp(at_s - half, edges_s, turned)
    missing = np.append(0, np.cumsum(~motion.valid)) * STEP_S
    gap_s = np.interp(at_s + half, edges_s, missing) - np.interp(at_s - half, edges_s, missing)
    return change, (gap_s < 0.1 * _SPAN_S) & (at_s >= half) & (at_s <= motion.seconds - half)
