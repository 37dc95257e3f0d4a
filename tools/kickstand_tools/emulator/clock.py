"""The emulated chip's time as the models use it: integer microseconds, and calls that are due later."""

from collections.abc import Callable

from rp2040py.clock.clock import IClock


class EmulatedClock:
    """Takes the place of simulated_board.clock.Clock; the emulated processor's cycles drive it."""

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
