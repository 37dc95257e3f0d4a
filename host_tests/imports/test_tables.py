"""A known motion, written as a table in any units, order of columns, clock and format, comes back."""

import functools
import json
import zipfile

import numpy as np
import pytest
from hypothesis import assume, given, settings, strategies as st
from kickstand_tools import api
from support.recordings import drawn_tables

G, RAD = 9.80665, 180.0 / np.pi
START_UTC_S = 1_715_938_200.25
ACCEL = {"g": 1.0, "m/s2": G, "mg": 1000.0, "counts/16384": 16384.0, "counts/2048": 2048.0}
RATES = {"deg/s": 1.0, "rad/s": 1.0 / RAD, "mdeg/s": 1000.0, "mrad/s": 1000.0 / RAD, "counts/16.4": 16.4}
SIGNS = {"": [1.0, 1.0, 1.0], "-": [-1.0, -1.0, -1.0], "z": [1.0, 1.0, -1.0]}
CLOCKS = {  # a function of the seconds, and the unit
    "s": (lambda t: f"{t:.3f}", "s"),
    "ms": (lambda t: f"{1e3 * t:.0f}", "ms"),
    "us": (lambda t: f"{1e6 * t:.0f}", "us"),
    "ns": (lambda t: f"{1e9 * t:.0f}", "ns"),
    "micros that overflow": (lambda t: f"{(4_290_000_000 + round(1e6 * t)) % 2**32}", "us"),
    "s since 1970": (lambda t: f"{START_UTC_S + t:.3f}", "s"),
    "ms since 1970": (lambda t: f"{1e3 * (START_UTC_S + t):.0f}", "ms"),
    "ns since 1970": (lambda t: f"{round(1e3 * (START_UTC_S + t))}000000", "ns"),
    "UTC": (lambda t: f"2024-05-17T09:30:{t + 0.25:06.3f}Z", ""),
    "a zone": (lambda t: f"2024-05-17 11:30:{t + 0.25:06.3f} +0200", ""),
    "day with slashes": (lambda t: f"2024/5/17 09:30:{t + 0.25:06.3f}", ""),
    "day and month's name": (lambda t: f"17-May-2024 09:30:{t + 0.25:06.3f}", ""),
    "day first, points": (lambda t: f"17.05.2024 09.30.{t + 0.25:06.3f}", ""),
    "compact": (lambda t: f"20240517T0930{t + 0.25:06.3f}", ""),
    "days since 1900": (lambda t: f"{25_569 + (START_UTC_S + t) / 86_400:.10f}", "d"),
    "only digits": (lambda t: f"202405170930{round(1e3 * t + 250):05d}", ""),
    "month first, 12 hours": (lambda t: f"05/17/2024 09:30:{t + 0.25:06.3f} AM", ""),
    "100 ns since 1601": (lambda t: f"{round(1e3 * (START_UTC_S + t + 11_644_473_600))}0000", "ticks"),
    "100 ns since the year 1": (lambda t: f"{round(1e3 * (START_UTC_S + t + 62_135_596_800))}0000", "ticks"),
    "a clock at midnight": (lambda t: f"{'23:59' if t < 5 else '00:00'}:{(t + 55.0) % 60:06.3f}", ""),
    "a clock of 12 hours at noon": (
        lambda t: f"{'11:59' if t < 5 else '12:00'}:{(t + 55.0) % 60:06.3f} {'ap'[t >= 5]}m",
        "",
    ),
    "colons before ms": (lambda t: f"09:30:{t:06.3f}".replace(".", ":"), ""),
    "minutes and seconds": (lambda t: f"12:{t:06.3f}", ""),
    "min": (lambda t: f"{t / 60.0:.6f}", "min"),
    "h": (lambda t: f"{t / 3600.0:.8f}", "h"),
    "0.1 ms": (lambda t: f"{1e4 * t:.0f}", "0.1ms"),
    "us since 1601": (lambda t: f"{13_359_034_395_000_000 + 1e6 * t:.0f}", "us"),
    "millis in 16 bits": (lambda t: f"{(60_000 + round(1e3 * t)) % 2**16}", "ms"),
    "a clock of 12 hours alone": (lambda t: f"{'12:59' if t < 5 else '1:00'}:{(t + 55.0) % 60:06.3f}", ""),
    "noon in Japanese": (lambda t: f"{'午前11:59' if t < 5 else '午後12:00'}:{(t + 55.0) % 60:06.3f}", ""),
    "digits of a clock": (lambda t: f"{115_955 + t + 4040.0 * (t >= 5):.3f}", ""),
}
DATED = list(CLOCKS)[5:19]


