"""Calibration records in flash may be damaged in any way. Loading then returns a complete calibration or none, and
never raises an error."""

import io
import struct
from binascii import crc32
from math import degrees

import pytest
from kickstand.calibration.parameters import Calibration
from kickstand.calibration.store import FILES, Store
from kickstand.errors import StoreError
from kickstand.lean.upright_trim import MAX_TRIM


def calibration(mark):
    """Return a plausible calibration that differs for each argument."""
    new = Calibration()
    new.set_accel((mark / 100, 0, 0), (1.0, 1.01, 0.99))
    new.gyro_bias[2] = -3.5
    new.six_done = new.aligned = True
    return new


def mark_of(loaded):
    return round(loaded.accel_offset[0] * 100)


@pytest.fixture
def store(tmp_path):
    return Store(0x68, 8, str(tmp_path))


def newest_file(tmp_path, store):
    """Return the file that the next load would use."""
    contents = {name: (tmp_path / name).read_bytes() for name in FILES if (tmp_path / name).exists()}
    return tmp_path / max(contents, key=lambda name: struct.unpack_from("<I", contents[name], 8))


def test_nothing_stored(store, tmp_path):
    loaded = store.load()
    assert (loaded.aligned, loaded.six_done, store.message) == (False, False, "not calibrated")
    assert list(tmp_path.iterdir()) == []  # load() writes nothing


@pytest.mark.parametrize("sign", [-1, 1])
def test_the_largest_trim_that_the_filter_finds_is_loaded_again(store, sign):
    new = calibration(1)
    new.trim_deg = sign * degrees(MAX_TRIM)
    store.save(new)
    assert store.load().trim_deg == pytest.approx(sign * degrees(MAX_TRIM))


IDENTITY = [1, 0, 0, 0, 1, 0, 0, 0, 1]
# All values are exact as 32-bit floats
NUMBERS = [0.25, -0.125, 0.375, 1.125, 0.875, 1.0, 3.5, -2.5, 1.5, *IDENTITY, 2.5]


def record(*, magic=b"KSTD", version=1, sequence=7, chip=(0x68, 8), six_done=1, how=1, numbers=NUMBERS):
    """Return a record as every release has written it: 96 bytes, little-endian."""
    body = struct.pack("<4sHHI", magic, version, 96, sequence) + struct.pack("<4B19f", *chip, six_done, how, *numbers)
    return body + struct.pack("<I", crc32(body))


@pytest.mark.parametrize(("six_done", "how"), [(1, 1), (1, 2), (0, 1), (0, 0)])
def test_records_are_read_and_written_as_by_the_first_release(store, tmp_path, six_done, how):
    """how: how the sensor was aligned. 0 means not aligned, 1 by two poses, 2 by driving."""
    (tmp_path / FILES[1]).write_bytes(record(sequence=7, six_done=six_done, how=how))
    loaded = store.load()
    assert loaded.parameters() == NUMBERS
    assert (loaded.six_done, loaded.aligned, loaded.by_drive) == (six_done == 1, how > 0, how == 2)
    assert store.message == "record 7"
    store.save(loaded)
    assert (tmp_path / FILES[0]).read_bytes() == record(sequence=8, six_done=six_done, how=how)
    store.save(loaded)
    assert (tmp_path / FILES[1]).read_bytes() == record(sequence=9, six_done=six_done, how=how)


# The flash of a board with firmware 0.4.0 after the six positions, and then after the two presses
OF_0_4_0 = {
    "kickstand_b.cal": "4b535444010060000100000068080100a69b443c96430bbd4260653d7368813f08ac7c3faaf1823f000050400000"
    "c0bf0000403f0000803f0000000000000000000000000000803f0000000000000000000000000000803f000000007ca03fb8",
    "kickstand_a.cal": "4b535444010060000200000068080101a69b443c96430bbd4260653d7368813f08ac7c3faaf1823f000060400000"
    "a0bf0000003f000000009a99193fcdcc4cbf0000803f000000000000000000000000cdcc4cbf9a9919bf0000a03fe2591250",
}


def test_the_flash_of_a_board_with_0_4_0_is_read(store, tmp_path):
    for name, content in OF_0_4_0.items():
        (tmp_path / name).write_bytes(bytes.fromhex(content))
    loaded = store.load()
    assert store.message == "record 2"
    assert loaded.parameters()[:9] == pytest.approx([0.012, -0.034, 0.056, 1.011, 0.987, 1.023, 3.5, -1.25, 0.5])
    assert loaded.parameters()[9:] == pytest.approx([0.0, 0.6, -0.8, 1.0, 0.0, 0.0, 0.0, -0.8, -0.6, 1.25])
    assert loaded.matrices() == [*IDENTITY, *IDENTITY, *[0.0] * 9]
    assert loaded.six_done and loaded.aligned and not loaded.whole
    store.save(loaded)
    assert (
        len((tmp_path / FILES[1]).read_bytes()) == 96
    )  # after a downgrade to 0.4.0 the board can still read the record


MATRICES = [1.0, 0.01, -0.02, 0.01, 1.0, 0.003, -0.02, 0.003, 1.0]
MATRICES += [1.02, 0.01, 0.02, -0.03, 0.98, 0.004, 0.005, -0.006, 1.01] + [0.001 * k for k in range(1, 10)]


def whole(mark=1):
    new = calibration(mark)
    new.set_matrices(MATRICES)
    return new


