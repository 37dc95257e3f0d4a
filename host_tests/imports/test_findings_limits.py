"""Tests what is concluded from the values of unknown columns, with a value on either side of each limit."""

import functools
import itertools
from typing import Any

import numpy as np
import pytest
from kickstand_tools.common.errors import InputError
from kickstand_tools.imports import findings, layout, mapped, rate_fit, units
from kickstand_tools.imports.recording import Sheet

MS = 1_000_000


# findings.py


@pytest.mark.parametrize(
    ("name", "stem", "axis"),
    [
        ("accX", "acc", "x"),
        ("Acc X (g)", "acc", "x"),
        ("x_acc", "acc", "x"),
        ("gyro:Y axis", "gyro:", "y"),
        ("data12", "data", "12"),
        ("xacc", "acc", "x"),
        ("accX_mg", "acc", "x"),
    ],
)
def test_an_axis_is_split_from_a_name(name, stem, axis):
    assert list(findings._split_axis(name)) == [(stem, axis)]


def test_names_without_an_axis_have_none():
    for name in ("speed", "accuracy", "verticalaccuracy", "x"):
        assert [axis for _, axis in findings._split_axis(name) if axis != "x"] in ([], ["y"])


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("acc (m/s^2)", "m/s2"),
        ("acc_mg", "mg"),
        ("millis", "ms"),
        ("micros", "us"),
        ("timeNano", "ns"),
        ("t_ms", "ms"),
        ("seconds", "s"),
        ("s", "s"),
        ("acc", ""),
        ("x (left)", ""),
        ("gyro_counts/131", "counts/131"),
    ],
)
def test_a_unit_is_stated_in_a_name(name, said):
    assert findings.stated_unit(name) == said


def test_numbered_columns_are_groups_of_three():
    assert findings._numbered({str(k): k for k in range(4, 10)}) == [["4", "5", "6"], ["7", "8", "9"]]
    assert findings._numbered({"1": 0, "2": 1, "4": 2}) == [] == findings._numbered({"1": 0, "2": 1})
    assert findings._numbered({"9": 0, "10": 1, "11": 2}) == [["9", "10", "11"]]


def calm(length, count=200):
    return np.tile([0.0, 0.6, 0.8], (count, 1)) * length


@pytest.mark.parametrize(
    ("length", "stated", "unit", "certain"),
    [
        (1.0, "", "g", True),
        (1.29, "", "g", True),
        (1.31, "", "g", False),
        (1 / 1.31, "", "g", False),
        (9.8, "m/s2", "m/s2", True),
        (9.8, "g", "m/s2", False),
        (1000.0, "", "mg", True),
        (1.2, "g", "g", True),
    ],
)
def test_gravity_shows_the_unit_of_accelerations(length, stated, unit, certain):
    found = findings.accelerometer(calm(length) + 0.25 * (length > 20.0), np.arange(200) / 50.0, stated)
    assert (found.unit, found.certain) == (unit, certain)


def test_the_calm_length_is_that_of_the_calmest_fifth():
    values = calm(1.0)
    values[50:] *= 1.0 + 0.5 * np.random.default_rng(1).uniform(-1.0, 1.0, (150, 1))
    assert findings.calm_length(values, np.arange(200) / 50.0) == pytest.approx(1.0, abs=0.01)


def test_rows_of_half_a_second():
    assert findings._rows_in(0.5, np.arange(200) / 50.0, 200) == 25
    assert findings._rows_in(0.5, 10.0 * np.arange(200.0), 200) == 1
    assert findings._rows_in(0.5, np.arange(30) / 100.0, 30) == 10
    assert [findings._rows_in(0.5, None, count) for count in (9, 100, 250, 900)] == [1, 10, 25, 25]


def test_whole_numbers_above_20_are_counts():
    assert findings._are_whole(np.array([21.0, 0.0])) and not findings._are_whole(np.array([20.0, 0.0]))
    assert not findings._are_whole(np.array([21.5])) and not findings._are_whole(np.array([np.nan]))


@pytest.mark.parametrize(
    ("most", "moving", "unit"),
    [(2.9, True, "rad/s"), (3.1, True, "deg/s"), (999.0, True, "deg/s"), (1001.0, True, "mdeg/s"),
     (0.1, False, "deg/s"), (0.1 / 57.3, False, "rad/s"), (100.0, False, "mdeg/s"), (1.75, False, "mrad/s")],
)  # fmt: skip
def test_a_unit_of_rates_by_their_size(most, moving, unit):
    """At rest the noise shows the unit, because it is about 0.1 deg/s. In motion the 90th percentile of the rates shows
    the unit."""
    force = calm(1.0)
    if moving:
        force[::2, 0] += 0.2
        rates = np.zeros((200, 3))
        rates[::2, 0], rates[1::2, 0] = most, -most
    else:
        rates = np.random.default_rng(1).normal(0.0, most, (200, 3))
    assert findings._by_size(rates, force)[0] == unit