def grouped(value, group, mark):
    """Return a number with separators of thousands and a decimal mark."""
    integer, _, part = value.lstrip("-").partition(".")
    text = f"{int(integer):,}".replace(",", group) + (mark + part if part else "")
    return "-" + text if value.startswith("-") else text


def plain(value):
    return value


def comma(value):
    return value.replace(".", ",")


DRESSES = {  # separator, function of a number, function of any cell, encoding, end of line
    "commas": (",", plain, plain, "utf-8", "\n"),
    "semicolons": (";", plain, plain, "utf-8", "\r\n"),
    "semicolons and decimal commas": (";", comma, comma, "utf-8", "\n"),
    "tabs and decimal commas": ("\t", comma, comma, "utf-8", "\n"),
    "quoted decimal commas": (",", plain, lambda value: f'"{comma(value)}"', "utf-8", "\n"),
    "minus of a spreadsheet": (";", lambda value: value.replace("-", "\u2212"), plain, "utf-8", "\n"),
    "a blank after the minus": (",", lambda value: value.replace("-", "- "), plain, "utf-8", "\n"),
    "negative in brackets": (",", lambda value: f"({value[1:]})" if value[0] == "-" else value, plain, "utf-8", "\n"),
    "bars": (" | ", plain, plain, "utf-8", "\n"),
    "an en dash as minus": (",", lambda value: value.replace("-", "\u2013"), plain, "utf-16", "\n"),
    "points for thousands": (";", lambda value: grouped(value, ".", ","), plain, "utf-8", "\n"),
    "commas for thousands": ("\t", lambda value: grouped(value, ",", "."), plain, "utf-8", "\n"),
    "byte order mark": (",", plain, plain, "utf-8-sig", "\n"),
    "UTF-16": (";", comma, comma, "utf-16", "\r\n"),
    "UTF-16 without its mark": (",", plain, plain, "utf-16-le", "\n"),
    "carriage returns": (",", plain, plain, "utf-8", "\r"),
}


@functools.cache
def hand(hz=50.0):
    """Return the times, forces and rates of a sensor that is turned in a hand."""
    return drawn_tables.motion("hand", hz, np.random.default_rng(5))


