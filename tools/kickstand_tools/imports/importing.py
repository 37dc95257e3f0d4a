"""Imports a recording of another app or logger: finds its format, joins its sensors, checks and writes the log."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from zipfile import is_zipfile

import numpy as np

from ..checks.axes import log_agrees
from ..checks.log import check_log
from ..common.messages import AT_REST, InputError, Message, Remedy, kind
from ..estimation.alignment import MIN_RIDING_S
from ..logs.log import Log
from ..logs.reader import write_log
from ..signals import Array
from . import mapped, phone_apps, vehicle_loggers
from .files import RecordingFile, read_files
from .recording import GAP_NS, App, AppRecording, Taken, join
from .units import ACCELERATIONS, factor
from .vehicle_loggers import OWN

# Each app gets the files that no earlier app has claimed. phyphox is last, because it only looks at names of columns
_APPS: tuple[App, ...] = (*vehicle_loggers.APPS, *phone_apps.APPS)
LEAST_HZ = 19.5  # a lean needs this many samples per second: 20, minus the error of a phone's clock
NAMES = [app.name for app in reversed(_APPS)]


ImportSlow = kind(
    "import-slow",
    "rate_hz",
    "{rate_hz:.3g} samples per second: at least 20 are needed to find a lean",
    Remedy("record it faster"),
)
ImportShort = kind(
    "import-short",
    "lasts_s least_s",
    "it lasts {lasts_s:.0f} s: to find the alignment from it, at least {least_s:.0f} s of riding are needed",
)
ImportDamaged = kind(
    "import-damaged",
    "rows",
    "damaged rows that are left out: {rows}; a cell or a time is not a number, a time is out of order, a row has too "
    "many cells, or a reading is outside every sensor's range",
)
# In the files of this app, up may read +1 g or -1 g
ImportSign = kind(
    "import-sign",
    "app",
    "which sign accelerations have in {app} is not certain, and no track with turns shows it",
    Remedy(
        f"{AT_REST}, else the ride is mirrored and --units a=-g or a=-m/s2 puts it right",
        f"{AT_REST}, else the ride is mirrored and left is shown as right",
    ),
)
ImportTurned = kind(
    "import-turned",
    "",
    "by the turns of the track, up reads minus 1 g, so the sign of the accelerations is changed",
    Remedy("if latitude and longitude are exchanged or without their sign, the lean is mirrored: leave them out"),
)


@dataclass(eq=False)
class Imported:
    """An imported recording.

    app: name of the app.
    log: times count from the recording's own start.
    taken: the file, columns and unit of each quantity.
    notices: remarks.
    vehicle_axes: True if x already points left, y up and z forward on the vehicle, provided that the logger was mounted
        as its maker requires.
    """

    app: str
    log: Log
    taken: list[Taken]
    notices: list[Message] = field(default_factory=list)
    vehicle_axes: bool = False

    @property
    def rate_hz(self) -> float:
        """Samples per second, without the gaps."""
        return 1.0 / float(np.median(np.diff(self.log.t_s)))

    @property
    def shortfalls(self) -> list[Message]:
        """The reasons why the recording gives no alignment."""
        notices: list[Message] = [ImportSlow(self.rate_hz)] if self.rate_hz < LEAST_HZ else []
        lasts_s = float(self.log.t_s[-1])
        return notices + ([ImportShort(lasts_s, MIN_RIDING_S)] if lasts_s < MIN_RIDING_S else [])

    @property
    def gaps_s(self) -> Array:
        """The duration of each gap."""
        steps = np.diff(self.log.t_s)
        return steps[steps * 1e9 > GAP_NS]


def import_recording(
    source: Path | str,
    columns: Mapping[str, str] | None = None,
    units: Mapping[str, str] | None = None,
    start_s: float | None = None,
    end_s: float | None = None,
) -> Imported:
    """Read a recording of another app or logger: a file, a folder or a zip.

    `kickstand import --help` names the apps whose exports are known. For any other table, columns and units are found
    from the values. If the values do not show them, pass columns and units.

    columns: {"t": "time", "ax": "accX", ...}, with the keys t, ax, ay, az, gx, gy, gz, and optionally speed, lat, lon,
        temp.
    units: {"a": "m/s2", "g": "rad/s", "speed": "km/h"}. A - before a unit reverses the sign.
    start_s, end_s: the stretch to import, in s from the recording's own start.

    Raises InputError.

    >>> import pathlib, tempfile
    >>> rows = [f"{10 * k},0.0,9.81,0.0,0.0,0.0,0.1" for k in range(300)]
    >>> with tempfile.TemporaryDirectory() as directory:
    ...     path = pathlib.Path(directory, "ride.csv")
    ...     _ = path.write_text("\\n".join(["ms,X,Y,Z,P,Q,R", *rows]))
    ...     names = dict(t="ms", ax="X", ay="Y", az="Z", gx="P", gy="Q", gz="R")
    ...     found = import_recording(path, names, {"t": "ms", "a": "m/s2", "g": "rad/s"})
    >>> round(found.rate_hz), found.log.accel_g[0].round(3).tolist(), found.log.gyro_dps[0].round(2).tolist()
    (100, [0.0, 1.0, 0.0], [0.0, 0.0, 5.73])
    """
    recording = _recording(read_files(source), str(source), columns, dict(units or {}))
    return _imported(recording, str(source), start_s, end_s)


def import_of_app(source: Path) -> Imported | None:
    """Import a recording of a known app. Return None if source is something else.

    Raises InputError as import_recording() does, and for a folder or a zip that cannot be read."""
    try:
        files = read_files(source)
        of_apps = recordings(files)
        table = None if of_apps else mapped.table_in(files)
        known = any(app is not OWN for app, _ in of_apps) or (table is not None and "t_s" not in table.sheet.columns)
    except InputError:
        if source.is_dir() or is_zipfile(source):
            raise
        return None
    return _imported(_recording(files, str(source), None, {}), str(source)) if known else None


def _imported(recording: AppRecording, name: str, start_s: float | None = None, end_s: float | None = None) -> Imported:
    log, damaged = join(recording, name)
    _check_sign(recording, log)
    if damaged:
        recording.notices.append(ImportDamaged(damaged))
    log = _stretch(log, start_s, end_s)
    log.notices = recording.notices
    return Imported(recording.app, log, recording.taken, check_log(log).notices, recording.vehicle_axes)


def write_imported(path: Path | str, imported: Imported) -> None:
    """Write the log, gzipped if its name ends in .gz, whole or not at all. Raises InputError.

    The file has the columns of a log. Optional columns without values are left out. t_s counts from the recording's own
    start.

    >>> import tempfile
    >>> log = Log([0.0, 0.01], [[0.0, 1.0, 0.0]] * 2, [[0.0, 0.0, 0.0]] * 2)
    >>> with tempfile.TemporaryDirectory() as directory:
    ...     write_imported(f"{directory}/ride.csv", Imported("none", log, []))
    ...     print(Path(f"{directory}/ride.csv").read_text().splitlines()[1])
    0.000000,0.000000,1.000000,0.000000,0.000000,0.000000,0.000000
    """
    write_log(path, imported.log)


def _recording(
    files: list[RecordingFile], name: str, columns: Mapping[str, str] | None, units: dict[str, str]
) -> AppRecording:
    """Return the only recording among the files. columns: named by the user, or None. Raises InputError."""
    groups = recordings(files)
    if columns is not None:
        return mapped.read_mapped(mapped.sheet_of(files, name, columns), columns, units)
    if not groups:
        table = mapped.table_in(files)
        mapped.check_units(units)
        recording = None if table is None else mapped.read_table(table, units)
        if recording is None:
            raise mapped.unknown(files, name, table)
        return recording
    if len(groups) > 1:
        which = ", ".join(group[0].folder or group[0].name for _, group in groups[:4])
        more = ", ..." if len(groups) > 4 else ""
        raise InputError(f"{name} holds {len(groups)} recordings ({which}{more}): give one of them")
    app, group = groups[0]
    recording = app.read(group, name, units.get("speed", "")) if app.asks_speed else app.read(group, name)
    accepted = {"speed"} if app.asks_speed else set[str]() if recording.sign_known else {"a"}
    if not set(units) <= accepted:
        raise InputError(f"{name} is {app.name}'s, whose units are known: leave --units out, or add --columns, too")
    if "a" in units:
        recording.sign_known = True
        if factor(units["a"], ACCELERATIONS, "a") < 0.0:
            recording.accel.values = -recording.accel.values
            _note_sign(recording, "turned")
    return recording


def recordings(files: list[RecordingFile]) -> list[tuple[App, list[RecordingFile]]]:
    """Return the recordings of known apps among some files, each with its files."""
    groups: list[tuple[App, list[RecordingFile]]] = []
    unclaimed = files
    for app in _APPS:
        groups += [(app, group) for group in app.find(unclaimed)]
        claimed = {id(file) for _, group in groups for file in group}
        unclaimed = [file for file in unclaimed if id(file) not in claimed]
    return groups


def _check_sign(recording: AppRecording, log: Log) -> None:
    """Change an uncertain sign of the accelerometer if the track shows that it is mirrored."""
    if recording.sign_known:
        return  # reading the log gives a remark if it seems wrong
    agrees = log_agrees(log)
    if agrees is None:
        recording.notices.append(ImportSign(recording.app))
    elif agrees:
        _note_sign(recording, "+1 g up, by the turns of the track")
    else:
        log.accel_g = -log.accel_g
        _note_sign(recording, "-1 g up, by the turns of the track: sign turned")
        if recording.app == mapped.NAME:
            recording.notices.append(ImportTurned())


def _note_sign(recording: AppRecording, sign: str) -> None:
    for taken in recording.accel.taken:
        taken.sign = sign if taken.quantity == "accelerometer" else taken.sign


def _stretch(log: Log, start_s: float | None, end_s: float | None) -> Log:
    """The log from start_s to end_s, in s from the recording's own start, or back from its end if negative."""
    since_us = np.rint((log.start_s + log.t_s) * 1e6)
    last_s = float(since_us[-1]) / 1e6
    start_s, end_s = (s if s is None or s >= 0.0 else max(0.0, s + last_s) for s in (start_s, end_s))
    begin_s = start_s or 0.0
    wanted = (since_us >= round(begin_s * 1e6)) & (since_us <= (np.inf if end_s is None else round(end_s * 1e6)))
    if np.count_nonzero(wanted) < 2:
        asked = f"from {begin_s:g} s on" if end_s is None else f"from {begin_s:g} to {end_s:g} s"
        raise InputError(f"{log.name} lasts {last_s:.1f} s: there is nothing {asked}")
    return replace(log.part(wanted))  # its times count from its own first sample
