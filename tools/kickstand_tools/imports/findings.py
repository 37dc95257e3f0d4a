"""Finds the time, the accelerometer and the gyro in an unknown table, and their units. The names of the columns are
used, but mainly their values.

* Three columns belong together if their names differ only in the axis, or if they are side by side without names.
* Whenever the sensor is calm, the acceleration is as long as gravity in some unit.
* In the gyro's unit, the rates explain how the direction of gravity turns in the sensor's axes (unit_fits.py).
* In the time's unit, the number of samples per second is usual.

Each finding has a reason, and is certain or uncertain. An uncertain finding is proposed to the user, who must confirm
it.
"""

import difflib
import functools
import re
import struct
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np
from kickstand.units import STANDARD_GRAVITY

from ..common.errors import InputError
from ..logs.csv_reader import as_text
from ..signals import Array, moving_mean, moving_spread
from .recording import Sheet, increases, plain, unit_in
from .unit_fits import RateFit, fit_rates
from .units import (
    ACCELERATIONS,
    COUNTS_PER_DPS,
    COUNTS_PER_G,
    DATES,
    MOMENT,
    RARE_ACCELERATIONS,
    RARE_RATES,
    RATES,
    REPEATED,
    SPEEDS,
    TIME_NAME,
    TIMES,
    Nanoseconds,
    counts_per,
    factor,
    of_day,
    since_first_s,
    tick_ns,
    time_unit,
    unit,
)

ACCEL, GYRO = ("ax", "ay", "az"), ("gx", "gy", "gz")
REQUIRED = ("t", *ACCEL, *GYRO)
OPTIONAL = ("speed", "lat", "lon", "temp")
LATITUDE, LONGITUDE = r"^lat(?!er)|latitude", r"^lon(?!gi?t?u?d?i?n?al|gacc)|^lng|longitude"
_KINDS = {  # kinds of sensors, by the words in their columns' names
    "linear": r"lin|user|withoutgravity|nograv",
    "gravity": r"^(?!.*(incl|with)).*grav",
    "other": r"mag|compass|orient|euler|quat|angle|roll|pitch|yaw|azimuth|^[bmqh]$|^mg?$|press|baro",
    "gyro": r"gyr|rot|omega|angular|angvel|^gy$|^as$|^[wr]$|rate$",
    "accel": r"acc|force|^ac$|^gf$|^f$|^a$",
    "either": r"^g$",
}
# Words for an axis, longest first: of vehicles, and of web pages, whose alpha turns about z
_AXES = {"longitudinal": "x", "inline": "x", "long": "x", "roll": "x", "beta": "x", "lateral": "y", "lat": "y"}
_AXES |= {"pitch": "y", "gamma": "y", "vertical": "z", "vert": "z", "yaw": "z", "alpha": "z"}
# Scales above the rows: seconds per count, g per count, rad/s per count, counts per g
_SCALE = re.compile(
    r'^\W*(tscale|ascale|gscale|gyro_?scale|acc_?1g)"?[,;:=\s]+"?(0x[0-9a-f]{8}|\d*\.?\d+(?:[eE][+-]?\d+)?)',
    re.IGNORECASE | re.MULTILINE,
)
_SAMPLE_RATE = re.compile(r"(?:rate|frequency|sampl\w*)[^\d\n]*(\d+(?:\.\d+)?)\W*hz", re.IGNORECASE)
_COUNTER = re.compile(r"^(no|nr|n|i|index|count|counter|record|sample|frame|id|row)$")
CALM_S = 0.5  # length of the moving window in which the motion is measured to find calm samples
CALMEST = 0.2  # share of the samples that count as calm
NEAR = 1.3  # a calm acceleration is within this factor of gravity, also with clones of the chip and on rough rides
LEANT = 1.75  # in a long bend, even the calm acceleration is longer than gravity by this factor: 55 degrees of lean
NOISE_DPS = 0.1  # standard deviation of a gyro at rest
# Length of the mean acceleration, divided by the mean length of the accelerations. Without gravity the ratio is smaller
# than this.
LINEAR = 0.35
_SLOWEST_S = 1.0  # longest usual time between samples
DOUBTED_HZ, DOUBTED_S, DOUBTED_ROWS = 1000.0, 10.0, 2000  # more samples per second, or so many rows in less time
_USUAL_HZ = 4.0, 50.0, 600.0  # lowest, middle and highest usual rate of samples, if the unit of the time is doubted


