"""The board's models on the emulated chip's clock, and its button on a pin."""

from collections.abc import Callable
from typing import Any

from ..simulated_board.button import Button
from ..simulated_board.simulator import Board
from .clock import EmulatedClock


class WiredButton(Button):
    """A button that tells when its contacts touch and part."""

    def __init__(self, clock: EmulatedClock, seed: int) -> None:
        self.changed: Callable[[bool], None] | None = None
        super().__init__(clock, seed)

    @property
    def closed(self) -> bool:
        """True while the contacts touch."""
        return self._closed

    @closed.setter
    def closed(self, closed: bool) -> None:
        self._closed = closed
        if self.changed:
            self.changed(closed)


class EmulatedBoard(Board):
    """simulator.Board without its fake `machine`: parts, faults, button, time, for an emulated chip.

    fitted: as for Board, but for port and pace.
    """

    def __init__(self, clock: EmulatedClock, world: Callable[[float], tuple], **fitted: Any) -> None:
        super().__init__(world, **fitted)
        self.clock: Any = clock
        parts: list[Any] = [self.sensor, self.lcd, *self.buses]
        for part in parts:
            part.clock = clock
        self.button: Any = WiredButton(clock, self.seed)

    @property
    def button_pin(self) -> int:
        """The GPIO that the button connects to ground."""
        return self._button_pin

    def power_on(self) -> None:
        """The supply comes up at everything but the processor."""
        self.sensor.power_on()
        self.lcd.power_on()

    def power_off(self) -> None:
        """And goes."""
        for bus in self.buses:
            bus.power_off()
        self.lcd.power_off()
