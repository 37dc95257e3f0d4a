"""Writes a known ride as apps and loggers export it. Each writer follows the documentation of the format's maker.

The addresses of these documents are in the readers in kickstand_tools.imports and in the tests. No data in this module
is copied from an export.
"""

import functools
import io
import math
import zipfile
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from kickstand_sim.simulation.scripted import script

START_UTC_S = 1_715_938_200.25  # 2024-05-17 09:30:00.25 UTC
BERLIN = 52.5, 13.4
G = 9.80665
# The axes of a phone that is tilted in its holder. Each row is an axis, with its left, up and forward in the vehicle.
PHONE = np.array([[-0.96, 0.0, -0.28], [-0.168, 0.8, 0.576], [0.224, 0.6, -0.768]])
_EARTH_M = 6_371_000.0


@dataclass
class Riding:
    """The true motion of a ride, n samples.

    t_s: time, from 0 on, shape (n).
    force_g: specific force along the vehicle's left, up, forward, shape (n, 3).
    rates_dps: rates about the same axes, shape (n, 3).
    speed_mps, lat_deg, lon_deg, lean_deg: shape (n).
    """

    t_s: np.ndarray
    force_g: np.ndarray
    rates_dps: np.ndarray
    speed_mps: np.ndarray
    lat_deg: np.ndarray
    lon_deg: np.ndarray
    lean_deg: np.ndarray

    def every(self, steps: int, offset: int = 0) -> "Riding":
        """Keep one sample of every `steps`, starting at the index `offset`."""
        return Riding(*(getattr(self, name)[offset::steps] for name in self.__dataclass_fields__))

    def each_second(self) -> "Riding":
        """Return one sample per second."""
        return self.every(round(1.0 / float(np.median(np.diff(self.t_s)))), 20)

    def without(self, begin_s: float, end_s: float) -> "Riding":
        """Return the ride without the samples between two times."""
        valid = (self.t_s < begin_s) | (self.t_s >= end_s)
        return Riding(*(getattr(self, name)[valid] for name in self.__dataclass_fields__))

    @property
    def phone_g(self) -> np.ndarray:
        """The force in the phone's axes, in g."""
        return self.force_g @ PHONE.T

    @property
    def phone_rad(self) -> np.ndarray:
        """The rates about the phone's axes, in rad/s."""
        return np.radians(self.rates_dps @ PHONE.T)

    @property
    def gravity_g(self) -> np.ndarray:
        """The gravity that a phone reports: a specific force of 1 g along the direction up, in the phone's axes."""
        lean = np.radians(self.lean_deg)
        return np.column_stack((np.sin(lean), np.cos(lean), np.zeros(len(lean)))) @ PHONE.T


@functools.cache
def riding(rate_hz: int = 200) -> Riding:
    """Return a ride of half a minute: stand, set off, turn to each side, stop. The positions begin in Berlin."""
    parts = [script.upright(3), script.accelerate(14, 4), script.turn(-25, 4), script.straight(1)]
    ride = script.Ride([*parts, script.turn(35, 4), script.straight(1), script.brake(0, 3), script.wait(2)], 0.02)
    t_s = np.arange(round(ride.seconds * rate_hz)) / rate_hz
    motion = np.array([ride.motion(t) for t in t_s])
    truth = [ride.truth(t) for t in t_s]
    lean, speed, yaw = (np.array([row[k] for row in truth]) for k in range(3))
    course = np.cumsum(np.radians(yaw)) / rate_hz  # counterclockwise from east
    east, north = (np.cumsum(speed * wave(course)) / rate_hz for wave in (np.cos, np.sin))
    lat = BERLIN[0] + np.degrees(north / _EARTH_M)
    lon = BERLIN[1] + np.degrees(east / _EARTH_M) / math.cos(math.radians(BERLIN[0]))
    return Riding(t_s, motion[:, :3], motion[:, 3:], speed, lat, lon, lean)


