"""Tests the parts that read and write logs with small inputs. The expected results were computed by hand."""

import csv
import io

import numpy as np
import pytest
from kickstand_tools.common.errors import InputError
from kickstand_tools.logs import cells, csv_reader, even_times, frozen, reader, source
from kickstand_tools.logs.csv_lines import csv_lines, joined_cells, number_cells, text_cells, write_log, write_table
from kickstand_tools.logs.log import Log, Stretch, firmware_rows

NAMES = "t_s,ax_g,ay_g,az_g,gx_dps,gy_dps,gz_dps"


def log_of(n: int, step_s: float = 0.01, **more) -> Log:
    chance = np.random.default_rng(1)
    force = [0.0, 1.0, 0.0] + chance.normal(0.0, 0.01, (n, 3))
    return Log(np.asarray(np.arange(n) * step_s, dtype=float), force, chance.normal(0.0, 1.0, (n, 3)), **more)


def two_samples(t_s, speed_mps=(), temperature_c=(), turn_dps=0.0, **more) -> Log:
    force, rates = np.tile([0.0, 1.0, 0.0], (2, 1)), np.tile([0.0, 0.0, turn_dps], (2, 1))
    return Log(np.array(t_s), force, rates, np.array(speed_mps), np.array(temperature_c), **more)


def test_the_separator_is_the_most_frequent_outside_quotes():
    assert csv_reader.separator_of('a;b,c;"d,,,,"') == ";" and csv_reader.separator_of("a\tb") == "\t"
    assert csv_reader.separator_of("a,b") == ","


def test_cells_may_be_quoted():
    assert csv_reader.cells_of('a, "b,c",d') == ["a", "b,c", "d"] and csv_reader.cells_of("a;b", ";") == ["a", "b"]
    assert len(csv_reader.cells_of("," * 100_000)) == 100_001
    with pytest.raises(csv.Error, match="a line of over 100000 characters"):
        csv_reader.cells_of("," * 100_001)


def test_plain_numbers_are_read_with_empty_cells():
    found = csv_reader.numbers_in(b"1,,-2.5\n,,3\n", 3)
    assert found is not None and found == pytest.approx(np.array([[1, np.nan, -2.5], [np.nan, np.nan, 3]]), nan_ok=True)
    assert csv_reader.numbers_in(b"1,2\n", 3) is None and csv_reader.numbers_in(b"\n\n", 1) is None
    assert csv_reader.numbers_in(b"1e3\n", 1) is None and csv_reader.numbers_in(b"1-2\n", 1) is None


def test_columns_have_their_types():
    """A row with too few cells is filled up, and a row with too many is left out. A lone quotation mark is ignored."""
    columns, left_out = csv_reader.columns_of_text('1,2.5,x\n2,,\n\n3\n4,"1,y\n1,2,3,4\n', ",", 3)
    assert left_out == 1
    assert columns[0].tolist() == [1, 2, 3, 4] and columns[0].dtype == np.int64
    assert columns[1] == pytest.approx([2.5, np.nan, np.nan, 1.0], nan_ok=True)
    assert columns[2].tolist() == ["x", "", "", "y"]
    assert csv_reader.filled(columns[0]).tolist() == [True] * 4
    assert csv_reader.filled(columns[1]).tolist() == [True, False, False, True]
    assert csv_reader.filled(columns[2]).tolist() == [True, False, False, True]
    assert csv_reader.as_text(columns[1]) == ["2.5", "", "", "1.0"]
    assert csv_reader.numbers_of(columns[2]) == pytest.approx([np.nan] * 4, nan_ok=True)


def test_numbers_and_words_for_nothing():
    assert csv_reader._number(" 1.5 ") == 1.5 and csv_reader._number("1_0") is None and csv_reader._number("x") is None
    for word in ("", "-", "NA", "n/a", "nil", "None", "NULL", "#N/A"):
        assert np.isnan(csv_reader._number(word))  # type: ignore[arg-type]


