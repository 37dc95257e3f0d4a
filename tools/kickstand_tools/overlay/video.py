"""Reads and writes videos with ffmpeg, which is part of the package imageio-ffmpeg."""

import contextlib
import re
import struct
import subprocess
import tempfile
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..common.installation import extra
from ..common.messages import InputError
from ..signals import Array

_QUIET = ("-hide_banner", "-loglevel", "error", "-nostdin", "-y")
_LARGEST, _FASTEST = 16_384, 1000.0  # limits of real cameras: pixels per side, and pictures per second


@dataclass
class Video:
    """A video file.

    width, height: size in pixels, as a player shows the video.
    fps: pictures per second.
    seconds: duration.
    telemetry: number of the stream with a GoPro's sensor readings, None if the file has no such stream.
    """

    path: Path
    width: int
    height: int
    fps: float
    seconds: float
    telemetry: int | None


def ffmpeg() -> str:
    """The path of the program ffmpeg. Raises InputError if ffmpeg is not installed."""
    try:
        import imageio_ffmpeg
        import PIL  # noqa: F401  the gauge needs Pillow
    except ImportError as error:
        raise InputError("overlay needs imageio-ffmpeg and Pillow: " + extra("video")) from error
    try:
        return imageio_ffmpeg.get_ffmpeg_exe()
    except RuntimeError as error:
        raise InputError("imageio-ffmpeg has no ffmpeg for this system: install ffmpeg") from error


def input_of(path: Path) -> list[str]:
    """Return ffmpeg's arguments to read a file safely.

    The prefix file: is needed, because ffmpeg would read the name 12:30.mp4 as a protocol. The list of protocols keeps
    a malicious file from making ffmpeg read from the network.
    """
    return ["-protocol_whitelist", "file,pipe", "-i", f"file:{path}"]


def open_video(path: Path) -> Video:
    """Read the properties of a video file. Raises InputError if the file is not a video."""
    if not path.is_file():
        raise InputError(f"{path} is a directory, not a video" if path.is_dir() else f"{path}: there is no such file")
    output = _run(["-hide_banner", "-nostdin", *input_of(path)]).stderr.decode(errors="replace")
    stream = re.search(r"Stream #0:\d+.*: Video: (?P<words>.*)", output)
    if "Input #0" not in output:
        raise InputError(f"{path} is not a video that ffmpeg can read, or its copy is incomplete")
    if not stream or "attached pic" in stream[0]:
        raise InputError(f"{path} has no pictures: give a video")
    words = stream["words"]
    size = re.search(r"\b(?P<width>\d{2,5})x(?P<height>\d{2,5})\b", words)
    forms = (rf"(?P<fps>[\d.]+)(?P<thousand>k?) {unit}" for unit in ("fps", "tbr"))
    rate = next(filter(None, (re.search(form, words) for form in forms)), None)
    counted = _run(["-hide_banner", "-nostdin", *input_of(path), "-map", "0:v:0", "-c", "copy", "-f", "null", "-"])
    counts = re.findall(r"frame= *(\d+)", counted.stderr.decode(errors="replace"))
    pictures = int(counts[-1]) if counts else 0
    if not size or not rate or not pictures or counted.returncode:
        raise InputError(f"{path} is a damaged video: copy it again")
    fps = float(rate["fps"]) * (1000.0 if rate["thousand"] else 1.0)
    width, height = int(size["width"]), int(size["height"])
    if max(width, height) > _LARGEST or not 0.0 < fps <= _FASTEST:
        raise InputError(f"{path} is not a camera's video: {width}x{height} pixels, {fps:g} pictures per second")
    rotation = re.search(r"rotation of (-?[\d.]+) degrees", output)
    if rotation and round(float(rotation[1])) % 180 == 90:
        width, height = height, width
    telemetry = re.search(r"Stream #0:(\d+)[^\n]*\(gpmd", output)
    return Video(path, width, height, fps, pictures / fps, int(telemetry[1]) if telemetry else None)


def packets(video: Video, stream: int) -> list[tuple[float, float, bytes]]:
    """Read the packets of a stream: start in s since the first picture, duration in s, and content."""
    chosen = [*input_of(video.path), "-map", f"0:{stream}", "-c", "copy"]
    listed = _run([*_QUIET, *chosen, "-f", "framecrc", "-"]).stdout.decode(errors="replace")
    data = _run([*_QUIET, *chosen, "-f", "data", "-"]).stdout
    tick = re.search(r"#tb 0: (\d+)/(\d+)", listed)
    if not tick:
        return []
    unit_s, result, begin = int(tick[1]) / int(tick[2]), [], 0
    for line in listed.splitlines():
        if not line.startswith("#"):
            _, _, begin_ticks, ticks, size, *_ = (cell.strip() for cell in line.split(","))
            result.append((int(begin_ticks) * unit_s, int(ticks) * unit_s, data[begin : begin + int(size)]))
            begin += int(size)
    return result


def write_video(
    out: Path, arguments: Iterable[str], pictures: Iterable[bytes], on_picture: Callable[[], None] | None = None
) -> None:
    """Run ffmpeg to write a video to the file `out`.

    arguments: ffmpeg's other arguments.
    pictures: written to its standard input.
    on_picture: called after every picture.
    Raises InputError with ffmpeg's last line of text if ffmpeg fails.
    """
    with tempfile.TemporaryFile() as words:
        command = [ffmpeg(), "-hide_banner", "-loglevel", "error", "-y", *arguments, f"file:{out}"]
        process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, stderr=words)
        assert process.stdin is not None
        try:
            try:
                for picture in pictures:
                    process.stdin.write(picture)
                    if on_picture:
                        on_picture()
                process.stdin.close()
            except BrokenPipeError:
                pass  # ffmpeg has stopped, and prints the reason
            process.wait()
        except BaseException:  # also after Ctrl-C, because ffmpeg must not continue to write
            process.kill()
            process.wait()
            raise
        finally:
            with contextlib.suppress(BrokenPipeError):  # pictures that ffmpeg has not read
                process.stdin.close()
        if process.returncode:
            words.seek(0)
            output = words.read().decode(errors="replace").strip().rpartition("\n")[2]
            raise InputError(f"ffmpeg has stopped: {output or 'it does not say why'}")


def _run(arguments: list[str]) -> "subprocess.CompletedProcess[bytes]":
    return subprocess.run([ffmpeg(), *arguments], capture_output=True, check=False)


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
        if samples and lasts_s > 0.0 and np.all(np.abs(samples[0]) < 1e3):  # rad/s; others are damaged
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
    """Yield the values of one stream, divided by the number in its item SCAL, which comes before them."""
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
    """Yield key, type, size of a sample, and all samples of each item. Items are padded to four bytes."""
    offset = 0
    while offset + 8 <= len(data):
        name, kind, size, count = struct.unpack_from(">4scBH", data, offset)
        offset += 8
        yield name, kind, size, data[offset : offset + size * count]
        offset += (size * count + 3) // 4 * 4
