"""Random tables of six columns as found in practice: names, order, units, separators, times, signs and motion vary."""

from dataclasses import dataclass

import numpy as np

from support.recordings.app_exports import riding

GRAVITY = 9.80665
ACCEL_UNITS = {"g": 1.0, "m/s2": GRAVITY, "mg": 1000.0}
GYRO_UNITS = {"deg/s": 1.0, "rad/s": np.pi / 180.0, "mdeg/s": 1000.0}
COUNTS = ((16384.0, 131.0), (8192.0, 65.5), (4096.0, 32.8), (2048.0, 16.4))
# {} stands for the axis. The last two names of each list state the unit.
NAMES = (
    ("ax ay az", "gx gy gz"),
    ("AccX AccY AccZ", "GyroX GyroY GyroZ"),
    ("acc_x acc_y acc_z", "gyr_x gyr_y gyr_z"),
    ("AcX AcY AcZ", "GyX GyY GyZ"),
    ("Accel X Accel Y Accel Z", "Gyro X|Gyro Y|Gyro Z"),
    ("accelerometer.x accelerometer.y accelerometer.z", "gyroscope.x gyroscope.y gyroscope.z"),
    ("X-Acceleration Y-Acceleration Z-Acceleration", "X-Rotation Y-Rotation Z-Rotation"),
    ("a_x a_y a_z", "w_x w_y w_z"),
    ("imu_accel_x imu_accel_y imu_accel_z", "imu_gyro_x imu_gyro_y imu_gyro_z"),
    ("accX accY accZ", "omegaX omegaY omegaZ"),
    ("LinearAccel_x LinearAccel_y LinearAccel_z", "AngularVelocity_x AngularVelocity_y AngularVelocity_z"),
)
TIMES = {
    "s": (1.0, "time t Time seconds elapsed secs"),
    "ms": (1e3, "ms millis time_ms Timestamp t elapsed_ms"),
    "us": (1e6, "us micros timestamp t"),
}
CLOCKS = {"s": 0.25, "ms": 0.3, "us": 0.15, "epoch s": 0.08, "epoch ms": 0.12, "clock": 0.05, "date": 0.05}
BOOT = ("MPU6050 connected", "# my logger, v2", "// started", "", "Offsets: -1200, 33, 4", "% {'a': 1, 'b': 2, 'c': 3}")
SHAPES = {"table": 0.7, "labels": 0.1, "events": 0.1, "two sensors": 0.1}
Cells = list[list[str]]
EPOCH_S = 1_715_938_200.25


@dataclass
class DrawnTable:
    """A random table with the motion that it was made from.

    text: content of the file.
    time_s: shape (n).
    force_g: true specific force, shape (n, 3).
    rates_dps: true rates, shape (n, 3).
    kind: the kind of motion.
    """

    text: str
    time_s: np.ndarray
    force_g: np.ndarray
    rates_dps: np.ndarray
    kind: str
    said: str