def test_counts_of_a_gyro_follow_the_accelerometers_range():
    def accel(unit):
        return findings.ColumnFinding([], unit)

    assert [findings._usual_counts(accel(f"counts/{n}")) for n in (16384, 8192, 4096, 2048, 99)] == [
        131.0, 65.5, 32.8, 16.4, 131.0,
    ]  # fmt: skip
    assert findings.gyro_units(np.full((9, 3), 30.0), accel("counts/8192")) == {
        "counts/131": 1 / 131, "counts/65.5": 1 / 65.5, "counts/32.8": 1 / 32.8, "counts/16.4": 1 / 16.4,
    }  # fmt: skip
    assert findings.gyro_units(np.full((9, 3), 30.5), accel("counts/8192")) == units.RATES
    assert findings.gyro_units(np.full((9, 3), 30.0), accel("g")) == units.RATES


def test_a_time_column_increases_and_is_named():
    def found(**columns) -> Any:
        names = [name.replace("_", " ") for name in columns]
        return findings._time(Sheet("f", names, [np.array(cells) for cells in columns.values()]))

    steps = np.arange(100) * 10
    assert found(x=steps % 70, millis=steps).columns == ["millis"]
    assert found(millis=steps).unit == "ms" and found(millis=steps).why == "millis says ms"
    assert found(n=steps, b=steps * 1.5).columns == ["b"]  # column n only counts the rows
    assert found(a=np.arange(100)) is None and found(a=-steps) is None
    assert "in ms there are 100 samples per second" in found(a=steps * 1.01, b=steps[::-1]).why.replace("99", "100")
    assert found(time=np.arange(100) * 50_000_000, x=steps).unit == "ns"


@pytest.mark.parametrize(
    ("name", "step", "hz"), [("s", 0.01, 100.0), ("ms", 20.0, 50.0), ("us", 5000.0, 200.0), ("ns", 2e7, 50.0)]
)
def test_a_time_without_a_name_has_a_usual_rate(name, step, hz):
    found = findings._time(Sheet("f", ["x"], [step * np.arange(1000.0) * (1.0 + 1e-6 * np.arange(1000))]))
    assert found is not None and found.unit == name
    assert found.why == f"in {name} there are {hz:.3g} samples per second"
    assert findings._mean_step(np.arange(101.0) * step) == pytest.approx(80 * step / (0.8 * 101))


@pytest.mark.parametrize(
    ("unit", "step", "fits"), [("s", 0.99, True), ("s", 1.03, False), ("us", 51.0, True), ("us", 49.0, False)]
)
def test_a_stated_unit_of_times_must_be_usual(unit, step, fits):
    assert findings._step_fits(step * np.arange(1000.0), unit) is fits


def test_groups_of_three_columns_do_not_share_one():
    """Columns without any number belong to no group. Columns without names must be side by side to form a group."""

    def places(names, **cells):
        columns = [cells.get(name, np.arange(50.0) % 7) for name in names]
        return [(three.stem, three.places) for three in findings._find_triples(Sheet("f", names, columns))]

    assert places(["t", "ax", "ay", "az", "gx", "gy", "gz"]) == [("a", [1, 2, 3]), ("g", [4, 5, 6])]
    nothing = np.full(50, np.nan)
    assert places(["ax", "ay", "az", "gx", "gy", "gz"], gz=nothing) == [("a", [0, 1, 2])]
    few = np.where(np.arange(50) < 1, 1.0, np.nan)
    assert places(["ax", "ay", "az", "gx", "gy", "gz"], gz=few) == [("a", [0, 1, 2])]
    two = np.where(np.arange(50) < 2, 1.0, np.nan)
    assert len(places(["ax", "ay", "az", "gx", "gy", "gz"], gz=two)) == 2
    assert places(["time", "p", "q", "r", "u", "v", "w"], time=np.arange(50.0)) == [("", [1, 2, 3]), ("", [4, 5, 6])]
    assert places(["data1", "data2", "data3", "x1"]) == [("data", [0, 1, 2])]
    assert [place for _, place in places(["xgyrox", "xgyroy", "xgyroz"])] == [[0, 1, 2]]


def test_single_axes_of_a_sensor_are_proposed():
    sheet = Sheet("f", ["accX", "accY", "gyroZ", "t"], [np.arange(9.0)] * 4)
    assert findings._single(sheet, "a", "accel") == {"ax": "accX", "ay": "accY"}
    assert findings._single(sheet, "g", "gyro") == {"gz": "gyroZ"}


