"""The fault script: faults on the simulated board, with their times.

Times are in seconds of the board's clock. I2C addresses have 7 bits.
"""

import builtins
import errno
import io

from .clock import PowerOff, to_us
from .i2c import TransferFault

_FOREVER = 1 << 60  # a number of transfers
_BLOCK = 4096  # bytes of flash that are erased at once
_STALL_S = 0.5  # time-out of print() if the host reads nothing (shared/tinyusb/mp_usbd_cdc.h of MicroPython)


class Faults:
    """The faults of one board. Each method adds a fault to the script. Several faults may act at the same time."""

    def __init__(self, board):
        self._board = board
        self._real = {}  # the replaced builtin functions by name
        self.files_cut = 0

    # On the wires

    def nack(self, address, nth=1, count=1):
        """Do not acknowledge `count` transfers to address, beginning with the nth from now."""
        self._transfers("nack", address, nth, count)

    def nack_for(self, address, at_s, for_s):
        """From at_s on, acknowledge no transfer to address. This lasts for for_s."""
        self._during("nack", address, at_s, for_s)

    def timeout(self, address, nth=1, count=1):
        """Let `count` transfers to address hang until the controller gives up, beginning with the nth from now."""
        self._transfers("timeout", address, nth, count)

    def timeout_for(self, address, at_s, for_s):
        """From at_s on, every transfer to address hangs until the controller gives up. This lasts for for_s."""
        self._during("timeout", address, at_s, for_s)

    def corrupt(self, address, nth=1, byte=0, mask=0x01):
        """Invert bits in a byte that the nth transfer from now reads. byte: number of the byte. mask: the bits."""
        self._transfers("corrupt", address, nth, 1, byte, mask)

    def cut(self, address, at_s, byte):
        """Interrupt the first transfer to address after at_s that reaches byte number `byte`, at this byte."""
        self._board.at(at_s, lambda: self._transfers("cut", address, 1, _FOREVER, byte))

    def stuck_sda(self, at_s, bits=8, lcd=False):
        """Let a device on the sensor's bus, or the display's, hold SDA low for `bits` clocks of SCL."""
        bus = self._board.lcd_bus if lcd else self._board.sensor_bus
        self._board.at(at_s, lambda: bus.hang(bits))

    # In the devices

    def supply_dip(self, at_s, leaves="asleep"):
        """The sensor's supply drops for a moment. leaves: see Mpu6050.supply_dip()."""
        self._board.at(at_s, lambda: self._board.sensor.supply_dip(leaves))

    def freeze(self, at_s, for_s):
        """Freeze the sensor's data. The sensor still answers and keeps its configuration."""
        self._override(at_s, for_s, "freeze")

    def all_zero(self, at_s, for_s):
        """Make every data register read 0."""
        self._override(at_s, for_s, 0x00)

    def all_ones(self, at_s, for_s):
        """Make every data register read 0xFF."""
        self._override(at_s, for_s, 0xFF)

    def unplug_sensor(self, at_s, for_s=None):
        """Disconnect the sensor for for_s. None: until the end. The reconnected sensor starts as after power-on."""
        self._between(at_s, for_s, self._board.remove_sensor, self._board.fit_sensor)

    def unplug_lcd(self, at_s, for_s=None):
        """Disconnect the display for for_s. None: until the end. The reconnected display starts as after power-on."""
        self._between(at_s, for_s, self._board.remove_lcd, self._board.fit_lcd)

    def lcd_slip(self, at_s):
        """Shift the display's pairing of nibbles to bytes by one nibble, as a spike on its pin E does."""
        self._board.at(at_s, self._board.lcd.slip)

    def wheel_storm(self, at_s, for_s, pulses_per_s):
        """Add false pulses to the wheel contact, as an ignition cable beside its cable induces them."""

        def change(hz):
            return lambda: setattr(self._board.wheel, "noise_hz", hz)

        self._between(at_s, for_s, change(pulses_per_s), change(0))

    def busy(self, at_s, for_s, times=1):
        """Occupy the processor with other work for for_s. This happens `times` times, 30 ms apart."""

        def begin(left):
            self._board.clock.advance(to_us(for_s))
            if left > 1:
                self._board.clock.at(self._board.clock.now_us + 30_000, lambda: begin(left - 1))

        self._board.at(at_s, lambda: begin(times))

    # In the file system

    def disk_full(self, at_s, for_s):
        """Let every write to a file fail."""
        full = self._writing(lambda file, path: _failing(file, 0, OSError(errno.ENOSPC)))
        self._replaced("open", full, at_s, for_s)

    def cut_file(self, ending, length):
        """Cut the power after `length` bytes of the next file with this ending are written. Then files_cut is 1."""

        def wrap(file, path):
            if not path.endswith(ending):
                return file
            self.files_cut += 1
            return _failing(file, length, PowerOff())

        self._replace("open", self._writing(wrap))

    def file_error(self, ending, at_s, for_s):
        """Files whose name has this ending cannot be opened for reading."""
        self._files(ending, at_s, for_s, False)

    def file_empty(self, ending, at_s, for_s):
        """Files whose name has this ending read as empty, as after a power loss."""
        self._files(ending, at_s, for_s, True)

    def slow_flash(self, at_s, for_s, erase_s):
        """Erasing each flash block of a written file takes erase_s, during which the program is blocked."""
        slow = self._writing(lambda file, path: _erased(file, lambda: self._board.clock.advance(to_us(erase_s))))
        self._replaced("open", slow, at_s, for_s)

    def restore(self, *names):
        """End the faults that replace builtin functions. names: "open" for the file system, "print" for USB."""
        for name in names:
            if name in self._real:
                setattr(builtins, name, self._real.pop(name))

    def _replace(self, name, function):
        """Replace the builtin function `name`. function is called with the real function, then with its arguments."""
        self.restore(name)
        self._real[name] = real = getattr(builtins, name)
        setattr(builtins, name, lambda *arguments, **named: function(real, *arguments, **named))

    def _replaced(self, name, function, at_s, for_s):
        self._between(at_s, for_s, lambda: self._replace(name, function), lambda: self.restore(name))

    def _writing(self, wrap):
        """Return a function for _replace("open"). It passes files opened for writing through wrap(file, path)."""

        def opened(real, path, mode="r", *more, **named):
            file = real(path, mode, *more, **named)
            return wrap(file, str(path)) if "w" in mode else file

        return opened

    # On USB

    def usb_asleep(self, at_s, for_s):
        """Let the host read nothing. Each print() waits, then its text is lost."""
        self._replaced("print", lambda *_, **__: self._board.clock.advance(to_us(_STALL_S)), at_s, for_s)

    def _transfers(self, kind, address, nth, count, byte=0, mask=0):
        for bus in self._board.buses:
            first = bus.transfers.get(address, 0) + nth
            bus.faults.append(TransferFault(kind, address, first, first + count - 1, byte=byte, mask=mask))

    def _during(self, kind, address, at_s, for_s):
        for bus in self._board.buses:
            bus.faults.append(TransferFault(kind, address, 0, _FOREVER, to_us(at_s), to_us(at_s + for_s)))

    def _override(self, at_s, for_s, value):
        sensor = self._board.sensor
        self._between(at_s, for_s, lambda: sensor.override(value), lambda: sensor.override(None))

    def _between(self, at_s, for_s, begin, end):
        """Call begin() at at_s, and end() for_s later. for_s: None to never call end()."""
        self._board.at(at_s, begin)
        if for_s is not None:
            self._board.at(at_s + for_s, end)

    def _files(self, ending, at_s, for_s, empty):
        def failing(real, path, mode="r", *more, **named):
            if not str(path).endswith(ending) or "r" not in mode or "+" in mode:
                return real(path, mode, *more, **named)
            if not empty:
                raise OSError(errno.EIO)
            return io.BytesIO() if "b" in mode else io.StringIO()

        self._replaced("open", failing, at_s, for_s)


class _File:
    """A file with another method write(). Its other attributes come from the real file."""

    def __init__(self, file, write):
        self._file, self.write = file, write

    def __getattr__(self, name):
        return getattr(self._file, name)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self._file.close()


def _erased(file, erase):
    """Return a file in flash, which calls erase() whenever a write begins a new block."""
    room = 0  # free bytes in the flash block

    def write(data):
        nonlocal room
        room -= len(data)
        while room < 0:
            erase()
            room += _BLOCK
        return file.write(data)

    return _File(file, write)


def _failing(file, length, error):
    """Return a file that raises `error` after `length` bytes are written."""
    left = length

    def write(data):
        nonlocal left
        count = file.write(data[:left])
        left -= count
        if count < len(data):
            file.flush()
            raise error
        return count

    return _File(file, write)
