"""The parts of an overlay: the places of what is drawn, the part of the ride, ffmpeg's words, a camera's packets."""

import math
import struct
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

pytest.importorskip("PIL")

from kickstand_tools.common.errors import InputError
from kickstand_tools.joining.motion import CellMotion
from kickstand_tools.overlay import camera_match, gpmf, overlay, parts, shown, video
from kickstand_tools.overlay.gauge import Gauge
from kickstand_tools.overlay.parts import ACCENT, DIM, WHITE
from kickstand_tools.overlay.shown import Shown
from PIL import Image

NAN = math.nan
FILM = video.Video(Path("a.mp4"), 1920, 1080, 30.0, 60.0, None)


class Drawing:
    """Records what a Gauge of 300 pixels draws. One unit is 3 pixels.

    texts: {words: (height, colour, x, y)}, in units.
    """

    def __init__(self, monkeypatch, **given):
        self.texts: dict[str, tuple] = {}
        self.spots, self.arrows, self.bikes, self.pieces = [], [], [], []
        marks: dict[int, tuple] = {}
        real_put, real_text, real_mask = parts.put, parts.text, parts.smooth_mask
        real_spot, real_arrow, real_bike = parts.spot, parts.arrow, parts.bike

        def text(words, height, colour):
            made = real_text(words, height, colour).copy()
            marks[id(made)] = (words, height / 3.0, colour)
            self.kept.append(made)
            return made

        def put(picture, part, centre):
            at = centre[0] / 3.0, centre[1] / 3.0
            if id(part) in marks:
                words, height, colour = marks[id(part)]
                self.texts[words] = (pytest.approx(height), colour, pytest.approx(at[0]), pytest.approx(at[1]))
            else:
                self.pieces.append((part.size, at))
            real_put(picture, part, centre)

        self.kept: list[Image.Image] = []
        monkeypatch.setattr(parts, "smooth_mask", lambda size, draw, finer=1: real_mask(size, draw, 1))  # faster
        monkeypatch.setattr(parts, "text", text)
        monkeypatch.setattr(parts, "put", put)
        monkeypatch.setattr(parts, "spot", lambda *of: self.spots.append(of) or real_spot(*of))
        monkeypatch.setattr(parts, "arrow", lambda *of: self.arrows.append(of) or real_arrow(*of))
        monkeypatch.setattr(parts, "bike", lambda height: self.bikes.append(height) or real_bike(height))
        self.gauge = Gauge(1000, **given)

    def show(self, *values: float) -> Image.Image:
        self.texts.clear()
        self.pieces.clear()
        return self.gauge.picture(*values)


@pytest.fixture(scope="module")
def gauge() -> Gauge:
    return Gauge(1000)


def test_the_gauge_is_300_pixels_high_and_172_as_wide(gauge):
    assert (gauge.height, gauge.width) == (300, 516)


def test_what_never_changes_is_at_its_place(monkeypatch):
    texts = Drawing(monkeypatch).texts
    assert set(texts) == {"60", "30", "km/h"}
    # at 30 degrees the dial is at 45 degrees: 60 + 37 sin 45, 62 - 37 cos 45
    assert texts["30"] == (6.5, WHITE, 60 + 37 * math.sqrt(0.5), 62 - 37 * math.sqrt(0.5))
    assert texts["60"] == (6.5, WHITE, 60 + 36, 62 - 3)
    assert texts["km/h"] == (8.0, WHITE, 146, 33)
    assert "mph" in Drawing(monkeypatch, mph=True).texts
    assert set(Drawing(monkeypatch, has_speed=False).texts) == {"60", "30"}


