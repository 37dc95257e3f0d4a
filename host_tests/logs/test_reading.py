"""Logs from files: equal in any format and block size. Mistakes are refused with their line, limits with their unit."""

import contextlib
import gzip
import io

import numpy as np
import pytest
from kickstand_tools.api import Log
from kickstand_tools.checks.log import check_log
from kickstand_tools.common.messages import InputError
from kickstand_tools.logs.reader import is_log, read_log, text_rows, time_texts
from kickstand_tools.logs.source import chunks, open_input
from psutil import Process
from support import command

NAMES = command.HEADER
GOOD = [f"{k / 100:.2f},0.01,-0.02,1.01,0.5,-0.5,0.1{k % 7}" for k in range(20)]


def text(*rows, header=NAMES):
    return ("\n".join([header, *rows]) + "\n").encode()


def with_row(row):
    return text(*GOOD[:3], row)


BAD = {
    "empty.csv": (b"", "is empty"),
    "blank.csv": (b" \n\n", "is empty"),
    "header only.csv": (text(), "too short"),
    "one sample.csv": (text(GOOD[0]), "too short: 1 samples"),
    "no header.csv": (b"\n".join(g.encode() for g in GOOD), "line 1: no column t_s"),
    "no gz.csv": (text(*GOOD, header=NAMES.replace(",gz_dps", "")), "line 1: no column gz_dps, and a log starts with"),
    "column twice.csv": (text(*GOOD, header=NAMES + ",ax_g"), "line 1: column ax_g exists twice"),
    "temp twice.csv": (text(*GOOD, header=NAMES + ",temp_c,temp_c"), "column temp_c exists twice"),
    "word.csv": (with_row("0.03,0,0,one,0,0,0"), "line 5: az_g is 'one', not a number"),
    "long word.csv": (with_row("0.03,0,0,a word of 24 letters here,0,0,0"), "'a word of 24 letters...', not a number"),
    "underscore.csv": (with_row("0.03,0,0,1_0,0,0,0"), "line 5: az_g is '1_0', not a number"),
    "empty cell.csv": (with_row("0.03,0,,1,0,0,0"), "line 5: ay_g is empty"),
    "nan.csv": (with_row("0.03,0,nan,1,0,0,0"), "line 5: ay_g is 'nan': a number is needed"),
    "inf.csv": (with_row("0.03,0,0,1,0,-inf,0"), "line 5: gy_dps is '-inf'"),
    "huge.csv": (with_row("0.03,0,0,1,0,1e999,0"), "line 5: gy_dps is '1e999'"),
    "counts.csv": (with_row("0.03,0,0,16384,0,0,0"), "line 5: az_g is '16384', past any reading: its unit is g"),
    "time nan.csv": (with_row("nan,0,0,1,0,0,0"), "line 5: t_s is 'nan'"),
    "time stands.csv": (text(*["7.0" + g[4:] for g in GOOD]), "the time is the same in all samples"),
    "time goes back.csv": (with_row(GOOD[0]), "line 5: time goes back from 0.020000 at 0.00 s"),
    "short row.csv": (text(*GOOD[:3], "0.03,0,0", GOOD[4]), "line 5: 3 values under 7 column names"),
    "long row.csv": (with_row(GOOD[3] + ",1"), "line 5: 8 values under 7 column names"),
    "speed word.csv": (text(GOOD[0] + ",fast", header=NAMES + ",speed_mps"), "line 2: speed_mps is 'fast'"),
    "semicolons.csv": (text(GOOD[0]).replace(b",", b";"), "line 1: values are separated by ; or tab"),
    "tabs.csv": (text(GOOD[0]).replace(b",", b"\t"), "save it with commas"),
    "open quote.csv": (text(*GOOD[:3], '0.03,"0,0,1,0,0,0', *GOOD[4:]), "column names: is the line cut?"),
    "long line.csv": (text("1," * 50_001), "line 2: not CSV (a line of over 100000 characters)"),
    "long first line.csv": (b"x" * 100_001, "line 1: not CSV (a line of over 100000 characters)"),
    "lean.csv": (b"t_s,lean_deg\n0,1\n", "contains a lean but no readings: give the log that it was made from"),
    "track.gpx": (b"<?xml version", "track.gpx is a track: kickstand join adds it to a ride"),
    "track.FIT": (b"x", "track.FIT is a track"),
    "RIDE.cal.json": (b"{", "is not a log: give the ride, and a calibration with --calibration"),
    "binary.csv": (bytes(range(256)), "line 2: not text"),
    "zeros.csv": (bytes(100), "is empty"),
    "utf-16.csv": (text(*GOOD).decode().encode("utf-16"), "line 1: not text"),
    "zip.csv": (b"PK\x03\x04\xff", "zip.csv is a zip: if an app has exported it, kickstand import makes a log"),
    "gzip without its name.csv": (gzip.compress(text(*GOOD)), "not text"),
    "not gzip.csv.gz": (text(*GOOD), "is not a gzip file"),
    "nothing inside.csv.gz": (gzip.compress(b""), "is empty"),
    "cut.csv.gz": (gzip.compress(text(*GOOD))[:12], "cut short"),
    "changed.csv.gz": (gzip.compress(text(*GOOD))[:-8] + bytes(8), "is damaged: copy it again"),
    "damaged.csv.gz": (gzip.compress(text(*GOOD))[:20] + b"\xff" * 60, "damaged"),
    "binary inside.csv.gz": (gzip.compress(bytes(range(256))), "not text"),
}