def draw(seed: int) -> DrawnTable:
    """Return a random table. The same seed gives the same table."""
    random = np.random.default_rng(seed)
    kind = str(random.choice(["ride", "hand", "hand", "rest", "shaken"]))
    hz = float(random.choice([25.0, 50.0, 100.0, 200.0]))
    time_s, force, rates = motion(kind, hz, random)
    if random.random() < 0.25:
        force = -force
    raw = random.random() < 0.35
    if raw:
        of_accel, of_gyro = COUNTS[random.integers(4)]
        accel_unit = gyro_unit = "counts"
        limit = 32767
        accel = np.clip(np.rint(force * of_accel), -limit, limit)
        gyro = np.clip(np.rint(rates * of_gyro), -limit, limit)
        force, rates = accel / of_accel, gyro / of_gyro
        cells = [[f"{value:.0f}" for value in row] for row in np.hstack((accel, gyro))]
    else:
        accel_unit = str(random.choice(list(ACCEL_UNITS)))
        gyro_unit = str(random.choice(list(GYRO_UNITS), p=(0.5, 0.4, 0.1)))
        digits = int(random.integers(2, 5)), int(random.integers(2, 5))
        places = [max(0, digits[0] + (2 if accel_unit == "g" else 0) - (3 if accel_unit == "mg" else 0))]
        places += [max(0, digits[1] + (2 if gyro_unit == "rad/s" else 0) - (3 if gyro_unit == "mdeg/s" else 0))]
        accel, gyro = force * ACCEL_UNITS[accel_unit], rates * GYRO_UNITS[gyro_unit]
        cells = [
            [f"{value:.{places[0]}f}" for value in a] + [f"{value:.{places[1]}f}" for value in g]
            for a, g in zip(accel, gyro)
        ]
    clock, time_cells = _clock(time_s, random)
    label = f"{kind} {accel_unit} {gyro_unit} {hz:g} Hz {clock}"
    shape = str(random.choice(list(SHAPES), p=list(SHAPES.values())))
    if shape == "table":
        names = _names(random, accel_unit, gyro_unit)
        text = _table(random, names, clock, time_cells, cells)
        label += "" if names else " no header"
    else:
        text = {"labels": _labels, "events": _events, "two sensors": _two_sensors}[shape](
            random, clock, time_cells, cells
        )
    return DrawnTable(text, time_s, force, rates, kind, f"{label} {shape}")


def motion(kind: str, hz: float, random: np.random.Generator) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    if kind == "ride":
        ride = riding().every(round(200.0 / hz))
        return ride.t_s, ride.phone_g + 0.01 * random.standard_normal((len(ride.t_s), 3)), np.degrees(ride.phone_rad)
    n = round(float(random.uniform(6.0, 25.0)) * hz)
    time_s = np.arange(n) / hz
    rates = np.zeros((n, 3))
    if kind != "rest":
        for axis in range(3):
            for _ in range(3):
                size, speed, phase = random.uniform(5.0, 60.0), random.uniform(0.1, 0.6), random.uniform(0.0, 6.28)
                rates[:, axis] += size * np.sin(2.0 * np.pi * speed * time_s + phase)
    up = random.standard_normal(3)
    up /= np.linalg.norm(up)
    force = np.empty((n, 3))
    for k in range(n):
        force[k] = up
        w = np.radians(rates[k]) / hz
        angle = np.linalg.norm(w)
        if angle > 0.0:  # in the sensor's axes, gravity turns in the opposite direction
            axis = -w / angle
            up = up * np.cos(angle) + np.cross(axis, up) * np.sin(angle) + axis * (axis @ up) * (1.0 - np.cos(angle))
    noise = 0.2 if kind == "shaken" else 0.004
    force += noise * random.standard_normal((n, 3))
    rates += random.uniform(-3.0, 3.0, 3) + 0.08 * random.standard_normal((n, 3))
    return time_s, force, rates


def _names(random: np.random.Generator, accel_unit: str, gyro_unit: str) -> list[str] | None:
    if random.random() < 0.12:
        return None
    accel, gyro = NAMES[random.integers(len(NAMES) - 1)]
    names = [*(accel.split() if "Accel X" not in accel else ["Accel X", "Accel Y", "Accel Z"])]
    names += gyro.split("|") if "|" in gyro else gyro.split()
    if random.random() < 0.3:
        form = str(random.choice([" ({})", " [{}]"]))
        names = [name + form.format(accel_unit if k < 3 else gyro_unit) for k, name in enumerate(names)]
    return names


