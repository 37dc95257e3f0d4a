"""Each driver alone: what it sends on the bus, what it takes of the heap, what the button makes of presses."""

import itertools
import json
import re
import subprocess
import textwrap

import pytest
from kickstand_tools import unix_port
from kickstand_tools.simulated_board.simulator import Board

needs_micropython = pytest.mark.skipif(not unix_port.available(), reason="no MicroPython unix port for this system")

HEAP_SCRIPT = """
import json, sys
from kickstand_tools.simulated_board.simulator import Board

Board(lambda t: (0, 0, 1, 0, 0, 0, 25)).install()  # for machine and time
import micropython
from kickstand.imu.mpu6050 import Mpu6050

class Wire:
    "An I2C that allocates nothing itself."
    def readfrom_mem_into(self, address, register, buffer):
        for i in range(len(buffer)):
            buffer[i] = 0x9F - 13 * i

chip = Mpu6050(Wire())
chip.read()
micropython.heap_lock()
try:
    chip.read()
    grew = False
except MemoryError:
    grew = True
micropython.heap_unlock()
print(json.dumps([grew, list(chip.counts)]))
"""


@needs_micropython
def test_a_sample_takes_no_heap(tmp_path):
    script = tmp_path / "heap.py"
    script.write_text(HEAP_SCRIPT)
    done = subprocess.run(
        unix_port.command(str(script)),
        capture_output=True,
        text=True,
        env=unix_port.environment(),
        check=True,
    )
    grew, counts = json.loads(done.stdout)
    assert not grew
    burst = [0x9F - 13 * i for i in range(14)]
    words = [burst[2 * i] << 8 | burst[2 * i + 1] & 0xFF for i in range(7)]
    assert counts == [((word + 0x8000) & 0xFFFF) - 0x8000 for word in words]


@pytest.fixture
def board():
    made = Board(lambda t_s: (0.25, -0.5, 1.0, 10.0, -20.0, 30.0, 30.0))
    made.install()
    yield made
    made.uninstall()


def on(board, function):
    """Run a function on the board and give back what it returned."""
    result = []
    assert board.run(lambda: result.append(function()), 1000) == "returned"
    return result[0]


def sensor_i2c():
    from kickstand.board import i2c_bus

    return i2c_bus.open_i2c(0, 4, 5, 400_000)


@pytest.mark.parametrize("accel_range", [2, 4, 8, 16])
@pytest.mark.parametrize("gyro_range", [250, 500, 1000, 2000])
def test_every_range_reads_in_units(board, accel_range, gyro_range):
    from kickstand.imu.mpu6050 import Mpu6050

    def read():
        chip = Mpu6050(sensor_i2c(), accel_range_g=accel_range, gyro_range_dps=gyro_range)
        chip.setup()
        chip.read()
        accel = [count / chip.accel_lsb_per_g for count in chip.counts[:3]]
        return accel, [c / chip.gyro_lsb_per_dps for c in chip.counts[4:]], chip.temperature_c(chip.counts[3])

    accel, gyro, temperature = on(board, read)
    assert accel == pytest.approx([0.25, -0.5, 1.0], abs=1e-3)
    assert gyro == pytest.approx([10, -20, 30], abs=0.1)
    assert temperature == pytest.approx(30, abs=0.1)


def test_the_example_in_the_drivers_docstring_runs(board, capsys):
    """For a second: its name and temperature, then 200 samples, give or take those of the start and the end."""
    from kickstand.imu import mpu6050

    example = re.search(r"\n\n((?:    .*\n|\n)+)", mpu6050.__doc__ or "")
    assert example
    assert board.run(lambda: exec(textwrap.dedent(example[1]), {}), 1.3) == "off"
    first, *samples = capsys.readouterr().out.splitlines()
    assert first.startswith("MPU6050 30.")
    assert 190 < len(samples) < 260
    assert samples[-1] == "[0.25, -0.5, 1.0] g"


def test_setup_fails_when_the_configuration_does_not_stay(board):
    from kickstand.imu.mpu6050 import Mpu6050

    board.faults.corrupt(0x68, nth=5, byte=1, mask=0x04, read=False)  # WHO_AM_I twice, reset, clock, SMPLRT_DIV
    with pytest.raises(OSError, match="read back"):
        on(board, lambda: Mpu6050(sensor_i2c()).setup())


