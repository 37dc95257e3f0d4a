"""Reads the recordings of apps for phones. The axes are the phone's. Some phones record gravity separately."""

import re
from collections.abc import Callable, Container, Iterator

import numpy as np

from ..common.messages import InputError
from ..logs.csv_text import as_text
from .files import RecordingFile
from .recording import (
    App,
    AppRecording,
    ReceiverTrack,
    RecordedSensor,
    Sheet,
    cells_in,
    each_file,
    first_names,
    in_order,
    on_clock,
    plain,
    read_sheet,
    sensor_of,
    step_ns,
    track_of,
    unit_in,
)
from .units import EPOCH_NS, NO_TIME, RATES, REPEATED, Nanoseconds, of_seconds, unit

_IN_GYRO = "gyro", "rad/s", "right-handed"


def _both_sensors(
    recorded: Container[str],
    sensor: Callable[[str], RecordedSensor],
    name: str,
    whose: str,
    remedy: str,
    no_accel: str,
    no_gyro: str,
) -> tuple[RecordedSensor, RecordedSensor]:
    """Return the accelerometer with gravity, and the gyro.

    recorded: the sensors that exist among "total" (with gravity), "user" (without gravity), "gravity" and "gyro".
    sensor: returns the sensor of one of these names.
    whose, remedy: for the message if only the acceleration without gravity exists.
    no_accel, no_gyro: the messages if a sensor is missing.

    Raises InputError in these cases.
    """
    if "total" in recorded:
        accel = sensor("total")
    elif "user" not in recorded:
        raise InputError(f"{name}: {no_accel}")
    elif "gravity" not in recorded:
        raise InputError(f"{name}: gravity has been taken off its {whose}, and without it there is no lean: {remedy}")
    else:
        user, gravity = (in_order(sensor(which), name) for which in ("user", "gravity"))
        user.taken[0].sign = "without gravity: gravity added"
        values = user.values + on_clock(gravity, user.time_ns, step_ns(user))
        taken = [*user.taken, *gravity.taken]
        accel = RecordedSensor(user.name, user.time_ns, values, max(user.damaged, gravity.damaged), taken)
    if "gyro" not in recorded:
        raise InputError(f"{name}: {no_gyro}")
    return accel, sensor("gyro")


# SensorLog

# Sensor, the sensor whose clock it has, and the columns without their axis. The first that exists counts
_SENSORLOG = (
    ("total", "accelerometer", "accelerometerAcceleration"),
    ("user", "motion", "motionUserAcceleration"),
    ("gravity", "motion", "motionGravity"),
    ("gyro", "gyro", "gyroRotation"),
    ("gyro", "motion", "motionRotationRate"),
)


def _is_sensorlog(file: RecordingFile) -> bool:
    return any(cell.startswith(("accelerometerAccelerationX", "motionUserAccelerationX")) for cell in first_names(file))


def _read_sensorlog(files: list[RecordingFile], name: str) -> AppRecording:
    """Read SensorLog (Bernd Thomas) from an iPhone or a Watch: one wide CSV. Each sensor has a time since the start of
    iOS.

    The columns are the same as in the example logs at http://sensorlog.berndthomas.net. Values come from Core Motion.
    Accelerations are in g, and read -1 along the axis that points up at rest
    (https://developer.apple.com/reference/uikit/uiacceleration). These accelerations are the sum of gravity and the
    user's acceleration, which the file also contains. Rates are in rad/s, right-handed.
    """
    sheet = read_sheet(files[0])
    sources: dict[str, tuple[str, list[int]]] = {}
    for kind, clock, column in _SENSORLOG:
        places, missing = sheet.axes(*(f"{column}{axis}" for axis in "XYZ"))
        if not missing and np.any(np.isfinite(sheet.table(places)).all(axis=1)):
            sources.setdefault(kind, (clock, places))

    def sensor(kind: str) -> RecordedSensor:
        clock, places = sources[kind]
        time_ns = _times(sheet, clock)
        time_ns = np.where(np.diff(time_ns, prepend=NO_TIME) == 0, REPEATED, time_ns)  # rows repeat old samples
        if kind == "gyro":
            return sensor_of(sheet, time_ns, places, *_IN_GYRO)
        return sensor_of(sheet, time_ns, places, "accelerometer", "g", "Core Motion, -1 g up: sign turned", -1.0)

    remedy = "log the accelerometer, or gravity beside the user's acceleration"
    no_gyro = "no gyroRotation or motionRotationRate in it: log the gyro, too"
    sensors = _both_sensors(sources, sensor, name, "acceleration", remedy, f"no acceleration: {remedy}", no_gyro)
    time_ns = _times(sheet, "accelerometer" if "total" in sources else "motion")
    fix_ns, fix = time_ns, sheet.place("locationTimestamp_since1970")
    if fix is not None:  # a row has a new fix if the fix's own time has changed
        fix_ns = np.where(np.diff(sheet.numbers(fix), prepend=np.nan) == 0.0, NO_TIME, time_ns)
    speed, lat, lon = (sheet.place(f"location{column}") for column in ("Speed", "Latitude", "Longitude"))
    track = track_of(sheet, fix_ns, speed, lat, lon)
    return AppRecording(SENSORLOG.name, *sensors, track, utc_ns=_utc_of_rows(sheet, time_ns))


