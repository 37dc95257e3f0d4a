"""Draws a ride's gauge over a video, or as a transparent clip."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..analysis.overview import HELD_S
from ..analysis.ride import RideReading, open_ride
from ..calibration.file import CalibrationFile
from ..checks.log import CheckedLog
from ..common.messages import InputError, Message
from ..common.output import whole_file
from ..joining.motion import STEP_S, BinMotion, motion
from ..logs.log import Source
from ..logs.source import File, Progress
from ..signals import Array, correlations, log_likelihood_ratio, moving_mean, peak_offset, peaks, smoothed
from .video import Telemetry, Video, ffmpeg, input_of, open_video, telemetry, write_video

MARGIN = 0.03  # distance from the video's edges to the gauge, as a share of the video's height
_BEYOND_S = 1.0  # longest time by which a video may begin before the ride or end after the ride
_FPS = 30.0
_CLIP_HEIGHT = 1080
_TRANSPARENT = {
    ".mov": ("-c:v", "prores_ks", "-profile:v", "4444", "-pix_fmt", "yuva444p10le", "-vendor", "apl0"),
    ".webm": (
        *("-c:v", "libvpx-vp9", "-pix_fmt", "yuva420p", "-crf", "20", "-b:v", "0", "-auto-alt-ref", "0"),
        *("-deadline", "realtime", "-cpu-used", "6", "-row-mt", "1"),
    ),
}
_SOLID = ("-c:v", "libx264", "-preset", "fast", "-crf", "18", "-pix_fmt", "yuv420p", "-movflags", "+faststart")

_FORCE_S = 0.3  # averaging time of the forces, because engine and road shake the sensor
_GAP_S = 0.2  # longest gap between readings over which values are interpolated
_SPEED_S = 3.0  # longest gap between speeds over which the speed is interpolated; most receivers send one per second
# Finding a video in a ride: the camera and the bike turn by the same rates
_SLOW_S = 5.0  # changes of rate that take longer are removed, because they may come from the gyros' bias
_QUICK_S = 0.2  # changes of rate that take less time are removed as vibration, which is different at each place
_ALIKE_S = 0.5  # smallest time between two readings that count as independent
_LEAST_S = 8.0  # shortest part of the video that must be within the ride
_LEAST_EVIDENCE, _LEAST_LEAD, _LEAST_CORRELATION = 15.0, 6.0, 0.5
_APART_S = 2.0


@dataclass
class Overlaid:
    """The result of overlay().

    pictures: number of pictures.
    fps: pictures per second.
    begin_s, end_s: limits of the drawn part of the ride, in s since its first sample.
    offset_s: the ride's time at the video's first picture. None without a video.
    correlation: correlation between the rates of camera and bike. None if the offset was passed.
    notices: remarks about the ride.
    """

    pictures: int
    fps: float
    begin_s: float
    end_s: float
    offset_s: float | None
    correlation: float | None
    notices: list[Message]


@dataclass
class Shown:
    """The values at n moments of a ride. Values that are unknown or not trusted are NaN."""

    t_s: Array  # since the ride's first sample
    lean_deg: Array  # positive to the right
    forward_g: Array  # acceleration, positive when speeding up
    left_g: Array  # acceleration to the left, parallel to the road
    speed_mps: Array
    left_deg: Array  # the largest lean to the left so far, 0 for none
    right_deg: Array  # the largest lean to the right so far, 0 for none

    @property
    def has_speed(self) -> bool:
        return bool(np.any(np.isfinite(self.speed_mps)))

    @property
    def values(self) -> tuple[Array, ...]:
        """All values except the times, each of shape (n)."""
        return self.lean_deg, self.forward_g, self.left_g, self.speed_mps, self.left_deg, self.right_deg

    def at(self, t_s: Array) -> "Shown":
        """Interpolate the values at other times. The values are NaN before the ride, after it and in gaps."""
        lean, forward, left = (
            _along_lines(self.t_s, value, t_s, _GAP_S) for value in (self.lean_deg, self.forward_g, self.left_g)
        )
        valid = np.flatnonzero(np.isfinite(self.speed_mps))
        speed = np.full(len(t_s), np.nan)
        if len(valid) > 1:
            speed = _along_lines(self.t_s[valid], self.speed_mps[valid], t_s, _SPEED_S)
        last = np.searchsorted(self.t_s, t_s, side="right") - 1
        most_left, most_right = (np.where(last >= 0, value[last], 0.0) for value in (self.left_deg, self.right_deg))
        return Shown(t_s, lean, forward, left, speed, most_left, most_right)


def overlay(
    ride: Source,
    out: Path | str,
    calibration: CalibrationFile | File | None = None,
    video: Path | str | None = None,
    offset_s: float | None = None,
    fps: float | None = None,
    from_s: float | None = None,
    to_s: float | None = None,
    height: int | None = None,
    mph: bool = False,
    live: bool = False,
    progress: Progress | None = None,
) -> Overlaid:
    """Draw a gauge with lean, forces, speed and maxima over a video (.mp4), or write a transparent clip (.mov, .webm).

    Args:
        ride, calibration: see open_ride().
        out: path of the file to write.
        video: a video of the ride. None writes a clip.
        offset_s: the ride's time at the video's first picture, in s since the ride's first sample. It is negative if
            the video begins before the ride. None finds it from the gyro of a GoPro.
        fps: pictures per second. None uses the video's rate, or 30 for a clip.
        from_s, to_s: limits of the part of the ride, see Stretch.
        height: height in pixels of the video that a clip is for. None means 1080.
        mph: True to show the speed in miles per hour.
        live: True to show the lean of the display, False to show the smoothed lean.
        progress: called with (done, total), first while the ride is read, then while the pictures are drawn.

    Raises InputError.

    >>> overlay("ride.csv", "clip.avi")  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    kickstand_tools.common.messages.InputError: clip.avi: the name of a transparent clip ends in .mov or .webm...
    """
    out = Path(out)
    filmed = _check(out, video, offset_s, height)
    opened = open_ride(ride, calibration, smoothed=not live, progress=progress)
    correlation = None
    if filmed and offset_s is None:
        offset_s, correlation = _found_offset(opened.checked, filmed)
    reading = opened.read(progress)
    values = shown(reading)
    begin_s, end_s = _part(values, filmed, offset_s, from_s, to_s, opened.name)
    rate = fps or (filmed.fps if filmed else _FPS)
    count = max(1, round((end_s - begin_s) * rate))
    moments = values.at(begin_s + np.arange(count) / rate)
    from .gauge import Gauge

    size = min(filmed.width, filmed.height) if filmed else height or _CLIP_HEIGHT
    gauge = Gauge(size, values.has_speed, mph)
    written = 0

    def note_written() -> None:
        nonlocal written
        written += 1
        if progress:
            progress(written, count)

    def pictures() -> Iterator[bytes]:
        for k in range(count):
            yield gauge.picture(*(float(value[k]) for value in moments.values)).tobytes()

    raw = f"-f rawvideo -pix_fmt rgba -s {gauge.width}x{gauge.height} -r {rate:g} -i -".split()
    if filmed is None:
        arguments = [*raw, *_TRANSPARENT[out.suffix.lower()]]
    else:
        assert offset_s is not None
        arguments = _laid_over(filmed, begin_s - offset_s, end_s - begin_s, fps, raw, round(MARGIN * size))
    with whole_file(out) as temporary:
        temporary.touch()  # if this fails, the system gives the reason; ffmpeg would not report the reason
        write_video(temporary, arguments, pictures(), note_written)
    return Overlaid(count, rate, begin_s, end_s, offset_s, correlation, reading.notices())


def _check(out: Path, video: Path | str | None, offset_s: float | None, height: int | None) -> Video | None:
    """Check the files and options. Returns the opened video, or None. Raises InputError."""
    if video is None:
        if out.suffix.lower() not in _TRANSPARENT:
            raise InputError(f"{out}: the name of a transparent clip ends in .mov or .webm; an .mp4 needs --video")
        if offset_s is not None:
            raise InputError("an offset needs a video: give --video, or --from and --to")
        ffmpeg()
        return None
    if out.suffix.lower() != ".mp4":
        raise InputError(f"{out}: over a video the name must end in .mp4")
    if height is not None:
        raise InputError("a height is only for a clip: over a video the gauge follows the video's height")
    return open_video(Path(video))


def _found_offset(ride: CheckedLog, video: Video) -> tuple[float, float]:
    todo = "give --offset, the ride's time in seconds at the video's first picture"
    measured = telemetry(video)
    if measured is None:
        raise InputError(f"{video.path}: it has no gyro readings of a GoPro that show when it was filmed: {todo}")
    try:
        return camera_offset_s(motion(ride), measured)
    except InputError as error:
        raise InputError(f"{video.path}, {ride.log.name}: {error}: {todo}") from error


def _part(
    values: Shown, video: Video | None, offset_s: float | None, from_s: float | None, to_s: float | None, name: str
) -> tuple[float, float]:
    """Start and end of the part to draw, in s since the ride's first sample. Raises InputError."""
    last_s = float(values.t_s[-1])
    begin_s, end_s = (s if s is None or s >= 0.0 else max(0.0, last_s + s) for s in (from_s, to_s))
    if video is not None and offset_s is not None:
        begin_s, end_s = _part_of_video(offset_s, offset_s + video.seconds, begin_s, end_s, last_s, name)
    begin_s, end_s = begin_s or 0.0, last_s if end_s is None else end_s
    if end_s <= begin_s or begin_s >= last_s:
        raise InputError(f"{name} lasts {last_s:.1f} s: there is nothing from {begin_s:.1f} to {end_s:.1f} s")
    return begin_s, end_s if video else min(end_s, last_s)


