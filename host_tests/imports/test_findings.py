"""The columns of an unknown table are found from their values. Names, units, separators and times may be of any
kind."""

import functools
import re
import shlex

import numpy as np
import pytest
from kickstand_tools import api
from kickstand_tools.common.errors import InputError
from kickstand_tools.imports import findings
from support import command
from support.recordings import drawn_tables

G, RAD = drawn_tables.GRAVITY, np.pi / 180.0
HEAD = "t,ax,ay,az,gx,gy,gz"


@functools.cache
def hand(hz=50.0):
    """Return the times, forces and rates of a sensor that is turned in a hand."""
    return drawn_tables.motion("hand", hz, np.random.default_rng(5))


def lines(form, times=1.0, force=1.0, rates=1.0, head=""):
    """Return the text of a table with one row per sample.

    form: format string for seven numbers.
    times, force, rates: factors on the values.
    head: first line of the table, or "".
    """
    t, f, w = hand()
    rows = [form.format(*row) for row in np.column_stack((times * t, force * f, rates * w)).tolist()]
    return "\n".join([head, *rows] if head else rows) + "\n"


ROW = ",".join(["{:.3f}"] + ["{:.4f}"] * 6)
COUNT_ROW = ",".join(["{:.0f}"] * 7)
READ = {
    "labels over several lines": lines(
        "t: {:.3f}\nAcceleration X: {:.3f}, Y: {:.3f}, Z: {:.3f} m/s^2\n"
        "Rotation X: {:.4f}, Y: {:.4f}, Z: {:.4f} rad/s\n",
        1.0,
        G,
        RAD,
    ),
    "labels behind time stamps": lines("12:30:{:06.3f} -> a/g:" + "\t{:.0f}" * 6, 1.0, 16384.0, 131.0),
    "JSON per line": lines('{{"t": {:.3f}, "ax": {:.4f}, "ay": {:.4f}, "az": {:.4f}, "gx": {}, "gy": {}, "gz": {}}}'),
    "numbers of sensors": lines(
        "{0:.0f},1,{1:.4f},{2:.4f},{3:.4f}\n{0:.0f},4,{4:.5f},{5:.5f},{6:.5f}", 1e9, G, RAD, "ts,sensor,x,y,z"
    ),
    "counts of unlike ranges": lines(COUNT_ROW, 1000.0, 16384.0, 16.4, "ms,AcX,AcY,AcZ,GyX,GyY,GyZ"),
    "thousandths": lines(COUNT_ROW, 1e6, 1000.0, 1000.0 * RAD, "time_us,xacc,yacc,zacc,xgyro,ygyro,zgyro"),
    "a line of units": lines(ROW, head=HEAD + "\ns,g,g,g,dps,dps,dps"),
    "other words": lines(ROW.replace(",", ";"), 1.0, G, 1.0, "Zeit;Beschl_X;Beschl_Y;Beschl_Z;Dreh_X;Dreh_Y;Dreh_Z"),
    "other sensors": lines(
        ROW + ",0.01,0.02,0.01,10,20,30",
        1.0,
        G,
        RAD,
        "time,accX,accY,accZ,gyroX,gyroY,gyroZ,linX,linY,linZ,magX,magY,magZ",
    ),
}


def found_as_it_is(imported):
    t, force, rates = hand()
    log = imported.log
    for got, want, limit in ((log.accel_g, force, 0.02), (log.gyro_dps, rates, 0.6)):
        expected = np.column_stack([np.interp(log.t_s, t, column) for column in want.T])
        assert np.mean(np.abs(got - expected) < limit) > 0.95
    assert len(log.t_s) == pytest.approx(len(t), abs=2)


@pytest.mark.parametrize("name", READ)
def test_a_table_is_read_without_a_question(tmp_path, name):
    (tmp_path / "log.csv").write_text(READ[name])
    found_as_it_is(api.import_recording(tmp_path / "log.csv"))


def test_one_file_per_sensor_is_joined_by_time(tmp_path):
    t, force, rates = hand()
    for name, values in (("acc", G * force), ("gyro", RAD * rates)):
        rows = [",".join(f"{value:.5f}" for value in row) for row in np.column_stack((t, values)).tolist()]
        (tmp_path / f"{name}.csv").write_text("\n".join(["time,x,y,z", *rows]) + "\n")
    found_as_it_is(api.import_recording(tmp_path))
    columns = {"t": "time"} | {f"{name[0]}{axis}": f"{name}:{axis}" for name in ("acc", "gyro") for axis in "xyz"}
    found_as_it_is(api.import_recording(tmp_path, columns, {"t": "s", "a": "m/s2", "g": "rad/s"}))


def test_micros_that_overflow_are_one_recording(tmp_path):
    t, force, rates = hand()
    micros = (4_290_000_000 + np.rint(1e6 * t).astype(np.int64)) % 2**32
    rows = [",".join(map(str, [at, *row])) for at, row in zip(micros, np.hstack((force, rates)).round(4).tolist())]
    (tmp_path / "log.csv").write_text("\n".join(["us" + HEAD[1:], *rows]) + "\n")
    found_as_it_is(api.import_recording(tmp_path / "log.csv"))


