"""Draws the picture of one vehicle: how well the aligned axes fit the drive, and the brake tests over time."""

from collections.abc import Sequence

from kickstand_tools.common.svg import drawing, element
from markupsafe import Markup

from ..files import file_stem, write_bytes
from ..period import PeriodResult
from .panel import Panel, date_text

_WIDTH, _HEIGHT = 960, 380


def file_name(vehicle: str, mount: str) -> str:
    """The name of the picture of a mount."""
    return file_stem(f"{vehicle} {mount}".strip(), vehicle, mount) + ".svg"


def write_plot(path: str, result: PeriodResult) -> None:
    """Write the picture of a result, if this result has a picture. Raises InputError."""
    write_bytes(path, draw(result).encode())


def draw(result: PeriodResult) -> str:
    """The picture as SVG."""
    row = result.alignment
    name = row["vehicle"] + (f", mount {row['mount']}" if row["mount"] else "")
    subtitle = row["message"] or (
        f"forward known to {row['quality_deg']:.1f}°, the whole alignment to {row['attitude_deg']:.1f}°, "
        f"{row['events_used']} events, {row['stops']} stops, speed {row['speed_lag_s']:.1f} s late"
    )
    points = result.picture
    parts = [
        element("rect", width=_WIDTH, height=_HEIGHT, fill="#fff"),
        element("text", name, x=20, y=26, font_size=16, font_weight=600),
        element("text", subtitle, x=20, y=45, fill="#555"),
        _agreement("forward: measured against dv/dt", "dv/dt, g", [(p[0], p[1]) for p in points], 20),
    ]
    if row["kind"] == "motorcycle":  # a motorcycle leans into bends, so its force to the left is about zero
        side = [(p[0], p[3]) for p in points]
        parts.append(_agreement("left: measured against dv/dt, should be flat", "dv/dt, g", side, 335, flat=True))
    else:
        side = [(p[2], p[3]) for p in points]
        parts.append(_agreement("left: measured against v times yaw rate", "v times yaw rate, g", side, 335))
    parts.append(_braking(result, 650))
    return drawing((_WIDTH, _HEIGHT), *parts, width=_WIDTH, font_family="system-ui, sans-serif", font_size=12)


def _agreement(title: str, unit: str, points: Sequence[tuple[float, float]], x: float, flat: bool = False) -> Markup:
    reach = max([0.2, *(abs(value) for point in points for value in point)]) * 1.05
    panel = Panel(x, 60, 290, 300, (-reach, reach), (-reach, reach), title, unit, "measured, g")
    panel.line([(-reach, 0.0 if flat else -reach), (reach, 0.0 if flat else reach)], "#bbb")
    panel.dots(points, "#2563eb")
    return panel.svg()


def _braking(result: PeriodResult, x: float) -> Markup:
    tests = result.brake_tests
    dated = bool(tests) and all(test["utc_s"] is not None for test in tests)
    times = [test["utc_s"] if dated else float(k + 1) for k, test in enumerate(tests)]
    hardest = max([3.0, *(test["mfdd_mps2"] for test in tests)]) * 1.1
    first, last = (min(times), max(times)) if times else (0.0, 1.0)
    margin = 0.05 * max(last - first, 3600.0 if dated else 1.0)
    span = (first - margin, last + margin)
    title, unit = f"{len(tests)} brake tests", "day" if dated else "test"
    panel = Panel(x, 60, 290, 300, span, (0.0, hardest), title, unit, "MFDD, m/s²")
    panel.words = date_text if dated else panel.words
    panel.dots(list(zip(times, (test["mfdd_mps2"] for test in tests))), "#c2410c", 3.0)
    return panel.svg()