def _part_of_video(
    first: float, last: float, begin_s: float | None, end_s: float | None, last_s: float, name: str
) -> tuple[float, float]:
    """Limit the part to the video, which lasts from `first` to `last` on the ride's time. Raises InputError."""
    limits = f"the video lasts from {first:.1f} to {last:.1f} s of the ride {name}, which ends at {last_s:.1f} s"
    if first >= last_s or last <= 0.0:
        raise InputError(f"{limits}: they have nothing in common, check --offset")
    if begin_s is None and end_s is None:
        if first < -_BEYOND_S or last > last_s + _BEYOND_S:
            within = f"--from {max(first, 0.0):.1f} --to {min(last, last_s):.1f}"
            raise InputError(f"{limits}: check --offset, or take what they have in common with {within}")
        return first, last
    # A missing limit is the end of the common part
    return max(first, begin_s or 0.0), min(last, last_s if end_s is None else end_s, last_s)


def _laid_over(
    video: Video, begin_s: float, seconds: float, fps: float | None, gauge: list[str], margin: int
) -> list[str]:
    """Return ffmpeg's arguments to draw the gauge over the video's lower left corner and to copy the sound."""
    even = "crop=iw-mod(iw\\,2):ih-mod(ih\\,2)"
    rate = f",fps={fps:g}" if fps else ""
    laid = f"overlay=x={margin}:y=main_h-overlay_h-{margin}:eof_action=repeat"
    return [
        *("-ss", f"{max(begin_s, 0.0):.4f}", "-t", f"{seconds:.4f}", *input_of(video.path), *gauge),
        *("-filter_complex", f"[0:v:0]{even}{rate}[film];[film][1:v]{laid}[all]"),
        *("-map", "[all]", "-map", "0:a?", "-c:a", "copy", *_SOLID),
    ]


