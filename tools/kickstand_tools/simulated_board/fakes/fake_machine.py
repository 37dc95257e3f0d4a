"""MicroPython's `machine` on the simulated board: what the firmware may use of it, and the ports' errors."""

import errno

from ..clock import Reset

PWRON_RESET = 1
WDT_RESET = 3  # the rp2 port also reports machine.reset() so

_CALL_US = 2
_RP2_MAX_WATCHDOG_MS = 8388
_WATCHDOG_CTRL_CLEAR = 0x40058000 + 0x3000  # RP2040: writing bit 30 here stops the watchdog
_WATCHDOG_ENABLE = 1 << 30


def use(installed):
    """Let everything here mean this simulator.Board from now on."""
    global board
    board = installed


class Pin:
    """machine.Pin: levels; interrupts of what is wired to it, which come while time passes."""

    IN, OUT, OPEN_DRAIN = 0, 1, 2
    PULL_UP, PULL_DOWN = 1, 2
    IRQ_FALLING, IRQ_RISING = 4, 8

    def __init__(self, id, mode=-1, pull=-1, value=None):
        self.id = id.id if isinstance(id, Pin) else id
        if mode != -1:
            self.init(mode, pull, value)

    def init(self, mode=-1, pull=-1, value=None):
        board.set_up_pin(self.id, mode, pull, 1 if value is None and mode == Pin.OPEN_DRAIN else value)

    def value(self, level=None):
        board.clock.advance(_CALL_US)
        if level is None:
            return board.pin_level(self.id)
        board.drive_pin(self.id, 1 if level else 0)
        return None

    def irq(self, handler=None, trigger=IRQ_FALLING | IRQ_RISING, **hard):
        if hard and board.port == "esp32":
            raise TypeError("extra keyword arguments given")

        def edge(level):
            if handler and trigger & (Pin.IRQ_RISING if level else Pin.IRQ_FALLING):
                handler(self)

        board.watch_pin(self.id, edge)

    def __call__(self, level=None):
        return self.value(level)

    def on(self):
        self.value(1)

    def off(self):
        self.value(0)


class SoftI2C:
    """machine.SoftI2C, and the common part of machine.I2C. freq in Hz, timeout in us."""

    def __init__(self, scl, sda, freq=400000, timeout=50000):
        self._bus = board.bus_on(Pin(sda).id, Pin(scl).id, freq)
        self._clock = board.clock
        self._bit_ns = 1_000_000_000 // freq
        self._ns = 0  # time spent that the clock, in us, has not seen yet
        self._timeout_us = timeout

    def readfrom_mem_into(self, addr, memaddr, buf, addrsize=8):
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
        self._start(addr, False)
        self._send(memaddr)
        for value in buf:
            self._send(value)
        self._bus.stop()

    def writeto(self, addr, buf, stop=True):
        self._start(addr, False)
        for value in buf:
            self._send(value)
        if stop:
            self._bus.stop()
        return len(buf)

    def readfrom_into(self, addr, buf, stop=True):
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
                self._clock.advance(self._timeout_us)
                raise OSError(errno.ETIMEDOUT)
            raise OSError(errno.ENODEV if board.port == "esp32" else errno.EIO)

    def _send(self, value):
        self._spend(9)
        if not self._bus.write_byte(value):
            self._bus.stop()
            raise OSError(errno.EIO)

    def _receive(self, buf):
        length = len(buf)
        try:
            self._spend(9 * length + 1)  # with the STOP
        except Reset:
            self._bus.hang()  # the device does not know, and goes on sending
            raise
        bus = self._bus  # and not bus.read_byte: under MicroPython that would allocate
        for i in range(length):
            buf[i] = bus.read_byte()


class I2C(SoftI2C):
    """machine.I2C: on rp2 only certain pins belong to a controller."""

    def __init__(self, id, scl=None, sda=None, freq=400000, timeout=50000):
        if board.port == "rp2":
            if sda is None or Pin(sda).id % 4 != 2 * id:
                raise ValueError("bad SDA pin")
            if scl is None or Pin(scl).id % 4 != 2 * id + 1:
                raise ValueError("bad SCL pin")
        super().__init__(scl, sda, freq, timeout)


class UART:
    """machine.UART, to receive. What is not read in time is lost, as on the boards."""

    def __init__(self, id, baudrate=115200, tx=None, rx=None, rxbuf=256, timeout=0):
        if board.port == "rp2":
            if tx is None or tx.id % 4 != 0 or (tx.id + 4) // 8 % 2 != id:
                raise ValueError("bad TX pin")
            if rx is None or rx.id % 4 != 1 or (rx.id + 4) // 8 % 2 != id:
                raise ValueError("bad RX pin")
        self._received = b""
        self._size = rxbuf

        def receive(data):
            self._received = (self._received + data)[: self._size]

        board.connect_uart(Pin(rx).id, baudrate, receive)

    def any(self):
        board.clock.advance(_CALL_US)
        return len(self._received)

    def read(self, nbytes):
        data = self._received[:nbytes]
        self._received = self._received[nbytes:]
        return data or None


class WDT:
    """machine.WDT. timeout in ms."""

    def __init__(self, id=0, timeout=5000):
        if board.port == "rp2" and timeout > _RP2_MAX_WATCHDOG_MS:
            raise ValueError("timeout exceeds %d" % _RP2_MAX_WATCHDOG_MS)
        board.watchdog.start(timeout * 1000)

    def feed(self):
        board.watchdog.feed()


class Timer:
    """machine.Timer: calls back from within whatever lets time pass. period in ms."""

    ONE_SHOT, PERIODIC = 0, 1

    def __init__(self, id=-1, **settings):
        self._round = 0
        if settings:
            self.init(**settings)

    def init(self, mode=PERIODIC, freq=-1, period=-1, callback=None):
        period_us = int(1000000 / freq) if freq > 0 else period * 1000
        self.deinit()
        mine, boot = self._round, board.boots

        def fire():
            if self._round != mine or board.boots != boot:
                return
            if mode == Timer.PERIODIC:
                board.clock.at(board.clock.now_us + period_us, fire)
            if callback:
                callback(self)

        board.clock.at(board.clock.now_us + period_us, fire)

    def deinit(self):
        self._round += 1


class _Mem32:
    """machine.mem32: plain words, but for the register that stops the watchdog."""

    def __init__(self):
        self._words = {}

    def __getitem__(self, address):
        return self._words.get(address, 0)

    def __setitem__(self, address, value):
        if address == _WATCHDOG_CTRL_CLEAR and value & _WATCHDOG_ENABLE:
            board.watchdog.stop()
        self._words[address] = value


mem32 = _Mem32()


def reset():
    raise Reset


def soft_reset():
    raise Reset


def reset_cause():
    return board.reset_cause


def unique_id():
    return bytes((0xE6, 0x61, 0x64, 0x08, 0x43, 0, 0, board.seed & 0xFF))


def freq(hz=None):
    return 160000000 if board.port == "esp32" else 125000000


def idle():
    board.clock.advance(_CALL_US)


def lightsleep(ms=0):
    board.clock.advance(ms * 1000)


def disable_irq():
    return 0


def enable_irq(state=0):
    pass
