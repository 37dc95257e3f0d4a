"""What a reader checks and reports, the sizes that it allows, and which readings are frozen."""

import gzip
import io
import sys
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from kickstand_tools.common.errors import InputError
from kickstand_tools.logs import cells, csv_reader, frozen, reader, source
from kickstand_tools.logs.csv_lines import write_lean, write_log
from kickstand_tools.logs.log import Log, Stretch, float_schema
from test_reader_limits import NAMES, coarse, marks, text_log


def log_of(n=4, **more: Any) -> Log:
    return Log(np.arange(n) / 10.0, np.tile([0.0, 1.0, 0.0], (n, 1)), np.arange(3.0 * n).reshape(n, 3), **more)


class Checked:
    """Replaces the checks of a log. Each block is added to `blocks`, and each question to `asked`."""

    def __init__(self, name=""):
        self.blocks, self.asked, Checked.last = [], [], self

    def add(self, block):
        self.blocks.append(block)

    def remarks(self, axes, calibration):
        self.asked.append((axes, calibration))
        return ["checks"]


def marking(name, *marked):
    """Return a class that replaces a search for bad readings."""

    class Finder:
        def mark(self, time_us, readings):
            return np.isin(time_us // 100_000, marked)

        def notices(self):
            return [name]

    return Finder


@pytest.fixture
def checks(monkeypatch):
    monkeypatch.setattr(reader, "Checks", Checked)
    monkeypatch.setattr(reader, "FrozenFinder", marking("frozen", 1))
    monkeypatch.setattr(reader, "SensorHealth", marking("health", 2))
    monkeypatch.setattr(reader, "check_units", lambda name, time_us, force: units.append((name, time_us.tolist())))
    units: list = []
    return units


def test_a_reader_collects_all_remarks_at_the_end(checks, monkeypatch):
    monkeypatch.setattr(reader, "BLOCK_SAMPLES", 3)
    notices: Any = []
    blocks = list(reader.read_blocks(log_of(name="x"), notices=notices))
    assert [block.frozen.tolist() for block in blocks] == [[False, True, True], [False]]
    assert [block.time_us.tolist() for block in Checked.last.blocks] == [[0], [300_000]]  # bad readings are not checked
    assert checks == [("x", [0, 100_000, 200_000])]  # the units show in the first block
    assert notices == ["frozen", "health", "checks"] and Checked.last.asked == [(True, None)]


@pytest.mark.parametrize(
    ("how", "axes"), [({}, False), ({"notices": []}, True), ({"notices": [], "axes": False}, False)]
)
def test_axes_are_checked_if_somebody_reads_the_notices(checks, how, axes):
    calibration: Any = object()
    list(reader.read_blocks(log_of(), calibration=calibration, **how))
    assert Checked.last.asked == [(axes, calibration)]


@pytest.mark.parametrize(("how", "axes"), [({}, True), ({"axes": False}, False)])
def test_a_whole_log_has_the_notices_of_its_blocks(checks, how, axes):
    log = reader.read_log(log_of(), **how)
    assert log.notices == ["frozen", "health", "checks"] and Checked.last.asked == [(axes, None)]


def test_two_samples_are_needed_unless_less_is_asked():
    with pytest.raises(InputError, match="too short: 1 samples, at least 2"):
        list(reader.read_blocks(log_of(1)))
    assert len(list(reader.read_blocks(log_of(1), 1))) == 1


def test_a_log_has_at_most_ten_million_samples(monkeypatch):
    count = 10_000_000
    block = SimpleNamespace(time_us=range(count), readings=np.zeros((1, 7)), lines=[])
    monkeypatch.setattr(reader, "_unchecked", lambda *_: iter([block]))
    monkeypatch.setattr(reader, "check_units", lambda *_: None)
    with pytest.raises(AttributeError, match="range"):  # the search for frozen readings needs an array
        next(reader.read_blocks("a.csv"))
    block.time_us = range(count + 1)
    with pytest.raises(InputError, match=r"^a\.csv has over 10 million samples: kickstand cut writes a part of it"):
        next(reader.read_blocks("a.csv"))


@pytest.mark.parametrize("ends", [(None, None), (0.0, 1.0), (0.5, None), (None, 0.0)])
def test_a_log_is_not_read_to_count_from_its_start(ends):
    stretch = Stretch("none.csv", *ends)
    assert reader._from_beginning(stretch) is stretch


def test_an_open_file_is_read_for_a_second_reading():
    for given in (text_log("0,0,1,0,0,0,0\n1,0,1,0,0,0,1\n"), Stretch(text_log("0,0,1,0,0,0,0\n1,0,1,0,0,0,1\n"), 0.5)):
        again = reader.read_twice(given)
        whole = again.source if isinstance(again, Stretch) else again
        assert isinstance(whole, Log) and len(whole.t_s) == 2
        assert not isinstance(again, Stretch) or again.from_s == 0.5
    assert reader.read_twice("a.csv") == "a.csv"


def test_text_that_is_not_utf8_is_named_by_its_line():
    with pytest.raises(InputError, match="the log, line 3: not text"):
        reader.read_log(io.BytesIO(NAMES.encode() + b"\n0,0,1,0,0,0,0\n1,0,1,0,0,0,\xff\n2,0,1,0,0,0,0\n"))


@pytest.mark.parametrize(
    ("end", "cut"),
    [(b'4,"5', False), (b"4,x.25", True), (b"4,x.25\n", False), (b"\xff,5.25", True), (b"4,5.256", False)],
)
def test_a_last_line_that_cannot_be_read_is_cut(end, cut):
    """A line with a line end is complete, so its mistake is reported. A quotation mark may contain line ends."""
    found = reader._without_cut_line(b"3,5.00\n" + end, ["t_s", "temp_c"], {"t_s": 0, "temp_c": 1})
    assert found == ((b"3,5.00\n", end) if cut else (b"3,5.00\n" + end, b""))


def test_a_first_line_may_be_too_long():
    with pytest.raises(InputError, match=r"^a, line 1: not CSV \(a line of over 100000 characters\): is it a log\?"):
        cells.header("a", "x" * 100_001)


def test_no_rows_are_an_empty_table():
    found = cells.read("a", "\n\n", 2, {"t_s": 0, "temp_c": 1}, 10, None)
    assert found.shape == (0, 2)


@pytest.mark.parametrize(
    ("name", "most", "words"),
    [("MOST_CELLS", 1, "over 0 million cells, or 3 million of text"), ("MOST_TEXTS", 1, "over 30 million cells, or 0")],
)
def test_a_table_has_30_million_cells_and_3_million_texts(monkeypatch, name, most, words):
    monkeypatch.setattr(csv_reader, "ROWS", 2)
    monkeypatch.setattr(csv_reader, name, most)
    with pytest.raises(InputError, match=words):
        csv_reader.columns_of([["x"]] * 9, 1)


def test_numbers_of_a_column_stay_as_they_are():
    whole = np.array([1, 2])
    assert csv_reader.numbers_of(whole) is whole
    assert csv_reader.numbers_of(np.array(["1", "2.5", "x"], dtype=object))[:2].tolist() == [1.0, 2.5]
    assert list(csv_reader._lines("\na\n\n b\n")) == ["a", "b"]


def test_16_million_bytes_without_the_end_of_a_line_are_no_log():
    """The limit is checked when a chunk of 8 million bytes is full."""
    assert len(list(source.chunks(io.BytesIO(bytes(24_000_000)), 8_000_000))) == 1
    with pytest.raises(InputError, match="the log: 16 MB without the end of a line"):
        list(source.chunks(io.BytesIO(bytes(24_000_001)), 8_000_000))


@pytest.mark.parametrize("size", [1000, 10**6])
def test_progress_counts_the_bytes_of_the_packed_file(tmp_path, size):
    text = b"".join(b"%d\n" % k for k in range(9000))
    packed = gzip.compress(text)
    (tmp_path / "a.csv.gz").write_bytes(packed)
    (tmp_path / "a.csv").write_bytes(text)
    for name, length in (("a.csv.gz", len(packed)), ("a.csv", len(text))):
        found = list(source.chunks(tmp_path / name, size))
        assert b"".join(part for part, _ in found) == text
        assert found[-1][1] == length == source.total_bytes(tmp_path / name)
        assert [read for _, read in found] == sorted(read for _, read in found)


def test_a_gzip_file_with_a_wrong_check_sum_is_damaged(tmp_path):
    packed = bytearray(gzip.compress(b"t_s\n1\n"))
    packed[-8] ^= 1
    (tmp_path / "a.csv.gz").write_bytes(packed)
    with pytest.raises(InputError, match=r"a\.csv\.gz is damaged: copy it again"):
        list(source.chunks(tmp_path / "a.csv.gz", 9))


def test_a_log_may_begin_at_any_time(monkeypatch):
    log = Log(np.array([1.0, 2.0]), np.tile([0.0, 1.0, 0.0], (2, 1)), np.zeros((2, 3)))
    assert log.t_s.tolist() == [0.0, 1.0] and log.start_s == 1.0
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(InputError, match=r"^data frames need pandas: .*\[rides\]"):
        log.to_pandas()


def test_only_fine_columns_have_64_bits():
    schema = float_schema({"t_s": "s", "up_g": "g"}, ("t_s",), {"made_by": "x"})
    assert [(field.name, str(field.type), field.metadata) for field in schema] == [
        ("t_s", "double", {b"unit": b"s"}),
        ("up_g", "float", {b"unit": b"g"}),
    ]
    assert schema.metadata == {b"made_by": b"x"}


def test_a_written_log_has_seven_decimals_of_a_degree(tmp_path):
    log = log_of(2, lat_deg=[52.123456789, np.nan], lon_deg=[-0.123456789, np.nan], utc_s=[1.79e9 + 0.12345, np.nan])
    write_log(tmp_path / "a.csv", log)
    names, first, second = (tmp_path / "a.csv").read_text().splitlines()
    assert names == NAMES + ",lat_deg,lon_deg,utc_s"
    assert first.endswith(",52.1234568,-0.1234568,1790000000.123") and second.endswith(",5.000000,,,")


def test_a_lean_has_the_times_of_the_log(tmp_path):
    text = text_log("0.50,0,1,0,0,0,0\n1.0,0,1,0,0,0,1\n1.50,0,1,0,0,0,2\n")
    rows = [(block, np.array([[1.25, 2.0], [0.0, -3.0], [np.nan, 4.0]])) for block in reader.read_blocks(text)]
    assert write_lean(tmp_path / "a.csv", ["lean_deg", "x"], [1, 0], rows) == 3
    assert (tmp_path / "a.csv").read_text() == "t_s,lean_deg,x\n0.50,1.2,2\n1.0,0.0,-3\n1.50,nan,4\n"


# frozen.py


def test_a_freeze_after_a_shorter_repetition_is_found():
    readings = coarse(0.0001, 0.001)
    readings[21] = readings[20]
    assert np.flatnonzero(marks(readings)[0]).tolist() == list(range(101, 180))


@pytest.mark.parametrize("blocks_of", [160, 170])
def test_a_freeze_continues_in_the_next_block(blocks_of):
    """The first block ends during the freeze, after a jump. The readings after the freeze are near it. They do not
    decide any more."""
    readings = coarse(0.0021, 0.051)
    readings[:100, 0] += 0.025
    found = marks(readings, blocks_of=blocks_of)[0]
    assert np.flatnonzero(found).tolist() == list(range(101, 180))
    assert not marks(readings)[0].any()  # a single block has the readings on both sides


@pytest.mark.parametrize(("beyond_s", "is_frozen"), [(0.55, False), (0.3, True)])
def test_readings_within_half_a_second_show_a_standstill(beyond_s, is_frozen):
    """Farther from the equal readings, the readings jump by 1 g."""
    readings = coarse(0.0021, 0.051)
    away_s = np.maximum(100 - np.arange(280), np.arange(280) - 179) * 0.01
    readings[:, 0] += np.where(away_s > beyond_s, 1.0, 0.0)
    assert marks(readings)[0].any() == is_frozen


def test_a_log_without_frozen_readings_is_the_same_log():
    made = log_of(60)
    assert frozen.without_frozen(made) is made
    made.gyro_dps[:] = np.where(np.arange(60)[:, None] < 3, np.arange(60)[:, None], 9.0)
    assert frozen.without_frozen(made).t_s.tolist() == pytest.approx([0.0, 0.1, 0.2, 0.3])
