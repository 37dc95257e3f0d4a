"""Describes a ride in words, for a terminal or a page, or as JSON."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..calibration.file import BY_RIDE
from ..calibration.mount import SWAPPED_DEG
from ..common.markup import clock
from ..common.messages import Remedy, WrongAxes, WrongMount, as_data as remarks_as_data
from ..estimation.smooth import PoseOff
from .overview import LeanCost, Overview, Peak, Quality, lean_cost
from .stops import Stop, stops_by_speed

if TYPE_CHECKING:
    from rich.console import Group

COSTS_DEG = 0.25  # the report names a remedy for larger errors of the lean only; the display cannot show smaller errors
GRAVITY_TOLERANCE_G = 0.02  # most that the force at rest may differ from 1 g, as in the check of the six positions
RIDDEN_S = 10.0  # a shorter riding time gets no report, because the bike was only pushed around
STOPS_TITLE = "Stops"
STOPS_UNITS = {"at": "", "from": "km/h", "time": "s", "distance": "m", "MFDD": "m/s²", "peak": "m/s²", "jerk": "m/s³"}
STOPS_UNITS |= {"pulls": "m"}  # a stop must fit one line of 80 columns, without room for units
STOPS_TERMS = (
    "MFDD: mean deceleration while the speed falls from 80 to 10 % of what it was (UN R13). peak: the largest. "
    "jerk: how fast the deceleration changes, at most. pulls: how far the bike ends beside its straight line."
)

_LESS_ROLL = Remedy(
    "calibrate ride takes it out, or calibrate two, held upright", f"{BY_RIDE}, or align the bike again, held upright"
)
_LESS_PITCH = Remedy(
    "calibrate ride takes it out, or calibrate two, on level ground",
    f"{BY_RIDE}, or align the bike again, on level ground",
)
_LESS_YAW = Remedy("calibrate ride takes it out", BY_RIDE)
_LESS_YAW_BY_SPEED = Remedy("calibrate ride or drive takes it out", BY_RIDE)
_SIX_POSITIONS = Remedy("kickstand calibrate six takes that out", "the six positions of the sensor take that out")


@dataclass
class Words:
    """The texts of a report."""

    name: str
    too_little: str  # a sentence that the log has too little riding; "" if it has enough
    ride: list[tuple[str, str, str]]  # rows of (quantity, value, time or "")
    alignment: str  # a paragraph about the alignment
    stops: list[tuple[str, ...]]  # one row per stop, with the columns of STOPS_UNITS; STOPS_TERMS explains some of them
    remark: str  # a remark about the stops, or the reason why no stop was found; "" without a remark


def as_data(overview: Overview) -> dict[str, Any]:
    """Return the values of the report for JSON; None for a missing value."""
    total, quality = overview.summary, overview.quality
    data: dict[str, Any] = {
        "ride": overview.ride.name,
        "vehicle": "car" if overview.ride.car else "motorcycle",
        "duration_s": round(total.duration_s, 3),
        "samples": total.samples,
        "riding_s": round(overview.riding_s, 1),
        "lean_unsure_s": round(total.not_sure_s, 1),
        "missing_s": round(max(0.0, total.missing_s - total.frozen_s), 1),
        "frozen_s": round(total.frozen_s, 1),
    }
    peaks = {"max_brake_g": total.brake_g, "max_accel_g": total.accel_g, "max_speed_mps": total.speed_mps}
    if not overview.ride.car:
        data["lean"] = "smoothed" if overview.ride.smoothed else "live"
        peaks = {"max_left_deg": total.left_deg, "max_right_deg": total.right_deg} | peaks
        data |= {f"beyond_{limit:.0f}_deg_s": round(s, 2) for limit, s in total.beyond_s.items()}
    for name, peak in peaks.items():
        present = peak.time_s is not None
        data[name] = {"value": round(peak.value, 4), "time_s": round(peak.time_s or 0.0, 3)} if present else None
    fits = judged(overview)
    angles = {name: value for name, value in vars(quality).items() if not name.endswith(("lateral_g", "forward_g"))}
    data["alignment"] = _rounded(angles, 4, fits)
    if not overview.ride.car:
        data["lean_cost"] = _rounded(vars(lean_cost(quality)), 2, fits and not overview.exchanged)
    data["remarks"] = remarks_as_data(overview.notices)
    data["remark"] = overview.exchanged.line() if overview.exchanged else ""
    data["stops"] = [
        {name: value if isinstance(value, str) else round(value, 3) for name, value in vars(stop).items()}
        | {"duration_s": round(stop.duration_s, 3)}
        for stop in overview.stops
    ]
    return data


def _rounded(values: dict[str, float | None], digits: int, known: bool) -> dict[str, float | None]:
    """Round the values, None for a missing one. known: False if all are unknown."""
    return {name: round(value, digits) if known and value is not None else None for name, value in values.items()}


def page(overview: Overview) -> "Group":
    """Format the report for a terminal."""
    from rich.console import Group
    from rich.table import Table
    from rich.text import Text

    texts = words(overview)
    ride = Table.grid(padding=(0, 3))
    for row in texts.ride:
        ride.add_row(*row)
    parts: list[Any] = [Text(texts.name, style="bold")]
    parts += [Text(texts.too_little, style="bold")] if texts.too_little else []
    parts += [ride, Text(), Text(texts.alignment), Text()]
    if texts.stops:
        stops = Table(title=STOPS_TITLE, title_justify="left", box=None, pad_edge=False, header_style="dim")
        for name, unit in STOPS_UNITS.items():
            stops.add_column(f"{name}\n{unit}", justify="right", no_wrap=True)
        for row in texts.stops:
            stops.add_row(*row)
        parts += [stops, Text(STOPS_TERMS, style="dim")]
    if texts.remark:
        parts += [Text(texts.remark, style="dim" if texts.stops else "")]
    return Group(*parts)


def words(overview: Overview, on_page: bool = False) -> Words:
    """Describe the ride in words. on_page: remedies name the buttons of the page, not commands."""
    name, alignment = Path(overview.ride.name).name, _alignment(overview, on_page)
    return Words(name, _too_little(overview), _ride(overview), alignment, _stops(overview.stops), _remark(overview))


def _too_little(overview: Overview) -> str:
    if overview.riding_s >= RIDDEN_S:
        return ""
    riding = f"{overview.riding_s:.0f} s of it riding" if overview.riding_s >= 1.0 else "all of it standing"
    return f"{clock(overview.summary.duration_s)} of log, {riding}: too little for a report."


def _remark(overview: Overview) -> str:
    if any(stop.speed_from == "integrated" for stop in overview.stops):
        return "* no speed in the log: integrated from the acceleration"
    return "" if overview.stops else _no_stops(overview)


def _no_stops(overview: Overview) -> str:
    if overview.exchanged:
        return "Stops: not known, see the warning."
    if not overview.has_speed and overview.riding_s > RIDDEN_S:
        return "Stops: not known, the log has no speed."  # without a speed, no stop is certain
    if stops_by_speed(overview.course):
        return "The speed falls to a stop, the force says otherwise: is the calibration this ride's?"
    return "No stop from over 10 km/h found."


def _ride(overview: Overview) -> list[tuple[str, str, str]]:
    total = overview.summary
    rows = [("Duration", clock(total.duration_s), f"riding {clock(overview.riding_s)}")]
    if not overview.ride.car:
        smoothed = ("Lean", "best estimate", "from the whole ride")
        rows.append(smoothed if overview.ride.smoothed else ("Lean", "as the display showed it", ""))
        rows.append(("Max left", *peak_words(total.left_deg, "{:.0f}°")))
        rows.append(("Max right", *peak_words(total.right_deg, "{:.0f}°")))
        has_lean = (total.left_deg.time_s, total.right_deg.time_s) != (None, None)
        for limit, seconds in total.beyond_s.items():
            rows.append((f"Over {limit:.0f}°", f"{seconds:.1f} s" if has_lean else "--", ""))
    rows.append(("Max braking", *peak_words(total.brake_g, "{:.2f} g")))
    rows.append(("Max acceleration", *peak_words(total.accel_g, "{:.2f} g")))
    if overview.has_speed:
        peak = Peak(total.speed_mps.value * 3.6, total.speed_mps.time_s)
        rows.append(("Max speed", *peak_words(peak, "{:.0f} km/h")))
    if total.not_sure_s >= 1.0:
        rows.append(("Lean not sure", clock(total.not_sure_s), ""))
    if total.missing_s - total.frozen_s >= 0.1:
        rows.append(("No readings", f"{total.missing_s - total.frozen_s:.1f} s", ""))
    if total.frozen_s >= 0.1:
        rows.append(("Readings frozen", f"{total.frozen_s:.1f} s", ""))
    return rows


def _alignment(overview: Overview, on_page: bool) -> str:
    quality = overview.quality
    if not judged(overview):
        return "Alignment: not judged, see the warning."
    errors = ", ".join(angles(quality))
    if not errors:
        text = "Alignment: not enough straight riding to know how far it is off."
    elif _is_well_aligned(overview):
        text = f"Alignment: good. It seems off by {errors}, which costs less than {COSTS_DEG}° of lean."
    else:
        text = f"Alignment: it seems off by {errors}{_question_about_poses(overview)}"
    if errors and not (overview.ride.car or overview.exchanged):
        text += _cost_sentences(lean_cost(quality), overview.has_speed, on_page)
    return text + _gravity(quality.gravity_g, on_page)


def _question_about_poses(overview: Overview) -> str:
    """Return a question if the roll error is too large for a motorcycle's upright pose, otherwise a full stop."""
    if overview.ride.car or abs(overview.quality.roll_deg or 0.0) <= SWAPPED_DEG:
        return "."
    swapped = overview.exchanged or not overview.has_speed  # swapped poses also exchange forward and backward
    return ": were the poses swapped?" if swapped else ": was it held upright?"