def test_words_and_numbers_of_a_right_lean(monkeypatch):
    drawing = Drawing(monkeypatch)
    drawing.show(31.4, 0.25, -0.5, 20.0, 12.4, 44.6)
    texts = drawing.texts
    assert texts["31"] == (27.0, WHITE, 60, 84) and texts["°"] == (27.0, WHITE, 60 + 2.5 + 15.6, 84)
    assert texts["LEFT"] == (7.5, DIM, 22.5, 84.5) and texts["RIGHT"] == (7.5, ACCENT, 97.5, 84.5)
    assert texts["max 12°"] == (7.0, WHITE, 16, 70) and texts["max 45°"] == (7.0, WHITE, 104, 70)
    assert texts["72"] == (24.0, WHITE, 146, 17)
    assert texts["ACCEL 0.25 g"] == (6.5, WHITE, 146, 88.5) and texts["RIGHT 0.50 g"] == (6.5, WHITE, 146, 95.5)
    assert drawing.arrows == [(24.0, True, ACCENT)] and drawing.spots == [(21, ACCENT)] and drawing.bikes == [102.0]
    assert drawing.pieces[0][1] == pytest.approx((60.0, 61.0))  # the motorcycle
    assert drawing.pieces[1][1] == pytest.approx((114.0, 84.0))  # the arrow
    # the circle has a radius of 21 for 1.2 g: 0.5 g to the right are 8.75, and 0.25 g forward are 4.375 up
    assert drawing.pieces[2][1] == pytest.approx((146 + 8.75, 63 - 4.375))


def test_words_and_numbers_of_a_left_lean(monkeypatch):
    drawing = Drawing(monkeypatch, mph=True)
    drawing.show(-5.0, -2.4, 0.0, 44.704, 0.0, 0.51)
    texts = drawing.texts
    assert texts["5"][2] == 60 and texts["°"][2] == 60 + 2.5 + 7.8 and texts["LEFT"][1] == ACCENT
    assert texts["100"] == (24.0, WHITE, 146, 17) and "max --" in texts and "max 1°" in texts
    assert "BRAKE 2.40 g" in texts and "SIDE 0.00 g" in texts
    assert drawing.arrows == [(24.0, False, ACCENT)]
    assert drawing.pieces[1][1] == pytest.approx((6.0, 84.0))
    assert drawing.pieces[2][1] == pytest.approx((146.0, 63 + 21.0))  # at the edge of the circle


def test_small_and_unknown_values_have_their_words(monkeypatch):
    drawing = Drawing(monkeypatch, has_speed=False)
    drawing.show(0.5, 0.0, 0.006, 20.0, 0.5, 0.0)
    assert drawing.texts["LEFT"][1] == drawing.texts["RIGHT"][1] == DIM and not drawing.arrows
    assert "ACCEL 0.00 g" in drawing.texts and "LEFT 0.01 g" in drawing.texts and "72" not in drawing.texts
    assert "max --" in drawing.texts and not any(words.startswith("max 0") for words in drawing.texts)
    # without a speed the circle has its middle at 46 and a radius of 30
    assert drawing.pieces[-1][1] == pytest.approx((146 - 30 * 0.005, 46.0), abs=1e-6)
    drawing.show(0.0, 0.0, -0.004, NAN, 0.0, 0.0)
    assert "SIDE 0.00 g" in drawing.texts
    unknown = Drawing(monkeypatch)
    unknown.show(NAN, NAN, 0.0, NAN, 0.0, 0.0)
    assert {"--", "-- g", "max --"} <= set(unknown.texts) and not unknown.pieces and not unknown.bikes


def pixels(picture: Image.Image) -> np.ndarray:
    return np.asarray(picture, dtype=int)


def test_ticks_are_every_ten_degrees_and_longer_every_thirty(gauge):
    """At 45 of 50 units from the middle only the long ticks are white; at 48 units every tick is drawn."""
    still = pixels(gauge._still)
    for lean in range(-60, 61, 5):
        x, y = (round(3.0 * value) for value in gauge._on_dial(lean, 48.0))
        bright = still[max(y - 1, 0) : y + 2, x - 1 : x + 2, :3].max()
        assert (bright > 120) == (lean % 10 == 0)
        x, y = (round(3.0 * value) for value in gauge._on_dial(lean, 44.0))
        long = still[y - 1 : y + 2, x - 1 : x + 2, :3].max() > 200
        assert long == (lean % 30 == 0)


