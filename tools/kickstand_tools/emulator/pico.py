"""The emulated Pico with all that is soldered to it: for tests, bench, replay and `kickstand emulate`."""

from collections.abc import Callable
from typing import Any

from . import flash_image, image
from .board import EmulatedBoard
from .chip import Chip
from .clock import EmulatedClock
from .flash_memory import PowerCut
from .i2c_wires import Wires
from .quiet_usb import QuietConsole

_LEVEL = (0.0, 0.0, 1.0, 0.0, 0.0, 0.0)
_CTRL_A, _CTRL_C, _CTRL_D = b"\x01", b"\x03", b"\x04"
_PROMPT = b"raw REPL; CTRL-B to exit\r\n>"


class NotReached(Exception):
    """What was waited for did not come in time."""


class GuestError(Exception):
    """The code that was given to exec() raised this traceback."""


class Pico:
    """Without power at first. with Pico(...) as pico: switches it on.

    world: as for simulator.Board; level and at rest if None.  files: what its flash holds, see flash_image.
    fitted: as for simulator.Board.  Times are emulated seconds; they go on over resets and power cycles.
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
        self.said = bytearray()  # by the board, on its console
        self.heard: Callable[[bytes], None] | None = None  # called with the same as it comes
        self.powered = False
        self._awaited = b""
        self._raw = False  # its console is at the raw prompt
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
        """A cold start of everything."""
        self._reset()
        self.board.power_on()
        self.chip.power_on()
        self.powered = True

    def power_off(self) -> None:
        """Everything but the flash is lost."""
        self.powered = False
        self.chip.power_off()
        self.board.power_off()
        self._reset()

    def power_cycle(self, off_s: float = 0.5) -> None:
        """Off, and on again."""
        self.power_off()
        self.run(off_s)
        self.power_on()

    def run(self, seconds: float, between: Callable[[], None] | None = None) -> None:
        """Let time pass. When the power goes meanwhile, powered is False after it, and it ends there."""
        if not self.powered:
            self.chip.sleep(seconds)
            return
        try:
            self.chip.run(seconds, between)
        except PowerCut:
            self.power_off()

    def stall(self, seconds: float) -> None:
        """Time passes, and the processor does nothing: as in a long flash operation. That is the program's own doing,
        so it cannot come in the middle of a transfer, which would time out: once the buses rest for a millisecond."""
        before = None
        while before != (begun := [dict(bus.transfers) for bus in self.board.buses]) or self._transferring():
            before = begun
            self.run(0.001)
        self.chip.sleep(seconds)

    def _transferring(self) -> bool:
        return any(bus.open for bus in self.board.buses)

    def run_until(self, condition: Callable[[], Any], limit_s: float, step_s: float = 0.005) -> Any:
        """Let time pass until condition() is true, looked at every step_s; what it said. Raises NotReached."""
        end_s = self.time_s + limit_s
        while not (reached := condition()):
            if self.time_s >= end_s:
                raise NotReached(f"not within {limit_s} s; the display says {self.lcd()}")
            self.run(step_s)
        return reached

    # What a rider sees and does

    def lcd(self) -> list[str]:
        """The two lines."""
        return self.board.lcd.text()

    def press(self, at_s: float | None = None, for_s: float = 0.15) -> None:
        """Press the button at at_s (now, if None)."""
        self.board.press(at_s, for_s)

    # What else can be soldered on

    def fit_wheel(self, speed: Callable[[float], float], **kind: Any) -> None:
        """A contact at a wheel on its pin, as simulator.Board.fit_wheel()."""
        self.board.fit_wheel(speed, **kind)
        self.board.watch_pin(self.board.wheel_pin, self._wheel_changed)

    # The flash

    @property
    def file_system(self) -> bytes:
        """The part of the flash that holds the files; can be set."""
        return bytes(self.chip.rp2040.flash[flash_image.START : flash_image.START + flash_image.SIZE])

    @file_system.setter
    def file_system(self, system: bytes) -> None:
        self.chip.rp2040.flash[flash_image.START : flash_image.START + flash_image.SIZE] = system

    def put_files(self, files: dict[str, bytes]) -> None:
        """Make these the only files in flash."""
        self.file_system = flash_image.build(files)

    def files(self) -> dict[str, bytes]:
        """Every file in flash, by path."""
        return flash_image.read(self.file_system)

    # The console

    def exec(self, code: str, limit_s: float = 10.0) -> str:
        """Run code on the board, as mpremote does, whatever runs there interrupted first; what it printed.

        Raises GuestError with the board's traceback, NotReached.
        """
        if not self._raw:
            self.run(0.1)  # until the board listens
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
