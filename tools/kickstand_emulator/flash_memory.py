"""Makes rp2040py's flash realistic. Erasing and programming take time, and the processor stops during that time.

Tests can also cut the power in the middle of an erase or program operation.
"""

from collections.abc import Callable

from rp2040py.peripherals.ssi import (
    CMD_BLOCK_ERASE,
    CMD_PAGE_PROGRAM,
    CMD_SECTOR_ERASE,
    FLASH_BLOCK_SIZE,
    FLASH_PAGE_SIZE,
    FLASH_SECTOR_SIZE,
    RPSSI,
)
from rp2040py.rp2040 import RP2040

ERASE_MS = {CMD_SECTOR_ERASE: 45.0, CMD_BLOCK_ERASE: 150.0}  # typical times of a W25Q16JV to erase 4 KB and 64 KB
PROGRAM_MS = 0.5  # typical time to program a page of 256 bytes


class PowerCut(Exception):
    """The power was cut. TimedFlash raises it in the operation chosen by cut_power(), and Pico.run() catches it."""


class TimedFlash(RPSSI):
    """rp2040py's flash interface, in which erasing and programming take time.

    operations: number of erase and program operations that have begun.
    before_operation: function that is called before each operation, or None.
    """

    def __init__(self, rp2040: RP2040, name: str) -> None:
        rp2040.qspi[1]._listeners.clear()  # disconnect rp2040py's own interface, which this class replaces
        super().__init__(rp2040, name)
        self.operations = 0
        self.before_operation: Callable[[], None] | None = None
        self._cut_at = 0
        self._cut_share = 0.0

    def cut_power(self, operation: int, share: float = 0.0) -> None:
        """Raise PowerCut in a later erase or program operation.

        operation: Number of the operation, 1 for the next one.
        share: Share of the operation that is completed before the cut, 0 to 1.
        """
        self._cut_at = self.operations + operation
        self._cut_share = share

    def _apply_command(self) -> None:
        opcode = self._tx_buffer[0] if self._tx_buffer else 0
        if not self._write_enabled or len(self._tx_buffer) < 4 or opcode not in (*ERASE_MS, CMD_PAGE_PROGRAM):
            super()._apply_command()
            return
        self.operations += 1
        if self.before_operation:
            self.before_operation()
        if self.operations == self._cut_at:
            self._tear(opcode)
            raise PowerCut
        super()._apply_command()
        self.rp2040.clock.tick(ERASE_MS.get(opcode, PROGRAM_MS) * 1e6)

    def _tear(self, opcode: int) -> None:
        address = self._address_from_buffer()
        flash = self.rp2040.flash
        if opcode == CMD_PAGE_PROGRAM:
            page = self._tx_buffer[4 : 4 + FLASH_PAGE_SIZE]
            for i in range(round(len(page) * self._cut_share)):
                flash[address + i] &= page[i]
        else:
            count = round((FLASH_SECTOR_SIZE if opcode == CMD_SECTOR_ERASE else FLASH_BLOCK_SIZE) * self._cut_share)
            flash[address : address + count] = b"\xff" * count
