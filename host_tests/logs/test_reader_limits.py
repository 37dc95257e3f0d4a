"""The limits of logs, stretches, files, frozen readings and rounded times."""

import gzip
import io

import numpy as np
import pytest
from kickstand_tools.common.errors import InputError
from kickstand_tools.logs import even_times, frozen, log, reader, source
from kickstand_tools.logs.even_times import even_blocks
from kickstand_tools.logs.log import Block, Log, Stretch
from kickstand_tools.logs.source import CutGzip

NAMES = "t_s,ax_g,ay_g,az_g,gx_dps,gy_dps,gz_dps"


def block(time_us, lines=(), names=(), start_s=0.0, done=0) -> Block:
    time_us = np.array(time_us, dtype=np.int64)
    n, nothing = len(time_us), np.full(len(time_us), np.nan)
    return Block(
        time_us, np.arange(7.0 * n).reshape(n, 7), nothing, nothing, nothing, nothing, np.zeros(n, dtype=bool),
        False, start_s, done, list(lines), tuple(names),
    )  # fmt: skip


# log.py


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"accel_g": np.zeros((2, 2))}, r"accel_g has the shape \(2, 2\), it must be \(2, 3\)"),
        ({"t_s": [0.0, 0.0]}, "must incr"),
    ]
    + [({"t_s": [0.0, 4e-7]}, "must increase"), ({"speed_mps": np.zeros(3)}, r"speed_mps has the shape \(3,\)")]
    + [({"t_s": [1.0, 0.5]}, "must increase")],
)
def test_a_log_in_memory_is_checked(given, words):
    whole = {"t_s": [0.0, 1.0], "accel_g": np.zeros((2, 3)), "gyro_dps": np.zeros((2, 3))} | given
    with pytest.raises(InputError, match=words):
        Log(**whole)


def test_times_of_a_block_are_texts():
    made = block([0, 500_000], ["x,1.50 ", "x,2"], ["a", "t_s"], start_s=1.5)
    assert made.time_text == ["1.50", "2"] and made.t_s.tolist() == [0.0, 0.5]
    made.own_times = False
    assert made.time_text == ["1.500000", "2.000000"]
    assert block([0, 1], start_s=3.0).time_text == ["3.000000", "3.000001"]
    assert made.part(np.array([False, True])).lines == ["x,2"] and made.part(slice(0, 1)).lines == ["x,1.50 "]
    made.frozen[0] = True
    assert made.measured.time_us.tolist() == [500_000] and block([0]).measured.time_us.tolist() == [0]


def test_a_stretch_is_cut_from_blocks():
    blocks = [block([0, 100_000]), block([200_000, 300_000]), block([400_000, 500_000]), block([600_000])]
    taken = []

    def given():
        for one in blocks:
            taken.append(one)
            yield one

    found = list(Stretch("a", 0.1, 0.3).cut(given()))
    assert [one.time_us.tolist() for one in found] == [[0], [100_000, 200_000]] and found[1].start_s == 0.1
    assert len(taken) == 3  # the block after the end is read but not used, and no later block is read
    assert [one.time_us.tolist() for one in Stretch("a", 0.6).cut(iter(blocks))] == [[0]]
    with pytest.raises(InputError, match=r"the log is 0\.6 s long"):
        list(Stretch("a", 0.7).cut(iter(blocks)))


def test_rows_of_the_whole_log_are_limited_to_a_stretch():
    one, values = block([0, 100_000, 200_000]), np.array([1.0, 2.0, 3.0])
    assert [found.tolist() for _, found in log.within(None, one, values)] == [[1.0, 2.0, 3.0]]
    assert [found.tolist() for _, found in log.within(Stretch("a", 0.1, 0.2), one, values)] == [[2.0, 3.0]]
    assert not list(log.within(Stretch("a", 0.3), one, values))


# reader.py


