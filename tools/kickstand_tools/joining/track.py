"""The track of a phone or a watch, its GPX or FIT file, and its course (the direction of each step, if known).

Course and speed are compared with a ride in segments of half a minute. Within a segment, only changes count: the mean
and the trend are subtracted. This removes the gyro's residual bias, the initial direction of the ride, and hills.
"""

import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np

from ..common.installation import extra
from ..common.messages import InputError, cause
from ..logs.log import Table
from ..logs.source import Progress, open_input
from ..signals import Array, Bools, distance_m, intervals

LONGEST_S = 6.0  # longest time between two points of a course; watches write points this far apart on straights
SLOWEST_MPS = 2.5  # in slower steps, the errors of the positions dominate
FASTEST_MPS = 100.0  # a faster step is a jump of the receiver's position
STEP_ERROR_M = 1.0  # standard deviation of a step across its direction, for a phone's receiver and one second
COURSE_ERROR_DEG = 4.0  # standard deviation of other errors, due to the gyro's scale factor and smoothed positions
_OFTEN_S = 0.7
_AROUND = 2  # number of points on each side from which a speed is computed
STEPS = 30  # largest number of steps in a segment
_FEWEST_STEPS = 8  # least number of steps in a segment

_DEGREES = 180.0 / 2**31  # one unit of a FIT file ("semicircle"), in degrees
_FEWEST_POINTS = 30  # least number of points of a track
# largest file; a day with a fix per second has 20 million, and parsing takes ten times as much memory
_MOST_BYTES = 50_000_000

# time in s since 1970, latitude and longitude in degrees, speed in m/s or NaN
Point = tuple[float, float, float, float]

_FIT_FIELDS = ("timestamp", "position_lat", "position_long", "speed", "enhanced_speed")


@dataclass(eq=False)
class Track(Table):
    """n points in chronological order."""

    utc_s: Array  # s since 1970, increasing
    lat_deg: Array
    lon_deg: Array
    speed_mps: Array  # from the file, NaN if missing
    name: str  # the file's name

    def speeds_mps(self) -> Array:
        """Return the file's speeds, shape (n), or without any speed the mean speeds over the neighbouring points.

        Such a speed is NaN over a jump or a gap, or if it is not larger than the positions' errors.
        """
        if np.any(np.isfinite(self.speed_mps)):
            return self.speed_mps
        speed = np.full(len(self.utc_s), np.nan)
        if len(speed) <= 2 * _AROUND:
            return speed
        way_m = np.append(0.0, np.cumsum(np.hypot(*self.steps_m())))
        span_s = self.utc_s[2 * _AROUND :] - self.utc_s[: -2 * _AROUND]
        mean = (way_m[2 * _AROUND :] - way_m[: -2 * _AROUND]) / span_s
        valid = (span_s <= LONGEST_S) & (mean > SLOWEST_MPS) & (mean < FASTEST_MPS)
        speed[_AROUND:-_AROUND] = np.where(valid, mean, np.nan)
        return speed

    def once_a_second(self) -> "Track":
        """Return the track with at most one point per second: errors of closer points exceed the course's change."""
        if len(self.utc_s) < 2 or np.median(np.diff(self.utc_s)) > _OFTEN_S:
            return self
        first = np.unique(np.floor(self.utc_s - self.utc_s[0]), return_index=True)[1]
        return Track(*(values[first] for values in self.columns().values()), name=self.name)

    def steps_m(self) -> tuple[Array, Array]:
        """Return how far each point is east and north of the previous point, in metres, two arrays of shape (n - 1)."""
        return distance_m(self.lat_deg[:-1], self.lon_deg[:-1], self.lat_deg[1:], self.lon_deg[1:])


@dataclass
class Course:
    """m steps between the m + 1 points of a track. All arrays have shape (m)."""

    begin_s: Array  # begin of each step, in s since the track's first point
    end_s: Array  # end of each step, in s since the track's first point
    sigma_deg: Array  # standard deviation of the course of a good step
    speed_mps: Array  # the step's length divided by its duration
    good: Bools  # False for a step that is too slow, a gap or a jump
    turn_deg: Array  # change of the course from the previous step, positive to the left; 0 unless both steps are good