@settings(max_examples=25)
@given(
    clock=st.sampled_from(list(CLOCKS)),
    accel=st.sampled_from(list(ACCEL)),
    rates=st.sampled_from(list(RATES)),
    signs=st.tuples(st.sampled_from(list(SIGNS)), st.sampled_from(list(SIGNS))),
    order=st.permutations(range(7)),
    dress=st.sampled_from(list(DRESSES)),
    head=st.sampled_from(["", "Logger 3000\n\nMade,by nobody\n"]),
    numbers=st.booleans(),
)
def test_a_motion_in_any_table_comes_back(tmp_path_factory, clock, accel, rates, signs, order, dress, head, numbers):
    """The columns are named by the user, or by their numbers."""
    t_s, force_g, rates_dps = hand()
    text_of, clock_unit = CLOCKS[clock]
    separator, number, cell, encoding, end = DRESSES[dress]
    digits = {"g": 5, "m/s2": 4, "mg": 1, "rad/s": 5, "deg/s": 3}
    assume("thousands" not in dress or {accel, rates} <= set(digits))  # 1.234 alone may be 1234
    assume(clock != "day first, points" or number is plain)  # 30.250 among decimal commas may be 30250
    cells = [[text_of(t) for t in t_s.tolist()]]
    for values, sign, factor, unit in (
        (force_g, signs[0], ACCEL[accel], accel),
        (rates_dps, signs[1], RATES[rates], rates),
    ):
        table = values * SIGNS[sign] * factor
        cells += [[number(f"{value:.{digits.get(unit, 0)}f}") for value in column] for column in table.T.tolist()]
    names = ["t", "a1", "a2", "a3", "r1", "r2", "r3"]
    lines = [[names[k] for k in order], *zip(*[cells[k] for k in order])]
    text = "\n".join(separator.join(map(cell, line)) for line in lines)
    path = tmp_path_factory.mktemp("table") / "log.csv"
    path.write_bytes((head + text + "\n").replace("\n", end).encode(encoding))
    keys = ("t", "ax", "ay", "az", "gx", "gy", "gz")
    columns = {key: f"#{order.index(k) + 1}" if numbers else names[k] for k, key in enumerate(keys)}
    units = {"t": clock_unit} if clock_unit else {}
    for key, unit, sign in (("a", accel, signs[0]), ("g", rates, signs[1])):
        units |= {key: ("-" if sign == "-" else "") + unit} | ({f"{key}z": f"-{unit}"} if sign == "z" else {})
    imported = api.import_recording(path, columns, units)
    log = imported.log
    assert log.t_s == pytest.approx(t_s, abs=0.002)
    assert log.accel_g == pytest.approx(force_g, abs=0.6 * max(1e-3, 1.0 / 2048.0))
    assert log.gyro_dps == pytest.approx(rates_dps, abs=0.05)
    words = {"": "as it is", "-": "turned", "z": "turned in part"}
    assert [origin.sign for origin in imported.taken] == ["", words[signs[0]], words[signs[1]]]
    assert bool(np.isfinite(log.utc_s).any()) is (clock in DATED)
    assert clock not in DATED or np.nanmin(log.utc_s) == pytest.approx(START_UTC_S, abs=0.01)


def text_of(form, times=1.0, force=1.0, rates=1.0, head=""):
    """Return the text of a table with one row per sample.

    form: format string for seven numbers.
    times, force, rates: factors on the values.
    head: first line of the table, or "".
    """
    t, f, w = hand()
    rows = [form.format(*row) for row in np.column_stack((times * t, force * f, rates * w)).tolist()]
    return "\n".join([head, *rows] if head else rows) + "\n"


HEAD = "t,ax,ay,az,gx,gy,gz"
ROW = ",".join(["{:.3f}"] + ["{:.4f}"] * 6)
FIELDS = "{0:.3f},{1:.4f},{2:.4f},{3:.4f},{4:.4f},{5:.4f},{6:.4f}"
COUNT_ROW = ",".join(["{:.0f}"] * 7)


def axes(*stems):
    return ",".join(stem + axis for stem in stems for axis in "xyz")


