"""The process in which QEMU emulates an ESP32. QEMU's library can be started only once per process.

esp32.py starts this process:

    python -m kickstand_emulator.esp32_machine SOCKET LIBRARY FLASH SDA,SCL...

The models of sensor and display are in the process of esp32.py. The two processes exchange messages over an inherited
socket. This process converts the levels of the I2C wires to bytes, because one message per level would take too long.

The emulated time is counted in instructions, and advances only after the message GO. Three parts of QEMU would still
make the emulation depend on the host:

1. The main loop may run timers while only one processor has had its turn, or set the clock forward before both
   processors sleep. So _hold_main_loop() makes the main loop wait until both processors sleep.
2. One timer of the scheduler begins at one of two moments, by chance. So _calm_timers() postpones this timer forever.
3. The main loop executes a reset of one processor while the other processor continues. So _guard() delays a reset to
   the next full millisecond, and the processors wait for the reset. _on_reset() makes the reset wait until the
   processors' thread sleeps.
"""

import ctypes as c
import os
import socket
import struct
import sys
import threading
import time

from kickstand_sim.simulated_board.i2c import Bus

from .i2c_wires import Wires

# A command to this process consists of kind, a, b and value. A message from this process consists of the time in
# nanoseconds, kind, a and b
COMMAND, MESSAGE = struct.Struct("<BBHq"), struct.Struct("<qBBH")
GO, PIN, UART, HANG, LEVEL, SYNC = range(6)
START, WRITE, READ, STOP, PRINTED, STOPPED = range(6)

_PINS = 40
_VIRTUAL = 1  # QEMU_CLOCK_VIRTUAL
_NEVER = 1 << 62
_GUARD_NS = 1_000_000
_SHORTEST_S, _LONGEST_S = 5e-5, 1e-3  # time between two checks whether the processors sleep

_PIN_CALL = c.CFUNCTYPE(None, c.c_int, c.c_int)
_I2C_CALL = c.CFUNCTYPE(c.c_int, c.c_uint8, c.c_uint8, c.c_uint16)
_SPI_CALL = c.CFUNCTYPE(c.c_uint8, c.c_uint8, c.c_uint16)
_UART_CALL = c.CFUNCTYPE(None, c.c_uint8, c.c_uint8)
_RMT_CALL = c.CFUNCTYPE(None, c.c_uint8, c.c_uint32, c.c_uint32)
_CALL = c.CFUNCTYPE(None, c.c_void_p)
_WORK_CALL = c.CFUNCTYPE(None, c.c_void_p, c.c_void_p)


class _Callbacks(c.Structure):
    _fields_ = [
        ("write_pin", _PIN_CALL),
        ("dir_pin", _PIN_CALL),
        ("i2c", _I2C_CALL),
        ("spi", _SPI_CALL),
        ("uart_tx", _UART_CALL),
        ("pinmap", c.POINTER(c.c_short)),
        ("rmt", _RMT_CALL),
    ]


class _Timer(c.Structure):
    """QEMU's struct QEMUTimer."""


_Timer._fields_ = [
    ("expires", c.c_int64),
    ("list", c.c_void_p),
    ("call", c.c_void_p),
    ("opaque", c.c_void_p),
    ("next", c.POINTER(_Timer)),
    ("attributes", c.c_int),
    ("scale", c.c_int),
]


class _Poll(c.Structure):
    """QEMU's struct MainLoopPoll. state: 0 before the main loop waits for events."""

    _fields_ = [("state", c.c_int), ("timeout", c.c_uint32)]


_POLL_CALL = c.CFUNCTYPE(None, c.c_void_p, c.POINTER(_Poll))


class _Notifier(c.Structure):
    _fields_ = [("call", _POLL_CALL), ("next", c.c_void_p), ("previous", c.c_void_p)]


