"""Finds the columns of an unknown table that belong together: their names differ only in the axis, or they are side by
side without names."""

import functools
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from kickstand.units import STANDARD_GRAVITY

from ..common.messages import InputError
from ..logs.csv_text import as_text
from ..signals import Array, moving_mean, moving_spread
from .recording import Sheet, increases, plain, unit_in
from .units import (
    ACCELERATIONS,
    COUNTS_PER_G,
    RARE_ACCELERATIONS,
    RARE_RATES,
    RATES,
    REPEATED,
    SPEEDS,
    TIME_NAME,
    TIMES,
    counts_per,
    of_day,
    since_first_s,
    tick_ns,
    unit,
)

LATITUDE, LONGITUDE = r"^lat(?!er)|latitude", r"^lon(?!gi?t?u?d?i?n?al|gacc)|^lng|longitude"
KINDS = {  # kinds of sensors, by the words in their columns' names
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
CALM_S = 0.5  # length of the moving window in which the motion is measured to find calm samples
CALMEST = 0.2  # share of the samples that count as calm
NEAR = 1.3  # a calm acceleration is within this factor of gravity, also with clones of the chip and on rough rides
LEANT = 1.75  # in a long bend, even the calm acceleration is longer than gravity by this factor: 55 degrees of lean
# Length of the mean acceleration, divided by the mean length of the accelerations. Without gravity the ratio is smaller
# than this.
LINEAR = 0.35
# Largest standard deviation of the calm length of gravity, as a share of its length: in a known and in an unknown unit
SPREAD, SPREAD_UNKNOWN = 0.25, 0.02
# Length of gravity in each unit of acceleration
GRAVITIES = {"g": 1.0, "m/s2": STANDARD_GRAVITY, "mg": 1000.0} | {f"counts/{size:g}": size for size in COUNTS_PER_G}


@dataclass
class Triple:
    """Three columns, one per axis. kind: a key of KINDS, "" if neither their names nor their unit show it."""

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
        return np.linalg.norm(moving_mean(self.good, rows_in(span_s, seconds, len(self.values))), axis=1)

    def has_gravity(self, seconds: Array | None, like_gravity: bool) -> bool:
        """True if the values contain gravity: their length is constant in calm stretches, and hardly ever close to 0.

        seconds: times of the rows in s, None if the clock is unknown.
        like_gravity: True if it must also be gravity's length in some unit, False if it must be more constant.
        """
        length, means = self.length, self.mean_lengths(CALM_S, seconds)
        if len(means) < 3 or length <= 0.0 or float(np.percentile(means, 10.0)) < LINEAR * length:
            return False
        # The scales of raw counts differ by a factor of 2, so each length would be like gravity's in one, up to LEANT
        most = NEAR if are_whole(self.good) else LEANT
        if like_gravity and not any(1.0 / NEAR < length / gravity < most for gravity in GRAVITIES.values()):
            return False
        return float(np.std(means)) / length < (SPREAD if like_gravity else SPREAD_UNKNOWN)

    def is_second(self, accel: "Triple", seconds: Array | None) -> bool:
        """True for another accelerometer beside accel: its values are as long, and contain gravity."""
        near = 1.0 / NEAR < self.length / max(accel.length, 1e-9) < NEAR
        return near and self.has_gravity(seconds, like_gravity=True)

    def is_linear(self, seconds: Array | None) -> bool:
        """True if the mean of the values over some seconds is short, because they do not contain gravity."""
        means = self.mean_lengths(10.0 * CALM_S, seconds)
        return len(means) < 3 or float(np.median(means)) < LINEAR * self.length


def completed(sheet: Sheet) -> Sheet:
    """Join the parts of a time, axes that are in several rows, and the user's acceleration with gravity."""
    names = [plain(name) for name in sheet.columns]
    _add_time(sheet, names)
    _sign_positions(sheet, names)
    threes = {three.kind: three for three in reversed(find_triples(sheet))}
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
    """Add the time of a clock in several columns: hours, minutes and seconds, or seconds and their fraction."""
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
    """Make south and west negative. Their letter is in the same cell or in its own column."""
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


def _merge_rows(sheet: Sheet, three: Triple) -> None:
    """Fill axes that are in successive rows into the row of the last axis."""
    starts = np.argmax(np.isfinite(three.values), axis=0)
    ends = np.isfinite(three.values[:, int(np.argmax(starts))])
    for place, column in zip(three.places, three.values.T):
        row = np.maximum.accumulate(np.where(np.isfinite(column), np.arange(len(column)), 0))
        sheet.cells[place] = np.where(ends, column[row], np.nan)


def find_triples(sheet: Sheet) -> list[Triple]:
    """The groups of three columns that belong together."""
    stems: dict[str, dict[str, int]] = {}
    for place, name in enumerate(sheet.columns):
        for stem, axis in _split_axis(name):
            while axis in stems.setdefault(stem, {}):
                stem += " "  # another sensor with the same names
            stems[stem][axis] = place
    triples: list[Triple] = []
    used: set[int] = set()
    for stem, axes in stems.items():
        for group in ["xyz"] if set("xyz") <= set(axes) else _numbered(axes):
            places = [axes[axis] for axis in group]
            stated = stated_unit(sheet.columns[places[0]])
            by_unit = "gyro" if is_of(RATES, stated) else "accel" if is_of(ACCELERATIONS, stated) else ""
            kind = _kind(stem) or by_unit
            if not _numeric(sheet, places):
                if kind in ("accel", "gyro", "either"):
                    cell = next((cell for place in places for cell in as_text(sheet.cells[place]) if cell), "")
                    names = ", ".join(sheet.columns[place] for place in places)
                    sheet.unread = f"its columns {names} hold no numbers ({cell[:20]!a})"
            elif not used & set(places):
                used |= set(places)
                triples.append(Triple(stem, places, kind, sheet.table(places)))
    return triples or _side_by_side(sheet)


def single_axes(sheet: Sheet, key: str, kind: str) -> dict[str, str]:
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


def _side_by_side(sheet: Sheet) -> list[Triple]:
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
        triples = [Triple("", run, "", sheet.table(run)) for run in beside]
        if any(triple.has_gravity(None, like_gravity=True) for triple in triples):
            return triples
    return [Triple("", run, "", sheet.table(run)) for run in runs[::3] if run[2] - run[0] == 2]


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
        if axis and (others or word == axis or is_of(RATES, stated_unit(name))):
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
    """A name without its unit, which is in brackets at the end, or after the last _."""
    bare = re.sub(r"[(\[]([^)\]]*)[)\]]\s*$", lambda bracket: "" if _is_unit(bracket[1]) else " " + bracket[1], name)
    head, mark, last = bare.rpartition("_")
    return head if mark and _is_unit(last) and len(head) > 1 else bare


def is_of(units: dict[str, float], name: str) -> bool:
    """True if a unit is one of ACCELERATIONS or RATES, or a rare one of the same kind."""
    return name in units or name in (RARE_RATES if units is RATES else RARE_ACCELERATIONS)


def _is_unit(text: str) -> bool:
    name = unit(text)
    in_tables = name in (*SPEEDS, "counts") or is_of(ACCELERATIONS, name) or is_of(RATES, name)
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
        for kind, words in KINDS.items():
            if text and re.search(words, text):
                return kind
    return ""


# Gravity


def rows_in(span_s: float, seconds: Array | None, count: int) -> int:
    """The number of rows in span_s; without times 25, but at most a tenth of all rows."""
    if seconds is None or not np.any(np.isfinite(seconds)):
        return max(1, min(25, count // 10))
    span = float(np.nanmax(seconds) - np.nanmin(seconds))
    return max(1, min(count // 3, round(span_s * count / max(span, 1e-6))))


def calm_length(values: Array, seconds: Array | None) -> float:
    """The median length of vectors, shape (n, 3), in calm stretches, in which their length changes least."""
    values = values[np.all(np.isfinite(values), axis=1)]
    lengths = np.linalg.norm(values, axis=1)
    spread = moving_spread(lengths, rows_in(CALM_S, seconds, len(values)))
    return float(np.median(lengths[spread <= np.quantile(spread, CALMEST)]))


def are_whole(values: Array) -> bool:
    good = values[np.isfinite(values)]
    return len(good) > 0 and bool(np.all(good == np.rint(good))) and float(np.max(np.abs(good))) > 20.0
