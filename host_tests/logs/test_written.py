"""Numbers are written exactly as Python's own formatting writes them, and read as float() reads them. A log that is
written and read comes back."""

import gzip

import numpy as np
import pytest
from hypothesis import given, strategies as st
from kickstand_tools.api import Log, read_log, write_log
from kickstand_tools.common.messages import InputError
from kickstand_tools.logs import csv_text
from kickstand_tools.logs.log import float_schema
from kickstand_tools.logs.reader import time_texts
from support import command


@given(st.lists(st.floats(allow_nan=False, allow_infinity=False), min_size=1, max_size=20), st.integers(0, 7))
def test_any_number_is_written_and_read_as_python_does(values, digits):
    text = b"".join(csv_text.csv_lines(np.reshape(values, (-1, 1)), [digits]))
    lines = text.decode().split("\n")[:-1]
    assert lines == [f"{value:.{digits}f}" for value in values]
    read, expected = np.ravel(np.array(csv_text.numbers_in(text, 1))), np.array(lines, dtype=float)
    assert np.array_equal(read, expected) and np.array_equal(np.signbit(read), np.signbit(expected))


@pytest.mark.parametrize("text", ["1.25,,-3\n,2,-0.0", "1.5,2,1234567890123456789\n00.,-.5,0.1234567890123456\n"])
def test_plain_numbers_are_read_with_empty_cells(text):
    values = [[float(cell or "nan") for cell in line.split(",")] for line in text.strip().split("\n")]
    assert np.array_equal(np.array(csv_text.numbers_in(text.encode(), 3)), values, equal_nan=True)


@pytest.mark.parametrize(
    "text",
    ["", "\n", "1,2\n3", "1,2,3\n4\n", "1,2\n\n3,4\n", "1,2\n3,4,\n", "0" * 100_001 + ",1\n"]
    + ["-,1\n", ".,1\n", "1-2,1\n", "--2,1\n", "1.2.3,1\n", "1e3,1\n", "1+2\n", " 1,1\n", "nan,1\n"]
    + ["1\r,2\n", '"1",2\n', "1.5,2\n\u0661.5,2\n"],
)
def test_other_tables_are_left_to_another_reader(text):
    assert csv_text.numbers_in(text.encode(), 2) is None


def test_damaged_rows_of_a_table_are_counted():
    """A row with too few cells is filled up. The first row may be wider. A lone quotation mark is ignored."""
    columns, left_out = csv_text.columns_of_text('1,2.5,x\n2,,\n\n3\n4,"1,y\n1,2,3,4\n' + "9," * 60_000, ",", 3)
    assert left_out == 2 and columns[0].tolist() == [1, 2, 3, 4]
    assert columns[1] == pytest.approx([2.5, np.nan, np.nan, 1.0], nan_ok=True)
    assert columns[2].tolist() == ["x", "", "", "y"]
    assert [csv_text.filled(column).tolist() for column in columns[1:]] == [[True, False, False, True]] * 2
    assert csv_text.as_text(columns[1]) == ["2.5", "", "", "1.0"]
    assert (
        csv_text.numbers_of(columns[2]) == pytest.approx([np.nan] * 4, nan_ok=True)
        and csv_text.numbers_of(columns[0]) is columns[0]
    )
    columns, left_out = csv_text.columns_of_text("1,2,3\n4,5\n6,7,8,9\n", ",", 2)
    assert left_out == 1 and [column.tolist() for column in columns] == [[1, 4], [2, 5]]


@pytest.mark.parametrize(("name", "most"), [("MOST_CELLS", 9), ("MOST_TEXTS", 1)])
def test_a_table_of_too_many_cells_is_refused(monkeypatch, name, most):
    """The sizes are checked from block to block."""
    monkeypatch.setattr(csv_text, "ROWS", 2)
    monkeypatch.setattr(csv_text, name, most)
    assert len(csv_text.columns_of([["x"]] * 2, 1)[0]) == 2
    with pytest.raises(InputError, match="the table is too large: over"):
        csv_text.columns_of([["x"]] * 10, 1)


def test_a_written_log_comes_back(tmp_path):
    """The column t_s has the recorder's own time. Columns without values are left out."""
    nan = np.nan
    log = Log(
        np.array([5.0, 5.25]), np.tile([0.0, 1.0, 0.0], (2, 1)), np.tile([0.0, 0.0, 9.0], (2, 1)),
        np.array([nan, 3.0]), np.array([20.0, 20.126]),
    )  # fmt: skip
    write_log(tmp_path / "a.csv", log)
    rows = ["5.000000,0.000000,1.000000,0.000000,0.000000,0.000000,9.000000,,20.00"]
    rows += ["5.250000,0.000000,1.000000,0.000000,0.000000,0.000000,9.000000,3.000,20.13"]
    assert (tmp_path / "a.csv").read_text().splitlines() == [command.HEADER + ",speed_mps,temp_c", *rows]
    log.lat_deg[0], log.lon_deg[0], log.utc_s[0] = -33.8688197, 151.2092955, 1_700_000_000.25
    write_log(tmp_path / "a.csv.gz", log)
    assert gzip.decompress((tmp_path / "a.csv.gz").read_bytes()).count(b"\n") == 3
    copy = read_log(tmp_path / "a.csv.gz")
    for name, values in log.columns().items():
        assert copy.columns()[name] == pytest.approx(values, abs=5e-3 if name == "temp_c" else 1e-8, nan_ok=True)
    csv_text.write_table(tmp_path / "b.csv", ["a", "b"], [(1, "x"), (2.5, "y")])
    assert (tmp_path / "b.csv").read_text() == "a,b\n1,x\n2.5,y\n"


def test_a_lean_has_the_times_of_the_log(tmp_path, text_log):
    path = tmp_path / "log.csv"
    path.write_bytes(text_log("0.50,0,1,0,0,0,0", " 1.0,0,1,0,0,0,1", "1.50,0,1,0,0,0,2").read())
    parts = [np.array([[1.25, 2.0]]), np.array([[0.0, -3.0], [np.nan, 4.0]])]
    assert (
        csv_text.write_lean(tmp_path / "a.csv", ["lean_deg", "x"], [1, 0], time_texts(path, read_log(path)), parts) == 3
    )
    assert (tmp_path / "a.csv").read_text() == "t_s,lean_deg,x\n0.50,1.2,2\n1.0,0.0,-3\n1.50,nan,4\n"


def test_only_fine_columns_of_parquet_have_64_bits():
    pytest.importorskip("pyarrow")
    schema = float_schema({"t_s": "s", "up_g": "g"}, ("t_s",), {"made_by": "x"})
    fields = [(field.name, str(field.type), field.metadata) for field in schema]
    assert fields == [("t_s", "double", {b"unit": b"s"}), ("up_g", "float", {b"unit": b"g"})]
    assert schema.metadata == {b"made_by": b"x"}