def test_the_rings_of_forces_are_at_half_one_and_12_g(gauge):
    """With a radius of 63 pixels for 1.2 g, the rings are 26.25, 52.5 and 63 pixels from the middle."""
    still = pixels(gauge._still)
    row = still[189 + 8, 438:].sum(axis=1)  # beside the line through the middle
    along = np.sqrt(np.maximum(np.array([26.25, 52.5, 63.0]) ** 2 - 64.0, 0.0))
    for ring in along:
        assert row[round(ring) - 1 : round(ring) + 2].max() > 450
    for between in (13, 38, 57):
        assert row[between] < 450


def test_the_band_of_the_dial_is_eight_units_wide(gauge):
    """Around 75 degrees from upright (50 degrees of lean) the band is filled from 42 to 50 units."""
    picture = pixels(gauge.picture(60.0, NAN, NAN, NAN, 0.0, 0.0))

    def amber(lean, radius):
        x, y = (round(3.0 * value) for value in gauge._on_dial(lean, radius))
        return bool(np.abs(picture[y, x, :3] - ACCENT[:3]).max() < 12)

    assert [amber(45, radius) for radius in (41.0, 43.5, 46.0, 48.5, 51.5)] == [False, True, True, True, False]
    assert not amber(-5, 46.0) and amber(5, 46.0) and amber(59, 48.0)


def test_the_largest_lean_has_a_line_from_40_to_52(gauge):
    plain, marked = (pixels(gauge.picture(NAN, NAN, NAN, NAN, left, 0.0)) for left in (0.0, 45.0))
    for radius, drawn in ((38.0, False), (41.0, True), (46.0, True), (51.0, True), (54.0, False)):
        x, y = (round(3.0 * value) for value in gauge._on_dial(-45.0, radius))
        assert bool(np.abs(plain - marked)[y, x].max() > 60) is drawn


# parts.py


def test_an_outline_is_dark_and_around_the_shape():
    mask = Image.new("L", (21, 21), 0)
    mask.paste(255, (8, 8, 13, 13))
    found = pixels(parts.outlined(mask, WHITE, 2))
    assert found[10, 10].tolist() == [255, 255, 255, 255] and found[10, 7, 3] > 200 and found[10, 7, 0] < 20
    assert found[10, 6, 3] > 100 and found[10, 4, 3] < 60 and found[10, 2, 3] == 0


def test_a_part_is_put_with_its_middle_and_cut():
    picture = Image.new("RGBA", (10, 10), parts.CLEAR)
    parts.put(picture, Image.new("RGBA", (4, 2), WHITE), (5.0, 5.0))
    assert np.argwhere(pixels(picture)[..., 3]).min(axis=0).tolist() == [4, 3]
    assert np.argwhere(pixels(picture)[..., 3]).max(axis=0).tolist() == [5, 6]
    for centre, count in (((0.0, 0.0), 2), ((10.0, 10.0), 2), ((-2.0, 5.0), 0), ((12.0, 5.0), 0), ((9.0, 5.0), 6)):
        picture = Image.new("RGBA", (10, 10), parts.CLEAR)
        parts.put(picture, Image.new("RGBA", (4, 2), WHITE), centre)
        assert np.count_nonzero(pixels(picture)[..., 3]) == count


def test_a_mask_is_drawn_larger_and_reduced():
    seen = []

    def draw(pen, finer):
        seen.append(finer)
        pen.rectangle([0, 0, 2 * finer - 1, 0.5 * finer - 1], fill=255)

    found = pixels(parts.smooth_mask((4, 2), draw))
    assert seen == [4] and found[0].tolist() == [128, 128, 0, 0] and not found[1].any()


def test_texts_have_one_baseline_and_a_margin():
    low, high, dash = (parts.text(words, 30.0, WHITE) for words in ("g", "0", "-"))
    assert dash.height == high.height < low.height
    found = pixels(high)
    assert (found[0].max() < 20 and found[..., :3].max() == 255 and not found[0, :, 3].any()) or found[
        0, :, 3
    ].max() < 255


