"""The parts of an import, with small tables and results computed by hand."""

import itertools
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from kickstand_tools.common.errors import InputError
from kickstand_tools.imports import files, findings, importing, join, layout, mapped, rate_fit, recording, units
from kickstand_tools.imports.apps import aim, own, phyphox, racebox, racechrono, sensor_logger, sensorlog, vbo
from kickstand_tools.imports.files import RecordingFile
from kickstand_tools.imports.recording import AppRecording, ReceiverTrack, RecordedSensor, Sheet
from kickstand_tools.logs.log import Log

MS = 1_000_000
G = 9.80665


def file(text: str, name: str = "a.csv") -> RecordingFile:
    return RecordingFile(name, text.encode(), text)


def sensor(times_ms, values=None, name="accelerometer") -> RecordedSensor:
    time_ns = np.round(np.array(times_ms, dtype=float) * MS).astype(np.int64)
    rows = np.tile([0.0, 1.0, 0.0], (len(time_ns), 1)) if values is None else np.array(values, dtype=float)
    return RecordedSensor(name, time_ns, rows)


# files.py


def test_bytes_are_decoded_by_their_mark_or_their_zeros():
    for encoding in ("utf-8", "utf-8-sig", "utf-16", "utf-16-le", "utf-16-be"):
        assert files._decoded("t,°\n1,2\n".encode(encoding)) == "t,°\n1,2\n"
    assert files._decoded(b"\xfe\xff\x00t") == "t"
    assert files._decoded("t,°\n".encode("cp1252")) == "t,°\n"


def test_a_file_with_four_control_characters_is_no_text():
    assert files._recording_file("a", b"\x00\x01\x02,1,2,3,4,5,6,7,8,9\n") is not None
    assert files._recording_file("a", b"\x01\x01\x01\x01,1,2,3,4,5,6,7,8,9\n") is None
    found = files._recording_file("a", b"a\tb\r\nc\rd\r\r\r")
    assert found is not None and found.text == "a\tb\nc\nd\n\n\n"
    assert files._recording_file("a", b"PAR1\x00\x00\x00\x00\x00") == RecordingFile(
        "a", b"PAR1\x00\x00\x00\x00\x00", ""
    )


def test_a_line_may_have_a_million_characters():
    assert files._recording_file("a", b"x" * 1_000_000) is not None
    with pytest.raises(InputError, match="a: a line of over 1,000,000 characters"):
        files._recording_file("a", b"x" * 1_000_001)


def test_first_lines_are_not_blank():
    assert file("\n a\n\nb\nc\n").first_lines(2) == [" a", "b"]
    assert file("a").first_lines(2) == ["a"]


def test_the_largest_recording_is_250_mb(monkeypatch):
    assert (files.MOST_BYTES, files.MOST_FILES) == (250_000_000, 10_000)
    monkeypatch.setattr(files, "MOST_BYTES", 10)
    for sizes, fits in (((4, 6), True), ((4, 7), False)):
        monkeypatch.setattr(files, "_contents", lambda path, sizes=sizes: [("a", b"x" * n) for n in sizes])
        if fits:
            assert len(list(files._bounded(Path("p")))) == 2
        else:
            with pytest.raises(InputError, match="p is too large: over 0 MB when unpacked"):
                list(files._bounded(Path("p")))


# units.py


@pytest.mark.parametrize(
    ("text", "name"),
    [("m/s^2", "m/s2"), ("M/S²", "m/s2"), ("m s-2", "m/s2"), ("m*s^-2", "m/s2"), ("°/s", "deg/s"), ("kph", "km/h")]
    + [("µs", "us"), ("furlong", "furlong"), (" G ", "g")],
)
def test_units_have_many_spellings(text, name):
    assert units.unit(text) == name


def test_factors_of_units_by_hand():
    assert units.factor("km/h", units.SPEEDS, "x") == pytest.approx(1000.0 / 3600.0)
    assert units.factor("-mph", units.SPEEDS, "x") == pytest.approx(-1609.344 / 3600.0)
    assert units.factor("kn", units.SPEEDS, "x") == pytest.approx(0.514444, rel=1e-5)
    assert units.factor("mg", units.ACCELERATIONS, "x") * 1000.0 == pytest.approx(1.0)
    assert units.factor("m/s2", units.ACCELERATIONS, "x") * G == pytest.approx(1.0)
    assert [units.factor(name, units.RATES, "x") for name in ("rad/s", "mrad/s", "mdeg/s")] == pytest.approx(
        [57.29578, 0.05729578, 0.001]
    )
    assert units.factor("min", units.ANGLES, "x") == pytest.approx(1 / 60)
    assert units.factor("-counts/131", units.RATES, "x") == pytest.approx(-1 / 131)
    for wrong, kinds in (("counts/131", units.SPEEDS), ("counts/0", units.RATES), ("x", units.RATES)):
        with pytest.raises(InputError, match=f"where: unit '{wrong}' is not known"):
            units.factor(wrong, kinds, "where")


