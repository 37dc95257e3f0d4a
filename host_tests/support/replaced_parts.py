"""An app whose parts are replaced by objects that record the calls."""

from types import SimpleNamespace
from typing import Any

from kickstand_tools.simulated_board.simulator import Board

from .board_access import level


class Calls(list):
    """A list of (name, arguments) of all calls of its parts."""

    def part(self, name, **given) -> Any:
        """Return a part of the app. The methods of the part, other than `given`, add their calls to this list."""
        calls = self

        class Part:
            def __getattr__(self, method):
                if method.startswith("__"):
                    raise AttributeError(method)
                return lambda *arguments: calls.append((f"{name}.{method}", *arguments))

        part = Part()
        for key, value in given.items():
            setattr(part, key, value)
        return part

    def of(self, name):
        """Return the arguments of each call of this name."""
        return [call[1:] for call in self if call[0] == name]


def run_app(use, **config):
    """Run use(app, calls, board) on a board at rest, with replaced parts, and return its result.

    app.samples is the number of new samples in each pass of the loop, at first 0. config: values of config.py.
    """
    with Board(level) as board:
        from kickstand import app as module, devices
        from kickstand.settings import Settings

        settings = Settings(SimpleNamespace(**config))

        def program():
            app: Any = module.App(settings, devices.open_lcd(settings), devices.open_sensor(settings))
            calls = replace_parts(app)
            found.append(use(app, calls, board))

        found = []
        assert board.run(program, 60.0) == "returned"
    return found[0]


def replace_parts(app: Any):
    """Replace the parts of an App. Return the Calls of the new parts."""
    calls = Calls()
    axes = SimpleNamespace(notice=None, shaken=lambda: ([1, 2, 3], 0.25))
    chip = calls.part("chip", sums=[7] * 7, counts=[8] * 7, frames_left=0, axes=axes)
    chip.least_free_samples = lambda: 33
    app.sensor = calls.part("sensor", chip=chip, clipped=0, restarts=0, fault=None, fetch=lambda now_ms: app.samples)
    app.samples = 0
    app.meter, app.calibration = calls.part("meter"), calls.part("calibration")
    app.lcd = calls.part("lcd", draws=False)
    app.button = calls.part("button", poll=lambda now_ms: None)
    app.clock = calls.part("clock", step=lambda n, now_us: 5000 * n)
    pages = SimpleNamespace(late=None, draws=None, trusted=True)
    app.screen = calls.part("screen", pages=pages, menu=None, wizard=None, lines=lambda now_ms: ("one", "two"))
    recorder = calls.part("recorder", active=False, stalled=False, take_problem=lambda: None)
    app.rides = calls.part("rides", recorder=recorder, on_card=False, start_due=lambda: None)
    return calls


def ms_after(board, ms):
    board.clock.advance(1000 * ms)