def test_an_arrow_and_a_spot_have_their_sizes():
    """An outline is 9 % of an arrow's size, and 12 % of a spot's."""
    for right in (True, False):
        found = pixels(parts.arrow(50.0, right, ACCENT))
        assert found.shape == (50 + 2 * 4 + 2, 60, 4)  # 4.5 is rounded to 4
        shape = np.abs(found[..., :3] - ACCENT[:3]).max(axis=2) < 12
        assert (shape[30, 5:55].sum() >= 45) and shape.sum() == pytest.approx(52 * 52 / 2, rel=0.06)
        assert (shape[:, 50].sum() < 12) == right and (shape[:, 9].sum() < 12) != right
    found = pixels(parts.spot(50, ACCENT))
    assert found.shape == (64, 64, 4)
    shape = np.abs(found[..., :3] - ACCENT[:3]).max(axis=2) < 12
    assert shape.sum() == pytest.approx(math.pi * 25**2, rel=0.06)
    assert (np.argwhere(shape).mean(axis=0) == pytest.approx((31.5, 31.5), abs=0.6)) and found[32, 32, 3] == 255


def test_the_motorcycle_has_its_shape():
    """With a height of 360 pixels, a unit has 10. The outer width at each height follows from the lines that are drawn:
    the tyre is 5.4 wide, and the head has a radius of 4.4 at a height of 31.8."""
    found = pixels(parts.bike(360.0))
    side = 2 * round(360 * 1.12)
    assert found.shape == (side, side, 4)
    white = (found[..., :3].min(axis=2) > 250) & (found[..., 3] == 255)
    assert (white == white[:, ::-1]).mean() > 0.99

    def width(units):
        columns = np.flatnonzero(white[round(side / 2 - 10 * units)])
        return 0 if not len(columns) else columns[-1] - columns[0] + 1

    assert width(4.0) == pytest.approx(54, abs=2)
    assert width(31.8) == pytest.approx(88, abs=2)
    assert width(35.0) == pytest.approx(2 * math.sqrt(44**2 - 32**2), abs=3)
    assert width(19.0) == pytest.approx(2 * 145, abs=6)  # the hands: 13 and half of 3
    assert width(13.0) == pytest.approx(2 * 106, abs=8)  # the knees: 9 and half of 3.2
    assert width(6.5) == pytest.approx(2 * 78, abs=4)  # the feet: 6.2 and half of 3.2
    assert width(28.9) == pytest.approx(2 * 46, abs=6)  # the shoulders
    assert width(-0.5) == width(36.6) == 0
    red = np.abs(found[..., :3] - (214, 40, 40)).max(axis=2) < 12
    rows, columns = np.argwhere(red)[:, 0], np.argwhere(red)[:, 1]
    assert (np.ptp(columns) + 1, np.ptp(rows) + 1) == (67, 23)  # 6 and 2 times 11, and one
    assert rows.mean() == pytest.approx(side / 2 - 162, abs=1) and columns.mean() == pytest.approx(side / 2, abs=1)


# shown.py


def seen(t_s, lean=None, speed=None) -> Shown:
    t_s = np.array(t_s, dtype=float)
    lean, speed = (np.full(len(t_s), NAN) if of is None else np.array(of, dtype=float) for of in (lean, speed))
    return Shown(
        t_s, lean, lean, lean, speed, np.linspace(1.0, len(t_s), len(t_s)), np.linspace(11.0, len(t_s) + 10.0, len(t_s))
    )


def test_a_lean_is_shown_up_to_a_gap_of_200_ms():
    values = seen([0.0, 0.2, 0.41, 0.5], [0.0, 2.0, 4.0, 5.0]).at(np.array([-0.09, 0.1, 0.3, 0.5, 0.54, 0.56]))
    assert values.lean_deg == pytest.approx([-0.9, 1.0, NAN, 5.0, 5.0 + 4 / 9, NAN], nan_ok=True)
    assert values.left_deg.tolist() == [0.0, 1.0, 2.0, 4.0, 4.0, 4.0]
    assert np.isnan(seen([0.0, 0.2], [0.0, 2.0]).at(np.array([-0.11])).lean_deg).all()


