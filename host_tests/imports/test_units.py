"""Units and times by hand: spellings, factors, clocks and dates, the size of times without a unit, and rates and speeds
whose unit the motion shows."""

import numpy as np
import pytest
from kickstand_tools.common.messages import InputError
from kickstand_tools.imports import columns, findings, units
from kickstand_tools.imports.recording import Sheet
from kickstand_tools.imports.unit_fits import RateFit, fit_rates, unit_by_positions
from kickstand_tools.logs.csv_text import columns_of

MS, DAY_MS = 1_000_000, 86_400_000


@pytest.mark.parametrize(
    ("text", "name"),
    [("m/s^2", "m/s2"), ("M/S²", "m/s2"), ("m s-2", "m/s2"), ("m*s^-2", "m/s2"), ("°/s", "deg/s"), ("kph", "km/h"),
     ("KM/H", "km/h"), ("µs", "us"), ("μs", "us"), ("furlong", "furlong"), (" G ", "g"), ("kts", "knots")],
)  # fmt: skip
def test_units_have_many_spellings(text, name):
    assert units.unit(text) == name


@pytest.mark.parametrize(
    ("text", "kinds", "factor"),
    [
        ("km/h", units.SPEEDS, 1000.0 / 3600.0), ("-mph", units.SPEEDS, -1609.344 / 3600.0),
        ("kn", units.SPEEDS, 1852.0 / 3600.0), ("mg", units.ACCELERATIONS, 1e-3),
        ("m/s2", units.ACCELERATIONS, 1.0 / 9.80665), ("rad/s", units.RATES, 57.2957795),
        ("mrad/s", units.RATES, 0.0572957795), ("mdeg/s", units.RATES, 1e-3), ("min", units.ANGLES, 1.0 / 60.0),
        ("-counts/131", units.RATES, -1.0 / 131.0), ("LSB/16384", units.ACCELERATIONS, 1.0 / 16384.0),
        ("counts/131", units.SPEEDS, None), ("counts/0", units.RATES, None), ("x", units.RATES, None),
    ],
)  # fmt: skip
def test_factors_of_units(text, kinds, factor):
    if factor is None:
        with pytest.raises(InputError, match=f"where: unit '{text}' is not known: write one of"):
            units.factor(text, kinds, "where")
    else:
        assert units.factor(text, kinds, "where") == pytest.approx(factor)


def column(*texts):
    """Return the column that the reader makes of these cells."""
    return columns_of([[text] for text in texts], 1)[0]


@pytest.mark.parametrize(
    ("texts", "unit", "times_ms"),
    [
        (("1", "2", "3"), "ms", [1, 2, 3]),
        (("0.5", "1.25"), "s", [500, 1250]),
        (("-0.25", "1.25", "x", "1e300", "inf", ""), "s", [-250, 1250, None, None, None, None]),
        (("01:02:03.5", "59:58", "", "1:00:00"), "", [3_723_500, 3_598_000, None, 3_600_000]),
        (("23:59:59.5", "00:00:00.25"), "", [DAY_MS - 500, DAY_MS + 250]),
        (("1970-01-01T00:00:01Z", "1970/1/2 00:00:00", "1970-01-01 01:00:00 +01:00"), "", [1000, DAY_MS, 0]),
        (("1970-01-01T00:00:02:250", "1970-01-01T00:00:03,250", "2300-01-01T00:00:00"), "", [2250, 3250, None]),
        (("4294967286", "5", "20"), "ms", [2**32 - 10, 2**32 + 5, 2**32 + 20]),
    ],
)
def test_times_are_numbers_clocks_or_dates(texts, unit, times_ms):
    """A cell without a time is marked. Midnight adds a day. A clock of 32 bits continues."""
    times = units.times_ns(column(*texts), unit)
    assert times.tolist() == [units.NO_TIME if time is None else time * MS for time in times_ms]


def test_times_of_day_without_colons():
    times = units.of_day(np.array([235959.5, 0.25, 10203.0]))
    assert times.tolist() == [(DAY_MS - 500) * MS, (DAY_MS + 250) * MS, (DAY_MS + 3_723_000) * MS]
    with pytest.raises(InputError, match="the recording: 'x' is no time"):
        units.times_ns(column("x", "y", "01:02:03"))


@pytest.mark.parametrize(
    ("first", "step", "name"),
    [(0.0, 0.02, "s"), (0.0, 0.89, "s"), (0.0, 0.91, "ms"), (0.0, 599.0, "ms"), (0.0, 601.0, "us"), (0.0, 599e3, "us"),
     (0.0, 601e3, "ns"), (1.7e9, 0.01, "s"), (1.7e9, 99.0, "s"), (1.7e9, 101.0, "ms"), (1.7e12, 10.0, "ms"),
     (1.7e15, 10e3, "us"), (1.7e18, 1e7, "ns"), (0.9e8, 10.0, "ms"), (1.1e10, 10e3, "us")],
)  # fmt: skip
def test_the_unit_of_times_is_shown_by_size_and_step(first, step, name):
    assert units.time_unit(first + step * np.arange(50.0)) == name


@pytest.mark.parametrize(
    ("name", "unit"),
    [("acc (m/s^2)", "m/s2"), ("acc_mg", "mg"), ("millis", "ms"), ("micros", "us"), ("timeNano", "ns"), ("t_ms", "ms"),
     ("seconds", "s"), ("s", "s"), ("acc", ""), ("x (left)", ""), ("gyro_counts/131", "counts/131")],
)  # fmt: skip
def test_a_unit_is_stated_in_a_name(name, unit):
    assert columns.stated_unit(name) == unit


