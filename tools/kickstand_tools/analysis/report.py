"""A ride in a page of the terminal, or as JSON."""

from pathlib import Path
from typing import Any

from rich.console import Group
from rich.table import Table
from rich.text import Text

from ..refusals import SWAPPED_DEG, sentence
from .alignment_quality import LeanCost, Quality, lean_cost
from .overview import Overview
from .stops.brake_test import Stop
from .stops.speed_stops import stops_by_speed
from .summary import Peak

CONTRADICTED = ("up-off", "forward-off", "left-handed", "rates-misfit", "rates-in-radians")  # by the ride
COSTS_DEG = 0.1  # of lean: less is not worth a word
RIDDEN_S = 10.0  # a shorter ride is pushing the bike about


def as_data(seen: Overview) -> dict[str, Any]:
    """What the page says, as JSON has it; None where there is no value."""
    total, quality = seen.summary, seen.quality
    data: dict[str, Any] = {
        "ride": seen.ride.name,
        "vehicle": "car" if seen.ride.car else "motorcycle",
        "duration_s": round(total.duration_s, 3),
        "samples": total.samples,
        "riding_s": round(total.riding_s, 1),
        "lean_unsure_s": round(total.not_sure_s, 1),
        "missing_s": round(max(0.0, total.missing_s - total.frozen_s), 1),
        "frozen_s": round(total.frozen_s, 1),
    }
    peaks = {"max_brake_g": total.brake_g, "max_accel_g": total.accel_g, "max_speed_mps": total.speed_mps}
    if not seen.ride.car:
        data["lean"] = "smoothed" if seen.ride.smoothed else "live"
        peaks = {"max_left_deg": total.left_deg, "max_right_deg": total.right_deg} | peaks
        data |= {f"beyond_{limit:.0f}_deg_s": round(s, 2) for limit, s in total.beyond_s.items()}
    for name, peak in peaks.items():
        there = peak.time_s is not None
        data[name] = {"value": round(peak.value, 4), "time_s": round(peak.time_s or 0.0, 3)} if there else None
    judged = _judged(seen)
    data["alignment"] = {
        name: round(value, 4) if judged and value is not None else None
        for name, value in vars(quality).items()
        if not name.endswith(("lateral_g", "forward_g"))
    }
    if not seen.ride.car:
        costs = vars(lean_cost(quality))
        known = judged and not seen.exchanged
        data["lean_cost"] = {
            name: round(value, 2) if known and value is not None else None for name, value in costs.items()
        }
    data["remark"] = sentence(seen.exchanged) if seen.exchanged else ""
    data["stops"] = [
        {name: value if isinstance(value, str) else round(value, 3) for name, value in vars(stop).items()}
        | {"duration_s": round(stop.duration_s, 3)}
        for stop in seen.stops
    ]
    return data


def page(seen: Overview) -> Group:
    """The ride for a terminal."""
    parts: list[Any] = [Text(Path(seen.ride.name).name, style="bold"), _ride(seen), Text(), _alignment(seen)]
    if seen.stops:
        parts += [Text(), _stops(seen.stops)]
        if any(stop.speed_from == "integrated" for stop in seen.stops):
            parts.append(Text("* no speed in the log: integrated from the acceleration", style="dim"))
    else:
        parts += [Text(), Text(_no_stops(seen))]
    return Group(*parts)


def _no_stops(seen: Overview) -> str:
    if seen.exchanged:
        return "Stops: not told, see the warning."
    if not seen.has_speed and seen.summary.riding_s > RIDDEN_S:
        return "no speed in the log: stops cannot be told"  # there may have been some: none was sure enough
    if stops_by_speed(seen.course):
        return "The speed falls to a stop, the force says otherwise: is the calibration this ride's?"
    return "No stop from over 10 km/h found."


def _ride(seen: Overview) -> Table:
    total = seen.summary
    table = Table.grid(padding=(0, 3))
    table.add_row("Duration", clock(total.duration_s), f"riding {clock(total.riding_s)}")
    if not seen.ride.car:
        how = "smoothed" if seen.ride.smoothed else "as the display showed it"
        table.add_row("Lean", how)
        table.add_row("Max left", *_peak(total.left_deg, "{:.0f}°"))
        table.add_row("Max right", *_peak(total.right_deg, "{:.0f}°"))
        for limit, seconds in total.beyond_s.items():
            table.add_row(f"Over {limit:.0f}°", f"{seconds:.1f} s")
    table.add_row("Max braking", *_peak(total.brake_g, "{:.2f} g"))
    table.add_row("Max acceleration", *_peak(total.accel_g, "{:.2f} g"))
    if seen.has_speed:
        peak = Peak(total.speed_mps.value * 3.6, total.speed_mps.time_s)
        table.add_row("Max speed", *_peak(peak, "{:.0f} km/h"))
    if total.not_sure_s >= 1.0:
        table.add_row("Lean not sure", clock(total.not_sure_s))
    if total.missing_s - total.frozen_s >= 0.1:
        table.add_row("No readings", f"{total.missing_s - total.frozen_s:.1f} s")
    if total.frozen_s >= 0.1:
        table.add_row("Readings frozen", f"{total.frozen_s:.1f} s")
    return table