def test_the_matrices_are_kept_through_a_new_alignment(store):
    store.save(whole().with_alignment(IDENTITY, [1.0, 2.0, 3.0]))
    loaded = store.load()
    assert loaded.matrices() == pytest.approx(MATRICES)
    assert loaded.whole


def test_a_damaged_record_with_matrices_leaves_the_previous_one(store, tmp_path):
    store.save(calibration(1))
    store.save(whole(9))
    written = newest_file(tmp_path, store)
    record = written.read_bytes()
    for cut in range(len(record)):
        written.write_bytes(record[:cut])
        assert mark_of(store.load()) == 1
    assert "cut short" in store.message
    for at in range(0, len(record), 7):
        written.write_bytes(record[:at] + bytes([record[at] ^ 4]) + record[at + 1 :])
        assert mark_of(store.load()) == 1


@pytest.mark.parametrize(("index", "value"), [(0, 1.2), (10, -0.2), (14, float("nan")), (20, 0.06), (26, -0.001)])
def test_implausible_matrices_are_not_loaded(store, index, value):
    new = calibration(1)
    new.set_matrices([*MATRICES[:index], value, *MATRICES[index + 1 :]])
    store.save(new)
    assert store.message != "" or not store.load().aligned
    assert not store.load().aligned


@pytest.mark.parametrize(
    ("content", "problem"),
    [
        (b"", "empty"),
        (record()[:-1], "cut short"),
        (record() + b"\0", "too long"),
        (record()[:-1] + b"\0", "damaged"),
        (record(magic=b"KSTE"), "of another version"),
        (record(version=2), "of another version"),
        (record(sequence=0), "of another version"),
        (record(chip=(0x70, 8)), "of another sensor"),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_the_fault_of_a_record_is_reported(store, tmp_path, content, problem):
    (tmp_path / FILES[1]).write_bytes(content)
    assert not store.load().aligned
    assert store.message == f"not calibrated: {FILES[1]} {problem}"
    (tmp_path / FILES[0]).write_bytes(record())
    assert store.load().aligned
    assert store.message == f"record 7 (other record: {FILES[1]} {problem})"


def test_a_record_of_another_range_stays_valid(store, tmp_path):
    """Older boards were calibrated with a range of 8 g. The default is now 16 g."""
    (tmp_path / FILES[1]).write_bytes(record(chip=(0x68, 16)))
    assert store.load().aligned
    assert store.message == "record 7"


@pytest.mark.parametrize("saved_before", [0, 1, 2])
def test_power_cut_at_every_byte_of_a_save(store, tmp_path, saved_before):
    for mark in range(1, saved_before + 1):
        store.save(calibration(mark))
    before = {name: (tmp_path / name).read_bytes() for name in FILES if (tmp_path / name).exists()}
    store.save(calibration(9))
    written = newest_file(tmp_path, store)
    record = written.read_bytes()
    for cut in range(len(record)):
        for name, content in before.items():
            (tmp_path / name).write_bytes(content)
        written.write_bytes(record[:cut])
        assert mark_of(store.load()) == saved_before  # load() returns the previous record, or nothing without one
        store.save(calibration(5))  # the next save() after the power cut works
        assert mark_of(store.load()) == 5
        assert store.load().aligned


def test_every_damaged_byte_is_noticed(store, tmp_path):
    store.save(calibration(1))
    store.save(calibration(2))
    path = newest_file(tmp_path, store)
    record = path.read_bytes()
    for at in range(len(record)):
        path.write_bytes(record[:at] + bytes([record[at] ^ 0x10]) + record[at + 1 :])
        assert mark_of(store.load()) == 1
        assert "damaged" in store.message


@pytest.mark.parametrize(
    ("field", "value"),
    [(0, 0.6), (3, 1.3), (3, 0.7), (6, 61.0), (9, 1.1), (17, -1.0), (18, 4.0), (9, float("nan")), (0, float("inf"))],
)
def test_implausible_values_are_not_used(store, tmp_path, field, value):
    store.save(calibration(1))
    path = newest_file(tmp_path, store)
    record = bytearray(path.read_bytes()[:-4])
    struct.pack_into("<f", record, 16 + 4 * field, value)
    path.write_bytes(record + struct.pack("<I", crc32(record)))
    assert not store.load().aligned
    assert "out of range" in store.message


def test_a_flash_that_loses_writes_is_reported(store, tmp_path, monkeypatch):
    store.save(calibration(1))

    def forgetful(path, mode):
        if mode == "wb":
            open(path, mode).close()
            return io.BytesIO()
        return open(path, mode)

    monkeypatch.setattr("kickstand.calibration.store.open", forgetful, raising=False)
    with pytest.raises(StoreError, match="read-back"):
        store.save(calibration(2))
    assert mark_of(store.load()) == 1


def test_a_trim_may_be_stored_beside_a_foreign_record(store, tmp_path):
    """A foreign record is from another chip, or is empty after a power cut. A trim may be saved in spite of a foreign
    record."""
    store.save(calibration(1))
    store.save(calibration(2))
    other = Store(0x70, 8, str(tmp_path))
    other.load()
    other.save(calibration(3))
    again = Store(0x70, 8, str(tmp_path))
    assert mark_of(again.load()) == 3 and "another sensor" in again.message
    assert again.unchanged()
    newest = newest_file(tmp_path, other)
    for name in FILES:
        if tmp_path / name != newest:
            (tmp_path / name).write_bytes(b"")
    again.load()
    assert again.unchanged()
    again.save(calibration(4))
    assert again.unchanged()
    assert mark_of(Store(0x70, 8, str(tmp_path)).load()) == 4
