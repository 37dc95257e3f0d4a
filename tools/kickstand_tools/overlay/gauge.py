"""Draws the gauge: a picture of one moment of a ride, with a transparent background.

The gauge has a dial from 60 degrees left to 60 degrees right, and a motorcycle seen from behind that leans like the
rider's. Speed and forces are beside the dial. Text has an outline, so it is legible on snow and in a tunnel.
"""

import math
from functools import lru_cache

from PIL import Image, ImageChops, ImageDraw, ImageFilter, ImageFont

Colour = tuple[int, int, int, int]
Point = tuple[float, float]

WHITE: Colour = (255, 255, 255, 255)
DARK: Colour = (12, 14, 18, 255)
DIM: Colour = (150, 156, 166, 255)
ACCENT: Colour = (255, 176, 0, 255)  # amber, which colour-blind people can distinguish from white and grey
PANEL: Colour = (12, 14, 18, 120)
CLEAR: Colour = (0, 0, 0, 0)
_LAMP: Colour = (214, 40, 40, 255)
_FINER = 4  # shapes are first drawn larger by this factor; reducing them smooths their edges
MOST_DEG = 60.0  # lean at each end of the dial
MOST_G = 1.2  # force at the edge of the circle of forces
SHARE = 0.3  # usual height of the gauge as a share of the video's height
# For a small video the gauge is higher, because its text must be legible. Such a gauge has LEGIBLE_PX pixels, but at
# most MOST_SHARE of the video's height
LEGIBLE_PX, MOST_SHARE = 216.0, 0.45
UPRIGHT_DEG = 0.5  # largest lean that counts as upright
# The lengths below and in Gauge are in hundredths of the gauge's height, if nothing else is said
_WIDTH = 1.72  # width of the gauge divided by its height
_SPREAD = 1.5  # degrees on the dial per degree of lean
_MIDDLE, _SIDE = 60.0, 146.0  # horizontal position of the dial's centre, and of speed and forces
_HALF_DIGIT = 7.8  # half the width of a digit of the lean
_KMH, _MPH = 3.6, 3.6 / 1.609344


def smooth_mask(size: tuple[int, int], draw, finer: int = _FINER) -> Image.Image:
    """Draw a mask with smooth edges, values 0 to 255.

    draw: called with an enlarged ImageDraw and with the factor of enlargement.
    """
    mask = Image.new("L", (size[0] * finer, size[1] * finer), 0)
    draw(ImageDraw.Draw(mask), finer)
    return mask.resize(size, Image.Resampling.BOX)


def outlined(mask: Image.Image, colour: Colour, width: int) -> Image.Image:
    """Draw the shape of a mask in a colour, with a dark edge of `width` pixels."""
    edge = mask.filter(ImageFilter.MaxFilter(2 * width + 1)).filter(ImageFilter.GaussianBlur(width * 0.4))
    picture = Image.new("RGBA", mask.size, DARK[:3] + (0,))
    picture.putalpha(edge)
    shape = Image.new("RGBA", mask.size, colour[:3] + (0,))
    shape.putalpha(mask)
    return Image.alpha_composite(picture, shape)


@lru_cache(maxsize=2000)
def text(words: str, height: float, colour: Colour) -> Image.Image:
    """Draw words with a dark outline, in a picture of the size of the words. height: font height in pixels."""
    stroke = max(1, round(height * 0.09))
    font = ImageFont.load_default(height)
    left, top, right, bottom = font.getbbox(words, stroke_width=stroke)
    ascent = font.getbbox("0", stroke_width=stroke)  # gives all texts the same baseline
    top, bottom = min(top, ascent[1]), max(bottom, ascent[3])
    picture = Image.new("RGBA", (int(right - left) + 2, int(bottom - top) + 2), DARK[:3] + (0,))
    origin = 1 - left, 1 - top
    ImageDraw.Draw(picture).text(origin, words, font=font, fill=colour, stroke_width=stroke, stroke_fill=DARK)
    return picture


def put(picture: Image.Image, part: Image.Image, centre: Point) -> None:
    """Draw a part over a picture, with its middle at centre. Pixels outside the picture are cut off."""
    x, y = round(centre[0] - part.width / 2.0), round(centre[1] - part.height / 2.0)
    left, top = max(0, -x), max(0, -y)
    right, bottom = min(part.width, picture.width - x), min(part.height, picture.height - y)
    if right > left and bottom > top:
        picture.alpha_composite(part.crop((left, top, right, bottom)), (x + left, y + top))