def text_log(rows: str, more: str = "") -> io.BytesIO:
    return io.BytesIO(f"{NAMES}{more}\n{rows}".encode())


def test_a_log_has_its_own_start_and_lines():
    made = list(reader.read_blocks(text_log("5,0,1,0,1,2,3,20\n5.5,0,1,0,4,5,6,\n", ",temp_c"), axes=False))
    assert len(made) == 1 and made[0].time_us.tolist() == [0, 500_000] and made[0].start_s == 5.0
    assert made[0].readings[:, 3] == pytest.approx([20.0, np.nan], nan_ok=True) and made[0].has_temp
    assert made[0].readings[1, 4:].tolist() == [4.0, 5.0, 6.0] and made[0].lines[0] == "5,0,1,0,1,2,3,20"
    assert not next(reader.read_blocks(text_log("5,0,1,0,1,2,3\n6,0,1,0,1,2,4\n"), lines=False)).lines
    with pytest.raises(InputError, match="is empty: a log starts with the line"):
        list(reader.read_blocks(io.BytesIO(b" \n")))
    assert (
        len(reader.read_log(io.BytesIO(b"\xef\xbb\xbf" + text_log("5,0,1,0,1,2,3\n6,0,1,0,1,2,4\n").read())).t_s) == 2
    )


def test_the_line_of_a_cut_end_is_named():
    made = reader.read_log(text_log("".join(f"{k},0,1,0,0,0,{k}.25\n" for k in range(5)) + "5,0,1,0,0,0,5.2"))
    assert [one.line() for one in made.notices if one.code == "cut-line"] == [
        "line 7, the last one, was cut: it is left out"
    ]
    assert len(made.t_s) == 5


def test_a_file_is_a_log_by_its_first_lines(tmp_path):
    for text, words in (("x\n1\n", "no column"), (NAMES + "\n", "there are no readings below"), (NAMES + "\n1\n", "")):
        (tmp_path / "a.csv").write_text(text)
        assert reader.is_log(tmp_path / "a.csv") is not bool(words)
        if words:
            with pytest.raises(InputError, match=words):
                reader.check_first_line(tmp_path / "a.csv")


def test_a_stretch_from_the_end_is_counted_from_the_start():
    made = Log(np.arange(11) / 10.0, np.zeros((11, 3)), np.zeros((11, 3)))
    assert reader._from_beginning(Stretch(made, 0.0, 0.5)) == Stretch(made, 0.0, 0.5)
    assert reader._from_beginning(Stretch(made, -0.25)).from_s == pytest.approx(0.75)
    assert reader._from_beginning(Stretch(made, 0.2, -0.25)).to_s == pytest.approx(0.75)
    assert reader.split_stretch(made) == (made, None)
    whole, stretch = reader.split_stretch(Stretch(made, -0.5))
    assert whole is made and stretch is not None and stretch.from_s == pytest.approx(0.5)
    with pytest.raises(InputError, match="no samples in this stretch"):
        reader.split_stretch(Stretch(made, 2.0))


def test_a_log_without_samples_ends_at_its_beginning(tmp_path):
    (tmp_path / "a.csv").write_text(NAMES + "\n")
    assert reader._from_beginning(Stretch(tmp_path / "a.csv", None, -0.5)).to_s == -0.5


# source.py


def test_a_cut_gzip_gives_what_is_before_the_cut(tmp_path):
    chance = np.random.default_rng(1)
    whole = "\n".join(str(value) for value in chance.normal(size=9000)).encode() + b"\n"
    (tmp_path / "a.csv.gz").write_bytes(gzip.compress(whole)[:-2000])
    notices: list = []
    found = b"".join(text for text, _ in source.chunks(tmp_path / "a.csv.gz", 5000, notices))
    assert [type(notice) for notice in notices] == [CutGzip] and whole.startswith(found) and len(found) > 1000
    with pytest.raises(InputError, match="is damaged or cut short"):
        list(source.chunks(tmp_path / "a.csv.gz", 5000, None))
    (tmp_path / "a.csv.gz").write_bytes(b"x" * 50)
    with pytest.raises(InputError, match="is not a gzip file"):
        list(source.chunks(tmp_path / "a.csv.gz", 5000, []))


