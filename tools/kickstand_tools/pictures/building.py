"""Draws pictures for a rider who builds the device, as SVG: a 5 V display with its level shifter, the supply on the
bike, the six positions, and the places of all parts on the bike."""

from math import cos, radians, sin

from . import wiring
from .drawing import AMBER, BLACK, BLUE, RED, Drawing

Vector = tuple[float, float, float]

_BOARD, _MODULE, _SHIFTER, _METAL, _QUIET = "#1f6b45", "#2a4f9e", "#b3312b", "#b9bec6", "#5b6270"
_WHITE, _PAD = "#ffffff", "#f2c94c"


def drawings(display: str, shifted: str) -> dict[str, str]:
    """Draw the wiring of both boards, and the other drawings.

    display: SVG of the display that is wired to a board.
    shifted: SVG of the display that is wired to the level shifter.
    Returns {file name: SVG}.
    """
    return {
        "wiring_pico.svg": wiring.draw(wiring.PICO, display),
        "wiring_esp32.svg": wiring.draw(wiring.ESP32, display),
        "display_5v.svg": shifter(wiring.PICO, shifted),
        "supply.svg": supply(),
        "six_positions.svg": six_positions(),
        "on_the_bike.svg": on_the_bike(),
    }


def shifter(board: wiring.DrawnBoard, display: str) -> str:
    """Draw a display with VCC at 5 V, and the level shifter between its SDA and SCL and a board. display: SVG of the
    display."""
    pins = wiring.pin_names(board)
    five = pins["5V"]
    page = Drawing(900, 330)
    left, low, high, right = 190, 400, 500, 640
    rows = {"5V": 96, "3V3": 140, "GND": 184, "SDA": 228, "SCL": 272}
    page.wire(RED, (left, rows["5V"]), (low - 40, rows["5V"]), (low - 40, 54), (high + 60, 54), (high + 60, rows["5V"]))
    page.wire(RED, (high, rows["5V"]), (right, rows["5V"]))
    page.disc(high + 60, rows["5V"], 6, RED)
    page.wire("#e07b2f", (left, rows["3V3"]), (low, rows["3V3"]))
    page.wire(BLACK, (left, rows["GND"]), (low, rows["GND"]))
    page.wire(BLACK, (high, rows["GND"]), (right, rows["GND"]))
    for name, colour in (("SDA", BLUE), ("SCL", AMBER)):
        page.wire(colour, (left, rows[name]), (low, rows[name]))
        page.wire(colour, (high, rows[name]), (right, rows[name]))
    page.box(30, 66, left - 30, 236, _BOARD, 10)
    page.text((30 + left) / 2, 34, board.title, 16, "middle", bold=True)
    _pads(page, left, -1, [five, "3V3", "GND", pins["SDA"], pins["SCL"]], list(rows.values()))
    page.box(low, 66, high - low, 236, _SHIFTER, 10)
    page.text((low + high) / 2, 26, "Level shifter, BSS138", 16, "middle", bold=True)
    _pads(page, low, 1, ["LV", "GND", "LV1", "LV2"], [rows[name] for name in ("3V3", "GND", "SDA", "SCL")])
    _pads(page, high, -1, ["HV", "GND", "HV1", "HV2"], [rows[name] for name in ("5V", "GND", "SDA", "SCL")])
    page.box(right, 66, 230, 236, _MODULE, 10)
    page.text(right + 115, 34, "Display for 5 V, I2C backpack", 16, "middle", bold=True)
    _pads(page, right, 1, ["VCC", "GND", "SDA", "SCL"], [rows[name] for name in ("5V", "GND", "SDA", "SCL")])
    page.picture(right + 60, 110, 160, 60, display)
    page.text(left + 14, 82, "5 V", 13, colour=RED, bold=True)
    page.text(left + 14, 126, "3.3 V", 13, colour="#b8560f", bold=True)
    return page.svg()


