"""What a quick GPS receiver costs on an emulated Pico. Prints the figures of cars.md."""

import re

import pytest
from kickstand_sim.simulated_board.gps import sentence
from support.emulated import modules, pico

pytestmark = [pytest.mark.chip, pytest.mark.long]

PROGRAM = """
import gc, time
from kickstand.speed.gps import Gps
class Wire:
    data = b""
    def any(self):
        return len(self.data)
    def read(self, n):
        data, self.data = self.data[:n], self.data[n:]
        return data
wire = Wire()
gps, now_ms, turns, worst_us, heap = Gps(wire), 1000, 0, 0, 0
for second in range(3):
    burst = {burst!r}.replace(b"120001", b"12000" + str(second).encode())
    for place in range(0, len(burst), 115):
        wire.data += burst[place : place + 115]
        gc.collect()
        used, begin_us = gc.mem_alloc(), time.ticks_us()
        gps.poll(now_ms)
        worst_us = max(worst_us, time.ticks_diff(time.ticks_us(), begin_us))
        heap, now_ms, turns = heap + gc.mem_alloc() - used, now_ms + 10, turns + 1
print("FIGURES", worst_us, heap // turns)
"""


def test_40_satellites_at_115200_baud_take_few_ms_and_bytes():
    gsv = [f"GPGSV,10,{k},40,01,40,083,46,02,17,308,41,12,07,344,39,14,22,228,45,1" for k in range(1, 11)]
    rmc = "GNRMC,120001.00,A,4807.03800,N,01131.00000,E,9.719,84.4,211126,,,A,V"
    burst = "".join(map(sentence, [*gsv, rmc, "GNVTG,84.4,T,,M,9.719,N,18.0,K,A"])).encode()
    with pico(files=modules() | {"/gps_cost.py": PROGRAM.format(burst=burst).encode()}) as device:
        figures = re.search(r"FIGURES (\d+) (\d+)", device.exec("import gps_cost", 120.0))
    assert figures
    worst_us, heap = map(int, figures.groups())
    print(f"longest poll {worst_us / 1000:.1f} ms, {heap} bytes of heap per pass")
    assert worst_us < 2500 and heap < 900
