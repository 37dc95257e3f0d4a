"""Decoding of files, units, times and columns, with values computed by hand."""

from pathlib import Path

import numpy as np
import pytest
from kickstand_tools.common.errors import InputError
from kickstand_tools.imports import files, recording, units
from kickstand_tools.imports.files import RecordingFile
from kickstand_tools.imports.recording import ReceiverTrack, RecordedSensor, Sheet

MS = 1_000_000


G = 9.80665


def file(text: str, name: str = "a.csv") -> RecordingFile:
    return RecordingFile(name, text.encode(), text)


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


def test_files_together_have_a_largest_size(monkeypatch):
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
    [
        ("m/s^2", "m/s2"),
        ("M/S²", "m/s2"),
        ("m s-2", "m/s2"),
        ("m*s^-2", "m/s2"),
        ("°/s", "deg/s"),
        ("kph", "km/h"),
        ("µs", "us"),
        ("furlong", "furlong"),
        (" G ", "g"),
    ],
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
    [
        (0.0, 0.02, "s"),
        (0.0, 0.89, "s"),
        (0.0, 0.91, "ms"),
        (0.0, 599.0, "ms"),
        (0.0, 601.0, "us"),
        (0.0, 599e3, "us"),
        (0.0, 601e3, "ns"),
        (1.7e9, 0.01, "s"),
        (1.7e9, 99.0, "s"),
        (1.7e9, 101.0, "ms"),
        (1.7e12, 10.0, "ms"),
        (1.7e15, 10e3, "us"),
        (1.7e18, 1e7, "ns"),
        (0.9e8, 10.0, "ms"),
        (1.1e10, 10e3, "us"),
    ],
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
    # The names' common beginning has 5 letters, which is too short
    assert sheet.named([3, 4, 5]) == "f: accelX, accelY, accelZ"
    assert sheet.named([0, 1]) == "f: gyroscopeX, gyroscopeY"


def test_a_rate_leaves_gaps_and_marks_out():
    time_ns = np.array([0, 10, 20, 30, 40, 90, 100, 110]) * MS
    assert recording.rate_hz(time_ns) == pytest.approx(100.0)  # the gap of 5 steps does not count
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