def test_wanted_names_may_be_in_any_line():
    lines = ["# a recording", "", "#t,ax,ay,az", "1,2,3,4", "2,3,4,5"]
    assert layout._grid_below(lines, ["t", "az"]) == layout.Grid(2, 3, ",", False, 4)
    assert layout._grid_below(lines, ["t", "b"]) is None is layout._grid_below(lines, [])
    assert layout._grid_below(["t;b", "x", "y"], ["t", "b"]) == layout.Grid(0, 1, ";", False, 2)
    assert layout._grid_below(["x", "t,b"], ["t"]) is None  # the names are in the last line, so no rows follow
    wide = layout._grid_below(["t,a,b,c,d", "1,2,3,4", "1,2,3,4"], ["t", "d"])
    assert wide is not None and wide.width == 5


def test_speeds_and_places_are_found_by_name():
    def sheet(*names):
        return Sheet("f", list(names), [np.arange(9.0)] * len(names))

    for name, unit in (
        ("Speed (km/h)", "km/h"),
        ("speed_kph", "km/h"),
        ("GPS_velocity_mph", "mph"),
        ("speed", ""),
        ("Velocity", ""),
    ):
        found = findings._speed(sheet("t", name))
        assert found is not None and (found.columns, found.unit, found.certain) == ([name], unit, bool(unit))
    for name in ("speedaccuracy", "angularvelocity", "velocityx", "velocity_y", "fast"):
        assert findings._speed(sheet(name)) is None
    assert findings._find_by_name(sheet("latitude_acc"), "^lat") is None
    assert findings._find_by_name(sheet("Latitude"), "^lat") is not None
    made = findings.find(Sheet("f", ["lat"], [np.arange(9.0)]))
    assert "lat" not in made.found and made.lacking == ["time", "acceleration", "gyro"]


def test_gravity_has_a_constant_length():
    def has(values, near=True):
        return findings._has_gravity(findings._Triple("", [0, 1, 2], "", values), None, near)

    assert has(calm(1.0)) and not has(calm(1.0)[:2]) and not has(calm(0.0)) and not has(calm(3.0))
    assert has(calm(3.0), near=False) and has(calm(1.29)) and not has(calm(1.31)) and not has(calm(1 / 1.31))
    swinging = calm(1.0) * np.where(np.arange(200) < 100, 1.03, 0.97)[:, None]
    assert has(swinging) and not has(swinging, near=False)
    assert not has(calm(1.0) * np.sign(np.random.default_rng(1).normal(size=(200, 1))))  # without gravity


# rate_fit.py


@functools.cache
def turning(dps=40.0, seconds=12.0, hz=100.0):
    """Simulate a sensor that turns about all axes. The direction of gravity u follows the rates w: du/dt = u x w."""
    t_s = np.arange(0.0, seconds, 1.0 / hz)
    w = np.radians(dps) * np.column_stack((np.sin(t_s), 0.2 * np.cos(0.7 * t_s), np.sin(1.3 * t_s + 1.0)))
    u = np.zeros((len(t_s), 3))
    u[0] = [0.0, 1.0, 0.0]
    for k in range(len(t_s) - 1):
        middle = 0.5 * (w[k] + w[k + 1])
        half = u[k] + 0.5 / hz * np.cross(u[k], middle)
        u[k + 1] = u[k] + np.cross(half, middle) / hz
        u[k + 1] /= np.linalg.norm(u[k + 1])
    return t_s, u, w


def test_rates_that_turn_gravity_are_found():
    t_s, u, w = turning()
    found = rate_fit.fit_rates(t_s, u, np.degrees(w) + [1.0, -2.0, 0.5])
    assert np.degrees(found.factor) == pytest.approx(1.0, abs=0.01) and found.explained > 0.99 and found.decides
    change = np.linalg.norm(u[40:] - u[:-40], axis=1)
    assert found.turn == pytest.approx(np.sqrt(np.mean(change**2)), rel=0.1)
    assert found.unturned == pytest.approx(found.turn * np.degrees(1.0), rel=0.1)
    exchanged = rate_fit.fit_rates(t_s, 9.81 * u, np.degrees(w)[:, [2, 0, 1]] * [1.0, -1.0, 1.0])
    assert np.degrees(exchanged.factor) == pytest.approx(1.0, abs=0.01)
    assert rate_fit.fit_rates(t_s[:79], u[:79], w[:79]) == rate_fit.RateFit()