@pytest.mark.parametrize("name", BAD)
def test_a_bad_log_is_refused_and_closed(tmp_path, name):
    content, words = BAD[name]
    (tmp_path / name).write_bytes(content)
    with pytest.raises(InputError) as refusal:
        read_log(tmp_path / name)
    assert words in str(refusal.value) and name in str(refusal.value)
    assert all(file.path != str(tmp_path / name) for file in Process().open_files())


@pytest.mark.parametrize("name", ["nan.csv", "cut.csv.gz", "line\nbreak.csv"])
def test_a_command_refuses_a_bad_log_in_one_line(tmp_path, name):
    (tmp_path / name).write_bytes(BAD.get(name, (b"",))[0])
    cal = command.write_cal(tmp_path / "CAL.json")
    (tmp_path / "LEAN.csv").write_text("the one from yesterday\n")
    line = command.refused(tmp_path, "replay", tmp_path / name, "--calibration", cal, "--out", tmp_path / "LEAN.csv")
    assert name.replace("\n", " ") in line


def test_directories_and_missing_files_are_refused(tmp_path):
    for path, words in ((tmp_path, "is a directory: give the name of a log in it"), (tmp_path / "x", "no such file")):
        with pytest.raises(InputError, match=words):
            read_log(path)
    (tmp_path / "a").write_bytes(b"abc")
    with open_input(tmp_path / "a") as file:
        following = file.fileno()
        assert file.read() == b"abc"
    with pytest.raises(InputError):
        open_input(tmp_path)
    with open_input(tmp_path / "a") as file:
        assert file.fileno() == following, "a refused directory stayed open"


PLAIN = text(*GOOD)
SAME = {
    "byte order mark.csv": b"\xef\xbb\xbf" + PLAIN,
    "CRLF.csv": PLAIN.replace(b"\n", b"\r\n"),
    "CR.csv": PLAIN.replace(b"\n", b"\r"),
    "no last newline.csv": PLAIN[:-1],
    "blank lines.csv": PLAIN.replace(b"\n", b"\n\n", 1) + b"\n \n",
    "spaces.csv": PLAIN.replace(b",", b" , "),
    "packed.csv.gz": gzip.compress(PLAIN),
    "quoted.csv": text(*[g + ',"a, ""b"""' for g in GOOD], header=NAMES + ",note"),
    "exponents.csv": PLAIN.replace(b"1.01", b"101e-2"),
    "optional columns.csv": text(*[g + ",,12.5" for g in GOOD], header=NAMES + ",temp_c,speed_mps"),
    "other columns twice.csv": text(*[g + ",hello,1" for g in GOOD], header=NAMES + ",note,note"),
    "another order.csv": text(
        *[",".join(reversed(g.split(","))) for g in GOOD], header=",".join(reversed(NAMES.split(",")))
    ),
}


@pytest.mark.parametrize("name", SAME)
def test_a_log_in_another_format_is_the_same(tmp_path, name):
    (tmp_path / name).write_bytes(SAME[name])
    log, plain = read_log(tmp_path / name), read_log(io.BytesIO(PLAIN))
    assert (
        np.array_equal(log.readings, plain.readings, equal_nan=True) and log.time_us.tolist() == plain.time_us.tolist()
    )
    assert is_log(tmp_path / name)


LIMITS = {
    "t_s": (1e10, "seconds"), "ax_g": (20.0, "g"), "az_g": (20.0, "g"), "gx_dps": (2500.0, "deg/s"),
    "gz_dps": (2500.0, "deg/s"), "speed_mps": (200.0, "m/s"), "temp_c": (200.0, "degrees Celsius"),
    "lat_deg": (90.0, "degrees"), "lon_deg": (180.0, "degrees"), "utc_s": (1e10, "seconds since 1970"),
}  # fmt: skip
MORE = ",speed_mps,temp_c,lat_deg,lon_deg,utc_s"


