"""The layouts of tables: separators, names, labels, stamps and rows per sensor."""

import numpy as np
from kickstand_tools.imports import layout
from kickstand_tools.imports.files import RecordingFile
from kickstand_tools.imports.recording import Sheet


def file(text: str, name: str = "a.csv") -> RecordingFile:
    return RecordingFile(name, text.encode(), text)


def test_the_layout_of_rows_is_found():
    plain_rows = ["t,a,b,c", *[f"{k},1,2,3" for k in range(5)]]
    assert layout.find_grid(plain_rows) == layout.Grid(0, 1, ",", False, 4)
    assert layout.find_grid(plain_rows[1:]) == layout.Grid(None, 0, ",", False, 4)
    comma = ["t;a;b;c", *[f"{k};1,5;2,5;3" for k in range(5)]]
    assert layout.find_grid(comma) == layout.Grid(0, 1, ";", True, 4)
    assert layout.find_grid(["1 2 3 4", "5 6 7 8"]) == layout.Grid(None, 0, " ", False, 4)
    assert layout.find_grid(["a,b,c", "1,2,3", "4,5,6"]) is None  # a table needs more than three numbers per row
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
    """The label u is in two or three of five rows, and then in two of four rows. A label becomes a column only if the
    majority of rows has it."""
    full, short = "t: {0} x: 2 y: 3 z: 4 u: 5", "t: {0} x: 2 y: 3 z: 4"
    for count, there in ((2, False), (3, True)):
        text = "\n".join((full if k < count else short).format(k) for k in range(5)) + "\n"
        found = layout._labelled("n", text)
        assert found is not None and ("u" in found.columns) is there
    four = "\n".join((full if k < 2 else short).format(k) for k in range(4)) + "\n"
    found = layout._labelled("n", four)
    assert found is not None and "u" not in found.columns


def test_lines_with_labels_are_the_majority():
    """Seven of ten lines are labelled. The lines have at least 1.5 labels each on average."""
    row = "t: 1 x: 2 y: 3 z: 4"
    assert layout._labelled("n", "\n".join([row] * 7 + ["text"] * 3)) is not None
    assert layout._labelled("n", "\n".join([row] * 6 + ["text"] * 4)) is None
    assert layout._labelled("n", "t: 1\nx: 2\ny: 3\nz: 4\n") is None


def test_a_joined_table_has_the_names_of_its_files():
    """The first columns of the joined table are the times. Each row of the joined table comes from one file."""
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