def course(track: Track) -> Course:
    """Return the Course of a track of at least two points."""
    since_s = track.utc_s - track.utc_s[0]
    east, north = track.steps_m()
    step_s, length_m = np.diff(since_s), np.hypot(east, north)
    speed = length_m / step_s
    good = (speed > SLOWEST_MPS) & (speed < FASTEST_MPS) & (step_s <= LONGEST_S)
    direction = np.degrees(np.arctan2(north, east))
    turn = (np.diff(direction, prepend=direction[:1]) + 180.0) % 360.0 - 180.0
    consecutive = good & np.append(False, good[:-1])
    sigma = np.hypot(np.degrees(STEP_ERROR_M / np.maximum(length_m, 0.1)), COURSE_ERROR_DEG)
    turn = np.where(consecutive, turn, 0.0)
    return Course(since_s[:-1], since_s[1:], sigma_deg=sigma, speed_mps=speed, good=good, turn_deg=turn)


@dataclass
class Segments(Table):
    """p segments of up to STEPS successive good steps. All arrays are (p, STEPS), with weights of 0 where unused.

    Mean and trend of turned_deg and speed_mps are subtracted.
    """

    begin_s: Array  # begin of each step, in s since the track's first point
    end_s: Array  # end of each step, in s since the track's first point
    turned_deg: Array  # course of each step minus the course of the segment's first step, > 0 to the left
    course_weight: Array  # weight of turned_deg, in 1/deg2
    speed_mps: Array  # speed in each step
    speed_weight: Array  # weight of speed_mps, 1 or 0

    @property
    def middle_s(self) -> Array:
        return (self.begin_s + self.end_s) / 2.0


def segments(course: Course) -> Segments:
    """Split a course into segments of at most STEPS steps, without the steps that are not good."""
    rows = [
        np.arange(start, min(start + STEPS, end))
        for begin, end in intervals(course.good)
        for start in range(begin, end, STEPS)
    ]
    rows = [row for row in rows if len(row) >= _FEWEST_STEPS]
    index, valid = np.zeros((len(rows), STEPS), dtype=int), np.zeros((len(rows), STEPS))
    # A short segment repeats its last step, with a weight of 0
    for k, row in enumerate(rows):
        index[k] = np.append(row, np.full(STEPS - len(row), row[-1]))
        valid[k, : len(row)] = 1.0
    turn = course.turn_deg[index] * valid
    turn[:, :1] = 0.0  # the courses are relative to the first step
    weight = valid / course.sigma_deg[index] ** 2
    begin_s, end_s = course.begin_s[index], course.end_s[index]
    result = Segments(begin_s, end_s, np.cumsum(turn, axis=1), weight, course.speed_mps[index], valid)
    result.turned_deg = without_trend(result.turned_deg, weight, result.middle_s)
    result.speed_mps = without_trend(result.speed_mps, valid, result.middle_s)
    return result


def without_trend(values: Array, weight: Array, at_s: Array) -> Array:
    """Subtract from each row of `values`, shape (p, STEPS), the straight line that fits this row best."""
    total = np.maximum(weight.sum(axis=1, keepdims=True), 1e-12)
    since = at_s - (weight * at_s).sum(axis=1, keepdims=True) / total
    mean = (weight * values).sum(axis=1, keepdims=True) / total
    spread = np.maximum((weight * since * since).sum(axis=1, keepdims=True), 1e-12)
    return values - mean - (weight * since * values).sum(axis=1, keepdims=True) / spread * since


