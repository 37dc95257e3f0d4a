"""Tests how ffmpeg is found, run and stopped, and how the camera's match is found at the ends of a ride."""

import struct
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from kickstand_tools.common.errors import InputError
from kickstand_tools.joining.motion import CellMotion
from kickstand_tools.overlay import camera_match, gpmf, video
from kickstand_tools.overlay.shown import Shown

NAN = float("nan")


# ffmpeg


def test_a_missing_ffmpeg_is_explained(monkeypatch):
    def nothing():
        raise RuntimeError("none")

    monkeypatch.setitem(sys.modules, "PIL", SimpleNamespace())
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", SimpleNamespace(get_ffmpeg_exe=lambda: "/bin/ffmpeg"))
    assert video.ffmpeg() == "/bin/ffmpeg"
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", SimpleNamespace(get_ffmpeg_exe=nothing))
    with pytest.raises(InputError, match="no ffmpeg for this system: install ffmpeg"):
        video.ffmpeg()
    for name in ("imageio_ffmpeg", "PIL"):
        monkeypatch.setitem(sys.modules, name, None)
        with pytest.raises(InputError, match=r"overlay needs imageio-ffmpeg and Pillow: .*\[video\]"):
            video.ffmpeg()


def test_a_path_without_a_file_is_explained(tmp_path):
    with pytest.raises(InputError, match="is a directory, not a video"):
        video.open_video(tmp_path)
    with pytest.raises(InputError, match=r"a\.mp4: there is no such file"):
        video.open_video(tmp_path / "a.mp4")


def test_the_last_number_of_pictures_and_the_size_count(monkeypatch, tmp_path):
    (tmp_path / "a.mp4").touch()

    def opened(size):
        texts = [f"Input #0\n  Stream #0:0: Video: h264{size}, 30 fps\n", "frame=1\rframe= 200\rframe= 600 z"]
        monkeypatch.setattr(video, "_run", lambda _: SimpleNamespace(stderr=texts.pop(0).encode(), returncode=0))
        return video.open_video(tmp_path / "a.mp4")

    assert opened(", 64x48").seconds == pytest.approx(20.0)
    with pytest.raises(InputError, match="damaged video"):
        opened("")


def test_a_program_is_run_with_its_output(monkeypatch):
    monkeypatch.setattr(video, "ffmpeg", lambda: sys.executable)
    done = video._run(["-S", "-c", "import sys; print(1); sys.exit('why')"])
    assert (done.returncode, done.stdout.strip(), done.stderr.strip()) == (1, b"1", b"why")


class Process:
    """An ffmpeg that ends with this status and these words. breaks: number of pictures after which it has stopped."""

    def __init__(self, returncode=0, words=b"", breaks=99):
        self.returncode, self.words, self.breaks = returncode, words, breaks
        self.did: list[Any] = []
        self.stdin = self

    def __call__(self, command, stdin, stdout, stderr):
        self.command = command
        assert (stdin, stdout) == (subprocess.PIPE, subprocess.DEVNULL)
        stderr.write(self.words)
        return self

    def write(self, picture):
        if len(self.did) >= self.breaks:
            raise BrokenPipeError
        self.did.append(picture)

    def close(self):
        self.did.append("close")

    def wait(self):
        self.did.append("wait")

    def kill(self):
        self.did.append("kill")


@pytest.fixture
def written(monkeypatch):
    """Return a function that writes a video with this process, and returns the number of calls after a picture."""

    def write(process, pictures=(b"1", b"2")):
        monkeypatch.setattr(video, "ffmpeg", lambda: "ffmpeg")
        monkeypatch.setattr(video.subprocess, "Popen", process)
        calls: list = []
        video.write_video(Path("out.mp4"), ["-x"], pictures, lambda: calls.append(1))
        return len(calls)

    return write


def test_pictures_are_written_and_ffmpeg_ends(written):
    process = Process()
    assert written(process) == 2
    assert process.did == [b"1", b"2", "close", "wait"]
    assert process.command[0] == "ffmpeg" and process.command[-3:] == ["-y", "-x", "file:out.mp4"]


@pytest.mark.parametrize(
    ("words", "said"), [(b"one\nthe last \n\n", "ffmpeg has stopped: the last$"), (b"", "it does not say why")]
)
def test_ffmpeg_that_stops_says_why(written, words, said):
    process = Process(1, words, breaks=1)
    with pytest.raises(InputError, match=said):
        written(process)
    assert process.did == [b"1", "wait"]


