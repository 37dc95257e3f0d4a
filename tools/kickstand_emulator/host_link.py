"""Adds registers through which code on the emulated Pico exchanges bytes with the host.

The real chip does not have these registers. The registers are faster than the console, on which every byte costs the
Pico time. GUEST is the code for the Pico.
"""

from collections.abc import Callable
from typing import Any

from rp2040py.memory_map import RAM_START_ADDRESS
from rp2040py.peripherals.peripheral import BasePeripheral

from .chip import EmulatedChip

_PLACE = 0x40068  # address of the registers, shifted right by 12 bits. On the real chip the address is reserved
_COUNT, _FILL, _TAKE = 0x0, 0x4, 0x8

GUEST = """
from machine import mem32
from uctypes import addressof
class Source:
    def __init__(self):
        self.buffer = bytearray(512)
        self.address = addressof(self.buffer)
        self.view = memoryview(self.buffer)
    def read(self, count):
        mem32[0x40068000] = count
        mem32[0x40068004] = self.address
        return self.view[:mem32[0x40068000]]
class Sink:
    def write(self, data):
        mem32[0x40068000] = len(data)
        mem32[0x40068008] = addressof(data)
"""


class HostLink(BasePeripheral):
    """The registers of the link.

    source: Bytes that Source.read() on the Pico returns, in this order.
    sink: Function that is called with the bytes that the Pico's code passes to Sink.write().
    """

    def __init__(self, chip: EmulatedChip, source: bytes, sink: Callable[[bytes], Any]) -> None:
        super().__init__(chip.rp2040, "HOST_LINK")
        self._source = source
        self._sink = sink
        self._at = self._count = 0
        chip.rp2040.peripherals[_PLACE] = self

    def read_uint32(self, offset: int) -> int:
        """Return the number of bytes that the last FILL copied."""
        return self._count

    def write_uint32(self, offset: int, value: int) -> None:
        """Write a register.

        COUNT sets the number of bytes. FILL copies COUNT bytes from the source to the address `value` in RAM. TAKE
        copies COUNT bytes from the address `value` to the sink.
        """
        start = value - RAM_START_ADDRESS
        if offset == _COUNT:
            self._count = value
        elif offset == _FILL:
            data = self._source[self._at : self._at + self._count]
            self._at += len(data)
            self._count = len(data)
            self.rp2040.sram[start : start + len(data)] = data
        elif offset == _TAKE:
            self._sink(bytes(self.rp2040.sram[start : start + self._count]))
