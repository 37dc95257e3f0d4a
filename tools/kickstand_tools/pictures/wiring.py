"""Draws the wiring of sensor, display and button to a Pico and to an ESP32 as SVG. The firmware's port.py defines the
pins."""

import runpy
from typing import NamedTuple

from ..common import firmware_path
from ..simulated_board import simulator
from .drawing import AMBER, BLACK, BLUE, RED, Drawing


class DrawnBoard(NamedTuple):
    """A board seen from above. near, far: the pins of each side, from the top down. The near side faces the modules."""

    title: str
    machine: str  # a key of simulated_board.fakes.chips.MACHINES
    pin_prefix: str  # the text before the GPIO number in a pin's name
    near: tuple[str, ...]
    far: tuple[str, ...]
    near_is_left: bool
    numbered: bool  # True if pins have numbers, counted down the near side, then up the far side


PICO = DrawnBoard(
    "Raspberry Pi Pico",
    "pico",
    "GP",
    tuple("GP0 GP1 GND GP2 GP3 GP4 GP5 GND GP6 GP7 GP8 GP9 GND GP10 GP11 GP12 GP13 GND GP14 GP15".split()),
    tuple("VBUS VSYS GND 3V3_EN 3V3 VREF GP28 GND GP27 GP26 RUN GP22 GND GP21 GP20 GP19 GP18 GND GP17 GP16".split()),
    True,
    True,
)
ESP32 = DrawnBoard(
    "ESP32-DevKitC",
    "esp32",
    "",
    tuple("GND 23 22 TX RX 21 GND 19 18 5 17 16 4 0 2 15 D1 D0 CLK".split()),
    tuple("3V3 EN VP VN 34 35 32 33 25 26 27 14 12 GND 13 D2 D3 CMD 5V".split()),
    False,
    False,
)

_GREEN = "#2b8a4b"
_PAD = "#f2c94c"  # colour of a pin in use
_COLOURS = {"SDA": BLUE, "SCL": AMBER, "signal": _GREEN}
_WIDTH, _HEIGHT = 900, 570
_LEFT, _RIGHT = 76, 256  # edges of the board
_FIRST_PIN_Y, _PITCH = 120, 20
_MODULE_LEFT, _MODULE_RIGHT = 540, 830
_MODULE_MIDDLE = (_MODULE_LEFT + _MODULE_RIGHT) // 2
_SENSOR_PINS_Y, _SENSOR_SUPPLY_Y = (114, 140, 166), 140
_DISPLAY_PINS_Y, _DISPLAY_SUPPLY_Y = (290, 320, 350), 320
_BUTTON_PINS_Y = (460, 500)
_CHANNELS = (320, 350)  # x of the two vertical parts of the wires to a module
_GROUND_X, _SUPPLY_X, _OUTSIDE_X, _TOP_Y = 380, 866, 36, 36


def connections(board: DrawnBoard) -> list[tuple[str, dict[str, str]]]:
    """Return the connections in the drawing as [(module, {pin of the module: pin of the board})]."""
    near, far = ({name: row + 1 for row, name in enumerate(side)} for side in (board.near, board.far))

    def pin(name: str) -> str:
        if not board.numbered:
            return f"GPIO {name}" if name.isdigit() else name
        return f"{name}, pin {near[name] if name in near else 2 * len(board.far) + 1 - far[name]}"

    pins = {module: {one: pin(name) for one, name in taken.items()} for module, taken in _default_pins(board).items()}
    supply = {"VCC": pin("3V3"), "GND": "any GND"}
    return [
        ("Sensor", supply | pins["sensor"]),
        ("Display", supply | pins["display"]),
        ("Button", {"one side": pins["button"]["signal"], "other side": "any GND"}),
    ]


def pin_names(board: DrawnBoard) -> dict[str, str]:
    """Return the names of the board's pins for SDA and SCL of a display, and of the pin with 5 V from USB."""
    return _default_pins(board)["display"] | {"5V": board.far[0] if board.far[0] == "VBUS" else board.far[-1]}