@dataclass
class ColumnFinding:
    """The columns of one quantity.

    columns: the names in the table.
    unit: the unit of these columns.
    why: the reason in words.
    certain: False if the user should check the finding.
    """

    columns: list[str]
    unit: str = ""
    why: str = ""
    certain: bool = True


@dataclass
class Findings:
    """What was found in a table.

    sheet: the table.
    found: the finding of each quantity, by "t", "a", "g", "speed", "lat" and "lon".
    lacking: the required quantities that are missing, in words.
    single: columns of single axes of an incomplete sensor, by the keys of REQUIRED.
    remarks: problems of the existing columns.
    joined: True if the table is joined from several files.
    """

    sheet: Sheet
    found: dict[str, ColumnFinding] = field(default_factory=dict)
    lacking: list[str] = field(default_factory=list)
    single: dict[str, str] = field(default_factory=dict)
    remarks: list[str] = field(default_factory=list)
    joined: bool = False

    @property
    def decided(self) -> bool:
        """True if all required quantities are found and certain."""
        return not self.lacking and all(self.found[key].certain for key in ("t", "a", "g"))

    @property
    def columns(self) -> dict[str, str]:
        """The columns by the keys of REQUIRED and OPTIONAL."""
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
        """The reasons, one sentence per quantity."""
        return "; ".join(f"{key}: {finding.why}" for key, finding in self.found.items() if finding.why)

    @property
    def lacking_words(self) -> str:
        """The missing columns in words, or ""."""
        return f", and no {', no '.join(self.lacking)} found in it" if self.lacking else ""

    def first_seconds(self, seconds: float = 10.0, points: int = 300) -> dict[str, list[float] | list[list[float]]]:
        """The first seconds of the found time (t, s), accelerometer (a) and gyro (g), reduced to `points` points, in
        the table's units. Empty without a time."""
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
    seconds = _seconds(sheet, time)
    _accel_and_gyro(sheet, seconds, findings)
    for key, kind in (("a", "accel"), ("g", "gyro")):
        if key not in findings.found:
            findings.single |= _single(sheet, key, kind)
    used = [name for finding in findings.found.values() for name in finding.columns]
    lat, lon = (_first_named(sheet, used, words) for words in (LATITUDE, LONGITUDE))
    if lat is not None and lon is not None:
        findings.found |= {key: ColumnFinding([name], "", "by its name") for key, name in (("lat", lat), ("lon", lon))}
    # velocityx and others are components, but velocity alone also ends in y
    speed = _first_named(sheet, used, "speed|velocity|kmh|kph", r"acc|ang|[xz]$|(?<!velocit)y$")
    if speed is not None:
        stated = stated_unit(speed)
        stated = stated if stated in SPEEDS else next((u for w, u in _SPEED_WORDS if w in plain(speed)), "")
        findings.found["speed"] = ColumnFinding([speed], stated, "by its name", bool(stated))
    return findings


# Time