@pytest.mark.parametrize("quoted", [False, True])  # one reader reads whole columns, the other reads single cells
@pytest.mark.parametrize("name", LIMITS)
def test_values_beyond_any_reading_are_refused(text_log, name, quoted):
    """The widest ranges of the chips are 16 g and 2000 deg/s, so larger values are in another unit."""
    limit, unit = LIMITS[name]
    for factor in (1.0, 1.001, -1.0, -1.001):
        rows = []
        for time in range(5):
            values = dict.fromkeys((NAMES + MORE).split(","), "0") | {"t_s": f"{time}", "az_g": "1"}
            rows.append(",".join((values | {name: f"{factor * limit:.10g}"} if time == 4 else values).values()))
        rows[0] = rows[0].replace("0", '"0"', quoted)
        words = f"line 6: {name} is '.*', past any reading: its unit is {unit}$" if abs(factor) > 1.0 else None
        if name == "t_s":  # a larger step is in milliseconds, which another check refuses
            words = words if factor > 1.0 else "milliseconds" if factor == 1.0 else "line 6: t"
        with pytest.raises(InputError, match=words) if words else contextlib.nullcontext():
            log = read_log(text_log(*rows, more=MORE))
            check_log(log, axes=False)
            assert len(log.t_s) == 5


@pytest.mark.parametrize(
    ("size_g", "step_s", "words"),
    [(9.81, 0.01, "look like m/s2"), (1.0, 10.0, "is t_s in milliseconds"), (4.5, 0.01, ""), (1.0, 2.0, "")],
)
def test_common_wrong_units_are_refused(size_g, step_s, words):
    """The check uses the usual size of the force, not single axes."""
    force = np.tile([size_g * 0.6, 0.0, size_g * 0.8], (9, 1))
    force[:4] = [0.0, 1.0, 0.0]
    log = Log(np.arange(9) * step_s, force, np.zeros((9, 3)))
    with pytest.raises(InputError, match=words) if words else contextlib.nullcontext():
        check_log(log)


def test_optional_columns_may_be_empty_anywhere(text_log):
    rows = ["5,0,1,0,0,0,0,,", "6,0,1,0,0,0,0,5,", "7,0,1,0,0,0,0,,20.5", "8,0,1,0,0,0,0,6,21"]
    log = read_log(text_log(*rows, more=",speed_mps,temp_c"))
    assert log.speed_mps == pytest.approx([np.nan, 5.0, np.nan, 6.0], nan_ok=True)
    assert log.temperature_c == pytest.approx([np.nan, np.nan, 20.5, 21.0], nan_ok=True)
    assert (log.start_s, log.t_s.tolist()) == (5.0, [0.0, 1.0, 2.0, 3.0])


def row_texts(count: int, start: int = 0) -> list[str]:
    return [
        f"{k / 200:.3f},{np.sin(k):.6f},-0.5,1e0,{k % 7}.25,-3,.5,{20 + k % 3},{f'{k % 40}.5' if k % 200 == 0 else ''}"
        for k in range(start, start + count)
    ]


HEADER = NAMES + ",temp_c,speed_mps"


@pytest.mark.parametrize("name", ["ride.csv", "ride.csv.gz"])
@pytest.mark.parametrize("size", [200, 5000])
def test_the_size_of_the_chunks_changes_nothing(tmp_path, small_chunks, name, size):
    path = tmp_path / name
    content = text(*row_texts(1500), header=HEADER)
    path.write_bytes(gzip.compress(content) if path.suffix == ".gz" else content)
    log, progress, length = read_log(path), [], path.stat().st_size
    small_chunks(size)
    small = read_log(str(path), progress=lambda *done: progress.append(done))
    assert progress == sorted(progress) and progress[-1] == (length, length) and len(progress) >= 10
    for column, values in log.columns().items():
        assert np.array_equal(small.columns()[column], values, equal_nan=True), column
    assert [line for _, lines in text_rows(path) for line in lines] == row_texts(1500)
    assert list(time_texts(path, small)) == [row.partition(",")[0] for row in row_texts(1500)]
    assert np.flatnonzero(np.isfinite(log.speed_mps)).tolist() == list(range(0, 1500, 200))


def test_16_mb_without_the_end_of_a_line_are_no_log():
    assert len(list(chunks(io.BytesIO(bytes(24_000_000)), 8_000_000))) == 1
    with pytest.raises(InputError, match="the log: 16 MB without the end of a line"):
        list(chunks(io.BytesIO(bytes(24_000_001)), 8_000_000))


@pytest.mark.parametrize(("blank", "count"), [("\n", 2), ("\n" * 2_000_000, 2), ("\n", 0), ("\n" * 2_000_000, 0)])
def test_a_file_is_a_log_by_its_first_lines(tmp_path, blank, count):
    """Blank lines may fill more than one block. A long line without a header is refused quickly."""
    (tmp_path / "log.csv").write_text(NAMES + "\n" + blank + "\n".join(GOOD[:count]))
    assert is_log(tmp_path / "log.csv") == (count > 0)
    (tmp_path / "long.csv").write_text("[" + "0.12345," * 125_000)
    assert not is_log(tmp_path / "long.csv")