def test_a_table_of_too_many_cells_is_refused(monkeypatch):
    monkeypatch.setattr(csv_reader, "MOST_CELLS", 4)
    assert len(csv_reader.columns_of([["1", "2"], ["3", "4"]], 2)[0]) == 2
    with pytest.raises(InputError, match="the table is too large"):
        csv_reader.columns_of([["1", "2"]] * 3, 2)


@pytest.mark.parametrize(
    ("name", "most"), [("ax_g", 20.0), ("gz_dps", 2500.0), ("temp_c", 200.0), ("speed_mps", 200.0), ("lat_deg", 90.0)]
    + [("lon_deg", 180.0), ("utc_s", 1e10)],
)  # fmt: skip
def test_a_value_at_its_limit_is_accepted(name, most):
    limit = cells._LIMITS[name]
    for value in (most, -most):
        assert cells._number(str(value), name, limit) == value
        assert cells.plausible(np.array([[0.0, value]]), ["t_s", name], None)
    with pytest.raises(cells._Mistake, match="past any reading: its unit is"):
        cells._number(str(1.001 * most), name, limit)
    assert not cells.plausible(np.array([[0.0, -1.001 * most]]), ["t_s", name], None)


def test_only_optional_cells_may_be_empty_and_times_may_repeat():
    assert np.isnan(cells._number(" ", "temp_c", 200.0))
    with pytest.raises(cells._Mistake, match="ax_g is empty, not a number"):
        cells._number("", "ax_g", 20.0)
    with pytest.raises(cells._Mistake, match="a number is needed"):
        cells._number("inf", "ax_g", 20.0)
    with pytest.raises(cells._Mistake, match="not a number"):
        cells._number("1_0", "ax_g", 20.0)
    assert cells.plausible(np.array([[1.0, np.nan]]), ["t_s", "temp_c"], None)
    assert not cells.plausible(np.array([[1.0, np.nan]]), ["t_s", "ax_g"], None)
    times = np.array([[1.0], [1.0], [1.5]])
    assert cells.plausible(times, ["t_s"], 1_000_000) and not cells.plausible(times, ["t_s"], 1_000_001)
    assert not cells.plausible(times[::-1], ["t_s"], None)


def test_long_cells_are_shortened_in_messages():
    assert cells._shown(" x ") == "'x'" and cells._shown("x" * 20) == repr("x" * 20)
    assert cells._shown("x" * 21) == repr("x" * 20 + "...") and cells._shown(" ") == "empty"


def test_numbers_are_written_with_their_digits():
    table = np.array([[0.0, -1.5], [np.nan, 1234.0]])
    assert b"".join(csv_lines(table, [3, 0])) == b"0.000,-2\n,1234\n"
    assert joined_cells([text_cells(["a", "bc"]), number_cells(np.array([0.05, np.nan]), 1)]) == b"a,0.1\nbc,nan\n"
    assert joined_cells([number_cells(np.array([-0.0, 2.0**53, np.inf]), 0)]) == b"-0\n9007199254740992\ninf\n"


def test_a_written_log_begins_at_its_own_time(tmp_path):
    write_log(tmp_path / "a.csv", two_samples([5.0, 5.25], [np.nan, 3.0], [20.0, 20.126], turn_dps=9.0))
    assert (tmp_path / "a.csv").read_text().splitlines() == [
        NAMES + ",speed_mps,temp_c",
        "5.000000,0.000000,1.000000,0.000000,0.000000,0.000000,9.000000,,20.00",
        "5.250000,0.000000,1.000000,0.000000,0.000000,0.000000,9.000000,3.000,20.13",
    ]
    write_table(tmp_path / "b.csv", ["a", "b"], [(1, "x"), (2.5, "y")])
    assert (tmp_path / "b.csv").read_text() == "a,b\n1,x\n2.5,y\n"