def supply() -> str:
    """Draw the supply of the board from switched 12 V."""
    page = Drawing(900, 210)
    y, ground = 84, 146
    page.wire(RED, (150, y), (520, y))
    page.wire(BLACK, (150, ground), (520, ground))
    page.wire(_QUIET, (650, 115), (760, 115))
    page.box(30, 54, 120, 122, "#3a3f4a", 8)
    page.text(90, 100, "12 V", 20, "middle", _WHITE, True)
    page.text(90, 124, "that the ignition", 11, "middle", _WHITE)
    page.text(90, 140, "switches", 11, "middle", _WHITE)
    page.box(230, y - 18, 90, 36, "#ece6d2", 10)
    page.wire(RED, (230, y), (320, y))
    page.text(275, y - 34, "Fuse 1 to 2 A", 14, "middle", bold=True)
    page.text(275, y + 34, "close to where the 12 V are taken", 12, "middle")
    page.text(335, ground + 18, "ground: frame, or minus of the battery", 12, "middle")
    page.box(520, 60, 130, 110, _MODULE, 8)
    page.text(585, 104, "12 V to 5 V", 15, "middle", _WHITE, True)
    page.text(585, 126, "USB adapter", 13, "middle", _WHITE)
    page.text(705, 96, "USB cable", 13, "middle")
    page.box(760, 74, 110, 82, _BOARD, 8)
    page.box(752, 104, 18, 22, _METAL, 3)
    page.text(822, 115, "board", 14, "middle", _WHITE, True)
    return page.svg()


# The directions of the sensor's axes x, y and z in each position. A direction is (right, up, towards the viewer).
_POSITIONS: dict[str, tuple[Vector, Vector, Vector]] = {
    "+z": ((1, 0, 0), (0, 0, -1), (0, 1, 0)),
    "-z": ((1, 0, 0), (0, 0, 1), (0, -1, 0)),
    "+x": ((0, 1, 0), (-1, 0, 0), (0, 0, 1)),
    "-x": ((0, -1, 0), (1, 0, 0), (0, 0, 1)),
    "+y": ((1, 0, 0), (0, 1, 0), (0, 0, 1)),
    "-y": ((-1, 0, 0), (0, -1, 0), (0, 0, 1)),
}
_SLANT = radians(35)
_SLANTED: tuple[Vector, Vector, Vector] = (
    (cos(_SLANT), -sin(_SLANT), 0),
    (0, 0, -1),
    (sin(_SLANT), cos(_SLANT), 0),
)
_SAYS = {"+z": "face up", "-z": "face down", "+x": "X up", "-x": "X down", "+y": "Y up", "-y": "Y down"}
_HALF = (44.0, 34.0, 6.0)  # half of the sensor board's size along its axes, in pixels


