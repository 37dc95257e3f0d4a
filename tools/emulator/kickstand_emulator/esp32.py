"""Emulates an ESP32 with the parts that are wired to it, for tests, bench and `kickstand emulate`.

QEMU runs in a separate process, esp32_machine.py. The models of the parts run in this process. Power-on starts the
QEMU process, and power-off kills it. Emulated time is an estimate: each instruction of either processor takes eight
nanoseconds, and the flash takes no time. The times of a real ESP32 also depend on its cache and its flash.
"""

import contextlib
import shutil
import socket
import subprocess
import sys
import tempfile
import weakref
from collections.abc import Callable
from pathlib import Path
from typing import Any

from kickstand_sim.simulated_board.clock import Clock, to_us
from kickstand_tools.deploy import firmware_files

from . import esp32_machine as machine, flash_image, image
from .device import EmulatedDevice

_IMAGE_AT, _FLASH_SIZE = 0x1000, 4 << 20
_ROM_STARTS = b"ets Jul 29 2019"  # the first text that the chip's ROM prints
_READY = b">>> ", b"Ctrl-C stops it."  # the board prints one of these texts when MicroPython accepts input
_BOOT_S = 5.0
_CHUNK = 64  # number of bytes that are sent to the console at once, half of the chip's FIFO
_CHUNK_US = 10 * _CHUNK * 1_000_000 // 115_200
_CONSOLE, _GPS = 0, 2  # numbers of the UARTs
_WRITES, _WRITTEN = b"\x01", b"\x02"  # begin and end of the output of Sink.write()
_MEMORY = Path("/dev/shm")


class Stopped(Exception):
    """QEMU has ended unexpectedly."""


