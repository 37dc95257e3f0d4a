"""Draws the gauge: a picture of one moment of a ride, with a transparent background.

The gauge has a dial from 60 degrees left to 60 degrees right, and a motorcycle seen from behind that leans like the
rider's. Speed and forces are beside the dial. Text has an outline, so it is legible on snow and in a tunnel.
"""

import math

from PIL import Image, ImageChops, ImageDraw

from . import parts
from .parts import ACCENT, DIM, PANEL, WHITE

MOST_DEG = 60.0  # lean at each end of the dial
MOST_G = 1.2  # force at the edge of the circle of forces
SHARE = 0.3  # usual height of the gauge as a share of the video's height
# For a small video the gauge is higher, because its text must be legible. Such a gauge has LEGIBLE_PX pixels, but at
# most MOST_SHARE of the video's height
LEGIBLE_PX, MOST_SHARE = 216.0, 0.45
UPRIGHT_DEG = 0.5  # largest lean that counts as upright
_WIDTH = 1.72  # width of the gauge divided by its height
_SPREAD = 1.5  # degrees on the dial per degree of lean
_MIDDLE, _SIDE = 60.0, 146.0  # horizontal position of the dial's centre, and of speed and forces
_KMH, _MPH = 3.6, 3.6 / 1.609344


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
        self._band = parts.smooth_mask((2 * self._radius, 2 * self._radius), self._draw_band)
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
            bike = parts.bike(34.0 * self._unit)
            turned = bike.rotate(-max(-75.0, min(75.0, lean_deg)), Image.Resampling.BICUBIC)
            parts.put(picture, turned, self._px(_MIDDLE, 61.0))
        self._marks(picture, left_deg, right_deg)
        self._number(picture, lean_deg, is_known)
        self._show_forces(picture, forward_g, left_g)
        if self._has_speed:
            scale = _MPH if self._mph else _KMH
            words = f"{scale * speed_mps:.0f}" if math.isfinite(speed_mps) else "--"
            self._text(picture, words, 24.0, WHITE, (_SIDE, 17.0))
        return picture

    def _px(self, x: float, y: float) -> tuple[float, float]:
        return x * self._unit, y * self._unit

    def _text(
        self, picture: Image.Image, words: str, size: float, colour: parts.Colour, centre: tuple[float, float]
    ) -> None:
        parts.put(picture, parts.text(words, round(size * self._unit, 1), colour), self._px(*centre))

    def _draw_band(self, pen: ImageDraw.ImageDraw, finer: int) -> None:
        """The dial's half ring, as a mask."""
        size, inner = 2 * self._radius * finer, 8.0 * self._unit * finer
        pen.pieslice([0, 0, size - 1, size - 1], 180, 360, fill=255)
        pen.ellipse([inner, inner, size - 1 - inner, size - 1 - inner], fill=0)

    def _still_picture(self) -> Image.Image:
        """Draw the part of the gauge that never changes."""
        picture = Image.new("RGBA", (self.width, self.height), parts.CLEAR)

        def draw(pen: ImageDraw.ImageDraw, finer: int) -> None:
            box = [0, 0, self.width * finer - 1, self.height * finer - 1]
            pen.rounded_rectangle(box, radius=9.0 * self._unit * finer, fill=PANEL[3])

        panel = parts.smooth_mask(picture.size, draw)
        picture.paste(PANEL[:3] + (255,), mask=panel)
        picture.putalpha(panel)
        edge = max(1, round(self._unit * 0.8))
        ring = parts.outlined(self._band, (70, 76, 86, 255), edge)
        parts.put(picture, ring, self._dial)
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

    def _tick(self, picture: Image.Image, lean_deg: float, near: float, far: float, colour: parts.Colour) -> None:
        begin, end = (self._px(*self._on_dial(lean_deg, radius)) for radius in (near, far))

        def draw(pen: ImageDraw.ImageDraw, finer: int) -> None:
            line = [(x * finer, y * finer) for x, y in (begin, end)]
            pen.line(line, fill=255, width=max(finer, round(0.9 * self._unit * finer)))

        picture.paste(colour, mask=parts.smooth_mask(picture.size, draw))

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

        mask = parts.smooth_mask(picture.size, draw)
        picture.alpha_composite(parts.outlined(mask, DIM, max(1, round(self._unit * 0.4))))

    def _fill(self, picture: Image.Image, lean_deg: float) -> None:
        """Fill the band from upright to the lean."""
        size = 2 * self._radius
        angle = _SPREAD * max(-MOST_DEG, min(MOST_DEG, lean_deg))
        begin, end = sorted((270.0, 270.0 + angle))

        def draw(pen: ImageDraw.ImageDraw, finer: int) -> None:
            pen.pieslice([0, 0, size * finer - 1, size * finer - 1], begin, end, fill=255)

        mask = ImageChops.multiply(parts.smooth_mask((size, size), draw, finer=2), self._band)
        corner = round(self._dial[0] - self._radius), round(self._dial[1] - self._radius)
        picture.paste(ACCENT, corner, mask)

    def _marks(self, picture: Image.Image, left_deg: float, right_deg: float) -> None:
        """Mark the largest leans: a line across the dial, and numbers below its ends."""
        pen = ImageDraw.Draw(picture)
        for sign, value in ((-1.0, left_deg), (1.0, right_deg)):
            if value > UPRIGHT_DEG:
                ends = [self._px(*self._on_dial(sign * value, radius)) for radius in (40.0, 52.0)]
                pen.line(ends, fill=parts.DARK, width=max(3, round(2.6 * self._unit)))
                pen.line(ends, fill=WHITE, width=max(1, round(1.4 * self._unit)))
            words = f"max {value:.0f}°" if value > UPRIGHT_DEG else "max --"
            self._text(picture, words, 7.0, WHITE, (_MIDDLE + sign * 44.0, 70.0))

    def _number(self, picture: Image.Image, lean_deg: float, is_known: bool) -> None:
        self._text(picture, f"{abs(lean_deg):.0f}" if is_known else "--", 27.0, WHITE, (_MIDDLE, 84.0))
        if is_known:
            digits = len(f"{abs(lean_deg):.0f}")
            self._text(picture, "°", 27.0, WHITE, (_MIDDLE + 2.5 + 7.8 * digits, 84.0))
        for sign, word in ((-1.0, "LEFT"), (1.0, "RIGHT")):
            on = is_known and sign * lean_deg > UPRIGHT_DEG
            self._text(picture, word, 7.5, ACCENT if on else DIM, (_MIDDLE + sign * 37.5, 84.5))
            if on:
                mark = parts.arrow(8.0 * self._unit, sign > 0.0, ACCENT)
                parts.put(picture, mark, self._px(_MIDDLE + sign * 54.0, 84.0))

    def _show_forces(self, picture: Image.Image, forward_g: float, left_g: float) -> None:
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
            spot = parts.spot(round(7.0 * self._unit), ACCENT)
            parts.put(picture, spot, (x - left_g * size, y - forward_g * size))