@pytest.mark.parametrize(
    ("first", "step", "name"),
    [(0.0, 0.02, "s"), (0.0, 0.89, "s"), (0.0, 0.91, "ms"), (0.0, 599.0, "ms"), (0.0, 601.0, "us")]
    + [(0.0, 599e3, "us"), (0.0, 601e3, "ns"), (1.7e9, 0.01, "s"), (1.7e9, 99.0, "s"), (1.7e9, 101.0, "ms")]
    + [(1.7e12, 10.0, "ms"), (1.7e15, 10e3, "us"), (1.7e18, 1e7, "ns"), (0.9e8, 10.0, "ms"), (1.1e10, 10e3, "us")],
)
def test_the_unit_of_times_is_guessed_by_size_and_step(first, step, name):
    assert units._guessed(first + step * np.arange(50.0)) == name


def test_times_of_numbers_clocks_and_dates():
    assert units.times_ns(np.array([1, 2, 3]), "ms").tolist() == [MS, 2 * MS, 3 * MS]
    assert units.times_ns(np.array([0.5, 1.25]), "s").tolist() == [500 * MS, 1250 * MS]
    assert units.times_ns(np.array([-0.25, np.nan]), "s").tolist() == [-250 * MS, units.NO_TIME]
    clock = units.times_ns(np.array(["01:02:03.5", "59:58", ""], dtype=object))
    assert clock.tolist()[:2] == [3_723_500 * MS, 3_598_000 * MS] and clock[2] == units.NO_TIME
    dates = ["1970-01-01T00:00:01Z", "1970/1/2 00:00:00", "1970-01-01 01:00:00 +01:00", "1970-01-01T00:00:02:250"]
    assert units.times_ns(np.array(dates, dtype=object)).tolist() == [1000 * MS, 86_400_000 * MS, 0, 2250 * MS]
    with pytest.raises(InputError, match="the recording: 'x' is no time"):
        units.times_ns(np.array(["x", "01:02:03"], dtype=object))
    assert units._date_ns("2300-01-01") == units.NO_TIME != units._date_ns("2200-01-01")


def test_midnight_adds_a_day():
    found = units.of_day(np.array([235959.5, 0.25, 10203.0]))
    day = 86_400_000 * MS
    assert found.tolist() == [day - 500 * MS, day + 250 * MS, day + 3_723_000 * MS]


def test_a_clock_of_32_bits_continues():
    assert units.unwrapped(np.array([2**32 - 10, 5, 20])).tolist() == [2**32 - 10, 2**32 + 5, 2**32 + 20]
    for same in ([2**32 - 10, 2**31, 2**31 + 5], [2**32, 5], [-1, 2**32 - 1, 0]):
        assert units.unwrapped(np.array(same)).tolist() == same


# recording.py


def test_a_unit_in_a_name_is_in_its_last_brackets():
    assert recording.unit_in("Acc (x) (m/s^2)") == "m/s^2" and recording.unit_in("a [ g ] ") == "g"
    assert recording.unit_in("a (g) b") == "" == recording.unit_in("a")
    assert recording.plain("Gyro_X (deg/s) [1]") == "gyrox"


def test_a_sheet_finds_its_columns_in_the_order_of_names():
    sheet = Sheet("f", ["T", "Acc X", "accx", "b"], [np.arange(2.0)] * 4)
    assert sheet.place("b", "acc_x") == 3 and sheet.place("accx") == 1 and sheet.place("z") is None
    assert sheet.axes("b", ("c", "t"), ("d", "e")) == ([3, 0], ["d"])
    assert np.isnan(sheet.numbers(None)).all() and len(sheet.numbers(None)) == 2
    assert sheet.table([0, 3]).shape == (2, 2)


def test_a_common_beginning_of_names_is_not_repeated():
    sheet = Sheet("f", ["gyroscopeX (g)", "gyroscopeY", "gyroscopeZ", "accelX", "accelY", "accelZ"], [])
    assert sheet.named([0, 1, 2]) == "f: gyroscopeX, …Y, …Z"
    assert sheet.named([3, 4, 5]) == "f: accelX, accelY, accelZ"  # only 5 letters after the first are alike
    assert sheet.named([0, 1]) == "f: gyroscopeX, gyroscopeY"


def test_a_rate_leaves_gaps_and_marks_out():
    time_ns = np.array([0, 10, 20, 30, 40, 90, 100, 110]) * MS
    assert recording.rate_hz(time_ns) == pytest.approx(100.0)  # the gap of 5 steps is left out
    assert recording.rate_hz(np.array([0, 10, 20, 30, 40, 89, 99]) * MS) == pytest.approx(6 / 0.099)
    assert recording.rate_hz(np.append(time_ns, units.REPEATED)) == pytest.approx(100.0)
    assert recording.rate_hz(time_ns[:1]) == recording.rate_hz(time_ns[:1].repeat(3)) == 0.0


