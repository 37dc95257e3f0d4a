"""A position on the emulated Pico, with its floats of 32 bits and small integers of 31: from the wire to the block."""

import pytest
from kickstand_tools.rides import block_reader
from kickstand_tools.simulated_board.gps import sentence

pytestmark = pytest.mark.chip

TEXT = sentence("GPRMC,235959.97,A,8959.99999,S,17959.99998,W,19.438,084.4,311226,,,A")

_RUN = """
import gc
from time import ticks_diff, ticks_ms, ticks_us
from kickstand.rides.block import RideBlock
from kickstand.speed.gps import Gps
class Uart:
    data = %r
    def any(self):
        return len(self.data)
    def read(self, n):
        data, self.data = self.data[:n], self.data[n:]
        return data
class Chip:
    accel_lsb_per_g, gyro_lsb_per_dps, gyro_delay_s = 4096, 65.5, 0.0134
    def temperature_c(self, counts):
        return 31.25
gps = Gps(Uart())
block = RideBlock(5000)
block.begin(512, 7, 3, 5, Chip(), 200, bytes(80))
gps.poll(990)
gps.poll(1000)
gc.collect()
before, begun_us = gc.mem_alloc(), ticks_us()
place = gps.place(1000)
took_us, heap = ticks_diff(ticks_us(), begun_us), gc.mem_alloc() - before
block.add_place(place)
block.add([200] * 7, 2, 10000)
block.close()
print(took_us, heap)
print("".join("%%02x" %% byte for byte in block.buffer[:512]))
"""


def test_a_position_is_exact_on_the_chip_quick_and_takes_little_heap(at_prompt):
    costs, block = at_prompt.exec(_RUN % TEXT.encode(), 20.0).split("\n")[:2]
    turn = block_reader.parse(bytes.fromhex(block.strip())).turns[0]
    assert turn.place == block_reader.Place(-89.0 - 59.99999 / 60, -179.0 - 59.99998 / 60, 1_798_761_599.97)
    took_us, heap = map(int, costs.split())
    assert took_us < 2000
    assert heap < 200
