"""Columns of numbers are written exactly as Python's own formatting writes them."""

import numpy as np
import pytest
from kickstand_tools.logs.csv_lines import csv_lines, joined_cells, number_cells, text_cells
from kickstand_tools.logs.csv_reader import columns_of, numbers_in

AWKWARD = [0.0, -0.0, -1e-9, 5e-324, 0.5, 1.5, 2.5, -0.5, 9.9999999, 99999.5, 2.0**53, -(2.0**60), 1e300]


def numbers(digits):
    chance = np.random.default_rng(digits)
    many = [chance.normal(scale=scale, size=300) for scale in (1e-6, 1e-2, 1.0, 30.0, 1e6, 1.7e9)]
    middles = (np.arange(-40, 40) + 0.5) * 10.0**-digits  # halfway between two texts, as closely as a double allows
    decimals = np.round(chance.normal(size=300), digits + 1)  # one number of ten is halfway between two texts
    return np.concatenate((*many, middles, np.nextafter(middles, 9.0), decimals))


@pytest.mark.parametrize("digits", range(8))
def test_numbers_are_written_as_python_writes_them(digits):
    for values in (numbers(digits), np.array(AWKWARD), np.array([*AWKWARD, np.inf, -np.inf]), np.array([-0.25])):
        cells = number_cells(values, digits)
        assert joined_cells([cells]).decode().split("\n")[:-1] == [f"{value:.{digits}f}" for value in values.tolist()]


@pytest.mark.parametrize("values", [[np.nan, 1.25, -np.nan], [np.nan], [np.nan, np.inf]])
@pytest.mark.parametrize("nan", ["nan", "", "unknown"])
def test_nan_and_infinity_have_their_texts(values, nan):
    lines = joined_cells([number_cells(np.array(values), 1, nan)]).decode().split("\n")[:-1]
    assert lines == [nan if np.isnan(value) else f"{value:.1f}" for value in values]


def test_lines_contain_texts_and_numbers():
    texts, values = ["0.00", "1700000000.125", "2"], np.array([-1.0, 22.125, 3.375])
    assert joined_cells([text_cells(texts), number_cells(values, 2)]) == b"0.00,-1.00\n1700000000.125,22.12\n2,3.38\n"
    assert joined_cells([text_cells([]), number_cells(values[:0], 2)]) == b""
    with pytest.raises(UnicodeEncodeError):
        text_cells(["\u0661"])


def test_a_table_is_written_in_pieces():
    table = np.random.default_rng(1).normal(size=(31_000, 2))
    table[30_500, 1] = np.nan
    pieces = list(csv_lines(table, [3, 0]))
    assert len(pieces) == 3
    assert b"".join(pieces).decode() == "".join(f"{a:.3f},{b:.0f}\n".replace("nan", "") for a, b in table.tolist())


@pytest.mark.parametrize("digits", range(8))
def test_numbers_are_read_as_python_reads_them(digits):
    values = numbers(digits)
    texts = [text for text in (f"{value:.{digits}f}" for value in values.tolist()) if len(text.strip("-")) <= 15]
    texts += ["-0.0", "7", "-12"] if digits == 0 else [f"-.{'5' * digits}", f"00.{'1' * digits}"]
    texts = [text for text in texts if len(text.partition(".")[2]) == digits]
    found = numbers_in("".join(f"{text},,\n" for text in texts).encode(), 3)
    assert found is not None and len(found) == len(texts) > 1000
    wanted = np.array([float(text) for text in texts])
    assert np.array_equal(found[:, 0], wanted) and np.array_equal(np.signbit(found[:, 0]), np.signbit(wanted))
    assert np.all(np.isnan(found[:, 1:]))


def test_last_line_needs_no_line_end():
    found = numbers_in(b"1.25,,-3\n,2,4", 3)
    assert found is not None
    assert np.array_equal(found, [[1.25, np.nan, -3.0], [np.nan, 2.0, 4.0]], equal_nan=True)


@pytest.mark.parametrize(
    "text",
    ["", "\n", "1,2\n3", "1,2,3\n4\n", "1,2\n\n3,4\n", "1,2\n3,4,\n"]
    + ["-,1\n", ".,1\n", "1-2,1\n", "--2,1\n", "1.2.3,1\n", "1e3,1\n", "1+2\n", " 1,1\n", "nan,1\n"]
    + ["1\r,2\n", '"1",2\n', "1.5,2\n\u0661.5,2\n"],
)
def test_other_tables_are_left_to_another_reader(text):
    assert numbers_in(text.encode(), 2) is None


def test_numbers_of_any_length_are_read_as_python_reads_them():
    rows = ["1.5,2", "2,1234567890123456789", "1.25,0.1234567890123456", "1.,-.5"]
    wanted = [[float(cell) for cell in row.split(",")] for row in rows]
    found = numbers_in("\n".join(rows).encode(), 2)
    assert found is not None and np.array_equal(found, wanted)


def test_columns_are_those_of_all_blocks_of_rows():
    rows = [["1", "x"], ["2", ""], ["3"]]
    assert [cells.tolist() for cells in columns_of(rows, 2)] == [[1, 2, 3], ["x", "", ""]]
    assert [cells.tolist() for cells in columns_of([], 2)] == [[], []]
    many = [[str(k), f"{k}.5"] for k in range(70_000)]
    whole, halves = columns_of(many, 2)
    assert whole.tolist() == list(range(70_000))
    assert halves.tolist() == [k + 0.5 for k in range(70_000)]