def _alignment(seen: Overview) -> Text:
    quality = seen.quality
    if not _judged(seen):
        return Text("Alignment: not judged, see the warning.")
    said = "Alignment: not enough straight riding to tell how far it is off."
    known = angles(quality)
    if known:
        said = f"Alignment: it seems off by {', '.join(known)}"
        far = abs(quality.roll_deg or 0.0) > SWAPPED_DEG and not seen.ride.car
        # swapped poses exchange forward and backward too
        swapped = far and (seen.speed_correlation is None or seen.speed_correlation < 0.0)
        said += ": were the poses swapped?" if swapped else ": was it held upright?" if far else "."
        if not seen.ride.car and not seen.exchanged:
            said += _cost(lean_cost(quality), seen.has_speed)
    if quality.gravity_g is not None:
        said += f" At rest the force is {quality.gravity_g:.3f} g."
    return Text(said)


def _judged(seen: Overview) -> bool:
    """Whether the ride says how well the sensor is aligned: not where it contradicts the calibration altogether."""
    return not any(notice.code in CONTRADICTED for notice in seen.notices)


def _cost(cost: LeanCost, speed: bool) -> str:
    """What the angles cost, and what to do against it. speed: the log has one."""
    drive = "calibrate ride or drive takes it out" if speed else "calibrate ride takes it out"
    remedies = {
        "Roll": (cost.roll_deg, "calibrate ride takes it out, or calibrate two, held upright"),
        "Pitch": (cost.pitch_deg, "calibrate ride takes it out, or calibrate two, on level ground"),
        "Yaw": (cost.yaw_deg, drive),
    }
    said = [
        f" {name} usually costs about {value:.1f}° of lean; {remedy}."
        for name, (value, remedy) in remedies.items()
        if value is not None and value >= COSTS_DEG
    ]
    return "".join(said) or f" That costs less than {COSTS_DEG}° of lean: nothing to do."


def _stops(stops: list[Stop]) -> Table:
    table = Table(title="Stops (MFDD: UN R13)", title_justify="left", box=None, pad_edge=False, header_style="dim")
    units = {"at": "", "from": "km/h", "time": "s", "distance": "m", "MFDD": "m/s²", "peak": "m/s²", "jerk": "m/s³"}
    for name, unit in (units | {"pulls": "m"}).items():  # one line a stop in 80 columns: no units in it
        table.add_column(f"{name}\n{unit}", justify="right", no_wrap=True)
    for stop in stops:
        mark = "*" if stop.speed_from == "integrated" else ""
        table.add_row(
            clock(stop.start_s),
            f"{stop.initial_speed_mps * 3.6:.1f}{mark}",
            f"{stop.duration_s:.2f}",
            f"{stop.distance_m:.1f}",
            f"{stop.mfdd_mps2:.2f}",
            f"{stop.peak_mps2:.2f}",
            f"{stop.jerk_mps3:.0f}",
            f"{abs(stop.side_m):.1f} {'left' if stop.side_m > 0 else 'right'}",
        )
    return table


def _peak(peak: Peak, form: str) -> tuple[str, str]:
    if peak.time_s is None:
        return "--", ""
    return form.format(peak.value), f"at {clock(peak.time_s)}"


def angles(quality: Quality) -> list[str]:
    """The angles that are known, in words."""
    named = {"roll": quality.roll_deg, "pitch": quality.pitch_deg, "yaw": quality.yaw_deg}
    return [f"{name} {value:+z.1f}°" for name, value in named.items() if value is not None]


def clock(seconds: float) -> str:
    """1:02:03 or 2:03."""
    whole = round(seconds)
    hours, minutes = whole // 3600, whole // 60 % 60
    return f"{hours}:{minutes:02d}:{whole % 60:02d}" if hours else f"{minutes}:{whole % 60:02d}"