class _RemoteBus(Bus):
    """An I2C bus whose devices are in the other process. The bus only knows whether a device holds SDA."""

    def __init__(self, machine: "Machine", number: int, sda: int, scl: int) -> None:
        super().__init__(None, sda, scl)
        self._machine, self._number = machine, number

    def start(self, address: int, read: bool) -> bool:
        if self.stuck():
            return False
        self._stuck_bits = -1  # as in Bus.start()
        return bool(self._machine.ask(START, self._number, address << 1 | read))

    def write_byte(self, value: int) -> bool:
        return bool(self._machine.ask(WRITE, self._number, value))

    def read_byte(self) -> int:
        return self._machine.ask(READ, self._number)

    def stop(self) -> None:
        self._machine.tell(STOP, self._number)


class Machine:
    """The emulated chip. run() does not return.

    pins: SDA and SCL of each I2C bus.
    """

    def __init__(self, link: socket.socket, folder: str, flash: str, pins: list[tuple[int, int]]) -> None:
        self._link = link
        self._qemu = qemu = c.CDLL(f"{folder}/libqemu-xtensa.so", mode=c.RTLD_GLOBAL)
        qemu.qemu_clock_get_ns.restype = c.c_int64
        qemu.timer_mod_ns.argtypes = [c.c_void_p, c.c_int64]
        qemu.qemu_get_cpu.restype = c.c_void_p
        qemu.timer_del.argtypes = [c.c_void_p]
        qemu.all_cpu_threads_idle.restype = qemu.runstate_is_running.restype = c.c_bool
        self._folder, self._flash = folder, flash
        self._inputs: dict[int, int] = {}  # levels set from outside the chip, by pin
        # The wires of a pin's bus, and the bus's SDA and SCL, by pin
        self._wires_of: dict[int, tuple[Wires, int, int]] = {}
        self._driven = [1] * _PINS
        # Pins whose input must be corrected, because QEMU set the input to the chip's own output
        self._stale: list[int] = []
        # _may_reset is True while the processors wait for a reset, _resetting while the main loop executes it
        self._may_reset = self._resetting = False
        self._fuses: _Timer | None = None
        self._state = -1  # descriptor of the file in /proc that shows whether the processors' thread sleeps
        self._buses = [_RemoteBus(self, i, sda, scl) for i, (sda, scl) in enumerate(pins)]
        self._wires = [Wires(bus, self._setter(bus.sda), self._setter(bus.scl)) for bus in self._buses]
        for bus, wires in zip(self._buses, self._wires, strict=True):
            self._wires_of[bus.sda] = self._wires_of[bus.scl] = wires, bus.sda, bus.scl

    # Messages

    def tell(self, kind: int, a: int = 0, b: int = 0) -> None:
        now_ns = self._qemu.qemu_clock_get_ns(_VIRTUAL)
        self._link.sendall(MESSAGE.pack(now_ns, kind, a, b))

    def ask(self, kind: int, a: int = 0, b: int = 0) -> int:
        self.tell(kind, a, b)
        answer = self._link.recv(1)
        if not answer:
            os._exit(0)  # end, because the other process has ended or has cut the power
        return answer[0]

    def _receive(self, size: int) -> bytes:
        data = self._link.recv(size, socket.MSG_WAITALL)
        if len(data) < size:
            os._exit(0)
        return data

    def _stopped(self, _: object = None) -> None:
        """Execute the commands of the other process until it advances the time."""
        if self._state < 0:
            self._begun()
        self.tell(STOPPED)
        while True:
            kind, a, b, value = COMMAND.unpack(self._receive(COMMAND.size))
            if kind == GO:
                self._qemu.timer_mod_ns(c.addressof(self._stop), value)
                return
            if kind == PIN:
                self._set(a, b)
            elif kind == UART:
                self._qemu.qemu_picsimlab_uart_receive(a, self._receive(b), b)
            elif kind == HANG:
                self._buses[a].hang(b)
                self._wires[a].show()
            elif kind == LEVEL:
                self._link.sendall(bytes([self._buses[a].sda_level()]))
            elif kind == SYNC:
                self._qemu.bdrv_drain_all()
                self._link.sendall(b"\0")

    # The pins

    def _setter(self, pin: int):
        self._inputs[pin] = 1

        def set_level(level: int) -> None:
            if self._inputs[pin] != level:
                self._set(pin, level)

        return set_level

    def _set(self, pin: int, level: int) -> None:
        self._inputs[pin] = level
        if self._state >= 0:
            self._qemu.qemu_picsimlab_set_pin(pin + 1, level)

    def _write_pin(self, number: int, level: int) -> None:
        pin = number - 1
        if pin in self._wires_of and self._driven[pin] != level:
            self._driven[pin] = level
            self._stale.append(pin)
            wires, sda, scl = self._wires_of[pin]
            wires.driven(self._driven[sda], self._driven[scl])

    def _sync(self, number: int, write_out: int) -> None:
        """Correct the inputs of stale pins, when QEMU reads the inputs or sets up a pin."""
        if write_out == -1 and self._stale:
            for pin in self._stale:
                self._qemu.qemu_picsimlab_set_pin(pin + 1, self._inputs[pin])
            self._stale = []

    def _transmitted(self, uart: int, value: int) -> None:
        if uart == 0 and self.ask(PRINTED, value):
            self._qemu.timer_mod_ns(c.addressof(self._stop), self._qemu.qemu_clock_get_ns(_VIRTUAL))

    def _on_reset(self, _: object) -> None:
        """Wait until the processors' thread sleeps. Otherwise chance would decide which processor continues first.

        QEMU calls this function in its main loop during a reset, while the processors are stopped.
        """
        if self._state >= 0:
            while not self._sleeps(_SHORTEST_S):
                pass
            self._may_reset = self._resetting = False
            self._stale = list(self._inputs)
            self._guard_later()

    # Time

    def _begun(self) -> None:
        """Prepare the emulation. QEMU calls this function in the processors' thread, before the first instruction."""
        # Keep one thread state of Python. Without a kept thread state each call from QEMU would create one, which is
        # slow
        c.pythonapi.PyGILState_Ensure()
        self._state = os.open(f"/proc/self/task/{threading.get_native_id()}/stat", os.O_RDONLY)
        self._calm_timers()
        self._guard_later()
        self._stale = list(self._inputs)

    def _calm_timers(self) -> None:
        """Postpone the scheduler's timer forever, by changing its scale.

        Of QEMU's two timers of 0.1 s it is the one without an owner. The other one ends a read of the eFuses.
        """
        self._qemu.timer_mod_ns(c.addressof(self._stop), 0)
        following = self._stop.next
        while following:
            timer = following.contents
            following = timer.next
            if timer.scale == 1 and timer.expires >= 99_999_000:
                if timer.opaque:
                    self._fuses = timer
                else:
                    timer.scale = 1_000_000
                    self._qemu.timer_mod_ns(c.addressof(timer), _NEVER)
        self._qemu.timer_del(c.addressof(self._stop))

    def _hold_main_loop(self, _: object, poll) -> None:
        """Let the main loop continue only while the processors sleep or wait for a reset.

        QEMU calls this function before and after the main loop waits for an event, with QEMU's lock held.
        """
        if poll.contents.state == 0 or self._state < 0:
            return
        qemu, wait_s = self._qemu, _SHORTEST_S
        while qemu.runstate_is_running():
            if qemu.qemu_reset_requested_get() and self._may_reset:
                self._resetting = True
                # Disable the clock, because QEMU does not set a disabled clock forward. The reset enables it again
                qemu.qemu_clock_enable(_VIRTUAL, False)
                return
            idle = qemu.all_cpu_threads_idle()
            if self._sleeps(0.0 if idle else wait_s) and idle and qemu.all_cpu_threads_idle():
                return
            wait_s = min(2 * wait_s, _LONGEST_S)

    def _sleeps(self, wait_s: float) -> bool:
        """Release QEMU's lock for wait_s, take it again, and return True if the processors' thread sleeps."""
        self._qemu.qemu_mutex_unlock_iothread()
        time.sleep(wait_s)
        os.lseek(self._state, 0, os.SEEK_SET)
        sleeps = os.read(self._state, 256).rpartition(b")")[2][1:2] == b"S"
        self._qemu.qemu_mutex_lock_iothread_impl(b"kickstand", 1)
        return sleeps

    def _guard_later(self) -> None:
        now_ns = self._qemu.qemu_clock_get_ns(_VIRTUAL)
        self._qemu.timer_mod_ns(c.addressof(self._guard_timer), (now_ns // _GUARD_NS + 1) * _GUARD_NS)

    def _guard(self, _: object) -> None:
        """Start a requested reset, and end reads of the eFuses early.

        QEMU calls this function every millisecond, between two time slices of the processors. At its start the ROM
        waits for three reads of the eFuses. On a real chip the three reads take microseconds. In QEMU they take 100 ms,
        as long as the rest of the start.
        """
        now_ns = self._qemu.qemu_clock_get_ns(_VIRTUAL)
        if self._fuses and self._fuses.expires > now_ns:
            self._qemu.timer_mod_ns(c.addressof(self._fuses), now_ns)
        if not self._qemu.qemu_reset_requested_get():
            self._guard_later()
            return
        for number in (0, 1):
            self._qemu.async_run_on_cpu(c.c_void_p(self._qemu.qemu_get_cpu(number)), self._reset_call, None)

    def _await_reset(self, _cpu: object, _data: object) -> None:
        """Release QEMU's lock so that the main loop can execute a reset, and wait for the reset.

        QEMU calls this function in the processors' thread, with its lock held.
        """
        if not self._qemu.qemu_reset_requested_get():
            return
        self._may_reset = True
        self._qemu.qemu_mutex_unlock_iothread()
        while not self._resetting:
            time.sleep(_SHORTEST_S)
        self._qemu.qemu_mutex_lock_iothread_impl(b"kickstand", 1)

    def run(self) -> None:
        """Start QEMU with the callbacks of this class. The process ends with the emulation, and closes all files."""
        qemu = self._qemu
        pinmap = (c.c_short * (_PINS + 1))(_PINS, *range(_PINS))
        self._callbacks = _Callbacks(
            _PIN_CALL(self._write_pin),
            _PIN_CALL(self._sync),
            _I2C_CALL(lambda *_: 0),
            _SPI_CALL(lambda *_: 0),
            _UART_CALL(self._transmitted),
            pinmap,
            _RMT_CALL(lambda *_: None),
        )
        qemu.qemu_picsimlab_register_callbacks(c.byref(self._callbacks))
        uart = ["-serial", "file:/dev/null"]
        drive = f"file={self._flash.replace(',', ',,')},if=mtd,format=raw,cache=unsafe"
        options = ["qemu", "-L", self._folder, "-display", "none", "-monitor", "none", "-machine", "esp32-picsimlab"]
        options += ["-drive", drive, "-icount", "shift=3,sleep=off", "-seed", "1", *uart, *uart, *uart]
        qemu.qemu_init(len(options), (c.c_char_p * (len(options) + 1))(*map(os.fsencode, options), None))
        self._reset_call = _WORK_CALL(self._await_reset)
        stopped, on_reset, guard = _CALL(self._stopped), _CALL(self._on_reset), _CALL(self._guard)
        poll = _POLL_CALL(self._hold_main_loop)
        self._calls = stopped, on_reset, guard, poll  # ctypes would free a function without a reference
        self._notifier, self._stop, self._guard_timer = _Notifier(poll), _Timer(), _Timer()
        qemu.timer_init_full(c.byref(self._guard_timer), None, _VIRTUAL, 1, 0, guard, None)
        qemu.timer_init_full(c.byref(self._stop), None, _VIRTUAL, 1, 0, stopped, None)
        qemu.timer_mod_ns(c.addressof(self._stop), 1000)
        qemu.qemu_register_reset(on_reset, None)
        qemu.main_loop_poll_add_notifier(c.byref(self._notifier))
        qemu.qemu_main_loop()
        os._exit(1)


def _end(unraisable) -> None:
    """End the process after an exception in a call from QEMU. QEMU itself would ignore the exception."""
    sys.__unraisablehook__(unraisable)
    os._exit(1)


def main() -> None:
    # An exception in a call from QEMU ends this process; one cause is that the other process has ended
    sys.unraisablehook = _end
    number, folder, flash, *buses = sys.argv[1:]
    link = socket.socket(fileno=int(number))
    pairs = [(int(sda), int(scl)) for sda, scl in (bus.split(",") for bus in buses)]
    Machine(link, folder, flash, pairs).run()


if __name__ == "__main__":
    main()