def test_a_speed_is_shown_up_to_3_s_apart():
    t_s = np.arange(0.0, 8.0, 0.5)
    speed = np.full(16, NAN)
    speed[[0, 6, 13]] = 10.0, 16.0, 20.0  # at 0, 3 and 6.5 s
    values = seen(t_s, None, speed).at(np.array([0.0, 1.5, 3.0, 5.0]))
    assert values.speed_mps == pytest.approx([10.0, 13.0, NAN, NAN], nan_ok=True)
    speed[3:] = NAN
    assert np.isnan(seen(t_s, None, speed).at(t_s).speed_mps).all() and seen(t_s, None, speed).has_speed
    assert not seen(t_s).has_speed


def test_forces_are_means_and_only_trusted_leans_are_shown():
    t_s = np.arange(200) / 100.0
    block = SimpleNamespace(
        t_s=t_s, trusted=t_s >= 1.0, lean_deg=np.full(200, 8.0), forward_g=(t_s >= 1.0) * 0.6,
        lateral_g=(t_s >= 1.0) * -0.3, speed_mps=t_s,
    )  # fmt: skip
    ride: Any = SimpleNamespace(blocks=lambda progress, notices: [block])
    found = shown.shown(ride)
    assert np.isnan(found.lean_deg[:100]).all() and found.lean_deg[100] == 8.0
    assert found.right_deg[[99, 114, 115, 199]].tolist() == [0.0, 0.0, 8.0, 8.0] and not found.left_deg.any()
    assert found.forward_g[[80, 120]] == pytest.approx([0.0, 0.6]) and 0.0 < found.forward_g[95] < 0.3
    assert found.forward_g[100] == pytest.approx(0.3, abs=0.02) and found.left_g[150] == pytest.approx(-0.3)


# overlay.py


def part(offset=None, begin=None, end=None, seconds=60.0, film=True):
    of = video.Video(Path("a.mp4"), 8, 8, 30.0, seconds, None) if film else None
    ride: Any = SimpleNamespace(t_s=np.array([0.0, 100.0]))
    return overlay._part(ride, of, offset, begin, end, "RIDE")


@pytest.mark.parametrize(
    ("given", "found"),
    [({"film": False}, (0.0, 100.0)), ({"film": False, "begin": 20.0, "end": 150.0}, (20.0, 100.0))]
    + [({"film": False, "begin": -30.0, "end": -10.0}, (70.0, 90.0)), ({"film": False, "begin": -300.0}, (0.0, 100.0))]
    + [({"offset": 12.5}, (12.5, 72.5)), ({"offset": -1.0}, (-1.0, 59.0)), ({"offset": 41.0}, (41.0, 101.0))]
    + [({"offset": 12.5, "begin": 5.0}, (12.5, 72.5)), ({"offset": 12.5, "begin": 20.0, "end": 30.0}, (20.0, 30.0))]
    + [({"offset": -20.0, "end": 90.0}, (0.0, 40.0)), ({"offset": 60.0, "begin": 70.0}, (70.0, 100.0))],
)
def test_the_drawn_part_of_a_ride(given, found):
    assert part(**given) == pytest.approx(found)


@pytest.mark.parametrize(
    ("given", "words"),
    [({"offset": 100.0}, "they have nothing in common"), ({"offset": -60.0}, "they have nothing in common")]
    + [({"offset": -1.1}, r"from -1\.1 to 58\.9 s of .* with --from 0\.0 --to 58\.9")]
    + [
        ({"offset": 41.1}, r"with --from 41\.1 --to 100\.0"),
        ({"film": False, "begin": 30.0, "end": 30.0}, "nothing from"),
    ]
    + [({"film": False, "begin": 100.0, "end": 110.0}, r"RIDE lasts 100\.0 s: there is nothing from 100\.0 to")],
)
def test_a_part_outside_the_ride_is_refused(given, words):
    with pytest.raises(InputError, match=words):
        part(**given)


def test_the_gauge_is_in_the_lower_left_corner():
    made = overlay._laid_over(FILM, 2.5, 7.25, 25.0, ["GAUGE"], 32)
    assert made[:4] == ["-ss", "2.5000", "-t", "7.2500"] and "GAUGE" in made
    assert "overlay=x=32:y=main_h-overlay_h-32:eof_action=repeat[all]" in made[made.index("-filter_complex") + 1]
    assert ",fps=25[film]" in made[made.index("-filter_complex") + 1]
    plain = overlay._laid_over(FILM, -0.5, 1.0, None, [], 1)
    assert plain[1] == "0.0000" and "fps" not in plain[plain.index("-filter_complex") + 1]
    at = plain.index("0:a?")
    assert plain[plain.index("-crf") + 1] == "18" and plain[at - 3 : at] == ["-map", "[all]", "-map"]
    assert plain[at + 1 : at + 3] == ["-c:a", "copy"]


