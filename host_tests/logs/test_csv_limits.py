"""The limits of cells, rows and tables, each with a value on either side of it."""

import numpy as np
import pytest
from kickstand_tools.common.errors import InputError
from kickstand_tools.logs import cells, csv_lines, csv_reader

NAMES = "t_s,ax_g,ay_g,az_g,gx_dps,gy_dps,gz_dps"


# csv_reader.py


def test_a_line_of_numbers_has_at_most_100000_characters():
    assert csv_reader.numbers_in(b"1" * 99_999 + b"\n", 1) is not None
    assert csv_reader.numbers_in(b"0" * 100_000, 1) is not None
    assert csv_reader.numbers_in(b"0" * 100_001, 1) is None


def test_numbers_need_every_line():
    assert csv_reader.numbers_in(b"1,2\n\n3,4\n", 2) is None
    assert csv_reader.numbers_in(b"1,2\n3,4", 2).tolist() == [[1, 2], [3, 4]]  # type: ignore[union-attr]


@pytest.mark.parametrize(
    ("cells", "kind", "values"),
    [(["1", "2"], "i", [1, 2]), (["1", "2.5"], "f", [1.0, 2.5]), (["1_0", "2"], "O", ["1_0", "2"])]
    + [(["x", "nan"], "O", ["x", ""]), (["1", "-2e3"], "f", [1.0, -2000.0]), (["9" * 30, "1"], "f", [1e30, 1.0])],
)
def test_cells_have_the_narrowest_type(cells, kind, values):
    found = csv_reader._typed(cells)
    assert found.dtype.kind == kind and found.tolist() == values
    assert csv_reader._typed(["0" * 41, "1"]).dtype.kind == "f" and csv_reader._typed(["0" * 40]).dtype.kind == "i"


def test_rows_are_converted_in_blocks(monkeypatch):
    monkeypatch.setattr(csv_reader, "ROWS", 4)
    rows = [[str(k), "x" if k == 9 else str(k / 2)] for k in range(10)]
    columns = csv_reader.columns_of(rows, 2)
    assert columns[0].tolist() == list(range(10)) and columns[0].dtype.kind == "i"
    assert columns[1].tolist()[-2:] == ["4.0", "x"] and columns[1].dtype.kind == "O"
    sizes = []
    monkeypatch.setattr(csv_reader, "_typed", lambda cells: sizes.append(len(cells)) or np.zeros(len(cells)))
    csv_reader.columns_of([["1"] * 40] * 5, 40)
    assert sizes == [2] * 40 + [2] * 40 + [1] * 40  # a part has 20 * ROWS cells: 80 cells, so 2 rows of 40 cells


def test_the_first_row_may_be_wider_than_the_names():
    columns, left_out = csv_reader.columns_of_text("1,2,3\n4,5\n6,7,8,9\n\n1,2,3\n", ",", 2)
    assert left_out == 1 and [column.tolist() for column in columns] == [[1, 4, 1], [2, 5, 2]]


def test_texts_of_a_table_are_limited(monkeypatch):
    monkeypatch.setattr(csv_reader, "ROWS", 2)
    monkeypatch.setattr(csv_reader, "MOST_TEXTS", 4)
    assert len(csv_reader.columns_of([["x"]] * 6, 1)[0]) == 6  # the limit is checked only at the next block
    with pytest.raises(InputError, match="over 30 million cells, or 0 million of text"):
        csv_reader.columns_of([["x"]] * 7, 1)


def test_parts_of_a_column_are_joined():
    whole, parts, texts = np.array([1, 2]), np.array([2.5]), np.array(["x"], dtype=object)
    assert csv_reader._joined([whole, parts]).tolist() == [1.0, 2.0, 2.5]
    assert csv_reader._joined([whole, texts]).tolist() == ["1", "2", "x"]
    assert csv_reader._joined([np.empty(0, dtype=np.int64)]).tolist() == []
    assert list(csv_reader._lines("a\n\n b \nc")) == ["a", "b", "c"]


# cells.py


@pytest.mark.parametrize(
    ("name", "line", "words"),
    [("a.gpx", "x", "a.gpx is a track"), ("a.FIT", "x", "is a track"), ("a.json", "x", "give the ride, and a calib")]
    + [("a.csv", "t_s,lean_deg", "contains a lean but no readings"), ("a.csv", "t_s;ax_g", "separated by ; or tab")]
    + [("a.csv", NAMES + ",t_s", "column t_s exists twice"), ("a.csv", NAMES + ",temp_c,temp_c", "temp_c exists twice")]
    + [
        ("a.csv", NAMES.replace(",ay_g", ""), "no column ay_g, and a log starts with"),
        ("a.csv", "t_s\tax_g", "or tab"),
    ],
)
def test_a_first_line_that_is_no_logs_is_named(name, line, words):
    with pytest.raises(InputError, match=words):
        cells.header(name, line)