JSON_ROWS = text_of('{{"t": {:.3f}, "ax": {:.4f}, "ay": {:.4f}, "az": {:.4f}, "gx": {}, "gy": {}, "gz": {}}}')
READ = {
    "labels over several lines": text_of(
        "t: {:.3f}\nAcceleration X: {:.3f}, Y: {:.3f}, Z: {:.3f} m/s^2\n"
        "Rotation X: {:.4f}, Y: {:.4f}, Z: {:.4f} rad/s\n", 1.0, G, 1.0 / RAD,
    ),
    "labels behind time stamps": text_of("12:30:{:06.3f} -> a/g:" + "\t{:.0f}" * 6, 1.0, 16384.0, 131.0),
    "time stamps of a monitor": text_of("12:30:{:06.3f} -> " + ",".join(["{:.4f}"] * 6), 1.0, 1.0, 1.0),
    "JSON per line": JSON_ROWS,
    "numbers of sensors": text_of(
        "{0:.0f},1,{1:.4f},{2:.4f},{3:.4f}\n{0:.0f},4,{4:.5f},{5:.5f},{6:.5f}", 1e9, G, 1.0 / RAD, "ts,sensor,x,y,z"
    ),
    "names of sensors": text_of(
        "{0:.3f},acc,{1:.4f},{2:.4f},{3:.4f}\n{0:.3f},gyro,{4:.4f},{5:.4f},{6:.4f}", head="time,type,x,y,z"
    ),
    "counts of unlike ranges": text_of(COUNT_ROW, 1000.0, 16384.0, 16.4, "ms,AcX,AcY,AcZ,GyX,GyY,GyZ"),
    "thousandths": text_of(COUNT_ROW, 1e6, 1000.0, 1000.0 / RAD, "time_us,xacc,yacc,zacc,xgyro,ygyro,zgyro"),
    "a line of units": text_of(ROW, head=HEAD + "\ns,g,g,g,dps,dps,dps"),
    "units in brackets": text_of(ROW, 1e3, G, 1.0, HEAD.replace("t,", "t [ms],").replace("ax", "ax (m/s^2)")),
    "numbered names": text_of(ROW, head="time,data1,data2,data3,data4,data5,data6"),
    "no names": text_of(ROW),
    "blanks": text_of(ROW.replace(",", "  "), head=HEAD.replace(",", " ")),
    "other words": text_of(ROW.replace(",", ";"), 1.0, G, 1.0, "Zeit;Beschl_X;Beschl_Y;Beschl_Z;Dreh_X;Dreh_Y;Dreh_Z"),
    "scales above the rows": text_of(
        COUNT_ROW, 1e6, 2049.0, RAD / 4.0, "GYROFLOW IMU LOG\nversion,1.3\ntscale,0.000001\nascale,0.000488043\n"
        f"gscale,{4.0 / RAD / RAD:.8f}\n{HEAD}",
    ),
    "a rate above the rows": text_of(
        ROW, 1e4, G, 1.0 / RAD, "// Update rate: 50.0Hz\nTimeFine," + axes("Acc_", "Gyr_")
    ),
    "three lines of names": text_of(ROW, 1e3, G, 1.0, "\n".join(
        ("sep=,", HEAD, "X" + ",CAL" * 6, "ms" + ",m/(s^2)" * 3 + ",deg/s" * 3)
    )),
    "axes by words": text_of(
        ROW, head='"Format","MoTeC CSV File"\n\n"Time","G Force Long","G Force Lat","G Force Vert","Gyro Roll Rate",'
        '"Gyro Pitch Rate","Gyro Yaw Rate"\n"s","G","G","G","deg/s","deg/s","deg/s"\n',
    ),
    "axes of a web page": text_of(
        "{0:.0f},0.1,0.2,-0.1,{1:.4f},{2:.4f},{3:.4f},{6:.4f},{4:.4f},{5:.4f}", 1e3, G, 1.0, "timeStamp,"
        + axes("acceleration.", "accelerationIncludingGravity.") + ",rotation.alpha,rotation.beta,rotation.gamma",
    ),
    "two sensors": text_of(FIELDS + ",{3:.4f},{1:.4f},{2:.4f},{6:.4f},{4:.4f},{5:.4f}",
                           head="time," + axes("front_a", "front_g", "rear_a", "rear_g")),
    "the second gyro first": text_of("{0:.3f},{1:.4f},{2:.4f},{3:.4f},{6:.4f},{4:.4f},{5:.4f},{4:.4f},{5:.4f},{6:.4f}",
                                     head="time," + axes("front acc ", "rear gyro ", "front gyro ")),
    "axes in several rows": text_of(
        "{0:.3f},{1:.4f},{2:.4f},,,,\n{0:.3f},,,{3:.4f},,,\n{0:.3f},,,,{4:.4f},{5:.4f},{6:.4f}", head=HEAD,
    ),
    "gravity in columns of its own": text_of(
        FIELDS.replace("{1", "0,0,0,{1"), head="time," + axes("user.", "gravity.", "gyro.")
    ),
    "linear acceleration with gravity": text_of(
        ROW, 1.0, G, 1.0 / RAD, "time," + axes("linear_acceleration.", "angular_velocity."),
    ),
    "Chinese": text_of(
        ROW, head="时间(s),加速度X(g),加速度Y(g),加速度Z(g),角速度X(°/s),角速度Y(°/s),角速度Z(°/s)",
    ),
    "ids before the sensors": text_of("{0:.3f},3,{1:.4f},{2:.4f},{3:.4f},4,{4:.4f},{5:.4f},{6:.4f}"),
    "JSON, nested": text_of('{{"ts": {}, "acc": {{"x": {}, "y": {}, "z": {}}}, "gyro": [{}, {}, {}]}}'),
    "JSON, a list per column": json.dumps({"data": dict(zip(HEAD.split(","), np.column_stack(hand()).T.tolist()))}),
    "one row per axis": text_of(
        "\n".join(f"{{0:.3f}},{axis},{{{k}:.4f}}" for k, axis in enumerate(HEAD.split(",")) if k),
        head="time,field,value",
    ),
    "ArduPilot": "FMT, 129, 53, IMU, QffffffB, TimeUS,GyrX,GyrY,GyrZ,AccX,AccY,AccZ,I\n" + text_of(
        "IMU, {0:.0f}, {4:.5f}, {5:.5f}, {6:.5f}, {1:.4f}, {2:.4f}, {3:.4f}, 0\n"
        "IMU, {0:.0f}, {5:.5f}, {6:.5f}, {4:.5f}, {2:.4f}, {3:.4f}, {1:.4f}, 1", 1e6, G, 1.0 / RAD),
    "a second accelerometer": text_of(FIELDS.replace(",{4", ",{3:.4f},{1:.4f},{2:.4f},{4")),
    "sensors by their names": text_of(
        FIELDS.replace(",{1", ",{5:.4f},{6:.4f},{4:.4f},{1"),
        head="time,gx_seat,gy_seat,gz_seat,ax_fork,ay_fork,az_fork,gx_fork,gy_fork,gz_fork",
    ),
    "rare units": text_of(ROW, 1.0, 100.0 * G, 1.0 / 6.0,
                          "t (s),ax (cm/s^2),ay (cm/s^2),az (cm/s^2),gx (rpm),gy (rpm),gz (rpm)"),
    "JSON, an array": f"[{JSON_ROWS.strip().replace(chr(10), ',')}]",
    "other sensors": text_of(
        ROW + ",0.01,0.02,0.01,10,20,30", 1.0, G, 1.0 / RAD,
        "time,accX,accY,accZ,gyroX,gyroY,gyroZ,linX,linY,linZ,magX,magY,magZ",
    ),
}  # fmt: skip