def _times(sheet: Sheet, sensor: str) -> Nanoseconds:
    place = sheet.place(f"{sensor}Timestamp_sinceReboot", "accelerometerTimestamp_sinceReboot", "loggingTime")
    if place is None:
        raise InputError(f"{sheet.name}: no column {sensor}Timestamp_sinceReboot(s): export it with the timestamps")
    return sheet.times(place)


def _utc_of_rows(sheet: Sheet, time_ns: Nanoseconds) -> int | None:
    """UTC minus the time since the start of iOS, from the times at which the rows were logged."""
    logged = sheet.place("loggingTime")
    try:
        written = np.full(len(time_ns), NO_TIME) if logged is None else sheet.times(logged, "")
    except InputError:
        return None
    both = (written != NO_TIME) & (time_ns != NO_TIME)
    return int(np.median(written[both] - time_ns[both])) if np.any(both) else None


SENSORLOG = App("SensorLog", each_file(_is_sensorlog), _read_sensorlog)

# Sensor Logger

_TOTAL, _RAW, _USER, _GRAVITY = "totalacceleration", "accelerometeruncalibrated", "accelerometer", "gravity"
# The sensor of each file. Of two files of one sensor the first counts
_SENSOR_OF = {_TOTAL: "total", _RAW: "total", _USER: "user", _GRAVITY: "gravity"}
_SENSOR_OF |= {"gyroscope": "gyro", "gyroscopeuncalibrated": "gyro"}
_FIRST_NAMES = ["time", "seconds_elapsed"]


def _sensor_logger_recordings(files: list[RecordingFile]) -> list[list[RecordingFile]]:
    """The recordings among these files, one per folder."""
    own = [file for file in files if file.stem in _SENSOR_OF and first_names(file)[:2] == _FIRST_NAMES]
    folders = dict.fromkeys(file.folder for file in own)
    return [[file for file in files if file.folder == folder] for folder in folders]


def _read_sensor_logger(files: list[RecordingFile], name: str) -> AppRecording:
    """Read Sensor Logger (Kelvin Choi): one CSV per sensor, times in ns since 1970, signs as in the phone's system.

    In https://github.com/tszheichoi/awesome-sensor-logger, UNITS.md describes files and units, and COORDINATES.md and
    CROSSPLATFORM.md describe the signs. Accelerometer.csv does not contain gravity. An iPhone's acceleration and
    gravity have the opposite sign, and AccelerometerUncalibrated is in g, unless "Standardise Units & Frames" was on.
    """
    by_stem = {file.stem: file for file in files}
    apple, standard = _platform(by_stem)
    turned = apple is not False and not standard
    if turned and apple is None and (_RAW in by_stem or _GRAVITY in by_stem):
        raise InputError(
            f"{name}: Metadata.csv is missing, which says whether an iPhone or an Android phone recorded this: their "
            "accelerations have opposite signs; give all files of the export"
        )
    up = "iPhone, -1 g up: sign turned" if turned else "+1 g up, standardised" if apple else "Android, +1 g up"
    stems = {kind: stem for stem, kind in reversed(_SENSOR_OF.items()) if stem in by_stem}

    def sensor(kind: str) -> RecordedSensor:
        sheet = read_sheet(by_stem[stems[kind]])
        places, missing = sheet.axes("time", "x", "y", "z")
        if missing:
            raise InputError(f"{sheet.name}: no columns time, x, y and z: export it again")
        time_ns = sheet.times(places[0], "ns")
        if kind == "gyro":
            return sensor_of(sheet, time_ns, places[1:], *_IN_GYRO)
        unit_name = "g" if turned and stems[kind] == _RAW else "m/s2"
        return sensor_of(sheet, time_ns, places[1:], "accelerometer", unit_name, up, -1.0 if turned else 1.0)

    give = "give all files of the export"
    no_accel = f"no acceleration: switch Accelerometer and Gravity on, and {give}"
    no_gyro = f"no Gyroscope.csv: switch the gyroscope on, and {give}"
    remedy = "record Gravity, or Total Acceleration, beside it"
    sensors = _both_sensors(stems, sensor, name, "Accelerometer.csv", remedy, no_accel, no_gyro)
    track = None
    if "location" in by_stem and len(by_stem["location"].first_lines(2)) > 1:
        sheet = read_sheet(by_stem["location"])
        time_ns = sheet.times(sheet.place("time") or 0, "ns")
        speed, lat, lon = (sheet.place(column) for column in ("speed", "latitude", "longitude"))
        track = track_of(sheet, time_ns, speed, lat, lon)
    return AppRecording(SENSOR_LOGGER.name, *sensors, track, utc_ns=0)