def _clock(time_s: np.ndarray, random: np.random.Generator) -> tuple[str, list[str]]:
    form = str(
        random.choice(
            ["s", "ms", "us", "epoch s", "epoch ms", "clock", "date"], p=(0.25, 0.3, 0.15, 0.08, 0.12, 0.05, 0.05)
        )
    )
    if form in TIMES:
        size, names = TIMES[form]
        begin = random.uniform(0.0, 1000.0) if random.random() < 0.5 else 0.0
        digits = 3 if form == "s" else 0
        return str(random.choice(names.split())), [f"{(begin + t) * size:.{digits}f}" for t in time_s]
    if form == "epoch s":
        return "timestamp", [f"{EPOCH_S + t:.3f}" for t in time_s]
    if form == "epoch ms":
        return "time", [f"{1000.0 * (EPOCH_S + t):.0f}" for t in time_s]
    if form == "clock":
        return "time", [f"12:{30 + int(t // 60):02d}:{t % 60:06.3f}" for t in time_s]
    return "datetime", [f"2024-05-17T09:{30 + int(t // 60):02d}:{t % 60:06.3f}Z" for t in time_s]


def _table(random: np.random.Generator, names: list[str] | None, clock: str, time: list[str], cells: Cells) -> str:
    separator = str(random.choice([",", ";", "\t", " "], p=(0.5, 0.2, 0.15, 0.15)))
    comma = separator != "," and random.random() < 0.4
    order = [3, 4, 5, 0, 1, 2] if names and random.random() < 0.25 else list(range(6))
    extra = random.random() < 0.4 if names else False
    rows = []
    for k, row in enumerate(cells):
        line = [time[k], *[row[j] for j in order]]
        rows.append([*line[:4], f"{24.0 + 0.001 * k:.2f}", *line[4:]] if extra else line)
    lines = [str(random.choice(BOOT)) for _ in range(random.integers(1, 6))] if random.random() < 0.25 else []
    if names is not None:
        head = [clock, *[names[j] for j in order]]
        head = [*head[:4], "temp", *head[4:]] if extra else head
        lines.append(separator.join(name.replace(" ", "_") if separator == " " else name for name in head))
    end = separator if separator in ",;" and random.random() < 0.15 else ""
    for row in rows:
        lines.append(separator.join(cell.replace(".", ",") if comma else cell for cell in row) + end)
    return "\n".join(lines) + "\n"


def _labels(random: np.random.Generator, clock: str, time: list[str], cells: Cells) -> str:
    """Write lines with labelled values, as an Arduino sketch prints them to a serial monitor."""
    stamped = ":" in time[0]
    names = [name for axes in NAMES[random.integers(3)] for name in axes.split()]
    mark, between = str(random.choice([": ", ":", " = "])), str(random.choice(["\t", ", ", " "]))
    lines = []
    for time_s, row in zip(time, cells):
        pairs = between.join(name + mark + cell for name, cell in zip(names, row))
        stamp = time_s.partition("T")[2].rstrip("Z") or time_s
        lines.append(f"{stamp} -> {pairs}" if stamped else f"{clock}{mark}{time_s}{between}{pairs}")
    return "\n".join(lines) + "\n"


def _events(random: np.random.Generator, clock: str, time: list[str], cells: Cells) -> str:
    """Write one row per event. Rows of the inertial unit have all six values."""
    lines = [f"{clock},sensor,v1,v2,v3,v4,v5,v6"]
    for k, (stamp, row) in enumerate(zip(time, cells)):
        lines.append(",".join((stamp, "IMU", *row)))
        if k % 5 == 0:
            lines.append(f"{stamp},{random.choice(['MAG', 'BARO'])},{1.0 + 0.01 * k:.2f},2.5,3.5,,,")
    return "\n".join(lines) + "\n"


def _two_sensors(random: np.random.Generator, clock: str, time: list[str], cells: Cells) -> str:
    """Write one row per event, alternately from accelerometer and gyro."""
    names = [("accelerometer", "gyroscope"), ("ACC", "GYR"), ("acc", "gyro")][random.integers(3)]
    lines = [f"{clock},type,x,y,z"]
    for stamp, row in zip(time, cells):
        lines += [",".join((stamp, names[0], *row[:3])), ",".join((stamp, names[1], *row[3:]))]
    return "\n".join(lines) + "\n"