def _time(sheet: Sheet) -> ColumnFinding | None:
    """The column of the time, which must increase. Among several such columns, columns named like a time are preferred,
    then the column with the finest steps."""
    usable: list[tuple[tuple[bool | int, ...], Nanoseconds]] = []
    for place, name in enumerate(sheet.columns):
        named = bool(TIME_NAME.search(plain(name.rpartition(":")[2])))
        stated = stated_unit(name) if tick_ns(stated_unit(name)) else ""
        cells = sheet.cells[place]
        if not (named or stated) and cells.dtype.kind == "O" and not MOMENT.fullmatch(str(cells[0])):
            continue
        try:
            text = time_unit(cells, stated) == DATES
            time_ns = sheet.times(place, stated)
        except InputError:
            continue
        valid = time_ns[time_ns > REPEATED]
        steps = np.diff(valid[:: -1 if named and len(valid) and valid[-1] < valid[0] else 1])  # newest first
        if len(steps) < 2 or np.mean(steps >= 0) < 0.95 or not np.any(steps > 0):
            continue
        if not named and (_COUNTER.match(plain(name)) or np.all(np.diff(sheet.numbers(place)) == 1.0)):
            continue  # the column only numbers the rows
        finest = len(np.unique(valid)) > 0.5 * len(valid)
        usable.append(((named, finest, bool(np.all(steps >= 0)), not text, -place), valid))
    if not usable:
        return None
    merits, valid = max(usable, key=lambda column: column[0])
    name, cells = sheet.columns[-merits[-1]], sheet.cells[-merits[-1]]
    stated = stated_unit(name) if tick_ns(stated_unit(name)) else ""
    unit_name = time_unit(cells, stated)
    if unit_name == DATES:
        return ColumnFinding([name], "", "dates or times of day")
    low, high = np.percentile(valid, (10.0, 90.0))
    step = float(high - low) / max(0.8 * len(valid), 1.0) / tick_ns(unit_name)  # mean, in units
    rate = _SAMPLE_RATE.search(sheet.head)
    fitting = [key for key in _CLOCK_UNITS if rate and 0.9 < step * tick_ns(key) * float(rate[1]) / 1e9 < 1.1]
    above = _scales(sheet).get("t", "") or next(iter(fitting), "")
    unit_name = above or unit_name
    step_s = step * tick_ns(unit_name) / 1e9
    why = f"in {unit_name} there are {1.0 / max(step_s, 1e-9):.3g} samples per second"
    doubted = step_s * DOUBTED_HZ < 1.0 or (len(cells) >= DOUBTED_ROWS and step_s * len(cells) < DOUBTED_S)
    if doubted or step_s > _SLOWEST_S:
        rates = {key: 1e9 / (max(step, 1e-12) * tick_ns(key)) for key in TIMES}
        usual = [key for key, hz in rates.items() if _USUAL_HZ[0] < hz < _USUAL_HZ[2]]
        likely = min(usual, key=lambda key: abs(np.log(rates[key] / _USUAL_HZ[1])), default=stated or "?")
        return ColumnFinding([name], likely if doubted or not stated else stated, f"{why}, which is doubtful", False)
    if above or stated:
        why = "the lines above the rows say so" if above else f"{name} says {unit_name}"
    return ColumnFinding([name], unit_name, why + (": at least 20 are needed" if step_s * 19.5 > 1.0 else ""))


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
    """Return the seconds since the first time, shape (n), or None without a time column."""
    if time is None:
        return None
    return since_first_s(sheet.times(sheet.columns.index(time.columns[0]), time.unit.strip("?")))


# Groups of three


@dataclass
class _Triple:
    """Three columns, one per axis. kind: a key of _KINDS, "" if neither their names nor their unit show it."""

    stem: str
    places: list[int]
    kind: str
    values: Array

    @functools.cached_property
    def good(self) -> Array:
        """The complete rows of values."""
        return self.values[np.all(np.isfinite(self.values), axis=1)]

    @functools.cached_property
    def length(self) -> float:
        """The median length of the vectors, NaN without one."""
        return float(np.median(np.linalg.norm(self.good, axis=1))) if len(self.good) else np.nan

    def mean_lengths(self, span_s: float, seconds: Array | None) -> Array:
        """The length of the moving mean over span_s."""
        return np.linalg.norm(moving_mean(self.good, _rows_in(span_s, seconds, len(self.values))), axis=1)


