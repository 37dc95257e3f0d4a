"""ffmpeg's words about a video, a camera's packets, and the time of a video in a ride."""

import struct
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

pytest.importorskip("PIL")
from kickstand_tools.common.errors import InputError
from kickstand_tools.joining.motion import CellMotion
from kickstand_tools.overlay import camera_match, gpmf, video

FILM = video.Video(Path("a.mp4"), 1920, 1080, 30.0, 60.0, None)


# video.py


HEAD = "Input #0, mov\n  Stream #0:0[0x1](und): Video: h264, yuv420p, 1920x1080, 9 kb/s, {}\n"


def opened(monkeypatch, tmp_path, text, frames="frame=  10 x\rframe=  300 y", code=0):
    (tmp_path / "a.mp4").touch()
    outputs = [text, frames]
    monkeypatch.setattr(
        video, "_run", lambda _: SimpleNamespace(stderr=outputs.pop(0).encode(), returncode=code, stdout=b"")
    )
    return video.open_video(tmp_path / "a.mp4")


def test_a_video_is_described_by_ffmpegs_words(monkeypatch, tmp_path):
    text = HEAD.format("29.97 fps, 60 tbr") + "  Stream #0:3(eng): Data: bin_data (gpmd / 0x1)\n"
    found = opened(monkeypatch, tmp_path, text)
    assert (found.width, found.height, found.fps, found.telemetry) == (1920, 1080, 29.97, 3)
    assert found.seconds == pytest.approx(300 / 29.97)
    turned = opened(monkeypatch, tmp_path, HEAD.format("60 tbr") + "displaymatrix: rotation of -90.00 degrees")
    assert (turned.width, turned.height, turned.fps, turned.telemetry) == (1080, 1920, 60.0, None)
    upside = opened(monkeypatch, tmp_path, HEAD.format("1k fps") + "rotation of 180.00 degrees")
    assert (upside.width, upside.fps) == (1920, 1000.0)


@pytest.mark.parametrize(
    ("text", "frames", "code", "words"),
    [
        ("nothing", "", 0, "is not a video that"),
        ("Input #0", "", 0, "has no pictures"),
        (HEAD.format(""), "frame=9", 0, "damaged"),
        (HEAD.format("30 fps"), "frame=0", 0, "damaged"),
        (HEAD.format("30 fps"), "frame=9", 1, "damaged"),
        (HEAD.format("30 fps, attached pic"), "frame=9", 0, "has no pictures"),
        (HEAD.format("30 fps"), "", 0, "damaged"),
        (HEAD.format("1001 fps"), "frame=9", 0, "1920x1080 pixels, 1001 pictures"),
        (HEAD.format("0 fps"), "frame=9", 0, "not a"),
        (HEAD.format("30 fps").replace("1920", "16385"), "frame=9", 0, "not a camera's video: 16385x1080"),
    ],
)
def test_a_file_that_is_no_cameras_video_is_refused(monkeypatch, tmp_path, text, frames, code, words):
    with pytest.raises(InputError, match=words):
        opened(monkeypatch, tmp_path, text, frames, code)


def test_the_largest_video_has_16384_pixels(monkeypatch, tmp_path):
    assert opened(monkeypatch, tmp_path, HEAD.format("30 fps").replace("1920", "16384")).width == 16384


def test_packets_have_their_times_in_ticks(monkeypatch):
    listed = b"#tb 0: 1/1000\n0, 0, 500, 1001, 3, 0xab\n0, 0, 1501, 1000, 2, 0xcd\n"
    outputs = [SimpleNamespace(stdout=listed), SimpleNamespace(stdout=b"abcde")]
    monkeypatch.setattr(video, "_run", lambda _: outputs.pop(0))
    found = video.packets(FILM, 3)
    assert found == [(0.5, pytest.approx(1.001), b"abc"), (pytest.approx(1.501), 1.0, b"de")]
    outputs += [SimpleNamespace(stdout=b"x"), SimpleNamespace(stdout=b"")]
    assert video.packets(FILM, 3) == []


