"""The fault script: what goes wrong on the simulated board, and when.

Times are in seconds of the board's clock, I2C addresses have 7 bits.
"""

import builtins
import errno
import io

from .clock import NEVER_US, to_us
from .fakes.erased_file import ErasedFile

_FOREVER = 1 << 60  # a number of transfers
_STALL_S = 0.5  # that a print waits for a host which takes nothing (shared/tinyusb/mp_usbd_cdc.h of MicroPython)


class TransferFault:
    """A fault in the transfers number first to last to one address, if they begin between from_us and until_us.

    kind: "nack"; "timeout"; "corrupt" inverts the bits of mask in the data byte with the number byte; "slip" delays
    what is read by one bit from that byte on. read: the fault is in what is read, else in what is written.
    """

    def __init__(self, kind, address, first, last, from_us=0, until_us=NEVER_US, byte=0, mask=0, read=True):
        self.kind = kind
        self.mask = mask
        self._address = address
        self._numbers = (first, last)
        self._times = (from_us, until_us)
        self._byte = byte
        self._read = read
        self._count = 0
        self._carry = 0

    def applies(self, address, number, now_us):
        """Whether the transfer that begins now has this fault."""
        first, last = self._numbers
        start, end = self._times
        return address == self._address and first <= number <= last and start <= now_us < end

    def begin(self, read):
        """Called at each START: True (the device may answer), False (NACK) or None (the wires are held)."""
        self._count = 0
        return {"nack": False, "timeout": None}.get(self.kind, True)

    def on_write(self, value):
        """What arrives of a byte that the controller sends. Byte 0 is the first, usually the register address."""
        return value if self._read else self._spoil(value)

    def on_read(self, value):
        """What arrives of a byte that a device sends."""
        return self._spoil(value) if self._read else value

    def _spoil(self, value):
        number = self._count
        self._count += 1
        if self.kind == "corrupt":
            return value ^ self.mask if number == self._byte else value
        if number < self._byte:
            return value
        # The device missed a clock: one bit is read twice, and all later bits come one clock late
        late = (value & 0x80 if number == self._byte else self._carry << 7) | value >> 1
        self._carry = value & 1
        return late