def test_damaged_rows_of_a_sensor_are_counted():
    values = np.array([[1.0, 1, 1], [np.nan, 1, 1], [np.nan] * 3, [1e6, 1, 1], [1, 1, 1], [1, 1, 1], [-9e5, 1, 1]])
    time_ns = np.array([1, 2, 3, 4, units.NO_TIME, units.REPEATED, 7])
    found = RecordedSensor("x", time_ns, values, damaged=10)
    assert found.damaged == 13 and found.time_ns.tolist() == [1, 7]


def track(time_s, speed, lat=None, lon=None) -> ReceiverTrack:
    nothing = np.full(len(time_s), np.nan)
    lat, lon = (nothing if place is None else np.array(place, dtype=float) for place in (lat, lon))
    return ReceiverTrack(np.round(np.array(time_s) * 1e9).astype(np.int64), np.array(speed, dtype=float), lat, lon)


def test_a_track_drops_markers_and_repetitions():
    found = track([0.1, 0.2, 0.9, 1.1, 1.2, 1.3], [5.0, 5.0, np.nan, 5.0, 6.0, -1.0])
    assert found.time_ns.tolist() == [100 * MS, 1100 * MS, 1200 * MS]
    places = track([0, 1, 2, 3, 4, 5], [0.0] * 6, [0, 90, 90.1, 1, 0, 1], [0, 180, 1, 180.1, 1, 0])
    assert np.isfinite(places.lat_deg).tolist() == [False, True, False, False, True, True]
    assert len(track([0.0], [np.nan]).time_ns) == 0


# join.py


def test_a_single_wrong_time_is_damaged():
    def damaged(*times_ms):
        return np.flatnonzero(join._damaged(np.array(times_ms) * MS)).tolist()

    assert damaged(0, 10, 20, 30) == [] == damaged(0, 520) == damaged(0, 499, 20, 30)
    assert damaged(0, 600, 20, 30) == [1] and damaged(600, 1200, 50, 1300) == [2]
    assert damaged(511, 10, 20, 30) == [0] and damaged(509, 10, 20, 30) == []
    assert damaged(1000, 1010, 1020, 519) == [3] and damaged(1000, 1010, 1020, 521) == []
    assert damaged(0, 2000, 1001, 1011) == []  # the times around it are a second apart


def test_late_samples_are_sorted_up_to_half_a_second():
    times = np.arange(200.0) * 10.0
    times[[50, 51]] = times[[51, 50]]
    values = np.tile(np.arange(200.0)[:, None], (1, 3))
    assert np.allclose(np.diff(join.in_order(sensor(times, values), "n").time_ns), 10 * MS)
    assert join.in_order(sensor(times, values), "n").values[50:52, 0].tolist() == [51.0, 50.0]


def test_a_sensor_needs_two_samples_and_at_most_10_khz():
    with pytest.raises(InputError, match="n: gyro has 1 samples"):
        join.in_order(sensor([0.0], name="gyro"), "n")
    assert len(join.in_order(sensor([0.0, 5.0]), "n").time_ns) == 2
    assert len(join.in_order(sensor(np.arange(30) / 9.9), "n").time_ns) == 30
    with pytest.raises(InputError, match="has 10100 samples per second, and no sensor has over 10000"):
        join.in_order(sensor(np.arange(30) / 10.1), "n")


def test_times_may_be_late_in_two_of_a_hundred_rows():
    for late, refused in ((2, False), (3, True)):
        times = np.arange(100.0) * 10.0
        times[np.arange(late) * 20 + 20] -= 75.0
        if refused:
            with pytest.raises(InputError, match=r"goes back 3 times, first in its row 21"):
                join.in_order(sensor(times), "n")
        else:
            join.in_order(sensor(times), "n")


def test_a_slower_sensor_is_interpolated_and_gaps_are_not():
    slow = sensor([0, 20, 200, 220], [[0.0] * 3, [2.0] * 3, [20.0] * 3, [22.0] * 3])
    found = join.on_clock(slow, np.array([-1, 0, 10, 20, 100, 200, 205, 221]) * MS, 10.0 * MS)
    assert found[:, 0] == pytest.approx([np.nan, 0.0, 1.0, 2.0, np.nan, 20.0, 20.5, np.nan], nan_ok=True)
    near = sensor([0, 170], [[0.0] * 3, [17.0] * 3])
    assert join.on_clock(near, np.array([50]) * MS, 200.0 * MS)[0, 0] == pytest.approx(5.0)


def test_a_faster_sensor_is_averaged():
    """20 ms around 30 ms have the samples after 20 ms up to 40 ms, two of 10 ms each or four of 5 ms."""
    values = np.array([0.0, 1.0, 4.0, 9.0, 16.0, 25.0, 36.0])[:, None] * [1.0, 1.0, 1.0]
    fast = sensor(np.arange(7) * 10.0, values)
    assert join.on_clock(fast, np.array([30 * MS]), 15.0 * MS)[0, 0] == 9.0  # 1.5 times as fast is not averaged
    assert join._averaged(fast, 20.0 * MS)[:, 0] == pytest.approx([0.5, 2.5, 6.5, 12.5, 20.5, 30.5, 36.0])
    assert (
        join.on_clock(fast, np.array([30 * MS]), 15.2 * MS)[0, 0]
        == 9.0
        != join.on_clock(fast, np.array([30 * MS]), 20.0 * MS)[0, 0]
    )