# gpmf.py


def item(name: bytes, kind: bytes, size: int, count: int, body: bytes) -> bytes:
    return struct.pack(">4scBH", name, kind, size, count) + body + bytes(-len(body) % 4)


def test_a_gyro_is_divided_by_its_scale():
    rows = struct.pack(">6h", 100, 200, 300, -100, 0, 50)
    stream = item(b"SCAL", b"s", 2, 1, struct.pack(">h", 100)) + item(b"GYRO", b"s", 6, 2, rows)
    packet = item(b"DEVC", b"\0", 1, len(stream) + 8, item(b"STRM", b"\0", 1, len(stream), stream))
    (found,) = gpmf.streams(packet, b"GYRO")
    assert found.tolist() == [[1.0, 2.0, 3.0], [-1.0, 0.0, 0.5]]
    three = item(b"SCAL", b"s", 2, 3, struct.pack(">3h", 1, 2, 4)) + item(b"GYRO", b"s", 6, 2, rows)
    assert next(gpmf._of_stream(three, b"GYRO"))[0].tolist() == [100.0, 100.0, 75.0]
    two = item(b"SCAL", b"s", 2, 2, struct.pack(">2h", 10, 2)) + item(b"GYRO", b"s", 4, 3, rows)
    assert list(gpmf._of_stream(two, b"GYRO")) == []  # a stream with two axes is not a gyro
    four = item(b"GYRO", b"s", 8, 1, rows)
    assert next(gpmf._of_stream(four, b"GYRO")).tolist() == [[100.0, 200.0, 300.0]]


def test_items_are_padded_to_four_bytes():
    data = item(b"AAAA", b"b", 1, 5, b"12345") + item(b"BBBB", b"b", 2, 2, b"6789")
    assert list(gpmf._items(data)) == [(b"AAAA", b"b", 1, b"12345"), (b"BBBB", b"b", 2, b"6789")]
    assert list(gpmf._items(data[:23])) == [(b"AAAA", b"b", 1, b"12345")]
    assert len(list(gpmf._items(data[:24]))) == 2


def test_readings_of_a_packet_are_spread_over_its_time(monkeypatch):
    film = video.Video(Path("a.mp4"), 8, 8, 30.0, 60.0, 3)
    monkeypatch.setattr(gpmf, "packets", lambda *_: [(1.0, 2.0, b"a"), (3.0, 0.0, b"b"), (3.0, 1.0, b"c")])
    values = {b"a": np.full((4, 3), 0.5), b"b": np.ones((4, 3)), b"c": np.full((4, 3), 1e3)}
    monkeypatch.setattr(gpmf, "streams", lambda packet, key: iter([np.zeros((0, 3)), values[packet]]))
    found = gpmf.telemetry(film)
    assert found is not None
    assert found.t_s == pytest.approx([1.25, 1.75, 2.25, 2.75]) and found.rate_dps[0] == pytest.approx([28.6479] * 3)
    assert gpmf.telemetry(FILM) is None
    monkeypatch.setattr(gpmf, "packets", lambda *_: [])
    assert gpmf.telemetry(film) is None


# camera_match.py


@pytest.fixture
def offset(monkeypatch):
    """Return a function that returns the offset, or the refusal, for a given match at some shifts. The first argument
    is {index of the shift: (correlation, evidence)}.

    The video has 200 cells of 50 ms. The camera's readings begin 0.3 s after the video's first picture.
    """

    def result(given, common=160):
        monkeypatch.setattr(camera_match, "correlations", lambda *_: (found, np.full(799, common)))
        monkeypatch.setattr(camera_match, "log_likelihood_ratio", lambda values, *_: likely * (values > 0.0))
        monkeypatch.setattr(camera_match, "peaks", lambda *_: sorted(given, key=lambda at: -likely[at]))
        found, likely = np.zeros(799), np.zeros(799)
        for at, (correlation, evidence) in given.items():
            found[at], likely[at] = correlation, evidence
            found[[at - 1, at + 1]] = correlation - 0.1
        camera = gpmf.Telemetry(np.linspace(0.3, 10.275, 400), np.random.default_rng(1).normal(size=(400, 3)))
        ride = CellMotion(np.zeros((600, 3)), np.zeros((600, 3)), np.ones(600, dtype=bool), False, False)
        try:
            return camera_match.camera_offset_s(ride, camera)
        except InputError as error:
            return str(error)

    return result