def check_motion(imported):
    t, force, rates = hand()
    log = imported.log
    for values, truth, limit in ((log.accel_g, force, 0.02), (log.gyro_dps, rates, 0.6)):
        expected = np.column_stack([np.interp(log.t_s, t, column) for column in truth.T])
        assert np.mean(np.abs(values - expected) < limit) > 0.95
    assert len(log.t_s) == pytest.approx(len(t), abs=2)


@pytest.mark.parametrize("name", READ)
def test_a_table_is_read_without_a_question(tmp_path, name):
    (tmp_path / "log.csv").write_text(READ[name])
    check_motion(api.import_recording(tmp_path / "log.csv"))


def test_one_file_per_sensor_is_joined_by_time(tmp_path):
    t, force, rates = hand()
    for name, values in (("acc", G * force), ("gyro", rates / RAD)):
        rows = [",".join(f"{value:.5f}" for value in row) for row in np.column_stack((t, values)).tolist()]
        (tmp_path / f"{name}.csv").write_text("\n".join(["time,x,y,z", *rows]) + "\n")
    check_motion(api.import_recording(tmp_path))
    columns = {"t": "time"} | {f"{name[0]}{axis}": f"{name}:{axis}" for name in ("acc", "gyro") for axis in "xyz"}
    check_motion(api.import_recording(tmp_path, columns, {"t": "s", "a": "m/s2", "g": "rad/s"}))


@pytest.mark.parametrize("units", [{"a": "counts", "g": "counts"}, {"a": "counts/8192", "g": "LSB/32.8"}])
def test_the_range_of_raw_counts_is_found(tmp_path, units):
    (tmp_path / "log.csv").write_text(text_of(COUNT_ROW, 1000.0, 8192.0, 32.8, HEAD))
    columns = {name: name for name in HEAD.split(",")}
    check_motion(api.import_recording(tmp_path / "log.csv", columns, {"t": "ms", **units}))