def rows(track, times_ms, utc_ns=None):
    return join._on_rows(track, np.array(times_ms) * MS, utc_ns)


def test_a_fix_is_in_the_nearest_row_within_170_ms():
    found = rows(track([0.014, 0.5, 0.671], [5.0, 6.0, 7.0]), [0, 10, 20, 330, 1000], 10**9)
    assert found["speed_mps"] == pytest.approx([np.nan, 5.0, np.nan, 6.0, np.nan], nan_ok=True)
    assert found["utc_s"] == pytest.approx([1.0, 1.01, np.nan, 1.33, np.nan], nan_ok=True)
    alone = rows(None, [250, 260], 10**9)
    assert alone["utc_s"] == pytest.approx([1.25, np.nan], nan_ok=True)
    assert np.isnan(rows(track([0.0], [201.0], [200.5], [1.0]), [0, 10])["speed_mps"]).all()
    assert rows(track([0.0], [199.0]), [0, 10])["speed_mps"][0] == 199.0


def joined(accel, gyro, **more):
    return join.join(AppRecording("app", accel, gyro, **more), "n")


def test_sensors_are_joined_and_lost_rows_counted():
    """The gyro lasts from 20 to 1000 ms, so two samples have no rate. A reading of 401 g is past any sensor's."""
    accel = sensor(np.arange(0.0, 1010.0, 10.0))
    accel.values[50] = [0.0, 401.0, 0.0]
    accel.damaged, steady = 3, sensor(np.arange(20.0, 1010.0, 10.0), np.tile([1.0, 2.0, 3.0], (99, 1)), "gyro")
    steady.damaged = 5
    log, lost = joined(accel, steady, temp_c=np.arange(101.0))
    assert lost == 6 and len(log.t_s) == 98
    assert log.gyro_dps[0] == pytest.approx([1.0, 2.0, 3.0]) and log.temperature_c[:2].tolist() == [2.0, 3.0]
    assert np.isnan(joined(accel, steady, temp_c=np.arange(100.0))[0].temperature_c).all()
    assert log.start_s + log.t_s[0] == pytest.approx(0.02)


def test_many_readings_past_the_range_are_another_unit():
    accel, gyro = sensor(np.arange(100.0) * 10.0), sensor(np.arange(100.0) * 10.0, None, "gyro")
    accel.values[:2, 1] = 1e4
    assert joined(accel, gyro)[1] == 2
    accel.values[2, 1] = 1e4
    with pytest.raises(InputError, match=r"past any sensor's, up to 1e\+04 g and 1 deg/s: check their units"):
        joined(accel, gyro)


def test_gravity_is_added_to_the_users_acceleration():
    made = {"user": sensor([0, 10, 20]), "gravity": sensor([0, 10, 20], [[0.0, 0.0, 1.0]] * 3)}
    for one in made.values():
        one.taken.append(recording.Taken("accelerometer", "f", "g"))
    made["gravity"].damaged = 4
    found = join.with_gravity(made, made.__getitem__, "n", "whose", "remedy", "none")
    assert found.values[0].tolist() == [0.0, 1.0, 1.0] and found.damaged == 4 and len(found.taken) == 2
    assert join.with_gravity({"total", "user"}, lambda which: which, "n", "w", "r", "o") == "total"  # type: ignore
    for there, words in (({"gravity"}, "n: none"), ({"user"}, "n: gravity has been taken off its whose")):
        with pytest.raises(InputError, match=words):
            join.with_gravity(there, made.__getitem__, "n", "whose", "remedy", "none")


# importing.py


def log_of(count=100, start=0.0) -> Log:
    t_s = start + np.arange(count) / 10.0
    return Log(t_s, np.tile([0.0, 1.0, 0.0], (count, 1)), np.zeros((count, 3)), name="n")


@pytest.mark.parametrize(
    ("begin", "end", "count", "first"),
    [(None, None, 100, 0.0), (2.0, None, 80, 2.0), (2.0, 3.0, 11, 2.0), (-1.0, None, 11, 8.9), (None, -1.0, 90, 0.0)]
    + [(-99.0, 0.1, 2, 0.0)],
)
def test_a_stretch_counts_from_the_start_or_the_end(begin, end, count, first):
    found = importing._stretch(log_of(), begin, end)
    assert len(found.t_s) == count and found.start_s + found.t_s[0] == pytest.approx(first)


def test_an_empty_stretch_is_refused():
    with pytest.raises(InputError, match=r"n lasts 9\.9 s: there is nothing from 9\.9 s on"):
        importing._stretch(log_of(), 9.9, None)
    with pytest.raises(InputError, match="there is nothing from 3 to 2 s"):
        importing._stretch(log_of(), 3.0, 2.0)


