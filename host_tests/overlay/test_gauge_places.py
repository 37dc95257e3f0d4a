"""The places of what the gauge draws, by its geometry."""

import math
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

pytest.importorskip("PIL")
from kickstand_tools.common.errors import InputError
from kickstand_tools.joining.motion import CellMotion
from kickstand_tools.overlay import camera_match, gpmf, overlay, parts, video
from kickstand_tools.overlay.gauge import Gauge
from kickstand_tools.overlay.parts import ACCENT, DIM, WHITE
from kickstand_tools.overlay.shown import Shown
from PIL import Image

NAN = math.nan


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


# overlay.py


def part(offset=None, begin=None, end=None, seconds=60.0, film=True):
    of = video.Video(Path("a.mp4"), 8, 8, 30.0, seconds, None) if film else None
    ride: Any = SimpleNamespace(t_s=np.array([0.0, 100.0]))
    return overlay._part(ride, of, offset, begin, end, "RIDE")


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
    band, hole, _, *rest = pen.shapes
    assert band == ("pieslice", [0.0, 0.0, 299.0, 299.0], 180, 360, {"fill": 255})
    assert hole == ("ellipse", [24.0, 24.0, 275.0, 275.0], {"fill": 0})
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


def test_a_text_has_a_margin_of_one_pixel():
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