def test_a_log_counts_from_its_first_sample():
    log = two_samples([2.0, 2.5], start_s=1.0, utc_s=np.array([np.nan, 1000.5]))
    assert (log.start_s, log.t_s.tolist(), log.time_us.tolist()) == (3.0, [0.0, 0.5], [0, 500_000])
    assert log.start_utc_s == 1000.0 and log_of(3).start_utc_s is None
    (first, _) = firmware_rows(log.time_us, log.readings, log.speed_mps)
    assert first[:2] == (0, [0.0, 1.0, 0.0, 25.0, 0.0, 0.0, 0.0]) and np.isnan(first[2])
    made = Log.from_readings(np.arange(14.0).reshape(2, 7), 100.0)
    assert made.accel_g[1].tolist() == [7.0, 8.0, 9.0] and made.gyro_dps[1].tolist() == [11.0, 12.0, 13.0]
    assert made.temperature_c.tolist() == [3.0, 10.0] and made.t_s[1] == 0.01


def test_a_stretch_holds_both_of_its_ends():
    log = log_of(101)
    assert len(reader.read_log(Stretch(log, 0.2, 0.5)).t_s) == 31
    late = reader.read_log(Stretch(log, -0.5))
    assert len(late.t_s) == 51 and late.start_s == pytest.approx(0.5) and late.t_s[0] == 0.0
    assert len(reader.read_log(Stretch(log, None, -0.9)).t_s) == 11
    with pytest.raises(InputError, match="the stretch ends before it begins"):
        reader.read_log(Stretch(log, 0.5, 0.5))
    with pytest.raises(InputError, match=r"no samples in this stretch: the log is 1\.0 s long"):
        reader.read_log(Stretch(log, 1.5))
    assert Stretch(log, -0.25, 0.5).of_length(1.0) == Stretch(log, 0.75, 0.5)


def test_logs_in_memory_come_in_blocks_with_their_progress(monkeypatch):
    monkeypatch.setattr(reader, "BLOCK_SAMPLES", 40)
    seen = []
    blocks = list(reader.read_blocks(log_of(100), progress=lambda *done: seen.append(done)))
    assert [len(block.time_us) for block in blocks] == [40, 40, 20] and seen == [(40, 100), (80, 100), (100, 100)]
    assert not blocks[0].has_temp
    monkeypatch.setattr(reader, "MOST_SAMPLES", 100)
    assert len(reader.read_log(log_of(100)).t_s) == 100
    with pytest.raises(InputError, match="million samples"):
        reader.read_log(log_of(101))


def test_a_log_needs_two_samples_unless_less_is_asked():
    with pytest.raises(InputError, match="too short: 1 samples, at least 2 are needed"):
        reader.read_log(log_of(1))
    assert len(reader.read_log(log_of(1), minimum=1).t_s) == 1


@pytest.mark.parametrize(
    ("end", "cut"),
    [(b"4,5.25\n", False), (b"4,5.25", False), (b"4,5.2", True), (b"4\n", True), (b"4", True), (b"4,", False)],
)
def test_a_cut_line_has_fewer_cells_or_decimals(end, cut):
    names = ["t_s", "temp_c"]
    kept, line = reader._without_cut_line(b"3,5.00\n" + end, names, {"t_s": 0, "temp_c": 1})
    assert (kept, line) == ((b"3,5.00\n", end.rstrip()) if cut else (b"3,5.00\n" + end, b""))
    assert reader._digits(b"1,2.345 ") == 3 and reader._digits(b"1,2") == 0 and reader._digits(b"1.5,") == 0


def test_parts_are_marked_as_last():
    assert list(reader._last_marked(iter([(b"a", 1), (b"b", 2)]))) == [(b"a", 1, False), (b"b", 2, True)]
    assert list(reader._last_marked(iter([]))) == []


def test_text_is_read_in_whole_lines():
    notices = []
    found = list(source.chunks(io.BytesIO(b"ab\r\ncd\r\nef\0\0"), 5, notices))
    assert b"".join(text for text, _ in found) == b"ab\ncd\nef" and found[-1][1] == 12
    assert [notice.line() for notice in notices] == [
        "its end is 2 NUL bytes, as after a loss of power: they are left out"
    ]
    assert b"".join(text for text, _ in source.chunks(io.StringIO("a\rb\r"), 100)) == b"a\nb\n"


def test_a_file_without_lines_is_no_log(monkeypatch):
    monkeypatch.setattr(source, "LONGEST_LINE", 10)
    assert len(list(source.chunks(io.BytesIO(b"x" * 15), 5))) == 1
    with pytest.raises(InputError, match="without the end of a line"):
        list(source.chunks(io.BytesIO(b"x" * 16), 5))


