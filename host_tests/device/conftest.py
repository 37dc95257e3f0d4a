"""Runs the whole device in the directory of a test, and prints its status."""

import io
from contextlib import redirect_stdout

import pytest
from kickstand_sim.simulated_board.simulator import Board
from kickstand_tools.deploy import status as board_status
from support import device_plans, device_runs
from support.board_access import rough


@pytest.fixture
def aligned(tmp_path):
    """Return a flash with the alignment of a perfect sensor."""
    device_plans.align(tmp_path)
    return tmp_path


@pytest.fixture
def run(tmp_path, capsys):
    """Return run(plan, engine, fit), which runs a plan in tmp_path and returns its Record. See device_plans.run().

    The chip takes 100 samples per second, because half the samples take half the time.
    """

    def run(plan, engine="cpython", fit=None):
        if plan.get("config", {}) is not None:
            plan = {**plan, "config": {"SAMPLE_HZ": 100, **plan.get("config", {})}}
        return device_plans.run(engine, tmp_path, plan, capsys, fit)

    return run


def ctrl_c():
    raise KeyboardInterrupt


@pytest.fixture
def status(tmp_path):
    """Return status(config, fit, world, **fitted), which returns the lines of `kickstand status`.

    fit(board): changes the board before power-on. wirings: True to also show the wirings of a display. ride_s: time for
    which the firmware runs before. fitted: arguments of Board.
    """

    def lines(config=None, fit=None, world=rough, wirings=False, ride_s=0, **fitted):
        with (
            device_runs.FreshFirmware(),  # so that an earlier run of the app is forgotten
            device_plans.on_flash(tmp_path),
            Board(world, **fitted) as board,
            redirect_stdout(io.StringIO()) as out,
        ):
            import kickstand
            from kickstand import start

            if fit:
                fit(board)
            device_runs.write_config(config or {})
            if ride_s:
                board.at(ride_s, ctrl_c)
                assert board.run(start.main, ride_s + 1) == "returned"
            assert board.run(kickstand.status, ride_s + 60.0) == "returned"
            if wirings:
                assert board.run(lambda: exec(board_status.WIRINGS), ride_s + 120.0) == "returned"
        return board_status.words(out.getvalue()).splitlines()

    return lines


@pytest.fixture
def on_board(tmp_path):
    """Return on_board(use, config, **fitted), which returns use(board, settings) on a board with these settings."""

    def on_board(use, config=None, world=rough, **fitted):
        results = []
        with device_plans.on_flash(tmp_path), Board(world, **fitted) as board:
            from kickstand.settings import Settings

            settings = Settings(type("Config", (), config or {}))
            assert board.run(lambda: results.append(use(board, settings)), 1e6) == "returned"
        return results[0]

    return on_board


@pytest.fixture
def with_app(on_board):
    """Return with_app(use, config, **fitted), which returns use(board, app). The App's loop does not run."""

    def with_app(use, config=None, **fitted):
        def built(board, settings):
            from kickstand.app import App

            return use(board, App(settings, settings.open_lcd(), settings.open_sensor()))

        return on_board(built, config, **fitted)

    return with_app
