"""Reads tracks of phones and watches: GPX and FIT."""

import warnings
from collections.abc import Callable, Iterator
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np

from ..common.installation import extra
from ..common.messages import InputError, cause
from ..logs.source import Progress, open_input
from .track import FASTEST_MPS, Track

_DEGREES = 180.0 / 2**31  # one unit of a FIT file ("semicircle"), in degrees
_FEWEST = 30  # least number of points of a track
# largest file; a day with a fix per second has 20 million, and parsing takes ten times as much memory
_MOST_BYTES = 50_000_000

# time in s since 1970, latitude and longitude in degrees, speed in m/s or NaN
Point = tuple[float, float, float, float]


def read_track(path: Path | str, progress: Progress | None = None) -> Track:
    """Read a .gpx or .fit file. progress: called with the bytes read and the bytes of the file. Raises InputError.

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
    on_earth = (np.abs(table[:, 1]) <= 90.0) & (np.abs(table[:, 2]) <= 180.0)
    table = table[np.all(np.isfinite(table[:, :3]), axis=1) & on_earth]
    if not len(table):
        raise InputError(f"{path} has no point with a position and a time: give a recorded track, not a planned route")
    table = table[np.unique(table[:, 0], return_index=True)[1]]
    if len(table) < _FEWEST:
        raise InputError(f"{path} has {len(table)} points with a time: at least {_FEWEST} are needed")
    speed = table[:, 3]
    speed = np.where((speed >= 0.0) & (speed <= FASTEST_MPS), speed, np.nan)
    return Track(table[:, 0], table[:, 1], table[:, 2], speed, str(path))


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
    """The speed of a point, m/s. GPX 1.0 has an element for the speed; in GPX 1.1 the speed is in an extension,
    Garmin's or another."""
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
    """The beginning of a library's message, which may quote a whole file."""
    return ascii(" ".join(str(error).split())[:60])[1:-1] or type(error).__name__


_FIT_FIELDS = ("timestamp", "position_lat", "position_long", "speed", "enhanced_speed")


def _utc_s(time: datetime) -> float:
    """Seconds since 1970. A time without a zone is UTC, as in both formats."""
    return (time if time.tzinfo else time.replace(tzinfo=UTC)).timestamp()


_READERS: dict[str, Callable[[Path, Progress | None], Iterator[Point]]] = {".gpx": _gpx, ".fit": _fit}
