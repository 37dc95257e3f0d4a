"""Simulates the tracks that a phone records on a ride, and writes them as files."""

import datetime
import struct
from pathlib import Path

import gpxpy.gpx
import numpy as np
from kickstand_tools.api import Track
from kickstand_tools.signals import EARTH_M

START_UTC_S = 1_700_000_000.3  # when the rides began
LAT_DEG, LON_DEG = 48.1, 11.5
FIT_EPOCH_S = 631_065_600  # 1989-12-31
SEMICIRCLES = 2**31 / 180.0


def track(
    ride,
    late_s: float = 0.5,
    error_m: float = 4.0,
    changes_s: float = 30.0,
    smooth_s: float = 0.3,
    before_s: float = 600.0,
    after_s: float = 200.0,
    seed: int = 1,
    speed: bool = True,
    pace: tuple[np.ndarray, np.ndarray] | None = None,
) -> Track:
    """Return the track that a phone records on this ride, one point per second.

    late_s: total delay of the positions.
    error_m: standard deviation of a position's error.
    changes_s: time within which this error changes.
    smooth_s: part of late_s that is the mean delay of a low-pass filter.
    before_s: time from the beginning of the track to the beginning of the ride. after_s: time from the end of the ride
        to the end of the track.
    speed: True if the track has speeds.
    pace: (new time in s, factor on the speed) of each sample of the ride, to ride the same road at another speed.
    """
    chance = np.random.default_rng(seed)
    step_s = 1.0 / ride.rate_hz
    at_s, faster = pace or (ride.time, np.ones(len(ride.time)))
    speed_mps = ride.truth["speed_mps"]
    heading = chance.uniform(0.0, 6.28) + np.cumsum(np.radians(ride.truth["yaw_rate_dps"])) * step_s
    way = [np.cumsum(speed_mps * turn(heading)) * step_s for turn in (np.cos, np.sin)]
    now_s = np.arange(at_s[0] - before_s, at_s[-1] + after_s)
    asked_s = np.clip(now_s - (late_s - smooth_s), at_s[0], at_s[-1])
    east, north, seen_mps = (
        np.interp(asked_s, at_s, _low_pass(values, smooth_s, step_s)) for values in (*way, speed_mps * faster)
    )
    east, north = (values + _wander(chance, len(now_s), error_m, changes_s) for values in (east, north))
    seen_mps = np.maximum(seen_mps + chance.normal(0.0, 0.2, len(now_s)), 0.0)
    return Track(
        START_UTC_S + now_s,
        LAT_DEG + np.degrees(north / EARTH_M),
        LON_DEG + np.degrees(east / EARTH_M) / np.cos(np.radians(LAT_DEG)),
        seen_mps if speed else np.full(len(now_s), np.nan),
        "track",
    )


def _low_pass(values: np.ndarray, delay_s: float, step_s: float) -> np.ndarray:
    if not delay_s:
        return values
    shape = np.exp(-np.arange(0.0, 6.0 * delay_s, step_s) / delay_s)
    return np.convolve(np.append(np.full(len(shape) - 1, values[0]), values), shape / shape.sum(), "valid")


def _wander(chance: np.random.Generator, count: int, sigma_m: float, changes_s: float) -> np.ndarray:
    """Return `count` errors in m: a correlated error that decays within changes_s, and a little white noise."""
    decay, values = np.exp(-1.0 / changes_s), [chance.normal(0.0, sigma_m)]
    for push in chance.normal(0.0, sigma_m * np.sqrt(1.0 - decay * decay), count - 1):
        values.append(decay * values[-1] + push)
    return np.array(values) + chance.normal(0.0, 0.3, count)


def write_gpx(path: Path, track: Track, speed_as: str = "") -> Path:
    """Write the track as a GPX file.

    speed_as: "" for a file without speeds, "1.0" for the element of GPX 1.0, "garmin" for the extension of GPX 1.1.
    """
    document, segment = gpxpy.gpx.GPX(), gpxpy.gpx.GPXTrackSegment()
    document.tracks.append(gpxpy.gpx.GPXTrack())
    document.tracks[0].segments.append(segment)
    for utc_s, lat, lon, speed in zip(track.utc_s, track.lat_deg, track.lon_deg, track.speed_mps):
        time = datetime.datetime.fromtimestamp(utc_s, datetime.UTC)
        segment.points.append(gpxpy.gpx.GPXTrackPoint(lat, lon, time=time, speed=speed if speed_as == "1.0" else None))
    text = document.to_xml("1.0" if speed_as == "1.0" else "1.1")
    if speed_as == "garmin":
        text = text.replace("<gpx ", '<gpx xmlns:gpxtpx="http://www.garmin.com/xmlschemas/TrackPointExtension/v2" ')
        for speed in track.speed_mps:
            extension = f"<gpxtpx:TrackPointExtension><gpxtpx:speed>{speed:.3f}</gpxtpx:speed>"
            extension += "</gpxtpx:TrackPointExtension>"
            text = text.replace("</time>\n      </trkpt>", f"</time><extensions>{extension}</extensions></trkpt>", 1)
    path.write_text(text)
    return path


def write_fit(path: Path, track: Track) -> Path:
    """Write records with time in whole seconds, position and speed, in Garmin's FIT format."""
    fields = ((253, 4, 0x86), (0, 4, 0x85), (1, 4, 0x85), (6, 2, 0x84))  # (number, size, type) of each field
    body = struct.pack("<BBBHB", 0x40, 0, 0, 20, len(fields)) + b"".join(struct.pack("BBB", *field) for field in fields)
    for utc_s, lat, lon, speed in zip(track.utc_s, track.lat_deg, track.lon_deg, track.speed_mps):
        record = int(utc_s) - FIT_EPOCH_S, round(lat * SEMICIRCLES), round(lon * SEMICIRCLES), round(1000.0 * speed)
        body += struct.pack("<BIiiH", 0, *record)
    head = struct.pack("<BBHI4s", 14, 0x20, 2132, len(body), b".FIT")
    content = head + struct.pack("<H", _crc(head)) + body
    path.write_bytes(content + struct.pack("<H", _crc(content)))
    return path


def _crc(data: bytes) -> int:
    """Return the CRC-16/ARC, which the FIT protocol uses."""
    crc = 0
    for byte in data:
        crc ^= byte
        for _ in range(8):
            crc = crc >> 1 ^ (0xA001 if crc & 1 else 0)
    return crc
