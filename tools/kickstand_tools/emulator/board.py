"""The models of simulated_board on the emulated chip's clock, and its button on a pin."""

from collections.abc import Callable
from typing import Any

from rp2040py.clock.clock import IClock

from ..simulated_board.button import Button
from ..simulated_board.simulator import Board


class EmulatedClock:
    """Takes the place of simulated_board.clock.Clock: integer microseconds, driven by the processor's cycles."""

    def __init__(self, clock: IClock) -> None:
        self._clock = clock

    @property
    def now_us(self) -> int:
        """Microseconds since the emulation began."""
        return int(self._clock.nanos + 0.5) // 1000

    def at(self, due_us: float, function: Callable[[], None]) -> None:
        """Call function() at due_us; at once if that time is over."""
        self._clock.create_alarm(function).schedule(max(0.0, due_us * 1000.0 - self._clock.nanos))

    def every(self, period_us: float, function: Callable[[], None]) -> None:
        """Call function() every period_us from now on."""

        def again() -> None:
            alarm.schedule(period_us * 1000.0)
            function()

        alarm = self._clock.create_alarm(again)
        alarm.schedule(period_us * 1000.0)


class WiredButton(Button):
    """A button that calls changed(closed) when its contacts touch and when they part."""

    def __init__(self, clock: Any, seed: int) -> None:
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
    """simulator.Board for an emulated chip: its parts, faults, button and time, but not its fake `machine`.

    fitted: the arguments of Board, except port and pace.
    """

    def __init__(self, clock: Any, world: Callable[[float], tuple], **fitted: Any) -> None:
        super().__init__(world, **fitted)
        self.clock: Any = clock
        parts: list[Any] = [self.sensor, self.lcd, *self.buses]
        for part in parts:
            part.clock = clock
        self.button: Any = WiredButton(clock, self.seed)

    @property
    def button_pin(self) -> int:
        """The number of the GPIO that the button connects to ground."""
        return self._button_pin

    def power_on(self) -> None:
        """The supply of everything but the processor comes up."""
        self.sensor.power_on()
        self.lcd.power_on()

    def power_off(self) -> None:
        """The supply of everything but the processor goes down."""
        for bus in self.buses:
            bus.power_off()
        self.lcd.power_off()