def test_a_first_line_may_have_other_columns():
    assert cells.header("a", " b , b ," + NAMES)[:3] == ["b", "b", "t_s"]
    assert cells.header("a.gpx", NAMES) == NAMES.split(",")


def test_the_ride_beside_a_lean_is_named(tmp_path):
    lean = str(tmp_path / "LEAN.csv")
    (tmp_path / "A.cal.json").touch()
    assert cells._made_from(lean) == ""
    (tmp_path / "A.csv.gz").touch()
    assert cells._made_from(lean) == f", {tmp_path / 'A.csv.gz'}"
    assert cells._made_from(str(tmp_path / "A.csv.gz")) == ""
    (tmp_path / "A.csv").touch()
    assert cells._made_from(lean) == ""


def test_text_that_is_not_utf8_is_refused_by_its_line():
    cells.check_text("a", "°\n".encode(), 5)
    with pytest.raises(InputError, match="a, line 8: not text"):
        cells.check_text("a", b"1\n2\n\xff\n", 5)
    with pytest.raises(InputError, match="a is a zip"):
        cells.check_text("a", b"PK\x03\x04\xff", 0)


def read(text, before_us=None):
    return cells.read("a", text, 2, {"t_s": 0, "temp_c": 1}, 10, before_us)


def test_rows_are_read_with_their_lines():
    assert (
        read("1,2\n\n1,\n").tolist()[0] == [1.0, 2.0] and len(read("1,2\n\n1,\n")) == 2 and read("\n").shape == (0, 2)
    )
    for text, words in (
        ("1,2\n3\n", "a, line 12: 1 values under 2 column names"), ("1,x\n", "a, line 11: temp_c is 'x', not a number"),
        ("2,1\n\n1,1\n", r"a, line 13: time goes back from 2\.000000 at 1 s"),
        ("1," + "9" * 100_000, "line 11: not CSV"),
    ):  # fmt: skip
        with pytest.raises(InputError, match=words):
            read(text)
    assert len(read("1,1\n", 1_000_000)) == 1
    with pytest.raises(InputError, match=r"goes back from 1\.000001 at 1 s"):
        read("1,1\n", 1_000_001)


# csv_lines.py


def test_lines_are_written_in_pieces(monkeypatch):
    monkeypatch.setattr(csv_lines, "_ROWS", 2)
    assert list(csv_lines.csv_lines(np.array([[1.0], [2.0], [3.0]]), [0])) == [b"1\n2\n", b"3\n"]


@pytest.mark.parametrize("value", [0.5, 1.5, 2.5, 0.125, 1.005, 4294967295.4, 4294967296.0, 999.9995, -0.0004, 2.0**52])
@pytest.mark.parametrize("digits", [0, 1, 3])
def test_numbers_near_the_middle_are_as_pythons(value, digits):
    for number in (value, -value):
        assert csv_lines.joined_cells([csv_lines.number_cells(np.array([number]), digits)]) == (
            f"{number:.{digits}f}\n".encode()
        )


def test_long_words_for_nan_fit():
    found = csv_lines.number_cells(np.array([1.0, np.nan]), 0, "nothing")
    assert csv_lines.joined_cells([found]) == b"1\nnothing\n"


def test_a_cut_log_counts_its_samples(tmp_path):
    (tmp_path / "a.csv").write_text(NAMES + "\n" + "".join(f"{k / 4},0,1,0,0,0,{k}\n" for k in range(9)))
    assert csv_lines.cut_log(tmp_path / "a.csv", tmp_path / "b.csv", 0.5, 1.25) == (4, 0.75)
    assert (tmp_path / "b.csv").read_text().splitlines()[1:] == [f"{k / 4},0,1,0,0,0,{k}" for k in range(2, 6)]


def test_a_single_sample_can_be_cut_out(tmp_path):
    (tmp_path / "a.csv").write_text(NAMES + "\n" + "".join(f"{k / 4},0,1,0,0,0,{k}\n" for k in range(9)))
    assert csv_lines.cut_log(tmp_path / "a.csv", tmp_path / "b.csv", 2.0) == (1, 0.0)
    assert (tmp_path / "b.csv").read_text().splitlines() == [NAMES, "2.0,0,1,0,0,0,8"]
