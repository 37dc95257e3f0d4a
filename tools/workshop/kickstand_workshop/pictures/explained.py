"""Draws two pictures that explain the lean: the forces in a bend, and three leans of one simulated ride."""

import io
from math import cos, radians, sin, tan

import numpy as np
from kickstand_tools.calibration.poses import fit_six_positions, fit_two_positions
from kickstand_tools.logs.log import Log
from kickstand_tools.pictures.drawing import AMBER, BLUE, RED, Drawing
from kickstand_tools.replay.replay import replay
from kickstand_tools.simulation.ride import ride as simulate_ride

_LEAN_DEG = 35.0
_G = 150.0  # length of an arrow of 1 g, in pixels
_DARK, _PAINT, _QUIET = "#22252b", "#c63c06", "#5b6270"
_COLOURS = 64
_PROFILE, _SEED, _SECONDS, _SHOWN_S = "track", 1, 120.0, (40.0, 100.0)


def forces() -> str:
    """Draw a motorcycle from behind in a bend to the right, and the forces on it."""
    page = Drawing(900, 400)
    foot, lean = (330.0, 340.0), radians(_LEAN_DEG)

    def at(along: float, aside: float = 0.0) -> tuple[float, float]:
        """Return a point on the bike in pixels. along: distance above the tyre. aside: distance to the right."""
        return foot[0] + along * sin(lean) + aside * cos(lean), foot[1] - along * cos(lean) + aside * sin(lean)

    page.box(0, 340, 900, 60, "#dcd6c6", 0)
    page.wire("#c9c2ae", foot, (foot[0], 40.0), width=2)
    page.wire(_DARK, at(10), at(78), width=26)
    page.shape("#8a9099", at(70, -34), at(70, 34), at(112, 30), at(112, -30))
    page.shape(_PAINT, at(108, -26), at(108, 26), at(160, 20), at(160, -20))
    page.wire("#33405a", at(160, -4), at(216, -2), width=40)
    page.disc(*at(250), 24, "#d5480f")
    middle = at(135)
    up = (middle[0], middle[1] - _G)
    tip = (middle[0] + _G * tan(lean), up[1])
    page.wire("#c9c2ae", tip, up, width=2)
    _arrow(page, BLUE, middle, up)
    _arrow(page, AMBER, middle, (tip[0], middle[1]))
    page.wire("#c9c2ae", (tip[0], middle[1]), tip, width=2)
    _arrow(page, RED, middle, tip)
    arc = [(foot[0] + 105 * sin(lean * k / 12), foot[1] - 105 * cos(lean * k / 12)) for k in range(13)]
    page.wire(_QUIET, *arc, width=2)
    page.text(foot[0] + 22, foot[1] - 122, "t", 18, "middle", bold=True)
    page.text(up[0] - 12, up[1] + 12, "1 g, against gravity", 15, "end", BLUE, True)
    page.text(tip[0] + 14, middle[1], "s, towards the middle of the bend", 15, "start", "#8a5f00", True)
    page.text(tip[0] + 14, tip[1], "the force that the sensor measures:", 15, "start", RED, True)
    page.text(tip[0] + 14, tip[1] + 22, "along the bike, 1 g / cos t", 15, "start", RED, True)
    page.text(40, 300, "lean t, > 0 to the right", 15, colour=_QUIET)
    page.text(40, 322, f"here {_LEAN_DEG:.0f}°: |s| = tan t = {tan(lean):.2f} g", 15, colour=_QUIET)
    return page.svg()


def _arrow(page: Drawing, colour: str, tail: tuple[float, float], tip: tuple[float, float]) -> None:
    """Draw an arrow from tail to tip."""
    away = np.subtract(tip, tail)
    along = away / np.hypot(*away)
    aside = np.array([-along[1], along[0]])
    end = np.asarray(tip) - 12 * along
    page.wire(colour, tail, (float(end[0]), float(end[1])), width=5)
    corners = [tip, *(end + side * 8 * aside for side in (-1, 1))]
    page.shape(colour, *((float(x), float(y)) for x, y in corners))


def lean_compared() -> bytes:
    """Return a PNG of three leans during one minute of a simulated ride: true, by the formula, and shown.

    This takes 5 s. The function needs the packages of `pip install -e ".[rides]"`.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure
    from PIL import Image

    ride = simulate_ride(_PROFILE, _SEED, _SECONDS)
    kickstand, upright, *poses, log = (
        Log.from_readings(readings, ride.rate_hz)
        for readings in (ride.kickstand, ride.upright, *ride.poses, ride.readings)
    )
    six = fit_six_positions(poses).calibration
    found = replay(log, fit_two_positions(kickstand, upright, six).calibration)
    figure = Figure(figsize=(9, 3.4), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.add_subplot()
    axes.plot(found.t_s, found.lean_formula_deg, color="#e8b450", linewidth=0.5, label="the formula, each reading")
    axes.plot(ride.time, ride.truth["lean_deg"], color="#2460d8", linewidth=3.0, label="true lean")
    axes.plot(found.t_s, found.lean_deg, color="#d1302a", linewidth=1.2, label="the lean filter, as shown")
    axes.set(xlim=_SHOWN_S, ylim=(-70, 70), xlabel="time, s", ylabel="lean, degrees, > 0 to the right")
    axes.grid(alpha=0.3)
    axes.legend(loc="lower left", ncols=3)
    drawn, packed = io.BytesIO(), io.BytesIO()
    figure.savefig(drawn, dpi=100)
    Image.open(drawn).convert("RGB").quantize(_COLOURS).save(packed, "PNG", optimize=True)
    return packed.getvalue()
