"""A log in memory and its blocks: times, the order of columns, and arrays of wrong shapes."""

import io
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from kickstand_tools.calibration.file import calibration_path
from kickstand_tools.common.errors import InputError
from kickstand_tools.logs import reader
from kickstand_tools.logs.log import Log
from kickstand_tools.logs.reader import is_log, read_blocks, read_log, read_twice
from kickstand_tools.logs.source import log_stem, name_of, total_bytes
from support import command

FORCE, RATE = [0.1, 0.2, 0.9], [1.0, 2.0, 3.0]


def log_of(n: int, start_s: float = 0.0, **more: Any) -> Log:
    return Log(start_s + np.arange(n) / 100.0, np.tile(FORCE, (n, 1)), np.tile(RATE, (n, 1)), **more)


def test_times_count_from_the_first_sample():
    log = log_of(3, 1_700_000_000.25)
    assert log.t_s == pytest.approx([0.0, 0.01, 0.02], abs=1e-6)
    assert log.start_s == 1_700_000_000.25
    assert log.time_us.tolist() == [0, 10_000, 20_000]
    again = log_of(3, 5.0)
    again = Log(again.t_s, again.accel_g, again.gyro_dps, start_s=again.start_s)
    assert again.start_s == 5.0
    assert Log(np.array([2.0, 3.0]), log.accel_g[:2], log.gyro_dps[:2], start_s=10.0).start_s == 12.0


def test_the_chips_order_and_the_names_of_the_columns():
    track: Any = {"lat_deg": [52.1, np.nan], "lon_deg": [-0.5, np.nan], "utc_s": [1.7e9, np.nan]}
    log = log_of(2, temperature_c=[20.0, 21.0], speed_mps=[5.0, np.nan], **track)
    assert log.readings[1].tolist() == [0.1, 0.2, 0.9, 21.0, 1.0, 2.0, 3.0]
    names = [*command.HEADER.split(","), "speed_mps", "lat_deg", "lon_deg", "utc_s", "temp_c"]
    first = {name: values[0] for name, values in log.columns().items()}
    assert first == dict(zip(names, [0.0, *FORCE, *RATE, 5.0, 52.1, -0.5, 1.7e9, 20.0], strict=True))
    again = Log.from_readings(log.readings, 50.0, "mine")
    assert again.t_s.tolist() == [0.0, 0.02]
    assert again.name == "mine"
    assert again.readings.tolist() == log.readings.tolist()
    assert np.isnan(again.speed_mps).all()
    assert np.isnan(log_of(2).temperature_c).all()


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({"t_s": [[0.0], [1.0]]}, r"t_s has the shape \(2, 1\), it must be \(2,\)"),
        ({"accel_g": [[0.0, 1.0]] * 2}, r"accel_g has the shape \(2, 2\), it must be \(2, 3\)"),
        ({"gyro_dps": [RATE]}, r"gyro_dps has the shape \(1, 3\), it must be \(2, 3\)"),
        ({"lat_deg": [1.0]}, r"lat_deg has the shape \(1,\), it must be \(2,\)"),
        ({"speed_mps": [1.0]}, r"speed_mps has the shape \(1,\), it must be \(2,\)"),
        ({"t_s": [0.0, 0.0]}, "must increase"),
        ({"t_s": [1.0, 0.5]}, "must increase"),
        ({"t_s": [0.0, 4e-7]}, "must increase"),  # both times round to the same microsecond
    ],
)
def test_arrays_that_do_not_fit_are_refused(changed, words):
    with pytest.raises(InputError, match="the log: .*" + words):
        Log(**({"t_s": [0.0, 1.0], "accel_g": [FORCE] * 2, "gyro_dps": [RATE] * 2} | changed))


def test_a_log_in_memory_comes_in_blocks(monkeypatch):
    monkeypatch.setattr(reader, "BLOCK_SAMPLES", 4)
    done = []
    log = log_of(10, 7.0, speed_mps=[5.0, *[np.nan] * 9])
    blocks = list(read_blocks(log, progress=lambda *both: done.append(both)))
    assert done == [(4, 10), (8, 10), (10, 10)]
    assert [len(block.time_us) for block in blocks] == [4, 4, 2]
    assert np.concatenate([block.time_us for block in blocks]).tolist() == log.time_us.tolist()
    assert not any(block.has_temp for block in blocks)
    assert np.concatenate([block.speed_mps for block in blocks])[0] == 5.0
    assert [block.start_s for block in blocks] == [7.0] * 3
    assert blocks[1].time_text == ["7.040000", "7.050000", "7.060000", "7.070000"]
    assert blocks[1].t_s == pytest.approx([0.04, 0.05, 0.06, 0.07])