def overlaid(monkeypatch, film=None, **given):
    """Return the Overlaid, ffmpeg's arguments, the number of pictures, and what the gauge gets."""
    calls: list = []
    ride = seen(np.arange(0.0, 10.0, 0.1), np.arange(100.0), np.ones(100))
    monkeypatch.setattr(overlay, "_check", lambda *_: film)
    monkeypatch.setattr(overlay, "read_twice", lambda source: source)
    monkeypatch.setattr(
        overlay, "open_ride", lambda *_, smoothed: calls.append(smoothed) or SimpleNamespace(name="R", log=1)
    )
    monkeypatch.setattr(overlay, "shown", lambda *_: ride)

    class Drawn:
        def __init__(self, height, has_speed, mph):
            calls.append((height, has_speed, mph))
            self.width, self.height = 50, 30

        def picture(self, *values):
            calls.append(values)
            return SimpleNamespace(tobytes=lambda: b"x")

    monkeypatch.setattr("kickstand_tools.overlay.gauge.Gauge", Drawn)

    def write(path, arguments, pictures, each):
        calls.append(arguments)
        for _ in pictures:
            each()

    monkeypatch.setattr(overlay, "write_video", write)
    return overlay.overlay("r", given.pop("out"), **given), calls


def test_a_clip_has_30_pictures_a_second(monkeypatch, tmp_path):
    done: list = []
    found, calls = overlaid(
        monkeypatch, out=tmp_path / "a.mov", from_s=2.0, to_s=4.0, progress=lambda *of: done.append(of), live=True
    )
    assert (found.pictures, found.fps, found.begin_s, found.end_s, found.offset_s) == (60, 30.0, 2.0, 4.0, None)
    assert calls[0] is False and calls[1] == (1080, True, False)
    assert calls[2][:10] == ["-f", "rawvideo", "-pix_fmt", "rgba", "-s", "50x30", "-r", "30", "-i", "-"]
    assert calls[3][0] == pytest.approx(20.0) and calls[4][0] == pytest.approx(20.0 + 10.0 / 30.0)
    assert done[0] == (1, 60) and done[-1] == (60, 60) and len(done) == 60
    found, calls = overlaid(monkeypatch, out=tmp_path / "a.webm", fps=10.0, height=720, mph=True, from_s=9.895)
    assert found.pictures == 1 and calls[0] is True and calls[1] == (720, True, True)


