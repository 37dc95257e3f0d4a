"""A log that is read in blocks equals the log that is read at once. A mistake far down is reported with its line."""

import gzip
import tracemalloc

import numpy as np
import pytest
from kickstand_tools.checks import cells
from kickstand_tools.common.errors import InputError
from kickstand_tools.logs import reader
from kickstand_tools.logs.csv_reader import numbers_in
from support import command

HEADER = command.HEADER + ",temp_c,speed_mps"


def rows(count: int, start: int = 0) -> list[str]:
    return [
        f"{k / 200:.3f},{np.sin(k):.6f},-0.5,1e0,{k % 7}.25,-3,.5,{20 + k % 3},{f'{k % 40}.5' if k % 200 == 0 else ''}"
        for k in range(start, start + count)
    ]


def write(path, lines):
    text = "\n".join(lines) + "\n"
    path.write_bytes(gzip.compress(text.encode()) if path.suffix == ".gz" else text.encode())
    return path


@pytest.mark.parametrize("name", ["ride.csv", "ride.csv.gz"])
@pytest.mark.parametrize("block_bytes", [200, 5000, 1 << 22])
def test_blocks_add_up_to_the_log(tmp_path, monkeypatch, name, block_bytes):
    path = write(tmp_path / name, [HEADER, *rows(1500)])
    whole, done, size = reader.read_log(path), [], path.stat().st_size
    monkeypatch.setattr(reader, "BLOCK_BYTES", block_bytes)
    blocks = list(reader.read_blocks(str(path), progress=lambda *both: done.append(both)))
    assert done == [(block.done, size) for block in blocks] and done == sorted(done) and done[-1] == (size, size)
    assert whole.name == str(path)
    assert len(blocks) >= min(10, 80_000 // block_bytes)
    assert [t for block in blocks for t in block.time_text] == [row.partition(",")[0] for row in rows(1500)]
    assert [t for block in blocks for t in block.time_us] == whole.time_us.tolist() == [5000 * k for k in range(1500)]
    assert np.array_equal(np.concatenate([block.readings for block in blocks]), whole.readings)
    assert np.flatnonzero(~np.isnan(whole.speed_mps)).tolist() == list(range(0, 1500, 200))


def test_the_readers_of_numbers_agree(tmp_path):
    """The reader of cells reads blocks with an exponent or with a column of text. The reader of cells finds the same
    numbers as the reader of columns."""
    quick = write(tmp_path / "quick.csv", [HEADER, *[row.replace("1e0", "1") for row in rows(800)]])
    plain = write(tmp_path / "plain.csv", [HEADER, *rows(800)])
    noted = write(tmp_path / "noted.csv", [HEADER + ",note", *[row + ',"a, ""b"""' for row in rows(800)]])
    assert numbers_in(quick.read_bytes().partition(b"\n")[2], 9) is not None
    assert numbers_in(plain.read_bytes().partition(b"\n")[2], 9) is None
    one = reader.read_log(quick)
    for other in (reader.read_log(plain), reader.read_log(noted)):
        assert np.array_equal(one.readings, other.readings)
        assert np.array_equal(one.speed_mps, other.speed_mps, equal_nan=True)


def test_rows_that_are_not_kept_leave_the_blocks_as_they_are(tmp_path):
    path = write(tmp_path / "ride.csv", [HEADER, *rows(800)])
    for kept, bare in zip(reader.read_blocks(path), reader.read_blocks(path, lines=False), strict=True):
        assert len(kept.lines) == len(kept.time_us) and not bare.lines
        assert np.array_equal(kept.readings, bare.readings) and np.array_equal(kept.time_us, bare.time_us)
        assert len(bare.part(slice(10, 20)).time_us) == len(bare.part(bare.time_us < 50_000).time_us) == 10


MISTAKES = {
    "0.0,0,0,1,0,0,0,20,": "line 1002: time goes back from 4.995000 at 0.0 s",
    "9.0,0,0,1,0,0,20,": "line 1002: 8 values under 9 column names",
    "9.0,0,0,77,0,0,0,20,": "line 1002: az_g is '77', past any reading",
    "9.0,0,0,,0,0,0,20,": "line 1002: az_g is empty",
    "9.0,0,0,1,0,0,0,20,nan": "line 1002: speed_mps is 'nan'",
    "9.0,0,0,1,0,0,0,20,\xff": "line 1002: not text",
}


@pytest.mark.parametrize("row", MISTAKES)
@pytest.mark.parametrize("block_bytes", [1, 700, 1 << 22])  # with 1 byte, each block is one row
def test_mistake_far_down_is_reported_with_its_line(tmp_path, monkeypatch, row, block_bytes):
    monkeypatch.setattr(reader, "BLOCK_BYTES", block_bytes)
    path = tmp_path / "ride.csv"
    path.write_bytes("\n".join([HEADER, *rows(1000), row, *rows(300, 2000)]).encode("latin-1") + b"\n")
    with pytest.raises(InputError) as error:
        list(reader.read_blocks(path))
    assert MISTAKES[row] in str(error.value)


def test_memory_does_not_grow_with_the_log(tmp_path, monkeypatch):
    """To check the text columns, only the cells of the last hour stay in memory. In this test, only the cells of half a
    minute stay in memory."""
    monkeypatch.setattr(reader, "BLOCK_BYTES", 1 << 16)
    monkeypatch.setattr(cells, "KEPT", 300)
    peaks = []
    for count in 8_000, 32_000:
        path = write(tmp_path / "ride.csv", [HEADER, *rows(count)])
        tracemalloc.start()
        assert sum(len(block.time_us) for block in reader.read_blocks(path)) == count
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    assert peaks[1] < 1.2 * peaks[0]