def test_shortfalls_of_an_import():
    for hz, lasts, codes in ((19.6, 61.0, []), (19.4, 61.0, ["import-slow"]), (20.0, 9.0, ["import-short"])):
        t_s = np.arange(0.0, lasts, 1.0 / hz)
        zeros = np.zeros((len(t_s), 3))
        found = importing.Imported("a", Log(t_s, zeros, zeros), [])
        assert [one.code for one in found.shortfalls] == codes
        assert found.rate_hz == pytest.approx(hz)


def test_gaps_are_longer_than_170_ms():
    t_s = np.array([0.0, 0.1, 0.27, 0.441, 0.5])
    found = importing.Imported("a", Log(t_s, np.zeros((5, 3)), np.zeros((5, 3))), [])
    assert found.gaps_s == pytest.approx([0.171])


@pytest.mark.parametrize(("agrees", "sign"), [(True, "+1 g up"), (False, "-1 g up"), (None, "")])
def test_an_uncertain_sign_follows_the_track(monkeypatch, agrees, sign):
    monkeypatch.setattr(importing, "log_agrees", lambda *_: agrees)
    made = AppRecording("app", sensor([0, 10]), sensor([0, 10]), sign_known=False)
    made.accel.taken = [recording.Taken("time", "f", "s"), recording.Taken("accelerometer", "f", "g")]
    log = log_of(3)
    importing._check_sign(made, log)
    assert log.accel_g[0, 1] == (-1.0 if agrees is False else 1.0)
    assert made.accel.taken[0].sign == "" and made.accel.taken[1].sign.startswith(sign)
    assert [one.code for one in made.notices] == ([] if sign else ["import-sign"])
    made.sign_known, log.accel_g = True, log_of(3).accel_g
    importing._check_sign(made, log)
    assert log.accel_g[0, 1] == 1.0


# layout.py


def test_the_layout_of_rows_is_found():
    plain_rows = ["t,a,b,c", *[f"{k},1,2,3" for k in range(5)]]
    assert layout.find_grid(plain_rows) == layout.Grid(0, 1, ",", False, 4)
    assert layout.find_grid(plain_rows[1:]) == layout.Grid(None, 0, ",", False, 4)
    comma = ["t;a;b;c", *[f"{k};1,5;2,5;3" for k in range(5)]]
    assert layout.find_grid(comma) == layout.Grid(0, 1, ";", True, 4)
    assert layout.find_grid(["1 2 3 4", "5 6 7 8"]) == layout.Grid(None, 0, " ", False, 4)
    assert layout.find_grid(["a,b,c", "1,2,3", "4,5,6"]) is None  # three numbers are too few
    assert layout.find_grid(["1,2,3,4"]) is None and layout.find_grid(["t,a,b,c", "1,2,3,4"]) is not None
    units_below = ["t,a,b,c", "(s),(g),(g),(g)", "1,2,3,4", "2,2,3,4"]
    found = layout.sheet_in(file("\n".join(units_below)))
    assert found is not None and found.columns == ["t (s)", "a (g)", "b (g)", "c (g)"]
    assert found.cells[0].tolist() == [1, 2]


def test_names_of_columns_are_hardly_numbers():
    assert layout._is_names(["a", "b", "c", "d"], 4) and layout._is_names(["a", "b", "c", "1"], 4)
    assert not layout._is_names(["a", "b", "1", "2"], 4) and not layout._is_names(["a", "b", "c", "d:"][3:], 4)
    assert layout._is_names(["a", "b", "c", "d", "e"], 4) and not layout._is_names(list("abcdef"), 4)
    assert layout._is_names(list("abc"), 6) and not layout._is_names(list("ab"), 6) and layout._is_names(list("ab"), 4)
    assert layout._all_units(["(s)", "g", "[m/s2]"]) and not layout._all_units(["s", "g"])
    assert not layout._all_units(["s", "g", "b", "c"])


def test_stamps_of_a_serial_monitor_are_a_first_cell():
    text = "12:30:05.250 -> 1,2,3\n12:30:05,750 -> 4,5,6\n"
    assert layout.without_stamps(text) == "45005.250,1,2,3\n45005.750,4,5,6\n"
    assert layout.without_stamps("00:00:01.5 -> x: 1\n") == "monitor_s: 1.500; x: 1\n"
    some = "12:30:05.250 -> 1\n" * 4 + "2\n"
    assert layout.without_stamps(some) != some and layout.without_stamps(some + "2\n") == some + "2\n"