class Faults:
    """The faults of one board. Each method adds one to the script; several may act at the same time."""

    def __init__(self, board):
        self._board = board
        self._real_open = None
        self._real_print = None

    # On the wires

    def nack(self, address, nth=1, count=1):
        """The nth transfer to address from now, and count - 1 more, are not acknowledged."""
        self._transfers("nack", address, nth, count)

    def nack_for(self, address, at_s, for_s):
        """No transfer to address is acknowledged for for_s."""
        self._during("nack", address, at_s, for_s)

    def timeout(self, address, nth=1, count=1):
        """The nth transfer to address from now, and count - 1 more, hang until the controller gives up."""
        self._transfers("timeout", address, nth, count)

    def timeout_for(self, address, at_s, for_s):
        """Every transfer to address hangs until the controller gives up, for for_s."""
        self._during("timeout", address, at_s, for_s)

    def corrupt(self, address, nth=1, byte=0, mask=0x01, read=True):
        """In the nth transfer from now the bits of mask are inverted in one byte read (read=False: written)."""
        self._transfers("corrupt", address, nth, 1, byte, mask, read)

    def bit_slip(self, address, nth=1, byte=0):
        """The device misses a clock in the nth transfer from now: what is read from that byte on comes one bit late."""
        self._transfers("slip", address, nth, 1, byte)

    def stuck_sda(self, at_s, bits=8, lcd=False):
        """A device on the sensor's bus (lcd: on the display's) holds SDA low until SCL was clocked `bits` times."""
        bus = self._board.lcd_bus if lcd else self._board.sensor_bus
        self._board.at(at_s, lambda: bus.hang(bits))

    # In the devices

    def supply_dip(self, at_s, leaves="asleep"):
        """The sensor's supply drops for a moment, and its configuration is lost.

        leaves: "asleep" (data 0), "frozen" (asleep, the last data) or "default_ranges" (awake, other scales).
        """
        self._board.at(at_s, lambda: self._board.sensor.supply_dip(leaves))

    def freeze(self, at_s, for_s):
        """The sensor answers and keeps its configuration, but its data no longer change."""
        self._override(at_s, for_s, "freeze")

    def all_zero(self, at_s, for_s):
        """Every data register reads 0."""
        self._override(at_s, for_s, 0x00)

    def all_ones(self, at_s, for_s):
        """Every data register reads 0xFF."""
        self._override(at_s, for_s, 0xFF)

    def unplug_sensor(self, at_s, for_s=None):
        """The sensor is disconnected, for good or for for_s; then it starts as after power-on."""
        self._board.at(at_s, self._board.remove_sensor)
        if for_s is not None:
            self._board.at(at_s + for_s, self._board.fit_sensor)

    def unplug_lcd(self, at_s, for_s=None):
        """The display is disconnected, for good or for for_s; then it starts as after power-on."""
        self._board.at(at_s, self._board.remove_lcd)
        if for_s is not None:
            self._board.at(at_s + for_s, self._board.fit_lcd)

    def lcd_slip(self, at_s):
        """A spike on E shifts the display's pairing of nibbles by one."""
        self._board.at(at_s, self._board.lcd.slip)

    # In the file system

    def file_error(self, ending, at_s, for_s):
        """Files whose name has this ending cannot be opened for reading."""
        self._files(ending, at_s, for_s, False)

    def file_empty(self, ending, at_s, for_s):
        """Files whose name has this ending read as empty, as after a loss of supply."""
        self._files(ending, at_s, for_s, True)

    def slow_flash(self, at_s, for_s, erase_s):
        """Each block of a file that is written is erased for erase_s, in which the program stands."""

        def erase():
            self._board.clock.advance(to_us(erase_s))

        def opened(real, path, mode="r", *more, **named):
            file = real(path, mode, *more, **named)
            return ErasedFile(file, erase) if "w" in mode else file

        self._opened_by(at_s, for_s, opened)

    def restore_files(self):
        """End the faults of the file system."""
        if self._real_open is not None:
            builtins.open = self._real_open
            self._real_open = None

    # On USB

    def usb_asleep(self, at_s, for_s):
        """The host takes nothing: what is printed waits, and is lost."""

        def begin():
            self._real_print = builtins.print
            builtins.print = lambda *_, **__: self._board.clock.advance(to_us(_STALL_S))

        self._board.at(at_s, begin)
        self._board.at(at_s + for_s, self.restore_print)

    def restore_print(self):
        """End usb_asleep()."""
        if self._real_print is not None:
            builtins.print = self._real_print
            self._real_print = None

    def _transfers(self, kind, address, nth, count, byte=0, mask=0, read=True):
        for bus in self._board.buses:
            first = bus.transfers.get(address, 0) + nth
            bus.faults.append(
                TransferFault(kind, address, first, first + count - 1, byte=byte, mask=mask, read=read)
            )

    def _during(self, kind, address, at_s, for_s):
        for bus in self._board.buses:
            bus.faults.append(TransferFault(kind, address, 0, _FOREVER, to_us(at_s), to_us(at_s + for_s)))

    def _override(self, at_s, for_s, value):
        self._board.at(at_s, lambda: self._board.sensor.override(value))
        self._board.at(at_s + for_s, lambda: self._board.sensor.override(None))

    def _files(self, ending, at_s, for_s, empty):
        def failing(real, path, mode="r", *more, **named):
            if not str(path).endswith(ending) or "r" not in mode or "+" in mode:
                return real(path, mode, *more, **named)
            if not empty:
                raise OSError(errno.EIO)
            return io.BytesIO() if "b" in mode else io.StringIO()

        self._opened_by(at_s, for_s, failing)

    def _opened_by(self, at_s, for_s, opened):
        """For for_s files are opened by opened(the real open(), its arguments)."""

        def begin():
            self.restore_files()
            self._real_open = real = builtins.open
            builtins.open = lambda *arguments, **named: opened(real, *arguments, **named)

        self._board.at(at_s, begin)
        self._board.at(at_s + for_s, self.restore_files)
