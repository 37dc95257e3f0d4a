"""ffmpeg's answers about a video, how it is started and stopped, and the gyro of a GoPro in a video."""

import sys
from pathlib import Path

import pytest
from kickstand_tools.common.messages import InputError
from kickstand_tools.overlay import video


def described(ffmpeg, rate="30 fps", size="1920x1080", more="", **counted):
    film = ffmpeg.film(300, size, rate, more)
    ffmpeg.answers(**counted)
    return video.open_video(film)


@pytest.mark.parametrize(
    ("text", "width", "height", "fps", "telemetry"),
    [
        ({"rate": "29.97 fps, 60 tbr", "more": "  Stream #0:3(eng): Data: (gpmd / 0x1)\n"}, 1920, 1080, 29.97, 3),
        ({"rate": "60 tbr", "more": "displaymatrix: rotation of -90.00 degrees"}, 1080, 1920, 60.0, None),
        ({"rate": "1k fps", "more": "displaymatrix: rotation of 180.00 degrees"}, 1920, 1080, 1000.0, None),
        ({"size": "16384x16"}, 16384, 16, 30.0, None),
    ],
)
def test_a_video_is_described_by_ffmpegs_words(ffmpeg, text, width, height, fps, telemetry):
    video = described(ffmpeg, **text)
    assert (video.width, video.height, video.fps, video.telemetry) == (width, height, fps, telemetry)
    assert video.seconds == pytest.approx(300 / fps)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ({"rate": ""}, "is a damaged video: copy it again"),
        ({"size": "x"}, "damaged"),
        ({"counted": ""}, "damaged"),
        ({"counted": "frame=0"}, "damaged"),
        ({"status": "1"}, "damaged"),
        ({"rate": "30 fps, attached pic"}, "has no pictures"),
        ({"rate": "1001 fps"}, "not a camera's video: 1920x1080 pixels, 1001 pictures"),
        ({"rate": "0 fps"}, "not a camera's video"),
        ({"size": "16385x1080"}, "not a camera's video: 16385x1080"),
    ],
)
def test_a_file_that_is_no_cameras_video_is_refused(ffmpeg, text, words):
    with pytest.raises(InputError, match=words):
        described(ffmpeg, **text)


def test_a_path_without_a_file_is_explained(tmp_path):
    with pytest.raises(InputError, match="is a directory, not a video"):
        video.open_video(tmp_path)
    with pytest.raises(InputError, match=r"a\.mp4: there is no such file"):
        video.open_video(tmp_path / "a.mp4")


def test_file_name_is_no_protocol_and_opens_no_network():
    assert video.input_of(Path("12:30.mp4")) == ["-protocol_whitelist", "file,pipe", "-i", "file:12:30.mp4"]


def test_missing_packages_and_a_missing_ffmpeg_are_explained(monkeypatch):
    import imageio_ffmpeg

    def no_program():
        raise RuntimeError("No ffmpeg exe could be found")

    monkeypatch.setattr(imageio_ffmpeg, "get_ffmpeg_exe", no_program)
    with pytest.raises(InputError, match="no ffmpeg for this system: install ffmpeg"):
        video.ffmpeg()
    for name in ("imageio_ffmpeg", "PIL"):
        monkeypatch.setitem(sys.modules, name, None)
        with pytest.raises(InputError, match=r"overlay needs imageio-ffmpeg and Pillow: .*\[video\]"):
            video.ffmpeg()


@pytest.mark.parametrize("deaf", [False, True])
@pytest.mark.parametrize(("words", "message"), [("one\nthe last \n\n", "the last$"), ("", "it does not say why")])
def test_ffmpeg_that_fails_says_why(ffmpeg, words, message, deaf):
    """A deaf ffmpeg ends before it has read the pictures."""
    ffmpeg.answers(words=words, status="1", **({"deaf": ""} if deaf else {}))
    with pytest.raises(InputError, match="ffmpeg has stopped: " + message):
        video.write_video(Path("o.mp4"), ["-f", "rawvideo"], [bytes(1_000_000)] * 3)


# The gyro of a GoPro