def draw(board: DrawnBoard, display: str) -> str:
    """Draw a board with its modules. display: SVG of the display, which is drawn in its module."""
    page = Drawing(_WIDTH, _HEIGHT, mirrored=board.near_is_left)
    pins = _default_pins(board)
    row = {module: [board.near.index(name) for name in names.values()] for module, names in pins.items()}
    grounds = [r for r, name in enumerate(board.near) if name == "GND"]
    ground = next(r for r in grounds if max(row["sensor"]) < r < min(row["display"]))
    supply = board.far.index("3V3")
    used_near, used_far = {ground, *(r for rows in row.values() for r in rows)}, {supply}

    _draw_supply(page, _pin_y(supply))
    _draw_ground(page, _pin_y(ground))
    sensor = _draw_signals(page, board, pins["sensor"], _SENSOR_PINS_Y[:2], _CHANNELS)
    screen = _draw_signals(page, board, pins["display"], _DISPLAY_PINS_Y[1:], _CHANNELS[::-1])
    if grounds[-1] > max(row["display"]):  # a ground pin is further up than the button's pin
        used_near.add(grounds[-1])
        page.wire(BLACK, (_RIGHT, _pin_y(grounds[-1])), (_MODULE_LEFT, _BUTTON_PINS_Y[0]))
        _draw_signals(page, board, pins["button"], _BUTTON_PINS_Y[1:], _CHANNELS)
    else:  # the ground wire starts on the other side and leads around the board
        ground = board.far.index("GND")
        used_far.add(ground)
        _draw_signals(page, board, pins["button"], _BUTTON_PINS_Y[:1], _CHANNELS)
        x, y, bottom = _CHANNELS[0], _BUTTON_PINS_Y[1], _HEIGHT - 24
        around = ((_OUTSIDE_X, _pin_y(ground)), (_OUTSIDE_X, bottom), (x, bottom), (x, y))
        page.wire(BLACK, (_LEFT, _pin_y(ground)), *around, (_MODULE_LEFT, y))

    _draw_board(page, board, used_near, used_far)
    _draw_module(page, 68, 122, "Sensor: MPU6050 (GY-521)", [*sensor, "GND"], _SENSOR_PINS_Y, _SENSOR_SUPPLY_Y)
    page.text(_MODULE_MIDDLE, _SENSOR_SUPPLY_Y, "XDA, XCL, AD0, INT: open", 13, "middle", "#d7e4ff")
    title = "Display: OLED, or LCD for 3.3 V"
    _draw_module(page, 248, 130, title, ["GND", *screen], _DISPLAY_PINS_Y, _DISPLAY_SUPPLY_Y)
    page.picture(_MODULE_MIDDLE - 62, _DISPLAY_SUPPLY_Y - 32, 124, 70, display)
    _draw_module(page, 432, 96, "Push button", ["", ""], _BUTTON_PINS_Y)
    page.box(_MODULE_MIDDLE - 24, 464, 48, 48, "#c9ccd2", 6)
    page.disc(_MODULE_MIDDLE, 488, 16, "#2b2f38")
    return page.svg()


def _draw_signals(
    page: Drawing, board: DrawnBoard, pins: dict[str, str], places: tuple[int, ...], channels: tuple[int, ...]
) -> list[str]:
    """Draw a module's wires in the order of the board's pins, to avoid crossings.

    places: heights of the module's pins.
    channels: x of the vertical parts of the wires.
    Returns the module's pins in the order of the board's pins.
    """
    order = sorted(pins, key=lambda pin: board.near.index(pins[pin]))
    for pin, y, x in zip(order, places, channels):
        pin_y = _pin_y(board.near.index(pins[pin]))
        page.wire(_COLOURS[pin], (_RIGHT, pin_y), (x, pin_y), (x, y), (_MODULE_LEFT, y))
    return order


def _default_pins(board: DrawnBoard) -> dict[str, dict[str, str]]:
    """Read the default pins of this board from the firmware's port.py.

    The function installs a simulated board, so do not call it while another simulated board is installed.
    Returns {module: {pin of the module: name of the board's pin}}.
    """
    with simulator.Board(lambda t_s: (0, 0, 1, 0, 0, 0), machine=board.machine):
        port = runpy.run_path(str(firmware_path.PACKAGE / "board" / "port.py"))

    def name(number: int) -> str:
        return f"{board.pin_prefix}{number}"

    pins = {
        module: {"SDA": name(port[pair][0]), "SCL": name(port[pair][1])}
        for module, pair in (("sensor", "SENSOR_PINS"), ("display", "LCD_PINS"))
    }
    return {**pins, "button": {"signal": name(port["BUTTON_PIN"])}}