def test_labels_before_the_values():
    assert list(layout._labelled_values("Acc X: 0.1, Y: 0.2, Z: -3 m/s2 temp=7")) == [
        ("Acc X (m/s2)", "0.1"), ("Acc Y (m/s2)", "0.2"), ("Acc Z (m/s2)", "-3"), ("temp", "7"),
    ]  # fmt: skip
    assert list(layout._labelled_values("acc: 1, 2, 3")) == [("acc x", "1"), ("acc y", "2"), ("acc z", "3")]
    assert list(layout._labelled_values("q: 1 2 3 4"))[-1] == ("q 4", "4")
    found = layout.sheet_in(file("t: 1 x: 2 y: 3 z: 4\nt: 2 x: 5 y: 6 z: 7\n"))
    assert found is not None and found.columns == ["t", "x", "y", "z"] and found.cells[3].tolist() == [4, 7]
    assert layout._labelled("n", "a: 1 b: 2 c: 3\n" * 3) is None


def test_labels_of_under_half_of_the_rows_are_left_out():
    """Of five rows, two or three have the label u. Of a label of half of the rows, only a minority is there."""
    full, short = "t: {0} x: 2 y: 3 z: 4 u: 5", "t: {0} x: 2 y: 3 z: 4"
    for count, there in ((2, False), (3, True)):
        text = "\n".join((full if k < count else short).format(k) for k in range(5)) + "\n"
        found = layout._labelled("n", text)
        assert found is not None and ("u" in found.columns) is there
    four = "\n".join((full if k < 2 else short).format(k) for k in range(4)) + "\n"
    found = layout._labelled("n", four)
    assert found is not None and "u" not in found.columns


def test_lines_with_labels_are_the_majority():
    """Seven of ten lines are labelled. There are at least 1.5 labels per line."""
    row = "t: 1 x: 2 y: 3 z: 4"
    assert layout._labelled("n", "\n".join([row] * 7 + ["text"] * 3)) is not None
    assert layout._labelled("n", "\n".join([row] * 6 + ["text"] * 4)) is None
    assert layout._labelled("n", "t: 1\nx: 2\ny: 3\nz: 4\n") is None


def test_a_joined_table_has_the_names_of_its_files():
    """The first columns are the times. Each row comes from one file."""
    one = file("t,x,y,z\n" + "".join(f"{k},1,2,3\n" for k in range(5)), "acc.csv")
    other = file("t,x,y,z\n" + "".join(f"{k + 0.5},4,5,6\n" for k in range(4)), "gyro.csv")
    found = layout.joined_sheet([one, other])
    assert found is not None and found.columns == ["t", *[f"{of}:{axis}" for of in ("acc", "gyro") for axis in "xyz"]]
    assert found.cells[0].tolist() == [0, 1, 2, 3, 4, 0.5, 1.5, 2.5, 3.5]
    assert np.isfinite(found.cells[1]).tolist() == [True] * 5 + [False] * 4
    assert found.cells[6].tolist()[5:] == [6.0] * 4 and np.isnan(found.cells[6][:5]).all()
    assert layout.joined_sheet([one]) is None and layout.joined_sheet([one, one]) is None
    assert layout.joined_sheet([one, file("text", "b.csv")]) is None


def test_units_below_the_names_are_added():
    text = "a,b,c,d,e\ns,g,,g\n1,2,3,4,5\n2,2,3,4,5\n"
    found = layout.sheet_in(file(text))
    assert found is not None and found.columns == ["a (s)", "b (g)", "c", "d (g)", "e"]
    assert found.left_out == 0 and len(found.cells) == 5


def test_rows_per_sensor_become_columns():
    lines = ["t,sensor,x,y"]
    for k in range(20):
        lines += [f"{k},acc,{k % 3},1", f"{k},gyro,{k % 5},2"]
    found = layout.sheet_in(file("\n".join(lines), "s.csv"))
    assert found is None or "t" in found.columns
    sheet = Sheet("s", ["t", "kind", "x"], [np.arange(8.0), np.array(["acc", "gyr"] * 4, dtype=object), np.ones(8)])
    split = layout._by_sensor(sheet)
    assert split.columns == ["t", "acc:x", "gyr:x"]
    assert np.isfinite(split.cells[1]).tolist() == [True, False] * 4
    assert layout._sensor_column(Sheet("s", ["kind"], [np.array(["a", "a", "a", "b"], dtype=object)])) is None
    assert layout._sensor_column(Sheet("s", ["kind"], [np.array(["a", "b"] * 2, dtype=object)])) == 0
    assert layout._sensor_column(Sheet("s", ["kind"], [np.array(["a", "1"] * 5, dtype=object)])) is None
    assert layout._sensor_column(Sheet("s", ["type"], [np.array([1, 4] * 5)])) == 0
    assert layout._sensor_column(Sheet("s", ["x"], [np.array([1, 4] * 5)])) is None


def test_a_time_increases():
    assert layout._increases(np.arange(4.0)) and not layout._increases(np.arange(3.0))
    assert not layout._increases(np.ones(9)) and not layout._increases(np.append(np.arange(9.0), 0.0))


# findings.py


