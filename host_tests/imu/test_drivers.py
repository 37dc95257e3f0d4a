"""Tests the drivers one at a time: transfers on the bus, and the events of the button."""

import re
import textwrap

import pytest
from kickstand_tools.simulated_board.simulator import Board


@pytest.fixture
def board():
    made = Board(lambda t_s: (0.25, -0.5, 1.0, 10.0, -20.0, 30.0, 30.0))
    made.install()
    yield made
    made.uninstall()


def on(board, function):
    """Run a function on the board and return its result."""
    result = []
    assert board.run(lambda: result.append(function()), 1000) == "returned"
    return result[0]


def sensor_i2c():
    from kickstand.board import i2c_bus

    return i2c_bus.open_i2c(0, 4, 5, 400_000)


def test_the_example_in_the_drivers_docstring_runs(board, capsys):
    """The example runs for a second. The example prints the chip's name and temperature, then about 200 samples."""
    from kickstand.imu import mpu6050

    example = re.search(r"\n\n((?:    .*\n|\n)+)", mpu6050.__doc__ or "")
    assert example
    assert board.run(lambda: exec(textwrap.dedent(example[1]), {}), 1.3) == "off"
    first, *samples = capsys.readouterr().out.splitlines()
    assert first.startswith("MPU6050 30.")
    assert 190 < len(samples) < 260
    assert samples[-1] == "[0.25, -0.5, 1.0] g"


def test_a_stuck_bus_is_freed_and_a_dead_one_is_reported(board):
    """A device that stopped in the middle of a byte needs up to nine clock pulses (NXP UM10204, 3.1.16)."""
    from kickstand.board import i2c_bus

    def freed(bits):
        board.sensor_bus.hang(bits)
        return i2c_bus.free(4, 5)

    for bits in (1, 8, 9):
        assert on(board, lambda bits=bits: freed(bits))
    assert not on(board, lambda: freed(1000))
    with pytest.raises(OSError, match="SDA is held low"):
        on(board, sensor_i2c)


@pytest.mark.parametrize(
    ("held_s", "events"),
    [(0.005, []), (0.013, []), (0.1, ["short"]), (0.7, ["short"]), (1.0, ["long"]), (5.0, ["long"])],
)
def test_presses(board, held_s, events):
    from time import sleep_ms, ticks_ms  # pyright: ignore[reportAttributeAccessIssue]

    from kickstand.board.button import LONG, SHORT, Button
    from machine import Pin  # pyright: ignore[reportMissingImports]

    def run():
        button = Button(Pin(15, Pin.IN, Pin.PULL_UP))
        got = []
        board.press(0.5, held_s)
        for _ in range(700):
            event = button.poll(ticks_ms())
            if event:
                got.append({SHORT: "short", LONG: "long"}[event])
            sleep_ms(10)
        return got

    assert on(board, run) == events


def test_ctrl_c_stops_the_watchdog(board, monkeypatch, capsys, tmp_path):
    """After Ctrl-C nothing feeds the watchdog. A watchdog that keeps running could reset the board while files are
    being copied, and the installation would be incomplete."""
    from kickstand import app, start

    monkeypatch.chdir(tmp_path)
    calls = []

    def interrupted(self):
        calls.append(1)
        if len(calls) == 50:
            raise KeyboardInterrupt

    monkeypatch.setattr(app.App, "turn", interrupted)

    def use_the_console():
        from time import sleep_ms  # pyright: ignore[reportAttributeAccessIssue]

        start.main()
        sleep_ms(20_000)

    assert board.run(use_the_console, 100) == "returned"
    assert "stopped" in capsys.readouterr().out


def test_a_second_ctrl_c_leaves_the_watchdog_stopped(board, monkeypatch, tmp_path):
    from kickstand import app, devices
    from kickstand.rides.recorder import Recorder
    from kickstand.settings import Settings

    monkeypatch.chdir(tmp_path)
    ended = []

    def interrupted(self):
        if self.recording:
            raise KeyboardInterrupt
        turn(self)

    def interrupted_again(self):
        if self.active:
            ended.append(True)
            raise KeyboardInterrupt

    turn = app.App.turn
    monkeypatch.setattr(app.App, "turn", interrupted)
    monkeypatch.setattr(Recorder, "stop", interrupted_again)

    def use_the_console():
        from time import sleep_ms  # pyright: ignore[reportAttributeAccessIssue]

        settings = Settings(type("Config", (), {"RECORD": True}))
        with pytest.raises(KeyboardInterrupt):
            app.App(settings, devices.open_lcd(settings), devices.open_sensor(settings)).run()
        sleep_ms(20_000)

    assert board.run(use_the_console, 100) == "returned"
    assert ended


def test_status_reports_on_the_board(board, monkeypatch, capsys, tmp_path):
    import gc
    import os

    import kickstand

    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(gc, "mem_free", lambda: 150_000, raising=False)
    monkeypatch.setattr(os, "statvfs", lambda path: (4096, 4096, 300, 200))
    on(board, kickstand.status)
    report = capsys.readouterr().out
    assert "MPU6050 (0x68), +-16 g, +-500 deg/s" in report
    assert "Reading      0.250 -0.500 1.000 g" in report
    assert "at 0x27" in report
    assert "six positions: no, aligned: no; not calibrated" in report
    board.remove_sensor()
    on(board, kickstand.status)
    assert "none answers on SDA 4, SCL 5" in capsys.readouterr().out