# The values that the gauge shows


def shown(reading: RideReading) -> Shown:
    """Compute the values of a ride from open_ride(). Raises InputError."""
    columns: list[Array] = []
    for part in reading.parts():
        lean = np.where(part.trusted, part.lean_deg, np.nan)
        columns.append(np.array([part.t_s, lean, part.forward_g, part.lateral_g, part.speed_mps]))
    t_s, lean, forward, left, speed = np.hstack(columns)
    forward, left = (smoothed(values, t_s, _FORCE_S) for values in (forward, left))
    return Shown(t_s, lean, forward, left, speed, _maximum(t_s, -lean), _maximum(t_s, lean))


def _maximum(t_s: Array, lean: Array) -> Array:
    """The largest lean up to each moment that lasted at least HELD_S, shape (n); 0 without one."""
    count = round(HELD_S / float(np.median(np.diff(t_s)))) + 1
    value = np.where(np.isfinite(lean), lean, 0.0)
    padded = np.append(np.zeros(count - 1), value)
    lasted = np.min(np.lib.stride_tricks.sliding_window_view(padded, count), axis=1)
    return np.maximum(np.maximum.accumulate(lasted), 0.0)


def _along_lines(at_s: Array, values: Array, t_s: Array, gap_s: float) -> Array:
    """Interpolate values at the times at_s linearly at t_s, NaN outside the values and in gaps longer than gap_s."""
    index = np.clip(np.searchsorted(at_s, t_s, side="right") - 1, 0, len(at_s) - 2)  # the last value before t_s
    step_s = at_s[index + 1] - at_s[index]
    share = (t_s - at_s[index]) / step_s
    result = values[index] * (1.0 - share) + values[index + 1] * share
    beyond = np.minimum(gap_s / step_s, 0.5)  # the first and the last value also hold this share of a step beyond
    inside = (share >= -beyond) & (share <= 1.0 + beyond) & (step_s <= gap_s)
    return np.where(inside, result, np.nan)