@pytest.mark.parametrize(
    ("name", "stem", "axis"),
    [("accX", "acc", "x"), ("Acc X (g)", "acc", "x"), ("x_acc", "acc", "x"), ("gyro:Y axis", "gyro:", "y")]
    + [("data12", "data", "12"), ("xacc", "acc", "x"), ("accX_mg", "acc", "x")],
)
def test_an_axis_is_split_from_a_name(name, stem, axis):
    assert list(findings._split_axis(name)) == [(stem, axis)]


def test_names_without_an_axis_have_none():
    for name in ("speed", "accuracy", "verticalaccuracy", "x"):
        assert [axis for _, axis in findings._split_axis(name) if axis != "x"] in ([], ["y"])


@pytest.mark.parametrize(
    ("name", "said"),
    [("acc (m/s^2)", "m/s2"), ("acc_mg", "mg"), ("millis", "ms"), ("micros", "us"), ("timeNano", "ns"), ("t_ms", "ms")]
    + [("seconds", "s"), ("s", "s"), ("acc", ""), ("x (left)", ""), ("gyro_counts/131", "counts/131")],
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
    [(1.0, "", "g", True), (1.29, "", "g", True), (1.31, "", "g", False), (1 / 1.31, "", "g", False)]
    + [(9.8, "m/s2", "m/s2", True), (9.8, "g", "m/s2", False), (1000.0, "", "mg", True), (1.2, "g", "g", True)],
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
    [(2.9, True, "rad/s"), (3.1, True, "deg/s"), (999.0, True, "deg/s"), (1001.0, True, "mdeg/s")]
    + [(0.1, False, "deg/s"), (0.1 / 57.3, False, "rad/s"), (100.0, False, "mdeg/s"), (1.75, False, "mrad/s")],
)  # fmt: skip
def test_a_unit_of_rates_by_their_size(most, moving, unit):
    """A sensor at rest has a noise of 0.1 deg/s. In motion the 90th percentile of the rates decides."""
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
    assert found(n=steps, b=steps * 1.5).columns == ["b"]  # n only numbers the rows
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
    """Columns without any number belong to no group. Without names, groups are side by side."""

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
    assert layout._grid_below(["x", "t,b"], ["t"]) is None  # below the last line there are no rows
    wide = layout._grid_below(["t,a,b,c,d", "1,2,3,4", "1,2,3,4"], ["t", "d"])
    assert wide is not None and wide.width == 5


def test_speeds_and_places_are_found_by_name():
    def sheet(*names):
        return Sheet("f", list(names), [np.arange(9.0)] * len(names))

    for name, unit in (("Speed (km/h)", "km/h"), ("speed_kph", "km/h"), ("GPS_velocity_mph", "mph"), ("speed", "")):
        found = findings._speed(sheet("t", name))
        assert found is not None and (found.columns, found.unit, found.certain) == ([name], unit, bool(unit))
    for name in ("speedaccuracy", "angularvelocity", "velocityx", "fast"):
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


def turning(dps=40.0, seconds=20.0, hz=100.0):
    """Gravity turns about x and z, as the rates say: du/dt = u x w."""
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
    """In 2 s it is 60 deg/s. Only the rate across gravity counts."""
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


# the apps


def test_aim_turns_right_and_down():
    text = "AiM CSV File\nTime,LateralAcc,VerticalAcc,InlineAcc,PitchRate,YawRate,RollRate,GPS Speed\n"
    text += "s,g,g,g,deg/s,deg/s,deg/s,mph\n" + "0.00,0.1,-1,0.2,1,2,3,10\n0.01,0.1,-1,0.2,1,2,3,10\n"
    made = aim.read([file(text)], "n")
    assert made.accel.values[0] == pytest.approx([-0.1, 1.0, 0.2])
    assert made.gyro.values[0] == pytest.approx([-1.0, -2.0, 3.0]) and made.vehicle_axes
    assert made.track is not None and made.track.speed_mps[0] == pytest.approx(4.4704)
    up = aim.read([file(text.replace(",-1,", ",1,"))], "n")
    assert up.accel.values[0] == pytest.approx([-0.1, 1.0, 0.2]) and "up" in up.accel.taken[0].sign
    assert aim.find_recordings([file("x" * 200 + text), file(text)]) == [[file(text)]]


def test_own_exports_have_pitch_nose_up():
    names = "t_s,left_g,up_g,forward_g,pitch_rate_dps,yaw_rate_dps,roll_rate_dps,utc_s"
    made = own.read([file(f"{names}\n1,0,1,0,5,6,7,101\n2,0,1,0,5,6,7,102\n")], "n")
    assert made.gyro.values[0].tolist() == [-5.0, 6.0, 7.0] and made.vehicle_axes and made.utc_ns == 100 * 10**9
    with pytest.raises(InputError, match="n contains a lean but no readings"):
        own.read([file("t_s,up_g\n1,2\n2,3\n")], "n")