def _platform(by_stem: dict[str, RecordingFile]) -> tuple[bool | None, bool]:
    """True for an iPhone (None: unknown), and True if units and signs were standardised."""
    if "metadata" in by_stem and len(by_stem["metadata"].first_lines(2)) > 1:
        names, values = (cells_in(line) for line in by_stem["metadata"].first_lines(2))
        metadata = {name.lower(): value.lower() for name, value in zip(names, values)}
        if metadata.get("platform"):
            return metadata["platform"] == "ios", metadata.get("standardisation") == "true"
    return (False, False) if _TOTAL in by_stem else (None, False)  # only Android has that file


SENSOR_LOGGER = App("Sensor Logger", _sensor_logger_recordings, _read_sensor_logger)

# Sensor Kinetics

_KINDS = {"acc": "total", "lac": "user", "grv": "gravity", "gyr": "gyro"}
_END = re.compile(r"^(.*?)[_.]?(acc|gyr|grv|lac|mag|rot)m?$")  # of a file's name


def _kinetics_recordings(files: list[RecordingFile]) -> list[list[RecordingFile]]:
    """The recordings among these files: the names of a recording's files differ only in the sensor."""
    groups: dict[str, list[RecordingFile]] = {}
    for file in files:
        if [cell.lower() for cell in first_names(file)] == ["time", "x_value", "y_value", "z_value"]:
            match = _END.match(file.stem)
            groups.setdefault(f"{file.folder}/{match[1] if match else file.stem}", []).append(file)
    return list(groups.values())


def _read_sensor_kinetics(files: list[RecordingFile], name: str) -> AppRecording:
    """Read Sensor Kinetics (Innoventions): NAME_accm.csv, NAME_gyrm.csv and so on, with a rounded time in s from the
    start.

    The names of the files are described in https://rotoview.com/multi-sensor-file-system.html. Example recordings, some
    with semicolons and decimal commas, are in https://github.com/Intelligent-Systems-Phystech/MobileSensorData. Units
    are m/s2 and rad/s. At rest with the screen up, z is +9.8.
    """
    matches = ((_END.match(file.stem), file) for file in files)
    by_kind = {_KINDS.get(match[2] if match else "", ""): file for match, file in matches}

    def sensor(kind: str) -> RecordedSensor:
        sheet = read_sheet(by_kind[kind])
        words = _IN_GYRO if kind == "gyro" else ("accelerometer", "m/s2", "+1 g up, as on Android")
        return sensor_of(sheet, sheet.times(0), [1, 2, 3], *words)

    give = "give the folder or the zip with NAME_accm.csv and NAME_gyrm.csv"
    remedy = "give the file of the accelerometer (_accm), or of gravity (_grvm), too"
    missing = f"no accelerometer: {give}", f"no gyroscope: {give}"
    sensors = _both_sensors(by_kind, sensor, name, "linear acceleration", remedy, *missing)
    return AppRecording(SENSOR_KINETICS.name, *sensors, sign_known=False)


SENSOR_KINETICS = App("Sensor Kinetics", _kinetics_recordings, _read_sensor_kinetics)

# phyphox

_AXIS = re.compile(
    r"^(?:((?:linear )?acceleration.*|accelerometer|gyroscope.*|gravity.*)\s+)?([xyz]) \((m/s\^2|rad/s)\)$",
    re.IGNORECASE,
)


def _phyphox_recordings(files: list[RecordingFile]) -> list[list[RecordingFile]]:
    """The recordings among these files: one per folder. meta/ belongs to its parent folder."""
    by_folder: dict[str, list[RecordingFile]] = {}
    for file in files:
        folder = file.folder.removesuffix("meta").removesuffix("/") if _is_meta(file) else file.folder
        by_folder.setdefault(folder, []).append(file)
    return [group for group in by_folder.values() if any(_is_phyphox(file) for file in group)]