class Esp32(EmulatedDevice):
    """An emulated ESP32. See EmulatedDevice."""

    NAME, FLASH, MPY = "ESP32", flash_image.ESP32, firmware_files.ESP32
    # The code uses the console, because registers such as those of host_link.py cannot be added to QEMU
    SINK = """
from binascii import hexlify
class Sink:
    def write(self, data):
        print("\\x01", end="")
        for i in range(0, len(data), 64):
            print(hexlify(data[i : i + 64]).decode(), end="")
        print("\\x02", end="")
"""

    def __init__(
        self, world: Callable[[float], tuple] | None = None, files: dict[str, bytes] | None = None, **fitted: Any
    ) -> None:
        self._folder = image.find_esp32()
        self.clock = Clock()
        super().__init__(self.clock, world, port="esp32", **fitted)
        directory = tempfile.mkdtemp(dir=_MEMORY if _MEMORY.is_dir() else None)
        weakref.finalize(self, shutil.rmtree, directory, ignore_errors=True)
        self._flash = Path(directory, "flash")
        self._process: subprocess.Popen | None = None
        self._link = socket.socket()
        self._begun_us = 0  # time of power-on
        self._end_us = 0  # time at which run() returns
        self._waiting = bytearray()  # data that wait to be sent to the board's console
        self._sending = False
        # _booted is True once the ROM has started. _reads is True once the program reads the console
        self._booted = self._reads = False
        self._device_sends = [False] * len(self.board.buses)  # for each bus, True if the addressed device sends bytes
        self._levels = {self.board.button_pin: 1}
        for number, bus in enumerate(self.board.buses):
            self._route_wires(number, bus)
        content = b"\xff" * _IMAGE_AT + (self._folder / image.ESP32_NAME).read_bytes()
        self._flash.write_bytes(content.ljust(_FLASH_SIZE, b"\xff"))
        self.put_files(files or {})

    # Power and time

    @property
    def time_s(self) -> float:
        return self.clock.now_us / 1e6

    def power_on(self) -> None:
        self.board.power_on()
        self._start()

    def power_off(self) -> None:
        self._kill()
        self.board.power_off()

    @property
    def reading(self) -> bool:
        return self.board.sensor_bus.open and self._device_sends[0]

    def reset(self) -> None:
        """Reset the chip, as its EN button does. A device that was sending does not notice, and holds SDA low."""
        interrupted = [bus for bus, sends in zip(self.board.buses, self._device_sends) if bus.open and sends]
        self._kill()
        for bus in self.board.buses:
            bus.stop()
        self._start()
        for bus in interrupted:
            bus.hang()
        self.resets += 1

    def _start(self) -> None:
        """Start the process of the chip, and wait until it is ready."""
        self._begun_us, self.powered = self.clock.now_us, True
        self._raw = self._booted = self._reads = False
        self._waiting.clear()
        self._link.close()
        self._link, its = socket.socketpair()
        wires = [f"{bus.sda},{bus.scl}" for bus in self.board.buses]
        arguments = [str(its.fileno()), str(self._folder), str(self._flash), *wires]
        command = [sys.executable, "-m", "kickstand_emulator.esp32_machine", *arguments]
        nowhere = subprocess.DEVNULL
        self._said = tempfile.TemporaryFile()
        self._process = subprocess.Popen(
            command, pass_fds=[its.fileno()], stdin=nowhere, stdout=nowhere, stderr=self._said
        )
        its.close()
        self._serve()
        for pin, level in self._levels.items():
            self._command(machine.PIN, pin, level)

    def _kill(self) -> None:
        if self._process:
            if self._process.poll() is None:
                self._sync()  # store the writes to the flash that the board has completed
            self._process.kill()
            self._process.wait()
            self._link.close()
            self._said.close()
        self._process, self.powered, self._raw = None, False, False

    def run(self, seconds: float, between: Callable[[], None] | None = None) -> None:
        """Run for some seconds of the board. between: called at least every 5 ms of the board."""
        self._end_us = self.clock.now_us + to_us(seconds)
        while self.clock.now_us < self._end_us:
            if not self.powered:
                self.clock.advance(self._end_us - self.clock.now_us)
                return
            due_us = max(self.clock.now_us, min(self._end_us, self.clock.next_us))
            if between:
                due_us = min(due_us, self.clock.now_us + 5000)
            self._command(machine.GO, value=(due_us - self._begun_us) * 1000)
            self._serve()
            self.clock.advance(0)
            if between:
                between()

    def stop(self) -> None:
        self._end_us = self.clock.now_us

    # Messages (see esp32_machine.py)

    def _command(self, kind: int, a: int = 0, b: int = 0, value: int = 0) -> None:
        with contextlib.suppress(OSError):  # OSError is ignored, because _serve() reports that QEMU has ended
            self._link.sendall(machine.COMMAND.pack(kind, a, b, value))

    def _serve(self) -> None:
        """Answer the messages of the other process until it has stopped. Raises Stopped if it has ended."""
        receive, answer, buses, size = self._link.recv, self._link.sendall, self.board.buses, machine.MESSAGE.size
        while True:
            message = receive(size, socket.MSG_WAITALL)
            if len(message) < size:
                raise Stopped(f"QEMU has ended: {self._last_output()}")
            now_ns, kind, a, b = machine.MESSAGE.unpack(message)
            self.clock.now_us = self._begun_us + now_ns // 1000
            if kind == machine.READ:
                answer(bytes([buses[a].read_byte()]))
            elif kind == machine.WRITE:
                answer(b"\1" if buses[a].write_byte(b) else b"\0")
            elif kind == machine.START:
                self._device_sends[a] = bool(b & 1)
                answer(b"\1" if buses[a].start(b >> 1, bool(b & 1)) else b"\0")
            elif kind == machine.STOP:
                buses[a].stop()
            elif kind == machine.PRINTED:
                # What listens to the output may call stop(), which sets _end_us
                self._end_us, end_us = 1 << 60, self._end_us
                self._received(bytes([a]))
                stop, self._end_us = self._end_us < 1 << 60, min(end_us, self._end_us)
                answer(b"\1" if stop else b"\0")
            elif kind == machine.STOPPED:
                return

    def _last_output(self) -> str:
        self._said.seek(0)
        output = self._said.read().decode(errors="replace").strip()
        return output.rpartition("\n")[2] or "it said nothing"

    def _sync(self) -> None:
        self._command(machine.SYNC)
        self._link.recv(1)

    # The console

    def listen(self, sink: Callable[[bytes], Any]) -> None:
        text = bytearray()

        def hear(data: bytes) -> None:
            text.extend(data)
            while _WRITTEN in text:
                written, _, text[:] = bytes(text).partition(_WRITTEN)
                sink(bytes.fromhex(written.rpartition(_WRITES)[2].decode()))

        self.heard = hear

    def send(self, data: bytes) -> None:
        self._waiting += data
        if not self._sending:
            self._sending = True
            self.clock.at(self.clock.now_us, self._send_chunk)

    def _send_chunk(self) -> None:
        chunk = bytes(self._waiting[:_CHUNK])
        del self._waiting[:_CHUNK]
        if chunk and self.powered:
            self._command(machine.UART, _CONSOLE, len(chunk))
            self._link.sendall(chunk)
        self._sending = bool(self._waiting)
        if self._sending:
            self.clock.at(self.clock.now_us + _CHUNK_US, self._send_chunk)

    def _received(self, data: bytes) -> None:
        super()._received(data)
        self._reads = self._reads or self.said.endswith(_READY)
        if data == _ROM_STARTS[-1:] and self.said.endswith(_ROM_STARTS):
            self.resets += self._booted
            self._booted, self._raw, self._reads = True, False, False

    def _until_it_reads(self) -> None:
        self.run_until(lambda: self._reads, _BOOT_S)
        super()._until_it_reads()

    # Optional parts

    def fit_gps(self, speed: Callable[[float], float], **kind: Any) -> None:
        self.board.fit_gps(speed, **kind)
        gps: Any = self.board.gps
        gps.connect(self._gps_sends)

    def _gps_sends(self, data: bytes) -> None:
        if self.powered:
            self._command(machine.UART, _GPS, len(data))
            self._link.sendall(bytes(data))

    def _set_pin(self, number: int, level: int) -> None:
        self._levels[number] = level
        if self.powered:
            self._command(machine.PIN, number, level)

    def _route_wires(self, number: int, bus: Any) -> None:
        """Route the methods hang() and sda_level() of a bus to the QEMU process, because it emulates the wires."""

        def hang(bits: int = 8) -> None:  # bits: clocks during which the device still holds SDA low, see Bus.hang()
            bus.stop()
            self._command(machine.HANG, number, bits)

        def sda_level() -> int:
            self._command(machine.LEVEL, number)
            return self._link.recv(1)[0]

        bus.hang, bus.sda_level = hang, sda_level

    # The flash

    @property
    def file_system(self) -> bytes:
        if self.powered:
            self._sync()
        with self._flash.open("rb") as flash:
            flash.seek(self.FLASH.start)
            return flash.read(self.FLASH.size)

    @file_system.setter
    def file_system(self, system: bytes) -> None:
        assert not self.powered, "QEMU has a copy of the flash"
        with self._flash.open("r+b") as flash:
            flash.seek(self.FLASH.start)
            flash.write(system)
