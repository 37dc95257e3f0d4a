"""The base class of the emulated boards: power, time, console, and the parts that are wired to the board."""

from abc import ABC, abstractmethod
from collections.abc import Callable
from functools import partial
from typing import Any

from kickstand_sim.simulated_board.simulator import Board

from .flash_image import FileSystem

_LEVEL = (0.0, 0.0, 1.0, 0.0, 0.0, 0.0)
_CTRL_A, _CTRL_B, _CTRL_C, _CTRL_D = b"\x01", b"\x02", b"\x03", b"\x04"
_PROMPT = b"raw REPL; CTRL-B to exit\r\n>"


class NotReached(Exception):
    """A condition was not met in time."""


class GuestError(Exception):
    """The code passed to exec() raised an exception. The text is the board's traceback."""


class EmulatedDevice(ABC):
    """An emulated board, which is off until power_on(). A `with` statement switches it on, and off at its end.

    Times are emulated seconds, which continue through resets and power cycles.

    The subclasses take these arguments:
        world: The board's motion, as for simulator.Board. None means that the board lies level and at rest.
        files: The content of the board's flash, see flash_image.py.
        fitted: Other arguments of simulator.Board.
    """

    NAME: str  # name of the board
    FLASH: FileSystem  # location of the file system in its flash
    MPY: int  # version of the bytecode that the board accepts, see firmware_files.py
    # Code for the board that defines a class Sink. Sink.write() passes bytes to the function given to listen().
    SINK: str

    def __init__(self, clock: Any, world: Callable[[float], tuple] | None, **fitted: Any) -> None:
        self.board = board = Board(world or (lambda t_s: _LEVEL), clock=clock, **fitted)
        self.said = bytearray()  # the board's output
        self.heard: Callable[[bytes], None] | None = None  # function that is called with each part of the output
        self.powered = False
        self.resets = 0  # number of resets since the start, not counting power cycles
        self._awaited = b""
        self._raw = False  # True while the console is at MicroPython's raw prompt
        self._wire(board.button_pin)

    def __enter__(self):
        self.power_on()
        return self

    def __exit__(self, *_: object) -> None:
        self.power_off()

    # Power and time

    @property
    @abstractmethod
    def time_s(self) -> float:
        """The emulated time since the object was created, in s."""

    @abstractmethod
    def power_on(self) -> None:
        """Switch on the power of the chip and of all parts."""

    @abstractmethod
    def power_off(self) -> None:
        """Cut the power. Only the content of the flash is kept."""

    @abstractmethod
    def run(self, seconds: float, between: Callable[[], None] | None = None) -> None:
        """Advance the time. between: function that is called every few ms of the host's time."""

    @abstractmethod
    def stop(self) -> None:
        """End run() now."""

    @property
    @abstractmethod
    def reading(self) -> bool:
        """True while the sensor sends data over I2C."""

    @abstractmethod
    def reset(self) -> None:
        """Reset the chip, while sensor and display keep their power."""

    @abstractmethod
    def _set_pin(self, number: int, level: int) -> None:
        """Set the level of this GPIO from outside. 0 pulls it to ground, 1 releases it."""

    def _wire(self, number: int) -> None:
        """Wire this GPIO to the part that simulator.Board connects to it."""
        self.board.watch_pin(number, partial(self._set_pin, number))

    def fit_wheel(self, speed: Callable[[float], float], **kind: Any) -> None:
        self.board.fit_wheel(speed, **kind)
        self._wire(self.board.wheel_pin)

    def power_cycle(self, off_s: float = 0.5) -> None:
        self.power_off()
        self.run(off_s)
        self.power_on()

    def run_until(self, condition: Callable[[], Any], limit_s: float, step_s: float = 0.005) -> Any:
        """Advance the time until condition() is true, and return its value. It is called every step_s seconds.

        Raises NotReached after limit_s seconds.
        """
        end_s = self.time_s + limit_s
        while not (reached := condition()):
            if self.time_s >= end_s:
                raise NotReached(f"not within {limit_s} s; the display says {self.lcd()}")
            self.run(step_s)
        return reached

    # The display and the button

    def lcd(self) -> list[str]:
        return self.board.lcd.text()

    def press(self, at_s: float | None = None, for_s: float = 0.15) -> None:
        """Press the button, see simulator.Board."""
        self.board.press(at_s, for_s)

    # The flash

    @property
    @abstractmethod
    def file_system(self) -> bytes:
        """The part of the flash that holds the files. It can be assigned."""

    @file_system.setter
    @abstractmethod
    def file_system(self, system: bytes) -> None: ...

    def put_files(self, files: dict[str, bytes]) -> None:
        self.file_system = self.FLASH.build(files)

    def files(self) -> dict[str, bytes]:
        return self.FLASH.read(self.file_system)

    # The console

    @abstractmethod
    def listen(self, sink: Callable[[bytes], Any]) -> None:
        """Call sink() with the bytes that the board's code passes to Sink.write() from now on."""

    @abstractmethod
    def send(self, data: bytes) -> None:
        """Send data to the board's console as fast as the board accepts data."""

    def exec(self, code: str, limit_s: float = 10.0) -> str:
        """Interrupt the board's program, run code as mpremote does, and return its output.

        Raises GuestError with the board's traceback, and NotReached if the code runs longer than limit_s.
        """
        if not self._raw:
            self._until_it_reads()
            self.send(_CTRL_C + _CTRL_C + _CTRL_A)
            self._expect(_PROMPT, 2.0)
            self._raw = True
        del self.said[:]
        self.send(code.encode() + _CTRL_D)
        self._expect(_CTRL_D + b">", limit_s)
        output, error = bytes(self.said).removeprefix(b"OK").split(_CTRL_D)[:2]
        if error:
            raise GuestError(error.decode(errors="replace"))
        return output.decode(errors="replace").replace("\r\n", "\n")

    def _until_it_reads(self) -> None:
        self.run(0.1)

    def soft_reset(self) -> None:
        self.send(_CTRL_B + _CTRL_D)
        self._raw = False

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
            self.stop()
        if self.heard:
            self.heard(data)