def completed(sheet: Sheet) -> Sheet:
    """Complete columns that belong together: seconds and their fractions, axes that are in several rows, and the user's
    acceleration and gravity."""
    names = [plain(name) for name in sheet.columns]
    _add_time(sheet, names)
    _sign_positions(sheet, names)
    threes = {three.kind: three for three in reversed(_find_triples(sheet))}
    for three in threes.values():
        if not np.any(np.all(np.isfinite(three.values), axis=1)):
            _merge_rows(sheet, three)
    if "linear" in threes and "gravity" in threes and "accel" not in threes:
        linear, gravity = threes["linear"].values, threes["gravity"].values
        total, valid = linear + gravity, np.all(np.isfinite(gravity), axis=1)
        if np.all(np.isnan(total)) and np.any(valid):  # in rows of their own
            t_s = since_first_s(sheet.times(0, ""))
            total = linear + np.column_stack([np.interp(t_s, t_s[valid], axis[valid]) for axis in gravity.T])
        stated = stated_unit(sheet.columns[threes["linear"].places[0]])
        sheet.columns += [f"total acceleration {axis}" + (f" ({stated})" if stated else "") for axis in "xyz"]
        sheet.cells += list(total.T)
    return sheet


# The ends of names of columns with fractions of a second, without a plural s, and the ns of their unit
_FRACTIONS = {"nsec": 1, "nanosec": 1, "nanosecond": 1, "usec": 1000, "microsecond": 1000, "msec": 10**6}
_FRACTIONS |= {"millisecond": 10**6, "milli": 10**6, "m": 10**6}


def _add_time(sheet: Sheet, names: Sequence[str]) -> None:
    """Add the time of a clock in several columns: of hours, minutes and seconds, of whole seconds and their fraction.

    names: the columns' names by plain()."""
    for k, name in enumerate(names[:-1]):
        last = k
        if [part[:1] for part in names[k : k + 3]] == ["h", "m", "s"] and all(map(_PART.fullmatch, names[k : k + 3])):
            hours, minutes, seconds = (sheet.numbers(k + part) for part in range(3))
            time_ns, last = of_day(10_000.0 * hours + 100.0 * minutes + seconds), k + 2
        elif re.search(r"secs?$|seconds?$|stamp$|time$|clock$", name) and sheet.cells[k].dtype.kind in "iO":
            try:
                time_ns = sheet.times(k, "s" if sheet.cells[k].dtype.kind == "i" else "")
            except InputError:
                continue
        else:
            continue
        after = names[last + 1].removesuffix("s") if last + 1 < len(names) else ""
        size = next((ns for ending, ns in _FRACTIONS.items() if after.endswith(ending)), 0)
        fraction = np.nan_to_num(sheet.numbers(last + 1)) * size if size else np.zeros(len(time_ns))
        if (size and np.any(time_ns[time_ns > REPEATED] % 10**9)) or np.any((fraction < 0) | (fraction >= 1e9)):
            continue
        if size or last > k:
            sheet.columns.append(f"time {' + '.join(sheet.columns[k : last + 1 + (size > 0)])} (ns)")
            sheet.cells.append(np.where(time_ns > REPEATED, time_ns + fraction.astype(np.int64), time_ns))
            return


_PART = re.compile(r"h(our|r)?s?|m(in|inute)?s?|s(ec|econd)?s?")


def _sign_positions(sheet: Sheet, names: Sequence[str]) -> None:
    """Give positions their signs: south and west are negative. The letter is in the same cell or in its own column."""
    for words, letters in ((LATITUDE, "NS"), (LONGITUDE, "EW")):
        place = next((k for k, name in enumerate(names) if re.search(words, name)), None)
        if place is None:
            continue
        for k in dict.fromkeys((place, place + 1, *range(len(names)))):
            texts = as_text(sheet.cells[k]) if k < len(names) and sheet.cells[k].dtype.kind == "O" else []
            marks = {mark for text in texts for mark in re.findall("[A-Za-z]+", text)}
            if marks and marks <= set(letters):
                numbers = [re.sub("[^0-9.]", "", text) for text in as_text(sheet.cells[place])]
                signs = np.array([-1.0 if letters[1] in text else 1.0 for text in texts])
                sheet.cells[place] = signs * np.array([float(number or "nan") for number in numbers])
                break