def test_over_a_video_the_gauge_follows_its_smaller_side(monkeypatch, tmp_path):
    film = video.Video(Path("a.mp4"), 700, 1000, 25.0, 4.0, None)
    found, calls = overlaid(monkeypatch, film, out=tmp_path / "a.mp4", offset_s=3.0)
    assert found.pictures == 100 and calls[1][0] == 700 and found.offset_s == 3.0
    assert "overlay=x=21:y" in " ".join(calls[2]) and calls[2][:4] == ["-ss", "0.0000", "-t", "4.0000"]
    monkeypatch.setattr(overlay, "_found_offset", lambda *_: (5.0, 0.9))
    found, calls = overlaid(monkeypatch, film, out=tmp_path / "a.mp4", from_s=6.0, to_s=7.0)
    assert (found.offset_s, found.correlation, found.begin_s) == (5.0, 0.9, 6.0)
    assert calls[2][:4] == ["-ss", "1.0000", "-t", "1.0000"]


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
    ]
    + [(HEAD.format("30 fps"), "frame=0", 0, "damaged"), (HEAD.format("30 fps"), "frame=9", 1, "damaged")]
    + [
        (HEAD.format("30 fps, attached pic"), "frame=9", 0, "has no pictures"),
        (HEAD.format("30 fps"), "", 0, "damaged"),
    ]
    + [
        (HEAD.format("1001 fps"), "frame=9", 0, "1920x1080 pixels, 1001 pictures"),
        (HEAD.format("0 fps"), "frame=9", 0, "not a"),
    ]
    + [(HEAD.format("30 fps").replace("1920", "16385"), "frame=9", 0, "not a camera's video: 16385x1080")],
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
    assert list(gpmf._of_stream(two, b"GYRO")) == []  # two axes are too few
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
    """Return a function of what each shift gives: {place: (correlation, evidence)}.

    The video has 200 cells of 50 ms. Its readings begin 0.3 s after its first picture."""

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
    """The place 199 is the same begin; the place 299 is 5 s later. The first reading is 0.3 s after the picture."""
    assert offset({199: (0.9, 30.0)}) == pytest.approx((-0.3, 0.9))
    assert offset({299: (0.9, 30.0), 399: (0.8, 24.0)}) == pytest.approx((4.7, 0.9))
    assert offset({299: (0.9, 30.0), 399: (0.8, 24.1)}) == "the camera turns like the bike at several times"
    assert offset({199: (0.5, 15.0)}) == pytest.approx((-0.3, 0.5))
    for none in ({199: (0.5, 14.9)}, {199: (0.49, 30.0)}, {}):
        assert offset(none) == "at no time does the camera turn like the bike"
    assert offset({199: (0.9, 30.0)}, 159) == "at no time does the camera turn like the bike"  # 7.95 s


def test_slow_and_quick_changes_of_the_rate_are_removed():
    """A steady rate leaves nothing. One cell of 40 deg/s counts as 10 over 4 or 8 over 5 cells, less its mean."""
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


# the shapes, as they are passed to the pen


class Pen:
    """Records the shapes that are drawn, with one pixel per pixel of the mask."""

    def __init__(self):
        self.shapes: list[tuple] = []

    def __getattr__(self, name):
        def draw(box, *more, **how):
            points = [value for point in box for value in (point if isinstance(point, tuple) else (point,))]
            self.shapes.append((name, [round(float(value), 6) for value in points], *more, how))

        return draw


@pytest.fixture
def pen(monkeypatch):
    """Let smooth_mask() pass its shapes to a Pen, and return the Pen."""
    made, real = Pen(), parts.smooth_mask

    def smooth_mask(size, draw, finer=4):
        draw(made, 1)
        return real(size, draw, finer)

    monkeypatch.setattr(parts, "smooth_mask", smooth_mask)
    return made


def test_the_shapes_of_the_gauge(pen):
    """A Gauge of 300 pixels has units of 3 pixels: the dial has a radius of 150, and the band is 24 pixels wide."""
    gauge = Gauge(1000)
    band, hole, panel, *rest = pen.shapes
    assert band == ("pieslice", [0.0, 0.0, 299.0, 299.0], 180, 360, {"fill": 255})
    assert hole == ("ellipse", [24.0, 24.0, 275.0, 275.0], {"fill": 0})
    assert panel == ("rounded_rectangle", [0.0, 0.0, 515.0, 299.0], {"radius": 27.0, "fill": 120})
    ticks, rings = rest[:13], rest[13:]
    assert all(tick[2] == {"fill": 255, "width": 3} for tick in ticks)
    assert ticks[6][1] == [180.0, 60.0, 180.0, 36.0]  # upright: from 42 to 50 units above 62
    assert ticks[0][1] == [180.0 - 126.0, 186.0, 30.0, 186.0]  # 60 degrees to the left
    sine, cosine = math.sin(math.radians(75)), math.cos(math.radians(75))
    long = [180 - 138 * sine, 186 - 138 * cosine, 180 - 150 * sine, 186 - 150 * cosine]
    assert ticks[1][1] == pytest.approx(long)
    assert [ring[2] for ring in rings[:3]] == [{"outline": 255, "width": width} for width in (2, 2, 3)]
    assert rings[0][1] == [438 - 26.25, 189 - 26.25, 438 + 26.25, 189 + 26.25]
    assert rings[2][1] == [438.0 - 63.0, 189.0 - 63.0, 438.0 + 63.0, 189.0 + 63.0]
    assert rings[3] == ("line", [438.0, 126.0, 438.0, 252.0], {"fill": 120, "width": 1})
    assert rings[4] == ("line", [375.0, 189.0, 501.0, 189.0], {"fill": 120, "width": 1})
    for lean, begin, end in ((20.0, 270.0, 300.0), (-20.0, 240.0, 270.0), (70.0, 270.0, 360.0)):
        pen.shapes.clear()
        gauge._fill(Image.new("RGBA", (516, 300)), lean)
        assert pen.shapes == [("pieslice", [0.0, 0.0, 299.0, 299.0], begin, end, {"fill": 255})]