def _pin_y(row: int) -> int:
    return _FIRST_PIN_Y + _PITCH * row


def _draw_supply(page: Drawing, pin_y: int) -> None:
    """Draw the 3.3 V wire around the outside to the far edge of both modules."""
    around = ((_OUTSIDE_X, pin_y), (_OUTSIDE_X, _TOP_Y), (_SUPPLY_X, _TOP_Y), (_SUPPLY_X, _DISPLAY_SUPPLY_Y))
    page.wire(RED, (_LEFT, pin_y), *around, (_MODULE_RIGHT, _DISPLAY_SUPPLY_Y))
    page.wire(RED, (_SUPPLY_X, _SENSOR_SUPPLY_Y), (_MODULE_RIGHT, _SENSOR_SUPPLY_Y))
    page.disc(_SUPPLY_X, _SENSOR_SUPPLY_Y, 6, RED)


def _draw_ground(page: Drawing, pin_y: int) -> None:
    """Draw the ground wire from one pin to the sensor above and the display below."""
    for y in (_SENSOR_PINS_Y[2], _DISPLAY_PINS_Y[0]):
        page.wire(BLACK, (_RIGHT, pin_y), (_GROUND_X, pin_y), (_GROUND_X, y), (_MODULE_LEFT, y))
    page.disc(_GROUND_X, pin_y, 6, BLACK)


def _draw_board(page: Drawing, board: DrawnBoard, used_near: set[int], used_far: set[int]) -> None:
    rows = len(board.near)
    top, height = _FIRST_PIN_Y - 18, _PITCH * (rows - 1) + 36
    middle = (_LEFT + _RIGHT) / 2
    page.box(middle - 28, top - 16 if board.near_is_left else top + height - 14, 56, 30, "#b9bec6", 4)  # USB
    page.box(_LEFT, top, _RIGHT - _LEFT, height, "#1f6b45" if board.near_is_left else "#23272e", 10)
    page.text(middle, _TOP_Y + 24, board.title, 16, "middle", bold=True)
    for side, names, used in (("near", board.near, used_near), ("far", board.far, used_far)):
        edge, inwards, anchor = (_RIGHT, -1, "end") if side == "near" else (_LEFT, 1, "start")
        for row, name in enumerate(names):
            taken = row in used
            page.disc(edge, _pin_y(row), 7, _PAD if taken else "#8f8a70")
            if not board.numbered:
                words = name
            else:  # write the number next to the edge
                words = f"{row + 1}  {name}" if side == "near" else f"{name}  {2 * rows - row}"
            size, colour = (14, "#ffffff") if taken else (13, "#b9cbc1")
            page.text(edge + 14 * inwards, _pin_y(row), words, size, anchor, colour, taken)


def _draw_module(
    page: Drawing, top: int, height: int, title: str, pins: list[str], places: tuple[int, ...], supply_y: int = 0
) -> None:
    """Draw a module.

    pins: names of the pins on the edge that faces the board.
    places: heights of these pins.
    supply_y: height of the pin VCC on the other edge.
    """
    colour = "#2a4f9e" if supply_y else "#5b6270"
    page.box(_MODULE_LEFT, top, _MODULE_RIGHT - _MODULE_LEFT, height, colour)
    page.text(_MODULE_MIDDLE, top + 18, title, 14, "middle", "#ffffff", True)
    for name, y in zip(pins, places):
        page.disc(_MODULE_LEFT, y, 7, _PAD)
        page.text(_MODULE_LEFT + 14, y, name, 13, "start", "#ffffff", True)
    if supply_y:
        page.disc(_MODULE_RIGHT, supply_y, 7, _PAD)
        page.text(_MODULE_RIGHT - 14, supply_y, "VCC", 13, "end", "#ffffff", True)