def test_ffmpeg_is_killed_after_an_interruption(written):
    def pictures():
        yield b"1"
        raise KeyboardInterrupt

    process = Process()
    with pytest.raises(KeyboardInterrupt):
        written(process, pictures())
    assert process.did == [b"1", "kill", "wait"]


# gpmf.py


def test_a_video_without_readings_is_not_read(monkeypatch):
    monkeypatch.setattr(gpmf, "packets", lambda *_: pytest.fail("it has no stream"))
    assert gpmf.telemetry(video.Video(Path("a.mp4"), 8, 8, 30.0, 60.0, None)) is None


def test_a_list_of_packets_that_is_none_has_no_readings(monkeypatch):
    def packets(*_):
        raise ValueError

    monkeypatch.setattr(gpmf, "packets", packets)
    assert gpmf.telemetry(video.Video(Path("a.mp4"), 8, 8, 30.0, 60.0, 3)) is None


def test_other_items_of_a_stream_are_skipped():
    """A text, a count and an unknown kind come before the scale and the values."""

    def item(name, kind, size, count, body):
        return struct.pack(">4scBH", name, kind, size, count) + body + bytes(-len(body) % 4)

    body = item(b"STNM", b"c", 1, 3, b"abc") + item(b"TSMP", b"L", 4, 1, struct.pack(">L", 7))
    body += item(b"GYRO", b"?", 4, 1, b"wxyz") + item(b"SCAL", b"s", 2, 1, struct.pack(">h", 10))
    body += item(b"GYRO", b"s", 6, 1, struct.pack(">3h", 10, 20, 30))
    other = item(b"STRM", b"s", 1, 4, b"abcd") + item(b"ABCD", b"\0", 1, 4, b"abcd")
    (found,) = gpmf.streams(other + item(b"STRM", b"\0", 1, len(body), body), b"GYRO")
    assert found.tolist() == [[1.0, 2.0, 3.0]]


@pytest.mark.parametrize(
    ("kind", "form"),
    [("b", "b"), ("B", "B"), ("s", "h"), ("S", "H"), ("l", "i"), ("L", "I"), ("j", "q"), ("J", "Q"), ("f", "f"),
     ("d", "d")],
)  # fmt: skip
def test_each_kind_of_number_is_read(kind, form):
    body = struct.pack(f">3{form}", 1, 2, 100)
    data = struct.pack(">4scBH", b"GYRO", kind.encode(), len(body), 1) + body + bytes(-len(body) % 4)
    assert next(gpmf._of_stream(data, b"GYRO")).tolist() == [[1.0, 2.0, 100.0]]


# camera_match.py


@pytest.mark.parametrize(("at", "between"), [(0, 0.0), (1, -1 / 6), (797, -1 / 6), (798, 0.0)])
def test_a_match_at_an_end_has_no_neighbour(monkeypatch, at, between):
    """The correlations are 0.8, 0.9 and 0.7, so the parabola's peak is a sixth of a cell before the middle. Readings
    count as independent after ten cells, and two matches are apart by 40 cells."""
    found, given = np.zeros(799), []
    found[at], found[max(0, at - 1) : at], found[at + 1 : at + 2] = 0.9, 0.8, 0.7
    monkeypatch.setattr(camera_match, "correlations", lambda *_: (found, np.full(799, 200)))
    monkeypatch.setattr(
        camera_match, "log_likelihood_ratio", lambda values, common, share: given.append(share) or 40.0 * values
    )
    monkeypatch.setattr(camera_match, "peaks", lambda values, apart, count: given.extend((apart, count)) or [at])
    camera = gpmf.Telemetry(np.linspace(0.0, 9.975, 400), np.random.default_rng(1).normal(size=(400, 3)))
    ride = CellMotion(np.zeros((600, 3)), np.zeros((600, 3)), np.ones(600, dtype=bool), False, False)
    offset_s, correlation = camera_match.camera_offset_s(ride, camera)
    assert offset_s == pytest.approx((at - 199 + between) * 0.05) and correlation == 0.9
    assert given == [pytest.approx(0.1), 40, 2]


# shown.py


def test_the_last_speed_is_shown_until_half_a_step_after_it():
    """The speeds are 10 m/s at 0 s, and 14 m/s at 2 s. After a further 1 s nothing is shown."""
    t_s, none = np.arange(0.0, 6.0, 0.1), np.full(60, NAN)
    speed = none.copy()
    speed[[0, 20]] = 10.0, 14.0
    found = Shown(t_s, none, none, none, speed, none, none).at(np.array([-1.1, -0.9, 1.0, 2.0, 2.9, 3.1]))
    assert found.speed_mps == pytest.approx([NAN, 8.2, 12.0, 14.0, 15.8, NAN], nan_ok=True)