def test_names_of_logs_lose_their_suffixes():
    for name, stem in (("a/b.csv", "b"), ("b.CSV.gz", "b"), ("b.vbo", "b"), ("b.c.zip", "b.c"), ("b.json", "b.json")):
        assert source.log_stem(name) == stem
    assert source.name_of(io.BytesIO()) == "the log" and source.name_of(log_of(2, name="x")) == "x"
    assert source.total_bytes(io.BytesIO(b"abc")) == 0


def marked(equal: int, step_s: float):
    """Look for frozen readings in a log of 50 changing readings, then equal readings, then 50 changing readings."""
    readings = np.random.default_rng(1).normal(0.0, 0.3, (100 + equal, 7))
    readings[50 : 50 + equal] = readings[50]
    finder = frozen.FrozenFinder()
    return finder.mark(np.rint(np.arange(len(readings)) * step_s * 1e6).astype(np.int64), readings), finder


def test_readings_are_frozen_after_half_a_second_and_ten_samples():
    assert not marked(50, 0.01)[0].any()  # 50 equal readings in 0.49 s
    found, finder = marked(51, 0.01)
    assert np.flatnonzero(found).tolist() == list(range(51, 101))
    assert [notice.line() for notice in finder.notices()] == [
        "the readings froze from 0.5 to 1.0 s: they are left out, and the lean filter restarts after each"
    ]
    assert not marked(9, 0.1)[0].any() and marked(10, 0.1)[0].any()


def test_a_stopped_clock_is_refused():
    """The clock has stopped if over 50 samples have the same time, and if they are over ten times as many as usual."""
    for count, stopped in ((50, False), (51, True)):
        t_s = np.concatenate((np.arange(100) * 0.01, np.full(count, 1.0), 1.01 + np.arange(100) * 0.01))
        if stopped:
            with pytest.raises(InputError, match=f"time stands still at 1 s, in {count} samples"):
                even_times.even_times(t_s)
        else:
            assert np.all(np.diff(even_times.even_times(t_s)) > 0.0)


def test_few_times_are_spread_over_their_period():
    recorded, starts, counts = np.array([0.0, 0.0, 0.1, 0.1]), np.array([0, 2]), np.array([2, 2])
    assert even_times._spread_repeated(recorded, starts, counts, 0.04) == pytest.approx([0.0, 0.04, 0.1, 0.14])
    assert even_times._spread_repeated(recorded, starts, counts, 0.06) == pytest.approx([0.0, 0.05, 0.1, 0.16])


def test_a_moving_mean_continues_along_straight_lines():
    line = 3.0 + 2.0 * np.arange(20.0)
    assert even_times._mean(line, 3) == pytest.approx(line) and even_times._mean(line, 30) == pytest.approx(line)
    peak = np.where(np.arange(20) == 10, 7.0, 0.0)
    assert even_times._mean(peak, 3)[5:16] == pytest.approx([0, 0, 1, 1, 1, 1, 1, 1, 1, 0, 0], abs=1e-9)
    assert even_times._line(np.array([0.0, 1.0, 2.0]), np.array([1.0, 3.0, 5.0]))(np.array([5.0])) == pytest.approx(
        [11.0]
    )


def test_steps_that_are_98_percent_equal_are_a_grid():
    assert even_times._one_step(np.array([5] * 98 + [10] * 2)) and not even_times._one_step(
        np.array([5] * 97 + [10] * 3)
    )


def test_rounded_times_stay_within_the_tick():
    """Samples are 7 ms apart, and their times are rounded to hundredths. The repaired times have even steps, and differ
    from the recorded times by at most 6 ms."""
    recorded = np.floor(np.arange(1000) * 0.7 + 1e-9) / 100.0
    found = even_times.even_times(recorded)
    assert np.abs(found - recorded).max() <= 0.006 + 1e-9
    assert np.diff(found)[100:900] == pytest.approx(np.full(800, 0.007), abs=2e-4)
    assert np.all(np.diff(found) >= 2e-6 - 1e-12)