def _merge_rows(sheet: Sheet, three: _Triple) -> None:
    """Fill axes that are in successive rows into the row of the last axis."""
    starts = np.argmax(np.isfinite(three.values), axis=0)
    ends = np.isfinite(three.values[:, int(np.argmax(starts))])
    for place, column in zip(three.places, three.values.T):
        row = np.maximum.accumulate(np.where(np.isfinite(column), np.arange(len(column)), 0))
        sheet.cells[place] = np.where(ends, column[row], np.nan)


def _find_triples(sheet: Sheet) -> list[_Triple]:
    """The groups of three columns that belong together."""
    stems: dict[str, dict[str, int]] = {}
    for place, name in enumerate(sheet.columns):
        for stem, axis in _split_axis(name):
            while axis in stems.setdefault(stem, {}):
                stem += " "  # another sensor with the same names
            stems[stem][axis] = place
    triples: list[_Triple] = []
    used: set[int] = set()
    for stem, axes in stems.items():
        for group in ["xyz"] if set("xyz") <= set(axes) else _numbered(axes):
            places = [axes[axis] for axis in group]
            stated = stated_unit(sheet.columns[places[0]])
            by_unit = "gyro" if _is_of(RATES, stated) else "accel" if _is_of(ACCELERATIONS, stated) else ""
            kind = _kind(stem) or by_unit
            if kind in ("accel", "gyro", "either") and not _numeric(sheet, places):
                cell = next((cell for place in places for cell in as_text(sheet.cells[place]) if cell), "")
                sheet.unread = (
                    f"its columns {', '.join(sheet.columns[k] for k in places)} hold no numbers ({cell[:20]!a})"
                )
            if not used & set(places) and _numeric(sheet, places):
                used |= set(places)
                triples.append(_Triple(stem, places, kind, sheet.table(places)))
    return triples or _side_by_side(sheet)


def _single(sheet: Sheet, key: str, kind: str) -> dict[str, str]:
    """The columns of single axes whose names fit a sensor of this kind."""
    named = [(stem, axis, name) for name in sheet.columns for stem, axis in _split_axis(name)]
    return {key + axis: name for stem, axis, name in reversed(named) if axis in "xyz" and _kind(stem) == kind}


def _numeric(sheet: Sheet, places: Sequence[int]) -> bool:
    return all(np.mean(np.isfinite(sheet.numbers(place))) > 0.02 for place in places)


def _numbered(axes: dict[str, int]) -> list[list[str]]:
    """Groups of three columns with successive numbers: data1 to data3, data4 to data6."""
    numbers = sorted((axis for axis in axes if axis.isdigit()), key=int)
    if len(numbers) % 3 or not numbers or int(numbers[-1]) - int(numbers[0]) != len(numbers) - 1:
        return []
    return [numbers[k : k + 3] for k in range(0, len(numbers), 3)]


def _side_by_side(sheet: Sheet) -> list[_Triple]:
    """Groups of three adjacent columns without meaningful names, of which one contains gravity if possible."""
    numeric = [
        place
        for place, name in enumerate(sheet.columns)
        if _numeric(sheet, [place]) and not TIME_NAME.search(plain(name)) and not increases(sheet.numbers(place))
        if len(np.unique(sheet.numbers(place))) > 3 and not _KNOWN.search(plain(name))
    ]
    runs = [numeric[k : k + 3] for k in range(len(numeric) - 2)] if len(numeric) > 5 else []
    for shift in range(3):  # where the groups begin
        beside = [run for run in runs[shift::3] if run[2] - run[0] == 2]
        triples = [_Triple("", run, "", sheet.table(run)) for run in beside]
        if any(_has_gravity(triple, None, near=True) for triple in triples):
            return triples
    return [_Triple("", run, "", sheet.table(run)) for run in runs[::3] if run[2] - run[0] == 2]


_KNOWN = re.compile(r"speed|velocity|lat|lon|lng|alt|height|lean|angle|heading|temp|sat|acc")