@lru_cache(maxsize=64)
def arrow(size: float, to_the_right: bool, colour: Colour) -> Image.Image:
    """A triangle that points to a side, with an outline."""
    width = max(1, round(size * 0.09))
    side = round(size) + 2 * width + 2

    def draw(pen: ImageDraw.ImageDraw, finer: int) -> None:
        near, far = width * finer, (side - width) * finer
        tip, base = (far, near) if to_the_right else (near, far)
        pen.polygon([(tip, side * finer / 2.0), (base, near), (base, far)], fill=255)

    return outlined(smooth_mask((side, side), draw), colour, width)


@lru_cache(maxsize=8)
def bike(height: float) -> Image.Image:
    """A motorcycle and its rider from behind, upright. The tyre touches the ground in the middle of the square
    picture."""
    side = 2 * round(height * 1.12)
    unit = height / 36.0

    def draw(pen: ImageDraw.ImageDraw, finer: int) -> None:
        def at(x: float, y: float) -> Point:
            return (side / 2.0 + x * unit) * finer, (side / 2.0 - y * unit) * finer

        def line(points: list[Point], width: float) -> None:
            pen.line([at(*point) for point in points], fill=255, width=round(width * unit * finer), joint="curve")
            for x, y in (points[0], points[-1]):
                blob(x, y, width / 2.0)

        def blob(x: float, y: float, radius: float) -> None:
            pen.ellipse([*at(x - radius, y + radius), *at(x + radius, y - radius)], fill=255)

        pen.rounded_rectangle([*at(-2.7, 15), *at(2.7, 0)], radius=2.5 * unit * finer, fill=255)
        pen.polygon([at(-5.5, 19), at(5.5, 19), at(3.4, 12.5), at(-3.4, 12.5)], fill=255)
        pen.polygon([at(-4.8, 17), at(4.8, 17), at(7.8, 26.5), at(4.5, 29), at(-4.5, 29), at(-7.8, 26.5)], fill=255)
        for sign in (-1.0, 1.0):
            line([(sign * 6.6, 26.3), (sign * 11.0, 22.0), (sign * 13.0, 19.0)], 3.0)
            line([(sign * 4.5, 18.0), (sign * 9.0, 13.0), (sign * 6.2, 6.5)], 3.2)
        blob(0.0, 31.8, 4.4)

    picture = outlined(smooth_mask((side, side), draw), WHITE, max(1, round(unit * 0.9)))
    lamp = max(1, round(unit * 1.1))
    middle, up = side // 2, round(16.2 * unit)
    box = [middle - 3 * lamp, middle - up - lamp, middle + 3 * lamp, middle - up + lamp]
    ImageDraw.Draw(picture).rounded_rectangle(box, radius=lamp, fill=_LAMP)
    return picture


@lru_cache(maxsize=8)
def spot(diameter: int, colour: Colour) -> Image.Image:
    """A round spot with an outline. diameter: in pixels, without the outline."""
    width = max(1, round(diameter * 0.12))
    side = diameter + 2 * width + 2  # one pixel around the outline stays empty

    def draw(pen: ImageDraw.ImageDraw, finer: int) -> None:
        near = (width + 1) * finer
        pen.ellipse([near, near, side * finer - near - 1, side * finer - near - 1], fill=255)

    return outlined(smooth_mask((side, side), draw), colour, width)


