"""MicroPython's machine.I2C, SoftI2C and UART on the simulated board, with the errors of the rp2 and esp32 ports."""

import errno

from ..clock import Reset
from . import chips, current
from .pins import Pin

_TICK_MS = 10  # of FreeRTOS on an ESP32
_LEGACY_MS = 100  # for each byte that the legacy driver of an ESP32 waits, and once more


class _Controller:
    """The common part of I2C and SoftI2C. freq in Hz, timeout in us."""

    _NO_DEVICE = errno.ENODEV

    def __init__(self, scl, sda, freq, timeout):
        self._bus = current.board.bus_on(Pin(sda).id, Pin(scl).id, freq)
        self._clock = current.board.clock
        self._bit_ns = 1_000_000_000 // freq
        self._ns = 0  # less than a microsecond: time that has passed but is not on the clock yet
        self._timeout_us = timeout
        self._bytes = 0  # of the transfer under way, without the address

    def readfrom_mem_into(self, addr, memaddr, buf, addrsize=8):
        self._bytes = 1 + len(buf)
        self._start(addr, False)
        self._send(memaddr)
        self._start(addr, True)
        self._receive(buf)
        self._bus.stop()

    def readfrom_mem(self, addr, memaddr, nbytes, addrsize=8):
        buf = bytearray(nbytes)
        self.readfrom_mem_into(addr, memaddr, buf)
        return bytes(buf)

    def writeto_mem(self, addr, memaddr, buf, addrsize=8):
        self._bytes = 1 + len(buf)
        self._start(addr, False)
        self._send(memaddr)
        for value in buf:
            self._send(value)
        self._bus.stop()

    def writeto(self, addr, buf, stop=True):
        self._bytes = len(buf)
        self._start(addr, False)
        for value in buf:
            self._send(value)
        if stop:
            self._bus.stop()
        return len(buf)

    def readfrom_into(self, addr, buf, stop=True):
        self._bytes = len(buf)
        self._start(addr, True)
        self._receive(buf)
        if stop:
            self._bus.stop()

    def readfrom(self, addr, nbytes, stop=True):
        buf = bytearray(nbytes)
        self.readfrom_into(addr, buf, stop)
        return bytes(buf)

    def scan(self):
        found = []
        for address in range(0x08, 0x78):
            try:
                self.writeto(address, b"")
            except OSError:
                continue
            found.append(address)
        return found

    def _spend(self, bits):
        ns = self._ns + bits * self._bit_ns
        self._ns = ns % 1000
        self._clock.advance(ns // 1000)

    def _start(self, address, read):
        self._spend(10)  # START, seven bits, R/W, ACK
        answer = self._bus.start(address, read)
        if not answer:
            self._bus.stop()
            if answer is None:
                self._stall()
            raise OSError(self._NO_DEVICE)

    def _stall(self):
        """Wait as long as the controller does for wires that are held; raises OSError."""
        self._clock.advance(self._timeout_us)
        raise OSError(errno.ETIMEDOUT)

    def _send(self, value):
        self._spend(9)
        if not self._bus.write_byte(value):
            self._bus.stop()
            raise OSError(errno.EIO)

    def _receive(self, buf):
        try:
            self._spend(9 * len(buf) + 1)  # the STOP included
        except Reset:
            self._bus.hang()  # the device does not notice the reset and goes on sending
            raise
        self._bus.read_into(buf)


def _in_one_go(method):
    """The same transfer of a SoftI2C, during which no handler of an interrupt is called."""

    def transfer(self, *arguments, **named):
        irqs = current.soft_irqs
        irqs.held = True
        try:
            return method(self, *arguments, **named)
        finally:
            irqs.release()

    return transfer


class SoftI2C(_Controller):
    """machine.SoftI2C, in software on any two pins. It does not look whether SDA is held: the clocks of a transfer let
    the device that holds it finish its byte, and the zeros that it sends meanwhile pass for answers."""

    def __init__(self, scl, sda, freq=400000, timeout=50000):
        super().__init__(scl, sda, freq, timeout)
        self._held = False

    readfrom_mem_into = _in_one_go(_Controller.readfrom_mem_into)
    writeto_mem = _in_one_go(_Controller.writeto_mem)
    writeto = _in_one_go(_Controller.writeto)
    readfrom_into = _in_one_go(_Controller.readfrom_into)

    def _start(self, address, read):
        self._held = self._bus.stuck()
        if self._held:
            self._spend(10)
            self._clock_byte()
        else:
            super()._start(address, read)

    def _send(self, value):
        if self._held:
            self._spend(9)
            self._clock_byte()
        else:
            super()._send(value)

    def _receive(self, buf):
        if not self._held:
            super()._receive(buf)
            return
        self._spend(9 * len(buf) + 1)
        for i in range(len(buf)):
            buf[i] = 0
            self._clock_byte()

    def _clock_byte(self):
        """Nine clocks; raises OSError if SDA is high at the last one, which is no acknowledgement."""
        for _ in range(9):
            self._bus.set_scl(0)
            self._bus.set_scl(1)
        if not self._bus.stuck():
            self._bus.power_off()  # STOP
            raise OSError(self._NO_DEVICE)


class I2C(_Controller):
    """machine.I2C. On rp2 each controller can use only certain pins. An ESP32 has one of two drivers, see
    MicroPython's ports/esp32/machine_i2c.c."""

    def __init__(self, id, scl=None, sda=None, freq=400000, timeout=50000):
        board = current.board
        if board.port == "rp2":
            if sda is None or Pin(sda).id % 4 != 2 * id:
                raise ValueError("bad SDA pin")
            if scl is None or Pin(scl).id % 4 != 2 * id + 1:
                raise ValueError("bad SCL pin")
        elif not 0 <= id < chips.i2c_controllers(board.machine):
            raise ValueError("I2C(%d) doesn't exist" % id)
        self._NO_DEVICE = errno.ENODEV if board.port == "esp32" else errno.EIO
        self._driver = board.i2c_driver if board.port == "esp32" else None
        super().__init__(scl, sda, freq, timeout)

    def _start(self, address, read):
        if self._driver == "new" and self._ticks() == 0:
            raise OSError(errno.ENODEV)  # IDF does not even wait for the address to be sent
        super()._start(address, read)

    def _stall(self):
        if self._driver == "legacy":  # the time-out of the constructor is not that of a transfer
            self._clock.advance(1000 * _LEGACY_MS * (1 + self._bytes))
            raise OSError(errno.ETIMEDOUT)
        if self._driver == "new":
            self._clock.advance(1000 * _TICK_MS * self._ticks())
            raise OSError(errno.ENODEV)
        super()._stall()

    def _ticks(self):
        return self._timeout_us // 1000 // _TICK_MS


class UART:
    """machine.UART, receiving only. Bytes that do not fit into rxbuf are lost, as on the boards."""

    def __init__(self, id, baudrate=115200, tx=None, rx=None, rxbuf=256, timeout=0):
        if current.board.port == "rp2":
            if tx is None or tx.id % 4 != 0 or (tx.id + 4) // 8 % 2 != id:
                raise ValueError("bad TX pin")
            if rx is None or rx.id % 4 != 1 or (rx.id + 4) // 8 % 2 != id:
                raise ValueError("bad RX pin")
        self._received = b""
        self._size = rxbuf

        def receive(data):
            self._received = (self._received + data)[: self._size]

        current.board.connect_uart(Pin(rx).id, baudrate, receive)

    def any(self):
        current.board.clock.advance(current.CALL_US)
        return len(self._received)

    def read(self, nbytes):
        data = self._received[:nbytes]
        self._received = self._received[nbytes:]
        return data or None
