"""Calibration records in flash may be damaged in any way. Loading then returns a complete calibration or none, and
never raises an error."""

import struct
from binascii import crc32

import pytest
from kickstand.calibration.parameters import Calibration
from kickstand.calibration.store import FILES, Store

IDENTITY = [1, 0, 0, 0, 1, 0, 0, 0, 1]
# All values are exact as 32-bit floats
NUMBERS = [0.25, -0.125, 0.375, 1.125, 0.875, 1.0, 3.5, -2.5, 1.5, *IDENTITY, 2.5]
MATRICES = [1.0, 0.01, -0.02, 0.01, 1.0, 0.003, -0.02, 0.003, 1.0]
MATRICES += [1.02, 0.01, 0.02, -0.03, 0.98, 0.004, 0.005, -0.006, 1.01] + [0.001 * k for k in range(1, 10)]


def calibration(mark, matrices=None):
    """Return a plausible calibration that differs for each argument."""
    new = Calibration()
    new.set_accel((mark / 100, 0, 0), (1.0, 1.01, 0.99))
    new.gyro_bias[2] = -3.5
    new.six_done = new.aligned = True
    if matrices:
        new.set_matrices(matrices)
    return new


def mark_of(loaded):
    return round(loaded.accel_offset[0] * 100)


@pytest.fixture
def store(tmp_path):
    return Store(0x68, 8, str(tmp_path))


def newest_file(tmp_path):
    """Return the file that the next load would use."""
    return max((path for name in FILES if (path := tmp_path / name).exists()), key=lambda path: path.read_bytes()[8])


def record(*, magic=b"KSTD", version=1, sequence=7, chip=(0x68, 8), six_done=1, how=1, numbers=NUMBERS):
    """Return a record as every release has written it: 96 bytes, little-endian."""
    body = struct.pack("<4sHHI", magic, version, 96, sequence) + struct.pack("<4B19f", *chip, six_done, how, *numbers)
    return body + struct.pack("<I", crc32(body))


def test_nothing_stored(store, tmp_path):
    loaded = store.load()
    assert (loaded.aligned, loaded.six_done, store.message) == (False, False, "not calibrated")
    assert list(tmp_path.iterdir()) == []  # load() writes nothing
    store.save(calibration(1))
    store.load()
    assert store.message == "record 1"


@pytest.mark.parametrize(("six_done", "how"), [(1, 1), (1, 2), (0, 1), (0, 0)])
def test_records_are_read_and_written_as_by_the_first_release(store, tmp_path, six_done, how):
    """how: how the sensor was aligned. 0 means not aligned, 1 by two poses, 2 by driving."""
    (tmp_path / FILES[1]).write_bytes(record(sequence=7, six_done=six_done, how=how))
    loaded = store.load()
    assert loaded.parameters() == NUMBERS
    assert (loaded.six_done, loaded.aligned, loaded.by_drive) == (six_done == 1, how > 0, how == 2)
    assert store.message == "record 7"
    for sequence, name in (8, FILES[0]), (9, FILES[1]):
        store.save(loaded)
        assert (tmp_path / name).read_bytes() == record(sequence=sequence, six_done=six_done, how=how)


def test_the_matrices_are_kept_through_a_new_alignment(store):
    store.save(calibration(1, MATRICES).with_alignment(IDENTITY, [1.0, 2.0, 3.0]))
    loaded = store.load()
    assert loaded.matrices() == pytest.approx(MATRICES)
    assert loaded.whole


@pytest.mark.parametrize(
    ("field", "value"),
    [(0, 0.6), (3, 1.3), (3, 0.7), (6, 61.0), (9, 1.1), (17, -1.0), (18, 4.0), (9, float("nan")), (0, float("inf"))],
)
def test_implausible_values_are_not_used(store, tmp_path, field, value):
    numbers = NUMBERS.copy()
    numbers[field] = value
    (tmp_path / FILES[0]).write_bytes(record(numbers=numbers))
    assert not store.load().aligned
    assert "out of range" in store.message


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


@pytest.mark.parametrize("matrices", [None, MATRICES])
@pytest.mark.parametrize("saved_before", [0, 1, 2])
def test_after_a_power_cut_at_any_byte_the_previous_record_counts(store, tmp_path, saved_before, matrices):
    for mark in range(1, saved_before + 1):
        store.save(calibration(mark))
    contents = {name: (tmp_path / name).read_bytes() for name in FILES if (tmp_path / name).exists()}
    store.save(calibration(9, matrices))
    written = newest_file(tmp_path)
    content = written.read_bytes()
    for cut in range(len(content)):
        for name, old in contents.items():
            (tmp_path / name).write_bytes(old)
        written.write_bytes(content[:cut])
        assert mark_of(store.load()) == saved_before
        store.save(calibration(5))  # the next save works
        assert mark_of(store.load()) == 5


@pytest.mark.parametrize("matrices", [None, MATRICES])
def test_every_damaged_byte_is_noticed(store, tmp_path, matrices):
    store.save(calibration(1))
    store.save(calibration(2, matrices))
    path = newest_file(tmp_path)
    content = path.read_bytes()
    for k in range(len(content)):
        path.write_bytes(content[:k] + bytes([content[k] ^ 0x10]) + content[k + 1 :])
        assert mark_of(store.load()) == 1
