"""The ring of rides: the room for a part, the removal of the oldest ride, and the paths of files."""

import errno
import re
import shutil
from pathlib import Path
from types import SimpleNamespace

import pytest
from kickstand.rides import flash_ring, ride_paths
from kickstand.rides.block import block_length
from rings import CARD, FLASH, KB_4, old_ride, ride_ring, write_block
from support.recordings import ride_writer


@pytest.mark.parametrize(("settings", "blocks"), [(FLASH, 16), (CARD, 256)])
def test_part_has_16_blocks_in_flash_and_256_on_a_card(settings, blocks, root):
    root.free = root.all = 2000 * KB_4
    ring = ride_ring(settings)
    assert ring.stops_interrupts is (settings is FLASH)
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
    """A part needs its 16 blocks and two blocks of directories, beside the reserve."""
    needed = flash_ring.RESERVE + 18 * KB_4
    for free, steps in ((needed, 1), (needed - KB_4, 3)):
        directory = old_ride(root, 1)
        root.free = free
        ring = ride_ring(FLASH)
        assert ring.begin() > 1
        assert write_block(ring) == steps  # the steps are: find the oldest ride, remove its part, open the new part
        assert (directory / "00000.rid").exists() is (steps == 1)
        ring.end()


def test_its_own_first_parts_are_removed_last(root):
    root.free = flash_ring.RESERVE + 18 * KB_4
    old_ride(root, 1)
    ring = ride_ring(FLASH)
    assert ring.begin() == 2
    for _ in range(16):
        write_block(ring, KB_4)
    assert sorted(ride_paths.parts("rides")) == [(1, 0, KB_4), (2, 0, 16 * KB_4)]
    rooms = [ring.room()]
    while not ring.ready():
        root.free = flash_ring.RESERVE + 3 * KB_4
        rooms.append(ring.room())
    # The steps are: find ride 1, remove its part and its directory, find ride 2, remove its part, open the next part
    assert [room > 0 for room in rooms] == [True] * 5 + [False] * 2
    assert [part for part in ride_paths.parts("rides") if part[1] == 0] == []
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

    steps, left = [], paths()
    with pytest.raises(OSError) as error:
        for _ in range(50):
            assert not ring.ready()
            steps.append([path for path in left if path not in paths()])
            left = paths()
    assert error.value.args[0] == errno.ENOSPC and all(len(removed) <= 1 for removed in steps)
    assert [path for removed in steps for path in removed] == [
        "000/00", "000/98/00000.rid", "000/99/00000.rid", "000/99", "001/00/00000.rid", "001/00", "002",
        "003/00/00000.rid", "003/00",
    ]  # fmt: skip
    assert left == ["000", "000/98", "000/98/notes.txt", "001", "001/notes.txt", "003", "003/01"]
    # Two steps find and remove ride 0. Three steps find each other ride, remove its part and remove its directory. Two
    # steps find the groups 1 and 2 empty. The last step finds the current ride itself.
    assert len(steps) == 2 + 4 * 3 + 2 + 1


def test_without_the_current_ride_there_is_no_room(root):
    root.free = 0
    ring = ride_ring(FLASH)
    ring.begin()
    shutil.rmtree("rides/000")
    with pytest.raises(OSError) as error:
        ring.ready()
    assert ring.fault_code(error.value) == "out-of-room"


class FullFile:
    """An open file on a full flash. closed: number of calls of close(), each of which fails."""

    closed = 0

    def write(self, piece):
        return len(piece) - 1

    def close(self):
        self.closed += 1
        raise OSError(5)


def test_full_flash_ends_a_ride_and_its_file_is_closed_once(root, monkeypatch):
    file = FullFile()
    monkeypatch.setattr("builtins.open", lambda path, mode: file)
    ring = ride_ring(FLASH)
    ring.end()  # end() of a ring without an open part
    ring.begin()
    while not ring.ready():
        pass
    with pytest.raises(OSError) as error:
        ring.write(b"abc")
    assert ring.fault_code(error.value) == "out-of-room"
    ring.abandon()
    ring.abandon()
    assert file.closed == 1
    while not ring.ready():
        pass
    with pytest.raises(OSError):
        ring.end()


