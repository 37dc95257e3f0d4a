"""MicroPython's `machine` on the board that was installed last.

It has the parts that the firmware may use, with the errors of the rp2 and esp32 ports.
"""

import errno

from ..clock import Reset
from . import chips

CALL_US = 2  # duration of a call into `machine`, without which a loop that waits for a pin would never end
IRQ_US = 26  # duration of an interrupt without its calls into `machine` and `time`. With these calls it is 33 us

PWRON_RESET = 1
WDT_RESET = 3  # the rp2 port reports this cause also after machine.reset()

_TICK_MS = 10  # tick of FreeRTOS on an ESP32
_LEGACY_MS = 100  # time-out of an ESP32's legacy driver per byte, added once more at the end of a transfer
_SPI_CALL_US = 20  # duration of a call into machine.SPI, including the driver's Python code
_RP2_MAX_WATCHDOG_MS = 8388
_ESP32_TICKS = 4  # ticks per millisecond of the second stage of an ESP32's watchdog, counted in 32 bits (ESP-IDF)
_WATCHDOG_CTRL_CLEAR = 0x40058000 + 0x3000  # RP2040: writing bit 30 here stops the watchdog
_WATCHDOG_ENABLE = 1 << 30


def use(installed):
    """Make all calls act on this simulator.Board."""
    global board, soft_irqs
    board = installed
    soft_irqs = Irqs(board.clock, Irqs.SCHEDULED)


class Pin:
    """machine.Pin, with interrupts from the part wired to the pin. Handlers run while the simulated time advances."""

    IN, OUT, OPEN_DRAIN = 0, 1, 2
    PULL_UP, PULL_DOWN = 1, 2
    IRQ_FALLING, IRQ_RISING = 4, 8

    def __init__(self, id, mode=-1, pull=-1, value=None):
        self.id = id.id if isinstance(id, Pin) else id
        if self.id is None and board.port == "rp2":
            raise TypeError("can't convert NoneType to int")
        if self.id not in board.pins:
            raise ValueError("invalid pin")
        if mode != -1:
            self.init(mode, pull, value)

    def init(self, mode=-1, pull=-1, value=None):
        machine = board.machine
        if self.id in chips.flash_pins(machine):
            board.clock.reset()  # the program crashes, because its next instruction cannot be read
        if self.id in chips.inputs_only(machine):
            if mode in (Pin.OUT, Pin.OPEN_DRAIN):
                raise ValueError("pin can only be input")
            pull = -1
        board.set_up_pin(self.id, mode, pull, 1 if value is None and mode == Pin.OPEN_DRAIN else value)

    def value(self, level=None):
        board.clock.advance(CALL_US)
        if level is None:
            return board.pin_level(self.id)
        board.drive_pin(self.id, 1 if level else 0)
        return None

    def irq(self, handler=None, trigger=IRQ_FALLING | IRQ_RISING, **hard):
        if hard and board.port == "esp32":
            raise TypeError("extra keyword arguments given")
        self._handler = handler
        irqs = soft_irqs if board.port == "esp32" else Irqs(board.clock, 1)

        def edge(level):
            if trigger & (Pin.IRQ_RISING if level else Pin.IRQ_FALLING):
                irqs.add(self)

        board.watch_pin(self.id, edge if handler else None)

    def handle(self):
        """Call the interrupt's handler."""
        if self._handler:
            self._handler(self)
            board.clock.advance(IRQ_US)

    def __call__(self, level=None):
        return self.value(level)

    def on(self):
        self.value(1)

    def off(self):
        self.value(0)


class Irqs:
    """Interrupts that wait while a handler runs. If the queue is full, further interrupts are lost.

    An RP2040 keeps one more edge of a pin. On an ESP32, MicroPython calls the handlers of all pins between two steps of
    the program. A transfer of SoftI2C is one step. During the transfer interrupts wait in the scheduler's queue.

    clock: a Clock.
    held: True during a transfer of SoftI2C.
    """

    SCHEDULED = 8  # the depth of MicroPython's queue

    def __init__(self, clock, depth):
        self.held = False
        self._clock = clock
        self._depth = depth
        self._queue = []
        self._running = False

    def add(self, pin):
        """Handle an edge, or keep it while a handler runs."""
        if len(self._queue) < self._depth:
            self._queue.append(pin)
        self._run()

    def release(self):
        """Handle the waiting interrupts after a transfer."""
        self.held = False
        self._clock.at(self._clock.now_us, self._run)

    def _run(self):
        while self._queue and not self.held and not self._running:
            pin = self._queue.pop(0)
            self._running = True
            try:
                pin.handle()
            finally:
                self._running = False


class _Controller:
    """The base of I2C and SoftI2C. freq in Hz, timeout in us."""

    _NO_DEVICE = errno.ENODEV

    def __init__(self, scl, sda, freq, timeout):
        self._bus = board.bus_on(Pin(sda).id, Pin(scl).id, freq)
        self._clock = board.clock
        self._bit_ns = 1_000_000_000 // freq
        self._ns = 0  # elapsed time of less than one microsecond that is not yet added to the clock
        self._timeout_us = timeout
        self._bytes = 0  # number of bytes in the current transfer, without the address byte

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
        self.writeto(addr, bytes([memaddr]) + bytes(buf))

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
        addresses = []
        for address in range(0x08, 0x78):
            try:
                self.writeto(address, b"")
            except OSError:
                continue
            addresses.append(address)
        return addresses

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
        """Wait for the controller's time-out, because the wires are held, then raise OSError."""
        self._clock.advance(self._timeout_us)
        raise OSError(errno.ETIMEDOUT)

    def _send(self, value):
        self._spend(9)
        if not self._bus.write_byte(value):
            self._bus.stop()
            raise OSError(errno.EIO)

    def _receive(self, buf):
        try:
            self._spend(9 * len(buf) + 1)  # including the STOP
        except Reset:
            self._bus.hang()  # the device does not notice the controller's reset and continues to send
            raise
        self._bus.read_into(buf)


