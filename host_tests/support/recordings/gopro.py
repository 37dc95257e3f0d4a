"""Makes small videos, with or without a GoPro's telemetry."""

import struct
import subprocess
from pathlib import Path

import numpy as np
from kickstand_tools.overlay.video import ffmpeg, open_video

SCALE = 3755  # scale of the gyro's integers in HERO cameras


def film(path: Path, seconds: float, fps: int = 10, size: str = "320x240", colour: str = "green") -> Path:
    """Create a video of one colour, with sound."""
    sources = ["-f", "lavfi", "-i", f"color={colour}:size={size}:rate={fps}:duration={seconds}"]
    sources += ["-f", "lavfi", "-i", f"sine=duration={seconds}"]
    command = [ffmpeg(), "-y", "-loglevel", "error", *sources, "-pix_fmt", "yuv420p", str(path)]
    subprocess.run(command, check=True)
    return path


def frames(path: Path, form: str = "rgb24") -> np.ndarray:
    """Return all pictures of a video, shape (n, height, width, 3), or (..., 4) for "rgba", with transparency."""
    film, channels = open_video(path), 4 if form == "rgba" else 3
    decoder = ["-c:v", "libvpx-vp9"] if path.suffix == ".webm" else []  # ffmpeg's own decoder ignores transparency
    pictures = ["-i", str(path), "-f", "rawvideo", "-pix_fmt", form, "-"]
    command = [ffmpeg(), "-loglevel", "error", *decoder, *pictures]
    content = subprocess.run(command, stdout=subprocess.PIPE, check=True).stdout
    return np.frombuffer(content, np.uint8).reshape(-1, film.height, film.width, channels)


def with_telemetry(video: Path, rate_dps: np.ndarray, rate_hz: float) -> Path:
    """Return the video with an added GPMF track of the gyro's readings.

    rate_dps: readings from the first picture on, shape (n, 3).
    """
    count = round(rate_hz)
    packets = [_packet(rate_dps[begin : begin + count]) for begin in range(0, len(rate_dps) - count + 1, count)]
    content = video.read_bytes()
    moov = _find(content, b"moov")
    head, inner, tail = content[: moov.start], content[moov.start + 8 : moov.stop], content[moov.stop :]
    assert not tail  # the track is added at the end, so the earlier parts of the file keep their offsets
    length = 8 + len(inner) + len(_track(packets, 0))
    grown = inner + _track(packets, len(head) + length + 8)
    video.write_bytes(head + _box(b"moov", grown) + _box(b"mdat", b"".join(packets)))
    return video


def _packet(rate_dps: np.ndarray) -> bytes:
    numbers = np.rint(np.radians(rate_dps) * SCALE).astype(">i2")
    streams = []
    for key, values in ((b"ACCL", np.ones((len(numbers), 3), ">i2")), (b"GYRO", numbers)):
        scale = _item(b"SCAL", b"s", 2, struct.pack(">h", SCALE))
        name = _item(b"STNM", b"c", 1, b"of three axes")
        streams.append(_item(b"STRM", b"\0", 1, name + scale + _item(key, b"s", 6, values.tobytes())))
    return _item(b"DEVC", b"\0", 1, _item(b"DVNM", b"c", 1, b"camera") + b"".join(streams))


def _item(key: bytes, kind: bytes, size: int, values: bytes) -> bytes:
    padded = values + bytes(-len(values) % 4)
    return key + kind + struct.pack(">BH", size, len(values) // size) + padded


def _box(name: bytes, content: bytes) -> bytes:
    return struct.pack(">I4s", 8 + len(content), name) + content


def _find(content: bytes, name: bytes) -> slice:
    offset = 0
    while offset < len(content):
        size, kind = struct.unpack_from(">I4s", content, offset)
        if kind == name:
            return slice(offset, offset + size)
        offset += size
    raise AssertionError(name)


def _track(packets: list[bytes], begin: int) -> bytes:
    """Return an MP4 track with one packet per second. begin: offset of the first packet in the file."""
    count, seconds = len(packets), 1000 * len(packets)
    matrix = struct.pack(">9i", 65536, 0, 0, 0, 65536, 0, 0, 0, 1 << 30)
    tkhd = struct.pack(">IIIIII8xHHHH", 7, 0, 0, 3, 0, seconds, 0, 0, 0, 0) + matrix + struct.pack(">II", 0, 0)
    mdhd = struct.pack(">IIIIIHH", 0, 0, 0, 1000, seconds, 0x15C7, 0)
    hdlr = struct.pack(">II4s12x", 0, 0, b"meta") + b"GoPro MET\0"
    gmin = struct.pack(">IHHHHHH", 0, 64, 0x8000, 0x8000, 0x8000, 0, 0)
    dref = struct.pack(">II", 0, 1) + _box(b"url ", struct.pack(">I", 1))
    stsd = struct.pack(">II", 0, 1) + _box(b"gpmd", struct.pack(">6xHI", 1, 0))
    places, offset = [], begin
    for packet in packets:
        places.append(offset)
        offset += len(packet)
    stbl = (
        _box(b"stsd", stsd)
        + _box(b"stts", struct.pack(">IIII", 0, 1, count, 1000))
        + _box(b"stsc", struct.pack(">IIIII", 0, 1, 1, 1, 1))
        + _box(b"stsz", struct.pack(f">III{count}I", 0, 0, count, *map(len, packets)))
        + _box(b"stco", struct.pack(f">II{count}I", 0, count, *places))
    )
    minf = _box(b"gmhd", _box(b"gmin", gmin)) + _box(b"dinf", _box(b"dref", dref)) + _box(b"stbl", stbl)
    mdia = _box(b"mdhd", mdhd) + _box(b"hdlr", hdlr) + _box(b"minf", minf)
    return _box(b"trak", _box(b"tkhd", tkhd) + _box(b"mdia", mdia))