@pytest.mark.parametrize(
    ("typed", "much"), [("rad/s", "57[.0-9]* times too far"), ("mdeg/s", "1e\\+03 times too little")]
)
def test_unit_that_does_not_turn_gravity_is_refused(tmp_path, typed, much):
    (tmp_path / "log.csv").write_text(lines(ROW, head=HEAD))
    columns = {name: name for name in HEAD.split(",")}
    with pytest.raises(InputError, match=f"in this unit the rates turn gravity {much}"):
        api.import_recording(tmp_path / "log.csv", columns, {"a": "g", "g": typed})


def test_bias_that_would_turn_gravity_around_is_refused(tmp_path):
    rows = [f"{20 * k},0,0,1,-2.5,1,1" for k in range(300)]
    (tmp_path / "log.csv").write_text("\n".join([HEAD, *rows]) + "\n")
    columns = {name: name for name in HEAD.split(",")}
    with pytest.raises(InputError, match="gravity keeps its direction while the rates, in this unit, turn it round"):
        api.import_recording(tmp_path / "log.csv", columns, {"a": "g", "g": "rad/s"})


def test_range_of_raw_counts_is_found(tmp_path):
    (tmp_path / "log.csv").write_text(lines(COUNT_ROW, 1000.0, 8192.0, 32.8, HEAD))
    columns = {name: name for name in HEAD.split(",")}
    for units in ({"a": "counts", "g": "counts"}, {"a": "counts/8192", "g": "LSB/32.8"}):
        found_as_it_is(api.import_recording(tmp_path / "log.csv", columns, {"t": "ms", **units}))


def test_import_reports_at_once_why_no_lean_is_possible(tmp_path):
    t, force, rates = hand()
    rows = [ROW.format(*row) for row in np.column_stack((t, force, rates))[::5].tolist()]
    (tmp_path / "log.csv").write_text("\n".join([HEAD, *rows]) + "\n")
    result = command.works("import", tmp_path / "log.csv", "--out", tmp_path / "R.csv")
    assert "10 samples per second: at least 20 are needed" in result.err
    assert "at least 30 s of riding are needed" in result.err
    assert "next:" not in result.out
    assert "gyro: in it the rates turn gravity as it turns" in result.out


def judged(seed, path):
    """Return the result of importing a random table: "right", "refused", or the error."""
    drawn = drawn_tables.draw(seed)
    path.write_text(drawn.text)
    try:
        found = api.import_recording(path)
    except InputError as error:
        typed = re.search(r"kickstand (import .*)", str(error))
        if typed is None or "?" in typed[1]:
            return "refused"
        words = shlex.split(typed[1])
        columns, units = (words[words.index(option) + 1].split(",") for option in ("--columns", "--units"))
        try:
            found = api.import_recording(
                path, dict(pair.split("=", 1) for pair in columns), dict(pair.split("=", 1) for pair in units)
            )
        except InputError:
            return "refused"
    log = found.log
    if abs(log.t_s[-1] - drawn.time_s[-1]) > 0.02 * drawn.time_s[-1] + 0.05:
        return f"{drawn.said}: {log.t_s[-1]} s"
    for got, want, limit in ((log.accel_g, drawn.force_g, 0.03), (log.gyro_dps, drawn.rates_dps, 0.7)):
        expected = np.column_stack([np.interp(log.t_s, drawn.time_s, column) for column in want.T])
        if np.mean(np.abs(got - expected) < limit) < 0.9:
            return f"{drawn.said}: {got[5]} in place of {expected[5]}"
    return "right"


@pytest.mark.parametrize("count", [15, pytest.param(500, marks=pytest.mark.nightly)])
def test_no_random_table_is_imported_wrongly(tmp_path, count):
    # the tables with odd seeds were not used for development
    results = [judged(seed, tmp_path / "log.csv") for seed in range(1, 2 * count, 2)]
    assert [result for result in results if result not in ("right", "refused")] == []
    assert results.count("right") >= 0.99 * count


@pytest.mark.parametrize(
    ("per_g", "unit", "why"),
    [
        (1.0, "g", "gravity at rest is 1 long"),
        (G, "m/s2", "gravity at rest is 9.807 long"),
        (8192.0, "counts/8192", "gravity at rest is 8192 long: raw counts of a sensor with 8192 counts (LSB) per g"),
    ],
)
def test_the_unit_of_an_accelerometer_is_explained(per_g, unit, why):
    values = np.round(per_g * np.tile([0.0, 0.6, 0.8], (200, 1)), 0 if per_g > 1000.0 else 6)
    found = findings.accelerometer(values, np.arange(200) / 50.0)
    assert (found.unit, found.why, found.certain) == (unit, why, True)
