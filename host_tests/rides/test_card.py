"""Rides on a card with MicroPython's own FAT: no step of the recorder takes long, and a power cut loses one block."""

import contextlib
import io
import json
import os
import types

import pytest
from kickstand.errors import CardError
from kickstand.rides import ride_paths
from rings import CARD
from support.mpy import run_mpy

SECTOR_S = 3.1e-3  # time to transfer a sector at 1.32 MHz, including the commands
TURN_S, BEGIN_S = 0.1, 1.0

# A card of 32 GB. Only the card's sectors that are not zero are kept in RAM. The card's clusters have the usual 32 KB.
_CARD = """
import json, os
from kickstand.rides import flash_ring, ride_paths
from kickstand.rides.flash_ring import RideRing

class Card:
    def __init__(self):
        self.sectors, self.moved, self.on_write, self.empty = {}, 0, None, bytes(512)
    def readblocks(self, n, buf):
        for i in range(len(buf) // 512):
            buf[i * 512 : i * 512 + 512] = self.sectors.get(n + i, self.empty)
        self.moved += len(buf) // 512
    def writeblocks(self, n, buf):
        for i in range(len(buf) // 512):
            data = bytes(buf[i * 512 : i * 512 + 512])
            if self.on_write:
                self.on_write()
            if data == self.empty:
                self.sectors.pop(n + i, None)
            else:
                self.sectors[n + i] = data
        self.moved += len(buf) // 512
    def ioctl(self, op, arg):
        return {4: 32 * 1024 * 2048, 5: 512}.get(op, 0)

class Settings:
    SD_SPI = 0

ride_paths.directory = lambda _settings: "/sd/rides"
card = Card()
os.VfsFat.mkfs(card)
os.mount(os.VfsFat(card), "/sd")
"""

_MANY = """
def moved(function):
    before = card.moved
    result = function()
    return card.moved - before, result

ring = RideRing(Settings)
for _ in range(RIDES):
    ring.begin()
    for _ in range(PARTS):
        while not ring.ready():
            pass
        ring.write(b"KRID")
        ring.end()
os.umount("/sd")
os.mount(os.VfsFat(card), "/sd")
ring = RideRing(Settings)
sectors = {"begin": moved(ring.begin)[0], "open": [], "room": [], "block": []}
for _ in range(85):  # a day
    ready = False
    while not ready:
        count, ready = moved(ring.ready)
        sectors["open"].append(count)
    for _ in range(4):
        sectors["block"].append(moved(lambda: ring.write(bytes(256)))[0])
    sectors["block"].append(moved(ring.end_block)[0])
    ring.end()
flash_ring.free_bytes = lambda path: 0
ring._free = 0
for _ in range(min(3, RIDES) * PARTS + 2):
    sectors["room"].append(moved(ring.ready)[0])
print(json.dumps(sectors))
"""


@pytest.mark.parametrize(("rides", "parts"), [(40, 25), pytest.param(2000, 1, marks=pytest.mark.long), (20, 85)])
def test_no_pass_waits_long_for_a_card(rides, parts):
    sectors = json.loads(run_mpy(_CARD + _MANY.replace("RIDES", str(rides)).replace("PARTS", str(parts))))
    assert sectors.pop("begin") * SECTOR_S < BEGIN_S
    assert all(max(counts) * SECTOR_S < TURN_S for counts in sectors.values()), sectors


# The board records four rides. The first ride is removed to make room for the fourth. The power is cut before each
# write of a sector. Completed blocks must be kept, and the next ride must be recorded.
_CUTS = """
states = []
safe = {}  # blocks of each ride
card.on_write = lambda: states.append((card.sectors.copy(), safe.copy()))

def record(blocks):
    ring = RideRing(Settings)
    ring._part_blocks, ring.needed = 2, 4 * 4096
    ride = ring.begin()
    if ride == 4 and card.on_write:
        ring._free = 0
        safe.pop(1)
    for block in range(blocks):
        while not ring.ready():
            pass
        for _ in range(16):
            ring.write(bytes([ride]) * 256)
        ring.end_block()
        safe[ride] = block + 1
    ring.end()
    return ride

def held():
    blocks = {}
    for ride, part, size in ride_paths.parts("/sd/rides"):
        with open(ride_paths.part_path("/sd/rides", ride, part), "rb") as file:
            data = file.read()
        assert data == bytes([ride]) * size
        blocks[ride] = blocks.get(ride, 0) + size // 4096
    return blocks

for _ in range(4):
    record(3)
assert 1 not in held()
card.on_write = None
os.umount("/sd")
last = None
for sectors, blocks in states:
    if sectors == last:
        continue
    last = sectors
    card.sectors = sectors.copy()
    os.mount(os.VfsFat(card), "/sd")
    found = held() if "rides" in os.listdir("/sd") else {}
    assert all(found.get(ride, 0) >= count for ride, count in blocks.items()), (found, blocks)
    new = record(1)
    found = held()
    assert found[new] == 1 and all(found.get(ride, 0) >= blocks[ride] for ride in blocks if ride > 1), (found, blocks)
    os.umount("/sd")
print(len(states))
"""