def _split_axis(name: str) -> Iterator[tuple[str, str]]:
    """Yield (name without its axis, axis) for each way to find an axis in a name."""
    sensor, colon, bare = _without_unit(name).rpartition(":")
    words = re.sub(r"axis|[\W_]+", " ", bare.lower()).split()
    sensor = plain(sensor) + (":" if colon else "")
    if words in (["p"], ["q"], ["r"]):  # rates about x, y and z in flight mechanics
        yield f"{sensor}omega", "xyz"["pqr".index(words[0])]
        return
    for k, word in enumerate(words):  # LongAcc, accLat
        part = next((part for part in _AXES if word.startswith(part) or word.endswith(part)), word)
        words[k : k + 1] = [word] if part == word else [part, word.replace(part, "", 1)]
    for k, word in enumerate(words):
        others = " ".join(words[:k] + words[k + 1 :])
        axis = word if word in ("x", "y", "z") else _AXES.get(word, "")
        if axis and (others or word == axis or _is_of(RATES, stated_unit(name))):
            yield sensor + others, axis
            return
    joined = "".join(words)
    for k, word in reversed(list(enumerate(words))):  # accx, or ax before the name of a sensor
        last = k == len(words) - 1
        if len(joined) > 1 and word[-1] in "xyz" and not _NO_AXIS.search(word) and (last or len(word) == 2):
            yield sensor + " ".join([*words[:k], word[:-1], *words[k + 1 :]]).strip(), word[-1]
            return
    if len(joined) > 1 and joined[0] in "xyz":
        yield sensor + joined[1:], joined[0]
    elif (match := re.fullmatch(r"(.*?)(\d{1,2})", joined)) and (colon or not bare.startswith("#")):
        yield sensor + match[1], match[2]


_NO_AXIS = re.compile(r"..(acy|ity|ncy)$")  # accuracy, velocity, frequency


def _without_unit(name: str) -> str:
    """A name without its unit. The unit is in brackets at the end, or after the last _."""
    bare = re.sub(r"[(\[]([^)\]]*)[)\]]\s*$", lambda bracket: "" if _is_unit(bracket[1]) else " " + bracket[1], name)
    head, mark, last = bare.rpartition("_")
    return head if mark and _is_unit(last) and len(head) > 1 else bare


def _is_of(units: dict[str, float], name: str) -> bool:
    """True if a unit is one of ACCELERATIONS or RATES, or a rare one of the same kind."""
    return name in units or name in (RARE_RATES if units is RATES else RARE_ACCELERATIONS)


def _is_unit(text: str) -> bool:
    name = unit(text)
    in_tables = name in (*SPEEDS, "counts") or _is_of(ACCELERATIONS, name) or _is_of(RATES, name)
    return in_tables or tick_ns(name) > 0 or bool(counts_per(text)) or "/" in text


def stated_unit(name: str) -> str:
    """The unit in a column's name, or ""."""
    in_brackets, last = unit(unit_in(name)), unit(name.rpartition("_")[2])
    bare = plain(name)
    if in_brackets and _is_unit(in_brackets):
        return in_brackets
    if "_" in name and _is_unit(last):
        return last
    if "gyroadc" in bare:  # Betaflight
        return "deg/s"
    for word, unit_name in (("milli", "ms"), ("micro", "us"), ("nano", "ns"), ("minutes", "min"), ("hours", "h")):
        if word in bare:
            return unit_name
    if bare.endswith("ms"):
        return "ms"
    return unit(bare) if unit(bare) in TIMES else ""


def _kind(stem: str) -> str:
    sensor, _, stem = stem.rpartition(":")
    for text in (re.sub(r"[ \d]", "", stem), *re.sub(r"\d", "", stem).split()[-1:], sensor):
        for kind, words in _KINDS.items():
            if text and re.search(words, text):
                return kind
    return ""


# Accelerometer and gyro