def _is_well_aligned(overview: Overview) -> bool:
    """True if the ride shows that the alignment errors of a motorcycle together cause a lean error under COSTS_DEG."""
    cost = lean_cost(overview.quality)
    if overview.ride.car or overview.exchanged or cost.roll_deg is None or cost.yaw_deg is None:
        return False
    together = cost.roll_deg + cost.yaw_deg + (cost.pitch_deg or 0.0)
    upright = abs(overview.quality.roll_deg or 0.0) <= SWAPPED_DEG
    return together < COSTS_DEG and upright and not any(isinstance(notice, PoseOff) for notice in overview.notices)


def _gravity(found_g: float | None, on_page: bool) -> str:
    """Return a sentence about the mean force at rest; "" if it is unknown. on_page: see words()."""
    if found_g is None:
        return ""
    if abs(found_g - 1.0) <= GRAVITY_TOLERANCE_G:
        return f" At rest the force is {found_g:.3f} g: right, {GRAVITY_TOLERANCE_G} g from 1 are allowed."
    return f" At rest the force is {found_g:.3f} g and not 1: {_SIX_POSITIONS.words(on_page)}."


def judged(overview: Overview) -> bool:
    """Return True if the ride shows how well the sensor is aligned, False if it contradicts the whole calibration."""
    return not any(
        isinstance(notice, WrongAxes) or (isinstance(notice, WrongMount) and not notice.judged)
        for notice in overview.notices
    )