class Gauge:
    """Draws the gauge with lean and forces.

    video_height: height in pixels of the video that the gauge is for.
    has_speed: also show the speed.
    mph: show the speed in miles per hour instead of kilometres per hour.
    width, height: size of the pictures in pixels. Both are even, as videos require.
    """

    def __init__(self, video_height: int, has_speed: bool = True, mph: bool = False) -> None:
        height = max(SHARE * video_height, min(LEGIBLE_PX, MOST_SHARE * video_height))
        self.height = 2 * round(height / 2.0)
        self.width = 2 * round(self.height * _WIDTH / 2.0)
        self._unit = self.height / 100.0  # pixels per unit of length; the gauge is 100 units high
        self._has_speed, self._mph = has_speed, mph
        self._dial, self._radius = self._px(_MIDDLE, 62.0), round(50.0 * self._unit)
        forces_y, forces_radius = (63.0, 21.0) if has_speed else (46.0, 30.0)
        self._forces, self._forces_radius = self._px(_SIDE, forces_y), forces_radius * self._unit
        self._band = smooth_mask((2 * self._radius, 2 * self._radius), self._draw_band)
        self._still = self._still_picture()

    def picture(
        self, lean_deg: float, forward_g: float, left_g: float, speed_mps: float, left_deg: float, right_deg: float
    ) -> Image.Image:
        """Draw one RGBA picture. Values that are unknown or not trusted are NaN.

        left_deg, right_deg: the largest lean to each side so far.
        """
        picture = self._still.copy()
        is_known = math.isfinite(lean_deg)
        if is_known:
            self._fill(picture, lean_deg)
            upright = bike(34.0 * self._unit)
            leaning = upright.rotate(-max(-75.0, min(75.0, lean_deg)), Image.Resampling.BICUBIC)
            put(picture, leaning, self._px(_MIDDLE, 61.0))
        self._marks(picture, left_deg, right_deg)
        self._show_lean(picture, lean_deg, is_known)
        self._show_side(picture, lean_deg, is_known)
        self._show_forces(picture, forward_g, left_g)
        if self._has_speed:
            scale = _MPH if self._mph else _KMH
            words = f"{scale * speed_mps:.0f}" if math.isfinite(speed_mps) else "--"
            self._text(picture, words, 24.0, WHITE, (_SIDE, 17.0))
        return picture

    def _px(self, x: float, y: float) -> tuple[float, float]:
        return x * self._unit, y * self._unit

    def _text(self, picture: Image.Image, words: str, size: float, colour: Colour, centre: tuple[float, float]) -> None:
        put(picture, text(words, round(size * self._unit, 1), colour), self._px(*centre))

    def _draw_band(self, pen: ImageDraw.ImageDraw, finer: int) -> None:
        """The dial's half ring, as a mask."""
        size, inner = 2 * self._radius * finer, 8.0 * self._unit * finer
        pen.pieslice([0, 0, size - 1, size - 1], 180, 360, fill=255)
        pen.ellipse([inner, inner, size - 1 - inner, size - 1 - inner], fill=0)

    def _still_picture(self) -> Image.Image:
        """Draw the part of the gauge that never changes."""
        picture = Image.new("RGBA", (self.width, self.height), CLEAR)

        def draw(pen: ImageDraw.ImageDraw, finer: int) -> None:
            box = [0, 0, self.width * finer - 1, self.height * finer - 1]
            pen.rounded_rectangle(box, radius=9.0 * self._unit * finer, fill=PANEL[3])

        panel = smooth_mask(picture.size, draw)
        picture.paste(PANEL[:3] + (255,), mask=panel)
        picture.putalpha(panel)
        edge = max(1, round(self._unit * 0.8))
        ring = outlined(self._band, (70, 76, 86, 255), edge)
        put(picture, ring, self._dial)
        for lean in range(-60, 61, 10):
            long = lean % 30 == 0
            self._tick(picture, lean, 42.0 if long else 46.0, 50.0, WHITE if long else DIM)
        for lean in (-60, -30, 30, 60):
            x, y = self._on_dial(lean, 36.0 if abs(lean) == 60 else 37.0)
            self._text(picture, f"{abs(lean)}", 6.5, WHITE, (x, y - 3.0 if abs(lean) == 60 else y))
        self._circle(picture)
        if self._has_speed:
            self._text(picture, "mph" if self._mph else "km/h", 8.0, WHITE, (_SIDE, 33.0))
        return picture

    def _on_dial(self, lean_deg: float, radius: float) -> tuple[float, float]:
        angle = math.radians(_SPREAD * max(-MOST_DEG, min(MOST_DEG, lean_deg)))
        return _MIDDLE + radius * math.sin(angle), 62.0 - radius * math.cos(angle)

    def _tick(self, picture: Image.Image, lean_deg: float, near: float, far: float, colour: Colour) -> None:
        begin, end = (self._px(*self._on_dial(lean_deg, radius)) for radius in (near, far))

        def draw(pen: ImageDraw.ImageDraw, finer: int) -> None:
            line = [(x * finer, y * finer) for x, y in (begin, end)]
            pen.line(line, fill=255, width=max(finer, round(0.9 * self._unit * finer)))

        picture.paste(colour, mask=smooth_mask(picture.size, draw))

    def _circle(self, picture: Image.Image) -> None:
        """Draw the circle of forces, with rings at 0.5 and 1 g and labels at its ends."""
        (x, y), radius = self._forces, self._forces_radius

        def draw(pen: ImageDraw.ImageDraw, finer: int) -> None:
            for ring_g, width in ((0.5, 0.5), (1.0, 0.5), (MOST_G, 1.0)):
                r = radius * ring_g / MOST_G * finer
                box = [x * finer - r, y * finer - r, x * finer + r, y * finer + r]
                pen.ellipse(box, outline=255, width=max(finer, round(width * self._unit * finer)))
            pen.line([(x * finer, (y - radius) * finer), (x * finer, (y + radius) * finer)], fill=120, width=finer)
            pen.line([((x - radius) * finer, y * finer), ((x + radius) * finer, y * finer)], fill=120, width=finer)

        mask = smooth_mask(picture.size, draw)
        picture.alpha_composite(outlined(mask, DIM, max(1, round(self._unit * 0.4))))

    def _fill(self, picture: Image.Image, lean_deg: float) -> None:
        """Fill the band from upright to the lean."""
        size = 2 * self._radius
        angle = _SPREAD * max(-MOST_DEG, min(MOST_DEG, lean_deg))
        begin, end = sorted((270.0, 270.0 + angle))

        def draw(pen: ImageDraw.ImageDraw, finer: int) -> None:
            pen.pieslice([0, 0, size * finer - 1, size * finer - 1], begin, end, fill=255)

        mask = ImageChops.multiply(smooth_mask((size, size), draw, finer=2), self._band)
        corner = round(self._dial[0] - self._radius), round(self._dial[1] - self._radius)
        picture.paste(ACCENT, corner, mask)

    def _marks(self, picture: Image.Image, left_deg: float, right_deg: float) -> None:
        """Mark the largest leans: a line across the dial, and numbers below its ends."""
        pen = ImageDraw.Draw(picture)
        for sign, value in ((-1.0, left_deg), (1.0, right_deg)):
            if value > UPRIGHT_DEG:
                ends = [self._px(*self._on_dial(sign * value, radius)) for radius in (40.0, 52.0)]
                pen.line(ends, fill=DARK, width=max(3, round(2.6 * self._unit)))
                pen.line(ends, fill=WHITE, width=max(1, round(1.4 * self._unit)))
            words = f"max {value:.0f}°" if value > UPRIGHT_DEG else "max --"
            self._text(picture, words, 7.0, WHITE, (_MIDDLE + sign * 44.0, 70.0))

    def _show_lean(self, picture: Image.Image, lean_deg: float, is_known: bool) -> None:
        number = f"{abs(lean_deg):.0f}" if is_known else "--"
        self._text(picture, number, 27.0, WHITE, (_MIDDLE, 84.0))
        if is_known:  # the number is in the middle, so half of it is between the middle and its sign
            self._text(picture, "°", 27.0, WHITE, (_MIDDLE + _HALF_DIGIT * len(number) + 2.5, 84.0))

    def _show_side(self, picture: Image.Image, lean_deg: float, is_known: bool) -> None:
        for sign, word in ((-1.0, "LEFT"), (1.0, "RIGHT")):
            on = is_known and sign * lean_deg > UPRIGHT_DEG
            self._text(picture, word, 7.5, ACCENT if on else DIM, (_MIDDLE + sign * 37.5, 84.5))
            if on:
                mark = arrow(8.0 * self._unit, sign > 0.0, ACCENT)
                put(picture, mark, self._px(_MIDDLE + sign * 54.0, 84.0))

    def _show_forces(self, picture: Image.Image, forward_g: float, left_g: float) -> None:
        """Draw the forces as words, and as a spot in the circle. The words are -- if they are unknown."""
        is_known = math.isfinite(forward_g) and math.isfinite(left_g)
        braking = is_known and forward_g < 0.0
        ends = (
            ("BRAKE" if braking else "ACCEL", abs(forward_g), 92.0 - 3.5),
            ("SIDE" if abs(left_g) < 0.005 else "LEFT" if left_g > 0.0 else "RIGHT", abs(left_g), 95.5),
        )
        for word, value, y in ends:
            self._text(picture, f"{word} {value:.2f} g" if is_known else "-- g", 6.5, WHITE, (_SIDE, y))
        if is_known:
            (x, y), scale = self._forces, self._forces_radius / MOST_G
            size = min(1.0, MOST_G / max(math.hypot(forward_g, left_g), 1e-9)) * scale
            put(picture, spot(round(7.0 * self._unit), ACCENT), (x - left_g * size, y - forward_g * size))