def _in_one_go(method):
    """Wrap a transfer of SoftI2C, so that no interrupt handler runs during it."""

    def transfer(self, *arguments, **named):
        soft_irqs.held = True
        try:
            return method(self, *arguments, **named)
        finally:
            soft_irqs.release()

    return transfer


class SoftI2C(_Controller):
    """machine.SoftI2C, in software on any two pins. It does not check whether a device holds SDA. A device that holds
    SDA finishes its byte during the clocks of the next transfer. The zeros that it sends look like answers."""

    def __init__(self, scl, sda, freq=400000, timeout=50000):
        super().__init__(scl, sda, freq, timeout)
        self._held = False

    readfrom_mem_into = _in_one_go(_Controller.readfrom_mem_into)
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
        """Send nine clocks. Raises OSError if SDA is high at the ninth clock, which means no acknowledgement."""
        for _ in range(9):
            self._bus.set_scl(0)
            self._bus.set_scl(1)
        if not self._bus.stuck():
            self._bus.power_off()  # STOP
            raise OSError(self._NO_DEVICE)


class I2C(_Controller):
    """machine.I2C. On rp2, each controller works only with certain pins. MicroPython for the ESP32 has a new and a
    legacy driver, see its ports/esp32/machine_i2c.c."""

    def __init__(self, id, scl=None, sda=None, freq=400000, timeout=50000):
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
            raise OSError(errno.ENODEV)  # ESP-IDF fails before the address is sent
        super()._start(address, read)

    def _stall(self):
        if self._driver == "legacy":  # this driver ignores the constructor's time-out in transfers
            self._clock.advance(1000 * _LEGACY_MS * (1 + self._bytes))
            raise OSError(errno.ETIMEDOUT)
        if self._driver == "new":
            self._clock.advance(1000 * _TICK_MS * self._ticks())
            raise OSError(errno.ENODEV)
        super()._stall()

    def _ticks(self):
        return self._timeout_us // 1000 // _TICK_MS


class ADC:
    """machine.ADC. It measures the voltage of the pin in the board's `volts`."""

    def __init__(self, pin):
        self._number = pin.id if isinstance(pin, Pin) else pin

    def read_u16(self):
        board.clock.advance(CALL_US)
        return min(65535, int(board.volts.get(self._number, 0.0) / 3.3 * 65535))


class UART:
    """machine.UART. If rxbuf is full, further bytes are lost, as on real boards."""

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
        board.clock.advance(CALL_US)
        return len(self._received)

    def write(self, data):
        board.clock.advance(CALL_US)
        board.sent += data.encode() if isinstance(data, str) else data

    def read(self, nbytes):
        data = self._received[:nbytes]
        self._received = self._received[nbytes:]
        return data or None


class SPI:
    """machine.SPI, connected to the simulated board's SD card."""

    def __init__(self, id, baudrate=1_000_000, sck=None, mosi=None, miso=None, **mode):
        self.init(baudrate)

    def init(self, baudrate=1_000_000, **mode):
        self._hz = baudrate
        card = board.card
        if card:
            card.most_hz = max(card.most_hz, baudrate)

    def write(self, buf):
        self._exchange(buf)

    def read(self, count, write=0x00):
        return self._exchange(bytes([write]) * count)

    def readinto(self, buf, write=0x00):
        buf[:] = self._exchange(bytes([write]) * len(buf))

    def write_readinto(self, out, buf):
        buf[:] = self._exchange(bytes(out))

    def _exchange(self, data):
        board.clock.advance(_SPI_CALL_US + 8 * len(data) * 1_000_000 // self._hz)
        card = board.card
        return card.exchange(data) if card else b"\xff" * len(data)


class WDT:
    """machine.WDT. timeout in ms."""

    def __init__(self, id=0, timeout=5000):
        if board.port == "rp2" and timeout > _RP2_MAX_WATCHDOG_MS:
            raise ValueError("timeout exceeds %d" % _RP2_MAX_WATCHDOG_MS)
        if board.port == "esp32":
            timeout = (timeout * _ESP32_TICKS & 0xFFFFFFFF) // _ESP32_TICKS
        board.watchdog.start(timeout * 1000)

    def feed(self):
        board.watchdog.feed()


class Timer:
    """machine.Timer. Its callback runs in the call that advances the time. period in ms."""

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
    """machine.mem32, which stores words. Only one register has a function. It stops the watchdog."""

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
    board.clock.reset()


def reset_cause():
    return board.reset_cause


def freq(hz=None):
    """Return the processor's clock, or set it. A classic ESP32 has 240, 160 and 80 MHz."""
    if hz is not None:
        if hz not in (80_000_000, 160_000_000, 240_000_000):
            raise ValueError("frequency must be 20MHz, 40MHz, 80Mhz, 160MHz or 240MHz")
        board.processor_hz = hz
    return board.processor_hz