def _accel_and_gyro(sheet: Sheet, seconds: Array | None, findings: Findings) -> None:
    """Add the accelerometer and the gyro to findings, and note what is missing."""
    threes = _find_triples(sheet)
    kinds = {kind: [three for three in threes if three.kind == kind] for kind in (*_KINDS, "")}
    scales = _scales(sheet)
    possible = [*kinds["accel"], *kinds["either"], *([] if kinds["accel"] else kinds[""])]
    without = kinds["linear"] or kinds["accel"]
    accel = _first_with_gravity(possible, seconds)
    accel = accel or next((three for three in kinds["linear"] if _has_gravity(three, seconds, near=True)), None)
    exchanged = None if accel else _first_with_gravity(kinds["gyro"], seconds)
    accel = accel or exchanged or next((three for three in kinds["accel"] if not _is_linear(three, seconds)), None)
    unnamed = [three for three in (*kinds["either"], *kinds[""]) if three is not accel]
    others = [three for three in unnamed if accel is None or not _is_second(three, accel, seconds)]
    rates = _partner(accel, kinds["gyro"]) or _partner(accel, others)
    if exchanged is not None and without:
        rates = without[0]
    if accel is None:
        lost = "gravity in its acceleration" if without else "acceleration"
        findings.lacking.append(lost)
        if without:
            findings.remarks.append("gravity has been taken off its acceleration: record the one with gravity")
    else:
        names = _names(sheet, accel)
        of_accel = accelerometer(accel.values, seconds, scales.get("a") or stated_unit(names[0]))
        of_accel.columns, findings.found["a"] = names, of_accel
        if exchanged is not None:
            of_accel.certain, of_accel.why = False, f"{of_accel.why}, so these columns are the accelerometer's"
    if sheet.unread and (accel is None or rates is None):
        findings.remarks.insert(0, sheet.unread)
    if rates is None:
        findings.lacking.append("gyro")
        return
    names = _names(sheet, rates)
    findings.found["g"] = ColumnFinding(names, stated_unit(names[0]), "by name", False)
    if accel is not None:
        of_gyro = gyro(
            accel.values, rates.values, findings.found["a"], seconds, scales.get("g") or stated_unit(names[0])
        )
        of_gyro.columns = names
        findings.found["g"] = of_gyro


def _partner(accel: _Triple | None, gyros: Sequence[_Triple]) -> _Triple | None:
    """The gyro whose names are most like those of the accelerometer, because a table may have two sensors."""
    stem = "" if accel is None else accel.stem
    return max(gyros, key=lambda gyro: difflib.SequenceMatcher(None, stem, gyro.stem).ratio(), default=None)


def _names(sheet: Sheet, three: _Triple) -> list[str]:
    names = sheet.columns
    return [names[place] if names.count(names[place]) == 1 else f"#{place + 1}" for place in three.places]


def _first_with_gravity(threes: Sequence[_Triple], seconds: Array | None) -> _Triple | None:
    """The first group whose vectors are as long as gravity in some unit. Without such a group, the first group with a
    constant length."""
    return next(
        (three for three in threes if _has_gravity(three, seconds, near=True)),
        next((three for three in threes if _has_gravity(three, seconds, near=False)), None),
    )


def _has_gravity(three: _Triple, seconds: Array | None, near: bool) -> bool:
    """Return True if the values contain gravity: their length is constant in calm stretches, and hardly ever near 0.

    near: True if the length must also be gravity's length in some unit. If False, the length must be more constant.
    """
    length, means = three.length, three.mean_lengths(CALM_S, seconds)
    if len(means) < 3 or length <= 0.0 or float(np.percentile(means, 10.0)) < LINEAR * length:
        return False
    most = NEAR if _are_whole(three.good) else LEANT  # raw counts differ by a factor of 2
    if near and not any(1.0 / NEAR < length / gravity < most for gravity in _gravities().values()):
        return False
    return float(np.std(means)) / length < (0.25 if near else 0.02)


def _is_second(three: _Triple, accel: _Triple, seconds: Array | None) -> bool:
    """True for another accelerometer beside accel: its values are as long, and contain gravity."""
    near = 1.0 / NEAR < three.length / max(accel.length, 1e-9) < NEAR
    return near and _has_gravity(three, seconds, near=True)