def test_chunks_end_with_a_line():
    found = list(source.chunks(io.BytesIO(b"ab\ncd\nefgh\ni"), 4, []))
    assert [text for text, _ in found] == [b"ab\n", b"cd\n", b"efgh\n", b"i"] and found[-1][1] == 12
    assert [text for text, _ in source.chunks(io.BytesIO(b"ab\rcd\ref"), 4, [])] == [b"ab\n", b"cd\n", b"ef"]
    assert list(source.chunks(io.BytesIO(b"a\0\0"), 9)) == [(b"a\0\0", 3)]


def test_a_pipe_or_a_directory_is_no_input(tmp_path):
    with pytest.raises(InputError, match="is a directory: give the name of a log in it"):
        list(source.chunks(tmp_path, 9))
    with pytest.raises(InputError, match="there is no such file"):
        source.open_input(tmp_path / "x")
    (tmp_path / "a").write_bytes(b"abc")
    with source.open_input(tmp_path / "a") as file:
        assert file.read() == b"abc"
    assert source.total_bytes(tmp_path / "a") == 3 and source.total_bytes(tmp_path / "x") == 0


# frozen.py


def marks(readings, step_s=0.01, blocks_of=10**6):
    finder, found = frozen.FrozenFinder(), []
    time_us = np.rint(np.arange(len(readings)) * step_s * 1e6).astype(np.int64)
    for begin in range(0, len(readings), blocks_of):
        part = slice(begin, begin + blocks_of)
        found.append(finder.mark(time_us[part], readings[part]))
    return np.concatenate(found), finder


def coarse(digit_g, digit_dps, jump_g=0.0, jump_dps=0.0, equal=80):
    """Return readings in steps of these digits. The readings change, are equal for 0.8 s, and change again around the
    same values or around other values."""
    chance, n = np.random.default_rng(1), 200 + equal
    readings = np.zeros((n, 7))
    readings[:, :3] = digit_g * chance.integers(-2, 3, (n, 3))
    readings[:, 4:] = digit_dps * chance.integers(-2, 3, (n, 3))
    readings[100 : 100 + equal] = 0.0
    readings[:, 0] += np.where((np.arange(n) < 100) | (np.arange(n) >= 100 + equal), jump_g, 0.0)
    readings[:, 5] += np.where((np.arange(n) < 100) | (np.arange(n) >= 100 + equal), jump_dps, 0.0)
    return readings


@pytest.mark.parametrize(
    ("given", "is_frozen"),
    [((0.0019, 0.06), True), ((0.0021, 0.049), True), ((0.0021, 0.051), False), ((0.0021, 0.051, 0.019), False)]
    + [((0.0021, 0.051, 0.025), True), ((0.0021, 0.051, 0.0, 0.49), False), ((0.0021, 0.051, 0.0, 0.56), True)],
)
def test_rounding_hides_the_noise_of_a_bike_at_rest(given, is_frozen):
    assert marks(coarse(*given))[0].any() == is_frozen


def test_the_temperature_does_not_count():
    readings = coarse(0.0001, 0.001)
    readings[:, 3] = np.arange(len(readings))
    found = marks(readings)[0]
    assert np.flatnonzero(found).tolist() == list(range(101, 180))
    readings[140, 3] = 1e9
    readings[140, 6] = 1e-10  # even the smallest change of a reading counts
    assert not marks(readings)[0].any()
    assert frozen.FrozenFinder().notices() == []