def lines(names: Sequence[str], rows: Iterable[Sequence[object]], separator: str = ",", comma: bool = False) -> str:
    """Return a table as text. comma: True to write a decimal comma."""
    text = [separator.join(names)]
    for row in rows:
        cells = [cell if isinstance(cell, str) else f"{cell:.9g}" for cell in row]
        text.append(separator.join(cell.replace(".", ",") for cell in cells) if comma else separator.join(cells))
    return "\n".join(text) + "\n"


def into(target: Path, files: dict[str, str]) -> Path:
    """Write files into a folder, or into a zip archive if the name of target ends in .zip."""
    if target.suffix != ".zip":
        for name, text in files.items():
            (target / name).parent.mkdir(parents=True, exist_ok=True)
            (target / name).write_text(text, encoding="utf-8", newline="")
        return target
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, text in files.items():
            archive.writestr(name, text)
    target.write_bytes(packed.getvalue())
    return target


def phyphox(ride: Riding, separator: str = ",", comma: bool = False) -> dict[str, str]:
    """Write the files and columns of the app's own template.

    The gyro has half the accelerometer's rate and starts slightly later. The GPS has one fix per second.
    """

    def number(value: float, digits: int = 9) -> str:
        return f"{value:.{digits}E}".replace(".", "," if comma else ".")

    def table(names: list[str], *columns: np.ndarray) -> str:
        text = [separator.join(f'"{name}"' for name in names)]
        text += [separator.join(map(number, row)) for row in np.column_stack(columns).tolist()]
        return "\n".join(text)  # the file has no line feed at its end

    gyro, fixes = ride.every(2, 1), ride.each_second()
    metres = ["Time (s)", *[f"{axis} (m/s^2)" for axis in "XYZ"]]
    header = ["Time (s)", "Latitude (°)", "Longitude (°)", "Height (m)", "Velocity (m/s)", "Direction (°)"]
    zeros = np.zeros(len(fixes.t_s))
    start = separator.join(['"START"', number(0.0), number(START_UTC_S, 15), '"2024"'])
    return {
        "Gyroscope.csv": table(["Time (s)", *[f"{axis} (rad/s)" for axis in "XYZ"]], gyro.t_s, gyro.phone_rad),
        "Linear Accelerometer.csv": table(metres, ride.t_s, 9.81 * (ride.phone_g - ride.gravity_g)),
        "Accelerometer.csv": table(metres, ride.t_s, 9.81 * ride.phone_g),
        "Location.csv": table(header, fixes.t_s, fixes.lat_deg, fixes.lon_deg, zeros, fixes.speed_mps, zeros),
        "meta/device.csv": f'"property"{separator}"value"\n"deviceModel"{separator}"Pixel"\n',
        "meta/time.csv": separator.join(f'"{name}"' for name in ("event", "experiment time", "system time", "text"))
        + f"\n{start}\n",
    }


def sensor_logger(ride: Riding, platform: str = "android", standard: bool = False) -> dict[str, str]:
    """Write one CSV per sensor, with columns in the order z, y, x and times in ns since 1970.

    An iPhone writes no TotalAcceleration.
    """
    sign = -1.0 if platform == "ios" and not standard else 1.0
    gyro = ride.every(2, 1)
    head = ["time", "seconds_elapsed", "z", "y", "x"]

    def table(part: Riding, values: np.ndarray) -> str:
        times = (START_UTC_S + part.t_s) * 1e3
        rows = zip(times.tolist(), part.t_s.tolist(), values[:, ::-1].tolist())
        return lines(head, [(f"{round(ms * 1000)}000", t, *row) for ms, t, row in rows])

    fixes = ride.each_second()
    location = ["time", "seconds_elapsed", "speed", "bearing", "altitude", "longitude", "latitude"]
    rows = zip(fixes.t_s.tolist(), fixes.speed_mps.tolist(), fixes.lon_deg.tolist(), fixes.lat_deg.tolist())
    located = [
        (f"{round((START_UTC_S + t) * 1e6)}000", t, v, "-1", "34.5", f"{lon:.7f}", f"{lat:.7f}")
        for t, v, lon, lat in rows
    ]
    names = "version,device name,recording epoch time,recording time,recording timezone,platform,appVersion,device id,"
    names += "sensors,sampleRateMs,standardisation,platform version"
    said = f"3,Phone,{round(START_UTC_S * 1000)},2024-05-17_09-30-00,Europe/Berlin,{platform},1.47,x,Accelerometer,10,"
    files = {
        "Accelerometer.csv": table(ride, sign * G * (ride.phone_g - ride.gravity_g)),
        "Gravity.csv": table(ride, sign * G * ride.gravity_g),
        "Gyroscope.csv": table(gyro, gyro.phone_rad),
        "Location.csv": lines(location, located),
        "Annotation.csv": "time,seconds_elapsed,text,millisecond_press_duration\n",
        "Metadata.csv": f"{names}\n{said}{str(standard).lower()},17\n",
    }
    if platform == "android":
        files["TotalAcceleration.csv"] = table(ride, G * ride.phone_g)
    return files