def test_vbo_has_minutes_and_west_positive():
    head = "File created on 02/01/1970 @ 00:00\n[header]\nvelocity kmh\n[column names]\n"
    names = "time lat long velocity Y_Accel Z_Accel X_Accel PitchRate YawRate RollRate"
    row = "000001.00 +60 -120 36 0.1 1 0.2 1 2 3\n"
    made = vbo.read(
        [file(f"{head}{names}\n[data]\n{row}{row.replace('1.00', '2.00')}".replace("velocity kmh\n", ""))], "n"
    )
    assert made.utc_ns == 86400 * 10**9 and made.vehicle_axes and made.sign_known
    assert made.accel.values[0] == pytest.approx([0.1, 1.0, 0.2]) and made.gyro.values[0] == pytest.approx([-1, -2, 3])
    assert made.track is not None and made.track.speed_mps[0] == pytest.approx(10.0)
    assert (made.track.lat_deg[0], made.track.lon_deg[0]) == pytest.approx((1.0, 2.0))
    assert made.accel.time_ns.tolist() == [10**9, 2 * 10**9]
    assert vbo._speed_unit({"header": ["velocity mph"]}) == "mph" and vbo._speed_unit({}) == "km/h"
    assert vbo._midnight_ns({"": ["31/02/2024"]}) is None


def test_units_of_vbo_belong_to_the_last_columns():
    sheet = Sheet("f", list("abcd"), [np.arange(1.0)] * 4)
    found = vbo._units({"header": ["a", "b", "c", "d", ""], "channel units": ["g", "furlong", ""]}, sheet)
    assert found == {2: "g"}
    assert vbo._units({"channel units": ["m/s^2"]}, sheet) == {3: "m/s2"}


def test_racechrono_has_its_units_below_or_in_brackets():
    lines = ["x", "timestamp,a,b,c,d", "unix time,g,,deg/s,m", "s1,,,,"]
    assert racechrono._units(lines, 1) == ({0: "unix time", 1: "g", 3: "deg/s", 4: "m"}, 2)
    assert racechrono._units(["time,a (G),b", "1,2,3", "4,5,6"], 0) == ({1: "G"}, 0)
    assert racechrono._is_speed("speed (m/s)") and racechrono._is_speed("speed")
    assert not racechrono._is_speed("speed (km/h)") and not racechrono._is_speed("speeds")
    assert not racechrono._is_header("a,b,c,d,e") and not racechrono._is_header("timestamp,a,b,c")


def test_racebox_finds_its_line_of_names():
    text = "Lap,1\n\nTime,GForceX,GForceY,GForceZ,GyroX,GyroY,GyroZ,KPH\n"
    assert racebox._header(file(text)) == 2 and racebox._header(file("a\n")) is None
    made = racebox.read([file(text + "0,1,2,3,4,5,6,36\n" + "10,1,2,3,4,5,6,36\n")], "n")
    assert made.accel.values[0].tolist() == [2.0, 3.0, 1.0] and made.gyro.values[0].tolist() == [5.0, 6.0, 4.0]
    assert made.track is not None and made.track.speed_mps[0] == pytest.approx(10.0)


def test_sensor_logger_knows_its_platform():
    def platform(text, **more):
        return sensor_logger._platform({"metadata": file(text), **more} if text else more)

    assert platform("platform,standardisation\niOS,false\n") == (True, False)
    assert platform("platform,standardisation\nios,true\n") == (True, True)
    assert platform("platform\nandroid\n") == (False, False)
    assert platform("") == (None, False) and platform("", totalacceleration=1) in ((False, False), (None, False))


def test_sensorlogs_repeated_samples_have_no_time():
    names = ["loggingTime", "accelerometerTimestamp_sinceReboot"]
    sheet = Sheet("f", names, [np.array([100.0, 100.1, 100.2]), np.array([5.0, 5.0, 5.1])])
    assert sensorlog._clock(sheet, "accelerometer").tolist() == [5000 * MS, units.REPEATED, 5100 * MS]


def test_phyphox_adds_its_pauses():
    text = '"event","experiment time","system time"\nSTART,0.0,1700000000.0\nPAUSE,5.0,1700000005.0\n'
    text += "START,5.0,1700000008.0\n"
    pauses = phyphox._Pauses([file(text, "meta/time.csv")])
    assert pauses.utc_ns == 1_700_000_000 * 10**9
    assert pauses.after(np.array([0, 4999, 5000, 6000]) * MS).tolist() == [0, 4999 * MS, 8000 * MS, 9000 * MS]
    assert phyphox._Pauses([]).utc_ns is None
    assert [phyphox._kind(what) for what in ("gravity", "linear a", "a (without g)", "a")] == [
        "gravity", "user", "user", "total",
    ]  # fmt: skip


def test_a_module_of_apps_claims_its_files_once():
    log = file("t_s,ax_g,ay_g,az_g,gx_dps,gy_dps,gz_dps\n0,0,1,0,0,0,0\n")
    assert [app.NAME for app, _ in importing.recordings([log, file("a,b\n1,2\n")])] == ["Kickstand"]
    assert SimpleNamespace(names=importing.NAMES).names[0] == "phyphox"