def test_speed_and_positions_of_a_table(tmp_path):
    """Positions are in minutes, west positive. The speed's unit is in its name, or the positions show it."""
    t, force, rates = hand()
    east_m = 12.0 * t
    columns = np.column_stack(
        (t, force, rates, 43.2 + 0 * t, 60.0 * (48.0 + 0 * t), -60.0 * (11.0 + east_m / 74_406.0))
    )
    for name, units in (("speed_kmh", {}), ("v", {}), ("v", {"speed": "mph"})):
        head = HEAD + f",{name},latm,lonm"
        rows = [",".join(f"{value:.6f}" for value in row) for row in columns.tolist()]
        (tmp_path / "log.csv").write_text("\n".join([head, *rows]) + "\n")
        names = {key: key for key in HEAD.split(",")} | {"speed": name, "lat": "latm", "lon": "lonm"}
        given_units = {"a": "g", "g": "deg/s", "lat": "min", "lon": "-min"} | units
        log = api.import_recording(tmp_path / "log.csv", names, given_units).log
        assert np.nanmax(log.speed_mps) == pytest.approx(12.0 if not units else 43.2 * 0.44704, abs=1e-3)
        assert np.nanmin(log.lat_deg) == pytest.approx(48.0) and np.nanmin(log.lon_deg) == pytest.approx(11.0, abs=1e-6)


@pytest.mark.parametrize(
    "way", ["newest first", "the clock is set", "whole and fraction", "clock in parts", "wider rows", "no suffix"]
)
def test_rows_in_another_order_or_shape_are_read(tmp_path, way):
    t, force, rates = hand()
    head, *rows = text_of(ROW, head="t,ax_g,ay_g,az_g,gx_dps,gy_dps,gz_dps").strip().splitlines()
    cells = [row.partition(",")[2] for row in rows]
    path = tmp_path / "log.csv"
    if way == "newest first":
        rows.reverse()
    if way == "the clock is set":
        days = ["2000-01-01" if k < 400 else "2024-05-17" for k in range(len(t))]
        seconds = t - np.where(t < t[400], 0.0, t[400])  # one gap of 1 s
        rows = [f"{day} 09:30:{s:06.3f},{row}" for day, s, row in zip(days, seconds, cells)]
    if way == "whole and fraction":
        head = head.replace("t,", "secs,nsecs,")
        rows = [f"{1_714_557_600 + int(s)},{round(s % 1 * 1e3)}000000,{row}" for s, row in zip(t.tolist(), cells)]
    if way == "clock in parts":
        head = head.replace("t,", "hour,min,sec,ms,")
        rows = [
            f"11,{59 - 59 * (s >= 9)},{(51 + s) // 1 % 60:.0f},{round(s % 1 * 1e3)},{row}"
            for s, row in zip(t.tolist(), cells)
        ]
        rows = [row.replace("11,0,", "12,0,", 1) for row in rows]
    if way == "wider rows":
        rows[5::80] = [f"{t[k]},48.1,11.5,1,{cells[k]}" for k in range(5, len(t), 80)]
    if way == "no suffix":
        path = tmp_path / "log.zip"
        with zipfile.ZipFile(path, "w") as archive:
            archive.writestr("log", "\n".join([head, *rows]))
    else:
        path.write_text("\n".join([head, *rows]) + "\n")
    log = api.import_recording(path).log
    if way == "the clock is set":
        assert np.diff(log.t_s)[399] == pytest.approx(1.0) and np.nanmin(log.utc_s) > 1.7e9
        log = api.Log(log.t_s - np.where(np.arange(len(t)) < 400, 0.0, 0.98), log.accel_g, log.gyro_dps)
    for values, truth, limit in ((log.accel_g, force, 0.02), (log.gyro_dps, rates, 0.6)):
        expected = np.column_stack([np.interp(log.t_s, t, column) for column in truth.T])
        assert np.mean(np.abs(values - expected) < limit) > 0.9
    assert log.t_s[-1] == pytest.approx(t[-1], abs=0.1)
