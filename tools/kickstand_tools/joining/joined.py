"""Joins a track to a ride: finds its time in the ride, or the reason why none fits, and writes the ride with it."""

import csv
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from kickstand.units import LOST_US, STANDARD_GRAVITY

from ..checks.log import check_log
from ..common.messages import OPPOSITE_SIGN, InputError, Message
from ..common.output import write_packed
from ..logs.log import Log, Source
from ..logs.reader import DIGITS, read_log, text_rows, write_log
from ..logs.source import File, Progress, name_of
from ..signals import Array, Bools, Ints, correlations, log_likelihood_ratio, moving_mean, peaks
from .motion import AROUND_S, STEP_S, BinMotion, cost_of_one_shift, fitted, motion
from .track import LONGEST_S, SLOWEST_MPS, STEPS, Course, Track, course, read_track, segments

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

_LONGER = "a longer ride with more bends is needed, or a track with a point every second"
_OTHER = "is it the track of another ride or another day?"

SPEED = "speed_mps"


@dataclass
class Match:
    """The time of a track in a ride."""

    # the track's time at the ride's first sample, in s since 1970, corrected for the receiver's delay, so positions
    # are where the bike is
    start_utc_s: float
    drift: float  # seconds per second that the ride's clock loses
    sigma_s: float  # standard deviation of start_utc_s
    correlation: float  # correlation of the changes of course, 0 to 1
    common_s: float  # time that ride and track have in common, in s

    def ride_s(self, utc_s: Array) -> Array:
        """Convert Universal Times to seconds since the ride's first sample."""
        return (utc_s - self.start_utc_s) * (1.0 - self.drift)


def match(motion: BinMotion, track: Track) -> Match:
    """Return the Match of a track with a ride. Callers put both names in front of the text of an InputError."""
    track = track.once_a_second()
    steps = course(track)
    parts = segments(steps)
    _check_turns(motion, steps)
    mirrored, rough = _rough_shifts(motion, steps)
    tried = (fitted(motion, steps, parts, shift_s) for shift_s in rough)
    fits = sorted((fit for fit in tried if fit is not None), key=lambda fit: -fit.evidence)
    if not fits:
        raise InputError(f"they have less than {LEAST_S:.0f} s of riding in common: {_OTHER}")
    best, *others = fits
    if best.evidence < LEAST_EVIDENCE or best.correlation < _LEAST_CORRELATION:
        if mirrored:
            raise InputError("the ride turns left where the track turns right: " + OPPOSITE_SIGN)
        if best.correlation > _ALIKE:
            common_s = best.segments * STEPS
            raise InputError(f"they have {common_s} s with too few bends in common to be sure: {_LONGER}")
        raise InputError(f"at no time does the ride turn like the track: {_OTHER}")
    distances_s = (abs(fit.shift_s - best.shift_s) for fit in others if fit.evidence > best.evidence - LEAST_LEAD)
    far_s = next((distance_s for distance_s in distances_s if distance_s > AROUND_S), None)
    if far_s is not None:
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


def _check_turns(motion: BinMotion, steps: Course) -> None:
    """Raise InputError if the ride or the track is too short or has too few bends."""
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
    # see correlations() for the shift at an index
    shifts = [(index - (len(of_ride) - 1)) * _GRID_S for index in indices]
    return bool(mirrored_ratio.max() > LEAST_EVIDENCE and mirrored_ratio.max() > 2.0 * likely.max()), shifts


def _changes_of_track(steps: Course) -> tuple[Array, Bools]:
    """Return the change of course within _SPAN_S every _GRID_S, as a leaning bike's gyro reads it; where known."""
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
    """Return the ride's rotation about its up within _SPAN_S every _GRID_S, and where it is known."""
    at_s, half = np.arange(0.0, motion.seconds, _GRID_S), _SPAN_S / 2.0
    edges_s = np.arange(len(motion.valid) + 1) * STEP_S
    turned = np.append(0.0, np.cumsum(motion.rate_dps @ motion.up)) * STEP_S
    change = np.interp(at_s + half, edges_s, turned) - np.interp(at_s - half, edges_s, turned)
    missing = np.append(0, np.cumsum(~motion.valid)) * STEP_S
    gap_s = np.interp(at_s + half, edges_s, missing) - np.interp(at_s - half, edges_s, missing)
    return change, (gap_s < 0.1 * _SPAN_S) & (at_s >= half) & (at_s <= motion.seconds - half)


@dataclass
class Joined:
    """A ride, its track, and their Match."""

    ride: File | Log
    track: Track
    match: Match
    own_speed: bool  # True if the log already has a speed, which is then kept
    notices: list[Message]

    @property
    def columns(self) -> dict[str, Array]:
        """The track's values by the names of the log's columns, each of shape (m)."""
        track = self.track
        values = {SPEED: track.speeds_mps(), "lat_deg": track.lat_deg, "lon_deg": track.lon_deg, "utc_s": track.utc_s}
        return {name: value for name, value in values.items() if name != SPEED or not self.own_speed}