def test_a_stuck_bus_is_freed_and_a_dead_one_is_reported(board):
    """A device that was left in the middle of a byte needs up to nine clocks (NXP UM10204, 3.1.16)."""
    from kickstand.board import i2c_bus

    def freed(bits):
        board.sensor_bus.hang(bits)
        return i2c_bus.free(4, 5)

    for bits in (1, 8, 9):
        assert on(board, lambda bits=bits: freed(bits))
    assert not on(board, lambda: freed(1000))
    with pytest.raises(OSError, match="SDA is held low"):
        on(board, sensor_i2c)


def test_a_pause_that_overflows_the_fifo_is_not_taken_for_silence(board):
    """Also when the pause came after the turn of the loop had read the clock."""
    from time import sleep_ms, ticks_ms  # pyright: ignore[reportAttributeAccessIssue]

    from kickstand.imu.mpu6050 import Mpu6050
    from kickstand.imu.sensor import Sensor

    def pause():
        sensor = Sensor(Mpu6050(None), sensor_i2c)
        while not sensor.fetch(ticks_ms()):
            sleep_ms(5)
        begun_ms = ticks_ms()
        sleep_ms(450)
        for now_ms in (begun_ms, ticks_ms()):
            assert sensor.fetch(now_ms) == 0
        return sensor.chip.overflows, sensor.fault

    assert on(board, pause) == (1, None)


def display():
    from kickstand.board import i2c_bus
    from kickstand.board.hd44780 import Lcd

    return Lcd(lambda: i2c_bus.open_i2c(1, 6, 7, 100_000))


def test_only_changed_lines_are_sent(board):
    """Each takes three transfers: one asks whether the display has kept its power, one writes dashes, one the line."""
    from time import sleep_ms, ticks_ms  # pyright: ignore[reportAttributeAccessIssue]

    def run():
        lcd = display()
        lcd.show("first", "second")
        lcd.flush()
        counts = [board.lcd_bus.transfers[0x27]]
        for line1, line2 in (("first", "second"), ("first", "third"), ("a", "b")):
            lcd.show(line1, line2)
            for _ in range(8):  # under 0.2 s in all: then it is asked whether it is still there
                sleep_ms(6)
                lcd.tick(ticks_ms())
            counts.append(board.lcd_bus.transfers[0x27])
        return [after - before for before, after in itertools.pairwise(counts)]

    assert on(board, run) == [0, 3, 6]
    assert board.lcd.text() == ["a" + " " * 15, "b" + " " * 15]


def test_only_what_has_changed_of_a_line_is_sent(board):
    """That takes four bytes a character, and four for its place; twice, if it is more than one character."""
    from time import sleep_ms, ticks_ms  # pyright: ignore[reportAttributeAccessIssue]

    sent = []

    def run():
        lcd = display()
        lcd.show("Lean  23\xdf right", "")
        lcd.flush()
        original = board.lcd.write_byte
        board.lcd.write_byte = lambda value: sent.append(value) or original(value)
        lcd.show("Lean  24\xdf right", "")
        sleep_ms(6)
        lcd.tick(ticks_ms())
        assert len(sent) == 4 * 2
        lcd.show("Lean   4\xdf left", "")
        sleep_ms(6)
        lcd.tick(ticks_ms())

    on(board, run)
    assert len(sent) == 8 + 2 * 4 * (1 + 9)
    assert board.lcd.text()[0] == "Lean   4\xb0 left  "


@pytest.mark.parametrize("gap_s", [0.001, 0.1])
@pytest.mark.parametrize("ticks", [3, 8, 12, 20])  # during its initialisation, and after
@pytest.mark.parametrize("then", ["Lean  12\xdf", "Lean  13\xdf"])
def test_a_display_that_lost_its_power_for_a_moment_is_started_again(board, gap_s, ticks, then):
    """Even if no transfer failed in that moment: the PCF8574's pins are high after power-up, where E had been low. Also
    if what is sent next is a text or a step of the initialisation, which makes E low again."""
    from time import sleep_ms, ticks_ms  # pyright: ignore[reportAttributeAccessIssue]

    def run():
        lcd = display()
        lcd.show("Lean  12\xdf", "")
        for _ in range(ticks):
            lcd.tick(ticks_ms())
            sleep_ms(10)
        board.remove_lcd()
        board.at(board.clock.now_us / 1e6 + gap_s, board.fit_lcd)
        sleep_ms(round(gap_s * 1000) + 1)
        assert board.lcd.text()[0].strip() == ""
        lcd.show(then, "")
        for _ in range(50):
            lcd.tick(ticks_ms())
            sleep_ms(10)

    on(board, run)
    assert board.lcd.text()[0] == then.replace("\xdf", "\xb0") + "       "