def test_the_shapes_of_an_arrow_a_spot_and_the_motorcycle(pen):
    parts.arrow.cache_clear()
    parts.spot.cache_clear()
    parts.bike.cache_clear()
    parts.arrow(50.0, True, ACCENT)
    parts.arrow(50.0, False, ACCENT)
    parts.spot(50, ACCENT)
    assert pen.shapes == [
        ("polygon", [56.0, 30.0, 4.0, 4.0, 4.0, 56.0], {"fill": 255}),
        ("polygon", [4.0, 30.0, 56.0, 4.0, 56.0, 56.0], {"fill": 255}),
        ("ellipse", [7.0, 7.0, 56.0, 56.0], {"fill": 255}),
    ]  # fmt: skip
    pen.shapes.clear()
    parts.bike(360.0)  # a unit has 10 pixels, and the middle is at 403
    tyre, seat, back, *limbs, head = pen.shapes

    def at(*points):
        return [value for x, y in points for value in (403.0 + 10 * x, 403.0 - 10 * y)]

    assert tyre == ("rounded_rectangle", at((-2.7, 15), (2.7, 0)), {"radius": 25.0, "fill": 255})
    assert seat[1] == at((-5.5, 19), (5.5, 19), (3.4, 12.5), (-3.4, 12.5))
    assert back[1] == at((-4.8, 17), (4.8, 17), (7.8, 26.5), (4.5, 29), (-4.5, 29), (-7.8, 26.5))
    assert head == ("ellipse", at((-4.4, 36.2), (4.4, 27.4)), {"fill": 255})
    arm, hand_1, hand_2, leg = limbs[0], limbs[1], limbs[2], limbs[3]
    assert arm == ("line", at((-6.6, 26.3), (-11.0, 22.0), (-13.0, 19.0)), {"fill": 255, "width": 30, "joint": "curve"})
    assert hand_1[1] == at((-8.1, 27.8), (-5.1, 24.8)) and hand_2[1] == at((-14.5, 20.5), (-11.5, 17.5))
    assert leg == ("line", at((-4.5, 18.0), (-9.0, 13.0), (-6.2, 6.5)), {"fill": 255, "width": 32, "joint": "curve"})
    mirrored = [shape[1] for shape in limbs[6:] if shape[0] == "line"]
    assert mirrored == [at((6.6, 26.3), (11.0, 22.0), (13.0, 19.0)), at((4.5, 18.0), (9.0, 13.0), (6.2, 6.5))]


def test_the_colours_and_sizes_of_texts():
    assert (WHITE, DIM, ACCENT) == ((255, 255, 255, 255), (150, 156, 166, 255), (255, 176, 0, 255))
    assert (parts.DARK, parts.PANEL, parts.CLEAR) == ((12, 14, 18, 255), (12, 14, 18, 120), (0, 0, 0, 0))
    from PIL import ImageFont

    for words, height, stroke in (("60", 50.0, 4), ("g", 30.0, 3), ("-", 5.0, 1)):
        font = ImageFont.load_default(height)
        left, top, right, bottom = font.getbbox(words, stroke_width=stroke)
        _, zero_top, _, zero_bottom = font.getbbox("0", stroke_width=stroke)
        size = int(right - left) + 2, int(max(bottom, zero_bottom) - min(top, zero_top)) + 2
        found = parts.text(words, height, ACCENT)
        assert found.size == size
        inside = pixels(found)[1:-1, 1:-1, 3]
        assert inside.sum() == pixels(found)[..., 3].sum() > 0