def _read_phyphox(files: list[RecordingFile], name: str) -> AppRecording:
    """Read phyphox: one CSV per sensor in a folder or a zip, or one CSV for all sensors. Every phone has Android's
    signs.

    Names of files and columns come from the app's own template,
    UI/MainView/CreateExperiment/SimpleExperimentTemplete.swift of https://github.com/phyphox/phyphox-ios, and the "Raw
    Data" of https://github.com/phyphox/phyphox-experiments. On an iPhone the app multiplies Core Motion's acceleration
    and gravity by -9.81 (ExperimentSensorInput.swift).
    """
    sensors: dict[str, RecordedSensor] = {}
    track: ReceiverTrack | None = None
    pauses = _Pauses(files)
    for sheet, stem in ((read_sheet(file), file.stem) for file in files if _is_phyphox(file)):
        for kind, sensor in _sensors(sheet, stem, pauses):
            sensors.setdefault(kind, sensor)
        track = track or _location(sheet, pauses)
    give = "give all files of the export"
    no_accel = f"no acceleration: add the accelerometer, and {give}"
    no_gyro = f"no gyroscope: add it to the experiment, and {give}"
    remedy = "record Acceleration (with g), or Gravity beside it"
    both = _both_sensors(sensors, sensors.__getitem__, name, "acceleration", remedy, no_accel, no_gyro)
    return AppRecording(PHYPHOX.name, *both, track, utc_ns=pauses.utc_ns)


def _is_meta(file: RecordingFile) -> bool:
    return file.folder == "meta" or file.folder.endswith("/meta")


def _is_phyphox(file: RecordingFile) -> bool:
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
        kind, words = "total", ("accelerometer", unit_name, "+1 g up, on every phone")
        if unit_name in RATES:
            kind, words = "gyro", _IN_GYRO
        elif "gravity" in what:
            kind = "gravity"
        elif "linear" in what or "without g" in what:
            kind = "user"
        yield kind, sensor_of(sheet, pauses.after(sheet.times(time)), [axes[axis] for axis in "xyz"], *words)


def _location(sheet: Sheet, pauses: "_Pauses") -> ReceiverTrack | None:
    lat, lon, speed = sheet.place("Latitude"), sheet.place("Longitude"), sheet.place("Velocity", "Speed")
    if lat is None and speed is None:
        return None
    time = next((place for place, column in enumerate(sheet.columns) if plain(column).endswith("time")), 0)
    unit_name = unit(unit_in(sheet.columns[speed])) if speed is not None else ""
    return track_of(sheet, pauses.after(sheet.times(time)), speed, lat, lon, unit_name or "m/s")


class _Pauses:
    """Reads from meta/time.csv when the experiment was started and paused. The experiment's time stops during a pause,
    but UTC does not."""

    def __init__(self, files: list[RecordingFile]) -> None:
        """Read meta/time.csv, which has a row for each start and pause of the experiment, if it exists."""
        self.utc_ns: int | None = None
        self._resumed: list[tuple[int, int]] = []  # (the experiment's time, duration of all pauses until then), ns
        file = next((file for file in files if _is_meta(file) and file.stem == "time"), None)
        if file is None or len(file.first_lines(2)) < 2:
            return
        sheet = read_sheet(file)
        experiment, utc = sheet.place("experiment time"), sheet.place("system time")
        if experiment is None or utc is None or sheet.columns[0].lower() != "event":
            return
        time_ns, clock = (of_seconds(sheet.numbers(place)).tolist() for place in (experiment, utc))
        rows = zip(as_text(sheet.cells[0]), time_ns, clock)
        starts = [(t, utc - t) for event, t, utc in rows if event.upper() == "START" and 0 <= t < EPOCH_NS < utc]
        if starts:
            (_, self.utc_ns), *resumed = starts
            self._resumed = [(t, max(0, utc_minus_t - self.utc_ns)) for t, utc_minus_t in resumed]

    def after(self, time_ns: Nanoseconds) -> Nanoseconds:
        """Add to each of the experiment's times the pauses before it."""
        moved_ns = time_ns.copy()
        for since_ns, paused in self._resumed:
            moved_ns = np.where(time_ns >= since_ns, time_ns + paused, moved_ns)
        return moved_ns


PHYPHOX = App("phyphox", _phyphox_recordings, _read_phyphox)
APPS = SENSORLOG, SENSOR_LOGGER, SENSOR_KINETICS, PHYPHOX