def read_track(path: Path | str, progress: Progress | None = None) -> Track:
    """Read a .gpx or .fit file. Raises InputError.

    Points without a time or a position are left out. If several points have the same time, the first is kept.

    >>> import tempfile
    >>> point = '<trkpt lat="48.1" lon="11.{0:02}"><time>2026-05-17T09:30:{0:02}Z</time></trkpt>'
    >>> body = "".join(point.format(k) for k in range(40))
    >>> with tempfile.TemporaryDirectory() as directory:
    ...     gpx = Path(directory, "track.gpx")
    ...     _ = gpx.write_text(f'<gpx version="1.1" creator="me"><trk><trkseg>{body}</trkseg></trk></gpx>')
    ...     len(read_track(gpx).utc_s)
    40
    """
    path = Path(path)
    reader = _READERS.get(path.suffix.lower())
    if reader is None:
        raise InputError(f"{path}: the name of a track ends in .gpx or .fit: export the track as one of these")
    try:
        with open_input(path) as file:
            size = file.seek(0, 2)
        if size > _MOST_BYTES:
            raise InputError(f"{path} is too large for a track: over {_MOST_BYTES / 1e6:.0f} MB: export a part of it")
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # fitdecode warns about each line of a damaged file
            points = list(reader(path, progress))
    except InputError:
        raise
    except OSError as error:
        raise InputError(f"{path} cannot be read: {cause(error)}") from error
    except Exception as error:  # the libraries raise many kinds of errors for damaged files
        raise InputError(f"{path} is damaged, or in another format than its name says: {_words(error)}") from error
    table = np.array(points, dtype=float).reshape(-1, 4)
    utc_s, lat_deg, lon_deg, _ = table.T
    table = table[np.isfinite(utc_s) & (np.abs(lat_deg) <= 90.0) & (np.abs(lon_deg) <= 180.0)]  # False for NaN
    if not len(table):
        raise InputError(f"{path} has no point with a position and a time: give a recorded track, not a planned route")
    _, first_of_time = np.unique(table[:, 0], return_index=True)
    table = table[first_of_time]
    if len(table) < _FEWEST_POINTS:
        raise InputError(f"{path} has {len(table)} points with a time: at least {_FEWEST_POINTS} are needed")
    utc_s, lat_deg, lon_deg, speed = table.T
    speed = np.where((speed >= 0.0) & (speed <= FASTEST_MPS), speed, np.nan)
    return Track(utc_s, lat_deg, lon_deg, speed, str(path))


def _gpx(path: Path, progress: Progress | None) -> Iterator[Point]:
    try:
        import gpxpy
        import gpxpy.gpx
    except ImportError as error:
        raise InputError("GPX files need gpxpy: " + extra("rides")) from error
    content = path.read_bytes()
    try:
        document = gpxpy.parse(content)
    except (gpxpy.gpx.GPXException, ValueError, LookupError) as error:
        raise InputError(f"{path} is not a GPX file, or its copy is incomplete: {_words(error)}") from error
    for track in document.tracks:
        for segment in track.segments:
            for point in segment.points:
                if point.time is not None:
                    yield _utc_s(point.time), point.latitude, point.longitude, _gpx_speed(point)
    if progress:
        progress(len(content), len(content))


def _gpx_speed(point: Any) -> float:
    """Return the speed of a point in m/s, from GPX 1.0's element, or from an extension of GPX 1.1 (e.g. Garmin's)."""
    if point.speed is not None:
        return float(point.speed)
    for extension in point.extensions:
        for element in extension.iter():
            if isinstance(element.tag, str) and element.tag.rpartition("}")[2].lower() == "speed":
                try:
                    return float(element.text or "nan")
                except ValueError:
                    return np.nan
    return np.nan


def _fit(path: Path, progress: Progress | None) -> Iterator[Point]:
    try:
        import fitdecode
    except ImportError as error:
        raise InputError("FIT files need fitdecode: " + extra("rides")) from error
    total = path.stat().st_size
    try:
        with open(path, "rb") as file, fitdecode.FitReader(file, check_crc=fitdecode.CrcCheck.WARN) as frames:
            for frame in frames:
                if not isinstance(frame, fitdecode.FitDataMessage) or frame.name != "record":
                    continue
                time, lat, lon, plain, speed = (frame.get_value(name, fallback=None) for name in _FIT_FIELDS)
                speed = plain if speed is None else speed
                if isinstance(time, datetime) and isinstance(lat, int) and isinstance(lon, int):
                    mps = float(speed) if isinstance(speed, (int, float)) else np.nan
                    yield _utc_s(time), lat * _DEGREES, lon * _DEGREES, mps
                if progress:
                    progress(min(file.tell(), total), total)
    except (fitdecode.FitError, TypeError, ValueError) as error:
        raise InputError(f"{path} is not a FIT file, or it is damaged: {_words(error)}") from error


def _words(error: Exception) -> str:
    """Return the beginning of a library's message, which may quote a whole file."""
    return ascii(" ".join(str(error).split())[:60])[1:-1] or type(error).__name__


def _utc_s(time: datetime) -> float:
    """Return the seconds since 1970. A time without a zone is UTC, as in both formats."""
    return (time if time.tzinfo else time.replace(tzinfo=UTC)).timestamp()


_READERS: dict[str, Callable[[Path, Progress | None], Iterator[Point]]] = {".gpx": _gpx, ".fit": _fit}
