"""The ring of rides: its parts, the removal of the oldest ride, and the paths of files."""

import errno
from pathlib import Path

import pytest
from kickstand.rides import ride_files
from rings import FLASH, KB_4, old_ride, ride_ring, write_block


def test_its_own_first_parts_are_removed_last(root):
    root.free = ride_files.RESERVE + 18 * KB_4
    old_ride(root, 1)
    ring = ride_ring(FLASH)
    assert ring.begin() == 2
    for _ in range(16):
        write_block(ring, KB_4)
    assert sorted(ride_files.parts("rides")) == [(1, 0, KB_4), (2, 0, 16 * KB_4)]
    rooms = [ring.room()]
    while not ring.ready():
        root.free = ride_files.RESERVE + 3 * KB_4
        rooms.append(ring.room())
    # The steps are: find ride 1, remove its part and its directory, find ride 2, remove its part, open the next part
    assert [room > 0 for room in rooms] == [True] * 5 + [False] * 2
    assert [part for part in ride_files.parts("rides") if part[1] == 0] == []
    assert not (root.path / "rides/000/01").exists()
    ring.end()


def test_oldest_rides_are_removed_first(root):
    """Each step removes one file or one directory. Rides without parts are skipped. The owner's files are kept."""
    for ride in (98, 99, 100, 300):
        old_ride(root, ride)
    (root.path / "rides/000/98/notes.txt").write_bytes(b"the rider's own")
    (root.path / "rides/001/notes.txt").write_bytes(b"the rider's own")
    (root.path / "rides/002").mkdir()
    (root.path / "rides/000/00").mkdir()
    root.free = 10 * KB_4
    ring = ride_ring(FLASH)
    assert ring.begin() == 301

    def paths():
        return sorted(path.relative_to("rides").as_posix() for path in Path("rides").rglob("*"))

    steps, remaining = [], paths()
    with pytest.raises(OSError) as error:
        for _ in range(50):
            assert not ring.ready()
            steps.append([path for path in remaining if path not in paths()])
            remaining = paths()
    assert error.value.args[0] == errno.ENOSPC and all(len(removed) <= 1 for removed in steps)
    assert [path for removed in steps for path in removed] == [
        "000/00", "000/98/00000.rid", "000/99/00000.rid", "000/99", "001/00/00000.rid", "001/00", "002",
        "003/00/00000.rid", "003/00",
    ]  # fmt: skip
    assert remaining == ["000", "000/98", "000/98/notes.txt", "001", "001/notes.txt", "003", "003/01"]
    # Two steps find and remove ride 0. Three steps find each other ride, remove its part and remove its directory. The
    # last step finds the current ride itself.
    assert len(steps) == 2 + 4 * 3 + 1


@pytest.mark.parametrize(
    "names",
    [
        ["999/99/00000.rid"],
        ["999/99/00000.rid", "999/98/00000.rid", "999/97/notes.txt"],
        ["001", "000/99/00000.rid"],
        ["999/98/00003.rid", "999/99/"],
    ],
)
def test_no_stray_name_makes_a_ride_overwrite_another(names, root):
    for name in names:
        path = root.path / "rides" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        if name.endswith("/"):
            path.mkdir(parents=True, exist_ok=True)
        else:
            path.write_text(name)
    contents = {path: path.read_bytes() for path in Path("rides").rglob("*") if path.is_file()}
    numbers = []
    for k in range(5):
        ring = ride_ring(FLASH)
        numbers.append(ring.begin())
        write_block(ring, 100 + k)
        ring.end()
    assert len(set(numbers)) == 5 and {path: path.read_bytes() for path in contents} == contents
    sizes = {ride: size for ride, part, size in ride_files.parts("rides") if ride in numbers}
    assert sizes == {number: 100 + k for k, number in enumerate(numbers)}  # `pull` lists every ride