@pytest.mark.parametrize(
    ("settings", "error", "code"),
    [
        (FLASH, OSError(5), "flash-fault"), (CARD, OSError(5), "card-fault"), (FLASH, OSError(), "flash-fault"),
        (FLASH, OSError(28), "out-of-room"), (CARD, OSError(28), "out-of-room"), (CARD, MemoryError(), "out-of-memory"),
    ],
)  # fmt: skip
def test_faults_have_their_codes(settings, error, code):
    assert ride_ring(settings).fault_code(error) == code


def test_free_and_all_bytes_are_blocks_of_the_size_that_counts(root):
    """Of the block size and the fragment size of statvfs(), only the fragment size counts."""
    root.free, root.all = 200 * KB_4, 300 * KB_4
    assert (flash_ring.free_bytes(""), flash_ring.all_bytes("")) == (root.free, root.all)


def test_numbers_of_rides_continue(root):
    Path("rides").mkdir()
    assert ride_paths.newest_ride("rides") == 0
    old_ride(root, 99)
    (root.path / "rides/002").mkdir()  # a group without parts, as after a power cut before the first block
    ring = ride_ring(FLASH)
    assert ring.begin() == ring.begin() == 100
    write_block(ring)
    ring.end()
    assert ring.begin() == 101


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
    sizes = {ride: size for ride, part, size in ride_paths.parts("rides") if ride in numbers}
    assert sizes == {number: 100 + k for k, number in enumerate(numbers)}  # `pull` lists every ride


def test_existing_part_is_never_opened_for_writing(root):
    ring = ride_ring(FLASH)
    path = root.path / ride_paths.part_path("rides", ring.begin(), 0)
    path.write_bytes(b"a ride")
    write_block(ring)
    ring.end()
    assert path.read_bytes() == b"a ride"
    assert {part: size for _, part, size in ride_paths.parts("rides")} == {0: 6, 1: 100}


# The recording times in firmware/docs/rides.md

PAGE = Path(__file__).resolve().parents[2] / "firmware" / "docs" / "rides.md"
BYTES_S = 1024  # the recorder assumes this rate until it has measured a block
# Size of the file system in MicroPython's images, in KB. The sources are ports/rp2/boards/*/mpconfigboard.cmake and
# ports/esp32/partitions-4MiBplus.csv.
FLASH_KB = {"Pico": 1408, "Pico W": 848, "Pico 2": 3072, "Pico 2 W": 2560, "ESP32 with 4 MB of flash": 2048}


def room_s(root, settings, size, used):
    """Return the recording time in s that a board reports if its flash or card has no rides."""
    root.all, root.free = size, size - used
    ring = ride_ring(SimpleNamespace(SD_SPI=settings.SD_SPI) if settings is CARD else FLASH)
    ring.begin()
    return ring.room() / BYTES_S


def test_recording_times_are_those_of_the_page(root):
    section = PAGE.read_text(encoding="utf-8").partition("| recorded to |")[2].partition("\n\n")[0]
    rows = {name.strip(): int(value) for name, value in re.findall(r"^\| ([^|]+) \| (\d+) ", section, re.MULTILINE)}
    for board, size_kb in FLASH_KB.items():
        assert rows[board] == int(room_s(root, FLASH, size_kb * 1024, flash_ring.FIRMWARE) / 60)
    assert rows["SD card, for each GB"] == int(room_s(root, CARD, 10**9, 0) / 3600)
    written, turns = ride_writer.blocks(10)
    bytes_s = sum(map(len, written)) / (sum(dt_us for *_, dt_us in turns) / 1e6)
    assert 0.5 * BYTES_S < bytes_s <= BYTES_S  # a rough ride takes no more