def test_cells_are_means_over_50_ms():
    t_s = np.arange(0.0, 10.0, 0.01)
    force = np.column_stack((t_s, 2.0 * t_s, 0.0 * t_s))
    gaps = force.copy()
    gaps[::3] = np.nan
    for rates in (force, gaps):
        cells = rate_fit._in_cells(t_s, force, rates)
        assert cells is not None
        begin = np.percentile(t_s, 1.0)
        middles = begin + 0.05 * (np.arange(len(cells[1])) + 0.5)
        assert len(middles) == int((np.percentile(t_s, 99.0) - begin) / 0.05)
        assert cells[1][1:-1, 1] == pytest.approx(2.0 * middles[1:-1], abs=0.003)
    assert rate_fit._in_cells(t_s[:3], force[:3], force[:3]) is None


@pytest.mark.parametrize(("dps", "too_far"), [(59.0, False), (61.0, True)])
def test_rates_may_turn_constant_gravity_by_120_degrees(dps, too_far):
    """120 degrees in 2 s are a rate of 60 deg/s. Only the rate across gravity counts."""
    t_s = np.arange(0.0, 10.0, 0.01)
    force = np.tile([0.0, 1.0, 0.0], (len(t_s), 1))
    assert rate_fit.turns_too_far(t_s, force, np.tile([dps, 500.0, 0.0], (len(t_s), 1))) is too_far
    t_s, u, w = turning(dps=150.0)
    assert not rate_fit.turns_too_far(t_s, u, 3.0 * np.degrees(w))


def test_the_sign_of_levi_civita():
    for i, j, a in itertools.product(range(3), repeat=3):
        cross = np.cross(np.eye(3)[j], np.eye(3)[i])
        assert rate_fit._LEVI_CIVITA[i, j, a] == cross[a]


# mapped.py


def test_a_wrong_unit_of_rates_is_refused_by_a_factor_of_three(monkeypatch):
    for shown, words in (
        (2.9, None),
        (3.1, r"gravity 3\.1 times too little"),
        (1 / 2.9, None),
        (1 / 3.1, "3.1 times too far"),
    ):
        monkeypatch.setattr(mapped, "fit_rates", lambda *_, shown=shown: rate_fit.RateFit(np.radians(shown), 0.9, 1.0))
        monkeypatch.setattr(mapped, "turns_too_far", lambda *_: False)
        nothing: Any = None
        if words is None:
            mapped._check_rates("n", nothing, nothing, nothing)
        else:
            with pytest.raises(InputError, match=words):
                mapped._check_rates("n", nothing, nothing, nothing)


def test_columns_are_named_or_numbered():
    sheet = Sheet("f", ["a", "Acc X", "c,d", "a"], [np.arange(2.0)] * 4)
    assert [mapped._place(sheet, "ax", text) for text in ("a", "acc_x", "#1", "#4", " c,d ")] == [0, 1, 0, 3, 2]
    for wrong in ("#0", "#5", "b", "!"):
        with pytest.raises(InputError, match="no column"):
            mapped._place(sheet, "ax", wrong)
    table = mapped.MappedTable("f", sheet, findings.Findings({"a": findings.ColumnFinding(["Acc X", "c,d", "a"])}))
    assert [mapped._column_as_typed(table, key) for key in ("ax", "ay", "az", "gx")] == ["Acc X", "#3", "#1", "?"]
    assert table.missing == ["t", "gx", "gy", "gz"] and table.first_seconds() == {}


def test_the_first_ten_seconds_are_thinned():
    found = {"t": findings.ColumnFinding(["t"], "s"), "a": findings.ColumnFinding(["x", "x", "x"], "g")}
    sheet = Sheet("f", ["t", "x"], [5.0 + np.arange(4000) / 100.0, np.arange(4000.0)])
    shown: Any = mapped.MappedTable("f", sheet, findings.Findings(found)).first_seconds()
    assert len(shown["t"]) == 334 and shown["t"][:2] == [0.0, 0.03] and shown["t"][-1] == 9.99
    assert shown["a"][0][:2] == [0.0, 3.0]


def test_the_sign_of_an_axis_is_reported():
    sheet = Sheet("f", list("abc"), [np.ones(5)] * 3)
    places = {"ax": 0, "ay": 1, "az": 2}
    for given, sign in (({"a": "g"}, "as it is"), ({"a": "-g"}, "turned"), ({"a": "g", "ay": "-g"}, "turned in part")):
        scaled = mapped._scaled(sheet, places, given, findings.ACCEL)
        made = mapped._sensor(sheet, np.arange(5) * 10 * MS, places, given, "accelerometer", scaled)
        assert made.taken[0].sign == sign and made.taken[0].unit == "g"
        assert mapped._sign_changed(given) is (sign != "as it is")
    assert made.values[0].tolist() == [1.0, -1.0, 1.0] and made.taken[0].rate_hz == pytest.approx(100.0)
