"""Reads phyphox: one CSV per sensor in a folder or a zip, or one CSV for all sensors. Every phone has Android's signs.

Names of files and columns come from the app's own template,
UI/MainView/CreateExperiment/SimpleExperimentTemplete.swift of https://github.com/phyphox/phyphox-ios, and the "Raw
Data" of https://github.com/phyphox/phyphox-experiments. On an iPhone the app multiplies Core Motion's acceleration and
gravity by -9.81 (ExperimentSensorInput.swift).
"""

import re
from collections.abc import Iterator

import numpy as np

from ...common.messages import InputError
from ...logs.csv_text import as_text
from ..files import RecordingFile
from ..join import with_gravity
from ..recording import (
    AppRecording,
    ReceiverTrack,
    RecordedSensor,
    Sheet,
    first_names,
    plain,
    read_sheet,
    sensor_of,
    track_of,
    unit_in,
)
from ..units import EPOCH_NS, RATES, Nanoseconds, of_seconds, unit

NAME = "phyphox"
_AXIS = re.compile(
    r"^(?:((?:linear )?acceleration.*|accelerometer|gyroscope.*|gravity.*)\s+)?([xyz]) \((m/s\^2|rad/s)\)$",
    re.IGNORECASE,
)
_SIGN = "+1 g up, on every phone"
_WITHOUT_GRAVITY = "linear"  # part of the name of a sensor without gravity


def find_recordings(files: list[RecordingFile]) -> list[list[RecordingFile]]:
    """The recordings among these files: one per folder. meta/ belongs to its parent folder."""
    by_folder: dict[str, list[RecordingFile]] = {}
    for file in files:
        folder = file.folder.removesuffix("meta").removesuffix("/") if _is_meta(file) else file.folder
        by_folder.setdefault(folder, []).append(file)
    return [group for group in by_folder.values() if any(_is_ours(file) for file in group)]


def read(files: list[RecordingFile], name: str) -> AppRecording:
    """Read a recording. Raises InputError for a missing column or sensor."""
    sensors: dict[str, RecordedSensor] = {}
    track: ReceiverTrack | None = None
    pauses = _Pauses(files)
    for file in files:
        if not _is_ours(file):
            continue
        sheet = read_sheet(file)
        for kind, sensor in _sensors(sheet, file.stem, pauses):
            sensors.setdefault(kind, sensor)
        track = track or _location(sheet, pauses)
    remedy = "record Acceleration (with g), or Gravity beside it"
    none = "no acceleration: add the accelerometer, and give all files of the export"
    accel = with_gravity(sensors, sensors.__getitem__, name, "acceleration", remedy, none)
    if "gyro" not in sensors:
        raise InputError(f"{name}: no gyroscope: add it to the experiment, and give all files of the export")
    return AppRecording(NAME, accel, sensors["gyro"], track, utc_ns=pauses.utc_ns)


def _is_meta(file: RecordingFile) -> bool:
    return file.folder == "meta" or file.folder.endswith("/meta")


def _is_ours(file: RecordingFile) -> bool:
    """True if the first line has a time in s and then quantities with their units in brackets."""
    first = first_names(file)
    if _is_meta(file) or len(first) < 2 or not re.fullmatch(r"(.*\s)?time \(s\)", first[0], re.IGNORECASE):
        return False
    axes = [_AXIS.match(column) for column in first if re.search(r"\b[xyz]\b", column, re.IGNORECASE)]
    if "accelerometer x (m/s^2)" in map(str.lower, first) and not file.name.endswith("Accelerometer.csv"):
        return False  # other loggers name their columns like the sensor, too, but not their files
    return bool(axes and all(axes)) or "latitude" in map(plain, first)


def _sensors(sheet: Sheet, stem: str, pauses: "_Pauses") -> Iterator[tuple[str, RecordedSensor]]:
    """Yield (kind, sensor) for each sensor in a file. The column before a sensor is its time."""
    groups: dict[tuple[int, str, str], dict[str, int]] = {}
    time_place = 0
    for place, column in enumerate(sheet.columns):
        match = _AXIS.match(column)
        if plain(column).endswith("time"):
            time_place = place
        elif match:
            key = time_place, (match[1] or stem).lower(), unit(match[3])
            groups.setdefault(key, {}).setdefault(match[2].lower(), place)
    for (time, what, unit_name), axes in groups.items():
        if len(axes) < 3:
            continue
        time_ns = pauses.after(sheet.times(time))
        of_gyro = unit_name in RATES
        words = ("gyro", unit_name, "right-handed") if of_gyro else ("accelerometer", unit_name, _SIGN)
        yield (
            "gyro" if of_gyro else _kind(what),
            sensor_of(sheet, time_ns, [axes[axis] for axis in "xyz"], *words),
        )


def _kind(what: str) -> str:
    if "gravity" in what:
        return "gravity"
    return "user" if _WITHOUT_GRAVITY in what or "without g" in what else "total"


def _location(sheet: Sheet, pauses: "_Pauses") -> ReceiverTrack | None:
    lat, lon = sheet.place("Latitude"), sheet.place("Longitude")
    speed = sheet.place("Velocity", "Speed")
    if lat is None and speed is None:
        return None
    time = next((place for place, column in enumerate(sheet.columns) if plain(column).endswith("time")), 0)
    unit_name = unit(unit_in(sheet.columns[speed])) if speed is not None else ""
    return track_of(sheet, pauses.after(sheet.times(time)), speed, lat, lon, unit_name or "m/s")


class _Pauses:
    """Reads from meta/time.csv when the experiment was started and paused. The experiment's time stops during a pause,
    but UTC does not."""

    def __init__(self, files: list[RecordingFile]) -> None:
        self.utc_ns: int | None = None
        self._resumed: list[tuple[int, int]] = []  # (the experiment's time, duration of all pauses until then), ns
        file = next((file for file in files if _is_meta(file) and file.stem == "time"), None)
        if file is None or len(file.first_lines(2)) < 2:
            return
        sheet = read_sheet(file)
        experiment, utc = sheet.place("experiment time"), sheet.place("system time")
        if experiment is None or utc is None or sheet.columns[0].lower() != "event":
            return
        events = [event.upper() for event in as_text(sheet.cells[0])]
        time_ns = of_seconds(sheet.numbers(experiment)).tolist()
        clock = of_seconds(sheet.numbers(utc)).tolist()
        starts = [k for k, event in enumerate(events) if event == "START" and k < len(clock)]
        starts = [k for k in starts if 0 <= time_ns[k] < EPOCH_NS < clock[k]]
        if starts:
            self.utc_ns = clock[starts[0]] - time_ns[starts[0]]
            self._resumed = [
                (time_ns[k], max(0, clock[k] - clock[starts[0]] - (time_ns[k] - time_ns[starts[0]])))
                for k in starts[1:]
            ]

    def after(self, time_ns: Nanoseconds) -> Nanoseconds:
        """Add to each of the experiment's times the pauses before it."""
        moved_ns = time_ns.copy()
        for since_ns, paused in self._resumed:
            moved_ns = np.where(time_ns >= since_ns, time_ns + paused, moved_ns)
        return moved_ns