def still(length, count=200):
    return np.tile([0.0, 0.6, 0.8], (count, 1)) * length


@pytest.mark.parametrize(
    ("length", "stated", "unit", "certain"),
    [
        (1.0, "", "g", True), (1.74, "", "g", True), (1.8, "", "g", False), (1 / 1.31, "", "g", False),
        (9.8, "m/s2", "m/s2", True), (9.8, "g", "m/s2", False), (1000.0, "", "mg", True), (1.2, "g", "g", True),
        (8192.0, "", "counts/8192", True), (8192.0, "counts", "counts/8192", True),
    ],
)  # fmt: skip
def test_gravity_shows_the_unit_of_accelerations(length, stated, unit, certain):
    values = still(length) + (0.25 if length == 1000.0 else 0.0)
    values = np.rint(values) if length > 2000.0 else values
    values[50:] *= 1.0 + 0.5 * np.random.default_rng(1).uniform(-1.0, 1.0, (150, 1)) if length < 2.0 else 1.0
    finding = findings.accelerometer(values, np.arange(200) / 50.0, stated)
    assert (finding.unit, finding.certain) == (unit, certain)
    assert finding.why.startswith("gravity at rest is ")


@pytest.mark.parametrize(("accel", "gyro"), [(16384, 131), (8192, 65.5), (4096, 32.8), (2048, 16.4), (99, 131)])
def test_counts_of_a_gyro_follow_the_accelerometers_range(accel, gyro):
    finding = findings.gyro(still(1.0), np.full((200, 3), 30.0), findings.ColumnFinding([], f"counts/{accel}"), None)
    assert (finding.unit, finding.certain) == (f"counts/{gyro:g}", False)


def turning(dps=40.0, seconds=12.0, hz=100.0):
    """Return times, gravity and rates in rad/s of a sensor that turns about all axes: du/dt = u x w."""
    t_s = np.arange(0.0, seconds, 1.0 / hz)
    w = np.radians(dps) * np.column_stack((np.sin(t_s), 0.2 * np.cos(0.7 * t_s), np.sin(1.3 * t_s + 1.0)))
    u = np.zeros((len(t_s), 3))
    u[0] = [0.0, 1.0, 0.0]
    for k in range(len(t_s) - 1):
        middle = 0.5 * (w[k] + w[k + 1])
        u[k + 1] = u[k] + np.cross(u[k] + 0.5 / hz * np.cross(u[k], middle), middle) / hz
        u[k + 1] /= np.linalg.norm(u[k + 1])
    return t_s, u, w


def test_rates_that_turn_gravity_show_their_unit():
    """Also with a bias, with exchanged axes, and with missing readings."""
    t_s, u, w = turning()
    fit = fit_rates(t_s, u, np.degrees(w) + [1.0, -2.0, 0.5])
    assert np.degrees(fit.factor) == pytest.approx(1.0, abs=0.01) and fit.explained > 0.99 and fit.decides
    assert fit.turn == pytest.approx(np.sqrt(np.mean(np.sum((u[40:] - u[:-40]) ** 2, axis=1))), rel=0.1)
    rates = 9.81 * np.degrees(w)[:, [2, 0, 1]] * [1.0, -1.0, 1.0]
    rates[::3] = np.nan
    assert np.degrees(fit_rates(t_s, u, rates).factor) == pytest.approx(1.0 / 9.81, rel=0.01)
    assert fit_rates(t_s[:79], u[:79], w[:79]) == RateFit()


@pytest.mark.parametrize(
    ("shown", "mps", "more", "unit"),
    [
        (20.0, 20.0, {}, "m/s"), (72.0, 20.0, {}, "km/h"), (44.74, 20.0, {}, "mph"), (38.88, 20.0, {}, "knots"),
        (72.0, 20.0, {"east": False, "per_degree": (1 / 60, -1 / 60)}, "km/h"),
        (20.0, 20.0, {"columns": (None, 2)}, ""), (20.0, 20.0, {"columns": (1, None)}, ""),
        (3.1, 3.1, {}, "m/s"), (2.9, 2.9, {}, ""),  # below 3 m/s the errors of positions are too large
        (20.0, 20.0, {"rows": 21}, ""), (20.0, 20.0, {"rows": 22}, "m/s"),  # 20 steps of one second are needed
        (24.9, 20.0, {}, "m/s"), (29.0, 20.0, {}, ""), (0.0, 20.0, {}, ""),  # a factor below 1.25
        (20.0, 20.0, {"period_s": 1.9}, "m/s"), (20.0, 20.0, {"period_s": 2.1}, ""),
    ],
)  # fmt: skip
def test_positions_show_the_unit_of_a_speed(shown, mps, more, unit):
    """A straight course begins at the equator, where one degree is 111 194.9 m."""
    settings = {"rows": 40, "period_s": 0.5, "east": True, "per_degree": (1.0, 1.0), "columns": (1, 2)} | more
    t_s = settings["period_s"] * np.arange(settings["rows"])
    degrees = mps * t_s / 111_194.9
    lat, lon = (0.0 * degrees, degrees) if settings["east"] else (degrees, 0.0 * degrees)
    per_degree, (lat_column, lon_column) = settings["per_degree"], settings["columns"]
    cells = [np.full(len(t_s), shown), lat / per_degree[0], lon / per_degree[1]]
    sheet = Sheet("a.csv", ["speed", "lat", "lon"], cells)
    time_ns = (t_s * 1e9).astype(np.int64)
    assert unit_by_positions(sheet, time_ns, 0, lat_column, lon_column, per_degree) == unit