def text_of(n: int, header: str = command.HEADER, row: str = "{t:.2f},0.1,0.2,0.9,1,2,3") -> str:
    return "\n".join([header, *[row.format(t=k / 100) for k in range(n)]]) + "\n"


def test_time_may_be_in_any_column():
    text = text_of(3, "note,ax_g,ay_g,az_g,gx_dps,gy_dps,gz_dps,t_s", '"a, b",0.1,0.2,0.9,1,2,3, {t:.3f} ')
    (block,) = read_blocks(io.StringIO(text))
    assert block.time_text == ["0.000", "0.010", "0.020"]
    assert block.time_us.tolist() == [0, 10_000, 20_000]


def test_optional_columns_may_be_empty_anywhere():
    header = "t_s,ax_g,ay_g,az_g,gx_dps,gy_dps,gz_dps,speed_mps,temp_c"
    text = header + "\n0,0,1,0,0,0,0,,\n1,0,1,0,0,0,0,5,\n2,0,1,0,0,0,0,,20.5\n3,0,1,0,0,0,0,6,21\n"
    log = read_log(io.BytesIO(text.encode()))
    assert log.speed_mps == pytest.approx([np.nan, 5.0, np.nan, 6.0], nan_ok=True)
    assert log.temperature_c == pytest.approx([np.nan, np.nan, 20.5, 21.0], nan_ok=True)


def test_minimum_number_of_samples_is_required():
    assert len(read_log(log_of(300), 300).t_s) == 300
    with pytest.raises(InputError, match="the log is too short: 299 samples, at least 300 are needed"):
        read_log(log_of(299), 300)


def test_an_open_file_is_read_once_and_kept():
    source = io.StringIO(text_of(5))
    kept = read_twice(source)
    assert isinstance(kept, Log)
    assert len(kept.t_s) == 5
    assert read_twice(kept) is kept
    assert read_twice("log.csv") == "log.csv"


def test_sources_have_the_expected_names():
    assert log_stem("rides/monday.csv.gz") == "monday"
    for name in ("monday.csv", "monday", "monday.zip", "monday.VBO", "monday.txt.gz", "monday.parquet"):
        assert log_stem(name) == "monday", name
    assert name_of(io.StringIO()) == "the log"
    assert name_of(log_of(2, name="mine")) == "mine"
    assert total_bytes(io.StringIO("abc")) == total_bytes("there is none") == 0


def test_stem_of_the_current_folder_is_its_name(tmp_path, monkeypatch):
    (tmp_path / "EXPORT" / "in").mkdir(parents=True)
    monkeypatch.chdir(tmp_path / "EXPORT" / "in")
    assert log_stem(".") == "in" and log_stem("..") == "EXPORT"
    assert calibration_path(Path(".")) == tmp_path / "EXPORT" / "in.cal.json"
    assert calibration_path(Path("..")) == tmp_path / "EXPORT.cal.json"
    assert calibration_path(Path("RIDE.csv")) == Path("RIDE.cal.json")


def test_long_line_is_refused_quickly(tmp_path):
    """The line has 1 MB. A reader that searches its end again after each byte would take minutes."""
    (tmp_path / "long.csv").write_text("[" + "0.12345," * 125_000)
    begin_s = time.process_time()
    assert not is_log(tmp_path / "long.csv")
    assert time.process_time() - begin_s < 1.0


@pytest.mark.parametrize(("blank", "rows"), [("\n", 2), ("\n" * 2_000_000, 2), ("\n", 0), ("\n" * 2_000_000, 0)])
def test_blank_lines_below_the_header_are_skipped(tmp_path, blank, rows):
    """The blank lines may fill more than one block."""
    header, *given = text_of(2).splitlines(keepends=True)
    (tmp_path / "log.csv").write_text(header + blank + "".join(given[:rows]))
    assert is_log(tmp_path / "log.csv") == (rows > 0)
