"""Parts of the gauge's picture: text with an outline, arrows, and the motorcycle seen from behind."""

from functools import lru_cache

from PIL import Image, ImageDraw, ImageFilter, ImageFont

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
    """A round spot with an outline."""
    width = max(1, round(diameter * 0.12))
    side = diameter + 2 * width + 2

    def draw(pen: ImageDraw.ImageDraw, finer: int) -> None:
        near = (width + 1) * finer
        pen.ellipse([near, near, side * finer - near - 1, side * finer - near - 1], fill=255)

    return outlined(smooth_mask((side, side), draw), colour, width)
