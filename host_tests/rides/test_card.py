"""Rides on a card with MicroPython's own FAT: a power cut loses one block."""

from support.mpy import run_mpy

# A card of 32 GB. Only the card's sectors that are not zero are kept in RAM. The card's clusters have the usual 32 KB.
_CARD = """
import os
from kickstand.rides import ride_files
from kickstand.rides.ride_files import RideFiles

class Card:
    def __init__(self):
        self.sectors, self.on_write, self.empty = {}, None, bytes(512)
    def readblocks(self, n, buf):
        for i in range(len(buf) // 512):
            buf[i * 512 : i * 512 + 512] = self.sectors.get(n + i, self.empty)
    def writeblocks(self, n, buf):
        for i in range(len(buf) // 512):
            data = bytes(buf[i * 512 : i * 512 + 512])
            if self.on_write:
                self.on_write()
            if data == self.empty:
                self.sectors.pop(n + i, None)
            else:
                self.sectors[n + i] = data
    def ioctl(self, op, arg):
        return {4: 32 * 1024 * 2048, 5: 512}.get(op, 0)

class Settings:
    SD_SPI = 0

ride_files.directory = lambda _settings: "/sd/rides"
card = Card()
os.VfsFat.mkfs(card)
os.mount(os.VfsFat(card), "/sd")
"""

# The board records four rides. The first ride is removed to make room for the fourth. The power is cut before each
# write of a sector. Completed blocks must be kept, and the next ride must be recorded.
_CUTS = """
states = []
safe = {}  # blocks of each ride
card.on_write = lambda: states.append((card.sectors.copy(), safe.copy()))

def record(blocks):
    ring = RideFiles(Settings)
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
    for ride, part, size in ride_files.parts("/sd/rides"):
        with open(ride_files.part_path("/sd/rides", ride, part), "rb") as file:
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
