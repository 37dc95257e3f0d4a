"""Files and options that an overlay accepts, messages about refused files and options, and the picture at the ends of a
ride."""

import math
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

pytest.importorskip("PIL")
from kickstand_tools.common.errors import InputError
from kickstand_tools.overlay import overlay, parts, shown, video
from kickstand_tools.overlay.gauge import Gauge
from kickstand_tools.overlay.gpmf import Telemetry

FILM = video.Video(Path("a.mp4"), 1920, 1080, 30.0, 60.0, None)


@pytest.fixture
def check(monkeypatch):
    """Return _check(), for which ffmpeg is installed and every file is a video."""
    monkeypatch.setattr(overlay, "ffmpeg", lambda: "ffmpeg")
    monkeypatch.setattr(overlay, "open_video", lambda path: path)
    return overlay._check


@pytest.mark.parametrize(
    ("out", "film", "offset_s", "height", "found"),
    [
        ("a.mov", None, None, None, None),
        ("a.WEBM", None, None, 720, None),
        ("a.MP4", "film.mp4", 3.0, None, Path("film.mp4")),
        ("a.mp4", "film.mp4", None, None, Path("film.mp4")),
    ],
)
def test_clips_and_videos_have_their_names(check, out, film, offset_s, height, found):
    assert check(Path(out), film, offset_s, height) == found


@pytest.mark.parametrize(
    ("out", "film", "offset_s", "height", "words"),
    [
        ("a.mp4", None, None, None, r"ends in \.mov or \.webm; an \.mp4 needs --video"),
        ("a.mov", None, 0.0, None, "an offset needs a video"),
        ("a.mov", "film.mp4", None, None, r"over a video the name must end in \.mp4"),
        ("a.mp4", "film.mp4", None, 720, "a height is only for a clip"),
    ],
)
def test_other_names_and_options_are_refused(check, out, film, offset_s, height, words):
    with pytest.raises(InputError, match=words):
        check(Path(out), film, offset_s, height)


def test_without_ffmpeg_no_clip_is_begun(monkeypatch):
    def missing():
        raise InputError("no ffmpeg")

    monkeypatch.setattr(overlay, "ffmpeg", missing)
    with pytest.raises(InputError, match="no ffmpeg"):
        overlay._check(Path("a.mov"), None, None, None)


def test_an_offset_that_is_not_found_asks_for_it(monkeypatch):
    def unlike(ride, camera):
        raise InputError("it never turns")

    readings = Telemetry(np.zeros(1), np.zeros((1, 3)))
    monkeypatch.setattr(overlay, "motion", lambda log, progress: "motion")
    for measured, match, words in (
        (None, unlike, r"a\.mp4: it has no gyro readings of a GoPro.*: give --offset"),
        (readings, unlike, r"a\.mp4, RIDE\.csv: it never turns: give --offset"),
    ):
        monkeypatch.setattr(overlay, "telemetry", lambda film, measured=measured: measured)
        monkeypatch.setattr(overlay, "camera_offset_s", match)
        with pytest.raises(InputError, match=words):
            overlay._found_offset(Path("RIDE.csv"), FILM, None)
    monkeypatch.setattr(overlay, "camera_offset_s", lambda ride, camera: (12.5, 0.9))
    assert overlay._found_offset(Path("RIDE.csv"), FILM, None) == (12.5, 0.9)


@pytest.mark.parametrize(("at", "expected"), [(-0.01, 0.0), (0.0, 5.0), (0.15, 5.0), (0.2, 7.0), (9.0, 8.0)])
def test_maxima_are_those_so_far(at, expected):
    none = np.full(4, math.nan)
    made = shown.Shown(np.array([0.0, 0.1, 0.2, 0.3]), none, none, none, none, np.array([5.0, 5, 7, 8]), none)
    assert made.at(np.array([at])).left_deg.tolist() == [expected]


def test_values_are_in_the_gauges_order():
    columns = [np.full(2, value) for value in range(1, 7)]
    made = shown.Shown(np.array([0.0, 0.1]), *columns)
    assert [value[0] for value in made.values] == [1, 2, 3, 4, 5, 6]
    assert [value[0] for value in made.at(np.array([0.05])).values] == pytest.approx([1, 2, 3, 4, 5, 6])


def test_a_single_speed_is_not_shown():
    """Between two speeds, values are interpolated. One speed has no neighbour, and nothing is divided by 0."""
    none, speed = np.full(3, 0.0), np.array([math.nan, 9.0, math.nan])
    made = shown.Shown(np.array([0.0, 0.1, 0.2]), none, none, none, speed, none, none)
    with np.errstate(all="raise"):
        assert made.has_speed and np.all(np.isnan(made.at(np.array([0.05, 0.1])).speed_mps))


@pytest.fixture
def drawn(monkeypatch):
    """Return a function that draws a picture of the gauge, and returns where the spot of the forces is, and the angles
    of the bike."""
    spots, angles = [], []
    put = parts.put
    spot = object()

    def note(picture, part, centre):
        if part is spot:
            spots.append(centre)
        elif part is turned:
            pass
        else:
            put(picture, part, centre)

    turned = SimpleNamespace()
    bike: Any = SimpleNamespace(rotate=lambda angle, how: angles.append(angle) or turned)
    monkeypatch.setattr(parts, "put", note)
    monkeypatch.setattr(parts, "spot", lambda diameter, colour: spot)
    monkeypatch.setattr(parts, "bike", lambda height: bike)

    def draw(lean_deg=0.0, forward_g=0.0, left_g=0.0):
        spots.clear()
        angles.clear()
        Gauge(300).picture(lean_deg, forward_g, left_g, 20.0, 0.0, 0.0)
        return list(spots), list(angles)

    return draw


@pytest.mark.parametrize(
    ("lean_deg", "turned"), [(30.0, -30.0), (-45.0, 45.0), (75.0, -75.0), (90.0, -75.0), (-90.0, 75.0)]
)
def test_the_bike_turns_with_the_lean_up_to_75_degrees(drawn, lean_deg, turned):
    assert drawn(lean_deg)[1] == [turned]


def test_the_spot_of_the_forces_stays_in_its_circle(drawn):
    """Acceleration is upward and a force to the left is on the left. Over 1.2 g the spot is on the circle."""
    ((x, y),) = drawn()[0]
    ((left, _),), ((right, _),) = drawn(left_g=0.6)[0], drawn(left_g=-0.6)[0]
    ((_, ahead),), ((_, back),) = drawn(forward_g=0.6)[0], drawn(forward_g=-0.6)[0]
    assert left - x == x - right == ahead - y == y - back < 0.0
    ((_, edge),), ((_, beyond),) = drawn(forward_g=1.2)[0], drawn(forward_g=5.0)[0]
    assert edge - y == pytest.approx(2.0 * (ahead - y)) and beyond == pytest.approx(edge)
    ((side, ahead),) = drawn(forward_g=3.0, left_g=-4.0)[0]
    assert (side - x, ahead - y) == pytest.approx((0.8 * (y - edge), 0.6 * (edge - y)))
    assert drawn(forward_g=math.nan)[0] == drawn(left_g=math.nan)[0] == []


@pytest.mark.parametrize(("video_height", "height"), [(1080, 324), (600, 216), (480, 216), (200, 90)])
def test_the_gauge_is_legible_in_a_small_video(video_height, height):
    """The gauge has 30 % of the video's height, but at least 216 pixels, and the 216 pixels only up to 45 %."""
    made = Gauge(video_height)
    assert made.height == height and made.width % 2 == 0