def _cost_sentences(cost: LeanCost, speed: bool, on_page: bool) -> str:
    """Return a sentence with a remedy for each angle that causes an error of the lean; "" without such an angle."""
    costs = {
        "Roll": (cost.roll_deg, _LESS_ROLL),
        "Pitch": (cost.pitch_deg, _LESS_PITCH),
        "Yaw": (cost.yaw_deg, _LESS_YAW_BY_SPEED if speed else _LESS_YAW),
    }
    return "".join(
        f" {name} usually costs about {value:.1f}° of lean; {remedy.words(on_page)}."
        for name, (value, remedy) in costs.items()
        if value is not None and value >= COSTS_DEG
    )


def _stops(stops: list[Stop]) -> list[tuple[str, ...]]:
    return [
        (
            clock(stop.start_s),
            f"{stop.initial_speed_mps * 3.6:.1f}{'*' if stop.speed_from == 'integrated' else ''}",
            f"{stop.duration_s:.2f}",
            f"{stop.distance_m:.1f}",
            f"{stop.mfdd_mps2:.2f}",
            f"{stop.peak_mps2:.2f}",
            f"{stop.jerk_mps3:.0f}",
            f"{abs(stop.side_m):.1f} {'left' if stop.side_m > 0 else 'right'}",
        )
        for stop in stops
    ]


def peak_words(peak: Peak, form: str) -> tuple[str, str]:
    """Return a peak's value and its time in words; "--" if no lean was certain enough."""
    if peak.time_s is None:
        return "--", ""
    return form.format(peak.value), f"at {clock(peak.time_s)}"


def angles(quality: Quality) -> list[str]:
    named = {"roll": quality.roll_deg, "pitch": quality.pitch_deg, "yaw": quality.yaw_deg}
    return [f"{name} {value:+z.1f}°" for name, value in named.items() if value is not None]