def sensorlog(ride: Riding, separator: str = ",", accelerometer: bool = True) -> str:
    """Write the app's wide CSV: Core Motion's values, rows that repeat old values, and one GPS fix per second."""
    boot_s = 86_400.0
    names = ["loggingTime(txt)", "loggingSample(N)", "locationTimestamp_since1970(s)", "locationLatitude(WGS84)"]
    names += ["locationLongitude(WGS84)", "locationSpeed(m/s)"]
    if accelerometer:
        names += ["accelerometerTimestamp_sinceReboot(s)", *[f"accelerometerAcceleration{axis}(G)" for axis in "XYZ"]]
    names += ["motionTimestamp_sinceReboot(s)", *[f"motionRotationRate{axis}(rad/s)" for axis in "XYZ"]]
    names += [f"motionUserAcceleration{axis}(G)" for axis in "XYZ"] + [f"motionGravity{axis}(G)" for axis in "XYZ"]
    rows = []
    force, rates, gravity = -ride.phone_g, ride.phone_rad, -ride.gravity_g
    for k, t in enumerate(ride.t_s.tolist()):
        fix = k // 100 * 100
        utc = START_UTC_S + t
        clock = f"2024-05-17 11:{30 + int(utc - 1_715_938_200) // 60:02d}:{(utc - 1_715_938_200) % 60:06.3f} +0200"
        row = [clock, str(k), f"{START_UTC_S + ride.t_s[fix]:.3f}"]
        row += [f"{ride.lat_deg[fix]:.7f}", f"{ride.lon_deg[fix]:.7f}", f"{ride.speed_mps[fix]:.3f}"]
        if accelerometer:
            row += [f"{boot_s + t:.6f}", *[f"{value:.6f}" for value in force[k]]]
        row += [f"{boot_s + ride.t_s[k // 2 * 2]:.6f}", *[f"{value:.6f}" for value in rates[k // 2 * 2]]]
        row += [f"{value:.6f}" for value in (force - gravity)[k // 2 * 2]]
        row += [f"{value:.6f}" for value in gravity[k // 2 * 2]]
        rows.append(row)
    return lines(names, rows, separator)


def sensor_kinetics(ride: Riding, semicolon: bool = False) -> dict[str, str]:
    """Return the texts of Ride_accm.csv, Ride_gyrm.csv, Ride_lacm.csv and Ride_grvm.csv, by file name.

    Times have four decimals, and some times occur twice.
    """
    head = ["time", "X_value", "Y_value", "Z_value"]

    def table(part: Riding, values: np.ndarray) -> str:
        t_s = np.round(part.t_s + 0.0091, 4)
        t_s[7::50] = t_s[6::50][: len(t_s[7::50])]
        rows = [(f"{t:.4f}", *[f"{value:.5f}" for value in row]) for t, row in zip(t_s, values)]
        return lines(head, rows, ";" if semicolon else ",", comma=semicolon)

    return {
        "Ride_accm.csv": table(ride, G * ride.phone_g),
        "Ride_gyrm.csv": table(ride.every(2, 1), ride.every(2, 1).phone_rad),
        "Ride_lacm.csv": table(ride, G * (ride.phone_g - ride.gravity_g)),
        "Ride_grvm.csv": table(ride, G * ride.gravity_g),
    }


def racechrono(ride: Riding, sign: float = 1.0, version: int = 3) -> str:
    """Write version 3 or 2 of the app's CSV.

    Version 3 has three header lines and repeats some names. Version 2 has one header line, with units in brackets.
    """
    force, rates = sign * ride.phone_g, np.degrees(ride.phone_rad)
    empty = [""] * len(ride.t_s)
    speed = [f"{value:.2f}" for value in ride.speed_mps]
    columns: list[tuple[str, str, str, Sequence[str]]] = [
        ("timestamp", "unix time", "", [f"{START_UTC_S + t:.3f}" for t in ride.t_s]),
        ("fragment_id", "", "", ["0"] * len(empty)),
        ("lap_number", "", "", empty),
        ("elapsed_time", "s", "", [f"{t:.3f}" for t in ride.t_s]),
        ("latitude", "deg", "100: gps", [f"{value:.7f}" for value in ride.lat_deg]),
        ("longitude", "deg", "100: gps", [f"{value:.7f}" for value in ride.lon_deg]),
        ("speed", "m/s", "100: gps", speed),
        ("lateral_acc", "G", "calc", empty),
        ("lean_angle", "deg", "calc", empty),
        ("speed", "m/s", "calc", speed),
        *[(f"{axis}_acc", "G", "101: acc", [f"{v:.5f}" for v in column]) for axis, column in zip("xyz", force.T)],
        *[
            (f"{axis}_rate_of_rotation", "deg/s", "102: gyro", [f"{v:.4f}" for v in column])
            for axis, column in zip("xyz", rates.T)
        ],
    ]
    head = ["This file is created using RaceChrono Pro v9.1.3 ( http://racechrono.com/ ).", f"Format,{version}"]
    head += ['Session title,"Ride"', "Session type,Lap timing", 'Track name,"Home"', "Driver name,", "Note,", ""]
    if version == 3:
        head += [",".join(cells) for cells in zip(*[column[:3] for column in columns])]
    else:
        head += [",".join(f"{column[0]} ({column[1]})" if column[1] else column[0] for column in columns)]
        head[-1] = head[-1].replace("timestamp (unix time)", "Timestamp (s)")
    rows = [",".join(row) for row in zip(*[column[3] for column in columns])]
    return "\n".join([*head, *rows]) + "\n"


def racebox(ride: Riding, per_mps: float = 3.6, laps: bool = False) -> str:
    """Write a CSV whose axes are x forward, y left, z up.

    The header has no unit for Speed. per_mps: the number in the column Speed for 1 m/s.
    """
    names = "Record,Time,Latitude,Longitude,Altitude,Speed,GForceX,GForceY,GForceZ,Lap,GyroX,GyroY,GyroZ".split(",")
    rows = []
    for k, (left, up, forward) in enumerate(ride.force_g.tolist()):
        about_left, about_up, about_forward = ride.rates_dps[k].tolist()
        t_s = ride.t_s[k] + 0.25
        rows.append(
            [str(k + 1), f"2024-05-17T09:30:{t_s:06.3f}Z", f"{ride.lat_deg[k]:.7f}", f"{ride.lon_deg[k]:.7f}", "34.5"]
            + [f"{per_mps * ride.speed_mps[k]:.2f}", f"{forward:.3f}", f"{left:.3f}", f"{up:.3f}", "0"]
            + [f"{about_forward:.2f}", f"{about_left:.2f}", f"{about_up:.2f}"]
        )
    head = "Format,RaceBox CSV\nTrack,Home\nLap 1, 33.821, sectors, 9.01,6.759,9.764,0,8.288\n\n" if laps else ""
    return head + lines(names, rows)


def vbo(ride: Riding, speed: str = "kmh") -> str:
    """Write a file with sections.

    Positions are in minutes, and longitudes in the west are positive. The channels of the IMU04 have that unit's own
    signs.
    """
    per_mps = {"kmh": 3.6, "knots": 3600.0 / 1852.0}[speed]
    names = ["sats", "time", "lat", "long", "velocity", "heading", "height"]
    units = ["g", "g", "g", "deg/s", "deg/s", "deg/s"]
    titles = ["satellites", "time", "latitude", "longitude", f"velocity {speed}", "heading", "height"]
    extra = ["X_Accel", "Y_Accel", "Z_Accel", "YawRate", "PitchRate", "RollRate"]
    rows = []
    for k, t in enumerate(ride.t_s.tolist()):
        left, up, forward = ride.force_g[k].tolist()
        about_left, about_up, about_forward = ride.rates_dps[k].tolist()
        second = t + 0.25
        row = f"011 0930{second:05.2f} {60.0 * ride.lat_deg[k]:+012.5f} {-60.0 * ride.lon_deg[k]:+012.5f} "
        row += f"{per_mps * ride.speed_mps[k]:07.3f} 000.00 +00034.50"
        measured = (forward, left, up, -about_up, -about_left, about_forward)
        row += "".join(f" {value:+.6E}" for value in measured)
        rows.append(row)
    head = ["File created on 17/05/2024 at 09:31:00", "", "[header]", *titles, *extra, "", "[channel units]", *units]
    head += ["", "[comments]", "(c) nobody", "", "[column names]", " ".join(names + extra), "", "[data]"]
    return "\r\n".join([*head, *rows]) + "\r\n"


def aim(ride: Riding, quoted: bool = True, up_sign: float = -1.0) -> str:
    """Write a CSV whose axes are forward, right, down.

    quoted: True to put every cell in quotation marks. False to write the cells as a spreadsheet saves them.
    """
    names = ["Time", "GPS Speed", "GPS Nsat", "GPS Latitude", "GPS Longitude", "InlineAcc", "LateralAcc", "VerticalAcc"]
    names += ["RollRate", "PitchRate", "YawRate", "GPS InlineAcc"]
    units = ["s", "km/h", "#", "deg", "deg", "g", "g", "g", "deg/s", "deg/s", "deg/s", "g"]
    table = [["Format", "AiM CSV File"], ["Session", "Home"], ["Vehicle", "Bike"], ["Date", "Friday, May 17, 2024"]]
    table += [["Time", "9:30 AM"], ["Sample Rate", "50"], ["Beacon Markers", "12.5", "25.0"], [], names, units, []]
    for k, t in enumerate(ride.t_s.tolist()):
        left, up, forward = ride.force_g[k].tolist()
        about_left, about_up, about_forward = ride.rates_dps[k].tolist()
        row = [f"{t:.3f}", f"{3.6 * ride.speed_mps[k]:.4f}", "11", f"{ride.lat_deg[k]:.8f}", f"{ride.lon_deg[k]:.8f}"]
        row += [f"{value:.3f}" for value in (forward, -left, up_sign * up, about_forward, -about_left, -about_up, 0.0)]
        table.append(row)
    if quoted:
        return "\r\n".join(",".join(f'"{cell}"' for cell in row) for row in table) + "\r\n"
    return "\n".join(",".join(row + [""] * (len(names) - len(row))) for row in table) + "\n"


_AXES = [f"{sensor}_{axis}" for sensor in ("Acc", "Gyro") for axis in "XYZ"]
# The columns of any_table()
ANY_NAMES: dict[str, str] = dict(
    zip(("t", "ax", "ay", "az", "gx", "gy", "gz", "speed"), ("Millis", *_AXES, "Speed_kmh"))
)


def any_table(ride: Riding, separator: str = ",", comma: bool = False) -> str:
    """Write the table of an unknown logger, in ms, m/s2, rad/s and km/h."""
    names = ["Millis", "Acc_X", "Acc_Y", "Acc_Z", "Gyro_X", "Gyro_Y", "Gyro_Z", "Speed_kmh", "Note"]
    rows = []
    for k, t in enumerate(ride.t_s.tolist()):
        row = [str(round(1000 * t)), *[f"{G * value:.5f}" for value in ride.phone_g[k]]]
        row += [f"{value:.6f}" for value in ride.phone_rad[k]]
        rows.append([*row, f"{3.6 * ride.speed_mps[k]:.3f}" if k % 100 == 0 else "", ""])
    return lines(names, rows, separator, comma)
