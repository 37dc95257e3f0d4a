"""Finds the time, the accelerometer and the gyro in an unknown table, and their units. The names of the columns are
used, but mainly their values.

* Three columns belong together by their names, or because they are side by side (columns.py).
* Whenever the sensor is calm, the acceleration is as long as gravity in some unit.
* In the gyro's unit, the rates explain how the direction of gravity turns in the sensor's axes (unit_fits.py).
* In the time's unit, the number of samples per second is usual.

The user must confirm a finding that is uncertain.
"""

import difflib
import re
import struct
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from ..common.messages import InputError
from ..logs.csv_text import as_text
from ..signals import Array
from .columns import (
    GRAVITIES,
    KINDS,
    LATITUDE,
    LEANT,
    LONGITUDE,
    NEAR,
    Triple,
    are_whole,
    calm_length,
    find_triples,
    is_of,
    single_axes,
    stated_unit,
)
from .recording import Sheet, plain
from .unit_fits import RateFit, fit_rates
from .units import (
    ACCELERATIONS,
    COUNTS_PER_DPS,
    COUNTS_PER_G,
    DATES,
    MOMENT,
    RARE_ACCELERATIONS,
    RATES,
    REPEATED,
    SPEEDS,
    TIME_NAME,
    TIMES,
    Nanoseconds,
    counts_per,
    factor,
    since_first_s,
    tick_ns,
    time_unit,
)

ACCEL, GYRO = ("ax", "ay", "az"), ("gx", "gy", "gz")
REQUIRED = ("t", *ACCEL, *GYRO)
OPTIONAL = ("speed", "lat", "lon", "temp")
# Scales above the rows: seconds per count, g per count, rad/s per count, counts per g
_SCALE = re.compile(
    r'^\W*(tscale|ascale|gscale|gyro_?scale|acc_?1g)"?[,;:=\s]+"?(0x[0-9a-f]{8}|\d*\.?\d+(?:[eE][+-]?\d+)?)',
    re.IGNORECASE | re.MULTILINE,
)
_SAMPLE_RATE = re.compile(r"(?:rate|frequency|sampl\w*)[^\d\n]*(\d+(?:\.\d+)?)\W*hz", re.IGNORECASE)
_COUNTER = re.compile(r"^(no|nr|n|i|index|count|counter|record|sample|frame|id|row)$")
NOISE_DPS = 0.1  # standard deviation of a gyro at rest
_SLOWEST_S = 1.0  # longest usual time between samples
DOUBTED_HZ, DOUBTED_S, DOUBTED_ROWS = 1000.0, 10.0, 2000  # more samples per second, or so many rows in less time
_LOWEST_HZ, _MIDDLE_HZ, _HIGHEST_HZ = 4.0, 50.0, 600.0  # usual rates of samples, if the unit of the time is doubted


@dataclass
class ColumnFinding:
    """The columns of one quantity."""

    columns: list[str]  # the names in the table
    unit: str = ""  # the unit of these columns
    why: str = ""  # the reason in words
    certain: bool = True  # False if the user should check the finding


