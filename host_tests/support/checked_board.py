"""`kickstand check` on the simulated board: its programs run in this process."""

import contextlib
import gc
import io
from collections.abc import Callable, Sequence
from pathlib import Path

import pytest
from kickstand_sim.simulated_board.simulator import Board
from kickstand_sim.simulation.scripted.sensor_errors import Sensor, resting
from kickstand_tools.deploy import check
from kickstand_tools.deploy.check import Finding

PRESS_S = 0.5  # time from the check's request to the press


def part(seed: int = 1, **more: float):
    """Return world(t_s) of an ordinary sensor at rest, in some orientation."""
    sensor = Sensor(seed=seed, **more)
    return resting(sensor, (0.3, -0.5, 0.8))


class CheckedBoard:
    """A simulated board on which `kickstand check` runs.

    world, fitted: see Board.
    config: settings.
    presses: [(at_s, for_s), ...]. With None the button is pressed once, when the check asks for a press.

    board: the Board. Plant a defect in it before you call findings().
    said: the messages to the rider.
    """

    def __init__(
        self,
        world: Callable | None = None,
        config: dict | None = None,
        presses: Sequence[tuple[float, float]] | None = None,
        **fitted,
    ):
        self.board = Board(world or part(), **fitted)
        self._config = type("Config", (), config or {})
        self._presses = presses
        self.said: list[str] = []
        self.free_bytes = 90_000

    def findings(self, folder: Path) -> list[Finding]:
        """Return all findings. folder: the board's flash."""
        results: list[Finding] = []
        self.run(folder, lambda ask: results.extend(check.measured(ask, self.say)))
        return results

    def say(self, text: str) -> None:
        """Called by check(): presses the button when the check asks for it."""
        self.said.append(text)
        if text.startswith("Press") and self._presses is None:
            self.board.press(self.board.clock.now_us / 1e6 + PRESS_S, 0.2)

    def run(self, folder: Path, function: Callable[[check.Ask], object]) -> None:
        """Call function(ask) while the board has power. ask(code) runs code on the board."""
        space: dict = {}
        board = self.board
        for press in self._presses or ():
            board.press(*press)

        def ask(code: str) -> str:
            out = io.StringIO()
            try:
                with contextlib.redirect_stdout(out):
                    exec(code, space)
            except Exception as error:
                raise check.GuestFailed(f"{type(error).__name__}: {error}") from error
            return out.getvalue()

        with contextlib.chdir(folder), board, pytest.MonkeyPatch.context() as patch:
            from kickstand import settings

            patch.setattr(settings, "load", lambda: settings.Settings(self._config))
            patch.setattr(gc, "mem_free", lambda: self.free_bytes, raising=False)
            assert board.run(lambda: function(ask), 1e6) == "returned"
