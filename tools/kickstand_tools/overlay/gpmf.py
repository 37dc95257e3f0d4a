"""Reads the gyro of a GoPro from its video file.

The video file has a track of packets in the format GPMF, about one packet per second. The format is described at
github.com/gopro/gpmf-parser. A packet consists of nested items. An item has a four-letter key, a type, a size, the
number of values, and the values, big-endian.
"""

import struct
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ..signals import Array
from .video import Video, packets

_NUMBERS = {b"b": "i1", b"B": "u1", b"s": "i2", b"S": "u2", b"l": "i4", b"L": "u4", b"j": "i8", b"J": "u8"}
_NUMBERS |= {b"f": "f4", b"d": "f8"}  # numpy's names
_NESTED = b"\0"


@dataclass
class Telemetry:
    """Readings of the camera's gyro."""

    t_s: Array  # time since the video's first picture, in s, shape (n)
    rate_dps: Array  # rates about the camera's axes, in deg/s, shape (n, 3)


def telemetry(video: Video) -> Telemetry | None:
    """Read the gyro of the camera that took a video. Returns None if the video contains no readable gyro."""
    if video.telemetry is None:
        return None
    times, rates = [], []
    try:
        payloads = packets(video, video.telemetry)
    except ValueError:  # ffmpeg's output is not a list of packets
        return None
    for at_s, lasts_s, packet in payloads:
        samples = [values for values in streams(packet, b"GYRO") if len(values)]
        if samples and lasts_s > 0.0 and np.all(np.abs(samples[0]) < 1e3):
            rate = samples[0]
            times.append(at_s + lasts_s * (np.arange(len(rate)) + 0.5) / len(rate))
            rates.append(np.degrees(rate))
    if not times:
        return None
    return Telemetry(np.concatenate(times), np.vstack(rates))


def streams(packet: bytes, key: bytes) -> Iterator[Array]:
    """Yield the values of each stream with this key, shape (n, axes), in the unit that GPMF defines for the key."""
    for name, kind, _, body in _items(packet):
        if kind == _NESTED and name in (b"DEVC", b"STRM"):
            yield from _of_stream(body, key) if name == b"STRM" else streams(body, key)


def _of_stream(body: bytes, key: bytes) -> Iterator[Array]:
    """Yield the values of one stream, divided by the number in its item SCAL. SCAL comes before the values."""
    scale = np.ones(1)
    for name, kind, size, values in _items(body):
        if kind not in _NUMBERS or name not in (b"SCAL", key):
            continue
        form = np.dtype(">" + _NUMBERS[kind])
        numbers = np.frombuffer(values[: len(values) // form.itemsize * form.itemsize], form).astype(float)
        axes = size // form.itemsize
        if name == b"SCAL":
            scale = numbers if len(numbers) == 3 else numbers[:1]
        elif axes >= 3:
            with np.errstate(all="ignore"):  # a damaged scale may be 0
                yield numbers[: len(numbers) // axes * axes].reshape(-1, axes)[:, :3] / scale


def _items(data: bytes) -> Iterator[tuple[bytes, bytes, int, bytes]]:
    """Yield key, type, size of one sample and bytes of all samples for each item. Items are padded to four bytes."""
    offset = 0
    while offset + 8 <= len(data):
        name, kind, size, count = struct.unpack_from(">4scBH", data, offset)
        offset += 8
        yield name, kind, size, data[offset : offset + size * count]
        offset += (size * count + 3) // 4 * 4