def _is_linear(three: _Triple, seconds: Array | None) -> bool:
    """True if the mean of the values over some seconds is short, because they do not contain gravity."""
    means = three.mean_lengths(10.0 * CALM_S, seconds)
    return len(means) < 3 or float(np.median(means)) < LINEAR * three.length


def _rows_in(span_s: float, seconds: Array | None, count: int) -> int:
    """The number of rows in span_s. Without a time column, 25 rows, but at most a tenth of all rows."""
    if seconds is None or not np.any(np.isfinite(seconds)):
        return max(1, min(25, count // 10))
    span = float(np.nanmax(seconds) - np.nanmin(seconds))
    return max(1, min(count // 3, round(span_s * count / max(span, 1e-6))))


def calm_length(values: Array, seconds: Array | None) -> float:
    """The median length of vectors, shape (n, 3), in calm stretches, in which their length changes least."""
    values = values[np.all(np.isfinite(values), axis=1)]
    lengths = np.linalg.norm(values, axis=1)
    spread = moving_spread(lengths, _rows_in(CALM_S, seconds, len(values)))
    return float(np.median(lengths[spread <= np.quantile(spread, CALMEST)]))


def _gravities() -> dict[str, float]:
    """Length of gravity in each unit of acceleration."""
    gravities = {"g": 1.0, "m/s2": STANDARD_GRAVITY, "mg": 1000.0}
    return gravities | {f"counts/{size:g}": size for size in COUNTS_PER_G}


def accelerometer(values: Array, seconds: Array | None, stated: str = "") -> ColumnFinding:
    """Find the unit of accelerations from the length of gravity. The finding names no columns.

    values: the accelerations, shape (n, 3). stated: the unit in the names of their columns.
    """
    length = calm_length(values, seconds)
    if stated and not (_is_of(ACCELERATIONS, stated) or counts_per(stated) or stated == "counts"):
        return ColumnFinding([], "?", f"its unit {stated} is not known", False)
    counts = _are_whole(values)
    gravities = {name: size for name, size in _gravities().items() if counts or not name.startswith("counts")}
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


def _are_whole(values: Array) -> bool:
    good = values[np.isfinite(values)]
    return len(good) > 0 and bool(np.all(good == np.rint(good))) and float(np.max(np.abs(good))) > 20.0


def gyro(force: Array, rates: Array, accel: ColumnFinding, seconds: Array | None, stated: str = "") -> ColumnFinding:
    """Find the unit of rates from the turns of gravity or from the columns' names, otherwise from their size.

    rates: shape (n, 3). accel: the finding of the accelerometer. The returned finding names no columns.
    """
    fit = RateFit() if seconds is None else fit_rates(seconds, force, rates)
    if "/" in stated and not (_is_of(RATES, stated) or counts_per(stated)):
        return ColumnFinding([], "?", f"its unit {stated} is not known", False)
    candidates = gyro_units(rates, accel)
    by_fit = fit.unit_among(candidates)
    if _is_of(RATES, stated) or counts_per(stated):
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


def gyro_units(rates: Array, accel: ColumnFinding) -> dict[str, float]:
    """The possible units of rates, shape (n, 3), with their factors to deg/s. Counts are possible if the accelerometer
    has counts."""
    if counts_per(accel.unit) and _are_whole(rates):
        return {f"counts/{size:g}": 1.0 / size for size in COUNTS_PER_DPS}
    return dict(RATES)


def _usual_counts(accel: ColumnFinding) -> float:
    """Counts per deg/s of an MPU6050 whose accelerometer has this unit, because both ranges usually have the same
    setting."""
    size = counts_per(accel.unit)
    return COUNTS_PER_DPS[COUNTS_PER_G.index(size)] if size in COUNTS_PER_G else COUNTS_PER_DPS[0]


def _by_size(rates: Array, force: Array) -> tuple[str, str]:
    """A likely unit and the reason, from the largest rates of a ride or from the noise of a sensor at rest."""
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
