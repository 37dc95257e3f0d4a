"""The fault script: what goes wrong on the simulated board, and when.

Times are in seconds of the board's clock, I2C addresses have 7 bits.
"""

import builtins
import errno
import io

from .clock import PowerOff, to_us
from .fakes.files import ErasedFile, FailingFile
from .i2c import TransferFault

_FOREVER = 1 << 60  # a number of transfers
_STALL_S = 0.5  # that a print waits for a host which takes nothing (shared/tinyusb/mp_usbd_cdc.h of MicroPython)


class Faults:
    """The faults of one board. Each method adds one to the script; several may act at the same time."""

    def __init__(self, board):
        self._board = board
        self._real_open = None
        self.files_cut = 0
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

    def cut(self, address, at_s, byte):
        """The first transfer to address after at_s that has so many bytes breaks off at byte `byte`."""

        def begin():
            self._transfers("cut", address, 1, _FOREVER, byte, read=False)

        self._board.at(at_s, begin)

    def stuck_sda(self, at_s, bits=8, lcd=False):
        """A device on the sensor's bus (lcd: on the display's) holds SDA low until SCL was clocked `bits` times."""
        bus = self._board.lcd_bus if lcd else self._board.sensor_bus
        self._board.at(at_s, lambda: bus.hang(bits))

    # In the devices

    def supply_dip(self, at_s, leaves="asleep"):
        """The sensor's supply drops for a moment, and its configuration is lost.

        leaves: "asleep" (data 0), "frozen" (asleep, the last data), "default_ranges" (awake, other scales) or "torn"
        (asleep, and the frame that was being read ends in garbage).
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

    def wheel_storm(self, at_s, for_s, pulses_per_s):
        """An ignition cable induces pulses in the cable of the wheel contact."""
        wheel = self._board.wheel

        def set_to(pulses_per_s):
            wheel.noise_hz = pulses_per_s

        self._board.at(at_s, lambda: set_to(pulses_per_s))
        self._board.at(at_s + for_s, lambda: set_to(0))

    def busy(self, at_s, for_s, times=1):
        """Something else takes all of the processor's time for for_s, `times` times with 30 ms between them."""

        def begin(left):
            self._board.clock.advance(to_us(for_s))
            if left > 1:
                self._board.clock.at(self._board.clock.now_us + 30_000, lambda: begin(left - 1))

        self._board.at(at_s, lambda: begin(times))

    # In the file system

    def disk_full(self, at_s, for_s):
        """Nothing can be written to a file."""

        def begin():
            self._replace_open(lambda file, path: FailingFile(file, 0, OSError(errno.ENOSPC)))

        self._board.at(at_s, begin)
        self._board.at(at_s + for_s, self.restore_files)

    def cut_file(self, ending, length):
        """The supply is cut when `length` bytes of the next file with this ending are written. Then files_cut is 1."""

        def wrap(file, path):
            if not path.endswith(ending):
                return file
            self.files_cut += 1
            return FailingFile(file, length, PowerOff())

        self._replace_open(wrap)

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

    def _replace_open(self, wrap):
        """Files opened for writing become wrap(file, path)."""
        self.restore_files()
        self._real_open = real = builtins.open

        def opening(path, mode="r", *more, **named):
            file = real(path, mode, *more, **named)
            return wrap(file, str(path)) if "w" in mode else file

        builtins.open = opening

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
            bus.faults.append(TransferFault(kind, address, first, first + count - 1, byte=byte, mask=mask, read=read))

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