# The time of a video


def camera_offset_s(ride: BinMotion, camera: Telemetry) -> tuple[float, float]:
    """Find the time of the video's first picture, in s since the ride's first sample.

    A camera on the bike turns with the bike. A camera on a helmet also turns with the head, and may not match. Also
    returns the correlation between the rates of camera and bike. Raises InputError without a match.
    """
    cell = np.floor((camera.t_s - camera.t_s[0]) / STEP_S).astype(int)
    count = np.bincount(cell)
    rate = np.column_stack([np.bincount(cell, axis) for axis in camera.rate_dps.T]) / np.maximum(count, 1)[:, None]
    filmed, ridden = _turning(rate - np.median(rate[count > 0], axis=0)), _turning(ride.rate_dps)
    correlation, common = correlations(ridden, ride.valid, filmed, count > 0)
    correlation = np.where(common * STEP_S >= _LEAST_S, correlation, 0.0)
    likely = log_likelihood_ratio(correlation, common, STEP_S / _ALIKE_S)
    best = peaks(likely, round(_APART_S / STEP_S), 2)
    if not best or likely[best[0]] < _LEAST_EVIDENCE or correlation[best[0]] < _LEAST_CORRELATION:
        raise InputError("at no time does the camera turn like the bike")
    if len(best) > 1 and likely[best[1]] > likely[best[0]] - _LEAST_LEAD:
        raise InputError("the camera turns like the bike at several times")
    index = best[0]
    between = peak_offset(correlation[index - 1 : index + 2]) if 0 < index < len(correlation) - 1 else 0.0
    shift = index - (len(filmed) - 1) + between  # see correlations(); `between` is the share of a step
    return shift * STEP_S - float(camera.t_s[0]), float(correlation[index])


def _turning(rate_dps: Array) -> Array:
    """The magnitude of the rate, shape (n), without its slow and quick changes."""
    size = moving_mean(np.linalg.norm(rate_dps, axis=1), round(_QUICK_S / STEP_S))
    return size - moving_mean(size, round(_SLOW_S / STEP_S))
