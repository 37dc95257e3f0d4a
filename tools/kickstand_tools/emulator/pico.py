"""The emulated Pico with the parts that are wired to it: for tests, bench, replay and `kickstand emulate`."""

from collections.abc import Callable
from typing import Any

from . import flash_image, image
from .board import EmulatedBoard, EmulatedClock
from .chip import Chip
from .console import QuietConsole
from .flash_memory import PowerCut
from .i2c_wires import Wires

_LEVEL = (0.0, 0.0, 1.0, 0.0, 0.0, 0.0)
_CTRL_A, _CTRL_C, _CTRL_D = b"\x01", b"\x03", b"\x04"
_PROMPT = b"raw REPL; CTRL-B to exit\r\n>"


class NotReached(Exception):
    """A condition was not met in time."""


class GuestError(Exception):
    """The code that was given to exec() raised an exception. The text is the board's traceback."""


class Pico:
    """Has no power until power_on(); `with Pico(...) as pico:` switches it on, and off at the end.

    world: as for simulator.Board; level and at rest if None.  files: what its flash holds, see flash_image.build().
    fitted: as for EmulatedBoard.  Times are emulated seconds; they continue through resets and power cycles.
    """

    def __init__(
        self, world: Callable[[float], tuple] | None = None, files: dict[str, bytes] | None = None, **fitted: Any
    ) -> None:
        self.chip = Chip(image.find())
        self.board = EmulatedBoard(EmulatedClock(self.chip.clock), world or (lambda t_s: _LEVEL), **fitted)
        pins = self.chip.rp2040.gpio
        self._wires = [Wires(bus, pins[bus.sda], pins[bus.scl]) for bus in self.board.buses]
        for bus in self.board.buses:
            self.chip.connect(bus.sda // 2 % 2, bus)
        self._button = pins[self.board.button_pin]
        self.board.button.changed = self._button_changed
        self.console = QuietConsole(self.chip.rp2040.usb_ctrl, self._received)
        self.said = bytearray()  # what the board printed
        self.heard: Callable[[bytes], None] | None = None  # called with each part of it
        self.powered = False
        self._awaited = b""
        self._raw = False  # True while its console is in the raw REPL
        self.chip.on_reset = self._reset
        self.put_files(files or {})

    def __enter__(self) -> "Pico":
        self.power_on()
        return self

    def __exit__(self, *_: object) -> None:
        self.power_off()

    # Power and time

    @property
    def time_s(self) -> float:
        """Emulated seconds since this Pico was made."""
        return self.chip.clock.nanos / 1e9

    def power_on(self) -> None:
        """Start everything from power-on."""
        self._reset()
        self.board.power_on()
        self.chip.power_on()
        self.powered = True

    def power_off(self) -> None:
        """Cut the supply; only the content of the flash is kept."""
        self.powered = False
        self.chip.power_off()
        self.board.power_off()
        self._reset()

    def power_cycle(self, off_s: float = 0.5) -> None:
        """Switch it off, and on again after off_s."""
        self.power_off()
        self.run(off_s)
        self.power_on()

    def run(self, seconds: float, between: Callable[[], None] | None = None) -> None:
        """Let time pass. A PowerCut ends it early; `powered` is then False."""
        if not self.powered:
            self.chip.sleep(seconds)
            return
        try:
            self.chip.run(seconds, between)
        except PowerCut:
            self.power_off()

    def stall(self, seconds: float) -> None:
        """Let time pass in which the processor stands still, as in a long flash operation.

        The program itself starts such an operation, never in the middle of an I2C transfer. So this waits until there
        was no transfer for a millisecond.
        """
        before = None
        while before != (begun := [dict(bus.transfers) for bus in self.board.buses]) or self._transferring():
            before = begun
            self.run(0.001)
        self.chip.sleep(seconds)

    def _transferring(self) -> bool:
        return any(bus.open for bus in self.board.buses)

    def run_until(self, condition: Callable[[], Any], limit_s: float, step_s: float = 0.005) -> Any:
        """Let time pass until condition() is true; return its value. It is called every step_s. Raises NotReached."""
        end_s = self.time_s + limit_s
        while not (reached := condition()):
            if self.time_s >= end_s:
                raise NotReached(f"not within {limit_s} s; the display says {self.lcd()}")
            self.run(step_s)
        return reached

    # What a rider sees and does

    def lcd(self) -> list[str]:
        """The two lines of the display."""
        return self.board.lcd.text()

    def press(self, at_s: float | None = None, for_s: float = 0.15) -> None:
        """Press the button at at_s (now, if None)."""
        self.board.press(at_s, for_s)

    # Parts that can be added

    def fit_wheel(self, speed: Callable[[float], float], **kind: Any) -> None:
        """Connect a wheel contact, as simulator.Board.fit_wheel() does."""
        self.board.fit_wheel(speed, **kind)
        self.board.watch_pin(self.board.wheel_pin, self._wheel_changed)

    # The flash

    @property
    def file_system(self) -> bytes:
        """The part of the flash that holds the files. It can be assigned."""
        return bytes(self.chip.rp2040.flash[flash_image.START : flash_image.START + flash_image.SIZE])

    @file_system.setter
    def file_system(self, system: bytes) -> None:
        self.chip.rp2040.flash[flash_image.START : flash_image.START + flash_image.SIZE] = system

    def put_files(self, files: dict[str, bytes]) -> None:
        """Replace the content of the file system with these files."""
        self.file_system = flash_image.build(files)

    def files(self) -> dict[str, bytes]:
        """Every file in flash, by path."""
        return flash_image.read(self.file_system)

    # The console

    def exec(self, code: str, limit_s: float = 10.0) -> str:
        """Interrupt what runs on the board, run code there as mpremote does, and return what it printed.

        Raises GuestError with the board's traceback, and NotReached if it takes longer than limit_s.
        """
        if not self._raw:
            self.run(0.1)  # until the board reads its console
            self.console.send(_CTRL_C + _CTRL_C + _CTRL_A)
            self._expect(_PROMPT, 2.0)
            self._raw = True
        del self.said[:]
        self.console.send(code.encode() + _CTRL_D)
        self._expect(_CTRL_D + b">", limit_s)
        output, error = bytes(self.said).removeprefix(b"OK").split(_CTRL_D)[:2]
        if error:
            raise GuestError(error.decode(errors="replace"))
        return output.decode(errors="replace").replace("\r\n", "\n")

    def _expect(self, ending: bytes, limit_s: float) -> None:
        self._awaited = ending
        if not self.said.endswith(ending):
            self.run(limit_s)
        self._awaited = b""
        if not self.said.endswith(ending):
            raise NotReached(f"the board's console ends with {bytes(self.said[-80:])!r}")

    def _received(self, data: bytes) -> None:
        self.said += data
        if self._awaited and self.said.endswith(self._awaited):
            self.chip.stop()
        if self.heard:
            self.heard(data)

    # The wires

    def _button_changed(self, closed: bool) -> None:
        if closed:
            self._button.set_input_value(False)
        else:
            self._button.release_input()

    def _wheel_changed(self, level: int) -> None:
        pin = self.chip.rp2040.gpio[self.board.wheel_pin]
        if level:
            pin.release_input()
        else:
            pin.set_input_value(False)

    def _reset(self) -> None:
        self._raw = False
        for wires in self._wires:
            wires.release()