@dataclass
class Findings:
    """What was found in a table."""

    sheet: Sheet
    # The finding of each quantity, by "t", "a", "g", "speed", "lat" and "lon"
    found: dict[str, ColumnFinding] = field(default_factory=dict)
    lacking: list[str] = field(default_factory=list)  # the required quantities that are missing, in words
    # Columns of single axes of an incomplete sensor, by the keys of REQUIRED
    single: dict[str, str] = field(default_factory=dict)
    remarks: list[str] = field(default_factory=list)  # problems of the existing columns
    joined: bool = False  # True if the table is joined from several files

    @property
    def decided(self) -> bool:
        """True if all required quantities are found and certain."""
        return not self.lacking and all(self.found[key].certain for key in ("t", "a", "g"))

    @property
    def columns(self) -> dict[str, str]:
        """The names of the columns by the keys of REQUIRED and OPTIONAL."""
        pairs = dict(self.single)
        for key, finding in self.found.items():
            keys = ACCEL if key == "a" else GYRO if key == "g" else (key,)
            pairs |= dict(zip(keys, finding.columns))
        return pairs

    @property
    def units(self) -> dict[str, str]:
        """The units by "t", "a", "g" and "speed", and of single axes whose name has another unit."""
        units = {key: finding.unit for key, finding in self.found.items() if finding.unit}
        for axes, kinds in ((ACCEL, ACCELERATIONS), (GYRO, RATES)):
            stated = {axis: stated_unit(self.columns[axis]) for axis in axes if axis in self.columns}
            units |= {axis: name for axis, name in stated.items() if name in kinds and len(set(stated.values())) > 1}
        return units

    @property
    def reasons(self) -> str:
        """The reason of each finding, in one line."""
        return "; ".join(f"{key}: {finding.why}" for key, finding in self.found.items() if finding.why)

    @property
    def lacking_words(self) -> str:
        """The missing columns in words, or ""."""
        return f", and no {', no '.join(self.lacking)} found in it" if self.lacking else ""

    def first_seconds(self, seconds: float = 10.0, points: int = 300) -> dict[str, list[float] | list[list[float]]]:
        """The first seconds of the time (t, in s), and of accelerometer (a) and gyro (g) in the table's units. Empty
        without a time."""
        since = _seconds(self.sheet, self.found.get("t"))
        if since is None:
            return {}
        rows = np.flatnonzero(since <= seconds)
        rows = rows[:: max(1, len(rows) // points)]
        picture: dict[str, list[float] | list[list[float]]] = {"t": since[rows].round(3).tolist()}
        for key in {"a", "g"} & self.found.keys():
            values = self.sheet.table([self.sheet.columns.index(name) for name in self.found[key].columns])[rows]
            picture[key] = np.nan_to_num(values).round(5).T.tolist()
        return picture


def find(sheet: Sheet) -> Findings:
    """Find the quantities in the columns of a table."""
    findings = Findings(sheet)
    time = _time(sheet)
    if time is None:
        findings.lacking.append("time")
        named = [k for k, name in enumerate(sheet.columns) if TIME_NAME.search(plain(name))][:1]
        shown = [f"{sheet.columns[k]} (first {as_text(sheet.cells[k])[0][:30]!a})" for k in named]
        findings.remarks += [f"its column {text} is no time that increases" for text in shown]
    else:
        findings.found["t"] = time
    _accel_and_gyro(sheet, _seconds(sheet, time), findings)
    for key, kind in (("a", "accel"), ("g", "gyro")):
        if key not in findings.found:
            findings.single |= single_axes(sheet, key, kind)
    used = [name for finding in findings.found.values() for name in finding.columns]
    lat, lon = (_first_named(sheet, used, words) for words in (LATITUDE, LONGITUDE))
    if lat is not None and lon is not None:
        findings.found |= {key: ColumnFinding([name], "", "by its name") for key, name in (("lat", lat), ("lon", lon))}
    # velocityx and others are components, but velocity alone also ends in y
    speed = _first_named(sheet, used, "speed|velocity|kmh|kph", r"acc|ang|[xz]$|(?<!velocit)y$")
    if speed is not None:
        stated = stated_unit(speed)
        in_name = next((unit for word, unit in _SPEED_WORDS if word in plain(speed)), "")
        stated = stated if stated in SPEEDS else in_name
        findings.found["speed"] = ColumnFinding([speed], stated, "by its name", bool(stated))
    return findings


# Time


def _time(sheet: Sheet) -> ColumnFinding | None:
    """The column of the time, with its unit; None without one."""
    column = _time_column(sheet)
    if column is None:
        return None
    place, valid = column
    name, rows = sheet.columns[place], len(sheet.cells[place])
    stated = _stated_time(name)
    unit_name = time_unit(sheet.cells[place], stated)
    if unit_name == DATES:
        return ColumnFinding([name], "", "dates or times of day")
    low, high = np.percentile(valid, (10.0, 90.0))
    step = float(high - low) / max(0.8 * len(valid), 1.0) / tick_ns(unit_name)  # mean, in units
    above = _scales(sheet).get("t", "") or _unit_at_rate(sheet.head, step)
    unit_name = above or unit_name
    step_s = step * tick_ns(unit_name) / 1e9
    why = f"in {unit_name} there are {1.0 / max(step_s, 1e-9):.3g} samples per second"
    doubted = step_s * DOUBTED_HZ < 1.0 or (rows >= DOUBTED_ROWS and step_s * rows < DOUBTED_S)
    if doubted or step_s > _SLOWEST_S:
        if doubted or not stated:
            stated = _likely_unit(step) or stated or "?"
        return ColumnFinding([name], stated, f"{why}, which is doubtful", False)
    if above or stated:
        why = "the lines above the rows say so" if above else f"{name} says {unit_name}"
    return ColumnFinding([name], unit_name, why + (": at least 20 are needed" if step_s * 19.5 > 1.0 else ""))


def _time_column(sheet: Sheet) -> tuple[int, Nanoseconds] | None:
    """The number of the column with the time, and its valid times. The column must increase.

    A name like a time counts first, then fine steps. None without such a column.
    """
    best, best_merits = None, ()
    for place, name in enumerate(sheet.columns):
        named, stated = bool(TIME_NAME.search(plain(name.rpartition(":")[2]))), _stated_time(name)
        cells = sheet.cells[place]
        if not (named or stated) and cells.dtype.kind == "O" and not MOMENT.fullmatch(str(cells[0])):
            continue
        try:
            is_text = time_unit(cells, stated) == DATES
            time_ns = sheet.times(place, stated)
        except InputError:
            continue
        valid = time_ns[time_ns > REPEATED]
        steps = np.diff(valid[:: -1 if named and len(valid) and valid[-1] < valid[0] else 1])  # newest first
        if len(steps) < 2 or np.mean(steps >= 0) < 0.95 or not np.any(steps > 0):
            continue
        if not named and (_COUNTER.match(plain(name)) or np.all(np.diff(sheet.numbers(place)) == 1.0)):
            continue  # the column only numbers the rows
        is_fine = len(np.unique(valid)) > 0.5 * len(valid)
        merits = named, is_fine, bool(np.all(steps >= 0)), not is_text
        if merits > best_merits:  # the first column among equals
            best, best_merits = (place, valid), merits
    return best


def _stated_time(name: str) -> str:
    """The unit of time in a column's name, or ""."""
    stated = stated_unit(name)
    return stated if tick_ns(stated) else ""


def _unit_at_rate(head: str, step: float) -> str:
    """The unit in which a step fits the sample rate in the lines above the rows, or ""."""
    rate = _SAMPLE_RATE.search(head)
    fitting = (key for key in _CLOCK_UNITS if rate and 0.9 < step * tick_ns(key) * float(rate[1]) / 1e9 < 1.1)
    return next(fitting, "")


def _likely_unit(step: float) -> str:
    """The unit in which the rate of samples is most usual, or "" if it is unusual in every unit."""
    rates = {key: 1e9 / (max(step, 1e-12) * tick_ns(key)) for key in TIMES}
    usual = [key for key, hz in rates.items() if _LOWEST_HZ < hz < _HIGHEST_HZ]
    return min(usual, key=lambda key: abs(np.log(rates[key] / _MIDDLE_HZ)), default="")


_CLOCK_UNITS = [*TIMES, "0.1ms", "10ms"]


def _scales(sheet: Sheet) -> dict[str, str]:
    """The units that the lines above the rows give, by "t", "a" and "g"."""
    scales: dict[str, str] = {}
    for key, text in _SCALE.findall(sheet.head):
        # Betaflight writes the bits of a 32-bit float
        scale = struct.unpack(">f", bytes.fromhex(text[2:]))[0] if text.startswith("0x") else float(text)
        kind = key[0].lower()
        if kind == "t":
            named = (name for name, ns in TIMES.items() if abs(ns - 1e9 * scale) < 1e6 * scale)
            scales["t"] = next(named, f"{scale:g}s")
        elif scale > 0.0:
            degrees = 1.0 if text.startswith("0x") and scale > 0.99 else np.degrees(1.0)
            counts = scale if key.lower().endswith("1g") else 1.0 / (scale * (degrees if kind == "g" else 1.0))
            scales[kind] = f"counts/{counts:.6g}"
    return scales


def _seconds(sheet: Sheet, time: ColumnFinding | None) -> Array | None:
    """The seconds since the first time, shape (n)."""
    if time is None:
        return None
    return since_first_s(sheet.times(sheet.columns.index(time.columns[0]), time.unit.strip("?")))


# Accelerometer and gyro


class _Sensors(NamedTuple):
    """Groups of three columns; None without one."""

    accel: Triple | None
    rates: Triple | None
    exchanged: bool  # True if the columns of the accelerometer have a gyro's names
    named: bool  # True if columns have an accelerometer's names, also without gravity


def _find_sensors(sheet: Sheet, seconds: Array | None) -> _Sensors:
    """Find both sensors by their names and by gravity."""
    threes = find_triples(sheet)
    kinds = {kind: [three for three in threes if three.kind == kind] for kind in (*KINDS, "")}
    possible = [*kinds["accel"], *kinds["either"], *([] if kinds["accel"] else kinds[""])]
    by_name = kinds["linear"] or kinds["accel"]
    accel = _first_with_gravity(possible, seconds)
    # Names may be wrong: gravity shows the accelerometer, also if its columns are named linear, or like a gyro's
    accel = accel or next((three for three in kinds["linear"] if three.has_gravity(seconds, like_gravity=True)), None)
    exchanged = None if accel else _first_with_gravity(kinds["gyro"], seconds)
    accel = accel or exchanged or next((three for three in kinds["accel"] if not three.is_linear(seconds)), None)
    if exchanged is not None and by_name:
        return _Sensors(accel, by_name[0], True, True)
    unnamed = [three for three in (*kinds["either"], *kinds[""]) if three is not accel]
    others = [three for three in unnamed if accel is None or not three.is_second(accel, seconds)]
    rates = _partner(accel, kinds["gyro"]) or _partner(accel, others)
    return _Sensors(accel, rates, exchanged is not None, bool(by_name))


def _accel_and_gyro(sheet: Sheet, seconds: Array | None, findings: Findings) -> None:
    """Add both sensors to findings, and what is missing."""
    accel, rates, exchanged, named = _find_sensors(sheet, seconds)
    scales = _scales(sheet)
    if accel is None:
        findings.lacking.append("gravity in its acceleration" if named else "acceleration")
        if named:
            findings.remarks.append("gravity has been taken off its acceleration: record the one with gravity")
    else:
        names = _names(sheet, accel)
        of_accel = accelerometer(accel.values, seconds, scales.get("a") or stated_unit(names[0]))
        of_accel.columns, findings.found["a"] = names, of_accel
        if exchanged:
            of_accel.certain, of_accel.why = False, f"{of_accel.why}, so these columns are the accelerometer's"
    if sheet.unread and (accel is None or rates is None):
        findings.remarks.insert(0, sheet.unread)
    if rates is None:
        findings.lacking.append("gyro")
        return
    names = _names(sheet, rates)
    stated = stated_unit(names[0])
    of_gyro = ColumnFinding([], stated, "by name", False)
    if accel is not None:
        of_gyro = gyro(accel.values, rates.values, findings.found["a"], seconds, scales.get("g") or stated)
    of_gyro.columns, findings.found["g"] = names, of_gyro


def _partner(accel: Triple | None, gyros: Sequence[Triple]) -> Triple | None:
    """The gyro whose names are most like those of the accelerometer, because a table may have two sensors."""
    stem = "" if accel is None else accel.stem
    return max(gyros, key=lambda gyro: difflib.SequenceMatcher(None, stem, gyro.stem).ratio(), default=None)


def _names(sheet: Sheet, three: Triple) -> list[str]:
    names = sheet.columns
    return [names[place] if names.count(names[place]) == 1 else f"#{place + 1}" for place in three.places]


def _first_with_gravity(threes: Sequence[Triple], seconds: Array | None) -> Triple | None:
    """The first group whose vectors are as long as gravity in some unit, otherwise the first with a constant length."""
    return next(
        (three for three in threes if three.has_gravity(seconds, like_gravity=True)),
        next((three for three in threes if three.has_gravity(seconds, like_gravity=False)), None),
    )


def accelerometer(values: Array, seconds: Array | None, stated: str = "") -> ColumnFinding:
    """Find the unit of accelerations, shape (n, 3), from the length of gravity. The finding names no columns.

    stated: the unit in the names of their columns.
    """
    length = calm_length(values, seconds)
    if stated and not (is_of(ACCELERATIONS, stated) or counts_per(stated) or stated == "counts"):
        return ColumnFinding([], "?", f"its unit {stated} is not known", False)
    counts = are_whole(values)
    gravities = {name: size for name, size in GRAVITIES.items() if counts or not name.startswith("counts")}
    near = min(gravities, key=lambda name: abs(np.log(length / gravities[name])))
    why = f"gravity at rest is {length:.4g} long"
    if counts_per(stated) or stated in RARE_ACCELERATIONS:
        gravities[stated] = 1.0 / factor(stated, ACCELERATIONS, "a")
    most = NEAR if counts else LEANT
    if stated in gravities and 1.0 / NEAR < length / gravities[stated] < most:
        return ColumnFinding([], stated, f"{why}, as its name says")
    if near.startswith("counts"):
        why += f": raw counts of a sensor with {near.partition('/')[2]} counts (LSB) per g"
    certain = 1.0 / NEAR < length / gravities[near] < most and stated in ("", near, "counts")
    return ColumnFinding([], near, why, certain)


def gyro(force: Array, rates: Array, accel: ColumnFinding, seconds: Array | None, stated: str = "") -> ColumnFinding:
    """Find the unit of rates, shape (n, 3), from the turns of gravity or the names of the columns, otherwise from their
    size. accel: the finding of the accelerometer. The returned finding names no columns.
    """
    fit = RateFit() if seconds is None else fit_rates(seconds, force, rates)
    if "/" in stated and not (is_of(RATES, stated) or counts_per(stated)):
        return ColumnFinding([], "?", f"its unit {stated} is not known", False)
    candidates = RATES  # with their factors to deg/s
    if counts_per(accel.unit) and are_whole(rates):
        candidates = {f"counts/{size:g}": 1.0 / size for size in COUNTS_PER_DPS}
    by_fit = fit.unit_among(candidates)
    if is_of(RATES, stated) or counts_per(stated):
        also = f", and so do the turns of gravity: {by_fit}" if by_fit == stated else ""
        size = factor(stated, RATES, "g")
        apart = by_fit and not 0.7 < candidates[by_fit] / size < 1.4
        against = f", but gravity turns as by {by_fit}" if apart else ""
        return ColumnFinding([], stated, f"its name says so{also}{against}", not against)
    if by_fit:
        return ColumnFinding([], by_fit, "in it the rates turn gravity as it turns")
    if "deg/s" not in candidates:
        usual = f"counts/{_usual_counts(accel):g}"
        why = "raw counts whose range nothing shows: the usual one with this accelerometer's"
        return ColumnFinding([], usual, why, False)
    return ColumnFinding([], *_by_size(rates, force), certain=False)


def _usual_counts(accel: ColumnFinding) -> float:
    """Counts per deg/s of an MPU6050, if both ranges have the same setting, as usual."""
    size = counts_per(accel.unit)
    return COUNTS_PER_DPS[COUNTS_PER_G.index(size)] if size in COUNTS_PER_G else COUNTS_PER_DPS[0]


def _by_size(rates: Array, force: Array) -> tuple[str, str]:
    """A likely unit and the reason: the largest rates of a ride, or the noise of a sensor at rest."""
    good = rates[np.all(np.isfinite(rates), axis=1)]
    length = np.linalg.norm(good - np.median(good, axis=0), axis=1)
    most, noise = float(np.percentile(length, 90.0)), float(np.median(np.std(good, axis=0)))
    length_force = float(np.median(np.linalg.norm(force[np.all(np.isfinite(force), axis=1)], axis=1)))
    unrest = float(np.max(np.std(force[np.all(np.isfinite(force), axis=1)], axis=0))) / max(length_force, 1e-9)
    if unrest < 0.02:  # the sensor is at rest
        near = min(RATES, key=lambda name: abs(np.log(max(noise, 1e-9) * RATES[name] / NOISE_DPS)))
        return near, f"its noise at rest is {noise:.2g}"
    if most > 1000.0:
        return "mdeg/s", f"nine tenths of its rates are below {most:.3g}"
    return ("rad/s" if most < 3.0 else "deg/s"), f"nine tenths of its rates are below {most:.3g}"


# Speed and position


def _first_named(sheet: Sheet, used: Sequence[str], words: str, without: str = "acc") -> str | None:
    """The first unused column with numbers whose name matches `words`, and not `without`."""
    for place, name in enumerate(sheet.columns):
        bare = plain(name) if name not in used else ""
        if re.search(words, bare) and not re.search(without, bare) and np.any(np.isfinite(sheet.numbers(place))):
            return name
    return None


_SPEED_WORDS = (("kmh", "km/h"), ("kph", "km/h"), ("mph", "mph"), ("mps", "m/s"), ("knot", "knots"))
