"""The ring of rides at its limits: the room for a part, the removal of the oldest ride, and the paths of files."""

import shutil
from pathlib import Path

import pytest
from kickstand.rides import flash_ring, ride_paths
from kickstand.rides.block import block_length
from kickstand.rides.flash_ring import RideRing
from rings import CARD, FLASH, KB_4, old_ride, write_block


@pytest.mark.parametrize(("settings", "blocks"), [(FLASH, 16), (CARD, 256)])
def test_a_part_has_16_blocks_in_flash_and_256_on_a_card(settings, blocks, root):
    root.free = root.all = 2000 * KB_4
    ring = RideRing(settings)
    assert ring.stops_interrupts is (settings is FLASH)
    assert ring.needed == flash_ring.RESERVE + (blocks + 2) * KB_4
    ring.begin()
    lengths = []
    for _ in range(2 * blocks + 1):
        lengths.append(ring.next_length())
        write_block(ring)
    ring.end()
    assert lengths == [block_length(i) for i in range(blocks)] * 2 + [KB_4]
    sizes = {part: size for _, part, size in ride_paths.parts("rides" if settings is FLASH else "card")}
    assert sizes == {0: 100 * blocks, 1: 100 * blocks, 2: 100}


def test_room_is_made_exactly_when_a_part_does_not_fit(root):
    needed = flash_ring.RESERVE + 18 * KB_4
    for free, steps in ((needed, 1), (needed - 1, 3)):
        old = old_ride(root, 1)
        root.free = free
        ring = RideRing(FLASH)
        assert ring.begin() > 1
        assert write_block(ring) == steps  # the steps are: find the oldest ride, remove its part, open the new part
        assert (old / "00000.rid").exists() is (steps == 1)
        ring.end()


def test_its_own_first_parts_are_removed_last(root):
    root.free = flash_ring.RESERVE + 18 * KB_4
    old_ride(root, 1)
    ring = RideRing(FLASH)
    assert ring.begin() == 2
    for _ in range(16):
        write_block(ring, KB_4)
    assert sorted(ride_paths.parts("rides")) == [(1, 0, KB_4), (2, 0, 16 * KB_4)]
    rooms = [ring.room()]
    while not ring.ready():
        root.free = flash_ring.RESERVE + 3 * KB_4
        rooms.append(ring.room())
    # The steps are: find ride 1, remove its part, remove its directory, find ride 2, remove its part, open the next
    # part.
    assert [room > 0 for room in rooms] == [True] * 5 + [False] * 2
    assert [part for part in ride_paths.parts("rides") if part[1] == 0] == []
    assert not (root.path / "rides/000/01").exists()


def test_the_oldest_rides_are_removed_first(root):
    """Each step removes one file or one directory. Rides without parts are skipped. The owner's files are kept."""
    for ride in (98, 99, 100, 300):
        old_ride(root, ride)
    (root.path / "rides/000/98/notes.txt").write_bytes(b"the rider's own")
    (root.path / "rides/001/notes.txt").write_bytes(b"the rider's own")
    (root.path / "rides/002").mkdir()
    (root.path / "rides/000/00").mkdir()
    root.free = 10 * KB_4
    ring = RideRing(FLASH)
    assert ring.begin() == 301

    def left():
        return sorted(path.relative_to("rides").as_posix() for path in Path("rides").rglob("*"))

    gone, before = [], left()
    with pytest.raises(OSError):
        for _ in range(50):
            assert not ring.ready()
            now = left()
            gone.append([path for path in before if path not in now])
            before = now
    assert all(len(paths) <= 1 for paths in gone)
    assert [path for paths in gone for path in paths] == [
        "000/00",
        "000/98/00000.rid",
        "000/99/00000.rid",
        "000/99",
        "001/00/00000.rid",
        "001/00",
        "002",
        "003/00/00000.rid",
        "003/00",
    ]
    assert before == ["000", "000/98", "000/98/notes.txt", "001", "001/notes.txt", "003", "003/01"]
    # Two steps find and remove ride 0. Three steps find each other ride, remove its part and remove its directory. Two
    # steps find the groups 1 and 2 empty. The last step finds the current ride itself.
    assert len(gone) == 2 + 4 * 3 + 2 + 1


def test_without_the_current_ride_there_is_no_room(root):
    root.free = 0
    ring = RideRing(FLASH)
    ring.begin()
    shutil.rmtree("rides/000")
    with pytest.raises(OSError) as error:
        ring.ready()
    assert ring.fault_code(error.value) == "out-of-room"