def test_an_offset_by_hand(offset):
    """At index 199 the ride's cells begin with the camera's. At index 299 the shift is 5 s. The first reading of the
    camera is 0.3 s after its first picture."""
    assert offset({199: (0.9, 30.0)}) == pytest.approx((-0.3, 0.9))
    assert offset({299: (0.9, 30.0), 399: (0.8, 24.0)}) == pytest.approx((4.7, 0.9))
    assert offset({299: (0.9, 30.0), 399: (0.8, 24.1)}) == "the camera turns like the bike at several times"
    assert offset({199: (0.5, 15.0)}) == pytest.approx((-0.3, 0.5))
    for none in ({199: (0.5, 14.9)}, {199: (0.49, 30.0)}, {}):
        assert offset(none) == "at no time does the camera turn like the bike"
    assert offset({199: (0.9, 30.0)}, 159) == "at no time does the camera turn like the bike"  # 7.95 s


def test_slow_and_quick_changes_of_the_rate_are_removed():
    """The result of a steady rate is 0. A single cell of 40 deg/s is smoothed to 10 deg/s over 4 cells or 8 deg/s over
    5 cells, and its mean is subtracted."""
    assert camera_match._turning(np.tile([3.0, 4.0, 0.0], (300, 1))) == pytest.approx(np.zeros(300))
    pulse = np.zeros((300, 3))
    pulse[150, 1] = -40.0
    found = camera_match._turning(pulse)
    assert found.sum() == pytest.approx(0.0, abs=1e-9)
    high = found > 1.0
    assert 4 <= high.sum() <= 5 and found[high] == pytest.approx(40.0 / high.sum() - 40.0 / 100.0, abs=0.05)
    assert found[100:145].min() == pytest.approx(-0.4, abs=0.02) and found[90] == pytest.approx(0.0, abs=1e-9)


def test_a_camera_is_averaged_over_cells_less_its_median(monkeypatch):
    """Cells of 50 ms without a reading do not count. The median of the rates is subtracted."""
    given: list = []
    monkeypatch.setattr(camera_match, "correlations", lambda *of: given.append(of) or (np.zeros(9), np.zeros(9)))
    monkeypatch.setattr(camera_match, "_turning", lambda rates: rates)
    monkeypatch.setattr(camera_match, "log_likelihood_ratio", lambda *_: np.zeros(9))
    monkeypatch.setattr(camera_match, "peaks", lambda *_: [])
    t_s = np.array([2.0, 2.01, 2.06, 2.21, 2.22])
    rates = np.outer([1.0, 3.0, 5.0, 8.0, 10.0], [1.0, 10.0, -1.0])
    ride = CellMotion(np.zeros((5, 3)), np.ones((5, 3)), np.ones(5, dtype=bool), False, False)
    with pytest.raises(InputError):
        camera_match.camera_offset_s(ride, gpmf.Telemetry(t_s, rates))
    ((ridden, there, filmed, known),) = given
    assert ridden.tolist() == ride.rate_dps.tolist() and there.all()
    assert known.tolist() == [True, True, False, False, True]
    # the cells have 2, 5 and 9, and their median is 5
    assert filmed[known] == pytest.approx(np.outer([-3.0, 0.0, 4.0], [1.0, 10.0, -1.0]))