@pytest.mark.parametrize("blocks_of", [1, 7, 130, 1000])
def test_stretches_over_blocks_are_one(blocks_of):
    """A frozen stretch is marked from the block in which it is found. The notice has the times of the whole stretch."""
    found, finder = marks(coarse(0.0001, 0.001), blocks_of=blocks_of)
    (notice,) = finder.notices()
    assert found[179] and not found[:101].any() and not found[180:].any()
    assert (notice.stretches, notice.end_s) == (1, pytest.approx(1.79))  # type: ignore[attr-defined]


def test_several_stretches_are_counted():
    twice = np.vstack((coarse(0.0001, 0.001), coarse(0.0001, 0.001)))
    (notice,) = marks(twice)[1].notices()
    assert notice.line().startswith("the readings froze from 1.0 to 1.8 s and 1 times more, 1.6 s in all: they are")


# even_times.py


def spread_blocks(times_s, size=None):
    time_us = np.rint(np.asarray(times_s) * 1e6).astype(np.int64)
    size = size or len(time_us)
    remarks: list = []
    blocks = [block(time_us[k : k + size]) for k in range(0, len(time_us), size)]
    return list(even_blocks(iter(blocks), "a", remarks)), remarks


def test_even_blocks_are_not_changed():
    blocks, remarks = spread_blocks(np.arange(100) / 100.0, 30)
    assert [len(one.time_us) for one in blocks] == [30, 30, 30, 10] and not remarks
    assert all(one.own_times for one in blocks)


@pytest.mark.parametrize("size", [700, 5000, 9000])
def test_repeated_times_are_spread_over_blocks(size):
    """Each time is repeated once. The result has even steps of 5 ms, for any size of the blocks."""
    times = np.repeat(np.arange(4500) / 100.0, 2)
    blocks, remarks = spread_blocks(times, size)
    time_us = np.concatenate([one.time_us for one in blocks])
    assert len(time_us) == 9000 and time_us[0] == 0 and np.all(np.diff(time_us) > 0)
    assert np.diff(time_us)[100:-100] == pytest.approx(5000, abs=30)
    assert remarks[0].repeated == 4500 and remarks[0].samples == 9000 and 0.002 < remarks[0].shift_s < 0.006
    assert not any(one.own_times for one in blocks)


def test_a_small_shift_of_the_times_is_no_remark():
    """The recorder takes 300 samples per second and rounds times to milliseconds. The repair moves times by up to 0.6
    ms."""
    times = np.round(np.arange(2000) / 300.0, 3)
    blocks, remarks = spread_blocks(times)
    assert not remarks and not blocks[0].own_times


def test_gaps_and_ticks_are_kept_apart():
    """A step of over 1.5 periods plus a tick is a gap. A new time near the gap is a mean of times on the same side of
    the gap."""
    recorded = np.round(np.arange(200) * 0.0137, 2)
    late = recorded + np.where(np.arange(200) >= 100, 0.5, 0.0)
    plain, apart = even_times.even_times(recorded), even_times.even_times(late)
    assert apart[100] - apart[99] == pytest.approx(0.5137, abs=0.006)
    assert np.abs(apart - late).max() <= 0.006 + 1e-9 and np.abs(plain - recorded).max() <= 0.006 + 1e-9


def test_fine_ticks_and_single_times_are_left():
    fine = np.round(np.cumsum(0.01 + 1e-3 * np.random.default_rng(1).normal(size=300)), 5)
    assert even_times.even_times(fine) is fine or np.array_equal(even_times.even_times(fine), fine)
    assert even_times.even_times([3.0]).tolist() == [3.0] and even_times.even_times([]).tolist() == []
    with pytest.raises(InputError, match="the time is the same in all samples"):
        even_times.even_times([1.0, 1.0])
    with pytest.raises(InputError, match="some times are not numbers"):
        even_times.even_times([1.0, np.nan])
    with pytest.raises(InputError, match=r"time goes back at 1\.5 s"):
        even_times.even_times([1.0, 2.0, 1.5])