class File:
    """Replaces an open file.

    short: number of bytes that each write leaves out.
    error: error that close() raises, or None.
    closed: number of calls of close().
    """

    def __init__(self, short=0, error=None):
        self.short, self.error, self.closed = short, error, 0

    def write(self, piece):
        return len(piece) - self.short

    def close(self):
        self.closed += 1
        if self.error:
            raise self.error


def begun(file, monkeypatch):
    """Return a ring whose first part is this file."""
    monkeypatch.setattr(flash_ring, "open", lambda path, mode: file, raising=False)
    ring = RideRing(FLASH)
    ring.begin()
    while not ring.ready():
        pass
    return ring


def test_an_incomplete_write_means_no_room(root, monkeypatch):
    begun(File(), monkeypatch).write(b"abc")
    ring = begun(File(short=1), monkeypatch)
    with pytest.raises(OSError) as error:
        ring.write(b"abc")
    assert ring.fault_code(error.value) == "out-of-room"


def test_faults_have_their_codes():
    for settings, code in ((FLASH, "flash-fault"), (CARD, "card-fault")):
        ring = RideRing(settings)
        assert ring.fault_code(OSError(5)) == code
        assert ring.fault_code(OSError()) == code
        assert ring.fault_code(OSError(28)) == "out-of-room"
        assert ring.fault_code(MemoryError()) == "out-of-memory"


def test_ending_closes_once_and_abandoning_raises_nothing(root, monkeypatch):
    RideRing(FLASH).end()  # end() of a ring without an open part
    file = File(error=OSError(5))
    ring = begun(file, monkeypatch)
    ring.abandon()
    ring.abandon()
    assert file.closed == 1
    with pytest.raises(OSError):
        begun(file, monkeypatch).end()


def test_free_and_all_bytes_are_blocks_of_the_size_that_counts(monkeypatch):
    """statvfs() returns the block size, the fragment size, the number of all fragments and of free fragments. Only the
    fragment size counts."""
    monkeypatch.setattr("os.statvfs", lambda path: (512, 4096, 300, 200, 190, 0, 0, 0, 0, 255), raising=False)
    assert flash_ring.free_bytes("") == 200 * 4096
    assert flash_ring.all_bytes("") == 300 * 4096


def test_numbers_of_rides_continue(root):
    Path("rides").mkdir()
    assert ride_paths.newest_ride("rides") == 0
    old_ride(root, 99)
    (root.path / "rides/002").mkdir()  # a group without parts, as after a power cut before the first block
    ring = RideRing(FLASH)
    assert ring.begin() == ring.begin() == 100
    write_block(ring)
    assert ring.begin() == 101


def strays(root, *names):
    """Create other directories and files among the rides. Each file has its own content."""
    for name in names:
        path = root.path / "rides" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        if name.endswith("/"):
            path.mkdir(parents=True, exist_ok=True)
        else:
            path.write_text(name)


@pytest.mark.parametrize(
    "names",
    [
        ["999/99/00000.rid"],
        ["999/99/00000.rid", "999/98/00000.rid", "999/97/notes.txt"],
        ["999/99/", "998/", "500/"],
        ["1000/00/00000.rid", "100/5/00000.rid"],
        ["000/01", "000/02"],
        ["000"],
        ["001", "000/99/00000.rid"],
        ["999/98/00003.rid", "999/99/"],
    ],
)
def test_no_stray_name_makes_a_ride_overwrite_another(names, root):
    strays(root, *names)
    before = {path: path.read_bytes() for path in Path("rides").rglob("*") if path.is_file()}
    numbers = []
    for k in range(5):
        ring = RideRing(FLASH)
        numbers.append(ring.begin())
        write_block(ring, 100 + k)
        ring.end()
    assert len(set(numbers)) == 5
    assert {path: path.read_bytes() for path in before} == before
    found = {ride: size for ride, part, size in ride_paths.parts("rides") if ride in numbers}
    assert found == {number: 100 + k for k, number in enumerate(numbers)}  # `pull` lists every ride


def test_an_existing_part_is_never_opened_for_writing(root):
    ring = RideRing(FLASH)
    number = ring.begin()
    path = root.path / ride_paths.part_path("rides", number, 0)
    path.write_bytes(b"a ride")
    write_block(ring)
    ring.end()
    assert path.read_bytes() == b"a ride"
    assert {part: size for _, part, size in ride_paths.parts("rides")} == {0: 6, 1: 100}