def join_track(ride: Source, track: Path | str | Track, progress: Progress | None = None) -> Joined:
    """Find the time of a phone's or watch's track in a ride, from the yaw and the acceleration of ride and track.

    The clocks of ride and track may differ by any time, and drift. The ride needs neither a calibration nor a speed.
    The track is a .gpx or .fit file. Raises InputError if the track is another ride's, or if the match is not certain.

    >>> ride = simulate_ride("hills", seed=1, seconds=120.0)
    >>> course = np.cumsum(np.radians(ride.truth["yaw_rate_dps"])) / ride.rate_hz  # to the left of east
    >>> north, east = (np.cumsum(ride.truth["speed_mps"] * way(course)) / ride.rate_hz for way in (np.sin, np.cos))
    >>> lat, lon = np.degrees(north / 6_371_000.0)[::200], np.degrees(east / 6_371_000.0)[::200]
    >>> track = Track(1.7e9 + np.arange(len(lat)), lat, lon, np.full(len(lat), np.nan), "track")
    >>> round(join_track(Log.from_readings(ride.readings, ride.rate_hz), track).match.start_utc_s - 1.7e9)
    0
    """
    track = track if isinstance(track, Track) else read_track(track)
    checked = check_log(read_log(ride, progress=progress))
    moved = motion(checked)
    if moved.has_positions:
        raise InputError(f"{name_of(ride)} has positions already: join adds positions to a ride without any")
    try:
        best = match(moved, track)
    except InputError as error:
        raise InputError(f"{name_of(ride)}, {track.name}: {error}") from error
    # The lines of a file are written again. An open file has been read, and a stretch is written as a log.
    source = ride if isinstance(ride, (Path, str)) else checked.log
    return Joined(source, track, best, moved.has_speed, checked.notices)


def write_joined(out: Path | str, joined: Joined, progress: Progress | None = None) -> int:
    """Write the lines of the ride, with the track's values in the nearest rows. Returns the number of positions.

    The file is gzipped if its name ends in .gz, and written whole or not at all. Raises InputError.

    >>> import tempfile
    >>> log = Log([0.0, 0.01], [[0.0, 1.0, 0.0]] * 2, [[0.0, 0.0, 0.0]] * 2)
    >>> track = Track(*(np.array([value]) for value in (1.7e9, 48.0, 11.0, 9.0)), name="track")
    >>> joined = Joined(log, track, Match(1.7e9, 0.0, 0.1, 0.9, 0.0), own_speed=False, notices=[])
    >>> with tempfile.TemporaryDirectory() as directory:
    ...     count = write_joined(f"{directory}/ride.csv", joined)
    ...     print(Path(f"{directory}/ride.csv").read_text().splitlines()[1].partition(",0.000000,9")[2])
    .000,48.0000000,11.0000000,1700000000.000
    """
    out, columns, log = Path(out), joined.columns, read_log(joined.ride)
    rows, points = _nearest(log.time_us, np.rint(joined.match.ride_s(joined.track.utc_s) * 1e6).astype(np.int64))
    if not isinstance(joined.ride, (Path, str)):
        values = {name: _placed(column[points], rows, len(log.t_s)) for name, column in columns.items()}
        write_log(out, replace(log, **values))
        return len(points)
    ends = {}
    for row, values in zip(rows.tolist(), zip(*(column[points].tolist() for column in columns.values()))):
        ends[row] = ",".join([f"{value:.{DIGITS[name]}f}" for name, value in zip(columns, values)]).replace("nan", "")
    write_packed(out, _lines(joined.ride, list(columns), len(log.t_s), ends, progress))
    return len(points)


def _lines(
    file: Path | str, columns: list[str], count: int, ends: dict[int, str], progress: Progress | None
) -> Iterator[bytes]:
    """Yield the lines of a log of `count` samples with the new cells `ends`, by sample, at their end."""
    begin, empty = 0, "," * (len(columns) - 1)
    for names, lines in text_rows(file, progress):
        own = [k for k, name in enumerate(names) if name not in columns]
        if not begin:
            yield (",".join([*(names[k] for k in own), *columns]) + "\n").encode()
        lines = lines[: count - begin]  # without a last row that was cut
        if len(own) < len(names):
            cells = (next(csv.reader([line])) if '"' in line else line.split(",") for line in lines)
            lines = [",".join([row[k] for k in own]) for row in cells]
        yield "".join([f"{line},{ends.get(k, empty)}\n" for k, line in enumerate(lines, begin)]).encode()
        begin += len(lines)


def _nearest(time_us: Ints, at_us: Ints) -> tuple[Ints, Ints]:
    """Return rows, and the index of the point for each: points within the log's time, and not in a gap."""
    points = np.flatnonzero((at_us >= time_us[0]) & (at_us <= time_us[-1]))
    following = np.clip(np.searchsorted(time_us, at_us[points]), 1, max(len(time_us) - 1, 1))
    if len(time_us) < 2:
        return np.zeros(len(points), dtype=int), points
    rows = following - (at_us[points] - time_us[following - 1] < time_us[following] - at_us[points])
    near = np.abs(time_us[rows] - at_us[points]) <= LOST_US
    rows, last = np.unique(rows[near][::-1], return_index=True)  # if a row has two points, use the later point
    return rows, points[near][::-1][last]


def _placed(values: Array, rows: Ints, count: int) -> Array:
    placed = np.full(count, np.nan)
    placed[rows] = values
    return placed