def six_positions(columns: int = 7) -> str:
    """Draw the six positions of the sensor with their names on the display, and the slanted pose that checks them.

    columns: number of poses side by side.
    """
    poses = [*_POSITIONS.items(), ("", _SLANTED)]
    table = [(-47, -50, -47), (47, -50, -47), (47, -50, 47), (-47, -50, 47)]
    page = Drawing(140 * columns, 215 * -(-len(poses) // columns))
    for k, (name, axes) in enumerate(poses):
        middle, top = 70 + 140 * (k % columns), 215 * (k // columns)
        page.shape("#e4dfd0", *(_seen(middle, top + 128, corner) for corner in table))
        _lay(page, middle, top + 128, axes)
        page.text(middle, top + 20, name or "then slanted", 17 if name else 14, "middle", bold=True)
        page.text(middle, top + 42, _SAYS.get(name, "the proof"), 15, "middle", _QUIET)
    return page.svg()


def _lay(page: Drawing, x: float, y: float, axes: tuple[Vector, Vector, Vector]) -> None:
    """Draw the sensor's board on the table, with the arrows printed on its face."""
    lowest = sum(abs(axis[1]) * half for axis, half in zip(axes, _HALF))

    def at(*of_sensor: float) -> tuple[float, float]:
        place = [sum(part * axis[k] for part, axis in zip(of_sensor, axes)) for k in range(3)]
        return _seen(x, y, (place[0], place[1] - 50 + lowest, place[2]))

    for which in range(3):
        side = 1.0 if sum(axes[which]) > 0 else -1.0  # seen from the right, from above and from the front
        along, across = [k for k in range(3) if k != which]
        corners = []
        for one, other in ((-1, -1), (1, -1), (1, 1), (-1, 1)):
            corner = [0.0, 0.0, 0.0]
            corner[which] = side * _HALF[which]
            corner[along], corner[across] = one * _HALF[along], other * _HALF[across]
            corners.append(at(*corner))
        page.shape(_MODULE if which == 2 else "#1d3872", *corners)
        if which == 2 and side > 0:
            top = _HALF[2]
            page.shape("#15171c", at(-9, -9, top), at(9, -9, top), at(9, 9, top), at(-9, 9, top))
            for letter, tip, wings in (
                ("X", (36, -20), ((28, -26), (28, -14))),
                ("Y", (-30, 27), ((-36, 19), (-24, 19))),
            ):
                page.wire(_WHITE, at(-30, -20, top), at(*tip, top), width=2.5)
                page.wire(_WHITE, at(*wings[0], top), at(*tip, top), at(*wings[1], top), width=2.5)
                beside = at(30, -6, top) if letter == "X" else at(-16, 24, top)
                page.text(*beside, letter, 12, "middle", _WHITE, True)
        elif which == 2:
            page.text(*at(0, 0, -_HALF[2]), "back", 11, "middle", "#b9c8ea")


def _seen(x: float, y: float, place: Vector) -> tuple[float, float]:
    """Project a point to the drawing. The viewer looks from the right, from above and from the front.

    x, y: the origin in the drawing. place: the point (right, up, towards the viewer).
    """
    right, up, near = place
    return x + 0.71 * (right - near), y - 0.78 * up + 0.36 * (right + near)


def on_the_bike() -> str:
    """Draw a motorcycle from its left side, with the place of each part."""
    page = Drawing(900, 470)
    dark, frame, paint = "#22252b", "#6b717c", "#c63c06"
    page.box(0, 404, 900, 66, "#dcd6c6", 0)
    for x in (250, 640):
        page.disc(x, 318, 88, dark)
        page.disc(x, 318, 62, "#f7f5ef")
        page.disc(x, 318, 12, frame)
    page.wire(frame, (250, 318), (330, 130), width=12)  # fork
    page.wire(frame, (640, 318), (470, 300), width=12)  # swing arm
    page.wire(frame, (330, 150), (420, 330), (500, 330), (520, 190), (340, 165), width=8)
    page.shape("#8a9099", (372, 228), (478, 228), (492, 318), (400, 330))  # engine
    page.wire("#9aa0a8", (400, 330), (430, 366), (640, 366), width=14)  # exhaust
    page.shape(paint, (344, 138), (380, 112), (470, 122), (500, 186), (372, 196))  # tank
    page.shape(dark, (486, 158), (600, 160), (668, 136), (660, 172), (560, 196), (500, 190))  # seat
    page.shape(paint, (560, 196), (662, 172), (700, 150), (694, 176), (590, 218))  # tail
    page.wire(dark, (330, 130), (352, 100), (384, 96), width=8)  # handlebar
    page.disc(292, 138, 20, "#f2e9c8")  # headlight
    page.wire(_QUIET, (470, 336), (432, 402), width=8)  # kickstand
    page.box(528, 198, 56, 26, _BOARD, 5)
    page.box(318, 82, 44, 24, "#1640ab", 4)
    page.disc(376, 82, 8, "#c8141b")
    page.box(440, 204, 34, 22, "#3a3f4a", 4)
    page.wire(RED, (474, 214), (500, 214), (528, 211), width=3)
    page.wire(BLUE, (528, 204), (430, 176), (352, 128), (340, 106), width=3)
    where = "firm on frame or tail, at any angle,", "away from the exhaust's heat"
    _label(page, (556, 198), (610, 56), "Board and sensor, in a dry box", *where)
    _label(page, (334, 82), (40, 40), "Display and button", "where you see and reach them")
    _label(page, (457, 204), (420, 30), "12 V through a fuse", "that the ignition switches")
    _label(page, (280, 246), (20, 190), "Not the sensor:", "fork and handlebar steer")
    _label(page, (438, 394), (300, 440), "Lean it on its kickstand: press. Upright: press again.")
    return page.svg()


def _label(page: Drawing, part: tuple[float, float], words_at: tuple[float, float], title: str, *lines: str) -> None:
    """Draw words with a line to the part that they name."""
    x, y = words_at
    under = y + 18 * len(lines) + 10 if part[1] > y else y - 12
    page.wire("#1d1f24", part, (x + 40, under), width=1.5)
    page.text(x, y, title, 15, bold=True)
    for k, line in enumerate(lines):
        page.text(x, y + 18 * (k + 1), line, 13)


def _pads(page: Drawing, x: float, inwards: int, names: list[str], heights: list[int]) -> None:
    """Draw pins at an edge of a module. inwards: 1 if the module is to the right of the edge."""
    for name, y in zip(names, heights):
        page.disc(x, y, 7, _PAD)
        page.text(x + 14 * inwards, y, name, 13, "start" if inwards > 0 else "end", _WHITE, True)