@pytest.mark.parametrize("byte", range(1, 130, 3))
def test_a_line_that_breaks_off_is_no_reading(board, byte):
    """Half of the new lean beside half of the old one could pass for a third. It is written again within 0.4 s."""
    from time import sleep_ms, ticks_ms  # pyright: ignore[reportAttributeAccessIssue]

    old, new = "Lean  19° right ", "Lean  28° left  "
    seen = set()

    def run():
        lcd = display()
        lcd.show(old.replace("°", "\xdf"), "")
        lcd.flush()
        board.faults.cut(0x27, 0.0, byte)
        lcd.show(new.replace("°", "\xdf"), "")
        for _ in range(40):
            lcd.tick(ticks_ms())
            sleep_ms(10)
            seen.add(board.lcd.text()[0])

    on(board, run)
    assert board.lcd.text()[0] == new
    assert all(line in (old, new) or "-" in line[:14] for line in seen), seen


def test_a_display_out_of_step_is_put_right_by_the_next_initialisation(board):
    from time import sleep_ms, ticks_ms  # pyright: ignore[reportAttributeAccessIssue]

    def run():
        lcd = display()
        lcd.show("Lean  12\xdf", "")
        lcd.flush()
        board.lcd.slip()
        lcd.show("Lean  13\xdf", "")
        garbled = None
        for _ in range(1100):
            lcd.tick(ticks_ms())
            sleep_ms(10)
            garbled = garbled or board.lcd.text()[0].startswith("Lean  13") is False
        return garbled

    assert on(board, run)
    assert board.lcd.text()[0] == "Lean  13°       "


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


def test_ctrl_c_puts_the_watchdog_to_rest(board, monkeypatch, capsys, tmp_path):
    """After Ctrl-C nothing feeds it, and a board that resets in the middle of a copy could not be deployed to."""
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


def test_a_second_ctrl_c_while_the_ride_is_being_ended_leaves_the_watchdog_at_rest(board, monkeypatch, tmp_path):
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


def test_status_tells_how_the_board_is(board, monkeypatch, capsys, tmp_path):
    import gc
    import os

    import kickstand

    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(gc, "mem_free", lambda: 150_000, raising=False)
    monkeypatch.setattr(os, "statvfs", lambda path: (4096, 4096, 300, 200))
    on(board, kickstand.status)
    report = capsys.readouterr().out
    assert "MPU6050 (0x68), +-8 g, +-500 deg/s" in report
    assert "Reading      0.250 -0.500 1.000 g" in report
    assert "at 0x27" in report
    assert "six positions: no, aligned: no; not calibrated" in report
    board.remove_sensor()
    on(board, kickstand.status)
    assert "none answers on SDA 4, SCL 5" in capsys.readouterr().out


@pytest.mark.parametrize("off", [-0.01, 0.0, 0.01])
def test_the_sample_clock_keeps_to_the_time_that_passes(board, off):
    """The chip's clock is 1 % off and samples come two or three at a time. All dt together are the time that passed."""
    from kickstand.imu.sample_clock import SampleClock

    clock, total_us, taken = SampleClock(5000), 0, 0
    for now_us in range(0, 20_000_000, 10_000):
        n = int(now_us * (1 + off)) // 5000 - taken
        taken += n
        if n:
            total_us += clock.step(n, now_us)
        clock.emptied(now_us)
    assert total_us == pytest.approx(20_000_000, abs=25_000)


def test_the_sample_clock_spans_a_gap(board):
    """After an overflow the next dt is as long as the gap."""
    from kickstand.imu.sample_clock import SampleClock

    clock = SampleClock(5000)
    for now_us in range(0, 1_000_000, 10_000):
        clock.step(2, now_us)
        clock.emptied(now_us)
    clock.emptied(1_700_000)  # nothing but an overflow
    clock.emptied(1_710_000)
    assert clock.step(2, 1_720_000) == pytest.approx(1_720_000 - 990_000, abs=10_000)
    clock.emptied(1_720_000)
    assert clock.step(2, 1_730_000) == pytest.approx(10_000, abs=1_000)