def test_after_any_power_cut_a_card_loses_only_the_last_block():
    assert int(run_mpy(_CARD + _CUTS)) > 300


# The board has a folder /sd in its flash, and a card.
_FOLDER = """
import os
from kickstand_tools.simulated_board.simulator import Board
Board(lambda t_s: (0, 0, 1, 0, 0, 0)).install()
from kickstand.board import port, sd_card

class Ram:
    def __init__(self, size):
        self.data = bytearray(size)
    def readblocks(self, n, buf, offset=0):
        buf[:] = self.data[n * 512 + offset : n * 512 + offset + len(buf)]
    def writeblocks(self, n, buf, offset=0):
        self.data[n * 512 + offset : n * 512 + offset + len(buf)] = buf
    def ioctl(self, op, arg):
        return {4: len(self.data) // 512, 5: 512}.get(op, 0)

opened = []
def open_sd_card(*pins):
    opened.append(pins)
    return card
class Settings:
    SD_SPI, SD_SCK, SD_MOSI, SD_MISO, SD_CS = 0, 18, 19, 16, 17

port.open_sd_card = open_sd_card
flash, card = Ram(1 << 16), Ram(1 << 18)
os.VfsFat.mkfs(card)
os.VfsLfs2.mkfs(flash)
os.umount("/")
os.mount(os.VfsLfs2(flash), "/")
os.mkdir("/sd")
for _ in range(3):
    assert sd_card.mount(Settings) == "/sd"
with open("/sd/ride", "w") as file:
    file.write("on the card")
assert len(opened) == 1
os.umount("/sd")
assert os.listdir("/sd") == [], os.listdir("/sd")
os.mount(os.VfsFat(card), "/sd")  # as the board's own boot.py may do it
assert sd_card.mount(Settings) == "/sd"
assert os.listdir("/sd") == ["ride"]
print(len(opened))
"""


def test_folder_in_the_flash_is_not_the_card():
    """A copy of a card's files may leave a folder /sd in the flash. Rides must not be written there."""
    assert int(run_mpy(_FOLDER)) == 1


# The trial of a card before a ride


def raises(error):
    def call(*_):
        raise error

    return call


REFUSAL = CardError("no-driver")


@pytest.mark.parametrize(
    ("fault", "error"),
    [
        (None, None),
        ("mount", REFUSAL),
        *(("statvfs", error) for error in (OSError(5), ValueError("a driver's own"), MemoryError())),
        ("read back", OSError(5)),
    ],
)
def test_card_is_tested_before_it_is_needed(fault, error, root, monkeypatch):
    from kickstand.rides import card_trial

    if fault == "mount":
        monkeypatch.setattr(ride_paths, "directory", raises(error))
    elif fault == "statvfs":
        monkeypatch.setattr(os, "statvfs", raises(error))
    elif fault:
        (root.path / "card").mkdir()
        (root.path / "card" / "probe").symlink_to(os.devnull)
    recorder = types.SimpleNamespace(problem=None, keeper=types.SimpleNamespace(refused=None))
    with contextlib.redirect_stdout(io.StringIO()) as console:
        card_trial.prepare(recorder, CARD)
    problem = recorder.problem
    assert problem is recorder.keeper.refused and console.getvalue().count("\n") == (fault is not None)
    if not fault:
        assert problem is None and os.listdir("card") == []  # the test file was removed
    elif error is REFUSAL:
        assert problem is REFUSAL
    else:
        assert isinstance(problem, CardError) and (problem.code, problem.values) == ("no-card", (str(error),))
